// Puts the motion into the vertex shaders of three.js' materials: a vertex finds, by its attribute `athPart`, the
// matrix of its node in a data texture, or its own position where it has one. In a forest every instance has a
// place, a size, a turn about the up axis and a frame of its own, and the texture holds all frames of a clip.

import { Vector2 } from "three";

const PARS = /* glsl */`
attribute float athPart;
uniform highp sampler2D athData;
uniform float athStride; // texels per exact vertex
#ifdef ATH_FOREST
uniform vec2 athForest; // texels per frame, 1: the up axis is z
attribute vec4 athPlace; // x, y, z, size
attribute vec4 athTurn; // cosine, sine, frame, the frame that its fraction leads to
#endif

vec4 athTexel(int at) {
  return texelFetch(athData, ivec2(at & 1023, at >> 10), 0);
}

#ifdef ATH_FOREST
vec4 athAt(int at) {
  int size = int(athForest.x);
  return mix(athTexel(int(athTurn.z) * size + at), athTexel(int(athTurn.w) * size + at), fract(athTurn.z));
}
vec3 athSpin(vec3 p) {
  return athForest.y > 0.5 ? vec3(athTurn.x * p.x - athTurn.y * p.y, athTurn.y * p.x + athTurn.x * p.y, p.z)
    : vec3(athTurn.x * p.x + athTurn.y * p.z, p.y, athTurn.x * p.z - athTurn.y * p.x);
}
#else
vec4 athAt(int at) { return athTexel(at); }
#endif

vec3 athMoved(vec3 p, float part) {
  int at = int(abs(part)) - 1;
  if (part < 0.0) {
    p = athAt(at).xyz;
  } else {
    vec4 q = vec4(p, 1.0);
    p = vec3(dot(athAt(at), q), dot(athAt(at + 1), q), dot(athAt(at + 2), q));
  }
#ifdef ATH_FOREST
  p = athSpin(p) * athPlace.w + athPlace.xyz;
#endif
  return p;
}

vec3 athTurned(vec3 n, float part) {
  int at = int(abs(part)) - 1;
  if (part > 0.0) {
    vec3 a = athAt(at).xyz, b = athAt(at + 1).xyz, c = athAt(at + 2).xyz;
    n = vec3(dot(cross(b, c), n), dot(cross(c, a), n), dot(cross(a, b), n)); // by the cofactors
  } else if (athStride > 1.5) {
    vec4 q = normalize(athAt(at + 1));
    n = n + 2.0 * cross(q.xyz, cross(q.xyz, n) + q.w * n);
  }
#ifdef ATH_FOREST
  n = athSpin(n);
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

/** Lets `material` draw geometries of a motion. `uniforms`: athData, athStride, athForest, shared by all materials
 * of one motion. Other changes in onBeforeCompile have to come before. */
export function injectMotion(material, uniforms, forest = false) {
  const before = material.onBeforeCompile, key = `ath${forest ? "-forest" : ""} ${material.customProgramCacheKey()}`;
  material.onBeforeCompile = (shader, renderer) => {
    before.call(material, shader, renderer);
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = `${forest ? "#define ATH_FOREST\n" : ""}${shader.vertexShader}`
      .replace("#include <common>", `#include <common>\n${PARS}`)
      .replace("#include <begin_vertex>", POSITION)
      .replace("#include <beginnormal_vertex>", NORMAL);
  };
  material.customProgramCacheKey = () => key;
  material.needsUpdate = true;
  return material;
}

export const MOTION_PARS = PARS;

export function motionUniforms() {
  return { athData: { value: null }, athStride: { value: 1 }, athForest: { value: new Vector2() } };
}
