// Puts the motion into the vertex shaders of three.js' materials: a vertex finds, by its attribute `athPart`, the
// matrix of its node in a data texture, or its own position where it has one. In a forest every instance has a
// place, a size, a turn about the up axis and a frame of its own, and the texture holds all frames of a clip; where its
// level changes it fades, and there are texture, athPart and frame of the level before, too.

import { MeshDepthMaterial, MeshDistanceMaterial, RGBADepthPacking, Vector2 } from "three";

const PARS = /* glsl */`
attribute float athPart;
uniform highp sampler2D athData;
uniform float athStride; // texels per exact vertex
#ifdef ATH_FOREST
uniform vec2 athForest; // texels per frame, 1: the up axis is z
attribute vec4 athPlace; // x, y, z, size
attribute vec4 athTurn; // cosine, sine, frame, the frame that its fraction leads to
attribute vec4 athLook; // amplitude of the motion, tint
varying vec3 athTint;
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
  p = athSpin(rest + athLook.x * (p - rest)) * athPlace.w + athPlace.xyz;
  athTint = athLook.yzw;
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
  n = athSpin(normal + athLook.x * (n - normal));
#endif
  return n;
}
`;

const POSITION = /* glsl */`
vec3 transformed = athMoved(position, athPart);
#ifdef USE_ALPHAHASH
vPosition = vec3(position);
#endif
`;

const NORMAL = /* glsl */`
vec3 objectNormal = athTurned(normal, athPart);
#ifdef USE_TANGENT
vec3 objectTangent = vec3(tangent.xyz);
#endif
`;

const TINT = /* glsl */`
#include <color_fragment>
diffuseColor.rgb *= athTint;
`;

const bound = new WeakMap(); // material: the uniforms that it reads

/** Lets `material` draw geometries of a motion. `uniforms`: athData, athStride, athForest, shared by all materials
 * of one motion; where a forest fades athDataBefore and athBefore. Other changes in onBeforeCompile have to come before. A
 * material that is bound already draws the motion that it was bound to last; its clones are bound as it is. */
export function injectMotion(material, uniforms, forest = false) {
  const known = bound.get(material);
  if (known === uniforms) return material;
  bound.set(material, uniforms);
  if (known) {
    material.dispose(); // its programs have the uniforms of the motion before
    return material;
  }
  const defines = [...(forest ? ["ATH_FOREST"] : []), ...(uniforms.athBefore ? ["ATH_FADING"] : [])];
  const { onBeforeCompile: before, customProgramCacheKey: keyBefore } = material, key = `ath ${defines} ${material.customProgramCacheKey()}`;
  material.onBeforeCompile = (shader, renderer) => {
    before.call(material, shader, renderer);
    Object.assign(shader.uniforms, bound.get(material));
    shader.vertexShader = `${defines.map((name) => `#define ${name}\n`).join("")}${shader.vertexShader}`
      .replace("#include <common>", `#include <common>\n${PARS}`)
      .replace("#include <begin_vertex>", POSITION)
      .replace("#include <beginnormal_vertex>", NORMAL);
    if (forest && shader.fragmentShader?.includes("#include <color_fragment>")) // Depths have no colour.
      shader.fragmentShader = `varying vec3 athTint;\n${shader.fragmentShader.replace("#include <color_fragment>", TINT)}`;
  };
  material.customProgramCacheKey = () => key;
  material.clone = () => {
    const clone = Object.getPrototypeOf(material).clone.call(material);
    return injectMotion(Object.assign(clone, { onBeforeCompile: before, customProgramCacheKey: keyBefore }), bound.get(material), forest);
  };
  material.needsUpdate = true;
  return material;
}

/** Materials with which an object's shadows move as it does: {customDepthMaterial, customDistanceMaterial}. */
export function shadowMaterials(uniforms, forest = false) {
  return {
    customDepthMaterial: injectMotion(new MeshDepthMaterial({ depthPacking: RGBADepthPacking }), uniforms, forest),
    customDistanceMaterial: injectMotion(new MeshDistanceMaterial(), uniforms, forest),
  };
}

export const MOTION_PARS = PARS;

export function motionUniforms() {
  return { athData: { value: null }, athStride: { value: 1 }, athForest: { value: new Vector2() } };
}
