import{DirectionalLight as wt,HemisphereLight as At,PerspectiveCamera as St,Scene as Mt,Vector3 as K,WebGLRenderer as Tt}from"three";import{OrbitControls as Ft}from"three/addons/controls/OrbitControls.js";import{ATHLoader as It}from"athcodec-three";import{BufferAttribute as p,BufferGeometry as W,DoubleSide as ct,Group as lt,InstancedBufferAttribute as ft,LineBasicMaterial as ut,LineSegments as dt,Mesh as V,MeshLambertMaterial as mt}from"three";var f=[[33,53,121],[38,117,148],[57,169,128],[171,206,88],[252,231,98],[240,120,58],[180,26,50]],C=[[86,65,48],[161,108,61],[88,129,66],[132,176,72],[70,158,158],[86,110,190],[150,92,180]],y=i=>((i/255+.055)/1.055)**2.4,m=([i,t,r])=>[y(i),y(t),y(r)],J=Array.from({length:256},(i,t)=>{let r=t/255*(f.length-1),e=Math.min(Math.floor(r),f.length-2);return m(f[e].map((a,s)=>a+(r-e)*(f[e+1][s]-a)))}),Ot=`linear-gradient(to right, ${f.map(i=>`rgb(${i.join(" ")})`).join(", ")})`;function P(i){return J[Math.max(0,Math.min(255,Math.round(i*255)))]}function B(i){return m(C[i%C.length])}function O(i){let t=i*.61803398875%1,r=150+60*(i*.381966%1),e=a=>r*(.62+.38*Math.cos(2*Math.PI*(t+a)));return m([e(0),e(1/3),e(2/3)])}function w(i){let t=(r,e)=>r+(e-r)*i;return m([t(92,132),t(72,140),t(54,84)])}import{BufferAttribute as Z,InstancedBufferAttribute as D,InstancedBufferGeometry as tt,ShaderMaterial as k,Vector2 as _}from"three";import{MeshDepthMaterial as Dt,MeshDistanceMaterial as kt,RGBADepthPacking as _t,Vector2 as Et}from"three";var Q=`
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
`;var z=Q;var E=`
attribute vec3 rest, restOther, color, colorOther;
attribute float athPartOther, radius, radiusOther;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${z}
void main() {
  bool far = position.x > 0.5;
  vec4 p = modelViewMatrix * vec4(athMoved(rest, athPart), 1.0);
  vec4 q = modelViewMatrix * vec4(athMoved(restOther, athPartOther), 1.0);
  vec2 along = isOrthographic ? p.xy - q.xy : p.xy / -p.z - q.xy / -q.z;
  vec2 across = length(along) > 1e-9 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  if (far) p = q;
  float pixel = (isOrthographic ? 1.0 : -p.z) * 2.0 / (projectionMatrix[1][1] * screen.y);
  float wide = max(far ? radiusOther : radius, 0.55 * pixel);
  p.xy += wide * (across * position.y + vec2(across.y, -across.x) * (far ? -0.6 : 0.6)); // over the joints, where limbs bend
  gl_Position = projectionMatrix * p;
  vColor = far ? colorOther : color;
  vSide = position.y;
  vAcross = vec3(across, 0.0);
}`,et=`
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
}`;function H(i,t){let r=i.skeleton,e=r.length/2,a=new Uint32Array(e),s=new Uint32Array(e);for(let o=0;o<e;o++)a[o]=r[2*o],s[o]=r[2*o+1];let n=new tt;return n.setAttribute("position",new Z(Float32Array.of(0,1,0,0,-1,0,1,1,0,1,-1,0),3)),n.setIndex([0,1,2,2,1,3]),n.setAttribute("rest",L(i.rest,a)),n.setAttribute("restOther",L(i.rest,s)),n.instanceCount=e,n.userData={source:a,other:s},A(n,t),n}function L(i,t){let r=new Float32Array(3*t.length);for(let e=0,a=0;e<t.length;e++){let s=3*t[e];r[a++]=i[s],r[a++]=i[s+1],r[a++]=i[s+2]}return new D(r,3)}function A(i,t){for(let[r,e]of[["radius",i.userData.source],["radiusOther",i.userData.other]]){let a=new Float32Array(e.length);for(let s=0;s<e.length;s++)a[s]=t[e[s]];i.setAttribute(r,new D(a,1))}}function G(i){let t=`#include <packing>
void main() { gl_FragColor = packDepthToRGBA(gl_FragCoord.z); }`;return new k({vertexShader:E,fragmentShader:t,side:2,uniforms:{...i,screen:{value:new _(2048,2048)}}})}function N(i){return new k({vertexShader:E,fragmentShader:et,side:2,uniforms:{...i,screen:{value:new _(1,1)},shade:{value:1}}})}function S(i){let t=i.attributes.radius,r=i.rest.length/3;if(t?.array.length===r)return Float32Array.from(t.array,Number);let e=new Float32Array(r).fill(1),{first:a,count:s,attach:n}=i.branches,o=i.channel.vertexSource;for(let h=a.length-1;h>=0;h--){for(let c=a[h]+s[h]-2;c>=a[h];c--)e[o[c]]+=e[o[c+1]];n[h]>=0&&(e[o[n[h]]]+=e[o[a[h]]])}let l=e.reduce((h,c)=>Math.max(h,c),1),g=i.sphere.radius/50;return e.map(h=>g*Math.sqrt(h/l))}import{DoubleSide as M,MeshDepthMaterial as rt,MeshStandardMaterial as at,RGBADepthPacking as it}from"three";var R=`
varying vec2 athUv;
varying vec3 athGrown;
float athHalf(float v) { // half the width of a leaf, its teeth as long as they are wider than a pixel; below 0.1 its stalk
  float along = clamp((v - 0.1) / 0.9, 0.0, 1.0), teeth = 1.0 - smoothstep(0.02, 0.06, fwidth(v));
  float outline = pow(sin(3.14159 * pow(along, 0.8)), 0.8) * (0.95 - 0.06 * teeth * abs(sin(34.0 * along)));
  return max(outline, v < 0.2 ? 0.04 : 0.0);
}
float athInside() { // below 0 outside of a leaf's outline
  if (athUv.x < 1.0) return 1.0;
  float across = abs(4.0 * fract(0.5 * (athUv.x - 1.0)) - 1.0);
  return min(athHalf(athUv.y) - across, 0.995 - athUv.y);
}
`,st=`
float athHash(vec3 p) {
  p = fract(p * 0.3183099 + vec3(0.71, 0.113, 0.419));
  p *= 17.0;
  return fract(p.x * p.y * p.z * (p.x + p.y + p.z));
}
float athNoise(vec3 x) {
  vec3 i = floor(x), f = fract(x);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(mix(athHash(i), athHash(i + vec3(1, 0, 0)), f.x), mix(athHash(i + vec3(0, 1, 0)), athHash(i + vec3(1, 1, 0)), f.x), f.y),
    mix(mix(athHash(i + vec3(0, 0, 1)), athHash(i + vec3(1, 0, 1)), f.x), mix(athHash(i + vec3(0, 1, 1)), athHash(i + vec3(1, 1, 1)), f.x), f.y), f.z);
}
float athBark(vec2 uv) { // height: furrows along the stem, broken across
  vec3 p = vec3(uv.x * 9.0, uv.y * 5.0, 1.7);
  float warp = athNoise(p * vec3(0.8, 1.4, 1.0)) - 0.5;
  float ridge = 1.0 - abs(2.0 * athNoise(vec3(p.x * 1.3 + 1.6 * warp, p.y * 0.55, 4.0)) - 1.0);
  float cracks = athNoise(vec3(p.x * 2.0, p.y * 3.2, 9.0));
  float near = 1.0 - smoothstep(0.06, 0.3, length(fwidth(uv)));
  return mix(0.45, ridge * ridge * 0.75 + 0.25 * cracks, near);
}
float athVeins(vec2 leaf) { // 1 on a vein, as long as that is wider than a pixel
  float across = abs(leaf.x), rib = 1.0 - smoothstep(0.0, 0.05, across);
  float side = abs(fract(8.0 * (leaf.y - 0.42 * across)) - 0.5);
  float near = 1.0 - smoothstep(0.03, 0.12, fwidth(leaf.y));
  return near * max(rib, (1.0 - smoothstep(0.0, 0.12, side)) * 0.55 * (1.0 - across));
}
`,ot=`
float athIn = athInside();
diffuseColor.a = clamp(athIn / max(fwidth(athIn), 1e-4) + 0.5, 0.0, 1.0);
if (diffuseColor.a < 0.5) discard;
bool athIsLeaf = athUv.x >= 1.0;
float athThin = 0.0, athBump = 0.0;
if (athIsLeaf) {
  float shade = floor(0.5 * (athUv.x - 1.0)) / 7.0;
  vec2 leaf = vec2(4.0 * fract(0.5 * (athUv.x - 1.0)) - 1.0, athUv.y);
  float veins = athVeins(leaf);
  vec3 green = mix(vec3(0.062, 0.155, 0.018), vec3(0.145, 0.255, 0.03), shade);
  green = mix(green, vec3(0.21, 0.22, 0.04), 0.3 * smoothstep(0.75, 1.0, shade));
  green *= 0.85 + 0.3 * athNoise(vec3(leaf * 5.0, 8.0 * shade));
  diffuseColor.rgb = mix(green, green * 1.5 + 0.015, veins * 0.6);
  athThin = 0.85 - 0.5 * veins;
  athBump = veins * 0.3;
} else {
  athBump = athBark(athUv);
  float age = athNoise(athGrown * 3.0), lichen = smoothstep(0.62, 0.8, athNoise(athGrown * 7.0 + 3.0));
  vec3 bark = mix(vec3(0.05, 0.037, 0.027), vec3(0.27, 0.215, 0.165), athBump);
  bark = mix(bark, bark * vec3(0.85, 0.92, 0.8), age);
  diffuseColor.rgb = mix(bark, vec3(0.17, 0.19, 0.12), 0.35 * lichen * athBump);
}
`,nt=`
if (athIsLeaf && dot(normal, normalize(vViewPosition)) < 0.0) normal = -normal;
{
  vec3 dx = dFdx(vViewPosition), dy = dFdy(vViewPosition);
  float hx = dFdx(athBump), hy = dFdy(athBump), strength = athIsLeaf ? 0.004 : 0.03;
  vec3 r1 = cross(dy, normal), r2 = cross(normal, dx);
  float det = dot(dx, r1);
  vec3 slope = sign(det) * (hx * r1 + hy * r2) * strength;
  float rough = length(vec2(hx, hy));
  normal = normalize(abs(det) * normal - slope * (1.0 - smoothstep(0.06, 0.3, rough)));
}
`,ht=`
#if NUM_DIR_LIGHTS > 0
if (athIsLeaf) {
  vec3 sun = directionalLights[0].direction;
  float behind = max(dot(-normal, sun), 0.0), toward = pow(max(dot(-normalize(vViewPosition), -sun) * -1.0, 0.0), 4.0);
  float lit = 1.0;
  #if defined(USE_SHADOWMAP) && NUM_DIR_LIGHT_SHADOWS > 0
  lit = receiveShadow ? getShadow(directionalShadowMap[0], directionalLightShadows[0].shadowMapSize, directionalLightShadows[0].shadowIntensity,
    directionalLightShadows[0].shadowBias, directionalLightShadows[0].shadowRadius, vDirectionalShadowCoord[0]) : 1.0;
  #endif
  vec3 through = diffuseColor.rgb * vec3(1.5, 1.45, 0.45);
  reflectedLight.directDiffuse += athThin * (0.55 * behind + 0.25 * toward) * lit * directionalLights[0].color * through;
}
#endif
`;function U(i,t){i.vertexShader=i.vertexShader.replace("#include <common>",`#include <common>
varying vec2 athUv;
varying vec3 athGrown;`).replace("#include <uv_vertex>",`#include <uv_vertex>
athUv = uv;
athGrown = position;`),i.fragmentShader=t}function j(){let i=new at({side:M,shadowSide:M});return i.onBeforeCompile=t=>U(t,t.fragmentShader.replace("#include <common>",`#include <common>
${R}${st}`).replace("#include <map_fragment>",ot).replace("#include <roughnessmap_fragment>","float roughnessFactor = athIsLeaf ? 0.62 : 0.95;").replace("#include <normal_fragment_maps>",nt).replace("#include <lights_fragment_end>",`#include <lights_fragment_end>
${ht}`)),i.customProgramCacheKey=()=>"ath surface",i}function q(){let i=new rt({depthPacking:it,side:M});return i.onBeforeCompile=t=>U(t,t.fragmentShader.replace("#include <common>",`#include <common>
${R}`).replace("#include <map_fragment>","if (athInside() < 0.0) discard;")),i.customProgramCacheKey=()=>"ath surface depth",i}var pt=[.16,.29,.07],vt=[.55,.2,.06],gt=4,xt=()=>new mt({vertexColors:!0,side:ct}),bt=()=>new ut({vertexColors:!0});function yt(i){let t=new W;t.setIndex(i.index);for(let[r,e]of Object.entries(i.attributes))!r.startsWith("athPart")&&r!=="color"&&t.setAttribute(r,e);return t.userData=i.userData,t}var $=({userData:{source:i,other:t}})=>[["color",i],...t?[["colorOther",t]]:[]],v=class{root=new lt;colour="plain";show="mesh";heatMost=0;beside=[this];#e;#i=null;#a;#t=[];#o=null;#r=!0;constructor(t,r=t.motion){this.ath=t,this.motion=r;let e=t.metadata.up_axis;e==="z"&&(this.root.rotation.x=-Math.PI/2),e==="x"&&(this.root.rotation.z=Math.PI/2),this.root.updateMatrixWorld(!0);let{depth:a}=t.branches,s=t.vertexBranch;this.#e=s.map(n=>a[n]),this.onArrays=()=>this.#c(),t.addEventListener("arrays",this.onArrays),this.onLevel=()=>{this.colour==="node"&&this.#m()},this.onFrame=()=>{this.colour==="distance"&&this.paint()},r.addEventListener("level",this.onLevel),r.addEventListener("frame",this.onFrame),this.#n()}#n(){this.#h(),this.#a=S(this.ath),this.setShow(this.show),this.setColour(this.colour)}#h(){for(let{object:t,geometry:r,other:e}of this.#t)this.root.remove(t),this.motion.detach(r),r.dispose(),t.material.dispose(),e?.dispose();this.#o?.dispose(),this.#o=null,this.#t=[]}#c(){if(this.ath.hasFaces){this.#n();return}this.#a=S(this.ath);for(let{kind:t,geometry:r}of this.#t)t==="mesh"&&A(r,this.#a);this.paint()}get hasSurfaces(){return this.ath.metadata.surfaces==="bark, leaves"&&this.ath.geometry.hasAttribute("uv")}#l(){let t=this.#t.find(({kind:e})=>e==="mesh"),r=this.colour==="plain"&&this.ath.hasFaces&&this.hasSurfaces;!t||r===!!t.other||(r&&(this.#o??=this.motion.bind(j())),[t.object.material,t.other]=r?[this.#o,t.object.material]:[t.other,null])}#s(t){if(this.#t.some(o=>o.kind===t))return;let{ath:r,motion:e}=this,a;if(t==="skeleton")a=new dt(e.attach(this.#d()),e.bind(bt())),a.renderOrder=1;else if(r.hasFaces)a=e.bindShadows(new V(e.attach(yt(r.geometry)),e.bind(xt()))),this.hasSurfaces&&Object.assign(a,{customDepthMaterial:e.bind(q())});else{let o=H(r,this.#a);a=new V(e.attach(o),N(e.uniforms)),a.customDepthMaterial=G(e.uniforms)}a.castShadow=a.receiveShadow=t==="mesh";let{geometry:s}=a,n=s.isInstancedBufferGeometry?ft:p;for(let[o,l]of $(s))s.setAttribute(o,new n(new Float32Array(3*l.length),3));a.frustumCulled=!1,this.#t.push({kind:t,geometry:s,object:a}),this.root.add(a),this.#l()}forestGeometry(){if(this.ath.hasFaces)return this.ath.geometry;let t=this.#d(),r=new Float32Array(this.ath.rest.length),e=this.#f();for(let a=0;a<r.length/3;a++)r.set(e(a),3*a);return t.setAttribute("color",new p(r,3)),t}#f(){let t=this.#e.reduce((e,a)=>Math.max(e,a),1),r=Array.from({length:t+1},(e,a)=>w(a/t));return e=>r[this.#e[e]]}#d(){let{rest:t,skeleton:r}=this.ath,e=new W;return e.setIndex(new p(r,1)),e.setAttribute("position",new p(t,3)),e.userData.source=Uint32Array.from({length:t.length/3},(a,s)=>s),e}get vertices(){return this.#t.reduce((t,{object:r,geometry:e})=>t+(r.visible?e.userData.source.length*(e.isInstancedBufferGeometry?4:1):0),0)}setShow(t){this.show=t;for(let r of["mesh","skeleton"])(t===r||t==="both")&&this.#s(r);for(let{kind:r,object:e}of this.#t)e.visible=t==="both"||t===r,r==="skeleton"&&(e.material.depthTest=t!=="both");this.paint()}setColour(t){this.colour=t,this.#l(),this.motion.heat=t==="distance",t==="node"&&this.#m(),this.motion.refresh(),this.paint()}async#m(){this.motion.level<0||(this.#i=await this.motion.nodeNumbers(),this.paint())}#p(){let{colour:t,motion:r}=this;if(t==="node"&&this.#i){let e=Array.from({length:1+this.#i.reduce((a,s)=>Math.max(a,s),0)},(a,s)=>O(s));return a=>e[this.#i[a]]}if(t==="order"){let e=Array.from({length:1+this.#e.reduce((a,s)=>Math.max(a,s),0)},(a,s)=>B(s));return a=>e[this.#e[a]]}if(t==="distance"){let{distances:e}=r;return this.heatMost=Math.max(...this.beside.map(a=>a.motion.level<0?0:a.motion.error(a.motion.level).max)),a=>P(e&&this.heatMost?Math.sqrt(e[a]/this.heatMost):0)}return this.#f()}paint(){this.#r=!0,this.onPaint?.()}prepare(t,r){for(let{object:o}of this.#t)o.material.uniforms?.screen?.value.set(t,r);if(!this.#r)return;this.#r=!1;let e=this.#p(),a=this.colour==="plain"&&this.ath.hasFaces,s=a?this.ath.geometry.getAttribute("color"):null,n=this.show==="both"&&this.colour==="plain"?vt:null;for(let{kind:o,geometry:l,object:g}of this.#t){if(!g.visible)continue;let h=o==="skeleton"?n:null,c=s&&o==="mesh",X=a&&o!=="skeleton"?this.#u():e;for(let[Y,F]of $(l)){let I=l.getAttribute(Y),x=I.array;for(let u=0,d=0;u<F.length;u++,d+=3){let b=h??(c?s.array.subarray(u*s.itemSize):X(F[u]));x[d]=b[0],x[d+1]=b[1],x[d+2]=b[2]}I.needsUpdate=!0}}}#u(){let{ring:t,depth:r}=this.ath.branches,e=this.ath.vertexBranch;return a=>{let s=e[a],n=.75+.6*(s*.61803398875%1);return t[s]?w(Math.min(1,r[s]/gt)):pt.map(o=>o*n)}}dispose(){this.ath.removeEventListener("arrays",this.onArrays),this.motion.removeEventListener("level",this.onLevel),this.motion.removeEventListener("frame",this.onFrame),this.#h()}};var Ct=":host { display: block; position: relative; min-height: 150px; } canvas { width: 100%; height: 100%; display: block; position: absolute; inset: 0; outline-offset: -2px; }",Pt=.5,Bt=null,T=class i extends HTMLElement{static observedAttributes=["src","clip","level","wind","paused","alt","camera-controls"];static get loader(){return Bt??=new It}#e=document.createElement("canvas");#i=null;#a=null;#t=new St(38,1,.01,1e3);#o=new Mt;#r=null;#n=0;#h=0;#c=0;#l=!1;#s=!1;#f=0;#d=new ResizeObserver(()=>this.#w());#m=new IntersectionObserver(([{isIntersecting:t}])=>{this.#l=t,this.#g()});constructor(){super();let t=new CSSStyleSheet,r=this.attachShadow({mode:"open"});t.replaceSync(Ct),r.adoptedStyleSheets=[t],r.append(this.#e),this.#e.setAttribute("role","img");let e=new wt(16773853,2.4);e.position.set(.6,1,.7),this.#o.add(new At(15397631,9077617,1.9),e)}connectedCallback(){this.#i=new Tt({canvas:this.#e,antialias:!0,alpha:!0}),this.#a=new Ft(this.#t,this.#e),this.#a.enableDamping=!0,this.#a.addEventListener("change",()=>{this.#s=!0}),this.#d.observe(this),this.#m.observe(this),this.#e.setAttribute("aria-label",this.getAttribute("alt")??"Moving plant"),this.#p(),this.src&&this.#x()}disconnectedCallback(){this.#d.disconnect(),this.#m.disconnect(),cancelAnimationFrame(this.#c),this.#c=0,this.#l=!1,this.#v(),this.#a.dispose(),this.#i.dispose(),this.#i=null}attributeChangedCallback(t,r,e){!this.#i||r===e||(t==="src"&&this.#x(),(t==="clip"||t==="wind")&&this.#b(),t==="level"&&this.#y(),t==="alt"&&this.#e.setAttribute("aria-label",e??"Moving plant"),t==="camera-controls"&&this.#p(),this.#h=0,this.#g())}get src(){return this.getAttribute("src")}set src(t){this.setAttribute("src",t)}get paused(){return this.hasAttribute("paused")}set paused(t){this.toggleAttribute("paused",t)}play(){this.paused=!1}pause(){this.paused=!0}get currentTime(){return this.#n}set currentTime(t){this.#n=t,this.#s=!0}get ath(){return this.#r?.ath??null}get camera(){return this.#t}#p(){this.#a.enabled=this.hasAttribute("camera-controls"),this.#e.style.touchAction=this.#a.enabled?"none":"auto",this.#a.enabled?this.#e.tabIndex=0:this.#e.removeAttribute("tabindex")}#u(t,r){this.dispatchEvent(new CustomEvent(t,{detail:r}))}async#x(){let t=++this.#f,{src:r}=this;if(!r){this.#v();return}try{i.loader.setClip(this.getAttribute("clip"));let e=i.loader.loadAsync(new URL(r,document.baseURI).href);i.loader.setClip(null);let a=await e;t===this.#f?this.#S(a):a.dispose()}catch(e){t===this.#f&&this.#u("error",e)}}#v(){this.#f++,this.#r?.dispose(),this.#r?.root.removeFromParent(),this.#r?.ath.dispose(),this.#r=null}#S(t){this.#v();let r=this.#r=new v(t),{motion:e}=t,a=()=>{this.#s=!0};r.onPaint=a;for(let s of["frame","ready"])e.addEventListener(s,a);e.addEventListener("progress",({loaded:s,total:n})=>this.#u("progress",{loaded:s,total:n}));for(let s of["stopped","damaged"])e.addEventListener(s,n=>this.#u("error",n));this.#o.add(r.root),this.#n=0,this.hasAttribute("wind")&&this.#b(),this.#y(),this.#w(),this.#M(),this.#g(),this.#u("load",{ath:t})}#b(){let t=this.#r?.ath.motion,r=this.getAttribute("wind"),e=this.getAttribute("clip");t&&(r!==null?t.wind(...r.split(/[\s,]+/).map(Number)):t.play(e??0,{fade:.4}),this.#s=!0)}#y(){let t=this.getAttribute("level")??"auto";this.#r?.ath.motion.setLevel(t==="auto"?t:Number(t)),this.#s=!0}#w(){let{clientWidth:t,clientHeight:r}=this;!this.#i||t===0||r===0||(this.#i.setPixelRatio(Math.min(devicePixelRatio,2)),this.#i.setSize(t,r,!1),this.#t.aspect=t/r,this.#t.updateProjectionMatrix(),this.#s=!0)}#M(){let{ath:t,root:r}=this.#r,e=t.box.clone().applyMatrix4(r.matrixWorld),a=e.getSize(new K),s=Math.tan(this.#t.fov*Math.PI/360),n=Math.hypot(a.x,a.z),o=.35*n+.6*Math.max(a.y,n/this.#t.aspect,1e-6)/s;e.getCenter(this.#a.target),this.#t.position.copy(this.#a.target).add(new K(.35,.16,.92).normalize().multiplyScalar(o)),Object.assign(this.#t,{near:o/500,far:o*60}).updateProjectionMatrix(),this.#a.update()}#g(){this.#c===0&&this.#l&&this.#r&&(this.#h=0,this.#c=requestAnimationFrame(t=>this.#A(t)))}#A(t){if(this.#c=0,!this.#l||!this.#r)return;this.#c=requestAnimationFrame(n=>this.#A(n));let r=this.#h?Math.min(Pt,(t-this.#h)/1e3):0,{ath:{motion:e},root:a}=this.#r;this.#h=t,this.paused||(this.#n+=r*(Number(this.getAttribute("speed"))||1));let s=this.#e.height;this.#a.update(),e.update(this.#t,s,a).setTime(this.#n),this.#s&&(this.#s=!1,this.#r.prepare(this.#e.width,s),this.#i.render(this.#o,this.#t))}};customElements.get("ath-viewer")||customElements.define("ath-viewer",T);export{T as ATHViewerElement};
