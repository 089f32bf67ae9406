var Ws=Object.defineProperty;var Gs=(n,t)=>{for(var e in t)Ws(n,e,{get:t[e],enumerable:!0})};import*as Xr from"./three.webgpu.js";var ie={};Gs(ie,{ATH:()=>ht,ATHForest:()=>Dt,ATHLimbs:()=>Pt,ATHLoader:()=>Y,ATHMotion:()=>et,ATHPlantMaterial:()=>Rt,MOTION_PARS:()=>Mt,dataTexture:()=>at,injectMotion:()=>I,limbDepth:()=>ze,limbGeometry:()=>At,limbMaterial:()=>Ot,motionUniforms:()=>tt,radii:()=>K,setRadii:()=>lt,upright:()=>V});import{Box3 as wi,Group as bi,LineBasicMaterial as yi,LineSegments as vi,Loader as xi,Mesh as _i,MeshStandardMaterial as Mi,EventDispatcher as Ei,DoubleSide as Si,LoaderUtils as Ti,Object3D as Ai,Vector3 as ke}from"./three.webgpu.js";import{Box3 as Zt,DataTexture as ai,EventDispatcher as hi,FloatType as li,MathUtils as Pe,NearestFilter as ci,RGBAFormat as ui,Sphere as Re,Vector3 as Et}from"./three.webgpu.js";import{BufferAttribute as W,BufferGeometry as Me,InstancedBufferAttribute as $s,ShapeUtils as qs,Vector2 as Ys,Vector3 as nt}from"./three.webgpu.js";function $t(n,{array:t,columns:e=0,counts:s=null}){let i=new Float64Array(n.length),o=s?s.length:t.length/e,r=[0,0,0];for(let a=0,h=0;a<o;a++){let l=s?Number(s[a]):e,c=[0,0,0];for(let u=1;u+1<l;u++)Vs(c,n,3*Number(t[h]),3*Number(t[h+u]),3*Number(t[h+u+1]));for(let u=h;u<h+l;u++)for(let f=0;f<3;f++)i[3*Number(t[u])+f]+=c[f];h+=l}for(let a=0;a<i.length;a++)r[a%3]+=3*n[a]/i.length;for(let a=0;a<i.length;a+=3){let h=i[a]||i[a+1]||i[a+2];for(let c=0;!h&&c<3;c++)i[a+c]=n[a+c]-r[c]||1e-9;let l=Math.hypot(i[a],i[a+1],i[a+2]);for(let c=0;c<3;c++)i[a+c]/=l}return Float32Array.from(i)}function Vs(n,t,e,s,i){let o=t[s]-t[e],r=t[s+1]-t[e+1],a=t[s+2]-t[e+2],h=t[i]-t[e],l=t[i+1]-t[e+1],c=t[i+2]-t[e+2];n[0]+=r*c-a*l,n[1]+=a*h-o*c,n[2]+=o*l-r*h}function qt(n,t){let{face_vertex_counts:e,face_vertex_indices:s}=t;return n.faces?n.faces:e&&s?{array:Uint32Array.from(s.array,Number),counts:e.array}:null}function V(n,{up_axis:t}){return t==="z"&&(n.rotation.x=-Math.PI/2),t==="x"&&(n.rotation.z=Math.PI/2),n}function vt(n,{metadata:t,origin:e}){return V(n,t).position.fromArray(e).applyEuler(n.rotation),n}function $(n,t,e,s){let i=n.getAttribute(t),o=n.isInstancedBufferGeometry?$s:W;i?.array.length!==e.length?n.setAttribute(t,new o(e,s)):Object.assign(i,{array:e,needsUpdate:!0})}function Ee(n,t){let{rest:e,statics:{metadata:s}}=n,i=s.domains??{},o=[i.uv,i.normals,i.colors].includes("corner"),r=o?t.array:Uint32Array.from({length:e.length/3},(h,l)=>l),a=Ae(e,r);return a.setIndex(new W(Xs(e,t,o),1)),Object.assign(a.userData,{corners:o,faces:t}),Ks(a,$t(e,t)),a}function Se(n,t){let{rest:e}=n,s=Ae(e,Uint32Array.from({length:e.length/3},(i,o)=>o));return s.setIndex(new W(t,1)),s}function Te(n,t){let{source:e,other:s,faces:i}=n.userData,o=s?[["rest",e,t],["restOther",s,t]]:[["position",e,t]];i&&o.push(["normal",e,$t(t,i)]);for(let[r,a,h]of o){let l=n.getAttribute(r);q(l.array,h,a,3),l.needsUpdate=!0}}var yt=class extends W{#t;#e=()=>null;follow(t,e){return this.#t=t,this.#e=e,this}getComponent(t,e){let s=this.#e();return s?s[3*this.#t[t]+e]:super.getComponent(t,e)}getX(t){return this.getComponent(t,0)}getY(t){return this.getComponent(t,1)}getZ(t){return this.getComponent(t,2)}};function Ae(n,t){let e=new Me,s=new Float32Array(3*t.length);return q(s,n,t,3),e.setAttribute("position",new W(s,3)),e.userData.source=t,e}function q(n,t,e,s){for(let i=0;i<e.length;i++)for(let o=0;o<s;o++)n[s*i+o]=Number(t[s*e[i]+o]);return n}function Ks(n,t){let{source:e}=n.userData;n.setAttribute("normal",new W(q(new Float32Array(3*e.length),t,e,3),3))}function Yt(n,t,e){let s=t.statics.metadata.domains??{};for(let[i,o,r]of[["uv","uv",[2]],["normals","normal",[3]],["colors","color",[3,4]]]){let a=e[i],h=a?.shape.at(-1);if(!a||a.shape.length!==2||!r.includes(h))continue;let{source:l,corners:c}=n.userData,u=s[i]==="corner",f=a.shape[0],d=u?l.length:t.rest.length/3;if(f!==d||u&&!c)continue;let m=a.array instanceof Uint8Array?1/255:1,p=u?Uint32Array.from({length:f},(x,b)=>b):l,y=q(new Float32Array(h*l.length),a.array,p,h).map(x=>x*m);$(n,o,y,h),i==="normals"&&(n.userData.faces=null)}}function Xs(n,{array:t,columns:e=0,counts:s=null},i){let o=[],r=s?s.length:t.length/e;for(let a=0,h=0;a<r;a++){let l=s?Number(s[a]):e;for(let[c,u,f]of Zs(n,t,h,l))o.push(...[c,u,f].map(d=>i?h+d:Number(t[h+d])));h+=l}return Uint32Array.from(o)}function Zs(n,t,e,s){if(s<3)return[];if(s===3)return[[0,1,2]];let i=Array.from({length:s},(o,r)=>new nt().fromArray(n,3*Number(t[e+r])));return s===4?i[0].distanceToSquared(i[2])<=i[1].distanceToSquared(i[3])?[[0,1,2],[0,2,3]]:[[0,1,3],[1,2,3]]:Js(i)??Array.from({length:s-2},(o,r)=>[0,r+1,r+2])}function Js(n){let t=new nt,e=new nt,s=new nt;if(n.forEach((o,r)=>t.add(new nt().crossVectors(o,n[(r+1)%n.length]))),t.lengthSq()===0)return null;t.normalize(),e.set(Math.abs(t.x)>.9?0:1,Math.abs(t.x)>.9?1:0,0).cross(t).normalize(),s.crossVectors(t,e);let i=qs.triangulateShape(n.map(o=>new Ys(o.dot(e),o.dot(s))),[]);return i.length>0?i:null}function Q(n,t,e,s){let{source:i}=n.userData,o=n.index.array,r=!n.getAttribute("normal"),a=new Map,h=r?2:3,l=[],c=new Set,u=f=>{let d=3*i[f],m=y=>Math.floor(t[d+y]/e)&4095,p=((s[i[f]]+1&65535)*4096+m(0))*16777216+m(1)*4096+m(2);return a.has(p)||a.set(p,f),a.get(p)};for(let f=0;f<o.length;f+=h){let d=Array.from(o.subarray(f,f+h),u),[m,p,y]=d;if(m===p||!r&&(p===y||y===m))continue;let[x,b,w]=[...d].sort((M,g)=>M-g),v=r?x*2**26+b:`${x},${b},${w}`;c.has(v)||(c.add(v),l.push(...d))}return l.length===0&&l.push(...o.subarray(0,h)),Qs(n,Uint32Array.from(l))}function Qs(n,t){let e=Uint32Array.from(new Set(t)).sort(),s=new Map(Array.from(e,(o,r)=>[o,r])),i=new Me;for(let[o,{array:r,itemSize:a}]of Object.entries(n.attributes))i.setAttribute(o,new W(q(new r.constructor(a*e.length),r,e,a),a));return i.setIndex(new W(t.map(o=>s.get(o)),1)),i.userData.source=e.map(o=>n.userData.source[o]),i}import{MeshDepthMaterial as ti,MeshDistanceMaterial as ei,RGBADepthPacking as si,Vector2 as ii}from"./three.webgpu.js";var Oe=`
attribute float athPart;
uniform highp sampler2D athData;
uniform float athStride;
#ifdef ATH_FOREST
uniform vec2 athForest;
attribute vec4 athPlace;
attribute vec4 athTurn;
attribute vec4 athLook;
varying vec3 athTint;
#endif
#ifdef ATH_FADING
attribute float athPartBefore;
attribute vec4 athFading;
uniform highp sampler2D athDataBefore;
uniform vec2 athBefore;
bool athIsBefore=false;
#endif
vec4 athTexel(int at){
ivec2 place=ivec2(at & 1023,at>>10);
#ifdef ATH_FADING
if (athIsBefore) return texelFetch(athDataBefore,place,0);
#endif
return texelFetch(athData,place,0);
}
#ifdef ATH_FOREST
vec4 athAt(int at){
vec2 frames=athTurn.zw;
int size=int(athForest.x);
#ifdef ATH_FADING
if (athIsBefore){
frames=athFading.xy;
size=int(athBefore.x);
}
#endif
return mix(athTexel(int(frames.x)*size+at),athTexel(int(frames.y)*size+at),fract(frames.x));
}
vec3 athSpin(vec3 p){
return athForest.y>.5?vec3(athTurn.x*p.x - athTurn.y*p.y,athTurn.y*p.x+athTurn.x*p.y,p.z)
:vec3(athTurn.x*p.x+athTurn.y*p.z,p.y,athTurn.x*p.z - athTurn.y*p.x);
}
#else
vec4 athAt(int at){return athTexel(at);}
#endif
vec3 athShown(vec3 p,float part){
int at=int(abs(part)) - 1;
if (part<.0) return athAt(at).xyz;
vec4 q=vec4(p,1.);
return vec3(dot(athAt(at),q),dot(athAt(at+1),q),dot(athAt(at+2),q));
}
vec3 athMoved(vec3 rest,float part){
vec3 p=athShown(rest,part);
#ifdef ATH_FADING
athIsBefore=true;
p=mix(p,athShown(rest,athPartBefore),athFading.z);
athIsBefore=false;
#endif
#ifdef ATH_FOREST
p=athSpin(rest+athLook.x*(p - rest))*athPlace.w+athPlace.xyz;
athTint=athLook.yzw;
#endif
return p;
}
vec3 athFacing(vec3 n,float part,float stride){
int at=int(abs(part)) - 1;
if (part>.0){
vec3 a=athAt(at).xyz,b=athAt(at+1).xyz,c=athAt(at+2).xyz;
n=vec3(dot(cross(b,c),n),dot(cross(c,a),n),dot(cross(a,b),n));
}else if (stride>1.5){
vec4 q=normalize(athAt(at+1));
n=n+2.*cross(q.xyz,cross(q.xyz,n)+q.w*n);
}
return n;
}
vec3 athTurned(vec3 normal,float part){
vec3 n=athFacing(normal,part,athStride);
#ifdef ATH_FADING
athIsBefore=true;
n=mix(n,athFacing(normal,athPartBefore,athBefore.y),athFading.z);
athIsBefore=false;
#endif
#ifdef ATH_FOREST
n=athSpin(normal+athLook.x*(n - normal));
#endif
return n;
}
`,oi=`
vec3 transformed=athMoved(position,athPart);
#ifdef USE_ALPHAHASH
vPosition=vec3(position);
#endif
`,ri=`
vec3 objectNormal=athTurned(normal,athPart);
#ifdef USE_TANGENT
vec3 objectTangent=vec3(tangent.xyz);
#endif
`,ni=`
#include <color_fragment>
diffuseColor.rgb*=athTint;
`,xt=new WeakMap;function I(n,t,e=!1){let s=xt.get(n);if(s===t)return n;if(xt.set(n,t),s)return n.dispose(),n;let i=[...e?["ATH_FOREST"]:[],...t.athBefore?["ATH_FADING"]:[]],{onBeforeCompile:o,customProgramCacheKey:r}=n,a=`ath ${i} ${n.customProgramCacheKey()}`;return n.onBeforeCompile=(h,l)=>{o.call(n,h,l),Object.assign(h.uniforms,xt.get(n)),h.vertexShader=`${i.map(c=>`#define ${c}
`).join("")}${h.vertexShader}`.replace("#include <common>",`#include <common>
${Oe}`).replace("#include <begin_vertex>",oi).replace("#include <beginnormal_vertex>",ri),e&&h.fragmentShader?.includes("#include <color_fragment>")&&(h.fragmentShader=`varying vec3 athTint;
${h.fragmentShader.replace("#include <color_fragment>",ni)}`)},n.customProgramCacheKey=()=>a,n.clone=()=>{let h=Object.getPrototypeOf(n).clone.call(n);return I(Object.assign(h,{onBeforeCompile:o,customProgramCacheKey:r}),xt.get(n),e)},n.needsUpdate=!0,n}function _t(n,t=!1){return{customDepthMaterial:I(new ti({depthPacking:si}),n,t),customDistanceMaterial:I(new ei,n,t)}}var Mt=Oe;function tt(){return{athData:{value:null},athStride:{value:1},athForest:{value:new ii}}}var Kt=1024;var Xt=new Et,fi=new Et;function at(n){let t=new ai(n,Kt,n.length/4/Kt,ui,li);return t.magFilter=t.minFilter=ci,t.needsUpdate=!0,t}function G({lastTime:n,frameCount:t}){return t>1?n+n/(t-1):0}var De={message:"ath: got a request after dispose(), expected none",codeName:"CLOSED"},F=({message:n,codeName:t})=>Object.assign(new Error(n??"MISSING: bytes are still to come"),{codeName:t??"MISSING"}),di=33;function St(n){return n<1?n*n*(3-2*n):1}var mi=19,pi=21,et=class extends hi{clip;time=0;start=0;wrap;frame=0;level=-1;held=!1;automatic=!0;target=0;pixels=1;measure="p99";fade=.2;fading=!1;heat=!1;distances=null;mode="matrices";milliseconds=0;uniforms=tt();#t;#e;#i=new Set;#n=null;#o=null;#s=new Zt;#a=null;#h=new Map;#f=null;#r=null;#c=!1;#d=!1;#m=0;#l=null;#p=null;#u=new Map;#b=1;constructor(t,e,s){super(),this.#t=t,this.#e=e,this.clip=s,this.target=t.info.levelCount-1,this.wrap=this.usualWrap,t.views.set(e,this)}get info(){return this.#t.info}get clips(){return this.#t.clips}get usualWrap(){return this.clips.some(({loop:t})=>t)?"marked":"loop"}get loops(){return this.wrap==="loop"||this.wrap==="marked"&&this.clip.loop}get duration(){return this.loops?G(this.clip):this.clip.lastTime*(this.wrap==="pingpong"?2:1)}get switching(){return this.#l&&(this.#l.begun?"fading":"waiting")}get levelCount(){return this.info.levelCount}levelName(t){return this.info.levelNames[t]}get failure(){return this.#t.failure}get bytesFetched(){return this.#t.state.fetched}get bytesTotal(){return this.info.fileLength}get requests(){return this.#t.state.requests}motionBytes(t){let{firstSegment:e,segmentCount:s}=this.clip;return this.#t.chunks.filter(o=>o.level<=t&&([mi,pi].includes(o.kind)||o.segment>=e&&o.segment<e+s)).reduce((o,{length:r})=>o+r,0)}bitRate(t=Math.max(this.level,0)){return this.clip.duration>0?8*this.motionBytes(t)/this.clip.duration:0}error(t){return this.clip.errors[t]}seamError(t){return this.clip.seams[t]}ready(t){let{times:e,segments:s}=this.#t,{firstFrame:i,frameCount:o,firstSegment:r}=this.clip,a=[],h=i+o-1,l=c=>e[Math.min(s[c],h)]-e[i];return this.readyLevels.forEach((c,u)=>{if(c<t)return;let f=l(r+u),d=l(r+u+1);a.at(-1)?.end===f?a.at(-1).end=d:a.push({start:f,end:d})}),a}get readyLevels(){let{firstSegment:t,segmentCount:e}=this.clip;return this.#t.state.ready.subarray(t,t+e)}get readyLevel(){return Math.min(...this.readyLevels)}get complete(){return this.readyLevel===this.levelCount-1}setTime(t){let e=Math.max(0,t-this.time),s=this.#l;return this.time=t,s&&(s.seconds+=e,s.begun&&(s.passed+=e),this.#y()),this.#w(),this}play(t,{fade:e=0,at:s=0}={}){let i=this.clips.find(({index:o,name:r})=>t===o||t===r);if(!i)throw new RangeError(`clip: got ${t}, expected one of ${this.clips.map(({name:o})=>o).join(", ")}`);return this.#p=null,this.level>=0&&(this.#l={...this.#S(),at:s,fade:e,passed:0,begun:!1}),Object.assign(this,{clip:i,start:this.time-s}),this.#w(),this}wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);return this.#p=[t,e],this.#l=null,this.#w(),this}#S(){let t=this.#l;return t&&(!t.begun||2*t.passed<t.fade)?t:this.#g(this.time)}#y(){this.#l.begun&&this.#l.passed>=this.#l.fade&&(this.#l=null)}setLevel(t){return this.automatic=t==="auto",this.automatic||(this.target=Pe.clamp(t,0,this.levelCount-1)),this.#w(),this}setMode(t){return this.mode=t,this}levelFor(t,e,s=null,i=this.pixels){let o=this.#_(t,e,s);for(let r=0;r<this.levelCount;r++)if(this.error(r)[this.measure]*o<=i)return r;return this.levelCount-1}pixelError(t,e,s,i=null){return this.error(t)[this.measure]*this.#_(e,s,i)}#_(t,e,s){let i=this.#t.sphere;Xt.copy(i.center);let o=1;if(s&&(Xt.applyMatrix4(s),o=s.getMaxScaleOnAxis()),t.isOrthographicCamera)return o*e*t.zoom/(t.top-t.bottom);let r=Math.max(Xt.distanceTo(fi.setFromMatrixPosition(t.matrixWorld))-i.radius*o,1e-9);return o*e/(2*Math.tan(Pe.degToRad(t.fov)/2)/t.zoom*r)}update(t,e,s=null){return this.automatic&&(this.target=this.levelFor(t,e,s?.matrixWorld??null)),this}show(t,e=this.target){return this.#x(t,{level:e,heat:this.heat,positions:this.mode==="positions"})}async positions(t,e=this.target){return(await this.#x(t,{level:e,positions:!0,aside:!0})).data}#x(t,e){let s=this.#b++;return new Promise((i,o)=>{if(!this.#t.views.has(this.#e))throw F(De);this.#u.set(s,{resolve:i,reject:o,aside:e.aside}),this.#t.send({type:"picture",view:this.#e,id:s,exactly:!0,...this.#g(t),wind:this.#p,...e})})}#g(t){return{clip:this.clip.index,seconds:t-this.start,wrap:this.wrap}}#w(){let t=this.#l,e=this.switching==="waiting",{clip:s,seconds:i,wrap:o}=this.#g(e?this.start+t.at:this.time),r=t&&{clip:t.clip,seconds:t.seconds,wrap:t.wrap,begun:t.begun,share:t.fade>0?1-t.passed/t.fade:0},a=`${s} ${i} ${o} ${this.target} ${this.heat} ${JSON.stringify([r,this.#p])}`;if(this.#c){this.#d=a!==this.#r;return}if(a===this.#r&&!this.#d&&!this.fading)return;this.#r=a,this.#d=!1,this.#c=!0;let h=this.#f;this.#f=null,this.#t.send({type:"picture",view:this.#e,id:0,clip:s,seconds:i,wrap:o,old:r,wind:this.#p,level:this.target,heat:this.heat,positions:this.mode==="positions",buffer:h,now:performance.now(),fade:this.fade,coarsely:this.#t.easing},h?[h]:[])}refresh(){this.#r=null,this.#w()}picture(t){let e=this.#u.get(t.id),{shown:s,codeName:i}=t;this.#u.delete(t.id),e||(this.#c=!1),s<0?e?.reject(F(t)):e?.aside||this.#M(t),s>=0&&e?.resolve(t),!e&&t.message&&this.dispatchEvent({type:"error",message:t.message,codeName:i}),!e&&this.#d&&this.#w()}dispatchEvent(t){try{super.dispatchEvent(t)}catch(e){queueMicrotask(()=>{throw e})}}#M({shown:t,cut:e=t,frame:s,data:i,heat:o,ms:r,held:a,clip:h,exactly:l,fading:c,whole:u}){let f=t!==this.level,d=this.#t.known.get(e),m=d!==this.#n;if(Object.assign(this,{frame:s,held:a,fading:c,milliseconds:r,distances:o??null,level:t}),this.#n=d,t>0&&this.#t.endEasing(),clearTimeout(this.#m),c&&(this.#m=setTimeout(()=>this.refresh(),di)),this.#o=u?i:null,u||this.#E(e,i),this.#T(i),this.mode==="positions"&&this.#v(this.uploaded()),m)for(let p of this.#i)this.#D(p);f&&this.dispatchEvent({type:"level",level:t}),this.switching==="waiting"&&h===this.clip.index&&this.#P(this.#l),l&&(this.#l=null),this.dispatchEvent({type:"frame",frame:s,level:t})}#P(t){t.begun=!0,this.start=this.time-t.at,this.#y(),this.dispatchEvent({type:"clip",clip:this.clip})}#E(t,e){let s=this.#h.get(t);s&&s.image.data.length===e.length?(this.#f=s.image.data.buffer,s.image.data=e,s.needsUpdate=!0):(s?.dispose(),this.#h.set(t,at(e)));let{texels:i,parts:{nodeCount:o,exactCount:r}}=this.#n;this.uniforms.athData.value=this.#h.get(t),this.uniforms.athStride.value=r>0?(i-3*o)/r:1}#v(t){for(let e of this.#i){let{source:s}=e.userData,{position:i,normal:o}=e.attributes;for(let r=0;r<s.length;r++)for(let a=0;a<3;a++)i.array[3*r+a]=t[3*s[r]+a];i.needsUpdate=!0,o&&e.computeVertexNormals()}}#T(t){let{min:e,max:s}=this.#s.makeEmpty(),{boxes:i}=this.#n,o=[...e],r=[...s],a=(l,c,u)=>{c<o[l]&&(o[l]=c),u>r[l]&&(r[l]=u)},h=(l,c,u)=>{for(let f=l;f<c;f+=u)for(let d=0;d<3;d++)a(d,t[f+d],t[f+d])};if(this.#o)h(0,t.length,3);else{let{parts:{nodeCount:l,exactCount:c}}=this.#n,u=4*this.uniforms.athStride.value;h(12*l,12*l+u*c,u);for(let[f,d,m,p,y,x,b]of i)for(let w=0;w<3;w++){let[v,M,g,E]=t.subarray(f+4*w,f+4*w+4),S=v*d+M*m+g*p+E,T=Math.abs(v)*y+Math.abs(M)*x+Math.abs(g)*b;a(w,S-T,S+T)}}e.fromArray(o),s.fromArray(r);for(let l of this.#i)this.#A(l)}#A(t){t.boundingBox=(t.boundingBox??new Zt).copy(this.#s),t.boundingSphere=this.#s.getBoundingSphere(t.boundingSphere??new Re)}uploaded(){if(this.#o||!this.uniforms.athData.value)return this.#o;let{data:t}=this.uniforms.athData.value.image,{rest:e}=this.#t,{vertices:s}=this.#n,i=this.#o=new Float32Array(e.length);for(let o=0,r=0;o<s.length;o++){let a=s[o],h=e[r],l=e[r+1],c=e[r+2];for(let u=4*(Math.abs(a)-1),f=0;f<3;f++,r++,u+=a<0?1:4)i[r]=a<0?t[u]:t[u]*h+t[u+1]*l+t[u+2]*c+t[u+3]}return i}bind(t){return this.mode==="positions"?t:I(t,this.uniforms)}bindShadows(t){if(this.mode==="positions")return t;let{clone:e}=Object.getPrototypeOf(t);return Object.assign(t,this.#a??=_t(this.uniforms),{onBeforeRender:this.#O,clone:(...s)=>this.bindShadows(e.apply(t,s))})}#O=({isWebGPURenderer:t})=>{!t||this.mode==="positions"||(this.setMode("positions"),this.level>=0&&this.#v(this.uploaded()))};attach(t){let{source:e,other:s}=t.userData,i=t.getAttribute("position");return this.mode!=="positions"&&!s&&t.setAttribute("position",new yt(i.array,3).follow(e,()=>this.uploaded())),this.level<0&&this.#s.copy(this.#t.box),this.#i.add(t),this.#A(t),this.#D(t),t}setRest(){if(this.mode==="positions")return;for(let e of this.#i)Te(e,this.#t.rest);this.#o=null;let t=this.uniforms.athData.value;t&&this.#T(t.image.data)}detach(t){this.#i.delete(t)}#D(t){if(this.mode==="positions")return;let{source:e,other:s}=t.userData;this.#k(t,"athPart",e),s&&this.#k(t,"athPartOther",s)}#k(t,e,s){let i=t.getAttribute(e)?.array??new Float32Array(s.length),o=this.#n?.vertices;if(o)for(let r=0;r<s.length;r++)i[r]=o[s[r]];$(t,e,i,1)}async nodeNumbers(t=this.level){return this.#t.nodeNumbers(await this.#t.parts(t))}clone(){return this.#t.view(this.clip)}dispose(){clearTimeout(this.#m);for(let t of this.#h.values())t.dispose();for(let t of Object.values(this.#a??{}))t.dispose();this.#h.clear(),this.#t.dropView(this.#e),this.fail(F(De))}fail(t){for(let{reject:e}of this.#u.values())e(t);this.#u.clear()}};function Jt(n){let t=[1/0,1/0,1/0],e=[-1/0,-1/0,-1/0];for(let i=0;i<n.length;i+=3)for(let o=0;o<3;o++)n[i+o]<t[o]&&(t[o]=n[i+o]),n[i+o]>e[o]&&(e[o]=n[i+o]);let s=new Zt(new Et(...t),new Et(...e));return{box:s,sphere:s.getBoundingSphere(new Re)}}function gi({presence:n,part_names:t},{part_vertex_counts:e,part_copies:s}){if(!n||!Array.isArray(t)||e?.array.length!==t.length)return[];let i=[];for(let o=0,r=0;o<t.length;r+=Number(e.array[o++])){let a=Number(e.array[o]),h=Number(s?.array[o]??1),l=n[t[o]];l&&i.push({first:r,stop:r+a,runs:l});for(let c=0,u=a/h;!l&&c<h;c++){let f=n[`${t[o]}:${c}`];f&&i.push({first:r+c*u,stop:r+(c+1)*u,runs:f})}}return i}var Tt=class{#t=new Map;#e=new WeakMap;#i="";show({motion:t,metadata:e,attributes:s},i,o){let r=t.clips.findLast(({firstFrame:c})=>c<=t.frame)??t.clip;o&&this.#t.clear(),this.#t.has(r)||this.#t.set(r,gi({...e,...e.clips?.[r.name]},s));let a=Math.floor(t.frame-r.firstFrame),h=this.#t.get(r).filter(({runs:c})=>!c.some(([u,f])=>u<=a&&a<f)),l=h.map(({first:c})=>c).join();if(!(l===this.#i&&!(o&&h.length))){this.#i=l;for(let c of i)this.#n(c,h)}}#n(t,e){let{index:s,userData:{source:i}}=t,o=t.hasAttribute("normal")?3:2;this.#e.has(t)||this.#e.set(t,s.array.slice());let r=this.#e.get(t),a=new Uint8Array(Math.max(0,...e.map(({stop:h})=>h)));for(let{first:h,stop:l}of e)a.fill(1,h,l);for(let h=0;h<r.length;h++){let l=r[h-h%o];s.array[h]=a[i[l]]?l:r[h]}s.needsUpdate=!0}};var Oi=16,Pi=0;function Di(n){if(n===null||n instanceof Float32Array&&n.length%3===0)return n;let t=n?.isBufferGeometry?n.getAttribute("position"):null;if(!t)throw new TypeError("mesh: got something else, expected three numbers per vertex or a BufferGeometry");return Float32Array.from({length:3*t.count},(e,s)=>t.getComponent(Math.floor(s/3),s%3))}function Ri(n){if(ArrayBuffer.isView(n))return new Uint8Array(n.buffer,n.byteOffset,n.byteLength).slice();if(!/Buffer/.test(Object.prototype.toString.call(n)))throw new TypeError("buffer: got something else, expected an ArrayBuffer or a view of one");return new Uint8Array(n).slice()}var Ce=n=>({codeName:"WORKER",message:`ath_worker.js: got no worker (${n??"not found or not allowed"}), expected it beside the loader or where setDecoderPath() says`}),Qt=()=>F({message:"loading was aborted",codeName:"AbortError"}),te=class{views=new Map;state={fetched:0,requests:0,ready:new Int8Array(1).fill(-1)};failure=null;sent=0;decodedAt=null;known=new Map;#t=new Map;#e=1;#i=1;#n=null;constructor(t,e){this.id=++Pi,this.worker=t,this.release=e,this.settle={};for(let s of["opened","whole","arrays"])this[s]=new Promise((i,o)=>{this.settle[s]={resolve:i,reject:o}}),this[s].catch(()=>{});t.channels.set(this.id,this)}#o(t){for(let{reject:e}of[this.settle.opened,this.settle.whole,...this.#t.values()])e(t);this.#t.clear()}send(t,e=[]){this.worker.postMessage({...t,file:this.id},e)}receive(t){let{type:e}=t;if(this.sent=t.sent-performance.timeOrigin,e==="opened")Object.assign(this,t,{type:void 0},Jt(t.rest)),this.state.ready=new Int8Array(t.info.segmentCount).fill(-1),this.settle.opened.resolve(this);else if(e==="rest")this.#r(t.rest);else if(e==="failed"){let s=F(t);this.#o(s);for(let i of this.views.values())i.fail(s);this.#s({...t,type:"stopped"})}else if(e==="attributes")this.settle.arrays.resolve(t.attributes);else if(e==="state")this.#f(t);else if(e==="picture")this.views.get(t.view)?.picture(t);else if(e==="parts")this.#a(t);else if(e==="decoded"){this.decodedAt??=this.sent;for(let s of this.views.values())s.refresh()}else e==="baked"?this.#l(`bake ${t.id}`,t):e==="gpu"||e==="wind"?this.#l(`${e} ${t.id}`,t):(e==="stopped"&&this.settle.whole.reject(F(t)),this.#s(t))}#s({type:t,level:e=null,message:s,codeName:i}){this.failure={type:t,level:e,message:s,codeName:i},this.#d(this.failure)}#a({level:t,parts:e,texels:s}){let i={parts:e,texels:s,vertices:this.#p(e,s),boxes:this.#h(e)};this.known.set(t,i),this.#l(`parts ${t}`,i)}#h({branch:t,first:e,count:s,index:i}){let{rest:o,vertexSource:r}=this,a=new ke,h=new wi,l=new ke,c=[];for(let u=0;u<t.length;u++)if(!(t[u]<0)){h.makeEmpty();for(let f=e[u];f<e[u]+s[u];f++)h.expandByPoint(a.fromArray(o,3*r[f]));c.push([12*i[u],...h.getCenter(a),...h.getSize(l).multiplyScalar(.5)])}return c}#f(t){let e=t.ready.some((s,i)=>s!==this.state.ready[i]);if(this.state=t,this.#d({type:"progress",loaded:t.fetched,total:t.total}),t.whole&&this.settle.whole.resolve(),!!e){this.#d({type:"ready"});for(let s of this.views.values())s.refresh()}}get easing(){return this.#n!==null}#r(t){let e=this.rest.slice(),s=performance.now(),i=Math.max(0,...[...this.views.values()].map(({level:r,fade:a})=>r===0?a:0)),o=()=>{let r=St((performance.now()-s)/1e3/i);r===1?this.endEasing():this.#c(t.map((a,h)=>e[h]+r*(a-e[h])))};this.#n={to:t,timer:setInterval(o,Oi)},o()}endEasing(){if(!this.easing)return;let{to:t,timer:e}=this.#n;clearInterval(e),this.#n=null,this.#c(t);for(let s of this.views.values())s.refresh()}#c(t){this.rest.set(t);let{box:e,sphere:s}=Jt(t);this.box.copy(e),this.sphere.copy(s);for(let i of this.known.values())i.boxes=this.#h(i.parts);for(let i of this.views.values())i.setRest()}#d(t){for(let e of this.views.values())e.dispatchEvent({...t})}async parts(t){return this.known.get(t)??this.#m(`parts ${t}`,{type:"parts",level:t})}bake(t,e,s){let i=this.#i++;return this.#m(`bake ${i}`,{type:"bake",id:i,clip:t,level:e,step:s})}async gpu(t,e=null){let s=this.#i++,i=await this.#m(`gpu ${s}`,{type:"gpu",id:s,level:t,segment:e});if(!i.words)throw F(i);return i}windWeights(t,e){let s=this.#i++;return this.#m(`wind ${s}`,{type:"wind",id:s,strength:t,heading:e})}#m(t,e){if(!this.#t.has(t)){let s={};s.promise=new Promise((i,o)=>{Object.assign(s,{resolve:i,reject:o})}),this.#t.set(t,s),this.send(e)}return this.#t.get(t).promise}#l(t,e){this.#t.get(t)?.resolve(e),this.#t.delete(t)}fetchAll(){return this.send({type:"all"}),this.whole}abort(){this.settle.opened.reject(Qt()),this.settle.whole.reject(Qt()),this.send({type:"abort"})}#p({nodeCount:t,exactCount:e,branch:s,first:i,count:o,index:r},a){let h=new Float32Array(this.info.placeCount),l=e>0?(a-3*t)/e:1;for(let c=0;c<s.length;c++)for(let u=0;u<o[c];u++)h[i[c]+u]=s[c]>=0?1+3*r[c]:-(1+3*t+l*(r[c]+u));return this.#u(h)}#u(t){return t.constructor.from(this.vertexPlaces,e=>t[e])}nodeNumbers({parts:{branch:t,first:e,count:s}}){let i=this.#b();for(let o=0;o<t.length;o++)t[o]>=0&&i.fill(t[o],e[o],e[o]+s[o]);return this.#u(i)}get vertexBranch(){return this.#u(this.#b())}#b(){let{branches:{first:t,count:e}}=this,s=new Int32Array(this.info.placeCount);for(let i=0;i<t.length;i++)s.fill(i,t[i],t[i]+e[i]);return s}view(t=this.clips[this.first]){return new et(this,this.#e++,t)}dropView(t){this.views.delete(t)&&this.send({type:"drop",view:t})}close(){if(this.worker.channels.delete(this.id)){clearInterval(this.#n?.timer),this.send({type:"close"});for(let t of[...this.views.values()])t.dispose();this.#o(Qt()),this.release()}}},ht=class extends Ei{attributes={};#t;#e;#i=null;#n=null;#o=null;#s=null;#a=null;#h=null;#f=new Tt;constructor(t,e){super(),this.#t=t,this.motion=t.view().setMode(e),this.motion.addEventListener("frame",()=>this.#r(!1)),this.metadata=t.statics.metadata,this.#e=qt(t.statics,{}),this.arrays=t.arrays.then(s=>this.#d(s))}get loaded(){return this.#h??=this.#t.fetchAll().then(()=>this)}abort(){this.#t.abort()}get hasFaces(){return this.#e!==null}get geometry(){return!this.#i&&this.#e&&(this.#i=this.motion.attach(Ee(this.#t,this.#e)),Yt(this.#i,this.#t,this.attributes),this.#r(!0)),this.#i}get lines(){let{statics:t}=this.#t;return!this.#n&&(t.edges||!this.#e)&&(this.#n=this.motion.attach(Se(this.#t,t.edges??t.skeleton)),this.#r(!0)),this.#n}get object(){return this.#o||(this.#o=vt(new bi,this),this.#o.name="ath",this.#c()),this.#o}#r(t){this.#f.show(this,[this.#i,this.#n].filter(Boolean),t)}#c(){let{geometry:t,motion:e}=this,s=this.#s;if(!s||t&&!s.isMesh){let o=t?new Mi({color:9083499,roughness:.8,side:Si}):new yi({color:7035717});this.#a=e.bind(o),this.#s=t?new _i(t,o):new vi(this.lines,o),s?Ai.prototype.copy.call(this.#s,s):this.#s.castShadow=this.#s.receiveShadow=!0,this.#o.add(e.bindShadows(this.#s)),s?.removeFromParent(),s?.material.dispose()}let{vertexColors:i}=this.#a;!t?.hasAttribute("color")||i||(this.#a.color.set(16777215),Object.assign(this.#a,{vertexColors:!0,needsUpdate:!0}))}get skeleton(){return this.#t.statics.skeleton}get origin(){return this.#t.origin}get rest(){return this.#t.rest}get branches(){return this.#t.branches}get vertexBranch(){return this.#t.vertexBranch}get sphere(){return this.#t.sphere}get box(){return this.#t.box}get channel(){return this.#t}#d(t){return this.attributes=t,this.#e??=qt(this.#t.statics,t),this.#i&&Yt(this.#i,this.#t,t),this.#o&&this.#e&&this.#c(),this.#r(!0),this.dispatchEvent({type:"arrays"}),t}dispose(){for(let t of[this.#i,this.#n])t?.dispose();this.#a?.dispose(),this.#t.close()}},Y=class extends xi{constructor(t){super(t),this.workerLimit=4,this.workerPool=[],this.workerURL=null,this.mode="matrices",this.clip=null,this.hostMesh=null,this.bandwidth=null,this.begun=null}setDecoderPath(t){return this.workerURL=/\/$/.test(t)?`${t}ath_worker.js`:t,this}setWorkerLimit(t){return this.workerLimit=t,this}setMode(t){return this.mode=t,this}setClip(t){return this.clip=t,this}setHostMesh(t){return this.hostMesh=Di(t),this}setBandwidth(t){return this.bandwidth=t,this}preload(){return this.workerPool.length===0&&this.#o(),this}takeOver({worker:t,url:e=null,front:s=null}){return this.#s(t),this.begun={url:e,front:s},this}load(t,e,s,i){let o=this.manager.resolveURL(Ti.resolveURL(t,this.path)),r={headers:this.requestHeader,credentials:this.withCredentials?"include":"same-origin"};this.manager.itemStart(t);let a=(h,l)=>{h===i&&this.manager.itemError(t),h?.(l),this.manager.itemEnd(t)};this.#t(new URL(o,globalThis.location?.href).href,r,s).then(h=>a(e,h),h=>{i||console.error(h),a(i,h)})}parse(t,e,s=i=>console.error(i)){this.parseAsync(t).then(e,s)}async parseAsync(t){let{buffer:e}=Ri(t);return this.#e({bytes:e},[e])}abort(){for(let{channels:t}of this.workerPool)for(let e of[...t.values()])e.abort();return this}async#t(t,e,s){let{clip:i,hostMesh:o,bandwidth:r,begun:a}=this,h=a?.url===t&&r===null?await a.front:null;return this.begun=null,this.#e({url:t,options:{...e,front:h},clip:i,hostMesh:o,bandwidth:r},h?[h.port]:[],s)}async#e(t,e,s){let i=this.#n(),o=this.manager.abortController?.signal,r=()=>a.abort(),a=new te(i,()=>{i.files--,o?.removeEventListener("abort",r)});o?.addEventListener("abort",r),i.files++;try{a.send({type:"open",clip:this.clip,hostMesh:this.hostMesh,bandwidth:this.bandwidth,...t},e),await a.opened;let h=new ht(a,this.mode);return s&&h.motion.addEventListener("progress",({loaded:l,total:c})=>s({loaded:l,total:c,lengthComputable:!0})),await this.#i(h.motion),h}catch(h){throw a.close(),h}}#i(t){return new Promise((e,s)=>{let i=o=>{t.level<0&&t.show(0,0).catch(()=>s(F(o)))};t.addEventListener("frame",e),t.addEventListener("stopped",i),t.addEventListener("damaged",i),t.setTime(0)})}#n(){let t=this.workerPool.find(e=>e.files===0);return t||(this.workerPool.length<this.workerLimit?this.#o():this.workerPool.reduce((e,s)=>s.files<e.files?s:e))}#o(){return this.#s(this.#a())}#s(t){return Object.assign(t,{files:0,channels:new Map}),t.onmessage=({data:e})=>t.channels.get(e.file)?.receive(e),t.onerror=({message:e})=>{this.workerPool.splice(this.workerPool.indexOf(t),1);for(let s of t.channels.values())s.receive({type:"failed",...Ce(e)})},this.workerPool.push(t),t}#a(){let{href:t,origin:e}=globalThis.location??{};try{let s=new URL(this.workerURL??new URL("./ath_worker.js",import.meta.url),t),o=s.protocol==="blob:"||s.origin===e||!/^http/.test(e)?s:URL.createObjectURL(new Blob([`import ${JSON.stringify(s.href)};`],{type:"text/javascript"}));return new Worker(o,{type:s.protocol==="blob:"?"classic":"module"})}catch({message:s}){throw F(Ce(s))}}dispose(){for(let t of this.workerPool)t.terminate();return this.workerPool.length=0,this}};import{Color as Li,Mesh as Ui,Vector4 as zi}from"./three.webgpu.js";import{BufferAttribute as ki,InstancedBufferAttribute as Ci,InstancedBufferGeometry as Ni,ShaderMaterial as Ie,Vector2 as Le}from"./three.webgpu.js";var Ue=`
attribute vec3 rest,restOther,color,colorOther;
attribute float athPartOther,radius,radiusOther;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${Mt}
void main(){
bool far=position.x>.5;
vec4 p=modelViewMatrix*vec4(athMoved(rest,athPart),1.);
vec4 q=modelViewMatrix*vec4(athMoved(restOther,athPartOther),1.);
float age=distance(p.xyz,q.xyz)/max(distance((modelViewMatrix*vec4(rest,1.)).xyz,(modelViewMatrix*vec4(restOther,1.)).xyz),1e-9);
vec2 along=isOrthographic?p.xy - q.xy:p.xy/-p.z - q.xy/-q.z;
vec2 across=length(along)>1e-9?normalize(vec2(-along.y,along.x)):vec2(1.,.0);
if (far) p=q;
float pixel=(isOrthographic?1.:-p.z)*2./(projectionMatrix[1][1]*screen.y);
float grown=min(age,1.);
float wide=max((far?radiusOther:radius)*grown,.55*pixel);
p.xy+=wide*(across*position.y+vec2(across.y,-across.x)*(far?-.6:.6));
gl_Position=projectionMatrix*p;
vColor=far?colorOther:color;
vSide=position.y;
vAcross=vec3(across,.0);
}`,Ii=`
uniform float shade;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
void main(){
float s=clamp(vSide,-1.,1.);
vec3 n=normalize(vAcross*s+vec3(.0,.0,sqrt(max(1. - s*s,.0))));
float light=.55+.55*max(dot(n,normalize(vec3(.45,.65,.6))),.0)+.1*n.y;
gl_FragColor=vec4(vColor*mix(1.,light,shade),1.);
#include <colorspace_fragment>
}`;function At(n,t){let e=n.skeleton,s=e.length/2,i=new Uint32Array(s),o=new Uint32Array(s);for(let a=0;a<s;a++)i[a]=e[2*a],o[a]=e[2*a+1];let r=new Ni;return r.setAttribute("position",new ki(Float32Array.of(0,1,0,0,-1,0,1,1,0,1,-1,0),3)),r.setIndex([0,1,2,2,1,3]),r.setAttribute("rest",Ne(n.rest,i)),r.setAttribute("restOther",Ne(n.rest,o)),r.instanceCount=s,r.userData={source:i,other:o},lt(r,t),r}function Ne(n,t){let e=new Float32Array(3*t.length);for(let s=0,i=0;s<t.length;s++){let o=3*t[s];e[i++]=n[o],e[i++]=n[o+1],e[i++]=n[o+2]}return new Ci(e,3)}function lt(n,t){for(let[e,s]of[["radius",n.userData.source],["radiusOther",n.userData.other]]){let i=new Float32Array(s.length);for(let o=0;o<s.length;o++)i[o]=t[s[o]];$(n,e,i,1)}}function ze(n){let t=`#include <packing>
void main() { gl_FragColor = packDepthToRGBA(gl_FragCoord.z); }`;return new Ie({vertexShader:Ue,fragmentShader:t,side:2,uniforms:{...n,screen:{value:new Le(2048,2048)}}})}function Ot(n){return new Ie({vertexShader:Ue,fragmentShader:Ii,side:2,uniforms:{...n,screen:{value:new Le(1,1)},shade:{value:1}}})}function K(n){let t=n.attributes.radius,e=n.rest.length/3;if(t?.array.length===e)return Float32Array.from(t.array,Number);let{branches:{first:s,count:i,attach:o,depth:r},channel:{info:a,vertexPlaces:h}}=n,l=new Float32Array(a.placeCount).fill(1);for(let d=s.length-1;d>=0;d--){for(let m=s[d]+i[d]-2;m>=s[d];m--)l[m]+=l[m+1];o[d]>=0&&(l[o[d]]+=l[s[d]])}let c=l.reduce((d,m)=>Math.max(d,m),1),u=r.length>1&&r.every(d=>d===0),f=n.sphere.radius/(u?500:50);return Float32Array.from(h,d=>f*Math.sqrt(l[d]/c))}var Fi=8020552,Bi=new zi,Pt=class extends Ui{#t;#e;#i;constructor(t,{motion:e=t.motion,color:s=Fi}={}){let i=At(t,K(t));super(e.attach(i),Ot(e.uniforms)),this.#t=t,this.#e=e,this.#i=()=>lt(i,K(t)),t.addEventListener("arrays",this.#i),vt(this,t),this.frustumCulled=!1,this.setColor(s)}setColor(t){let e=typeof t=="function"?null:new Li(t).toArray(),{source:s,other:i}=this.geometry.userData;for(let[o,r]of[["color",s],["colorOther",i]]){let a=Float32Array.from({length:3*r.length});r.forEach((h,l)=>a.set(e??t(h),3*l)),$(this.geometry,o,a,3)}return this}onBeforeRender=t=>{let{z:e,w:s}=t.getCurrentViewport(Bi);this.material.uniforms.screen.value.set(e,s),this.material.uniformsNeedUpdate=!0};dispose(){this.#t.removeEventListener("arrays",this.#i),this.#e.detach(this.geometry),this.geometry.dispose(),this.material.dispose(),this.removeFromParent()}};import{DynamicDrawUsage as ji,Frustum as Hi,Group as Wi,InstancedBufferAttribute as Gi,InstancedBufferGeometry as Fe,LineBasicMaterial as Vi,LineSegments as $i,Matrix4 as Be,Mesh as qi,MeshStandardMaterial as Yi,Sphere as Ki,Vector3 as Xi,BufferAttribute as Zi,DoubleSide as Ji}from"./three.webgpu.js";var Qi=4<<20,to=4096,je=1.5,He=2,eo=.85,so=-1,io=n=>n?new Vi({color:7035717}):new Yi({color:9083499,roughness:.8,side:Ji}),oo=()=>new Promise(n=>{setTimeout(n)}),Dt=class extends Wi{levelOfDetail=!0;pixels=1;measure="p99";fade=.2;fading=!1;counts=[];vertices=0;culled=0;#t;#e=new Map;#i=[];#n=new Set;#o=new Map;#s=new Map;#a=new Float32Array(0);#h=new Float32Array(0);#f=new Float32Array(0);#r=0;#c=[];#d;#m;#l;#p=0;constructor(t,{geometry:e=t.geometry??t.lines,material:s=io,depthMaterial:i=null}={}){super(),this.#t=t,this.#l=e,this.#d=s,this.#m=i,this.name="ath forest",V(this,t.metadata)}get count(){return this.#a.length/4}get baked(){return this.#o.get(this.#t.motion.clip.index)??[]}setInstances(t){let{motion:e}=this.#t;for(let{clip:i}of t)i!==void 0&&!this.#s.has(i)&&this.#s.set(i,e.clone().play(i).setLevel(e.levelCount-1));let s=i=>this.#s.get(i)?.clip.index??so;this.#a=Float32Array.from(t.flatMap(({x:i,y:o,z:r,size:a})=>[i,o,r,a])),this.#h=Float32Array.from(t.flatMap(({angle:i,seconds:o,clip:r})=>[Math.cos(i),Math.sin(i),o,s(r)])),this.#f=Float32Array.from(t.flatMap(({amplitude:i=1,tint:o=16777215})=>[i,...[16,8,0].map(r=>(o>>r&255)/255)])),this.#c=[];for(let i of this.#u())this.#g(i)}#u(){return[...this.#e.values()].flat().flatMap(t=>[t,...t.fades.values()])}bakeReady(){for(let t of[this.#t.motion,...this.#s.values()])for(let e=0;e<=t.readyLevel;e++)this.#b(e,t.clip)}bake(t){return this.#b(t,this.#t.motion.clip)}async#b(t,e){let s=`${e.index}/${t}`;if(this.#n.has(s))return;this.#n.add(s);let{channel:i,metadata:o}=this.#t,r=await i.parts(t),a=Math.max(1,Math.ceil(e.frameCount*r.texels/Math.min(Qi,1024*to))),h=await i.bake(e.index,t,a);if(!h.data||h.texels!==r.texels||!this.#t){this.#n.delete(s);return}let l=tt(),{nodeCount:c,exactCount:u}=r.parts;l.athData.value=at(h.data),l.athForest.value.set(h.texels,o.up_axis==="z"?1:0),l.athStride.value=u>0?(r.texels-3*c)/u:1,this.#r=Math.max(this.#r,ro(h,r,l.athStride.value)),await this.#S(t,e,r,{uniforms:l,rows:h.rows,perRow:G(e)/h.rows||1}),this.#o.set(e.index,[...this.#o.get(e.index)??[],t]),this.dispatchEvent({type:"level",level:t})}async#S(t,e,s,i){let{channel:o,motion:r,rest:a,sphere:h}=this.#t,l=t===r.levelCount-1,c=b=>e.errors[b][this.measure],u=c(t),f=t>0?c(t-1):h.radius/4,d=o.nodeNumbers(s),m=s.vertices;d.forEach((b,w)=>{m[w]<0&&(d[w]=-1)});let p=I(this.#d(!this.#l.hasAttribute("normal"),t),i.uniforms,!0),y=(b,w)=>this.#y(e,b,p,{...i,texel:m,level:t,tolerance:w}),x=l?this.#l:Q(this.#l,a,je*u,d);y(x,u);for(let b=Math.max(He*u,h.radius/2e3);b<f;b*=He){if(await oo(),!this.#t)return;let w=Q(this.#l,a,je*b,d);w.userData.source.length>eo*x.userData.source.length||(y(w,b),x=w)}}#y(t,e,s,i){let o=this.#_(t.index,e,s,{...i,base:e,fades:new Map});this.#e.set(t.index,[...this.#e.get(t.index)??[],o].sort((r,a)=>r.tolerance-a.tolerance))}#_(t,e,s,i){let o=new Fe,{source:r}=e.userData,a=!e.hasAttribute("normal"),h=({texel:u})=>new Zi(q(new Float32Array(r.length),u,r,1),1);o.setIndex(e.index);for(let[u,f]of Object.entries(e.attributes))u!=="athPart"&&o.setAttribute(u,f);o.setAttribute("athPart",h(i)),i.from&&o.setAttribute("athPartBefore",h(i.from));let l=a?new $i(o,s):new qi(o,s);Object.assign(l,_t(i.uniforms,!0),{castShadow:this.castShadow,receiveShadow:this.receiveShadow}),this.#m&&(l.customDepthMaterial=I(this.#m(),i.uniforms,!0)),Object.assign(l.userData,{level:i.level,clip:t}),l.frustumCulled=!1;let c={...i,drawn:l,size:r.length,filled:0};return this.#g(c),this.add(l),c}#x(t,e,s){if(!e.fades.has(s.level)){let{athData:i,athForest:o,athStride:r}=s.uniforms,a=!e.base.hasAttribute("normal"),h={...e.uniforms,athDataBefore:i,athBefore:{value:o.value.clone().setY(r.value)}},l=I(this.#d(a,e.level),h,!0);e.fades.set(s.level,this.#_(t,e.base,l,{...e,uniforms:h,from:s,fades:new Map}))}return e.fades.get(s.level)}#g(t){let e=t.drawn.geometry,s=new Fe;s.setIndex(e.index);for(let[i,o]of Object.entries(e.attributes))s.setAttribute(i,o);for(let[i,o]of[["place","athPlace"],["turn","athTurn"],["look","athLook"],...t.from?[["share","athFading"]]:[]])t[i]=new Gi(new Float32Array(Math.max(4,this.#a.length)),4),s.setAttribute(o,t[i].setUsage(ji));s.instanceCount=0,t.drawn.geometry=s,e.dispose()}update(t,e,s){let i=this.#u(),o=new Ki,r=new Hi,a=o.center,h=this.#A();this.updateWorldMatrix(!0,!1);let l=new Xi().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new Be().copy(this.matrixWorld).invert());r.setFromProjectionMatrix(new Be().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld));let c=2*Math.tan(t.fov*Math.PI/360)/e;this.#p=performance.now(),this.culled=0,this.fading=!1;for(let u of i)u.filled=0;this.#i=this.#e.get(this.#t.motion.clip.index)??this.#i;for(let u=0;u<this.#a.length&&i.length>0;u+=4){let f=this.#a[u+3],d=this.#A(this.#f[u]);if(a.fromArray(this.#a,u),o.radius=d*f,!r.intersectsSphere(o)){this.culled++,this.#c[u/4]=null;continue}let m=Math.max(l.distanceTo(a)-.5*h*f,1e-6),p=this.#e.get(this.#h[u+3])??this.#i,y=this.pixels*c*m/f;p.length>0&&this.#w(u,p,this.levelOfDetail?y:0,s)}this.counts=new Array(this.#t.motion.levelCount).fill(0),this.vertices=0;for(let u of this.#u())this.#D(u)}#w(t,e,s,i){let o=e[this.#O(e,s)],{clip:r}=o.drawn.userData,a=this.#P(t/4,r,o.level),h=a.level===o.level?o:this.#M(e,a.level,s),l=a.from<0?null:e.find(({level:c})=>c===a.from);if(!l){this.#v(t,h,i);return}this.fading=!0,this.#v(t,this.#x(r,h,l),i,1-St(this.#E(a)))}#M(t,e,s){let i=t.filter(o=>o.level===e);return i[this.#O(i,s)]}#P(t,e,s){let i=this.#c[t];return(!i||i.clip!==e)&&(i=this.#c[t]={clip:e,level:s,from:-1,since:0}),i.from>=0&&this.#E(i)>=1&&(i.from=-1),i.from<0&&i.level!==s&&Object.assign(i,{level:s,from:this.fade>0?i.level:-1,since:this.#p}),i}#E({since:t}){return(this.#p-t)/1e3/this.fade}#v(t,e,s,i=0){let{place:o,turn:r,look:a}=e,h=4*e.filled++;for(let l=0;l<4;l++)o.array[h+l]=this.#a[t+l];for(let l=0;l<4;l++)a.array[h+l]=this.#f[t+l];r.array[h]=this.#h[t],r.array[h+1]=this.#h[t+1],this.#T(r.array,h+2,e,s+this.#h[t+2]),e.from&&(this.#T(e.share.array,h,e.from,s+this.#h[t+2]),e.share.array[h+2]=i)}#T(t,e,{rows:s,perRow:i},o){let r=Math.fround(o/i%s),a=r<0?r+s:r;t[e]=a<s?a:0,t[e+1]=(Math.floor(t[e])+1)%s}#A(t=1){let{center:e,radius:s}=this.#t.sphere,i=e.length()+s,o=Math.max(Math.abs(t-.5)-.5,0);return Math.max(i,this.#r)+o*(i+this.#r)}#O(t,e){let s=0;for(;s+1<t.length&&t[s+1].tolerance<=e;)s++;return s}#D(t){let{filled:e,drawn:s}=t;s.geometry.instanceCount=e,s.visible=e>0,this.counts[t.level]+=e,this.vertices+=e*t.size;for(let i of[t.place,t.turn,t.look,t.share].filter(Boolean))i.clearUpdateRanges(),i.addUpdateRange(0,4*e),i.needsUpdate=e>0}dispose(){for(let t of this.#s.values())t.dispose();for(let{uniforms:t,drawn:e}of this.#u()){t.athData.value.dispose(),e.geometry.dispose();for(let s of[e.material,e.customDepthMaterial,e.customDistanceMaterial])s.dispose()}this.#e.clear(),this.#t=null}};function ro({data:n,rows:t,texels:e},{parts:{nodeCount:s,exactCount:i},boxes:o},r){let a=0;for(let h=0;h<t;h++){let l=4*h*e;for(let[c,u,f,d,m,p,y]of o){let x=0;for(let b=l+c,w=0;w<3;w++,b+=4){let v=n[b]*u+n[b+1]*f+n[b+2]*d+n[b+3];x+=(Math.abs(v)+Math.abs(n[b])*m+Math.abs(n[b+1])*p+Math.abs(n[b+2])*y)**2}a=Math.max(a,x)}for(let c=0,u=l+12*s;c<i;c++,u+=4*r)a=Math.max(a,n[u]**2+n[u+1]**2+n[u+2]**2)}return Math.sqrt(a)}import{DoubleSide as ee,MeshDepthMaterial as $n,MeshStandardMaterial as no,RGBADepthPacking as qn}from"./three.webgpu.js";var We=["bark","stalks"],Ge=["leaves","blades","pinnae"];function se({surfaces:n}){let[t,e]=typeof n=="string"?n.split(", "):[];return We.includes(t)&&Ge.includes(e)?[t,e]:null}var ao=`
varying vec2 athUv;
varying vec3 athGrown;
float athHalf(float v){
#if ATH_LEAF == 1
return 2.;
#elif ATH_LEAF == 2
float lobes=1. - smoothstep(.02,.06,fwidth(v));
return .97 - .55*lobes*pow(abs(cos(3.14159*13.*v)),3.)*(1. - .6*v);
#endif
float along=clamp((v - .1)/.9,.0,1.),teeth=1. - smoothstep(.02,.06,fwidth(v));
float outline=pow(sin(3.14159*pow(along,.8)),.8)*(.95 - .06*teeth*abs(sin(34.*along)));
return max(outline,v<.2?.04:.0);
}
float athInside(){
if (athUv.x<1.) return 1.;
float across=abs(4.*fract(.5*(athUv.x - 1.)) - 1.);
return min(athHalf(athUv.y) - across,.995 - athUv.y);
}
`,ho=`
float athHash(vec3 p){
p=fract(p*.3183099+vec3(.71,.113,.419));
p*=17.;
return fract(p.x*p.y*p.z*(p.x+p.y+p.z));
}
float athNoise(vec3 x){
vec3 i=floor(x),f=fract(x);
f=f*f*(3. - 2.*f);
return mix(mix(mix(athHash(i),athHash(i+vec3(1,0,0)),f.x),mix(athHash(i+vec3(0,1,0)),athHash(i+vec3(1,1,0)),f.x),f.y),
mix(mix(athHash(i+vec3(0,0,1)),athHash(i+vec3(1,0,1)),f.x),mix(athHash(i+vec3(0,1,1)),athHash(i+vec3(1,1,1)),f.x),f.y),f.z);
}
float athBark(vec2 uv){
vec3 p=vec3(uv.x*9.,uv.y*5.,1.7);
float warp=athNoise(p*vec3(.8,1.4,1.)) - .5;
float ridge=1. - abs(2.*athNoise(vec3(p.x*1.3+1.6*warp,p.y*.55,4.)) - 1.);
float cracks=athNoise(vec3(p.x*2.,p.y*3.2,9.));
float near=1. - smoothstep(.06,.3,length(fwidth(uv)));
return mix(.45,ridge*ridge*.75+.25*cracks,near);
}
float athVeins(vec2 leaf){
#if ATH_LEAF == 1
return (1. - smoothstep(.1,.5,fwidth(leaf.x)))*max(.8*(1. - smoothstep(.0,.14,abs(leaf.x))),.3+.3*sin(28.*leaf.x));
#endif
float across=abs(leaf.x),rib=1. - smoothstep(.0,.05,across);
float side=abs(fract(8.*(leaf.y - .42*across)) - .5);
float near=1. - smoothstep(.03,.12,fwidth(leaf.y));
return near*max(rib,(1. - smoothstep(.0,.12,side))*.55*(1. - across));
}
`,lo=`
float athIn=athInside();
diffuseColor.a=clamp(athIn/max(fwidth(athIn),1e-4)+.5,.0,1.);
#ifdef ALPHA_TO_COVERAGE
if (diffuseColor.a<.02) discard;
#else
if (diffuseColor.a<.5) discard;
#endif
`,co=`
${lo}
bool athIsLeaf=athUv.x>=1.;
float athThin=.0,athBump=.0;
if (athIsLeaf){
float shade=floor(.5*(athUv.x - 1.))/7.;
vec2 leaf=vec2(4.*fract(.5*(athUv.x - 1.)) - 1.,athUv.y);
float veins=athVeins(leaf);
vec3 green=mix(vec3(.062,.155,.018),vec3(.145,.255,.03),shade);
green=mix(green,vec3(.21,.22,.04),.3*smoothstep(.75,1.,shade));
#if ATH_LEAF == 1
green=mix(vec3(.16,.18,.05),green*1.15,smoothstep(.0,.45,leaf.y))*(.45+.55*smoothstep(.0,.35,leaf.y));
green=mix(green,vec3(.36,.31,.13),.8*step(.6,shade)*smoothstep(.72,1.,leaf.y));
#elif ATH_LEAF == 2
green=mix(vec3(.07,.17,.02),vec3(.135,.26,.03),shade)*(.8+.35*leaf.y);
#endif
green*=.85+.3*athNoise(vec3(leaf*5.,8.*shade));
diffuseColor.rgb=mix(green,green*1.5+.015,veins*.6);
athThin=.85 - .5*veins;
athBump=veins*.3;
}else{
#if ATH_STEM == 1
diffuseColor.rgb=mix(vec3(.1,.075,.03),vec3(.12,.17,.04),clamp(.02*athUv.y,.0,1.));
#else
athBump=athBark(athUv);
float age=athNoise(athGrown*3.),lichen=smoothstep(.62,.8,athNoise(athGrown*7.+3.));
vec3 bark=mix(vec3(.09,.07,.05),vec3(.3,.24,.18),athBump);
bark=mix(bark,bark*vec3(.85,.92,.8),age);
diffuseColor.rgb=mix(bark,vec3(.17,.19,.12),.35*lichen*athBump);
#endif
}
`,uo=`
if (athIsLeaf && dot(normal,normalize(vViewPosition))<.0) normal=-normal;
{
vec3 dx=dFdx(vViewPosition),dy=dFdy(vViewPosition);
float hx=dFdx(athBump),hy=dFdy(athBump),strength=athIsLeaf?.004:.03;
vec3 r1=cross(dy,normal),r2=cross(normal,dx);
float det=dot(dx,r1);
vec3 slope=sign(det)*(hx*r1+hy*r2)*strength;
float rough=length(vec2(hx,hy));
normal=normalize(abs(det)*normal - slope*(1. - smoothstep(.06,.3,rough)));
}
`,fo=`
#if NUM_DIR_LIGHTS > 0
if (athIsLeaf){
vec3 sun=directionalLights[0].direction;
float behind=max(dot(-normal,sun),.0),toward=pow(max(dot(-normalize(vViewPosition),-sun)*-1.,.0),4.);
float lit=1.;
#if defined(USE_SHADOWMAP) && NUM_DIR_LIGHT_SHADOWS > 0
lit=receiveShadow?getShadow(directionalShadowMap[0],directionalLightShadows[0].shadowMapSize,directionalLightShadows[0].shadowIntensity,
directionalLightShadows[0].shadowBias,directionalLightShadows[0].shadowRadius,vDirectionalShadowCoord[0]):1.;
#endif
vec3 through=diffuseColor.rgb*vec3(1.5,1.45,.45);
#if NUM_HEMI_LIGHTS > 0
reflectedLight.indirectDiffuse+=.45*athThin*getHemisphereLightIrradiance(hemisphereLights[0],-normal)*BRDF_Lambert(through);
#endif
reflectedLight.directDiffuse+=athThin*(.55*behind+.25*toward)*lit*directionalLights[0].color*through;
}
#endif
`;function mo(n,t,[e,s]){n.vertexShader=n.vertexShader.replace("#include <common>",`#include <common>
varying vec2 athUv;
varying vec3 athGrown;`).replace("#include <uv_vertex>",`#include <uv_vertex>
athUv = uv;
athGrown = position;`),n.fragmentShader=`#define ATH_STEM ${We.indexOf(e)}
#define ATH_LEAF ${Ge.indexOf(s)}
${t}`}function po(n){return n.onBeforeRender=(t,e)=>{n.alphaToCoverage=e.fog!==null,n.onBeforeRender=()=>{}},n}var Rt=class extends no{constructor(t={}){let e=se(t);super(e?{side:ee,shadowSide:ee}:{side:ee,color:7311178,roughness:.8}),e&&(this.onBeforeCompile=s=>mo(s,s.fragmentShader.replace("#include <common>",`#include <common>
${ao}${ho}`).replace("#include <map_fragment>",co).replace("#include <roughnessmap_fragment>","float roughnessFactor = athIsLeaf ? 0.62 : 0.95;").replace("#include <normal_fragment_maps>",uo).replace("#include <lights_fragment_end>",`#include <lights_fragment_end>
${fo}`),e),this.customProgramCacheKey=()=>`ath surface ${e}`,po(this))}};import{Box3 as Co,BufferAttribute as es,DoubleSide as No,Group as Io,IndirectStorageBufferAttribute as Lo,LineBasicNodeMaterial as Uo,LineSegments as zo,Mesh as Fo,MeshStandardNodeMaterial as Bo,Frustum as jo,Matrix4 as ss,StorageBufferAttribute as Ho,TSL as Lt,Vector3 as ne,WebGPUCoordinateSystem as Wo}from"./three.webgpu.js";var Ve=`// The blocks of a level and of a segment, as core/include/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

@group(0) @binding(0) var<storage, read> level: array<u32>;
@group(0) @binding(1) var<storage, read> segments: array<u32>; // blocks one behind the other

// A place is a blend of its sources. A dispatch computes several, one for each y of its workgroups.
struct Place {
    sources: u32, // word of \`places\` that they begin at
    source_count: u32,
    positions: u32, // number before those of this place; so are the others
    matrices: u32,
    modes: u32,
    bodies: u32,
    strength: f32, // Factor of the motion.
}
// A frame that a place shows, alone or blended with others.
struct Source {
    segment: u32, // word that the block of its segment begins at
    frame: u32,
    amplitudes: u32, // number before its own
    weight: f32,     // The weights of a place add up to 1.
}
@group(0) @binding(2) var<storage, read> places: array<u32>; // all of a dispatch, then all their sources
var<private> run: Place;
var<private> source: Source;
const PLACE_WORDS = 8u;
const SOURCE_WORDS = 4u;

// Words of the header of a level.
const VERTEX_COUNT = 2u;
const BODY_COUNT = 3u;
const POSITION_COUNT = 4u;
const MATRIX_COUNT = 5u;
const VERTICES = 7u;
const BODIES = 8u;
const ORDER = 9u;
const DEPTHS = 10u;
const BASES = 11u;

// Words of the header of a segment.
const FRAMES = 3u;
const JOIN_FRAMES = 4u;
const ROW_COUNT = 5u;
const CORRECTED_COUNT = 6u;
const CORRECTION_PART = 7u;
const MOVES = 8u;
const ROWS = 9u;
const VALUES = 10u;
const SHAPES = 11u;
const TURNS = 12u;
const JOIN_CURVE = 13u;
const JOIN_STEPS = 14u;
const JOINS = 15u;
const MATRIX_JOINS = 16u;
const CORRECTED = 17u;
const CORRECTIONS = 18u;
const BAKED = 19u;
const WAVE_SETS = 20u;

// Flags of bodies.
const NODE = 1u;
const FOLLOWS = 2u;
const FITTED = 4u;

// Words of records.
const BODY_WORDS = 16u;
const ROW_WORDS = 3u;
const MOVE_WORDS = 4u;
const VERTEX_WORDS = 4u;

struct Body {
    flags: u32,
    parent: i32,
    attach: i32,
    way: u32,
    modes: u32,
    first: u32,
    count: u32,
    vertex: u32,
    basis: u32,
    shape_modes: u32,
    rest_point: vec3<f32>,
    tangent: vec3<f32>,
}

struct Row {
    values: u32,
    count: u32,
    slot: u32,
    waves: u32,
    step: f32,
}

struct Move {
    row: u32,
    rows: u32,
    shape_count: u32,
    shapes: u32,
    turn: u32,
}

fn place_at(y: u32) -> Place {
    let at = PLACE_WORDS * y;
    return Place(places[at], places[at + 1u], places[at + 2u], places[at + 3u], places[at + 4u], places[at + 5u],
        bitcast<f32>(places[at + 6u]));
}

// The place that this invocation computes. Functions of segments read the source that is set.
fn source_at(s: u32) -> Source {
    let at = run.sources + SOURCE_WORDS * s;
    return Source(places[at], places[at + 1u], places[at + 2u], bitcast<f32>(places[at + 3u]));
}

fn segment(at: u32) -> u32 {
    return segments[source.segment + at];
}

fn level_float(at: u32) -> f32 {
    return bitcast<f32>(level[at]);
}

fn segment_float(at: u32) -> f32 {
    return bitcast<f32>(segment(at));
}

fn level_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(level_float(at), level_float(at + 1u), level_float(at + 2u));
}

fn body_at(b: u32) -> Body {
    let at = level[BODIES] + BODY_WORDS * b;
    return Body(
        level[at],
        bitcast<i32>(level[at + 1u]),
        bitcast<i32>(level[at + 2u]),
        level[at + 3u],
        level[at + 4u],
        level[at + 5u],
        level[at + 6u],
        level[at + 7u],
        level[at + 8u],
        level[at + 9u],
        level_vector(at + 10u),
        level_vector(at + 13u),
    );
}

fn move_at(b: u32) -> Move {
    let at = segment(MOVES) + MOVE_WORDS * b;
    let counts = segment(at + 1u);
    return Move(segment(at), counts & 0xffffu, counts >> 16u, segment(at + 2u), segment(at + 3u));
}

fn row_at(r: u32) -> Row {
    let at = segment(ROWS) + ROW_WORDS * r;
    let packed = segment(at + 1u);
    return Row(segment(at), packed & 0xffffu, (packed >> 16u) & 0xffu, packed >> 24u, segment_float(at + 2u));
}

fn rest_of(vertex: u32) -> vec3<f32> {
    return level_vector(level[VERTICES] + VERTEX_WORDS * vertex);
}

// One of two 16-bit integers of a word.
fn half(word: u32, index: u32) -> i32 {
    return bitcast<i32>(word << (16u - 16u * index)) >> 16u;
}
`;var $e=`// Chooses what instances are drawn with. \`measure\` runs first, for each level that is shown: it finds how far from its place a plant
// reaches now, over the vertices that pass 3 has placed, so that no instance is left out that is in view, whatever is blended. Then
// \`main\` appends each instance in view to the list of the coarsest shape whose error its distance hides, one invocation per instance.

const FLOATS = 9u; // numbers of a vertex, of which the first are its position

struct Instance {
    place: vec4<f32>, // x, y, z, size
    turn: vec4<f32>,  // cosine and sine of its angle, the plant that it shows, tint
    look: vec4<f32>,  // Amplitude: how many times as far from the rest pose everything is.
}

struct View {
    planes: array<vec4<f32>, 6>, // The planes of the view: normal, distance.
    eye: vec3<f32>,
    pixel: f32, // the error that is allowed at distance 1
    count: u32,
    shapes: u32,
    near: f32,  // how much nearer than its place an instance of size 1 begins, for its level
    room: u32,  // Instances that a list has room for.
    offset: vec3<f32>, // from the positions of vertices to those from the place
    beyond: f32,       // how far a shape's own vertices are from the plant's
    rest: f32,         // how far from its place the rest pose reaches
    headed: u32,       // 1: what moves is turned about the rest pose
}

struct Shape {
    tolerance: f32,
    list: u32,
}

@group(0) @binding(0) var<storage, read> instances: array<Instance>;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> shapes: array<Shape>; // the finest first
@group(0) @binding(3) var<storage, read_write> draws: array<atomic<u32>>; // five numbers of each list: of an indexed indirect draw
@group(0) @binding(4) var<storage, read_write> lists: array<u32>;
@group(0) @binding(5) var<storage, read_write> reach: array<atomic<u32>>; // a distance, whose bits grow with it as it is not negative
@group(0) @binding(6) var<storage, read> vertices: array<f32>;

var<workgroup> furthest: atomic<u32>;

@compute @workgroup_size(64)
fn measure(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) local: u32,
           @builtin(num_workgroups) groups: vec3<u32>) {
    var most = 0.0;
    for (var at = FLOATS * id.x; at + 2u < arrayLength(&vertices); at += FLOATS * 64u * groups.x) {
        most = max(most, length(vec3(vertices[at], vertices[at + 1u], vertices[at + 2u]) + view.offset));
    }
    atomicMax(&furthest, bitcast<u32>(most + view.beyond));
    workgroupBarrier();
    if (local == 0u) {
        atomicMax(&reach[0], atomicLoad(&furthest));
    }
}

// Returns how far from its place an instance of size 1 is seen. Its vertices are on the lines from the rest pose through where they
// are at amplitude 1, as many times as far along.
fn reach_of(amplitude: f32) -> f32 {
    let moved = max(view.rest, bitcast<f32>(atomicLoad(&reach[0])));
    if (view.headed == 1u) {
        return view.rest + abs(amplitude) * (view.rest + moved);
    }
    return moved * max(1.0, 2.0 * abs(amplitude - 0.5));
}

fn is_seen(centre: vec3<f32>, radius: f32) -> bool {
    for (var k = 0u; k < 6u; k++) {
        if (dot(view.planes[k].xyz, centre) + view.planes[k].w < -radius) {
            return false;
        }
    }
    return true;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.count || view.shapes == 0u) {
        return;
    }
    let place = instances[id.x].place;
    if (!is_seen(place.xyz, place.w * reach_of(instances[id.x].look.x))) {
        return;
    }
    let hidden = view.pixel * max(distance(view.eye, place.xyz) - 0.5 * view.near * place.w, 1e-6) / place.w;
    var chosen = 0u;
    while (chosen + 1u < view.shapes && shapes[chosen + 1u].tolerance <= hidden) {
        chosen++;
    }
    let list = shapes[chosen].list;
    lists[list * view.room + atomicAdd(&draws[5u * list + 1u], 1u)] = id.x;
}
`;var qe=`// The end of pass 2, when all depths have been placed: joins, matrices, corrections, and motion that is baked.

@group(0) @binding(3) var<storage, read_write> positions: array<f32>;
@group(0) @binding(4) var<storage, read_write> matrices: array<f32>;
@group(0) @binding(5) var<uniform> which: u32; // The source of each place whose corrections are added.

const FOOTPRINTS = array<array<f32, 4>, 3>(
    array<f32, 4>(32.0, 0.0, 0.0, 0.0), array<f32, 4>(32.0, 16.0, 0.0, 0.0), array<f32, 4>(32.0, 27.0, 16.0, 5.0),
);

fn is_joined() -> bool {
    return source.frame < segment(JOIN_FRAMES);
}

// The shares of jumps and of slopes that remain at the frame.
fn curve() -> vec2<f32> {
    let at = segment(JOIN_CURVE) + 2u * source.frame;
    return run.strength * source.weight * vec2<f32>(segment_float(at), segment_float(at + 1u));
}

fn join_position(b: u32, index: u32) {
    let steps = segment(JOIN_STEPS) + 2u * b;
    let step = curve() * vec2<f32>(segment_float(steps), segment_float(steps + 1u));
    for (var axis = 0u; axis < 3u; axis++) {
        let word = segment(segment(JOINS) + 3u * index + axis);
        positions[run.positions + 3u * index + axis] += f32(half(word, 0u)) * step.x + f32(half(word, 1u)) * step.y;
    }
}

// Numbers of R, row by row, then of c, as a matrix has them: R and c side by side.
fn join_matrix(index: u32) {
    for (var k = 0u; k < 12u; k++) {
        let at = segment(MATRIX_JOINS) + 2u * (12u * index + k);
        let place = select(4u * (k - 9u) + 3u, 4u * (k / 3u) + k % 3u, k < 9u);
        matrices[run.matrices + 12u * index + place] += segment_float(at) * curve().x + segment_float(at + 1u) * curve().y;
    }
}

// From c + R (x0 - a) to R x0 and a sum.
fn finish_matrix(index: u32, a: vec3<f32>) {
    for (var axis = 0u; axis < 3u; axis++) {
        let at = run.matrices + 12u * index + 4u * axis;
        matrices[at + 3u] -= dot(vec3<f32>(matrices[at], matrices[at + 1u], matrices[at + 2u]), a);
    }
}

// One workgroup per body.
@compute @workgroup_size(64)
fn bodies(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
          @builtin(local_invocation_index) i: u32) {
    run = place_at(group.y);
    let b = group.x + groups.x * group.z;
    if (b >= level[BODY_COUNT]) {
        return;
    }
    let body = body_at(b);
    let is_node = (body.flags & NODE) != 0u;
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        if (is_joined() && !is_node && i < body.count) {
            join_position(b, body.first + i);
        } else if (is_joined() && is_node && i == 0u) {
            join_matrix(body.first);
        }
    }
    if (is_node && i == 0u) {
        finish_matrix(body.first, body.rest_point);
    }
}

// One invocation per corrected position of a source.
@compute @workgroup_size(64)
fn corrections(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = place_at(id.y);
    if (which >= run.source_count) {
        return;
    }
    source = source_at(which);
    if (i >= segment(CORRECTED_COUNT)) {
        return;
    }
    let own = segment(CORRECTED) + 2u * i;
    var sum = vec3<f32>(0.0);
    for (var c = segment(own + 1u); c < segment(own + 3u); c++) {
        let at = segment(CORRECTIONS) + 2u * c;
        let low = segment(at);
        let high = segment(at + 1u);
        let away = abs(i32(source.frame) - i32((high >> 16u) & 0xffu));
        if (away < 4) {
            let width = high >> 24u;
            let part = FOOTPRINTS[width & 15u][away] * exp2(f32(width >> 4u));
            sum += part * vec3<f32>(f32(half(low, 0u)), f32(half(low, 1u)), f32(half(high, 0u)));
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        positions[run.positions + 3u * segment(own) + axis] +=
            sum[axis] * run.strength * source.weight * segment_float(CORRECTION_PART);
    }
}

// One invocation per number of a position, in place of all passes before.
@compute @workgroup_size(64)
fn baked(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = place_at(id.y);
    let count = 3u * level[POSITION_COUNT];
    if (i >= count) {
        return;
    }
    var sum = 0.0;
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        sum += source.weight * segment_float(segment(BAKED) + source.frame * count + i);
    }
    positions[run.positions + i] = sum;
}
`;var Ye=`// Pass 2: bodies of one depth, each placed from the one that it hangs on; amplitudes of all sources of a place add up. One
// workgroup per body, one invocation per position.

@group(0) @binding(8) var<uniform> depth: u32; // Depth of the bodies that this pass places.
@group(0) @binding(3) var<storage, read> amplitudes: array<f32>;
@group(0) @binding(4) var<storage, read_write> positions: array<f32>;
@group(0) @binding(5) var<storage, read_write> matrices: array<f32>;
@group(0) @binding(6) var<storage, read_write> parent_modes: array<f32>; // The modes of a body begin at its first position.
@group(0) @binding(7) var<storage, read_write> frames: array<f32>; // For each body: rotation, point.

const SHIFT = 64u;
const ROTATION = 65u;
const POLAR_ITERATIONS = 4;
const IDENTITY = mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

var<workgroup> modes: array<vec3<f32>, 64>;
var<workgroup> placed: array<vec3<f32>, 64>; // before: what modes of the parent add to its tangent

struct Frame {
    point: vec3<f32>,
    rotation: mat3x3<f32>,
}

fn amplitude(row: u32) -> vec3<f32> {
    let at = source.amplitudes + 3u * row;
    return vec3<f32>(amplitudes[at], amplitudes[at + 1u], amplitudes[at + 2u]);
}

fn position_at(index: u32) -> vec3<f32> {
    let at = run.positions + 3u * index;
    return vec3<f32>(positions[at], positions[at + 1u], positions[at + 2u]);
}

// Returns what mode m of its parent adds to the tangent that a body follows.
fn way_by_mode(body: Body, m: u32) -> vec3<f32> {
    let parent = level[BODIES] + BODY_WORDS * u32(max(body.parent, 0));
    if ((body.flags & FOLLOWS) == 0u || m >= level[parent + 4u]) {
        return vec3<f32>(0.0);
    }
    let at = run.modes + 3u * (level[parent + 5u] + m);
    let mode = vec3<f32>(parent_modes[at], parent_modes[at + 1u], parent_modes[at + 2u]);
    return level_float(level[BASES] + body.way + m) * mode;
}

// The rotation of the quaternion normalize(1, q) squared.
fn squared(q: vec3<f32>) -> mat3x3<f32> {
    let n2 = dot(q, q);
    let scale = 1.0 / (1.0 + n2);
    let w = (1.0 - n2) * scale;
    let v = 2.0 * q * scale;
    let x = v.x;
    let y = v.y;
    let z = v.z;
    return mat3x3<f32>( // columns
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y),
    );
}

fn unit(v: vec3<f32>) -> vec3<f32> {
    let n2 = dot(v, v);
    return select(v, v / sqrt(n2), n2 > 1e-30);
}

// The rotation by the least angle from u to v, which have length 1; beyond a right angle by less and less.
fn between(u: vec3<f32>, v: vec3<f32>) -> mat3x3<f32> {
    let axis = cross(u, v);
    let w = 1.0 + max(dot(u, v), 0.0);
    let sine2 = dot(axis, axis);
    let h = 2.0 / (w * w + sine2);
    let g = w * h * axis;
    let c = 1.0 - h * sine2;
    return mat3x3<f32>(
        h * axis * axis.x + vec3<f32>(c, g.z, -g.y),
        h * axis * axis.y + vec3<f32>(-g.z, c, g.x),
        h * axis * axis.z + vec3<f32>(g.y, -g.x, c),
    );
}

fn hung(body: Body) -> Frame {
    if (body.parent < 0) {
        return Frame(body.rest_point, IDENTITY);
    }
    let at = run.bodies + 12u * u32(body.parent);
    var rotation = mat3x3<f32>(
        frames[at], frames[at + 1u], frames[at + 2u],
        frames[at + 3u], frames[at + 4u], frames[at + 5u],
        frames[at + 6u], frames[at + 7u], frames[at + 8u],
    );
    if ((body.flags & FOLLOWS) != 0u) {
        var way = vec3<f32>(0.0);
        for (var m = 0u; m < 64u; m++) {
            way += placed[m];
        }
        rotation = rotation * between(unit(body.tangent), unit(body.tangent + way));
    }
    return Frame(position_at(u32(body.attach)), rotation);
}

// Returns the rotation that a row stands for.
fn turn_of(own: Move, row: u32) -> vec3<f32> {
    let at = segment(TURNS) + own.turn;
    let q = amplitude(row);
    var omega = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let turn = vec3<f32>(segment_float(at + 3u * k), segment_float(at + 3u * k + 1u), segment_float(at + 3u * k + 2u));
        omega[k] = dot(turn, q);
    }
    return omega;
}

// The rows of a shift and of a rotation, where there are any, are the first of a body.
fn turned(b: u32, body: Body) -> Frame {
    var frame = hung(body);
    var omega = vec3<f32>(0.0);
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        let own = move_at(b);
        for (var r = own.row; r < own.row + min(own.rows, 2u); r++) {
            let slot = row_at(r).slot;
            if (slot == SHIFT) {
                frame.point += amplitude(r);
            } else if (slot == ROTATION) {
                omega += turn_of(own, r);
            }
        }
    }
    frame.rotation = frame.rotation * squared(0.25 * omega);
    return frame;
}

// Mode m of a body with shapes: what they add up to.
fn unshaped(body: Body, own: Move, m: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var r = own.row; r < own.row + own.rows; r++) {
        let slot = row_at(r).slot;
        let tracks = amplitude(r);
        for (var axis = 0u; axis < 3u; axis++) {
            let shape = 3u * slot + axis;
            if (slot < body.shape_modes && shape < own.shape_count) {
                let at = segment(SHAPES) + own.shapes + 3u * (shape * body.shape_modes + m);
                sum += tracks[axis] * vec3<f32>(segment_float(at), segment_float(at + 1u), segment_float(at + 2u));
            }
        }
    }
    return sum;
}

// How far modes move position i of a body, or column i of a node's map.
fn moved_by_modes(body: Body, top: u32, i: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var m = 0u; m < top; m++) {
        sum += level_float(level[BASES] + body.basis + m * body.count + i) * modes[m];
    }
    return sum;
}

// A step of Newton's method from R to the rotation nearest to H.
fn turned_towards(H: mat3x3<f32>, R: mat3x3<f32>) -> mat3x3<f32> {
    let C = H * transpose(R);
    let axial = vec3<f32>(C[1].z - C[2].y, C[2].x - C[0].z, C[0].y - C[1].x);
    let spare = max(1.0 - (C[0].x + C[1].y + C[2].z), 0.0) + 1e-6;
    let a = C[1].y + C[2].z + spare; // Differences from the trace would lose precision.
    let b = C[0].x + C[2].z + spare;
    let c = C[0].x + C[1].y + spare;
    let d = -0.5 * (C[1].x + C[0].y);
    let e = -0.5 * (C[2].x + C[0].z);
    let f = -0.5 * (C[2].y + C[1].z);
    let x = vec3<f32>(b * c - f * f, e * f - d * c, d * f - e * b);
    let y = vec3<f32>(e * f - d * c, a * c - e * e, d * e - a * f);
    let z = vec3<f32>(d * f - e * b, d * e - a * f, a * b - d * d);
    let determinant = a * x.x + d * x.y + e * x.z;
    return squared(vec3<f32>(dot(x, axial), dot(y, axial), dot(z, axial)) * (0.25 / determinant)) * R;
}

// How a sheet has turned in its own frame: by the rotation nearest to what took its rest pose to \`placed\`.
fn fitted(body: Body) -> mat3x3<f32> {
    var H = mat3x3<f32>();
    var size2 = 0.0;
    for (var i = 0u; i < body.count; i++) {
        let offset = rest_of(body.vertex + i) - body.rest_point;
        size2 += dot(offset, offset);
        H += mat3x3<f32>(placed[i] * offset.x, placed[i] * offset.y, placed[i] * offset.z);
    }
    H += 0.01 * size2 * IDENTITY;
    let norm2 = dot(H[0], H[0]) + dot(H[1], H[1]) + dot(H[2], H[2]);
    var R = IDENTITY;
    if (norm2 > 1e-30) {
        H = H * (1.0 / sqrt(norm2));
        for (var step = 0; step < POLAR_ITERATIONS; step++) {
            R = turned_towards(H, R);
        }
    }
    return R;
}

fn write_column(node: u32, column: u32, v: vec3<f32>) {
    for (var axis = 0u; axis < 3u; axis++) {
        matrices[run.matrices + 12u * node + 4u * axis + column] = v[axis];
    }
}

fn write_frame(b: u32, frame: Frame) {
    for (var axis = 0u; axis < 3u; axis++) {
        for (var column = 0u; column < 3u; column++) {
            frames[run.bodies + 12u * b + 3u * column + axis] = frame.rotation[column][axis];
        }
        frames[run.bodies + 12u * b + 9u + axis] = frame.point[axis];
    }
}

// Adds the modes of a body in the source that is set, and returns the least that those above are nothing of.
fn add_modes(b: u32, body: Body, i: u32) -> u32 {
    let own = move_at(b);
    let from_shapes = select(0u, body.shape_modes, own.shape_count > 0u);
    for (var r = i; r < own.rows; r += 64u) {
        let slot = row_at(own.row + r).slot;
        if (slot >= from_shapes && slot < SHIFT) {
            modes[slot] += amplitude(own.row + r);
        }
    }
    if (i < from_shapes) {
        modes[i] += unshaped(body, own, i);
    }
    if (own.rows == 0u) {
        return from_shapes;
    }
    let last = row_at(own.row + own.rows - 1u).slot;
    return max(from_shapes, select(0u, last + 1u, last < SHIFT));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) i: u32) {
    run = place_at(group.y);
    let at = level[level[DEPTHS] + depth] + group.x + groups.x * group.z;
    if (at >= level[level[DEPTHS] + depth + 1u]) {
        return;
    }
    let b = level[level[ORDER] + at];
    let body = body_at(b);
    modes[i] = vec3<f32>(0.0);
    placed[i] = way_by_mode(body, i);
    workgroupBarrier();
    var top = 0u;
    for (var s = 0u; s < places[PLACE_WORDS * group.y + 1u]; s++) { // The count is uniform over the workgroup.
        source = source_at(s);
        top = max(top, add_modes(b, body, i));
        workgroupBarrier();
    }
    var frame = turned(b, body);
    workgroupBarrier();
    let is_node = (body.flags & NODE) != 0u;
    if (i < body.count) {
        let by_modes = moved_by_modes(body, top, i);
        if (is_node) {
            write_column(body.first, i, frame.rotation * (IDENTITY[i] + by_modes));
        } else {
            placed[i] = rest_of(body.vertex + i) - body.rest_point + by_modes;
            let x = frame.point + frame.rotation * placed[i];
            for (var axis = 0u; axis < 3u; axis++) {
                positions[run.positions + 3u * (body.first + i) + axis] = x[axis];
                parent_modes[run.modes + 3u * (body.first + i) + axis] = modes[i][axis];
            }
        }
    }
    workgroupBarrier();
    if (i == 0u && is_node) {
        write_column(body.first, 3u, frame.point);
    }
    if (i == 0u && !is_node) {
        if ((body.flags & FITTED) != 0u) {
            frame.rotation = frame.rotation * fitted(body);
        }
        write_frame(b, frame);
    }
}
`;var Ke=`// Pass 1: what each row is at the frame of each source. One invocation per row.

@group(0) @binding(3) var<storage, read_write> amplitudes: array<f32>;

const WIDE = 128u;

fn value(row: Row, index: u32) -> f32 {
    let at = segment(VALUES) + row.values;
    if ((row.waves & WIDE) != 0u) {
        return f32(bitcast<i32>(segment(at + index)));
    }
    return f32(half(segment(at + index / 2u), index % 2u));
}

fn evaluate(r: u32) {
    let row = row_at(r);
    let frames = segment(FRAMES);
    let waves = segment(WAVE_SETS + (row.waves & 127u)) + source.frame;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < row.count; k++) {
        let integers = vec3<f32>(value(row, k), value(row, row.count + k), value(row, 2u * row.count + k));
        sum += integers * segment_float(waves + k * frames);
    }
    for (var axis = 0u; axis < 3u; axis++) {
        amplitudes[source.amplitudes + 3u * r + axis] = run.strength * source.weight * row.step * sum[axis];
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = place_at(id.y);
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        if (i < segment(ROW_COUNT)) {
            evaluate(i);
        }
    }
}
`;var Xe=`// Pass 3: vertices at a time, between two frames that the passes before have placed. \`vertex_at\` is what a vertex stage calls;
// here it writes all of them, for tests and for engines that compute once what several views draw. One invocation per vertex.

struct Run {
    positions: vec4<u32>, // numbers before those of the two frames now, and of the two that the time drawn before lies between
    matrices: vec4<u32>,
    weights: vec2<f32>, // Weights of the second of each pair.
    with_normals: u32,
    vertices: u32, // number before those that are written
}

struct Vertex {
    position: vec3<f32>,
    normal: vec3<f32>,
    previous: vec3<f32>,
}

@group(0) @binding(1) var<storage, read> corners: array<u32>; // see \`normal_at\`
@group(0) @binding(2) var<storage, read> shows: array<Run>; // one for each y of the workgroups
var<private> run: Run;
@group(0) @binding(3) var<storage, read> positions: array<f32>;
@group(0) @binding(4) var<storage, read> matrices: array<f32>;
@group(0) @binding(5) var<storage, read_write> vertices: array<f32>; // position, normal, previous position of each

const MOVED = 0x80000000u;
const VERTEX_COUNT = 2u;
const VERTICES = 7u;

@group(0) @binding(0) var<storage, read> level: array<u32>;

fn mixed_position(index: u32, now: u32) -> vec3<f32> {
    let a = run.positions[2u * now] + 3u * index;
    let b = run.positions[2u * now + 1u] + 3u * index;
    return mix(
        vec3<f32>(positions[a], positions[a + 1u], positions[a + 2u]),
        vec3<f32>(positions[b], positions[b + 1u], positions[b + 2u]),
        run.weights[now],
    );
}

// The row of a matrix at the time.
fn mixed_row(index: u32, row: u32, now: u32) -> vec4<f32> {
    let a = run.matrices[2u * now] + 12u * index + 4u * row;
    let b = run.matrices[2u * now + 1u] + 12u * index + 4u * row;
    return mix(
        vec4<f32>(matrices[a], matrices[a + 1u], matrices[a + 2u], matrices[a + 3u]),
        vec4<f32>(matrices[b], matrices[b + 1u], matrices[b + 2u], matrices[b + 3u]),
        run.weights[now],
    );
}

// now: 0; 1: at the time drawn before.
fn position_at(v: u32, now: u32) -> vec3<f32> {
    let at = level[VERTICES] + 4u * v;
    let binding = level[at + 3u];
    let index = binding & ~MOVED;
    if ((binding & MOVED) == 0u) {
        return mixed_position(index, now);
    }
    let rest = vec4<f32>(bitcast<f32>(level[at]), bitcast<f32>(level[at + 1u]), bitcast<f32>(level[at + 2u]), 1.0);
    return vec3<f32>(
        dot(mixed_row(index, 0u, now), rest), dot(mixed_row(index, 1u, now), rest), dot(mixed_row(index, 2u, now), rest),
    );
}

// The mean normal of the triangles at a vertex, by their area. corners: where those of each vertex begin, and one behind the last;
// then of each triangle at a vertex its two other corners.
fn normal_at(v: u32, x: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var c = corners[v]; c < corners[v + 1u]; c += 2u) {
        sum += cross(position_at(corners[c], 0u) - x, position_at(corners[c + 1u], 0u) - x);
    }
    let n2 = dot(sum, sum);
    return select(vec3<f32>(0.0), sum / sqrt(n2), n2 > 0.0);
}

fn vertex_at(v: u32) -> Vertex {
    let x = position_at(v, 0u);
    var normal = vec3<f32>(0.0);
    if (run.with_normals != 0u) {
        normal = normal_at(v, x);
    }
    return Vertex(x, normal, position_at(v, 1u));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = shows[id.y];
    if (i >= level[VERTEX_COUNT]) {
        return;
    }
    let vertex = vertex_at(i);
    for (var axis = 0u; axis < 3u; axis++) {
        vertices[run.vertices + 9u * i + axis] = vertex.position[axis];
        vertices[run.vertices + 9u * i + 3u + axis] = vertex.normal[axis];
        vertices[run.vertices + 9u * i + 6u + axis] = vertex.previous[axis];
    }
}
`;var[Ze,Je,_o,Mo,Eo,So]=[2,3,4,5,6,10],[To,Ao,Oo]=[5,6,19],Po=64,ct=8,oe=4,re=12,Do=9,kt=n=>Math.ceil(n/Po),Ct=class{constructor(t,{blocks:e,time:s,hierarchy:i,finish:o,vertices:r}){let a=(...c)=>t.createShaderModule({code:c.join(`
`)}),h=(c,u="main")=>t.createComputePipeline({layout:"auto",compute:{module:c,entryPoint:u}}),l=a(e,o);this.time=h(a(e,s)),this.hierarchy=h(a(e,i)),this.bodies=h(l,"bodies"),this.corrections=h(l,"corrections"),this.baked=h(l,"baked"),this.vertices=h(a(r))}},Nt=class{uploaded=0;#t=new Map;#e=0;#i=0;#n=0;constructor(t,e,s,{slots:i=2,shown:o=1,vertices:r=null,across:a=t.limits.maxComputeWorkgroupsPerDimension}={}){Object.assign(this,{device:t,kernels:e,words:s,slots:i,shown:o,across:a}),this.size={positions:3*s[_o],matrices:12*s[Mo],bodies:12*s[Je],vertices:Do*s[Ze]},this.baked=!1;let{positions:h,matrices:l,bodies:c}=this.size;this.buffers={level:this.#s(s),segments:this.#o(1),places:this.#o((ct+oe)*i),shows:this.#o(re*o),amplitudes:this.#o(1),positions:this.#o(i*h),matrices:this.#o(i*l),modes:this.#o(i*h),bodies:this.#o(i*c),corners:this.#o(1),vertices:r??this.#o(o*this.size.vertices)},this.ownsVertices=!r,this.depths=Array.from({length:s[Eo]},(u,f)=>{let[d,m]=s.subarray(s[So]+f);return{count:m-d,uniform:this.#a(f)}}),this.ordinals=[],this.hasCorners=!1}get bytes(){return Object.values(this.buffers).reduce((t,{size:e})=>t+e,0)}#o(t,e=140){return this.device.createBuffer({size:Math.max(16,4*t),usage:e})}#s(t,e=140){let s=this.#o(t.length,e);return this.#h(s,t),s}#a(t){return this.#s(new Uint32Array([t,0,0,0]),72)}#h(t,e,s=0,i=e.length){this.uploaded+=4*i,this.device.queue.writeBuffer(t,4*s,e.buffer,e.byteOffset,4*i)}#f(t,e,s=0){let i=this.buffers[t],{device:o}=this;if(4*e<=i.size)return;let r=this.#o(e);if(s>0){let a=o.createCommandEncoder();a.copyBufferToBuffer(i,0,r,0,4*s),o.queue.submit([a.finish()])}i.destroy(),this.buffers[t]=r,this.#t.clear()}segment(t){let e=this.#n;return e+t.length>this.buffers.segments.size/4&&this.#f("segments",2*(e+t.length),e),this.#h(this.buffers.segments,t,e),this.#n+=t.length,this.#e=Math.max(this.#e,t[To]),this.#i=Math.max(this.#i,t[Ao]),this.baked||=t[Oo]!==0,e}setCorners(t){this.buffers.corners.destroy(),this.buffers.corners=this.#s(t),this.hasCorners=!0,this.#t.clear()}#r(t,e,[s,i],o,r=null){if(s===0||i===0)return;let a=r??e;if(!this.#t.has(a)){let l=o.flatMap((u,f)=>u?[{binding:f,resource:{buffer:this.buffers[u]}}]:[]);r&&l.push({binding:o.length,resource:{buffer:r}});let c=this.kernels[e].getBindGroupLayout(0);this.#t.set(a,this.device.createBindGroup({layout:c,entries:l}))}t.setPipeline(this.kernels[e]),t.setBindGroup(0,this.#t.get(a));let h=Math.min(s,this.across);t.dispatchWorkgroups(h,i,Math.ceil(s/h))}run(t,e){let s=this.device.createCommandEncoder(),i=s.beginComputePass();t.length>0&&this.#c(i,t),e.length>0&&this.#m(i,e),i.end(),this.device.queue.submit([s.finish()])}#c(t,e){let{positions:s,bodies:i}=this.size,o=e.length;if(this.#d(e),this.baked){this.#r(t,"baked",[kt(s),o],["level","segments","places","positions"]);return}this.#r(t,"time",[kt(this.#e),o],[null,"segments","places","amplitudes"]);let r=["amplitudes","positions","matrices","modes","bodies"];for(let h of this.depths)this.#r(t,"hierarchy",[h.count,o],["level","segments","places",...r],h.uniform);this.#r(t,"bodies",[this.words[Je],o],["level","segments","places","positions","matrices"]);let a=Math.max(...e.map(({sources:h})=>h.length));for(;this.ordinals.length<a;)this.ordinals.push(this.#a(this.ordinals.length));for(let h of this.ordinals.slice(0,a))this.#r(t,"corrections",[kt(this.#i),o],[null,"segments","places","positions",null],h)}#d(t){let{positions:e,matrices:s,bodies:i}=this.size,o=t.reduce((c,{sources:u})=>c+u.length,0),r=new Uint32Array(ct*t.length+oe*o),a=new Float32Array(r.buffer),h=ct*t.length,l=0;t.forEach(({sources:c,slot:u,strength:f=1},d)=>{r.set([h,c.length,u*e,u*s,d*e,d*i],ct*d),a[ct*d+6]=f;for(let{segment:m,frame:p,weight:y=1}of c)r.set([m,p,3*this.#e*l++],h),a[h+3]=y,h+=oe}),this.#f("places",r.length),this.#f("amplitudes",3*this.#e*o),this.#h(this.buffers.places,r)}#m(t,e){let{positions:s,matrices:i,vertices:o}=this.size,r=new Uint32Array(re*e.length),a=new Float32Array(r.buffer);e.forEach(({slots:h,weight:l,previous:c=h,previousWeight:u=l,at:f=null},d)=>{let m=re*d;[...h,...c].forEach((p,y)=>{r[m+y]=p*s,r[m+4+y]=p*i}),a[m+8]=l,a[m+9]=u,r[m+10]=this.hasCorners?1:0,r[m+11]=(f??d)*o}),this.#h(this.buffers.shows,r),this.#r(t,"vertices",[kt(this.words[Ze]),e.length],["level","corners","shows","positions","matrices","vertices"])}async read(t){this.run([],t);let e=this.device.createCommandEncoder(),s=4*this.size.vertices*t.length,i=this.device.createBuffer({size:s,usage:9});e.copyBufferToBuffer(this.buffers.vertices,0,i,0,s),this.device.queue.submit([e.finish()]),await i.mapAsync(1);let o=new Float32Array(i.getMappedRange().slice(0));return i.destroy(),o}dispose(){for(let t of[...this.depths.map(e=>e.uniform),...this.ordinals])t.destroy();for(let[t,e]of Object.entries(this.buffers))(t!=="vertices"||this.ownsVertices)&&e.destroy()}};var ut=null,Ro=.001,It=class{#t=new Map([[ut,1]]);#e=new Map([[ut,1]]);set(t){let e=t?[...t.values()].reduce((s,i)=>s+i,0):0;this.#t=e>0?new Map([...t].map(([s,i])=>[s,i/e])):new Map([[ut,1]])}get clips(){return[...this.#t.keys()].filter(t=>t!==ut)}advance(t,e){let s=[...this.#t].filter(([l,c])=>c>0&&(l===ut||e(l))),i=s.reduce((l,[,c])=>l+c,0),o=new Map(s.map(([l,c])=>[l,c/i]));if(o.size===0)return;let a=[...new Set([...this.#e.keys(),...o.keys()])].map(l=>[l,(this.#e.get(l)??0)*(1-t)+(o.get(l)??0)*t]).filter(([l,c])=>c>Ro||o.has(l)),h=a.reduce((l,[,c])=>l+c,0);this.#e=new Map(a.map(([l,c])=>[l,c/h]))}of(t){let e=new Map;for(let[s,i]of this.#e)e.set(s??t,(e.get(s??t)??0)+i);return e}};function Qe(n,t,e){let{firstFrame:s,frameCount:i,lastTime:o}=t,r=G(t);if(i===1||!(r>0))return[{frame:s,weight:1}];let a=(e%r+r)%r;return a<o?ko(n,t,a):ts(s+i-1,s,Math.min((a-o)/(r-o),1))}function ko(n,{firstFrame:t,frameCount:e},s){let i=n[t]+s,o=t,r=t+e-1;for(;r-o>1;){let a=o+r>>1;n[a]<=i?o=a:r=a}return r===o?[{frame:o,weight:1}]:ts(o,r,Math.min(Math.max((i-n[o])/(n[r]-n[o]),0),1))}var ts=(n,t,e)=>[{frame:n,weight:1-e},{frame:t,weight:e}];var ft=32,dt=12,mt=4,is=1.5,os=2,Go=.85,rs=40,ae=9,Vo=65536,$o=64,qo=16777215,Yo=n=>n?new Uo({color:7035717}):new Bo({color:9083499,roughness:.8,side:No}),st=class extends Io{pixels=1;measure="p99";phases=8;ease=.2;bytesOfMotion=0;bytesOfParameters=0;levels=[];#t;#e;#i;#n;#o;#s;#a;#h;#f;#r=new Map;#c=[];#d=[];#m=new It;#l=0;#p=null;#u=null;#b=null;#S=null;#y=[];#_=new Co;#x=1;#g=0;#w=!1;#M=0;#P=new Float32Array(rs);#E=0;#v=null;#T=null;#A=1;#O=Lt.uniform(new ne(1,0,0));constructor(t,e,{geometry:s=e.geometry??e.lines,material:i=Yo,shape:o=r=>r}={}){if(super(),this.name="ath forest",this.#s=t.backend.device,!this.#s)throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");this.#t=t,this.#e=e,V(this,e.metadata),this.#i=s,this.#n=i,this.#o=o,this.#a=new Ct(this.#s,{blocks:Ve,time:Ke,hierarchy:Ye,finish:qe,vertices:Xe});let r=this.#s.createShaderModule({code:$e});[this.#h,this.#f]=["main","measure"].map(a=>this.#s.createComputePipeline({layout:"auto",compute:{module:r,entryPoint:a}})),this.reach=this.#s.createBuffer({size:4,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST}),this.view=this.#s.createBuffer({size:4*rs,usage:GPUBufferUsage.UNIFORM|GPUBufferUsage.COPY_DST}),this.tolerances=this.#s.createBuffer({size:8*ft,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST})}get count(){return this.#g}get plantCount(){return this.#c.length}get plants(){return this.#c.map(({clip:t,phase:e})=>[t.name,e])}get clips(){return Array.from(this.#r.keys(),({name:t})=>t)}get bytes(){return this.levels.reduce((t,{passes:e})=>t+e.bytes,0)}setInstances(t){let{motion:e,channel:s}=this.#e,{limits:i}=this.#s,o=new Float32Array(dt*Math.max(1,t.length));this.#B();let r=f=>this.#k(f)??e.clip,a=new Set(t.map(({clip:f})=>r(f))),h=Math.floor(i.maxStorageBufferBindingSize/(12*mt*s.info.placeCount)/Math.max(1,a.size)),l=Math.max(1,Math.min(this.phases,h)),c=new Map,u=(f,d=0)=>{let m=G(f)||1,p=Math.floor((d/m%1+1)%1*l),y=f.index*l+p;return c.has(y)||c.set(y,{index:c.size,clip:f,phase:p/l}),c.get(y).index};t.forEach(({x:f,y:d,z:m,size:p=1,angle:y=0,seconds:x,clip:b,tint:w=qo,amplitude:v=1},M)=>{o.set([f,d,m,p,Math.cos(y),Math.sin(y),u(r(b),x),w,v],dt*M),this.#_.expandByPoint(new ne(f,d,m)),this.#x=Math.max(this.#x,p)}),this.#c=[...c.values()],this.#g=t.length;for(let f of[...a,...this.#m.clips])this.#I(f);return this.#p=this.#N(o,4),this.#u=new Lo(new Uint32Array(5*ft),5),this.#t.backend.createIndirectStorageAttribute(this.#u),this.#b=this.#N(new Uint32Array(ft*Math.max(1,this.#g)),1),this.#v=new Uint32Array(5*ft),this.#S=this.#D(this.#h,{0:this.#R(this.#p),1:this.view,2:this.tolerances,3:this.#R(this.#u),4:this.#R(this.#b),5:this.reach}),this}#D(t,e){let s=Object.entries(e).map(([i,o])=>({binding:Number(i),resource:{buffer:o}}));return this.#s.createBindGroup({layout:t.getBindGroupLayout(0),entries:s})}#k(t){return this.#e.motion.clips.find(({index:e,name:s})=>t===e||t===s)}#I(t){this.#r.has(t)||this.#r.set(t,this.#e.motion.clone().play(t.index).setLevel(Math.max(0,this.levels.length-1)).setTime(0))}#N(t,e){let s=new Ho(t,e);return this.#t.backend.createStorageAttribute(s),s}#R(t){return this.#t.backend.get(t).buffer}blend(t){let e=Object.entries(t??{}).map(([i,o])=>[this.#k(i),o]);if(e.findIndex(([i,o])=>!i||!(o>=0&&o<1/0))>=0||t&&!e.some(([,i])=>i>0))throw new RangeError(`blend: got ${JSON.stringify(t)}, expected weights of clips, ${this.#e.motion.clips.map(({name:i})=>i).join(", ")}`);for(let[i,o]of e)o>0&&this.#I(i);return this.#m.set(t&&new Map(e)),this}async wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);let s=this.#T={},{weights:i}=await this.#e.channel.windWeights(t,e),{clips:o}=this.#e.motion;return s===this.#T&&this.blend(Object.fromEntries(o.map(({name:r},a)=>[r,i[a]]))),this}sway(t,e=null){return this.#A=t,this.#O.value.set(Math.cos(e??0),Math.sin(e??0),e===null?0:1),this}#j(t){let e=this.levels.length,{motion:s}=this.#e;if(!this.#w){for(let i of this.levels)for(let[o,{readyLevel:r}]of this.#r)if(!i.clips.has(o)&&r>=i.level)return this.#L(()=>this.#W(i,o));if(!(e>=s.levelCount||e>0&&this.#C(e-1)<=t)){for(let i of this.#r.values())i.target<e&&i.setLevel(e);[...this.#r.values()].every(({readyLevel:i})=>i>=e)&&this.#L(()=>this.#H(e))}}}#L(t){this.#w=!0,t().catch(({message:e,codeName:s})=>this.#e.motion.dispatchEvent({type:"error",message:e,codeName:s}))}#C(t){return Math.max(...Array.from(this.#r.keys(),({errors:e})=>e[t][this.measure]))}async#H(t){let{channel:e}=this.#e,s=this.#M,i=()=>s===this.#M,[o,{words:r}]=[await e.parts(t),await e.gpu(t)];if(!i())return;let a=this.#c.length,h=this.#N(new Float32Array(ae*r[2]*a),1),l=new Nt(this.#s,this.#a,r,{slots:mt*a,shown:a,vertices:this.#R(h)}),c=this.#D(this.#f,{1:this.view,5:this.reach,6:this.#R(h)}),u={level:t,passes:l,shared:h,measured:c,clips:new Set,places:new Map,uploaded:0,bytesOfMotion:0,bytesOfParameters:0,strength:NaN,slots:this.#c.map(()=>new Array(mt).fill(-1)),before:this.#c.map(()=>null)};this.#e.hasFaces&&l.setCorners(Ko(this.#e.geometry,e));for(let f of this.#r.keys())if(!await this.#U(u,f,i)){l.dispose();return}this.levels.push(u),this.#G(u,o),this.#w=!1,this.dispatchEvent({type:"level",level:t})}async#W(t,e){let s=this.#M;await this.#U(t,e,()=>s===this.#M)&&(this.#w=!1)}async#U(t,e,s){let{channel:i}=this.#e,{passes:o,level:r,places:a}=t;for(let h=e.firstSegment;h<e.firstSegment+e.segmentCount;h++){let{words:l,coded:c}=await i.gpu(r,h);if(!s())return!1;let u=o.segment(l);this.#z(t,"bytesOfMotion"),c.forEach((f,d)=>a.set(i.segments[h]+d,{segment:u,frame:f}))}return t.clips.add(e),!0}#z(t,e){this[e]+=t.passes.uploaded-t.uploaded,t[e]+=t.passes.uploaded-t.uploaded,t.uploaded=t.passes.uploaded}#G(t,e){let{channel:s,motion:i,rest:o,sphere:r}=this.#e,{level:a}=t,h=this.#C(a),l=a>0?this.#C(a-1):r.radius/4,c=s.nodeNumbers(e);e.vertices.forEach((m,p)=>{m<0&&(c[p]=-1)});let u=a===i.levelCount-1?this.#i:Q(this.#i,o,is*h,c);this.#F(t,u,h);for(let m=Math.max(os*h,r.radius/2e3);m<l;m*=os){let p=Q(this.#i,o,is*m,c);p.userData.source.length>Go*u.userData.source.length||(this.#F(t,p,m),u=p)}let f=Float32Array.from({length:2*this.#y.length}),d=new Uint32Array(f.buffer);this.#y.sort((m,p)=>m.tolerance-p.tolerance).forEach((m,p)=>{f[2*p]=m.tolerance,d[2*p+1]=m.list}),this.#s.queue.writeBuffer(this.tolerances,0,f)}#F(t,e,s){let i=this.#y.length;if(i===ft)return;let o=this.#o(e,s).clone(),{source:r}=e.userData,a=!o.hasAttribute("normal"),h=this.#e.channel.vertexPlaces,l=o.userData.vertices??r,c=o.getAttribute("athOffset");for(let d=0;d<(c?.count??0);d++)this.#E=Math.max(this.#E,Math.hypot(c.getX(d),c.getY(d),c.getZ(d)));o.setAttribute("athVertex",new es(Uint32Array.from(l,d=>h[d]),1)),o.setAttribute("position",new es(Float32Array.from({length:3*l.length},(d,m)=>this.#e.rest[3*l[Math.floor(m/3)]+m%3]),3)),o.setIndirect(this.#u,20*i),this.#v[5*i]=o.index.count;let u=this.#n(a,t.level),f=a?new zo(o,u):new Fo(o,u);this.#V(u,o,t,i),f.frustumCulled=!1,f.castShadow=f.receiveShadow=!a,this.#y.push({level:t.level,tolerance:s,list:i,drawn:f,size:o.index.count}),this.add(f)}#V(t,e,{passes:s,shared:i},o){let{Fn:r,storage:a,uint:h,float:l,vec3:c,attribute:u,instanceIndex:f,positionGeometry:d,positionPrevious:m,normalLocal:p,normalGeometry:y,select:x}=Lt,{metadata:b,channel:{info:w},origin:v}=this.#e,M=b.up_axis==="z",g=this.#O,E=c(...w.origin.map((D,C)=>D-v[C])),S=h(s.words[2]),T=a(i,"float",i.count).toReadOnly(),N=a(this.#p,"vec4",dt/4*Math.max(1,this.#g)).toReadOnly(),J=a(this.#b,"uint",this.#b.count).toReadOnly(),z=(D,C,H)=>M?c(C.mul(D.x).sub(H.mul(D.y)),H.mul(D.x).add(C.mul(D.y)),D.z):c(C.mul(D.x).add(H.mul(D.z)),D.y,C.mul(D.z).sub(H.mul(D.x))),be=()=>J.element(h(o*Math.max(1,this.#g)).add(f)),Ns=e.hasAttribute("athOffset"),Is=s.hasCorners&&!e.userData.vertices;t.positionNode=r((D,C)=>{let H=be().toVar(),Gt=rt=>N.element(H.mul(dt/4).add(rt)).toVar(),ye=Gt(0),j=Gt(1),ve=Gt(2).x,Us=h(j.z).mul(S).add(u("athVertex","uint")).mul(ae).toVar(),Vt=rt=>c(...[0,1,2].map(bt=>T.element(Us.add(rt+bt)))),xe=rt=>{let bt=rt.add(E).sub(d).mul(ve).toVar(),Fs=g.x.mul(j.x).add(g.y.mul(j.y)),Bs=g.y.mul(j.x).sub(g.x.mul(j.y)),js=d.add(z(bt,Fs,Bs)),_e=x(g.z.greaterThan(.5),js,d.add(bt)).toVar(),Hs=Ns?_e.add(u("athOffset","vec3")):_e;return z(Hs,j.x,j.y).mul(ye.w).add(ye.xyz)},zs=()=>Is?y.add(Vt(3).sub(y).mul(ve)):y;return e.hasAttribute("normal")&&p.assign(z(zs(),j.x,j.y)),C.needsPreviousData?.()&&m.assign(xe(Vt(6))),xe(Vt(0))})();let Ls=r(()=>{let D=h(N.element(be().mul(dt/4).add(1)).w),C=H=>l(D.shiftRight(h(H)).bitAnd(h(255))).div(255);return c(C(16),C(8),C(0))})();t.colorNode=Lt.varying(Ls).mul(t.colorNode??(e.hasAttribute("color")?u("color","vec3"):Lt.materialColor))}update(t,e,s){if(!this.#S)return;let i=this.#$(t,e);this.#j(i),this.#q(s);let o=this.levels.filter(({level:r})=>r===0||this.#C(r-1)>i);for(let r of this.levels)o.includes(r)?this.#Y(r):r.before.fill(null);this.#Z(o)}#$(t,e){this.updateWorldMatrix(!0,!1),t.updateMatrixWorld();let{sphere:s,origin:i,channel:{info:o}}=this.#e,r=this.#P,a=s.center.length()+s.radius+this.#E,h=s.center.length()+1.2*s.radius,l=new ne().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new ss().copy(this.matrixWorld).invert());new jo().setFromProjectionMatrix(new ss().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld),t.coordinateSystem??Wo).planes.forEach(({normal:d,constant:m},p)=>r.set([d.x,d.y,d.z,m],4*p));let u=this.pixels*2*Math.tan(t.fov*Math.PI/360)/e,f=this.#_.distanceToPoint(l);return r.set([l.x,l.y,l.z,u],24),new Uint32Array(r.buffer).set([this.#g,this.#y.length],28),r[30]=h,new Uint32Array(r.buffer)[31]=Math.max(1,this.#g),r.set([...o.origin.map((d,m)=>d-i[m]),this.#E,a],32),new Uint32Array(r.buffer)[37]=this.#O.value.z,u*Math.max(f-.5*h*this.#x,1e-6)/this.#x}#q(t){let e=performance.now(),s=this.ease>0?1-Math.exp((this.#l-e)/(1e3*this.ease)):1;this.#l=e,this.#m.advance(s,o=>this.levels.every(r=>r.clips.has(o)));let{times:i}=this.#e.channel;this.#d=this.#c.map(({clip:o,phase:r})=>[...this.#m.of(o)].flatMap(([a,h])=>Qe(i,a,t+r*G(a)).map(({frame:l,weight:c})=>({frame:l,weight:h*c}))))}#Y(t){let e=[],s=[],i=this.#A,o=t.strength!==i;t.strength=i,this.#d.forEach((r,a)=>{let h=t.before[a];o&&t.slots[a].fill(-1);let l=r.length>2?this.#X(t,a,r,e):this.#K(t,a,r,e);s.push({...l,previous:h?.slots??l.slots,previousWeight:h?.weight??l.weight}),t.before[a]=l}),t.passes.run(e,s),this.#z(t,"bytesOfParameters")}#K(t,e,s,i){let o=t.slots[e],r=mt*e,a=s.map(({frame:l})=>l),h=a.map(l=>{let c=o.indexOf(l);return c<0&&(c=o.findIndex((u,f)=>!a.includes(u)&&!t.before[e]?.slots.includes(r+f)),o[c]=l,i.push({sources:[t.places.get(l)],slot:r+c,strength:t.strength})),r+c});return{slots:[h[0],h.at(-1)],weight:s.length>1?s[1].weight:0}}#X(t,e,s,i){let o=t.slots[e],r=mt*e,a=o.findIndex((l,c)=>!t.before[e]?.slots.includes(r+c));o[a]=-1;let h=s.filter(({weight:l})=>l>0).map(({frame:l,weight:c})=>({...t.places.get(l),weight:c}));return i.push({sources:h,slot:r+a,strength:t.strength}),{slots:[r+a,r+a],weight:0}}#Z(t){let{queue:e}=this.#s,s=this.#s.createCommandEncoder();e.writeBuffer(this.view,0,this.#P),e.writeBuffer(this.#R(this.#u),0,this.#v),e.writeBuffer(this.reach,0,new Uint32Array(1)),this.bytesOfParameters+=this.#P.byteLength+this.#v.byteLength+4;let i=s.beginComputePass();i.setPipeline(this.#f);for(let{measured:o,shared:r}of t)i.setBindGroup(0,o),i.dispatchWorkgroups(Math.ceil(Math.min(Vo,r.count/ae)/$o));i.setPipeline(this.#h),i.setBindGroup(0,this.#S),i.dispatchWorkgroups(Math.ceil(Math.max(1,this.#g)/64)),i.end(),e.submit([s.finish()])}async drawn(){let t=this.#v.byteLength,e=this.#s.createBuffer({size:t,usage:GPUBufferUsage.COPY_DST|GPUBufferUsage.MAP_READ}),s=this.#s.createCommandEncoder(),i=new Array(this.#e.motion.levelCount).fill(0);s.copyBufferToBuffer(this.#R(this.#u),0,e,0,t),this.#s.queue.submit([s.finish()]),await e.mapAsync(GPUMapMode.READ);let o=new Uint32Array(e.getMappedRange().slice(0));e.destroy();for(let{level:r,list:a}of this.#y)i[r]+=o[5*a+1];return i}async vertices(t){let{shared:e}=this.levels[t];return new Float32Array(await this.#t.getArrayBufferAsync(e))}#B(){this.#M++,this.#w=!1;for(let{drawn:t}of this.#y)t.removeFromParent(),t.geometry.dispose(),t.material.dispose();for(let{passes:t,shared:e}of this.levels)t.dispose(),this.#t.backend.destroyAttribute(e);for(let t of[this.#p,this.#u,this.#b].filter(Boolean))this.#t.backend.destroyAttribute(t);for(let t of this.#r.values())t.dispose();this.#r.clear(),this.levels=[],this.#y=[],this.#S=null,this.#_.makeEmpty(),this.#x=1e-9}dispose(){this.#B(),this.view.destroy(),this.reach.destroy(),this.tolerances.destroy()}};function Ko(n,{vertexPlaces:t,info:{placeCount:e}}){let s=Uint32Array.from(n.index.array,r=>t[n.userData.source[r]]),i=new Uint32Array(e+1),o=new Uint32Array(e+1+2*s.length);for(let r of s)i[r+1]++;for(let r=0;r<e;r++)i[r+1]+=i[r];for(let r=0;r<=e;r++)o[r]=e+1+2*i[r];for(let r=0;r<s.length;r++){let a=r-r%3,h=e+1+2*i[s[r]]++;o[h]=s[a+(r+1)%3],o[h+1]=s[a+(r+2)%3]}return o}import{ACESFilmicToneMapping as Zr,DoubleSide as Jr,MeshStandardNodeMaterial as Qr,PerspectiveCamera as tn,Scene as en,WebGPURenderer as sn}from"./three.webgpu.js";import{Controls as Xo,MOUSE as ot,Quaternion as ns,Spherical as as,TOUCH as it,Vector2 as L,Vector3 as B,Plane as Zo,Ray as Jo,MathUtils as Qo}from"./three.webgpu.js";var hs={type:"change"},le={type:"start"},cs={type:"end"},Ut=new Jo,ls=new Zo,tr=Math.cos(70*Qo.DEG2RAD),A=new B,R=2*Math.PI,_={NONE:-1,ROTATE:0,DOLLY:1,PAN:2,TOUCH_ROTATE:3,TOUCH_PAN:4,TOUCH_DOLLY_PAN:5,TOUCH_DOLLY_ROTATE:6},he=1e-6,zt=class extends Xo{constructor(t,e=null){super(t,e),this.state=_.NONE,this.target=new B,this.cursor=new B,this.minDistance=0,this.maxDistance=1/0,this.minZoom=0,this.maxZoom=1/0,this.minTargetRadius=0,this.maxTargetRadius=1/0,this.minPolarAngle=0,this.maxPolarAngle=Math.PI,this.minAzimuthAngle=-1/0,this.maxAzimuthAngle=1/0,this.enableDamping=!1,this.dampingFactor=.05,this.enableZoom=!0,this.zoomSpeed=1,this.enableRotate=!0,this.rotateSpeed=1,this.keyRotateSpeed=1,this.enablePan=!0,this.panSpeed=1,this.screenSpacePanning=!0,this.keyPanSpeed=7,this.zoomToCursor=!1,this.autoRotate=!1,this.autoRotateSpeed=2,this.keys={LEFT:"ArrowLeft",UP:"ArrowUp",RIGHT:"ArrowRight",BOTTOM:"ArrowDown"},this.mouseButtons={LEFT:ot.ROTATE,MIDDLE:ot.DOLLY,RIGHT:ot.PAN},this.touches={ONE:it.ROTATE,TWO:it.DOLLY_PAN},this.target0=this.target.clone(),this.position0=this.object.position.clone(),this.zoom0=this.object.zoom,this._cursorStyle="auto",this._domElementKeyEvents=null,this._lastPosition=new B,this._lastQuaternion=new ns,this._lastTargetPosition=new B,this._quat=new ns().setFromUnitVectors(t.up,new B(0,1,0)),this._quatInverse=this._quat.clone().invert(),this._spherical=new as,this._sphericalDelta=new as,this._scale=1,this._panOffset=new B,this._rotateStart=new L,this._rotateEnd=new L,this._rotateDelta=new L,this._panStart=new L,this._panEnd=new L,this._panDelta=new L,this._dollyStart=new L,this._dollyEnd=new L,this._dollyDelta=new L,this._dollyDirection=new B,this._mouse=new L,this._performCursorZoom=!1,this._pointers=[],this._pointerPositions={},this._controlActive=!1,this._onPointerMove=sr.bind(this),this._onPointerDown=er.bind(this),this._onPointerUp=ir.bind(this),this._onContextMenu=cr.bind(this),this._onMouseWheel=nr.bind(this),this._onKeyDown=ar.bind(this),this._onTouchStart=hr.bind(this),this._onTouchMove=lr.bind(this),this._onMouseDown=or.bind(this),this._onMouseMove=rr.bind(this),this._interceptControlDown=ur.bind(this),this._interceptControlUp=fr.bind(this),this.domElement!==null&&this.connect(this.domElement),this.update()}set cursorStyle(t){this._cursorStyle=t,t==="grab"?this.domElement.style.cursor="grab":this.domElement.style.cursor="auto"}get cursorStyle(){return this._cursorStyle}connect(t){super.connect(t),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointercancel",this._onPointerUp),this.domElement.addEventListener("contextmenu",this._onContextMenu),this.domElement.addEventListener("wheel",this._onMouseWheel,{passive:!1}),this.domElement.ownerDocument.addEventListener("keydown",this._interceptControlDown,{passive:!0,capture:!0}),this.domElement.style.touchAction="none"}disconnect(){this.state=_.NONE,this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.domElement.removeEventListener("pointercancel",this._onPointerUp),this.domElement.removeEventListener("wheel",this._onMouseWheel),this.domElement.removeEventListener("contextmenu",this._onContextMenu),this.stopListenToKeyEvents(),this.domElement.ownerDocument.removeEventListener("keydown",this._interceptControlDown,{capture:!0}),this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{capture:!0}),this._controlActive=!1,this._pointers.length=0,this._pointerPositions={},this.domElement.style.touchAction="",this.domElement.style.cursor="auto"}dispose(){this.disconnect()}getPolarAngle(){return this._spherical.phi}getAzimuthalAngle(){return this._spherical.theta}getDistance(){return this.object.position.distanceTo(this.target)}listenToKeyEvents(t){t.addEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=t}stopListenToKeyEvents(){this._domElementKeyEvents!==null&&(this._domElementKeyEvents.removeEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=null)}saveState(){this.target0.copy(this.target),this.position0.copy(this.object.position),this.zoom0=this.object.zoom}reset(){this.target.copy(this.target0),this.object.position.copy(this.position0),this.object.zoom=this.zoom0,this.object.updateProjectionMatrix(),this.dispatchEvent(hs),this.update(),this.state=_.NONE}pan(t,e){this._pan(t,e),this.update()}dollyIn(t){this._dollyIn(t),this.update()}dollyOut(t){this._dollyOut(t),this.update()}rotateLeft(t){this._rotateLeft(t),this.update()}rotateUp(t){this._rotateUp(t),this.update()}update(t=null){let e=this.object.position;A.copy(e).sub(this.target),A.applyQuaternion(this._quat),this._spherical.setFromVector3(A),this.autoRotate&&this.state===_.NONE&&this._rotateLeft(this._getAutoRotationAngle(t)),this.enableDamping?(this._spherical.theta+=this._sphericalDelta.theta*this.dampingFactor,this._spherical.phi+=this._sphericalDelta.phi*this.dampingFactor):(this._spherical.theta+=this._sphericalDelta.theta,this._spherical.phi+=this._sphericalDelta.phi);let s=this.minAzimuthAngle,i=this.maxAzimuthAngle;isFinite(s)&&isFinite(i)&&(s<-Math.PI?s+=R:s>Math.PI&&(s-=R),i<-Math.PI?i+=R:i>Math.PI&&(i-=R),s<=i?this._spherical.theta=Math.max(s,Math.min(i,this._spherical.theta)):this._spherical.theta=this._spherical.theta>(s+i)/2?Math.max(s,this._spherical.theta):Math.min(i,this._spherical.theta)),this._spherical.phi=Math.max(this.minPolarAngle,Math.min(this.maxPolarAngle,this._spherical.phi)),this._spherical.makeSafe(),this.enableDamping===!0?this.target.addScaledVector(this._panOffset,this.dampingFactor):this.target.add(this._panOffset),this.target.sub(this.cursor),this.target.clampLength(this.minTargetRadius,this.maxTargetRadius),this.target.add(this.cursor);let o=!1;if(this.zoomToCursor&&this._performCursorZoom||this.object.isOrthographicCamera)this._spherical.radius=this._clampDistance(this._spherical.radius);else{let r=this._spherical.radius;this._spherical.radius=this._clampDistance(this._spherical.radius*this._scale),o=r!=this._spherical.radius}if(A.setFromSpherical(this._spherical),A.applyQuaternion(this._quatInverse),e.copy(this.target).add(A),this.object.lookAt(this.target),this.enableDamping===!0?(this._sphericalDelta.theta*=1-this.dampingFactor,this._sphericalDelta.phi*=1-this.dampingFactor,this._panOffset.multiplyScalar(1-this.dampingFactor)):(this._sphericalDelta.set(0,0,0),this._panOffset.set(0,0,0)),this.zoomToCursor&&this._performCursorZoom){let r=null;if(this.object.isPerspectiveCamera){let a=A.length();r=this._clampDistance(a*this._scale);let h=a-r;this.object.position.addScaledVector(this._dollyDirection,h),this.object.updateMatrixWorld(),o=!!h}else if(this.object.isOrthographicCamera){let a=new B(this._mouse.x,this._mouse.y,0);a.unproject(this.object);let h=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),this.object.updateProjectionMatrix(),o=h!==this.object.zoom;let l=new B(this._mouse.x,this._mouse.y,0);l.unproject(this.object),this.object.position.sub(l).add(a),this.object.updateMatrixWorld(),r=A.length()}else console.warn("WARNING: OrbitControls.js encountered an unknown camera type - zoom to cursor disabled."),this.zoomToCursor=!1;r!==null&&(this.screenSpacePanning?this.target.set(0,0,-1).transformDirection(this.object.matrix).multiplyScalar(r).add(this.object.position):(Ut.origin.copy(this.object.position),Ut.direction.set(0,0,-1).transformDirection(this.object.matrix),Math.abs(this.object.up.dot(Ut.direction))<tr?this.object.lookAt(this.target):(ls.setFromNormalAndCoplanarPoint(this.object.up,this.target),Ut.intersectPlane(ls,this.target))))}else if(this.object.isOrthographicCamera){let r=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),r!==this.object.zoom&&(this.object.updateProjectionMatrix(),o=!0)}return this._scale=1,this._performCursorZoom=!1,o||this._lastPosition.distanceToSquared(this.object.position)>he||8*(1-this._lastQuaternion.dot(this.object.quaternion))>he||this._lastTargetPosition.distanceToSquared(this.target)>he?(this.dispatchEvent(hs),this._lastPosition.copy(this.object.position),this._lastQuaternion.copy(this.object.quaternion),this._lastTargetPosition.copy(this.target),!0):!1}_getAutoRotationAngle(t){return t!==null?R/60*this.autoRotateSpeed*t:R/60/60*this.autoRotateSpeed}_getZoomScale(t){let e=Math.abs(t*.01);return Math.pow(.95,this.zoomSpeed*e)}_rotateLeft(t){this._sphericalDelta.theta-=t}_rotateUp(t){this._sphericalDelta.phi-=t}_panLeft(t,e){A.setFromMatrixColumn(e,0),A.multiplyScalar(-t),this._panOffset.add(A)}_panUp(t,e){this.screenSpacePanning===!0?A.setFromMatrixColumn(e,1):(A.setFromMatrixColumn(e,0),A.crossVectors(this.object.up,A)),A.multiplyScalar(t),this._panOffset.add(A)}_pan(t,e){let s=this.domElement;if(this.object.isPerspectiveCamera){let i=this.object.position;A.copy(i).sub(this.target);let o=A.length();o*=Math.tan(this.object.fov/2*Math.PI/180),this._panLeft(2*t*o/s.clientHeight,this.object.matrix),this._panUp(2*e*o/s.clientHeight,this.object.matrix)}else this.object.isOrthographicCamera?(this._panLeft(t*(this.object.right-this.object.left)/this.object.zoom/s.clientWidth,this.object.matrix),this._panUp(e*(this.object.top-this.object.bottom)/this.object.zoom/s.clientHeight,this.object.matrix)):(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - pan disabled."),this.enablePan=!1)}_dollyOut(t){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale/=t:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_dollyIn(t){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale*=t:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_updateZoomParameters(t,e){if(!this.zoomToCursor)return;this._performCursorZoom=!0;let s=this.domElement.getBoundingClientRect(),i=t-s.left,o=e-s.top,r=s.width,a=s.height;this._mouse.x=i/r*2-1,this._mouse.y=-(o/a)*2+1,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()}_clampDistance(t){return Math.max(this.minDistance,Math.min(this.maxDistance,t))}_handleMouseDownRotate(t){this._rotateStart.set(t.clientX,t.clientY)}_handleMouseDownDolly(t){this._updateZoomParameters(t.clientX,t.clientY),this._dollyStart.set(t.clientX,t.clientY)}_handleMouseDownPan(t){this._panStart.set(t.clientX,t.clientY)}_handleMouseMoveRotate(t){this._rotateEnd.set(t.clientX,t.clientY),this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let e=this.domElement;this._rotateLeft(R*this._rotateDelta.x/e.clientHeight),this._rotateUp(R*this._rotateDelta.y/e.clientHeight),this._rotateStart.copy(this._rotateEnd),this.update()}_handleMouseMoveDolly(t){this._dollyEnd.set(t.clientX,t.clientY),this._dollyDelta.subVectors(this._dollyEnd,this._dollyStart),this._dollyDelta.y>0?this._dollyOut(this._getZoomScale(this._dollyDelta.y)):this._dollyDelta.y<0&&this._dollyIn(this._getZoomScale(this._dollyDelta.y)),this._dollyStart.copy(this._dollyEnd),this.zoomToCursor&&(this._performCursorZoom=!0,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()),this.update()}_handleMouseMovePan(t){this._panEnd.set(t.clientX,t.clientY),this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd),this.update()}_handleMouseWheel(t){this._updateZoomParameters(t.clientX,t.clientY),t.deltaY<0?this._dollyIn(this._getZoomScale(t.deltaY)):t.deltaY>0&&this._dollyOut(this._getZoomScale(t.deltaY)),this.update()}_handleKeyDown(t){let e=!1;switch(t.code){case this.keys.UP:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateUp(R*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,this.keyPanSpeed),e=!0;break;case this.keys.BOTTOM:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateUp(-R*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,-this.keyPanSpeed),e=!0;break;case this.keys.LEFT:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateLeft(R*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(this.keyPanSpeed,0),e=!0;break;case this.keys.RIGHT:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateLeft(-R*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(-this.keyPanSpeed,0),e=!0;break}e&&(t.preventDefault(),this.update())}_handleTouchStartRotate(t){if(this._pointers.length===1)this._rotateStart.set(t.pageX,t.pageY);else{let e=this._getSecondPointerPosition(t),s=.5*(t.pageX+e.x),i=.5*(t.pageY+e.y);this._rotateStart.set(s,i)}}_handleTouchStartPan(t){if(this._pointers.length===1)this._panStart.set(t.pageX,t.pageY);else{let e=this._getSecondPointerPosition(t),s=.5*(t.pageX+e.x),i=.5*(t.pageY+e.y);this._panStart.set(s,i)}}_handleTouchStartDolly(t){let e=this._getSecondPointerPosition(t),s=t.pageX-e.x,i=t.pageY-e.y,o=Math.sqrt(s*s+i*i);this._dollyStart.set(0,o)}_handleTouchStartDollyPan(t){this.enableZoom&&this._handleTouchStartDolly(t),this.enablePan&&this._handleTouchStartPan(t)}_handleTouchStartDollyRotate(t){this.enableZoom&&this._handleTouchStartDolly(t),this.enableRotate&&this._handleTouchStartRotate(t)}_handleTouchMoveRotate(t){if(this._pointers.length==1)this._rotateEnd.set(t.pageX,t.pageY);else{let s=this._getSecondPointerPosition(t),i=.5*(t.pageX+s.x),o=.5*(t.pageY+s.y);this._rotateEnd.set(i,o)}this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let e=this.domElement;this._rotateLeft(R*this._rotateDelta.x/e.clientHeight),this._rotateUp(R*this._rotateDelta.y/e.clientHeight),this._rotateStart.copy(this._rotateEnd)}_handleTouchMovePan(t){if(this._pointers.length===1)this._panEnd.set(t.pageX,t.pageY);else{let e=this._getSecondPointerPosition(t),s=.5*(t.pageX+e.x),i=.5*(t.pageY+e.y);this._panEnd.set(s,i)}this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd)}_handleTouchMoveDolly(t){let e=this._getSecondPointerPosition(t),s=t.pageX-e.x,i=t.pageY-e.y,o=Math.sqrt(s*s+i*i);this._dollyEnd.set(0,o),this._dollyDelta.set(0,Math.pow(this._dollyEnd.y/this._dollyStart.y,this.zoomSpeed)),this._dollyOut(this._dollyDelta.y),this._dollyStart.copy(this._dollyEnd);let r=(t.pageX+e.x)*.5,a=(t.pageY+e.y)*.5;this._updateZoomParameters(r,a)}_handleTouchMoveDollyPan(t){this.enableZoom&&this._handleTouchMoveDolly(t),this.enablePan&&this._handleTouchMovePan(t)}_handleTouchMoveDollyRotate(t){this.enableZoom&&this._handleTouchMoveDolly(t),this.enableRotate&&this._handleTouchMoveRotate(t)}_addPointer(t){this._pointers.push(t.pointerId)}_removePointer(t){delete this._pointerPositions[t.pointerId];for(let e=0;e<this._pointers.length;e++)if(this._pointers[e]==t.pointerId){this._pointers.splice(e,1);return}}_isTrackingPointer(t){for(let e=0;e<this._pointers.length;e++)if(this._pointers[e]==t.pointerId)return!0;return!1}_trackPointer(t){let e=this._pointerPositions[t.pointerId];e===void 0&&(e=new L,this._pointerPositions[t.pointerId]=e),e.set(t.pageX,t.pageY)}_getSecondPointerPosition(t){let e=t.pointerId===this._pointers[0]?this._pointers[1]:this._pointers[0];return this._pointerPositions[e]}_customWheelEvent(t){let e=t.deltaMode,s={clientX:t.clientX,clientY:t.clientY,deltaY:t.deltaY};switch(e){case 1:s.deltaY*=16;break;case 2:s.deltaY*=100;break}return t.ctrlKey&&!this._controlActive&&(s.deltaY*=10),s}};function er(n){this.enabled!==!1&&(this._pointers.length===0&&(this.domElement.setPointerCapture(n.pointerId),this.domElement.ownerDocument.addEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.addEventListener("pointerup",this._onPointerUp)),!this._isTrackingPointer(n)&&(this._addPointer(n),n.pointerType==="touch"?this._onTouchStart(n):this._onMouseDown(n),this._cursorStyle==="grab"&&(this.domElement.style.cursor="grabbing")))}function sr(n){this.enabled!==!1&&(n.pointerType==="touch"?this._onTouchMove(n):this._onMouseMove(n))}function ir(n){switch(this._removePointer(n),this._pointers.length){case 0:this.domElement.releasePointerCapture(n.pointerId),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.dispatchEvent(cs),this.state=_.NONE,this._cursorStyle==="grab"&&(this.domElement.style.cursor="grab");break;case 1:let t=this._pointers[0],e=this._pointerPositions[t];this._onTouchStart({pointerId:t,pageX:e.x,pageY:e.y});break}}function or(n){let t;switch(n.button){case 0:t=this.mouseButtons.LEFT;break;case 1:t=this.mouseButtons.MIDDLE;break;case 2:t=this.mouseButtons.RIGHT;break;default:t=-1}switch(t){case ot.DOLLY:if(this.enableZoom===!1)return;this._handleMouseDownDolly(n),this.state=_.DOLLY;break;case ot.ROTATE:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=_.PAN}else{if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=_.ROTATE}break;case ot.PAN:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=_.ROTATE}else{if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=_.PAN}break;default:this.state=_.NONE}this.state!==_.NONE&&this.dispatchEvent(le)}function rr(n){switch(this.state){case _.ROTATE:if(this.enableRotate===!1)return;this._handleMouseMoveRotate(n);break;case _.DOLLY:if(this.enableZoom===!1)return;this._handleMouseMoveDolly(n);break;case _.PAN:if(this.enablePan===!1)return;this._handleMouseMovePan(n);break}}function nr(n){this.enabled===!1||this.enableZoom===!1||this.state!==_.NONE||(n.preventDefault(),this.dispatchEvent(le),this._handleMouseWheel(this._customWheelEvent(n)),this.dispatchEvent(cs))}function ar(n){this.enabled!==!1&&this._handleKeyDown(n)}function hr(n){switch(this._trackPointer(n),this._pointers.length){case 1:switch(this.touches.ONE){case it.ROTATE:if(this.enableRotate===!1){this.state=_.NONE;break}this._handleTouchStartRotate(n),this.state=_.TOUCH_ROTATE;break;case it.PAN:if(this.enablePan===!1){this.state=_.NONE;break}this._handleTouchStartPan(n),this.state=_.TOUCH_PAN;break;default:this.state=_.NONE}break;case 2:switch(this.touches.TWO){case it.DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchStartDollyPan(n),this.state=_.TOUCH_DOLLY_PAN;break;case it.DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchStartDollyRotate(n),this.state=_.TOUCH_DOLLY_ROTATE;break;default:this.state=_.NONE}break;default:this.state=_.NONE}this.state!==_.NONE&&this.dispatchEvent(le)}function lr(n){switch(this._trackPointer(n),this.state){case _.TOUCH_ROTATE:if(this.enableRotate===!1)return;this._handleTouchMoveRotate(n),this.update();break;case _.TOUCH_PAN:if(this.enablePan===!1)return;this._handleTouchMovePan(n),this.update();break;case _.TOUCH_DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchMoveDollyPan(n),this.update();break;case _.TOUCH_DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchMoveDollyRotate(n),this.update();break;default:this.state=_.NONE}}function cr(n){this.enabled!==!1&&n.preventDefault()}function ur(n){n.key==="Control"&&(this._controlActive=!0,this.domElement.ownerDocument.addEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}function fr(n){n.key==="Control"&&(this._controlActive=!1,this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}function P(n,t){let e=Math.sin(12.9898*n+78.233*t)*43758.5453;return e-Math.floor(e)}import{BufferAttribute as us,BufferGeometry as dr,Color as ds,Vector3 as X}from"./three.webgpu.js";var mr=new ds(6968380),pr=[5208628,7050304,8825162].map(n=>new ds(n)),fs=2600;function ms(n,t){let{rest:e,sphere:s}=n,i=[...t].sort((h,l)=>h-l)[Math.floor(.7*t.length)],o=.026*s.radius,r=h=>t[h]<=i,a=h=>new X().fromArray(e,3*h);return h=>{let{source:l}=h.userData,c=h.index.array,u={offset:[],normal:[],color:[],vertices:[],index:[]},f=(w,v,M,g)=>(u.vertices.push(w),u.offset.push(v.x,v.y,v.z),u.normal.push(M.x,M.y,M.z),u.color.push(g.r,g.g,g.b),u.vertices.length-1),d=(w,v,M,g)=>{let E=(T,N)=>f(T,M.clone().multiplyScalar(N*t[T]),g,mr),S=[E(w,-1),E(w,1),E(v,-1),E(v,1)];u.index.push(S[0],S[1],S[2],S[2],S[1],S[3])},m=Array.from({length:c.length/2},(w,v)=>[l[c[2*v]],l[c[2*v+1]]]);for(let[w,v]of m){let M=a(v).sub(a(w)).normalize(),g=new X(M.y,-M.x,M.z*.1).cross(M).normalize(),E=new X().crossVectors(M,g);d(w,v,g,E),r(v)||d(w,v,E,g)}let p=m.map(([,w])=>w).filter(r),y=Math.min(fs,2*p.length),x=o*Math.sqrt(fs/Math.max(y,60));for(let w=0;w<y;w++){let v=p[Math.floor(w*p.length/y)],M=2*Math.PI*P(w,1),g=P(w,2)-.35,E=new X(Math.cos(M),g,Math.sin(M)).normalize().multiplyScalar(x),S=new X(-Math.sin(M),.6*(P(w,3)-.5),Math.cos(M)).multiplyScalar(.42*x),T=a(v).sub(s.center).normalize().add(new X(0,.7,0)).normalize(),N=pr[w%3].clone().multiplyScalar(.8+.4*P(w,4)),J=E.clone().multiplyScalar(.5),z=f(v,new X,T,N);f(v,J.clone().add(S),T,N),f(v,J.clone().sub(S),T,N),f(v,E,T,N),u.index.push(z,z+1,z+2,z+2,z+1,z+3)}let b=new dr;for(let[w,v]of[["athOffset",u.offset],["normal",u.normal],["color",u.color]])b.setAttribute(w,new us(Float32Array.from(v),3));return b.setIndex(new us(Uint32Array.from(u.index),1)),b.userData.vertices=Uint32Array.from(u.vertices),b}}import{Color as gr,DirectionalLight as wr,Fog as br,HemisphereLight as yr,Mesh as vr,MeshStandardNodeMaterial as xr,PlaneGeometry as _r,TSL as Mr,Vector3 as Er}from"./three.webgpu.js";var{Fn:ys,clamp:Sr,color:ce,dot:Tr,max:Ar,mix:Ft,mx_noise_float:Or,normalWorldGeometry:ps,positionWorld:Pr,pow:gs,smoothstep:ws,vec3:pt}=Mr,Z=new Er(-.62,.72,.32).normalize(),Dr=7317210,vs=15002600,Rr=16773334,bs=2048,kr=9,Cr=ys(()=>{let n=Sr(ps.y,0,1),t=Ar(Tr(ps,pt(Z.x,Z.y,Z.z)),0);return Ft(Ft(ce(vs),ce(Dr),gs(n,.55)),ce(Rr),gs(t,6).mul(.4))}),Nr=n=>ys(()=>{let t=Pr.xz.div(n),e=r=>Or(pt(t.x.mul(r),t.y.mul(r),r)),s=ws(-.5,.6,e(.35).add(e(1.9).mul(.5))),i=e(23).mul(.5).add(e(61).mul(.5)),o=Ft(pt(.085,.12,.03),pt(.16,.19,.055),s);return Ft(o,pt(.13,.1,.05),ws(.25,.75,e(.8)).mul(.5)).mul(i.mul(.5).add(1))})(),Bt=class{constructor(t,e){let s=260*e,i=kr*e;this.sun=new wr(16773592,3.2),this.ground=new vr(new _r(4*s,4*s),new xr({roughness:1})),this.ground.material.colorNode=Nr(e),this.ground.rotation.x=-Math.PI/2,this.ground.receiveShadow=!0,Object.assign(this.sun.shadow.camera,{left:-i,right:i,top:i,bottom:-i,near:.1*i,far:5*i}),Object.assign(this.sun.shadow,{bias:-5e-4,normalBias:.004*e}),this.sun.shadow.mapSize.setScalar(bs),this.reach=i,t.backgroundNode=Cr(),t.fog=new br(new gr(vs),10*e,.55*s),t.add(this.ground,this.sun,this.sun.target,new yr(14478328,9211746,1.3))}set shadows(t){this.sun.castShadow=t}around(t){let e=2*this.reach/bs*16,s=i=>Math.round(i/e)*e;this.sun.target.position.set(s(t.x),0,s(t.z)),this.sun.position.copy(this.sun.target.position).addScaledVector(Z,2.5*this.reach)}};import{DoubleSide as Ir,MeshStandardNodeMaterial as Lr,TSL as Ur}from"./three.webgpu.js";var{Fn:ue,abs:me,attribute:zr,clamp:pe,dot:Fr,float:gt,floor:Br,fract:jr,fwidth:xs,max:ge,mix:jt,mx_noise_float:_s,normalWorld:Hr,pow:fe,select:Ht,sin:Ms,smoothstep:de,vec3:U}=Ur;function Wr(n,t){if(n==="blades")return gt(2);if(n==="pinnae")return gt(.97).sub(fe(me(Ms(t.mul(40.84).add(1.5708))),3).mul(.55).mul(t.mul(-.6).add(1)));let e=pe(t.sub(.1).div(.9),0,1);return ge(fe(Ms(fe(e,.8).mul(Math.PI)),.8).mul(.92),Ht(t.lessThan(.2),gt(.04),gt(0)))}function we(n,t){let e=se(n),s=new Lr({color:e?16777215:8362581,roughness:.8,side:Ir});if(!e)return s;let[i,o]=e,r=zr("uv","vec2"),a=r.x,h=r.y,l=a.greaterThanEqual(1),c=Br(a.sub(1).mul(.5)).div(7),u=jr(a.sub(1).mul(.5)).mul(4).sub(1),f=ue(()=>{let x=jt(U(.062,.155,.018),U(.145,.255,.03),c).toVar();o==="blades"&&x.mulAssign(de(0,.45,h).mul(.6).add(.5));let b=de(.08,0,me(u)).mul(de(.12,.03,xs(h)));return jt(x,x.mul(1.5).add(.015),b.mul(.5))}),d=ue(()=>{if(i==="stalks")return jt(U(.1,.075,.03),U(.12,.17,.04),pe(h.mul(.02),0,1));let x=_s(U(a.mul(11),h.mul(2.6),4)).mul(.6).add(_s(U(a.mul(18),h.mul(16),9)).mul(.3)).add(.45);return jt(U(.05,.037,.027),U(.27,.215,.165),pe(x,0,1))}),m=Ht(l,f(),d());s.colorNode=m;let p=ue(()=>{let x=Wr(o,h).sub(me(u)),b=ge(xs(x),1e-4);return Ht(l,x.div(b).add(.5),gt(1))});s.opacityNode=p(),s.alphaTest=.5;let y=ge(Fr(Hr,U(t.x,t.y,t.z)).negate(),0);return s.emissiveNode=Ht(l,m.mul(U(1.5,1.45,.45)).mul(y).mul(.8),U(0)),s}var Gr=12e3,Vr=Math.PI*(3-Math.sqrt(5)),Es=({sphere:n},t,e=1)=>1.1*n.radius*e*Math.sqrt(t);function Ss({metadata:n,motion:t,rest:e},s,i){let o=t.duration||1,r=n.up_axis==="z";return Array.from({length:s},(a,h)=>{let l=i*Math.sqrt((h+.3)/s),c=h*Vr+.5*Math.sin(h*12.9898),u=.75+.5*(Math.sin(h*78.233)*.5+.5),f=l*Math.cos(c),d=l*Math.sin(c);return{...r?{x:f,y:d,z:e[2]*(1-u)}:{x:f,y:e[1]*(1-u),z:d},size:u,angle:h*2.4,seconds:h*.7548776662%1*o}})}var Ts=(n,{metadata:t})=>n.map(({x:e,y:s,z:i})=>t.up_axis==="z"?[e,-s]:[e,i]);function As(n,t,e,s){return Array.from({length:Math.min(Gr,Math.round(t*n.length))},(i,o)=>{let[r,a]=n[Math.floor(o/t)],h=Math.floor(o%t/3),l=20*s,c=2*Math.PI*P(Math.floor(o/t)*7+h+1,l),u=e*(.12+.88*P(Math.floor(o/t)*5+h+1,l+1)),f=.16*e*Math.sqrt(P(o+1,l+2)),d=2*Math.PI*P(o+1,l+3);return{x:r+u*Math.cos(c)+f*Math.cos(d),z:a+u*Math.sin(c)+f*Math.sin(d),size:.8+.8*P(o+1,l+4),angle:2*Math.PI*P(o+1,l+5),seconds:100*P(o+1,l+6)}})}function Os(n,{metadata:t,rest:e}){return t.up_axis==="z"?n.map(({x:s,z:i,size:o,...r})=>({...r,size:o,x:s,y:-i,z:e[2]*(1-o)})):n.map(({size:s,...i})=>({...i,size:s,y:e[1]*(1-s)}))}var $r=4;function Ps(n){let t=n.getAll("each").map(Number);return n.getAll("floor").map((e,s)=>({source:e,each:t[s]>0?t[s]:$r}))}var Ds=["The file cannot be fetched","The server did not answer, or it has no such file. Check the address, and whether you are online."],Rs=["The file is cut off too early","Its end is missing, as after a download that was interrupted. Get it again."],qr={NOT_AN_ATH_FILE:["This is not an .ath file","It begins as another kind of file. If it came from the web, its address may lead to a page about the file and not to the file."],NO_MOTION:["This GLB holds no plant that moves","athcodec encode FILE.glb --into OUT.glb puts the motion of its animation into it."],UNSUPPORTED_VERSION:["This file is of another version of the format","A newer viewer may show it, or the file can be made again from its source."],HTTP:Ds,NETWORK:Ds,MISSING:Rs,TRUNCATED:Rs,NEEDS_HOST_MESH:["This file needs the mesh that it was made for","It holds the motion alone. Open it together with its mesh: athcodec view FILE --host-mesh MESH."],UNSUPPORTED_FEATURE:["This file uses something newer than this viewer","A newer viewer may show it."],WRONG_HOST_MESH:["The mesh is not the one that this file was made for","The file fits one mesh alone, point for point."],CLIP:["The file has no such clip","The address names a clip that is not in the file."],CHANGED:["The file has changed","While it was loading, another one took its place. Load it again."],WORKER:["The decoder cannot be started","The page is not complete: ath_worker.js belongs beside it."],GRAPHICS:["This browser cannot draw in 3D","The page needs WebGL 2. It may be turned off in the browser's settings."]},Yr=["The file is damaged","Some of its bytes are not what they were when it was made. Get it again."],Kr=["HTTP","NETWORK","MISSING","TRUNCATED","CHANGED","WORKER"];function ks(n){let[t,e]=qr[n]??Yr;return{title:t,advice:e,passing:Kr.includes(n)}}var k=n=>document.getElementById(n),wt=new URLSearchParams(location.search),Wt=Number(wt.get("count")??1e4),on=.85,rn=40,nn=12,O={modules:{three:Xr,loading:ie},frames:0,milliseconds:0,forest:null,ath:null,error:null};window.athcodecForest=O;var an=n=>Math.floor(200+55*P(n,3))<<16|Math.floor(215+40*P(n,6))<<8|205;function Cs({motion:{clips:n},metadata:t}){let e=n.map(({name:o})=>t.clips?.[o]?.strength).filter(Number.isFinite),[s,i]=[Math.min(...e),Math.max(...e)];return i>s?{calm:s,wild:i}:null}function hn(n,t,e){return Promise.all(Ps(wt).map(async({source:s,each:i},o)=>{let r=await new Y().loadAsync(s),a=Cs(r),{clips:h}=r.motion,l=()=>we(r.metadata,Z),c=new st(n,r,{material:l}),u=f=>h[a?0:f%h.length].name;return c.setInstances(Os(As(t,i,e,o),r).map((f,d)=>({...f,clip:u(d)}))),{forest:c,winds:a}}))}async function ln(){if(!await navigator.gpu?.requestAdapter())return null;let n=new sn({canvas:k("canvas"),antialias:!0});return n.init().then(()=>n.backend.isWebGPUBackend?n:null,()=>null)}async function cn(){let n=await ln();if(!n){location.replace(`index.html${location.search}#forest=${Wt}`);return}let t=await new Y().loadAsync(wt.get("file")),e=t.hasFaces,{radius:s}=t.sphere,i=new st(n,t,{shape:e?void 0:ms(t,K(t)),material:()=>e?we(t.metadata,Z):new Qr({roughness:.85,side:Jr})}),o=Cs(t),{clips:r}=t.motion,a=o?1:r.length,h=Ss(t,Wt,Es(t,Wt,on)).map((g,E)=>({...g,clip:r[E%a].name,tint:an(E)}));i.setInstances(h);let l=await hn(n,Ts(h,t),.9*s),c=new en,u=new tn(40,1,.02*s,400*s),f=new zt(u,k("canvas")),d=new Bt(c,s),m=/swiftshader|llvmpipe/i.test(n.backend.device.adapterInfo?.architecture??"");n.toneMapping=Zr,n.shadowMap.enabled=!0,d.shadows=wt.get("quality")==="full"||!m,c.add(i,...l.map(g=>g.forest)),u.position.set(3*s,2.4*s,8*s),f.target.set(0,.9*s,0),f.maxPolarAngle=.49*Math.PI,f.maxDistance=150*s,f.enableDamping=!0,Object.assign(O,{ath:t,forest:i,floor:l.map(g=>g.forest),renderer:n,camera:u,controls:f,scene:c,time:null,seconds:0,playing:!0});let p=g=>{O.moves=g,k("play").textContent=g?"Pause":"Play"};p(!matchMedia("(prefers-reduced-motion: reduce)").matches),k("play").addEventListener("click",()=>p(!O.moves)),o&&Object.assign(k("strength"),{min:o.calm,max:o.wild,step:(o.wild-o.calm)/100,value:o.wild});let y=()=>{let g=Number(k("strength").value),E=Number(k("heading").value);k("strength-value").textContent=g.toFixed(1),k("heading-value").textContent=`${E}°`;for(let{forest:S,winds:T}of[{forest:i,winds:o},...l])T&&S.wind(o?g:T.calm+.5*g*(T.wild-T.calm)),S.sway(T||o?1:g,E*Math.PI/180)};for(let g of["strength","heading"])k(g).addEventListener("input",y);y();let x=null,b=0,w=g=>{b=g>rn?b+1:0,!(b<nn||wt.get("quality")==="full")&&(b=0,d.sun.castShadow?d.shadows=!1:n.setPixelRatio(1))},v=g=>{let E=x===null?0:g-x;x=g,w(E),d.around(f.target);let{clientWidth:S,clientHeight:T}=k("canvas");(S!==O.width||T!==O.height)&&(Object.assign(O,{width:S,height:T}),n.setPixelRatio(Math.min(devicePixelRatio,2)),n.setSize(S,T,!1),u.aspect=S/T,u.updateProjectionMatrix()),f.update();let N=performance.now();O.moves&&(O.seconds+=E/1e3);for(let J of[i,...O.floor])J.update(u,T,O.time??O.seconds);O.milliseconds=performance.now()-N,n.render(c,u),O.frames++},M=()=>{let g=[i,...O.floor].reduce((E,{bytesOfMotion:S})=>E+S,0)/1e3;k("status").textContent=`${Wt.toLocaleString("en")} plants, ${Math.round(g).toLocaleString("en")} kB of motion on the graphics card`};for(let g of[i,...O.floor])g.addEventListener("level",M);n.setAnimationLoop(g=>{O.playing&&v(g)}),O.draw=v}cn().catch(n=>{let{title:t,advice:e}=ks(n.codeName);O.error=n.message,Object.assign(k("status"),{textContent:n.codeName?`${t}. ${e}`:n.message,title:n.message,className:"wrong"}),k("controls").hidden=!0});
