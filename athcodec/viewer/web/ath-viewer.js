import{DirectionalLight as ht,HemisphereLight as ct,PerspectiveCamera as lt,Scene as ut,Vector3 as N,WebGLRenderer as ft}from"three";import{OrbitControls as dt}from"three/addons/controls/OrbitControls.js";import{ATHLoader as pt}from"athcodec-three";import{BufferAttribute as m,BufferGeometry as _,DoubleSide as Y,Group as J,InstancedBufferAttribute as Q,LineBasicMaterial as Z,LineSegments as tt,Mesh as k,MeshLambertMaterial as et}from"three";var u=[[33,53,121],[38,117,148],[57,169,128],[171,206,88],[252,231,98],[240,120,58],[180,26,50]],O=[[86,65,48],[161,108,61],[88,129,66],[132,176,72],[70,158,158],[86,110,190],[150,92,180]],y=o=>((o/255+.055)/1.055)**2.4,p=([o,t,r])=>[y(o),y(t),y(r)],H=Array.from({length:256},(o,t)=>{let r=t/255*(u.length-1),e=Math.min(Math.floor(r),u.length-2);return p(u[e].map((s,i)=>s+(r-e)*(u[e+1][i]-s)))}),gt=`linear-gradient(to right, ${u.map(o=>`rgb(${o.join(" ")})`).join(", ")})`;function z(o){return H[Math.max(0,Math.min(255,Math.round(o*255)))]}function P(o){return p(O[o%O.length])}function C(o){let t=o*.61803398875%1,r=150+60*(o*.381966%1),e=s=>r*(.62+.38*Math.cos(2*Math.PI*(t+s)));return p([e(0),e(1/3),e(2/3)])}function A(o){let t=(r,e)=>r+(e-r)*o;return p([t(92,132),t(72,140),t(54,84)])}import{BufferAttribute as U,InstancedBufferAttribute as B,InstancedBufferGeometry as $,ShaderMaterial as V,Vector2 as W}from"three";import{MeshDepthMaterial as At,MeshDistanceMaterial as wt,RGBADepthPacking as Mt,Vector2 as St}from"three";var q=`
attribute float athPart;
uniform highp sampler2D athData;
uniform float athStride; // texels per exact vertex
#ifdef ATH_FOREST
uniform vec2 athForest; // texels per frame, 1: the up axis is z
attribute vec4 athPlace; // x, y, z, size
attribute vec4 athTurn; // cosine, sine, frame, the frame that its fraction leads to
#endif
#ifdef ATH_FADING
attribute float athPartBefore;
attribute vec4 athFading; // the same two frames of the level before, its share
uniform highp sampler2D athDataBefore;
uniform vec2 athBefore; // texels per frame, per exact vertex
bool athIsBefore = false;
#endif

vec4 athTexel(int at) {
  ivec2 place = ivec2(at & 1023, at >> 10);
#ifdef ATH_FADING
  if (athIsBefore) return texelFetch(athDataBefore, place, 0);
#endif
  return texelFetch(athData, place, 0);
}

#ifdef ATH_FOREST
vec4 athAt(int at) {
  vec2 frames = athTurn.zw;
  int size = int(athForest.x);
#ifdef ATH_FADING
  if (athIsBefore) {
    frames = athFading.xy;
    size = int(athBefore.x);
  }
#endif
  return mix(athTexel(int(frames.x) * size + at), athTexel(int(frames.y) * size + at), fract(frames.x));
}
vec3 athSpin(vec3 p) {
  return athForest.y > 0.5 ? vec3(athTurn.x * p.x - athTurn.y * p.y, athTurn.y * p.x + athTurn.x * p.y, p.z)
    : vec3(athTurn.x * p.x + athTurn.y * p.z, p.y, athTurn.x * p.z - athTurn.y * p.x);
}
#else
vec4 athAt(int at) { return athTexel(at); }
#endif

vec3 athShown(vec3 p, float part) {
  int at = int(abs(part)) - 1;
  if (part < 0.0) return athAt(at).xyz;
  vec4 q = vec4(p, 1.0);
  return vec3(dot(athAt(at), q), dot(athAt(at + 1), q), dot(athAt(at + 2), q));
}

vec3 athMoved(vec3 rest, float part) {
  vec3 p = athShown(rest, part);
#ifdef ATH_FADING
  athIsBefore = true;
  p = mix(p, athShown(rest, athPartBefore), athFading.z);
  athIsBefore = false;
#endif
#ifdef ATH_FOREST
  p = athSpin(p) * athPlace.w + athPlace.xyz;
#endif
  return p;
}

vec3 athFacing(vec3 n, float part, float stride) {
  int at = int(abs(part)) - 1;
  if (part > 0.0) {
    vec3 a = athAt(at).xyz, b = athAt(at + 1).xyz, c = athAt(at + 2).xyz;
    n = vec3(dot(cross(b, c), n), dot(cross(c, a), n), dot(cross(a, b), n)); // by the cofactors
  } else if (stride > 1.5) {
    vec4 q = normalize(athAt(at + 1));
    n = n + 2.0 * cross(q.xyz, cross(q.xyz, n) + q.w * n);
  }
  return n;
}

vec3 athTurned(vec3 normal, float part) {
  vec3 n = athFacing(normal, part, athStride);
#ifdef ATH_FADING
  athIsBefore = true;
  n = mix(n, athFacing(normal, athPartBefore, athBefore.y), athFading.z);
  athIsBefore = false;
#endif
#ifdef ATH_FOREST
  n = athSpin(n);
#endif
  return n;
}
`;var E=q;var K=`
attribute vec3 rest, restOther, color, colorOther;
attribute float athPartOther, radius, radiusOther;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${E}
void main() {
  bool far = position.x > 0.5;
  vec4 p = modelViewMatrix * vec4(athMoved(rest, athPart), 1.0);
  vec4 q = modelViewMatrix * vec4(athMoved(restOther, athPartOther), 1.0);
  vec2 along = p.xy / -p.z - q.xy / -q.z;
  vec2 across = length(along) > 1e-9 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  if (far) p = q;
  float pixel = -p.z * 2.0 / (projectionMatrix[1][1] * screen.y);
  p.xy += across * position.y * max(far ? radiusOther : radius, 0.55 * pixel);
  gl_Position = projectionMatrix * p;
  vColor = far ? colorOther : color;
  vSide = position.y;
  vAcross = vec3(across, 0.0);
}`,X=`
uniform float shade;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
void main() {
  float s = clamp(vSide, -1.0, 1.0);
  vec3 n = normalize(vAcross * s + vec3(0.0, 0.0, sqrt(max(1.0 - s * s, 0.0))));
  float light = 0.55 + 0.55 * max(dot(n, normalize(vec3(0.45, 0.65, 0.6))), 0.0) + 0.1 * n.y;
  gl_FragColor = vec4(vColor * mix(1.0, light, shade), 1.0);
  #include <colorspace_fragment>
}`;function L(o,t){let r=o.skeleton,e=r.length/2,s=new Uint32Array(e),i=new Uint32Array(e);for(let n=0;n<e;n++)s[n]=r[2*n],i[n]=r[2*n+1];let a=new $;return a.setAttribute("position",new U(Float32Array.of(0,1,0,0,-1,0,1,1,0,1,-1,0),3)),a.setIndex([0,1,2,2,1,3]),a.setAttribute("rest",I(o.rest,s)),a.setAttribute("restOther",I(o.rest,i)),a.instanceCount=e,a.userData={source:s,other:i},w(a,t),a}function I(o,t){let r=new Float32Array(3*t.length);for(let e=0,s=0;e<t.length;e++){let i=3*t[e];r[s++]=o[i],r[s++]=o[i+1],r[s++]=o[i+2]}return new B(r,3)}function w(o,t){for(let[r,e]of[["radius",o.userData.source],["radiusOther",o.userData.other]]){let s=new Float32Array(e.length);for(let i=0;i<e.length;i++)s[i]=t[e[i]];o.setAttribute(r,new B(s,1))}}function D(o){return new V({vertexShader:K,fragmentShader:X,side:2,uniforms:{...o,screen:{value:new W(1,1)},shade:{value:1}}})}function M(o){let t=o.attributes.radius,r=o.rest.length/3;if(t?.array.length===r)return Float32Array.from(t.array,Number);let e=new Float32Array(r).fill(1),{first:s,count:i,attach:a}=o.branches,n=o.channel.vertexSource;for(let h=s.length-1;h>=0;h--){for(let c=s[h]+i[h]-2;c>=s[h];c--)e[n[c]]+=e[n[c+1]];a[h]>=0&&(e[n[a[h]]]+=e[n[s[h]]])}let l=e.reduce((h,c)=>Math.max(h,c),1),b=o.sphere.radius/50;return e.map(h=>b*Math.sqrt(h/l))}var rt=[.16,.29,.07],st=[.55,.2,.06],it=4,ot=()=>new et({vertexColors:!0,side:Y}),nt=()=>new Z({vertexColors:!0});function at(o){let t=new _;t.setIndex(o.index);for(let[r,e]of Object.entries(o.attributes))!r.startsWith("athPart")&&r!=="color"&&t.setAttribute(r,e);return t.userData=o.userData,t}var R=({userData:{source:o,other:t}})=>[["color",o],...t?[["colorOther",t]]:[]],v=class{root=new J;colour="plain";show="mesh";heatMost=0;beside=[this];#e;#i=null;#r;#t=[];#h=!0;constructor(t,r=t.motion){this.ath=t,this.motion=r;let e=t.metadata.up_axis;e==="z"&&(this.root.rotation.x=-Math.PI/2),e==="x"&&(this.root.rotation.z=Math.PI/2),this.root.updateMatrixWorld(!0);let{depth:s}=t.branches,i=t.vertexBranch;this.#e=i.map(a=>s[a]),this.onArrays=()=>this.#c(),t.addEventListener("arrays",this.onArrays),this.onLevel=()=>{this.colour==="node"&&this.#u()},this.onFrame=()=>{this.colour==="distance"&&this.paint()},r.addEventListener("level",this.onLevel),r.addEventListener("frame",this.onFrame),this.#s()}#s(){this.#n(),this.#r=M(this.ath),this.setShow(this.show),this.setColour(this.colour)}#n(){for(let{object:t,geometry:r}of this.#t)this.root.remove(t),this.motion.detach(r),r.dispose(),t.material.dispose();this.#t=[]}#c(){if(this.ath.hasFaces){this.#s();return}this.#r=M(this.ath);for(let{kind:t,geometry:r}of this.#t)t==="mesh"&&w(r,this.#r);this.paint()}#a(t){if(this.#t.some(n=>n.kind===t))return;let{ath:r,motion:e}=this,s;if(t==="skeleton")s=new tt(e.attach(this.#o()),e.bind(nt())),s.renderOrder=1;else if(r.hasFaces)s=new k(e.attach(at(r.geometry)),e.bind(ot()));else{let n=L(r,this.#r);s=new k(e.attach(n),D(e.uniforms))}let{geometry:i}=s,a=i.isInstancedBufferGeometry?Q:m;for(let[n,l]of R(i))i.setAttribute(n,new a(new Float32Array(3*l.length),3));s.frustumCulled=!1,this.#t.push({kind:t,geometry:i,object:s}),this.root.add(s)}forestGeometry(){if(this.ath.hasFaces)return this.ath.geometry;let t=this.#o(),r=new Float32Array(this.ath.rest.length),e=this.#l();for(let s=0;s<r.length/3;s++)r.set(e(s),3*s);return t.setAttribute("color",new m(r,3)),t}#l(){let t=this.#e.reduce((e,s)=>Math.max(e,s),1),r=Array.from({length:t+1},(e,s)=>A(s/t));return e=>r[this.#e[e]]}#o(){let{rest:t,skeleton:r}=this.ath,e=new _;return e.setIndex(new m(r,1)),e.setAttribute("position",new m(t,3)),e.userData.source=Uint32Array.from({length:t.length/3},(s,i)=>i),e}get vertices(){return this.#t.reduce((t,{object:r,geometry:e})=>t+(r.visible?e.userData.source.length*(e.isInstancedBufferGeometry?4:1):0),0)}setShow(t){this.show=t;for(let r of["mesh","skeleton"])(t===r||t==="both")&&this.#a(r);for(let{kind:r,object:e}of this.#t)e.visible=t==="both"||t===r,r==="skeleton"&&(e.material.depthTest=t!=="both");this.paint()}setColour(t){this.colour=t,this.motion.heat=t==="distance",t==="node"&&this.#u(),this.motion.refresh(),this.paint()}async#u(){this.motion.level<0||(this.#i=await this.motion.nodeNumbers(),this.paint())}#f(){let{colour:t,motion:r}=this;if(t==="node"&&this.#i){let e=Array.from({length:1+this.#i.reduce((s,i)=>Math.max(s,i),0)},(s,i)=>C(i));return s=>e[this.#i[s]]}if(t==="order"){let e=Array.from({length:1+this.#e.reduce((s,i)=>Math.max(s,i),0)},(s,i)=>P(i));return s=>e[this.#e[s]]}if(t==="distance"){let{distances:e}=r;return this.heatMost=Math.max(...this.beside.map(s=>s.motion.level<0?0:s.motion.error(s.motion.level).max)),s=>z(e&&this.heatMost?Math.sqrt(e[s]/this.heatMost):0)}return this.#l()}paint(){this.#h=!0,this.onPaint?.()}prepare(t,r){for(let{object:n}of this.#t)n.material.uniforms?.screen?.value.set(t,r);if(!this.#h)return;this.#h=!1;let e=this.#f(),s=this.colour==="plain"&&this.ath.hasFaces,i=s?this.ath.geometry.getAttribute("color"):null,a=this.show==="both"&&this.colour==="plain"?st:null;for(let{kind:n,geometry:l,object:b}of this.#t){if(!b.visible)continue;let h=n==="skeleton"?a:null,c=i&&n==="mesh",G=s&&n!=="skeleton"?this.#d():e;for(let[j,T]of R(l)){let F=l.getAttribute(j),g=F.array;for(let f=0,d=0;f<T.length;f++,d+=3){let x=h??(c?i.array.subarray(f*i.itemSize):G(T[f]));g[d]=x[0],g[d+1]=x[1],g[d+2]=x[2]}F.needsUpdate=!0}}}#d(){let{ring:t,depth:r}=this.ath.branches,e=this.ath.vertexBranch;return s=>{let i=e[s],a=.75+.6*(i*.61803398875%1);return t[i]?A(Math.min(1,r[i]/it)):rt.map(n=>n*a)}}dispose(){this.ath.removeEventListener("arrays",this.onArrays),this.motion.removeEventListener("level",this.onLevel),this.motion.removeEventListener("frame",this.onFrame),this.#n()}};var mt=":host { display: block; position: relative; min-height: 150px; } canvas { width: 100%; height: 100%; display: block; position: absolute; inset: 0; outline-offset: -2px; }",vt=.5,bt=null,S=class o extends HTMLElement{static observedAttributes=["src","clip","level","wind","paused","alt","camera-controls"];static get loader(){return bt??=new pt}#e=document.createElement("canvas");#i=null;#r=null;#t=new lt(38,1,.01,1e3);#h=new ut;#s=null;#n=0;#c=0;#a=0;#l=!1;#o=!1;#u=0;#f=new ResizeObserver(()=>this.#A());#d=new IntersectionObserver(([{isIntersecting:t}])=>{this.#l=t,this.#v()});constructor(){super();let t=new CSSStyleSheet,r=this.attachShadow({mode:"open"});t.replaceSync(mt),r.adoptedStyleSheets=[t],r.append(this.#e),this.#e.setAttribute("role","img");let e=new ht(16773853,2.4);e.position.set(.6,1,.7),this.#h.add(new ct(15397631,9077617,1.9),e)}connectedCallback(){this.#i=new ft({canvas:this.#e,antialias:!0,alpha:!0}),this.#r=new dt(this.#t,this.#e),this.#r.enableDamping=!0,this.#r.addEventListener("change",()=>{this.#o=!0}),this.#f.observe(this),this.#d.observe(this),this.#e.setAttribute("aria-label",this.getAttribute("alt")??"Moving plant"),this.#b(),this.src&&this.#g()}disconnectedCallback(){this.#f.disconnect(),this.#d.disconnect(),cancelAnimationFrame(this.#a),this.#a=0,this.#l=!1,this.#m(),this.#r.dispose(),this.#i.dispose(),this.#i=null}attributeChangedCallback(t,r,e){!this.#i||r===e||(t==="src"&&this.#g(),(t==="clip"||t==="wind")&&this.#x(),t==="level"&&this.#y(),t==="alt"&&this.#e.setAttribute("aria-label",e??"Moving plant"),t==="camera-controls"&&this.#b(),this.#c=0,this.#v())}get src(){return this.getAttribute("src")}set src(t){this.setAttribute("src",t)}get paused(){return this.hasAttribute("paused")}set paused(t){this.toggleAttribute("paused",t)}play(){this.paused=!1}pause(){this.paused=!0}get currentTime(){return this.#n}set currentTime(t){this.#n=t,this.#o=!0}get ath(){return this.#s?.ath??null}get camera(){return this.#t}#b(){this.#r.enabled=this.hasAttribute("camera-controls"),this.#e.style.touchAction=this.#r.enabled?"none":"auto",this.#r.enabled?this.#e.tabIndex=0:this.#e.removeAttribute("tabindex")}#p(t,r){this.dispatchEvent(new CustomEvent(t,{detail:r}))}async#g(){let t=++this.#u,{src:r}=this;if(!r){this.#m();return}try{o.loader.setClip(this.getAttribute("clip"));let e=o.loader.loadAsync(new URL(r,document.baseURI).href);o.loader.setClip(null);let s=await e;t===this.#u?this.#M(s):s.dispose()}catch(e){t===this.#u&&this.#p("error",e)}}#m(){this.#u++,this.#s?.dispose(),this.#s?.root.removeFromParent(),this.#s?.ath.dispose(),this.#s=null}#M(t){this.#m();let r=this.#s=new v(t),{motion:e}=t,s=()=>{this.#o=!0};r.onPaint=s;for(let i of["frame","ready"])e.addEventListener(i,s);e.addEventListener("progress",({loaded:i,total:a})=>this.#p("progress",{loaded:i,total:a}));for(let i of["stopped","damaged"])e.addEventListener(i,a=>this.#p("error",a));this.#h.add(r.root),this.#n=0,this.hasAttribute("wind")&&this.#x(),this.#y(),this.#A(),this.#S(),this.#v(),this.#p("load",{ath:t})}#x(){let t=this.#s?.ath.motion,r=this.getAttribute("wind"),e=this.getAttribute("clip");t&&(r!==null?t.wind(...r.split(/[\s,]+/).map(Number)):t.play(e??0,{fade:.4}),this.#o=!0)}#y(){let t=this.getAttribute("level")??"auto";this.#s?.ath.motion.setLevel(t==="auto"?t:Number(t)),this.#o=!0}#A(){let{clientWidth:t,clientHeight:r}=this;!this.#i||t===0||r===0||(this.#i.setPixelRatio(Math.min(devicePixelRatio,2)),this.#i.setSize(t,r,!1),this.#t.aspect=t/r,this.#t.updateProjectionMatrix(),this.#o=!0)}#S(){let{ath:t,root:r}=this.#s,e=t.box.clone().applyMatrix4(r.matrixWorld),s=e.getSize(new N),i=Math.tan(this.#t.fov*Math.PI/360),a=Math.hypot(s.x,s.z),n=.35*a+.6*Math.max(s.y,a/this.#t.aspect,1e-6)/i;e.getCenter(this.#r.target),this.#t.position.copy(this.#r.target).add(new N(.35,.16,.92).normalize().multiplyScalar(n)),Object.assign(this.#t,{near:n/500,far:n*60}).updateProjectionMatrix(),this.#r.update()}#v(){this.#a===0&&this.#l&&this.#s&&(this.#c=0,this.#a=requestAnimationFrame(t=>this.#w(t)))}#w(t){if(this.#a=0,!this.#l||!this.#s)return;this.#a=requestAnimationFrame(a=>this.#w(a));let r=this.#c?Math.min(vt,(t-this.#c)/1e3):0,{ath:{motion:e},root:s}=this.#s;this.#c=t,this.paused||(this.#n+=r*(Number(this.getAttribute("speed"))||1));let i=this.#e.height;this.#r.update(),e.update(this.#t,i,s).setTime(this.#n),this.#o&&(this.#o=!1,this.#s.prepare(this.#e.width,i),this.#i.render(this.#h,this.#t))}};customElements.get("ath-viewer")||customElements.define("ath-viewer",S);export{S as ATHViewerElement};
