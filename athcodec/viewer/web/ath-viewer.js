import{DirectionalLight as ts,HemisphereLight as es,PerspectiveCamera as It,Scene as ss,Vector3 as G,WebGLRenderer as os}from"three";import{OrbitControls as rs}from"three/addons/controls/OrbitControls.js";import{ATHLoader as as}from"athcodec-three";import{DoubleSide as he,MeshLambertMaterial as ce}from"three";import{ATHForest as le}from"athcodec-three";var m=(r,t)=>{let e=Math.sin(12.9898*(r+1)+78.233*t)*43758.5453;return e-Math.floor(e)},Dt=Math.PI*(3-Math.sqrt(5)),V=({sphere:r},t,e=1)=>1.1*r.radius*e*Math.sqrt(t);function K({metadata:r,motion:t,rest:e},s,o){let a=t.duration||1,i=r.up_axis==="z";return Array.from({length:s},(n,h)=>{let c=o*Math.sqrt((h+.3)/s),l=h*Dt+.5*Math.sin(h*12.9898),d=.75+.5*(Math.sin(h*78.233)*.5+.5),f=c*Math.cos(l),u=c*Math.sin(l);return{...i?{x:f,y:u,z:e[2]*(1-d)}:{x:f,y:e[1]*(1-d),z:u},size:d,angle:h*2.4,seconds:h*.7548776662%1*a}})}var Y=(r,{metadata:t})=>r.map(({x:e,y:s,z:o})=>t.up_axis==="z"?[e,-s]:[e,o]);function X(r,t,e,s){return Array.from({length:Math.min(12e3,Math.round(t*r.length))},(o,a)=>{let[i,n]=r[Math.floor(a/t)],h=Math.floor(a%t/3),c=20*s,l=2*Math.PI*m(Math.floor(a/t)*7+h,c),d=e*(.12+.88*m(Math.floor(a/t)*5+h,c+1)),f=.16*e*Math.sqrt(m(a,c+2)),u=2*Math.PI*m(a,c+3);return{x:i+d*Math.cos(l)+f*Math.cos(u),z:n+d*Math.sin(l)+f*Math.sin(u),size:.8+.8*m(a,c+4),angle:2*Math.PI*m(a,c+5),seconds:100*m(a,c+6)}})}function Z(r,{metadata:t,rest:e}){return t.up_axis==="z"?r.map(({x:s,z:o,size:a,...i})=>({...i,size:a,x:s,y:-o,z:e[2]*(1-a)})):r.map(({size:s,...o})=>({...o,size:s,y:e[1]*(1-s)}))}var Rt=4;function J(r){return(r.match(/\S+/g)??[]).map(t=>/^(.*?)(?:=([\d.]+))?$/.exec(t)).map(([,t,e])=>({source:t,each:Number(e)||Rt}))}import{BufferAttribute as S,BufferGeometry as bt,DoubleSide as Zt,Group as Jt,InstancedBufferAttribute as Qt,LineBasicMaterial as te,LineSegments as ee,Mesh as xt,MeshLambertMaterial as se}from"three";var x=[[33,53,121],[38,117,148],[57,169,128],[171,206,88],[252,231,98],[240,120,58],[180,26,50]],Q=[[86,65,48],[161,108,61],[88,129,66],[132,176,72],[70,158,158],[86,110,190],[150,92,180]],C=r=>((r/255+.055)/1.055)**2.4,M=([r,t,e])=>[C(r),C(t),C(e)],Nt=Array.from({length:256},(r,t)=>{let e=t/255*(x.length-1),s=Math.min(Math.floor(e),x.length-2);return M(x[s].map((o,a)=>o+(e-s)*(x[s+1][a]-o)))}),ms=`linear-gradient(to right, ${x.map(r=>`rgb(${r.join(" ")})`).join(", ")})`;function tt(r){return Nt[Math.max(0,Math.min(255,Math.round(r*255)))]}function et(r){return M(Q[r%Q.length])}function st(r){let t=r*.61803398875%1,e=150+60*(r*.381966%1),s=o=>e*(.62+.38*Math.cos(2*Math.PI*(t+o)));return M([s(0),s(1/3),s(2/3)])}function B(r){let t=(e,s)=>e+(s-e)*r;return M([t(92,132),t(72,140),t(54,84)])}import{BufferAttribute as jt,InstancedBufferAttribute as at,InstancedBufferGeometry as Gt,ShaderMaterial as it,Vector2 as nt}from"three";import{MeshDepthMaterial as vs,MeshDistanceMaterial as xs,RGBADepthPacking as ws,Vector2 as ys}from"three";var Ht=`
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
attribute vec4 athFading; // These two frames at the level before, and its share.
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
`;var ot=Ht;var ht=`
attribute vec3 rest, restOther, color, colorOther;
attribute float athPartOther, radius, radiusOther;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${ot}
void main() {
  bool far = position.x > 0.5;
  vec4 p = modelViewMatrix * vec4(athMoved(rest, athPart), 1.0);
  vec4 q = modelViewMatrix * vec4(athMoved(restOther, athPartOther), 1.0);
  vec2 along = isOrthographic ? p.xy - q.xy : p.xy / -p.z - q.xy / -q.z;
  vec2 across = length(along) > 1e-9 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  if (far) p = q;
  float pixel = (isOrthographic ? 1.0 : -p.z) * 2.0 / (projectionMatrix[1][1] * screen.y);
  float wide = max(far ? radiusOther : radius, 0.55 * pixel);
  p.xy += wide * (across * position.y + vec2(across.y, -across.x) * (far ? -0.6 : 0.6)); // Joints, where limbs bend, are covered.
  gl_Position = projectionMatrix * p;
  vColor = far ? colorOther : color;
  vSide = position.y;
  vAcross = vec3(across, 0.0);
}`,Ut=`
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
}`;function ct(r,t){let e=r.skeleton,s=e.length/2,o=new Uint32Array(s),a=new Uint32Array(s);for(let n=0;n<s;n++)o[n]=e[2*n],a[n]=e[2*n+1];let i=new Gt;return i.setAttribute("position",new jt(Float32Array.of(0,1,0,0,-1,0,1,1,0,1,-1,0),3)),i.setIndex([0,1,2,2,1,3]),i.setAttribute("rest",rt(r.rest,o)),i.setAttribute("restOther",rt(r.rest,a)),i.instanceCount=s,i.userData={source:o,other:a},L(i,t),i}function rt(r,t){let e=new Float32Array(3*t.length);for(let s=0,o=0;s<t.length;s++){let a=3*t[s];e[o++]=r[a],e[o++]=r[a+1],e[o++]=r[a+2]}return new at(e,3)}function L(r,t){for(let[e,s]of[["radius",r.userData.source],["radiusOther",r.userData.other]]){let o=new Float32Array(s.length);for(let a=0;a<s.length;a++)o[a]=t[s[a]];r.setAttribute(e,new at(o,1))}}function lt(r){let t=`#include <packing>
void main() { gl_FragColor = packDepthToRGBA(gl_FragCoord.z); }`;return new it({vertexShader:ht,fragmentShader:t,side:2,uniforms:{...r,screen:{value:new nt(2048,2048)}}})}function dt(r){return new it({vertexShader:ht,fragmentShader:Ut,side:2,uniforms:{...r,screen:{value:new nt(1,1)},shade:{value:1}}})}function _(r){let t=r.attributes.radius,e=r.rest.length/3;if(t?.array.length===e)return Float32Array.from(t.array,Number);let s=new Float32Array(e).fill(1),{first:o,count:a,attach:i}=r.branches,n=r.channel.vertexSource;for(let l=o.length-1;l>=0;l--){for(let d=o[l]+a[l]-2;d>=o[l];d--)s[n[d]]+=s[n[d+1]];i[l]>=0&&(s[n[i[l]]]+=s[n[o[l]]])}let h=s.reduce((l,d)=>Math.max(l,d),1),c=r.sphere.radius/50;return s.map(l=>c*Math.sqrt(l/h))}import{DoubleSide as F,MeshDepthMaterial as qt,MeshStandardMaterial as $t,RGBADepthPacking as Wt}from"three";var ft=["bark","stalks"],ut=["leaves","blades","pinnae"];function mt({surfaces:r}){let[t,e]=typeof r=="string"?r.split(", "):[];return ft.includes(t)&&ut.includes(e)?[t,e]:null}var I=`
varying vec2 athUv;
varying vec3 athGrown;
float athHalf(float v) { // half the width of a leaf, its teeth as long as they are wider than a pixel; below 0.1 its stalk
#if ATH_LEAF == 1 // a blade ends as its geometry does
  return 2.0;
#elif ATH_LEAF == 2 // lobes to a pinna, to near its rib
  float lobes = 1.0 - smoothstep(0.02, 0.06, fwidth(v));
  return 0.97 - 0.55 * lobes * pow(abs(cos(3.14159 * 13.0 * v)), 3.0) * (1.0 - 0.6 * v);
#endif
  float along = clamp((v - 0.1) / 0.9, 0.0, 1.0), teeth = 1.0 - smoothstep(0.02, 0.06, fwidth(v));
  float outline = pow(sin(3.14159 * pow(along, 0.8)), 0.8) * (0.95 - 0.06 * teeth * abs(sin(34.0 * along)));
  return max(outline, v < 0.2 ? 0.04 : 0.0);
}
float athInside() { // below 0 outside of a leaf's outline
  if (athUv.x < 1.0) return 1.0;
  float across = abs(4.0 * fract(0.5 * (athUv.x - 1.0)) - 1.0);
  return min(athHalf(athUv.y) - across, 0.995 - athUv.y);
}
`,Vt=`
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
#if ATH_LEAF == 1
  return (1.0 - smoothstep(0.1, 0.5, fwidth(leaf.x))) * max(0.8 * (1.0 - smoothstep(0.0, 0.14, abs(leaf.x))), 0.3 + 0.3 * sin(28.0 * leaf.x));
#endif
  float across = abs(leaf.x), rib = 1.0 - smoothstep(0.0, 0.05, across);
  float side = abs(fract(8.0 * (leaf.y - 0.42 * across)) - 0.5);
  float near = 1.0 - smoothstep(0.03, 0.12, fwidth(leaf.y));
  return near * max(rib, (1.0 - smoothstep(0.0, 0.12, side)) * 0.55 * (1.0 - across));
}
`,pt=`
float athIn = athInside();
diffuseColor.a = clamp(athIn / max(fwidth(athIn), 1e-4) + 0.5, 0.0, 1.0);
#ifdef ALPHA_TO_COVERAGE
if (diffuseColor.a < 0.02) discard;
#else
if (diffuseColor.a < 0.5) discard;
#endif
`,Kt=`
${pt}
bool athIsLeaf = athUv.x >= 1.0;
float athThin = 0.0, athBump = 0.0;
if (athIsLeaf) {
  float shade = floor(0.5 * (athUv.x - 1.0)) / 7.0;
  vec2 leaf = vec2(4.0 * fract(0.5 * (athUv.x - 1.0)) - 1.0, athUv.y);
  float veins = athVeins(leaf);
  vec3 green = mix(vec3(0.062, 0.155, 0.018), vec3(0.145, 0.255, 0.03), shade);
  green = mix(green, vec3(0.21, 0.22, 0.04), 0.3 * smoothstep(0.75, 1.0, shade));
#if ATH_LEAF == 1 // pale at the foot, where blades hide each other from the sky, and dry at some tips
  green = mix(vec3(0.16, 0.18, 0.05), green * 1.15, smoothstep(0.0, 0.45, leaf.y)) * (0.45 + 0.55 * smoothstep(0.0, 0.35, leaf.y));
  green = mix(green, vec3(0.36, 0.31, 0.13), 0.8 * step(0.6, shade) * smoothstep(0.72, 1.0, leaf.y));
#elif ATH_LEAF == 2
  green = mix(vec3(0.07, 0.17, 0.02), vec3(0.135, 0.26, 0.03), shade) * (0.8 + 0.35 * leaf.y);
#endif
  green *= 0.85 + 0.3 * athNoise(vec3(leaf * 5.0, 8.0 * shade));
  diffuseColor.rgb = mix(green, green * 1.5 + 0.015, veins * 0.6);
  athThin = 0.85 - 0.5 * veins;
  athBump = veins * 0.3;
} else {
#if ATH_STEM == 1
  diffuseColor.rgb = mix(vec3(0.1, 0.075, 0.03), vec3(0.12, 0.17, 0.04), clamp(0.02 * athUv.y, 0.0, 1.0));
#else
  athBump = athBark(athUv);
  float age = athNoise(athGrown * 3.0), lichen = smoothstep(0.62, 0.8, athNoise(athGrown * 7.0 + 3.0));
  vec3 bark = mix(vec3(0.05, 0.037, 0.027), vec3(0.27, 0.215, 0.165), athBump);
  bark = mix(bark, bark * vec3(0.85, 0.92, 0.8), age);
  diffuseColor.rgb = mix(bark, vec3(0.17, 0.19, 0.12), 0.35 * lichen * athBump);
#endif
}
`,Yt=`
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
`,Xt=`
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
`;function D(r,t,[e,s]){r.vertexShader=r.vertexShader.replace("#include <common>",`#include <common>
varying vec2 athUv;
varying vec3 athGrown;`).replace("#include <uv_vertex>",`#include <uv_vertex>
athUv = uv;
athGrown = position;`),r.fragmentShader=`#define ATH_STEM ${ft.indexOf(e)}
#define ATH_LEAF ${ut.indexOf(s)}
${t}`}function gt(r){return r.onBeforeRender=t=>{r.alphaToCoverage=!t.getContextAttributes().alpha,r.onBeforeRender=()=>{}},r}function A(r){let t=gt(new $t({side:F,shadowSide:F}));return t.onBeforeCompile=e=>D(e,e.fragmentShader.replace("#include <common>",`#include <common>
${I}${Vt}`).replace("#include <map_fragment>",Kt).replace("#include <roughnessmap_fragment>","float roughnessFactor = athIsLeaf ? 0.62 : 0.95;").replace("#include <normal_fragment_maps>",Yt).replace("#include <lights_fragment_end>",`#include <lights_fragment_end>
${Xt}`),r),t.customProgramCacheKey=()=>`ath surface ${r}`,t}function vt(r,t){return r.onBeforeCompile=e=>D(e,e.fragmentShader.replace("#include <common>",`#include <common>
${I}`).replace("#include <map_fragment>",pt),t),r.customProgramCacheKey=()=>`ath outlines ${t}`,gt(r)}function R(r){let t=new qt({depthPacking:Wt,side:F});return t.onBeforeCompile=e=>D(e,e.fragmentShader.replace("#include <common>",`#include <common>
${I}`).replace("#include <map_fragment>","if (athInside() < 0.0) discard;"),r),t.customProgramCacheKey=()=>`ath surface depth ${r}`,t}var oe=[.16,.29,.07],re=[.55,.2,.06],ae=4,wt=()=>new se({vertexColors:!0,side:Zt}),ie=()=>new te({vertexColors:!0});function ne(r){let t=new bt;t.setIndex(r.index);for(let[e,s]of Object.entries(r.attributes))!e.startsWith("athPart")&&e!=="color"&&t.setAttribute(e,s);return t.userData=r.userData,t}var yt=({userData:{source:r,other:t}})=>[["color",r],...t?[["colorOther",t]]:[]],p=class{root=new Jt;colour="plain";show="mesh";heatMost=0;beside=[this];#t;#e=null;#s;#o=[];#r=null;#u=!0;constructor(t,e=t.motion){this.ath=t,this.motion=e;let s=t.metadata.up_axis;this.root.rotation.order="YXZ",s==="z"&&(this.root.rotation.x=-Math.PI/2),s==="x"&&(this.root.rotation.z=Math.PI/2),this.root.updateMatrixWorld(!0);let{depth:o}=t.branches,a=t.vertexBranch;this.#t=a.map(i=>o[i]),this.onArrays=()=>this.#h(),t.addEventListener("arrays",this.onArrays),this.onLevel=()=>{this.colour==="node"&&this.#m()},this.onFrame=()=>{this.colour==="distance"&&this.paint()},e.addEventListener("level",this.onLevel),e.addEventListener("frame",this.onFrame),this.#i()}#i(){this.#n(),this.#s=_(this.ath),this.setShow(this.show),this.setColour(this.colour)}#n(){for(let{object:t,geometry:e,other:s}of this.#o)this.root.remove(t),this.motion.detach(e),e.dispose(),t.material.dispose(),s?.dispose();this.#r?.dispose(),this.#r=null,this.#o=[]}#h(){if(this.ath.hasFaces){this.#i();return}this.#s=_(this.ath);for(let{kind:t,geometry:e}of this.#o)t==="mesh"&&L(e,this.#s);this.paint()}turn(t){this.root.rotation.y=-t*Math.PI/180,this.root.updateMatrixWorld(!0)}get surfaces(){return this.ath.geometry?.hasAttribute("uv")?mt(this.ath.metadata):null}get depthMaterial(){let{surfaces:t}=this;return t&&(()=>R(t))}#l(){let t=this.#o.find(({kind:s})=>s==="mesh"),e=!!(this.colour==="plain"&&this.ath.hasFaces&&this.surfaces);!t||e===!!t.other||(e&&(this.#r??=this.motion.bind(A(this.surfaces))),[t.object.material,t.other]=e?[this.#r,t.object.material]:[t.other,null])}#a(t){if(this.#o.some(n=>n.kind===t))return;let{ath:e,motion:s}=this,o;if(t==="skeleton")o=new ee(s.attach(this.#d()),s.bind(ie())),o.renderOrder=1;else if(e.hasFaces){let n=this.surfaces?vt(wt(),this.surfaces):wt();o=s.bindShadows(new xt(s.attach(ne(e.geometry)),s.bind(n))),this.surfaces&&Object.assign(o,{customDepthMaterial:s.bind(R(this.surfaces))})}else{let n=ct(e,this.#s);o=new xt(s.attach(n),dt(s.uniforms)),o.customDepthMaterial=lt(s.uniforms)}o.castShadow=o.receiveShadow=t==="mesh";let{geometry:a}=o,i=a.isInstancedBufferGeometry?Qt:S;for(let[n,h]of yt(a))a.setAttribute(n,new i(new Float32Array(3*h.length),3));o.frustumCulled=!1,this.#o.push({kind:t,geometry:a,object:o}),this.root.add(o),this.#l()}forestGeometry(){if(this.ath.hasFaces)return this.ath.geometry;let t=this.#d(),e=new Float32Array(this.ath.rest.length),s=this.#c();for(let o=0;o<e.length/3;o++)e.set(s(o),3*o);return t.setAttribute("color",new S(e,3)),t}#c(){let t=this.#t.reduce((s,o)=>Math.max(s,o),1),e=Array.from({length:t+1},(s,o)=>B(o/t));return s=>e[this.#t[s]]}#d(){let{rest:t,skeleton:e}=this.ath,s=new bt;return s.setIndex(new S(e,1)),s.setAttribute("position",new S(t,3)),s.userData.source=Uint32Array.from({length:t.length/3},(o,a)=>a),s}get vertices(){return this.#o.reduce((t,{object:e,geometry:s})=>t+(e.visible?s.userData.source.length*(s.isInstancedBufferGeometry?4:1):0),0)}setShow(t){this.show=t;for(let e of["mesh","skeleton"])(t===e||t==="both")&&this.#a(e);for(let{kind:e,object:s}of this.#o)s.visible=t==="both"||t===e,e==="skeleton"&&(s.material.depthTest=t!=="both");this.paint()}setColour(t){this.colour=t,this.#l(),this.motion.heat=t==="distance",t==="node"&&this.#m(),this.motion.refresh(),this.paint()}async#m(){this.motion.level<0||(this.#e=await this.motion.nodeNumbers(),this.paint())}#p(){let{colour:t,motion:e}=this;if(t==="node"&&this.#e){let s=Array.from({length:1+this.#e.reduce((o,a)=>Math.max(o,a),0)},(o,a)=>st(a));return o=>s[this.#e[o]]}if(t==="order"){let s=Array.from({length:1+this.#t.reduce((o,a)=>Math.max(o,a),0)},(o,a)=>et(a));return o=>s[this.#t[o]]}if(t==="distance"){let{distances:s}=e;return this.heatMost=Math.max(...this.beside.map(o=>o.motion.level<0?0:o.motion.error(o.motion.level).max)),o=>tt(s&&this.heatMost?Math.sqrt(s[o]/this.heatMost):0)}return this.#c()}paint(){this.#u=!0,this.onPaint?.()}prepare(t,e){for(let{object:n}of this.#o)n.material.uniforms?.screen?.value.set(t,e);if(!this.#u)return;this.#u=!1;let s=this.#p(),o=this.colour==="plain"&&this.ath.hasFaces,a=o?this.ath.geometry.getAttribute("color"):null,i=this.show==="both"&&this.colour==="plain"?re:null;for(let{kind:n,geometry:h,object:c}of this.#o){if(!c.visible)continue;let l=n==="skeleton"?i:null,d=a&&n==="mesh",f=o&&n!=="skeleton"?this.#g():s;for(let[u,O]of yt(h)){let W=h.getAttribute(u),T=W.array;for(let y=0,b=0;y<O.length;y++,b+=3){let k=l??(d?a.array.subarray(y*a.itemSize):f(O[y]));T[b]=k[0],T[b+1]=k[1],T[b+2]=k[2]}W.needsUpdate=!0}}}#g(){let{ring:t,depth:e}=this.ath.branches,s=this.ath.vertexBranch;return o=>{let a=s[o],i=.75+.6*(a*.61803398875%1);return t[a]?B(Math.min(1,e[a]/ae)):oe.map(n=>n*i)}}dispose(){this.ath.removeEventListener("arrays",this.onArrays),this.motion.removeEventListener("level",this.onLevel),this.motion.removeEventListener("frame",this.onFrame),this.#n()}};var de=7311178,fe=r=>Object.assign(r,{castShadow:!0,receiveShadow:!0});function Mt(r,t){let{ath:e,root:s,surfaces:o}=r,a=o?()=>A(o):e.hasFaces?()=>new ce({color:de,side:he}):void 0,i=fe(new le(e,{geometry:r.forestGeometry(),material:a,depthMaterial:r.depthMaterial}));for(let n of s.children)n.visible=!1;return s.add(i),e.motion.wrap="loop",e.motion.setLevel(e.motion.levelCount-1),i.addEventListener("level",t),i}function At({ath:r,root:t},e){t.updateMatrixWorld(!0),t.position.y+=e-r.box.clone().applyMatrix4(t.matrixWorld).min.y,t.updateMatrixWorld(!0)}var z=class{#t;constructor(t,e,s){let{ath:o}=t,a=Mt(t,s);this.changed=s,this.reach=V(o,e),this.trees=K(o,e,this.reach),a.setInstances(this.trees),this.#t=[{plant:t,forest:a}]}get forests(){return this.#t.map(({forest:t})=>t)}async grow(t,e,s){let[{plant:{ath:o}}]=this.#t,a=this.reach/Math.sqrt(this.trees.length);for(let[i,{source:n,each:h}]of t.entries()){let c=await e.loadAsync(n);if(await c.arrays.catch(()=>{}),this.#t.length===0||!c.hasFaces){c.dispose();continue}let l=new p(c),d=Mt(l,this.changed),{name:f}=o.motion.clip;c.motion.clips.some(u=>u.name===f)&&c.motion.play(f),d.setInstances(Z(X(Y(this.trees,o),h,a,i),c)),this.#t.push({plant:l,forest:d}),s(l)}}update(t,e,s){for(let{plant:{ath:{motion:o}},forest:a}of this.#t)o.setTime(o.start),a.bakeReady(),a.update(t,e,s)}dispose(){this.#t.forEach(({plant:t,forest:e},s)=>{e.dispose(),s!==0&&(t.dispose(),t.root.removeFromParent(),t.ath.dispose())}),this.#t=[]}};import{ACESFilmicToneMapping as Ge,Box3 as Ue,Fog as Ft,PCFShadowMap as qe,PerspectiveCamera as $e,Scene as We,Vector3 as v,WebGLRenderer as Ve}from"three";import{OrbitControls as Ke}from"three/addons/controls/OrbitControls.js";import{BufferAttribute as N,BufferGeometry as ue,CircleGeometry as me,Color as H,Group as pe,InstancedMesh as ge,Matrix4 as ve,Mesh as xe,MeshLambertMaterial as Pt,Object3D as we,Vector3 as ye}from"three";var St=60,zt=26e3,w=.015,be=.0015,Et={day:[6847813,9478240],dusk:[4872760,6714442]},g=(r,t)=>{let e=Math.sin(12.9898*r+78.233*t)*43758.5453;return e-Math.floor(e)},Me=`
varying vec2 athMeadow;
uniform vec3 athOther;
float athHash2(vec2 p) { p = fract(p * vec2(123.34, 456.21)); p += dot(p, p + 45.32); return fract(p.x * p.y); }
float athNoise2(vec2 x) {
  vec2 i = floor(x), f = fract(x);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(athHash2(i), athHash2(i + vec2(1, 0)), f.x), mix(athHash2(i + vec2(0, 1)), athHash2(i + vec2(1, 1)), f.x), f.y);
}
`,Ae=`
{
  float shade = 0.0, wide = length(fwidth(athMeadow)), low = dot(normalize(vViewPosition), normalize(vNormal));
  for (int i = 0; i < 6; i++) {
    float often = exp2(1.4 * float(i)) * 1.3;
    shade += (athNoise2(athMeadow * often + 7.0 * float(i)) - 0.5) * 0.36 * (1.0 - smoothstep(0.05, 0.3, wide * often));
  }
  shade *= smoothstep(0.0, 0.3, low);
  diffuseColor.rgb = mix(diffuseColor.rgb, athOther, clamp(0.4 + shade, 0.0, 1.0)) * (0.92 + 0.3 * shade);
}
`;function Se(){let r=new Pt,t={value:new H};r.onBeforeCompile=s=>{s.uniforms.athOther=t,s.vertexShader=s.vertexShader.replace("#include <common>",`#include <common>
varying vec2 athMeadow;`).replace("#include <begin_vertex>",`#include <begin_vertex>
athMeadow = position.xy * ${St}.0;`),s.fragmentShader=s.fragmentShader.replace("#include <common>",`#include <common>
${Me}`).replace("#include <map_fragment>",Ae)},r.userData.other=t;let e=new xe(new me(1,96),r);return e.name="disc",e.scale.setScalar(St),e.receiveShadow=!0,e}function ze(){let r=new ue,t=[[1,0,0],[.75,.5,.1],[0,1,.42]],e=[],s=[];for(let[o,a,i]of t)for(let n of o>0?[-1,1]:[0]){e.push(n*o*be,i*w,a*w);let h=.8+.5*a;s.push(h,h,h*(1-.2*a))}return r.setAttribute("position",new N(Float32Array.from(e),3)),r.setAttribute("color",new N(Float32Array.from(s),3)),r.setAttribute("normal",new N(Float32Array.from(e,(o,a)=>a%3===2?1:0),3)),r.setIndex([0,1,2,2,1,3,2,3,4,2,1,0,3,1,2,4,3,2]),r}var Ee=`
vec4 mvPosition = instanceMatrix * vec4(transformed, 1.0);
{
  vec2 way = vec2(cos(athBreeze.z), sin(athBreeze.z)), at = instanceMatrix[3].xy;
  float own = fract(43.0 * at.x + 71.0 * at.y), up = mvPosition.z / ${w};
  float gust = sin(11.0 * dot(at, way) + 2.0 * sin(5.0 * dot(at, way.yx)) - 2.1 * athBreeze.x) * 0.5 + 0.5;
  float lean = athBreeze.y * (0.25 + 0.75 * gust + 0.2 * sin((5.0 + 3.0 * own) * athBreeze.x + 6.28 * own));
  mvPosition.xy += way * lean * up * up * ${w};
  mvPosition.z -= 0.3 * lean * lean * up * up * ${w};
}
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;
`;function Pe(){let r=new Pt({vertexColors:!0}),t={value:new ye};return r.userData.breeze=t.value,r.onBeforeCompile=e=>{e.uniforms.athBreeze=t,e.vertexShader=e.vertexShader.replace("#include <common>",`#include <common>
uniform vec3 athBreeze;`).replace("#include <project_vertex>",Ee)},r}function Ot(r,t,e,s){r.getObjectByName("grass").material.userData.breeze.set(t,e,(90-s)*Math.PI/180)}function Oe(){let r=new ge(ze(),Pe(),zt),t=new we,e=new ve;for(let s=0;s<zt;s++){let o=g(s,1)**.72*.98,a=2*Math.PI*g(s,2),i=o*Math.cos(a),n=o*Math.sin(a),h=.5+.5*Math.sin(9*i+3*Math.sin(7*n))*Math.sin(8*n),c=(.35+.65*g(s,3))*(.45+.75*h)*Math.min(1,3.2*(1-o));t.position.set(i,n,0),t.rotation.set(0,0,2*Math.PI*g(s,4)),t.scale.set(.7+.6*g(s,5),c,c),t.updateMatrix(),r.setMatrixAt(s,e.copy(t.matrix));let l=.85+.4*g(s,6);r.setColorAt(s,new H(l,l,.9*l))}return r.name="grass",r.receiveShadow=!0,r.frustumCulled=!1,r}function Tt(){let r=new pe().add(Se(),Oe());return r.name="ground",r.rotation.x=-Math.PI/2,r}function kt(r,t){let[e,s]=t?Et.dusk:Et.day,{material:o}=r.getObjectByName("disc");o.color.set(e),o.userData.other.value.set(s),r.getObjectByName("grass").material.color.set(e).lerp(new H(s),.45)}import{BackSide as Te,Color as Lt,DirectionalLight as ke,HemisphereLight as Ce,Mesh as Be,PMREMGenerator as Le,Scene as Ct,ShaderMaterial as _e,SphereGeometry as Fe,Vector3 as Ie}from"three";var _t=new Ie(-.62,.72,.32).normalize(),De=2048,Re={zenith:9419229,horizon:15331049,glow:16773334,grass:10135663,cloud:16777215,hills:8231564,sun:16773592,sunlight:3.4,above:14478328,below:9211746,fill:.55,around:.75},Ne={zenith:1581103,horizon:4870752,glow:9863276,grass:3818290,cloud:7301744,hills:2831940,sun:16767408,sunlight:4.2,above:11124704,below:5857356,fill:1.9,around:3.2},He="varying vec3 way; void main() { way = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",je=`
uniform vec3 zenith, horizon, glow, grass, sun, cloud, hills;
uniform float ground;
varying vec3 way;
float hash(vec2 p) { p = fract(p * vec2(123.34, 456.21)); p += dot(p, p + 45.32); return fract(p.x * p.y); }
float noise(vec2 x) {
  vec2 i = floor(x), f = fract(x);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(hash(i), hash(i + vec2(1, 0)), f.x), mix(hash(i + vec2(0, 1)), hash(i + vec2(1, 1)), f.x), f.y);
}
float ridge(vec2 way, vec2 k) { // height of hills all around, with woods on them
  return 0.05 * noise(2.3 * way + k) + 0.016 * noise(9.0 * way + k) + 0.005 * noise(31.0 * way) + 0.0035 * noise(110.0 * way) - 0.012;
}
void main() {
  vec3 w = normalize(way);
  vec3 c = mix(horizon, zenith, pow(clamp(w.y, 0.0, 1.0), 0.5));
  float toward = max(dot(w, sun), 0.0);
  c = mix(c, glow, 0.45 * pow(toward, 6.0) + 0.4 * pow(toward, 60.0));
  if (ground > 0.5) c = mix(c, grass, smoothstep(0.02, -0.06, w.y));
  else if (w.y > 0.0) {
    vec2 at = w.xz / (w.y + 0.12);
    float thick = 0.55 * noise(at * 1.1 + 3.0) + 0.27 * noise(at * 2.7) + 0.13 * noise(at * 6.1) + 0.05 * noise(at * 13.0);
    c = mix(c, cloud, 0.75 * smoothstep(0.44, 0.76, thick) * smoothstep(0.015, 0.2, w.y));
    vec2 around = normalize(w.xz);
    float soft = max(fwidth(w.y), 1e-4), far = ridge(around, vec2(7.3, 2.1)) + 0.012, near = ridge(around, vec2(1.7, 8.4));
    float mist = smoothstep(0.0, 0.022, w.y); // in the valleys
    c = mix(c, mix(horizon, hills, 0.2 + 0.2 * mist), smoothstep(soft, -soft, w.y - far));
    c = mix(c, mix(horizon, hills, 0.3 + 0.4 * mist), smoothstep(soft, -soft, w.y - near));
  }
  gl_FragColor = vec4(c, 1.0);
  #include <colorspace_fragment>
}`;function Bt(r,t){let e=Object.fromEntries(["zenith","horizon","glow","grass","cloud","hills"].map(o=>[o,{value:new Lt(r[o])}])),s=new _e({vertexShader:He,fragmentShader:je,side:Te,depthWrite:!1,depthTest:!1,uniforms:{...e,sun:{value:_t},ground:{value:t?1:0}}});return new Be(new Fe(1,48,24),s)}var E=class{dark=!1;#t=new Map;constructor(t){this.renderer=t}get colours(){return this.dark?Ne:Re}get horizon(){return new Lt(this.colours.horizon)}get#e(){if(!this.#t.has(this.dark)){let t=new Le(this.renderer),e=new Ct().add(Bt(this.colours,!0));this.#t.set(this.dark,t.fromScene(e,0,.1,10).texture),t.dispose()}return this.#t.get(this.dark)}light(t){let{sun:e,sunlight:s,above:o,below:a,fill:i}=this.colours,n=t.getObjectByName("sky");n?.removeFromParent();let h=new ke(e,s),c=Bt(this.colours,!1);h.name="sun",h.shadow.mapSize.setScalar(De),h.shadow.radius=2.5,c.name="dome",c.renderOrder=-2,c.frustumCulled=!1;let l=new Ct().add(c,h,h.target,new Ce(o,a,i));l.name="sky",l.children.at(-1).name="fill",n&&this.#s(h,n.getObjectByName("sun")),t.add(l)}surround(t,e){let{fill:s,around:o}=this.colours;t.environment=e?this.#e:null,t.environmentIntensity=o,t.getObjectByName("fill").intensity=e?s:s+.8*o}#s(t,e){t.position.copy(e.position),t.target.position.copy(e.target.position),t.shadow.camera.copy(e.shadow.camera),t.shadow.normalBias=e.shadow.normalBias,t.castShadow=e.castShadow}shade(t,e,s){let o=t.getObjectByName("sun"),{camera:a}=o.shadow;o.target.position.copy(e),o.position.copy(_t).multiplyScalar(3*s).add(e),Object.assign(a,{left:-s,right:s,top:s,bottom:-s,near:.5*s,far:5.5*s}),a.updateProjectionMatrix(),o.shadow.normalBias=.0015*s}};var Ye=20,Xe=24,Ze=12,Je=/swiftshader|llvmpipe|software|basic render/i,j=[{ratio:2,shadows:!0,grass:!0,around:!0},{ratio:1.25,shadows:!0,grass:!0,around:!0},{ratio:1,shadows:!1,grass:!1,around:!1}];function Qe(r){let t=r.getExtension("WEBGL_debug_renderer_info");return Je.test(r.getParameter(t?t.UNMASKED_RENDERER_WEBGL:r.RENDERER))}var P=class{panes=[];split=.5;less=0;steady=new URLSearchParams(location.search).get("quality")==="full";slow=0;moved=!1;#t=null;#e=new ResizeObserver(()=>this.fit());constructor(t,e,s){this.canvas=t;let o=t.getContext("webgl2",{alpha:!1,antialias:!0,powerPreference:"high-performance"})??void 0;this.renderer=new Ve({canvas:t,context:o}),Object.assign(this.renderer,{toneMapping:Ge,toneMappingExposure:.82}),this.renderer.shadowMap.enabled=!0,this.renderer.shadowMap.type=qe,this.sky=new E(this.renderer),!this.steady&&Qe(this.renderer.getContext())&&(this.less=j.length-1),this.camera=new $e(38,1,.01,1e3),this.controls=new Ke(this.camera,t),this.controls.enableDamping=!0,this.controls.dampingFactor=.12,this.controls.addEventListener("change",e),this.controls.addEventListener("start",()=>{this.moved=!0}),this.dark=matchMedia("(prefers-color-scheme: dark)"),this.#t=()=>{this.#o(),e()},this.dark.addEventListener("change",this.#t),this.changed=e,this.resized=s,this.#e.observe(t.parentElement),this.#s()}dispose(){this.#e.disconnect(),this.dark.removeEventListener("change",this.#t),this.controls.dispose(),this.renderer.dispose()}fit(){this.#s()&&(this.resized(),this.changed())}#s(){let{clientWidth:t,clientHeight:e}=this.canvas.parentElement,s=Math.min(devicePixelRatio,this.quality.ratio),o=parseInt(getComputedStyle(this.canvas.parentElement).getPropertyValue("--inset"),10)||0,a=t!==this.width||e!==this.height||s!==this.renderer.getPixelRatio();return!a&&o===this.inset?!1:(a&&(this.renderer.setPixelRatio(s),this.renderer.setSize(t,e,!1)),Object.assign(this,{width:t,height:e,inset:o}),!0)}warm(t){this.kept=this.scene(t),this.renderer.compile(this.kept,this.camera)}async compile(t){let e=this.scene(t);this.renderer.extensions.has("KHR_parallel_shader_compile")?await this.renderer.compileAsync(e,this.camera):this.renderer.compile(e,this.camera),e.remove(...t)}scene(t){let e=new We;return e.add(Tt(),...t),e.fog=new Ft(this.sky.horizon,1,2),this.#o([e]),e}#o(t=this.panes.map(({scene:e})=>e)){this.sky.dark=this.dark.matches;for(let e of t)this.sky.light(e),kt(e.getObjectByName("ground"),this.sky.dark),e.fog.color.copy(this.sky.horizon);this.#r(t)}get quality(){return j[this.less]}#r(t=this.panes.map(({scene:e})=>e)){for(let e of t)e.getObjectByName("sun").castShadow=this.quality.shadows,e.getObjectByName("grass").visible=this.quality.grass,this.sky.surround(e,this.quality.around)}took(t){this.slow=t>Ye?this.slow+1:0,!(this.steady||this.slow<Xe||this.less>=j.length-1)&&(this.slow=0,this.less++,this.#r(),this.#s(),this.changed())}setPanes(t){this.panes=t,this.#o(),this.changed()}look(t,e){let s=t.getSize(new v),o=Math.hypot(s.x,s.z),a=Math.tan(this.camera.fov*Math.PI/360),i=(this.width-this.inset)/this.height,n=.35*o+.62*Math.max(s.y,.84*o/i,1e-6)/a;t.getCenter(this.controls.target),this.camera.position.copy(this.controls.target).add(new v(.35,.16,.92).normalize().multiplyScalar(n)),this.camera.near=n/500,this.camera.far=n*60,this.controls.maxDistance=n*20,this.placeGround(e.height,e.size,e.plant),this.controls.update(),this.changed()}lookOver(t,e){let s=t.getSize(new v),o=Math.max(s.x,s.y,s.z),a=Math.max(e,o),i=Math.min(a,1.7*o),n=new Ue(new v(-i,t.min.y,-i),new v(i,t.max.y,i));this.look(n,{height:t.min.y,size:2.6*a,plant:1.9*o}),this.controls.maxDistance=6*a,this.camera.far=12*a+20*o,this.fog(this.camera.position.distanceTo(this.controls.target)*.7,7*a+12*o)}placeGround(t,e,s=e){for(let{scene:o}of this.panes){let a=o.getObjectByName("ground");a.position.y=t,a.scale.setScalar(e),a.getObjectByName("grass").scale.setScalar(Math.sqrt(s/e));let i=Math.min(e,Ze*s);this.sky.shade(o,new v(0,t+.25*i,0),.75*i)}this.fog(0,0)}fog(t,e){for(let{scene:s}of this.panes){let o=s.getObjectByName("ground").scale.x,[a,i]=e>0?[t,e]:[2*o,56*o];s.fog=new Ft(this.sky.horizon,a,i)}}breeze(t,e,s){for(let{scene:o}of this.panes)Ot(o.getObjectByName("ground"),t,e,s)}get pixels(){return this.height*this.renderer.getPixelRatio()}render(){let{renderer:t,camera:e,panes:s,width:o,height:a}=this,i=o-this.inset,n=this.split*i;e.aspect=i/a,e.setViewOffset(i,a,0,0,o,a),e.updateMatrixWorld(),t.setScissorTest(s.length>1);for(let{scene:h}of s){let c=h.getObjectByName("dome");c.position.copy(e.position),c.scale.setScalar(e.far*.5)}s.forEach(({scene:h,before:c},l)=>{c?.(o*t.getPixelRatio(),this.pixels),s.length>1&&t.setScissor(l*n,0,l===0?n:o-n,a),t.render(h,e)})}};var is=`:host { display: block; position: relative; min-height: 150px; overflow: hidden; }
div, canvas, ::slotted(*) { position: absolute; inset: 0; width: 100%; height: 100%; }
::slotted(*) { object-fit: cover; }
canvas { display: block; outline-offset: -2px; opacity: 0; transition: opacity .5s; }
canvas.drawn { opacity: 1; }
@media (prefers-reduced-motion: reduce) { canvas { transition: none; } }`,ns=.5,hs="120px",cs=.5,ls=1e4,ds=4e3,fs=null,U=class{camera=new It(38,1,.01,1e3);#t=new ss;constructor(t,e){this.canvas=t,this.changed=e,this.renderer=new os({canvas:t,antialias:!0,alpha:!0}),this.controls=new rs(this.camera,t),this.controls.enableDamping=!0,this.controls.addEventListener("change",e);let s=new ts(16773853,2.4);s.position.set(.6,1,.7),this.#t.add(new es(15397631,9077617,1.9),s),this.sized=new ResizeObserver(()=>this.#e()),this.sized.observe(t.parentElement),this.#e()}get pixels(){return this.canvas.height}#e(){let{clientWidth:t,clientHeight:e}=this.canvas.parentElement;t===0||e===0||(this.renderer.setPixelRatio(Math.min(devicePixelRatio,2)),this.renderer.setSize(t,e,!1),this.camera.aspect=t/e,this.camera.updateProjectionMatrix(),this.changed())}show(t){let e=t.ath.box.clone().applyMatrix4(t.root.matrixWorld),s=e.getSize(new G),{camera:o}=this,a=Math.tan(o.fov*Math.PI/360),i=Math.hypot(s.x,s.z),n=.35*i+.6*Math.max(s.y,i/o.aspect,1e-6)/a;this.plant=t,this.#t.add(t.root),e.getCenter(this.controls.target),o.position.copy(this.controls.target).add(new G(.35,.16,.92).normalize().multiplyScalar(n)),Object.assign(o,{near:n/500,far:n*60}).updateProjectionMatrix(),this.controls.update()}took(){}breeze(){}render(){this.plant.prepare(this.canvas.width,this.canvas.height),this.renderer.render(this.#t,this.camera)}dispose(){this.sized.disconnect(),this.controls.dispose(),this.renderer.dispose()}},q=class extends P{constructor(t,e){super(t,e,()=>this.#s())}#t=null;#e=0;#s(){if(!this.#t||this.moved)return;if(this.#e>0){this.lookOver(this.#t,this.#e);return}let t=this.#t.getSize(new G);this.look(this.#t,{height:this.#t.min.y,size:1.9*Math.max(t.x,t.y,t.z)})}show(t,e){this.#e=e,this.setPanes([{scene:this.scene([t.root]),before:(s,o)=>t.prepare(s,o)}]),this.#t=t.ath.box.clone().applyMatrix4(t.root.matrixWorld),this.#s()}add(t){At(t,this.#t.min.y),this.panes[0].scene.add(t.root)}},$=class r extends HTMLElement{static observedAttributes=["src","clip","level","wind","paused","alt","camera-controls"];static get loader(){return fs??=new as}#t=document.createElement("div");#e=null;#s=null;#o=null;#r=null;#u=new It;#i=0;#n=0;#h=0;#l=!1;#a=!1;#c=0;#d=0;#m=new IntersectionObserver(t=>this.#g(t.at(-1).isIntersecting),{rootMargin:hs});constructor(){super();let t=new CSSStyleSheet,e=this.attachShadow({mode:"open"});t.replaceSync(is),e.adoptedStyleSheets=[t],e.append(document.createElement("slot"),this.#t)}connectedCallback(){this.#m.observe(this),this.#p||this.#y()}disconnectedCallback(){this.#m.disconnect(),this.#g(!1),this.#b()}get#p(){return this.getAttribute("loading")==="lazy"}#g(t){this.#l=t,clearTimeout(this.#d),t?this.#y():this.#p&&(this.#d=setTimeout(()=>this.#b(),ds)),this.#w()}#y(){if(!(this.#s||!this.isConnected)){this.#e=document.createElement("canvas"),this.#e.setAttribute("role","img"),this.#e.setAttribute("aria-label",this.getAttribute("alt")??"Moving plant"),this.#t.replaceChildren(this.#e);try{this.#s=new(this.hasAttribute("scenery")?q:U)(this.#e,()=>{this.#a=!0})}catch(t){this.#e.remove(),this.#f("error",Object.assign(t,{codeName:"GRAPHICS"}));return}this.#M(),this.src&&this.#A()}}#b(){clearTimeout(this.#d),cancelAnimationFrame(this.#h),this.#h=0,this.#s&&(this.#v(),this.#s.dispose(),this.#s.renderer.forceContextLoss(),this.#s=null,this.#e.remove())}attributeChangedCallback(t,e,s){!this.#s||e===s||(t==="src"&&this.#A(),(t==="clip"||t==="wind")&&this.#S(),t==="level"&&this.#z(),t==="alt"&&this.#e.setAttribute("aria-label",s??"Moving plant"),t==="camera-controls"&&this.#M(),this.#n=0,this.#w())}get src(){return this.getAttribute("src")}set src(t){this.setAttribute("src",t)}get paused(){return this.hasAttribute("paused")}set paused(t){this.toggleAttribute("paused",t)}play(){this.paused=!1}pause(){this.paused=!0}get currentTime(){return this.#i}set currentTime(t){this.#i=t,this.#a=!0}get ath(){return this.#o?.ath??null}get forests(){return this.#r?.forests??[]}get camera(){return this.#s?.camera??this.#u}#M(){let{controls:t}=this.#s,e=this.getAttribute("camera-controls");t.enabled=e!==null,t.enableZoom=t.enablePan=e!=="turn",this.#e.style.touchAction=e===null?"auto":e==="turn"?"pan-y":"none",t.enabled?this.#e.tabIndex=0:this.#e.removeAttribute("tabindex")}#f(t,e){this.dispatchEvent(new CustomEvent(t,{detail:e}))}async#A(){let t=++this.#c,{src:e}=this;if(!e){this.#v();return}try{r.loader.setClip(this.getAttribute("clip"));let s=r.loader.loadAsync(new URL(e,document.baseURI).href);r.loader.setClip(null);let o=await s;this.#x>0&&await o.arrays.catch(()=>{}),t===this.#c?this.#P(o):o.dispose()}catch(s){t===this.#c&&this.#f("error",s)}}#v(){this.#c++,this.#r?.dispose(),this.#r=null,this.#o?.dispose(),this.#o?.root.removeFromParent(),this.#o?.ath.dispose(),this.#o=null}#P(t){this.#v();let e=this.#o=new p(t),{motion:s}=t,o=()=>{this.#a=!0};e.onPaint=o;for(let a of["frame","ready"])s.addEventListener(a,o);s.addEventListener("progress",({loaded:a,total:i})=>this.#f("progress",{loaded:a,total:i}));for(let a of["stopped","damaged"])s.addEventListener(a,i=>this.#f("error",i));this.#i=0,this.#x>0&&(this.#r=new z(e,this.#x,o)),this.#s.show(e,this.#r?.reach??0),this.#r?this.#O():this.#z(),this.hasAttribute("wind")&&!this.#r&&this.#S(),this.#a=!0,this.#w(),this.#f("load",{ath:t})}get#x(){return this.hasAttribute("scenery")?Math.round(Math.min(ls,Number(this.getAttribute("forest"))||0)):0}#O(){let t=this.#s,e=o=>this.#f("error",o),s=J(this.getAttribute("floor")??"").map(({source:o,each:a})=>({source:new URL(o,document.baseURI).href,each:a}));this.#r.grow(s,r.loader,o=>{t.add(o),this.#a=!0}).catch(e)}#S(){let t=this.#o?.ath.motion,e=this.getAttribute("wind"),s=this.getAttribute("clip");t&&(e!==null?t.wind(...e.split(/[\s,]+/).map(Number)):t.play(s??0,{fade:.4}),this.#a=!0)}#z(){let t=this.getAttribute("level")??"auto";this.#o?.ath.motion.setLevel(t==="auto"?t:Number(t)),this.#a=!0}#w(){this.#h===0&&this.#l&&this.#o&&(this.#n=0,this.#h=requestAnimationFrame(t=>this.#E(t)))}#E(t){if(this.#h=0,!this.#l||!this.#o)return;this.#h=requestAnimationFrame(h=>this.#E(h));let e=this.#n?Math.min(ns,(t-this.#n)/1e3):0,{ath:{motion:s},root:o}=this.#o;this.#n=t,this.paused||(this.#i+=e*(Number(this.getAttribute("speed"))||1));let{controls:a,camera:i,pixels:n}=this.#s;a.update(),this.#r?(this.#a||=!this.paused||this.#r.forests.some(({fading:h})=>h),this.#r.update(i,n,this.#i)):s.update(i,n,o).setTime(this.#i),this.#a&&(this.#a=!1,this.paused||this.#s.took(1e3*e),this.#s.breeze(this.#i,cs,0),this.#s.render(),this.#e.classList.add("drawn"))}};customElements.get("ath-viewer")||customElements.define("ath-viewer",$);export{$ as ATHViewerElement};
