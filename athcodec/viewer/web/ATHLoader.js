import{Box3 as ie,Group as oe,LineBasicMaterial as ne,LineSegments as ae,Loader as he,Mesh as le,MeshStandardMaterial as ce,EventDispatcher as fe,DoubleSide as ue,LoaderUtils as de,Object3D as pe,Vector3 as xt}from"three";import{Box3 as J,DataTexture as Kt,EventDispatcher as Xt,FloatType as Jt,MathUtils as gt,NearestFilter as Yt,RGBAFormat as Zt,Sphere as vt,Vector3 as _}from"three";import{BufferAttribute as A,BufferGeometry as ct,InstancedBufferAttribute as Lt,ShapeUtils as Pt,Vector2 as It,Vector3 as T}from"three";function j(o,{array:t,columns:e=0,counts:s=null}){let r=new Float64Array(o.length),i=s?s.length:t.length/e,n=[0,0,0];for(let a=0,h=0;a<i;a++){let l=s?Number(s[a]):e,f=[0,0,0];for(let c=1;c+1<l;c++)Dt(f,o,3*Number(t[h]),3*Number(t[h+c]),3*Number(t[h+c+1]));for(let c=h;c<h+l;c++)for(let u=0;u<3;u++)r[3*Number(t[c])+u]+=f[u];h+=l}for(let a=0;a<r.length;a++)n[a%3]+=3*o[a]/r.length;for(let a=0;a<r.length;a+=3){let h=r[a]||r[a+1]||r[a+2];for(let f=0;!h&&f<3;f++)r[a+f]=o[a+f]-n[f]||1e-9;let l=Math.hypot(r[a],r[a+1],r[a+2]);for(let f=0;f<3;f++)r[a+f]/=l}return Float32Array.from(r)}function Dt(o,t,e,s,r){let i=t[s]-t[e],n=t[s+1]-t[e+1],a=t[s+2]-t[e+2],h=t[r]-t[e],l=t[r+1]-t[e+1],f=t[r+2]-t[e+2];o[0]+=n*f-a*l,o[1]+=a*h-i*f,o[2]+=i*l-n*h}function G(o,t){let{face_vertex_counts:e,face_vertex_indices:s}=t;return o.faces?o.faces:e&&s?{array:Uint32Array.from(s.array,Number),counts:e.array}:null}function D(o,{up_axis:t}){return t==="z"&&(o.rotation.x=-Math.PI/2),t==="x"&&(o.rotation.z=Math.PI/2),o}function L(o,{metadata:t,origin:e}){return D(o,t).position.fromArray(e).applyEuler(o.rotation),o}function S(o,t,e,s){let r=o.getAttribute(t),i=o.isInstancedBufferGeometry?Lt:A;r?.array.length!==e.length?o.setAttribute(t,new i(e,s)):Object.assign(r,{array:e,needsUpdate:!0})}function ft(o,t){let{rest:e,statics:{metadata:s}}=o,r=s.domains??{},i=[r.uv,r.normals,r.colors].includes("corner"),n=i?t.array:Uint32Array.from({length:e.length/3},(h,l)=>l),a=pt(e,n);return a.setIndex(new A(Rt(e,t,i),1)),Object.assign(a.userData,{corners:i,faces:t}),_t(a,j(e,t)),a}function ut(o,t){let{rest:e}=o,s=pt(e,Uint32Array.from({length:e.length/3},(r,i)=>i));return s.setIndex(new A(t,1)),s}function dt(o,t){let{source:e,other:s,faces:r}=o.userData,i=s?[["rest",e,t],["restOther",s,t]]:[["position",e,t]];r&&i.push(["normal",e,j(t,r)]);for(let[n,a,h]of i){let l=o.getAttribute(n);k(l.array,h,a,3),l.needsUpdate=!0}}var C=class extends A{#t;#e=()=>null;follow(t,e){return this.#t=t,this.#e=e,this}getComponent(t,e){let s=this.#e();return s?s[3*this.#t[t]+e]:super.getComponent(t,e)}getX(t){return this.getComponent(t,0)}getY(t){return this.getComponent(t,1)}getZ(t){return this.getComponent(t,2)}};function pt(o,t){let e=new ct,s=new Float32Array(3*t.length);return k(s,o,t,3),e.setAttribute("position",new A(s,3)),e.userData.source=t,e}function k(o,t,e,s){for(let r=0;r<e.length;r++)for(let i=0;i<s;i++)o[s*r+i]=Number(t[s*e[r]+i]);return o}function _t(o,t){let{source:e}=o.userData;o.setAttribute("normal",new A(k(new Float32Array(3*e.length),t,e,3),3))}function V(o,t,e){let s=t.statics.metadata.domains??{};for(let[r,i,n]of[["uv","uv",[2]],["normals","normal",[3]],["colors","color",[3,4]]]){let a=e[r],h=a?.shape.at(-1);if(!a||a.shape.length!==2||!n.includes(h))continue;let{source:l,corners:f}=o.userData,c=s[r]==="corner",u=a.shape[0],d=c?l.length:t.rest.length/3;if(u!==d||c&&!f)continue;let p=a.array instanceof Uint8Array?1/255:1,g=c?Uint32Array.from({length:u},(x,m)=>m):l,v=k(new Float32Array(h*l.length),a.array,g,h).map(x=>x*p);S(o,i,v,h),r==="normals"&&(o.userData.faces=null)}}function Rt(o,{array:t,columns:e=0,counts:s=null},r){let i=[],n=s?s.length:t.length/e;for(let a=0,h=0;a<n;a++){let l=s?Number(s[a]):e;for(let[f,c,u]of Ut(o,t,h,l))i.push(...[f,c,u].map(d=>r?h+d:Number(t[h+d])));h+=l}return Uint32Array.from(i)}function Ut(o,t,e,s){if(s<3)return[];if(s===3)return[[0,1,2]];let r=Array.from({length:s},(i,n)=>new T().fromArray(o,3*Number(t[e+n])));return s===4?r[0].distanceToSquared(r[2])<=r[1].distanceToSquared(r[3])?[[0,1,2],[0,2,3]]:[[0,1,3],[1,2,3]]:Nt(r)??Array.from({length:s-2},(i,n)=>[0,n+1,n+2])}function Nt(o){let t=new T,e=new T,s=new T;if(o.forEach((i,n)=>t.add(new T().crossVectors(i,o[(n+1)%o.length]))),t.lengthSq()===0)return null;t.normalize(),e.set(Math.abs(t.x)>.9?0:1,Math.abs(t.x)>.9?1:0,0).cross(t).normalize(),s.crossVectors(t,e);let r=Pt.triangulateShape(o.map(i=>new It(i.dot(e),i.dot(s))),[]);return r.length>0?r:null}function q(o,t,e,s){let{source:r}=o.userData,i=o.index.array,n=!o.getAttribute("normal"),a=new Map,h=n?2:3,l=[],f=new Set,c=u=>{let d=3*r[u],p=v=>Math.floor(t[d+v]/e)&4095,g=((s[r[u]]+1&65535)*4096+p(0))*16777216+p(1)*4096+p(2);return a.has(g)||a.set(g,u),a.get(g)};for(let u=0;u<i.length;u+=h){let d=Array.from(i.subarray(u,u+h),c),[p,g,v]=d;if(p===g||!n&&(g===v||v===p))continue;let[x,m,w]=[...d].sort((E,B)=>E-B),M=n?x*2**26+m:`${x},${m},${w}`;f.has(M)||(f.add(M),l.push(...d))}return l.length===0&&l.push(...i.subarray(0,h)),zt(o,Uint32Array.from(l))}function zt(o,t){let e=Uint32Array.from(new Set(t)).sort(),s=new Map(Array.from(e,(i,n)=>[i,n])),r=new ct;for(let[i,{array:n,itemSize:a}]of Object.entries(o.attributes))r.setAttribute(i,new A(k(new n.constructor(a*e.length),n,e,a),a));return r.setIndex(new A(t.map(i=>s.get(i)),1)),r.userData.source=e.map(i=>o.userData.source[i]),r}import{MeshDepthMaterial as Ht,MeshDistanceMaterial as $t,RGBADepthPacking as jt,Vector2 as Gt}from"three";var mt=`
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
`,Vt=`
vec3 transformed=athMoved(position,athPart);
#ifdef USE_ALPHAHASH
vPosition=vec3(position);
#endif
`,qt=`
vec3 objectNormal=athTurned(normal,athPart);
#ifdef USE_TANGENT
vec3 objectTangent=vec3(tangent.xyz);
#endif
`,Wt=`
#include <color_fragment>
diffuseColor.rgb*=athTint;
`,P=new WeakMap;function y(o,t,e=!1){let s=P.get(o);if(s===t)return o;if(P.set(o,t),s)return o.dispose(),o;let r=[...e?["ATH_FOREST"]:[],...t.athBefore?["ATH_FADING"]:[]],{onBeforeCompile:i,customProgramCacheKey:n}=o,a=`ath ${r} ${o.customProgramCacheKey()}`;return o.onBeforeCompile=(h,l)=>{i.call(o,h,l),Object.assign(h.uniforms,P.get(o)),h.vertexShader=`${r.map(f=>`#define ${f}
`).join("")}${h.vertexShader}`.replace("#include <common>",`#include <common>
${mt}`).replace("#include <begin_vertex>",Vt).replace("#include <beginnormal_vertex>",qt),e&&h.fragmentShader?.includes("#include <color_fragment>")&&(h.fragmentShader=`varying vec3 athTint;
${h.fragmentShader.replace("#include <color_fragment>",Wt)}`)},o.customProgramCacheKey=()=>a,o.clone=()=>{let h=Object.getPrototypeOf(o).clone.call(o);return y(Object.assign(h,{onBeforeCompile:i,customProgramCacheKey:n}),P.get(o),e)},o.needsUpdate=!0,o}function I(o,t=!1){return{customDepthMaterial:y(new Ht({depthPacking:jt}),o,t),customDistanceMaterial:y(new $t,o,t)}}var W=mt;function O(){return{athData:{value:null},athStride:{value:1},athForest:{value:new Gt}}}var K=1024;var X=new _,Qt=new _;function R(o){let t=new Kt(o,K,o.length/4/K,Zt,Jt);return t.magFilter=t.minFilter=Yt,t.needsUpdate=!0,t}function Y({lastTime:o,frameCount:t}){return t>1?o+o/(t-1):0}var wt={message:"ath: got a request after dispose(), expected none",codeName:"CLOSED"},b=({message:o,codeName:t})=>Object.assign(new Error(o??"MISSING: bytes are still to come"),{codeName:t??"MISSING"}),te=33;function U(o){return o<1?o*o*(3-2*o):1}var ee=19,se=21,F=class extends Xt{clip;time=0;start=0;wrap;frame=0;level=-1;held=!1;automatic=!0;target=0;pixels=1;measure="p99";fade=.2;fading=!1;heat=!1;distances=null;mode="matrices";milliseconds=0;uniforms=O();#t;#e;#s=new Set;#r=null;#i=null;#o=new J;#a=null;#h=new Map;#p=null;#l=null;#c=!1;#f=!1;#d=0;#n=null;#m=null;#u=new Map;#w=1;constructor(t,e,s){super(),this.#t=t,this.#e=e,this.clip=s,this.target=t.info.levelCount-1,this.wrap=this.usualWrap,t.views.set(e,this)}get info(){return this.#t.info}get clips(){return this.#t.clips}get usualWrap(){return this.clips.some(({loop:t})=>t)?"marked":"loop"}get loops(){return this.wrap==="loop"||this.wrap==="marked"&&this.clip.loop}get duration(){return this.loops?Y(this.clip):this.clip.lastTime*(this.wrap==="pingpong"?2:1)}get switching(){return this.#n&&(this.#n.begun?"fading":"waiting")}get levelCount(){return this.info.levelCount}levelName(t){return this.info.levelNames[t]}get failure(){return this.#t.failure}get bytesFetched(){return this.#t.state.fetched}get bytesTotal(){return this.info.fileLength}get requests(){return this.#t.state.requests}motionBytes(t){let{firstSegment:e,segmentCount:s}=this.clip;return this.#t.chunks.filter(i=>i.level<=t&&([ee,se].includes(i.kind)||i.segment>=e&&i.segment<e+s)).reduce((i,{length:n})=>i+n,0)}bitRate(t=Math.max(this.level,0)){return this.clip.duration>0?8*this.motionBytes(t)/this.clip.duration:0}error(t){return this.clip.errors[t]}seamError(t){return this.clip.seams[t]}ready(t){let{times:e,segments:s}=this.#t,{firstFrame:r,frameCount:i,firstSegment:n}=this.clip,a=[],h=r+i-1,l=f=>e[Math.min(s[f],h)]-e[r];return this.readyLevels.forEach((f,c)=>{if(f<t)return;let u=l(n+c),d=l(n+c+1);a.at(-1)?.end===u?a.at(-1).end=d:a.push({start:u,end:d})}),a}get readyLevels(){let{firstSegment:t,segmentCount:e}=this.clip;return this.#t.state.ready.subarray(t,t+e)}get readyLevel(){return Math.min(...this.readyLevels)}get complete(){return this.readyLevel===this.levelCount-1}setTime(t){let e=Math.max(0,t-this.time),s=this.#n;return this.time=t,s&&(s.seconds+=e,s.begun&&(s.passed+=e),this.#M()),this.#g(),this}play(t,{fade:e=0,at:s=0}={}){let r=this.clips.find(({index:i,name:n})=>t===i||t===n);if(!r)throw new RangeError(`clip: got ${t}, expected one of ${this.clips.map(({name:i})=>i).join(", ")}`);return this.#m=null,this.level>=0&&(this.#n={...this.#F(),at:s,fade:e,passed:0,begun:!1}),Object.assign(this,{clip:r,start:this.time-s}),this.#g(),this}wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);return this.#m=[t,e],this.#n=null,this.#g(),this}#F(){let t=this.#n;return t&&(!t.begun||2*t.passed<t.fade)?t:this.#v(this.time)}#M(){this.#n.begun&&this.#n.passed>=this.#n.fade&&(this.#n=null)}setLevel(t){return this.automatic=t==="auto",this.automatic||(this.target=gt.clamp(t,0,this.levelCount-1)),this.#g(),this}setMode(t){return this.mode=t,this}levelFor(t,e,s=null,r=this.pixels){let i=this.#x(t,e,s);for(let n=0;n<this.levelCount;n++)if(this.error(n)[this.measure]*i<=r)return n;return this.levelCount-1}pixelError(t,e,s,r=null){return this.error(t)[this.measure]*this.#x(e,s,r)}#x(t,e,s){let r=this.#t.sphere;X.copy(r.center);let i=1;if(s&&(X.applyMatrix4(s),i=s.getMaxScaleOnAxis()),t.isOrthographicCamera)return i*e*t.zoom/(t.top-t.bottom);let n=Math.max(X.distanceTo(Qt.setFromMatrixPosition(t.matrixWorld))-r.radius*i,1e-9);return i*e/(2*Math.tan(gt.degToRad(t.fov)/2)/t.zoom*n)}update(t,e,s=null){return this.automatic&&(this.target=this.levelFor(t,e,s?.matrixWorld??null)),this}show(t,e=this.target){return this.#S(t,{level:e,heat:this.heat,positions:this.mode==="positions"})}async positions(t,e=this.target){return(await this.#S(t,{level:e,positions:!0,aside:!0})).data}#S(t,e){let s=this.#w++;return new Promise((r,i)=>{if(!this.#t.views.has(this.#e))throw b(wt);this.#u.set(s,{resolve:r,reject:i,aside:e.aside}),this.#t.send({type:"picture",view:this.#e,id:s,exactly:!0,...this.#v(t),wind:this.#m,...e})})}#v(t){return{clip:this.clip.index,seconds:t-this.start,wrap:this.wrap}}#g(){let t=this.#n,e=this.switching==="waiting",{clip:s,seconds:r,wrap:i}=this.#v(e?this.start+t.at:this.time),n=t&&{clip:t.clip,seconds:t.seconds,wrap:t.wrap,begun:t.begun,share:t.fade>0?1-t.passed/t.fade:0},a=`${s} ${r} ${i} ${this.target} ${this.heat} ${JSON.stringify([n,this.#m])}`;if(this.#c){this.#f=a!==this.#l;return}if(a===this.#l&&!this.#f&&!this.fading)return;this.#l=a,this.#f=!1,this.#c=!0;let h=this.#p;this.#p=null,this.#t.send({type:"picture",view:this.#e,id:0,clip:s,seconds:r,wrap:i,old:n,wind:this.#m,level:this.target,heat:this.heat,positions:this.mode==="positions",buffer:h,now:performance.now(),fade:this.fade,coarsely:this.#t.easing},h?[h]:[])}refresh(){this.#l=null,this.#g()}picture(t){let e=this.#u.get(t.id),{shown:s,codeName:r}=t;this.#u.delete(t.id),e||(this.#c=!1),s<0?e?.reject(b(t)):e?.aside||this.#E(t),s>=0&&e?.resolve(t),!e&&t.message&&this.dispatchEvent({type:"error",message:t.message,codeName:r}),!e&&this.#f&&this.#g()}dispatchEvent(t){try{super.dispatchEvent(t)}catch(e){queueMicrotask(()=>{throw e})}}#E({shown:t,cut:e=t,frame:s,data:r,heat:i,ms:n,held:a,clip:h,exactly:l,fading:f,whole:c}){let u=t!==this.level,d=this.#t.known.get(e),p=d!==this.#r;if(Object.assign(this,{frame:s,held:a,fading:f,milliseconds:n,distances:i??null,level:t}),this.#r=d,t>0&&this.#t.endEasing(),clearTimeout(this.#d),f&&(this.#d=setTimeout(()=>this.refresh(),te)),this.#i=c?r:null,c||this.#k(e,r),this.#b(r),this.mode==="positions"&&this.#y(this.uploaded()),p)for(let g of this.#s)this.#O(g);u&&this.dispatchEvent({type:"level",level:t}),this.switching==="waiting"&&h===this.clip.index&&this.#B(this.#n),l&&(this.#n=null),this.dispatchEvent({type:"frame",frame:s,level:t})}#B(t){t.begun=!0,this.start=this.time-t.at,this.#M(),this.dispatchEvent({type:"clip",clip:this.clip})}#k(t,e){let s=this.#h.get(t);s&&s.image.data.length===e.length?(this.#p=s.image.data.buffer,s.image.data=e,s.needsUpdate=!0):(s?.dispose(),this.#h.set(t,R(e)));let{texels:r,parts:{nodeCount:i,exactCount:n}}=this.#r;this.uniforms.athData.value=this.#h.get(t),this.uniforms.athStride.value=n>0?(r-3*i)/n:1}#y(t){for(let e of this.#s){let{source:s}=e.userData,{position:r,normal:i}=e.attributes;for(let n=0;n<s.length;n++)for(let a=0;a<3;a++)r.array[3*n+a]=t[3*s[n]+a];r.needsUpdate=!0,i&&e.computeVertexNormals()}}#b(t){let{min:e,max:s}=this.#o.makeEmpty(),{boxes:r}=this.#r,i=[...e],n=[...s],a=(l,f,c)=>{f<i[l]&&(i[l]=f),c>n[l]&&(n[l]=c)},h=(l,f,c)=>{for(let u=l;u<f;u+=c)for(let d=0;d<3;d++)a(d,t[u+d],t[u+d])};if(this.#i)h(0,t.length,3);else{let{parts:{nodeCount:l,exactCount:f}}=this.#r,c=4*this.uniforms.athStride.value;h(12*l,12*l+c*f,c);for(let[u,d,p,g,v,x,m]of r)for(let w=0;w<3;w++){let[M,E,B,Ct]=t.subarray(u+4*w,u+4*w+4),ht=M*d+E*p+B*g+Ct,lt=Math.abs(M)*v+Math.abs(E)*x+Math.abs(B)*m;a(w,ht-lt,ht+lt)}}e.fromArray(i),s.fromArray(n);for(let l of this.#s)this.#A(l)}#A(t){t.boundingBox=(t.boundingBox??new J).copy(this.#o),t.boundingSphere=this.#o.getBoundingSphere(t.boundingSphere??new vt)}uploaded(){if(this.#i||!this.uniforms.athData.value)return this.#i;let{data:t}=this.uniforms.athData.value.image,{rest:e}=this.#t,{vertices:s}=this.#r,r=this.#i=new Float32Array(e.length);for(let i=0,n=0;i<s.length;i++){let a=s[i],h=e[n],l=e[n+1],f=e[n+2];for(let c=4*(Math.abs(a)-1),u=0;u<3;u++,n++,c+=a<0?1:4)r[n]=a<0?t[c]:t[c]*h+t[c+1]*l+t[c+2]*f+t[c+3]}return r}bind(t){return this.mode==="positions"?t:y(t,this.uniforms)}bindShadows(t){if(this.mode==="positions")return t;let{clone:e}=Object.getPrototypeOf(t);return Object.assign(t,this.#a??=I(this.uniforms),{onBeforeRender:this.#T,clone:(...s)=>this.bindShadows(e.apply(t,s))})}#T=({isWebGPURenderer:t})=>{!t||this.mode==="positions"||(this.setMode("positions"),this.level>=0&&this.#y(this.uploaded()))};attach(t){let{source:e,other:s}=t.userData,r=t.getAttribute("position");return this.mode!=="positions"&&!s&&t.setAttribute("position",new C(r.array,3).follow(e,()=>this.uploaded())),this.level<0&&this.#o.copy(this.#t.box),this.#s.add(t),this.#A(t),this.#O(t),t}setRest(){if(this.mode==="positions")return;for(let e of this.#s)dt(e,this.#t.rest);this.#i=null;let t=this.uniforms.athData.value;t&&this.#b(t.image.data)}detach(t){this.#s.delete(t)}#O(t){if(this.mode==="positions")return;let{source:e,other:s}=t.userData;this.#C(t,"athPart",e),s&&this.#C(t,"athPartOther",s)}#C(t,e,s){let r=t.getAttribute(e)?.array??new Float32Array(s.length),i=this.#r?.vertices;if(i)for(let n=0;n<s.length;n++)r[n]=i[s[n]];S(t,e,r,1)}async nodeNumbers(t=this.level){return this.#t.nodeNumbers(await this.#t.parts(t))}clone(){return this.#t.view(this.clip)}dispose(){clearTimeout(this.#d);for(let t of this.#h.values())t.dispose();for(let t of Object.values(this.#a??{}))t.dispose();this.#h.clear(),this.#t.dropView(this.#e),this.fail(b(wt))}fail(t){for(let{reject:e}of this.#u.values())e(t);this.#u.clear()}};function Z(o){let t=[1/0,1/0,1/0],e=[-1/0,-1/0,-1/0];for(let r=0;r<o.length;r+=3)for(let i=0;i<3;i++)o[r+i]<t[i]&&(t[i]=o[r+i]),o[r+i]>e[i]&&(e[i]=o[r+i]);let s=new J(new _(...t),new _(...e));return{box:s,sphere:s.getBoundingSphere(new vt)}}function re({presence:o,part_names:t},{part_vertex_counts:e,part_copies:s}){if(!o||!Array.isArray(t)||e?.array.length!==t.length)return[];let r=[];for(let i=0,n=0;i<t.length;n+=Number(e.array[i++])){let a=Number(e.array[i]),h=Number(s?.array[i]??1),l=o[t[i]];l&&r.push({first:n,stop:n+a,runs:l});for(let f=0,c=a/h;!l&&f<h;f++){let u=o[`${t[i]}:${f}`];u&&r.push({first:n+f*c,stop:n+(f+1)*c,runs:u})}}return r}var N=class{#t=new Map;#e=new WeakMap;#s="";show({motion:t,metadata:e,attributes:s},r,i){let n=t.clips.findLast(({firstFrame:f})=>f<=t.frame)??t.clip;i&&this.#t.clear(),this.#t.has(n)||this.#t.set(n,re({...e,...e.clips?.[n.name]},s));let a=Math.floor(t.frame-n.firstFrame),h=this.#t.get(n).filter(({runs:f})=>!f.some(([c,u])=>c<=a&&a<u)),l=h.map(({first:f})=>f).join();if(!(l===this.#s&&!(i&&h.length))){this.#s=l;for(let f of r)this.#r(f,h)}}#r(t,e){let{index:s,userData:{source:r}}=t,i=t.hasAttribute("normal")?3:2;this.#e.has(t)||this.#e.set(t,s.array.slice());let n=this.#e.get(t),a=new Uint8Array(Math.max(0,...e.map(({stop:h})=>h)));for(let{first:h,stop:l}of e)a.fill(1,h,l);for(let h=0;h<n.length;h++){let l=n[h-h%i];s.array[h]=a[r[l]]?l:n[h]}s.needsUpdate=!0}};var me=16,ge=0;function we(o){if(o===null||o instanceof Float32Array&&o.length%3===0)return o;let t=o?.isBufferGeometry?o.getAttribute("position"):null;if(!t)throw new TypeError("mesh: got something else, expected three numbers per vertex or a BufferGeometry");return Float32Array.from({length:3*t.count},(e,s)=>t.getComponent(Math.floor(s/3),s%3))}function ve(o){if(ArrayBuffer.isView(o))return new Uint8Array(o.buffer,o.byteOffset,o.byteLength).slice();if(!/Buffer/.test(Object.prototype.toString.call(o)))throw new TypeError("buffer: got something else, expected an ArrayBuffer or a view of one");return new Uint8Array(o).slice()}var yt=o=>({codeName:"WORKER",message:`ath_worker.js: got no worker (${o??"not found or not allowed"}), expected it beside the loader or where setDecoderPath() says`}),Q=()=>b({message:"loading was aborted",codeName:"AbortError"}),tt=class{views=new Map;state={fetched:0,requests:0,ready:new Int8Array(1).fill(-1)};failure=null;sent=0;decodedAt=null;known=new Map;#t=new Map;#e=1;#s=1;#r=null;constructor(t,e){this.id=++ge,this.worker=t,this.release=e,this.settle={};for(let s of["opened","whole","arrays"])this[s]=new Promise((r,i)=>{this.settle[s]={resolve:r,reject:i}}),this[s].catch(()=>{});t.channels.set(this.id,this)}#i(t){for(let{reject:e}of[this.settle.opened,this.settle.whole,...this.#t.values()])e(t);this.#t.clear()}send(t,e=[]){this.worker.postMessage({...t,file:this.id},e)}receive(t){let{type:e}=t;if(this.sent=t.sent-performance.timeOrigin,e==="opened")Object.assign(this,t,{type:void 0},Z(t.rest)),this.state.ready=new Int8Array(t.info.segmentCount).fill(-1),this.settle.opened.resolve(this);else if(e==="rest")this.#l(t.rest);else if(e==="failed"){let s=b(t);this.#i(s);for(let r of this.views.values())r.fail(s);this.#o({...t,type:"stopped"})}else if(e==="attributes")this.settle.arrays.resolve(t.attributes);else if(e==="state")this.#p(t);else if(e==="picture")this.views.get(t.view)?.picture(t);else if(e==="parts")this.#a(t);else if(e==="decoded"){this.decodedAt??=this.sent;for(let s of this.views.values())s.refresh()}else e==="baked"?this.#n(`bake ${t.id}`,t):e==="gpu"||e==="wind"?this.#n(`${e} ${t.id}`,t):(e==="stopped"&&this.settle.whole.reject(b(t)),this.#o(t))}#o({type:t,level:e=null,message:s,codeName:r}){this.failure={type:t,level:e,message:s,codeName:r},this.#f(this.failure)}#a({level:t,parts:e,texels:s}){let r={parts:e,texels:s,vertices:this.#m(e,s),boxes:this.#h(e)};this.known.set(t,r),this.#n(`parts ${t}`,r)}#h({branch:t,first:e,count:s,index:r}){let{rest:i,vertexSource:n}=this,a=new xt,h=new ie,l=new xt,f=[];for(let c=0;c<t.length;c++)if(!(t[c]<0)){h.makeEmpty();for(let u=e[c];u<e[c]+s[c];u++)h.expandByPoint(a.fromArray(i,3*n[u]));f.push([12*r[c],...h.getCenter(a),...h.getSize(l).multiplyScalar(.5)])}return f}#p(t){let e=t.ready.some((s,r)=>s!==this.state.ready[r]);if(this.state=t,this.#f({type:"progress",loaded:t.fetched,total:t.total}),t.whole&&this.settle.whole.resolve(),!!e){this.#f({type:"ready"});for(let s of this.views.values())s.refresh()}}get easing(){return this.#r!==null}#l(t){let e=this.rest.slice(),s=performance.now(),r=Math.max(0,...[...this.views.values()].map(({level:n,fade:a})=>n===0?a:0)),i=()=>{let n=U((performance.now()-s)/1e3/r);n===1?this.endEasing():this.#c(t.map((a,h)=>e[h]+n*(a-e[h])))};this.#r={to:t,timer:setInterval(i,me)},i()}endEasing(){if(!this.easing)return;let{to:t,timer:e}=this.#r;clearInterval(e),this.#r=null,this.#c(t);for(let s of this.views.values())s.refresh()}#c(t){this.rest.set(t);let{box:e,sphere:s}=Z(t);this.box.copy(e),this.sphere.copy(s);for(let r of this.known.values())r.boxes=this.#h(r.parts);for(let r of this.views.values())r.setRest()}#f(t){for(let e of this.views.values())e.dispatchEvent({...t})}async parts(t){return this.known.get(t)??this.#d(`parts ${t}`,{type:"parts",level:t})}bake(t,e,s){let r=this.#s++;return this.#d(`bake ${r}`,{type:"bake",id:r,clip:t,level:e,step:s})}async gpu(t,e=null){let s=this.#s++,r=await this.#d(`gpu ${s}`,{type:"gpu",id:s,level:t,segment:e});if(!r.words)throw b(r);return r}windWeights(t,e){let s=this.#s++;return this.#d(`wind ${s}`,{type:"wind",id:s,strength:t,heading:e})}#d(t,e){if(!this.#t.has(t)){let s={};s.promise=new Promise((r,i)=>{Object.assign(s,{resolve:r,reject:i})}),this.#t.set(t,s),this.send(e)}return this.#t.get(t).promise}#n(t,e){this.#t.get(t)?.resolve(e),this.#t.delete(t)}fetchAll(){return this.send({type:"all"}),this.whole}abort(){this.settle.opened.reject(Q()),this.settle.whole.reject(Q()),this.send({type:"abort"})}#m({nodeCount:t,exactCount:e,branch:s,first:r,count:i,index:n},a){let h=new Float32Array(this.info.placeCount),l=e>0?(a-3*t)/e:1;for(let f=0;f<s.length;f++)for(let c=0;c<i[f];c++)h[r[f]+c]=s[f]>=0?1+3*n[f]:-(1+3*t+l*(n[f]+c));return this.#u(h)}#u(t){return t.constructor.from(this.vertexPlaces,e=>t[e])}nodeNumbers({parts:{branch:t,first:e,count:s}}){let r=this.#w();for(let i=0;i<t.length;i++)t[i]>=0&&r.fill(t[i],e[i],e[i]+s[i]);return this.#u(r)}get vertexBranch(){return this.#u(this.#w())}#w(){let{branches:{first:t,count:e}}=this,s=new Int32Array(this.info.placeCount);for(let r=0;r<t.length;r++)s.fill(r,t[r],t[r]+e[r]);return s}view(t=this.clips[this.first]){return new F(this,this.#e++,t)}dropView(t){this.views.delete(t)&&this.send({type:"drop",view:t})}close(){if(this.worker.channels.delete(this.id)){clearInterval(this.#r?.timer),this.send({type:"close"});for(let t of[...this.views.values()])t.dispose();this.#i(Q()),this.release()}}},z=class extends fe{attributes={};#t;#e;#s=null;#r=null;#i=null;#o=null;#a=null;#h=null;#p=new N;constructor(t,e){super(),this.#t=t,this.motion=t.view().setMode(e),this.motion.addEventListener("frame",()=>this.#l(!1)),this.metadata=t.statics.metadata,this.#e=G(t.statics,{}),this.arrays=t.arrays.then(s=>this.#f(s))}get loaded(){return this.#h??=this.#t.fetchAll().then(()=>this)}abort(){this.#t.abort()}get hasFaces(){return this.#e!==null}get geometry(){return!this.#s&&this.#e&&(this.#s=this.motion.attach(ft(this.#t,this.#e)),V(this.#s,this.#t,this.attributes),this.#l(!0)),this.#s}get lines(){let{statics:t}=this.#t;return!this.#r&&(t.edges||!this.#e)&&(this.#r=this.motion.attach(ut(this.#t,t.edges??t.skeleton)),this.#l(!0)),this.#r}get object(){return this.#i||(this.#i=L(new oe,this),this.#i.name="ath",this.#c()),this.#i}#l(t){this.#p.show(this,[this.#s,this.#r].filter(Boolean),t)}#c(){let{geometry:t,motion:e}=this,s=this.#o;if(!s||t&&!s.isMesh){let i=t?new ce({color:9083499,roughness:.8,side:ue}):new ne({color:7035717});this.#a=e.bind(i),this.#o=t?new le(t,i):new ae(this.lines,i),s?pe.prototype.copy.call(this.#o,s):this.#o.castShadow=this.#o.receiveShadow=!0,this.#i.add(e.bindShadows(this.#o)),s?.removeFromParent(),s?.material.dispose()}let{vertexColors:r}=this.#a;!t?.hasAttribute("color")||r||(this.#a.color.set(16777215),Object.assign(this.#a,{vertexColors:!0,needsUpdate:!0}))}get skeleton(){return this.#t.statics.skeleton}get origin(){return this.#t.origin}get rest(){return this.#t.rest}get branches(){return this.#t.branches}get vertexBranch(){return this.#t.vertexBranch}get sphere(){return this.#t.sphere}get box(){return this.#t.box}get channel(){return this.#t}#f(t){return this.attributes=t,this.#e??=G(this.#t.statics,t),this.#s&&V(this.#s,this.#t,t),this.#i&&this.#e&&this.#c(),this.#l(!0),this.dispatchEvent({type:"arrays"}),t}dispose(){for(let t of[this.#s,this.#r])t?.dispose();this.#a?.dispose(),this.#t.close()}},et=class extends he{constructor(t){super(t),this.workerLimit=4,this.workerPool=[],this.workerURL=null,this.mode="matrices",this.clip=null,this.hostMesh=null,this.bandwidth=null,this.begun=null}setDecoderPath(t){return this.workerURL=/\/$/.test(t)?`${t}ath_worker.js`:t,this}setWorkerLimit(t){return this.workerLimit=t,this}setMode(t){return this.mode=t,this}setClip(t){return this.clip=t,this}setHostMesh(t){return this.hostMesh=we(t),this}setBandwidth(t){return this.bandwidth=t,this}preload(){return this.workerPool.length===0&&this.#i(),this}takeOver({worker:t,url:e=null,front:s=null}){return this.#o(t),this.begun={url:e,front:s},this}load(t,e,s,r){let i=this.manager.resolveURL(de.resolveURL(t,this.path)),n={headers:this.requestHeader,credentials:this.withCredentials?"include":"same-origin"};this.manager.itemStart(t);let a=(h,l)=>{h===r&&this.manager.itemError(t),h?.(l),this.manager.itemEnd(t)};this.#t(new URL(i,globalThis.location?.href).href,n,s).then(h=>a(e,h),h=>{r||console.error(h),a(r,h)})}parse(t,e,s=r=>console.error(r)){this.parseAsync(t).then(e,s)}async parseAsync(t){let{buffer:e}=ve(t);return this.#e({bytes:e},[e])}abort(){for(let{channels:t}of this.workerPool)for(let e of[...t.values()])e.abort();return this}async#t(t,e,s){let{clip:r,hostMesh:i,bandwidth:n,begun:a}=this,h=a?.url===t&&n===null?await a.front:null;return this.begun=null,this.#e({url:t,options:{...e,front:h},clip:r,hostMesh:i,bandwidth:n},h?[h.port]:[],s)}async#e(t,e,s){let r=this.#r(),i=this.manager.abortController?.signal,n=()=>a.abort(),a=new tt(r,()=>{r.files--,i?.removeEventListener("abort",n)});i?.addEventListener("abort",n),r.files++;try{a.send({type:"open",clip:this.clip,hostMesh:this.hostMesh,bandwidth:this.bandwidth,...t},e),await a.opened;let h=new z(a,this.mode);return s&&h.motion.addEventListener("progress",({loaded:l,total:f})=>s({loaded:l,total:f,lengthComputable:!0})),await this.#s(h.motion),h}catch(h){throw a.close(),h}}#s(t){return new Promise((e,s)=>{let r=i=>{t.level<0&&t.show(0,0).catch(()=>s(b(i)))};t.addEventListener("frame",e),t.addEventListener("stopped",r),t.addEventListener("damaged",r),t.setTime(0)})}#r(){let t=this.workerPool.find(e=>e.files===0);return t||(this.workerPool.length<this.workerLimit?this.#i():this.workerPool.reduce((e,s)=>s.files<e.files?s:e))}#i(){return this.#o(this.#a())}#o(t){return Object.assign(t,{files:0,channels:new Map}),t.onmessage=({data:e})=>t.channels.get(e.file)?.receive(e),t.onerror=({message:e})=>{this.workerPool.splice(this.workerPool.indexOf(t),1);for(let s of t.channels.values())s.receive({type:"failed",...yt(e)})},this.workerPool.push(t),t}#a(){let{href:t,origin:e}=globalThis.location??{};try{let s=new URL(this.workerURL??new URL("./ath_worker.js",import.meta.url),t),i=s.protocol==="blob:"||s.origin===e||!/^http/.test(e)?s:URL.createObjectURL(new Blob([`import ${JSON.stringify(s.href)};`],{type:"text/javascript"}));return new Worker(i,{type:s.protocol==="blob:"?"classic":"module"})}catch({message:s}){throw b(yt(s))}}dispose(){for(let t of this.workerPool)t.terminate();return this.workerPool.length=0,this}};import{Color as Se,Mesh as ke,Vector4 as Te}from"three";import{BufferAttribute as xe,InstancedBufferAttribute as ye,InstancedBufferGeometry as be,ShaderMaterial as At,Vector2 as Mt}from"three";var St=`
attribute vec3 rest,restOther,color,colorOther;
attribute float athPartOther,radius,radiusOther;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${W}
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
}`,Ae=`
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
}`;function st(o,t){let e=o.skeleton,s=e.length/2,r=new Uint32Array(s),i=new Uint32Array(s);for(let a=0;a<s;a++)r[a]=e[2*a],i[a]=e[2*a+1];let n=new be;return n.setAttribute("position",new xe(Float32Array.of(0,1,0,0,-1,0,1,1,0,1,-1,0),3)),n.setIndex([0,1,2,2,1,3]),n.setAttribute("rest",bt(o.rest,r)),n.setAttribute("restOther",bt(o.rest,i)),n.instanceCount=s,n.userData={source:r,other:i},H(n,t),n}function bt(o,t){let e=new Float32Array(3*t.length);for(let s=0,r=0;s<t.length;s++){let i=3*t[s];e[r++]=o[i],e[r++]=o[i+1],e[r++]=o[i+2]}return new ye(e,3)}function H(o,t){for(let[e,s]of[["radius",o.userData.source],["radiusOther",o.userData.other]]){let r=new Float32Array(s.length);for(let i=0;i<s.length;i++)r[i]=t[s[i]];S(o,e,r,1)}}function Me(o){let t=`#include <packing>
void main() { gl_FragColor = packDepthToRGBA(gl_FragCoord.z); }`;return new At({vertexShader:St,fragmentShader:t,side:2,uniforms:{...o,screen:{value:new Mt(2048,2048)}}})}function rt(o){return new At({vertexShader:St,fragmentShader:Ae,side:2,uniforms:{...o,screen:{value:new Mt(1,1)},shade:{value:1}}})}function $(o){let t=o.attributes.radius,e=o.rest.length/3;if(t?.array.length===e)return Float32Array.from(t.array,Number);let{branches:{first:s,count:r,attach:i,depth:n},channel:{info:a,vertexPlaces:h}}=o,l=new Float32Array(a.placeCount).fill(1);for(let d=s.length-1;d>=0;d--){for(let p=s[d]+r[d]-2;p>=s[d];p--)l[p]+=l[p+1];i[d]>=0&&(l[i[d]]+=l[s[d]])}let f=l.reduce((d,p)=>Math.max(d,p),1),c=n.length>1&&n.every(d=>d===0),u=o.sphere.radius/(c?500:50);return Float32Array.from(h,d=>u*Math.sqrt(l[d]/f))}var Oe=8020552,Fe=new Te,it=class extends ke{#t;#e;#s;constructor(t,{motion:e=t.motion,color:s=Oe}={}){let r=st(t,$(t));super(e.attach(r),rt(e.uniforms)),this.#t=t,this.#e=e,this.#s=()=>H(r,$(t)),t.addEventListener("arrays",this.#s),L(this,t),this.frustumCulled=!1,this.setColor(s)}setColor(t){let e=typeof t=="function"?null:new Se(t).toArray(),{source:s,other:r}=this.geometry.userData;for(let[i,n]of[["color",s],["colorOther",r]]){let a=Float32Array.from({length:3*n.length});n.forEach((h,l)=>a.set(e??t(h),3*l)),S(this.geometry,i,a,3)}return this}onBeforeRender=t=>{let{z:e,w:s}=t.getCurrentViewport(Fe);this.material.uniforms.screen.value.set(e,s),this.material.uniformsNeedUpdate=!0};dispose(){this.#t.removeEventListener("arrays",this.#s),this.#e.detach(this.geometry),this.geometry.dispose(),this.material.dispose(),this.removeFromParent()}};import{DynamicDrawUsage as Ee,Frustum as Be,Group as Ce,InstancedBufferAttribute as De,InstancedBufferGeometry as kt,LineBasicMaterial as Le,LineSegments as Pe,Matrix4 as Tt,Mesh as Ie,MeshStandardMaterial as _e,Sphere as Re,Vector3 as Ue,BufferAttribute as Ne,DoubleSide as ze}from"three";var He=4<<20,$e=4096,Ot=1.5,Ft=2,je=.85,Ge=-1,Ve=o=>o?new Le({color:7035717}):new _e({color:9083499,roughness:.8,side:ze}),qe=()=>new Promise(o=>{setTimeout(o)}),ot=class extends Ce{levelOfDetail=!0;pixels=1;measure="p99";fade=.2;fading=!1;counts=[];vertices=0;culled=0;#t;#e=new Map;#s=[];#r=new Set;#i=new Map;#o=new Map;#a=new Float32Array(0);#h=new Float32Array(0);#p=new Float32Array(0);#l=0;#c=[];#f;#d;#n;#m=0;constructor(t,{geometry:e=t.geometry??t.lines,material:s=Ve,depthMaterial:r=null}={}){super(),this.#t=t,this.#n=e,this.#f=s,this.#d=r,this.name="ath forest",D(this,t.metadata)}get count(){return this.#a.length/4}get baked(){return this.#i.get(this.#t.motion.clip.index)??[]}setInstances(t){let{motion:e}=this.#t;for(let{clip:r}of t)r!==void 0&&!this.#o.has(r)&&this.#o.set(r,e.clone().play(r).setLevel(e.levelCount-1));let s=r=>this.#o.get(r)?.clip.index??Ge;this.#a=Float32Array.from(t.flatMap(({x:r,y:i,z:n,size:a})=>[r,i,n,a])),this.#h=Float32Array.from(t.flatMap(({angle:r,seconds:i,clip:n})=>[Math.cos(r),Math.sin(r),i,s(n)])),this.#p=Float32Array.from(t.flatMap(({amplitude:r=1,tint:i=16777215})=>[r,...[16,8,0].map(n=>(i>>n&255)/255)])),this.#c=[];for(let r of this.#u())this.#v(r)}#u(){return[...this.#e.values()].flat().flatMap(t=>[t,...t.fades.values()])}bakeReady(){for(let t of[this.#t.motion,...this.#o.values()])for(let e=0;e<=t.readyLevel;e++)this.#w(e,t.clip)}bake(t){return this.#w(t,this.#t.motion.clip)}async#w(t,e){let s=`${e.index}/${t}`;if(this.#r.has(s))return;this.#r.add(s);let{channel:r,metadata:i}=this.#t,n=await r.parts(t),a=Math.max(1,Math.ceil(e.frameCount*n.texels/Math.min(He,1024*$e))),h=await r.bake(e.index,t,a);if(!h.data||h.texels!==n.texels||!this.#t){this.#r.delete(s);return}let l=O(),{nodeCount:f,exactCount:c}=n.parts;l.athData.value=R(h.data),l.athForest.value.set(h.texels,i.up_axis==="z"?1:0),l.athStride.value=c>0?(n.texels-3*f)/c:1,this.#l=Math.max(this.#l,We(h,n,l.athStride.value)),await this.#F(t,e,n,{uniforms:l,rows:h.rows,perRow:Y(e)/h.rows||1}),this.#i.set(e.index,[...this.#i.get(e.index)??[],t]),this.dispatchEvent({type:"level",level:t})}async#F(t,e,s,r){let{channel:i,motion:n,rest:a,sphere:h}=this.#t,l=t===n.levelCount-1,f=m=>e.errors[m][this.measure],c=f(t),u=t>0?f(t-1):h.radius/4,d=i.nodeNumbers(s),p=s.vertices;d.forEach((m,w)=>{p[w]<0&&(d[w]=-1)});let g=y(this.#f(!this.#n.hasAttribute("normal"),t),r.uniforms,!0),v=(m,w)=>this.#M(e,m,g,{...r,texel:p,level:t,tolerance:w}),x=l?this.#n:q(this.#n,a,Ot*c,d);v(x,c);for(let m=Math.max(Ft*c,h.radius/2e3);m<u;m*=Ft){if(await qe(),!this.#t)return;let w=q(this.#n,a,Ot*m,d);w.userData.source.length>je*x.userData.source.length||(v(w,m),x=w)}}#M(t,e,s,r){let i=this.#x(t.index,e,s,{...r,base:e,fades:new Map});this.#e.set(t.index,[...this.#e.get(t.index)??[],i].sort((n,a)=>n.tolerance-a.tolerance))}#x(t,e,s,r){let i=new kt,{source:n}=e.userData,a=!e.hasAttribute("normal"),h=({texel:c})=>new Ne(k(new Float32Array(n.length),c,n,1),1);i.setIndex(e.index);for(let[c,u]of Object.entries(e.attributes))c!=="athPart"&&i.setAttribute(c,u);i.setAttribute("athPart",h(r)),r.from&&i.setAttribute("athPartBefore",h(r.from));let l=a?new Pe(i,s):new Ie(i,s);Object.assign(l,I(r.uniforms,!0),{castShadow:this.castShadow,receiveShadow:this.receiveShadow}),this.#d&&(l.customDepthMaterial=y(this.#d(),r.uniforms,!0)),Object.assign(l.userData,{level:r.level,clip:t}),l.frustumCulled=!1;let f={...r,drawn:l,size:n.length,filled:0};return this.#v(f),this.add(l),f}#S(t,e,s){if(!e.fades.has(s.level)){let{athData:r,athForest:i,athStride:n}=s.uniforms,a=!e.base.hasAttribute("normal"),h={...e.uniforms,athDataBefore:r,athBefore:{value:i.value.clone().setY(n.value)}},l=y(this.#f(a,e.level),h,!0);e.fades.set(s.level,this.#x(t,e.base,l,{...e,uniforms:h,from:s,fades:new Map}))}return e.fades.get(s.level)}#v(t){let e=t.drawn.geometry,s=new kt;s.setIndex(e.index);for(let[r,i]of Object.entries(e.attributes))s.setAttribute(r,i);for(let[r,i]of[["place","athPlace"],["turn","athTurn"],["look","athLook"],...t.from?[["share","athFading"]]:[]])t[r]=new De(new Float32Array(Math.max(4,this.#a.length)),4),s.setAttribute(i,t[r].setUsage(Ee));s.instanceCount=0,t.drawn.geometry=s,e.dispose()}update(t,e,s){let r=this.#u(),i=new Re,n=new Be,a=i.center,h=this.#A();this.updateWorldMatrix(!0,!1);let l=new Ue().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new Tt().copy(this.matrixWorld).invert());n.setFromProjectionMatrix(new Tt().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld));let f=2*Math.tan(t.fov*Math.PI/360)/e;this.#m=performance.now(),this.culled=0,this.fading=!1;for(let c of r)c.filled=0;this.#s=this.#e.get(this.#t.motion.clip.index)??this.#s;for(let c=0;c<this.#a.length&&r.length>0;c+=4){let u=this.#a[c+3],d=this.#A(this.#p[c]);if(a.fromArray(this.#a,c),i.radius=d*u,!n.intersectsSphere(i)){this.culled++,this.#c[c/4]=null;continue}let p=Math.max(l.distanceTo(a)-.5*h*u,1e-6),g=this.#e.get(this.#h[c+3])??this.#s,v=this.pixels*f*p/u;g.length>0&&this.#g(c,g,this.levelOfDetail?v:0,s)}this.counts=new Array(this.#t.motion.levelCount).fill(0),this.vertices=0;for(let c of this.#u())this.#O(c)}#g(t,e,s,r){let i=e[this.#T(e,s)],{clip:n}=i.drawn.userData,a=this.#B(t/4,n,i.level),h=a.level===i.level?i:this.#E(e,a.level,s),l=a.from<0?null:e.find(({level:f})=>f===a.from);if(!l){this.#y(t,h,r);return}this.fading=!0,this.#y(t,this.#S(n,h,l),r,1-U(this.#k(a)))}#E(t,e,s){let r=t.filter(i=>i.level===e);return r[this.#T(r,s)]}#B(t,e,s){let r=this.#c[t];return(!r||r.clip!==e)&&(r=this.#c[t]={clip:e,level:s,from:-1,since:0}),r.from>=0&&this.#k(r)>=1&&(r.from=-1),r.from<0&&r.level!==s&&Object.assign(r,{level:s,from:this.fade>0?r.level:-1,since:this.#m}),r}#k({since:t}){return(this.#m-t)/1e3/this.fade}#y(t,e,s,r=0){let{place:i,turn:n,look:a}=e,h=4*e.filled++;for(let l=0;l<4;l++)i.array[h+l]=this.#a[t+l];for(let l=0;l<4;l++)a.array[h+l]=this.#p[t+l];n.array[h]=this.#h[t],n.array[h+1]=this.#h[t+1],this.#b(n.array,h+2,e,s+this.#h[t+2]),e.from&&(this.#b(e.share.array,h,e.from,s+this.#h[t+2]),e.share.array[h+2]=r)}#b(t,e,{rows:s,perRow:r},i){let n=Math.fround(i/r%s),a=n<0?n+s:n;t[e]=a<s?a:0,t[e+1]=(Math.floor(t[e])+1)%s}#A(t=1){let{center:e,radius:s}=this.#t.sphere,r=e.length()+s,i=Math.max(Math.abs(t-.5)-.5,0);return Math.max(r,this.#l)+i*(r+this.#l)}#T(t,e){let s=0;for(;s+1<t.length&&t[s+1].tolerance<=e;)s++;return s}#O(t){let{filled:e,drawn:s}=t;s.geometry.instanceCount=e,s.visible=e>0,this.counts[t.level]+=e,this.vertices+=e*t.size;for(let r of[t.place,t.turn,t.look,t.share].filter(Boolean))r.clearUpdateRanges(),r.addUpdateRange(0,4*e),r.needsUpdate=e>0}dispose(){for(let t of this.#o.values())t.dispose();for(let{uniforms:t,drawn:e}of this.#u()){t.athData.value.dispose(),e.geometry.dispose();for(let s of[e.material,e.customDepthMaterial,e.customDistanceMaterial])s.dispose()}this.#e.clear(),this.#t=null}};function We({data:o,rows:t,texels:e},{parts:{nodeCount:s,exactCount:r},boxes:i},n){let a=0;for(let h=0;h<t;h++){let l=4*h*e;for(let[f,c,u,d,p,g,v]of i){let x=0;for(let m=l+f,w=0;w<3;w++,m+=4){let M=o[m]*c+o[m+1]*u+o[m+2]*d+o[m+3];x+=(Math.abs(M)+Math.abs(o[m])*p+Math.abs(o[m+1])*g+Math.abs(o[m+2])*v)**2}a=Math.max(a,x)}for(let f=0,c=l+12*s;f<r;f++,c+=4*n)a=Math.max(a,o[c]**2+o[c+1]**2+o[c+2]**2)}return Math.sqrt(a)}import{DoubleSide as nt,MeshDepthMaterial as Us,MeshStandardMaterial as Ke,RGBADepthPacking as Ns}from"three";var Et=["bark","stalks"],Bt=["leaves","blades","pinnae"];function Xe({surfaces:o}){let[t,e]=typeof o=="string"?o.split(", "):[];return Et.includes(t)&&Bt.includes(e)?[t,e]:null}var Je=`
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
`,Ye=`
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
`,Ze=`
float athIn=athInside();
diffuseColor.a=clamp(athIn/max(fwidth(athIn),1e-4)+.5,.0,1.);
#ifdef ALPHA_TO_COVERAGE
if (diffuseColor.a<.02) discard;
#else
if (diffuseColor.a<.5) discard;
#endif
`,Qe=`
${Ze}
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
`,ts=`
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
`,es=`
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
`;function ss(o,t,[e,s]){o.vertexShader=o.vertexShader.replace("#include <common>",`#include <common>
varying vec2 athUv;
varying vec3 athGrown;`).replace("#include <uv_vertex>",`#include <uv_vertex>
athUv = uv;
athGrown = position;`),o.fragmentShader=`#define ATH_STEM ${Et.indexOf(e)}
#define ATH_LEAF ${Bt.indexOf(s)}
${t}`}function rs(o){return o.onBeforeRender=(t,e)=>{o.alphaToCoverage=e.fog!==null,o.onBeforeRender=()=>{}},o}var at=class extends Ke{constructor(t={}){let e=Xe(t);super(e?{side:nt,shadowSide:nt}:{side:nt,color:7311178,roughness:.8}),e&&(this.onBeforeCompile=s=>ss(s,s.fragmentShader.replace("#include <common>",`#include <common>
${Je}${Ye}`).replace("#include <map_fragment>",Qe).replace("#include <roughnessmap_fragment>","float roughnessFactor = athIsLeaf ? 0.62 : 0.95;").replace("#include <normal_fragment_maps>",ts).replace("#include <lights_fragment_end>",`#include <lights_fragment_end>
${es}`),e),this.customProgramCacheKey=()=>`ath surface ${e}`,rs(this))}};export{z as ATH,ot as ATHForest,it as ATHLimbs,et as ATHLoader,F as ATHMotion,at as ATHPlantMaterial,W as MOTION_PARS,R as dataTexture,y as injectMotion,Me as limbDepth,st as limbGeometry,rt as limbMaterial,O as motionUniforms,$ as radii,H as setRadii,D as upright};
