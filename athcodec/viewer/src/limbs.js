// A plant that is lines, drawn as wood: each edge is a strip that faces the camera, as wide as the branch, lit as a
// cylinder. Widths are the attribute "radius" or, without one, follow from how much grows beyond an edge.

import { BufferAttribute, InstancedBufferAttribute, InstancedBufferGeometry, ShaderMaterial, Vector2 } from "three";

import { setValues } from "./geometry.js";
import { MOTION_PARS } from "./shader.js";

// One instance per edge, of four corners: `position` says which end, and which side. Attributes of the far end have
// "Other" in their names.
const VERTEX = /* glsl */`
attribute vec3 rest, restOther, color, colorOther;
attribute float athPartOther, radius, radiusOther;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${MOTION_PARS}
void main() {
  bool far = position.x > 0.5;
  vec4 p = modelViewMatrix * vec4(athMoved(rest, athPart), 1.0);
  vec4 q = modelViewMatrix * vec4(athMoved(restOther, athPartOther), 1.0);
  float age = distance(p.xyz, q.xyz) / max(distance((modelViewMatrix * vec4(rest, 1.0)).xyz, (modelViewMatrix * vec4(restOther, 1.0)).xyz), 1e-9);
  vec2 along = isOrthographic ? p.xy - q.xy : p.xy / -p.z - q.xy / -q.z;
  vec2 across = length(along) > 1e-9 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  if (far) p = q;
  float pixel = (isOrthographic ? 1.0 : -p.z) * 2.0 / (projectionMatrix[1][1] * screen.y);
  float grown = min(age, 1.0); // An edge that is shorter than in the rest pose is young, and as thin as it is short.
  float wide = max((far ? radiusOther : radius) * grown, 0.55 * pixel);
  p.xy += wide * (across * position.y + vec2(across.y, -across.x) * (far ? -0.6 : 0.6)); // Joints, where limbs bend, are covered.
  gl_Position = projectionMatrix * p;
  vColor = far ? colorOther : color;
  vSide = position.y;
  vAcross = vec3(across, 0.0);
}`;

const FRAGMENT = /* glsl */`
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
}`;

/** The edges as limbs. */
export function limbGeometry(ath, radius) {
  const edges = ath.skeleton, count = edges.length / 2, source = new Uint32Array(count), other = new Uint32Array(count);
  for (let e = 0; e < count; e++) {
    source[e] = edges[2 * e];
    other[e] = edges[2 * e + 1];
  }
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(Float32Array.of(0, 1, 0, 0, -1, 0, 1, 1, 0, 1, -1, 0), 3));
  geometry.setIndex([0, 1, 2, 2, 1, 3]);
  geometry.setAttribute("rest", pointsOf(ath.rest, source));
  geometry.setAttribute("restOther", pointsOf(ath.rest, other));
  geometry.instanceCount = count;
  geometry.userData = { source, other };
  setRadii(geometry, radius);
  return geometry;
}

function pointsOf(rest, vertices) {
  const out = new Float32Array(3 * vertices.length);
  for (let i = 0, to = 0; i < vertices.length; i++) {
    const from = 3 * vertices[i];
    out[to++] = rest[from];
    out[to++] = rest[from + 1];
    out[to++] = rest[from + 2];
  }
  return new InstancedBufferAttribute(out, 3);
}

export function setRadii(geometry, perVertex) {
  for (const [name, vertices] of [["radius", geometry.userData.source], ["radiusOther", geometry.userData.other]]) {
    const out = new Float32Array(vertices.length);
    for (let i = 0; i < vertices.length; i++) out[i] = perVertex[vertices[i]];
    setValues(geometry, name, out, 1);
  }
}

/** Returns the material of their shadows. */
export function limbDepth(uniforms) {
  const fragmentShader = "#include <packing>\nvoid main() { gl_FragColor = packDepthToRGBA(gl_FragCoord.z); }";
  return new ShaderMaterial({ vertexShader: VERTEX, fragmentShader, side: 2, uniforms: { ...uniforms, screen: { value: new Vector2(2048, 2048) } } });
}

export function limbMaterial(uniforms) {
  return new ShaderMaterial({
    vertexShader: VERTEX, fragmentShader: FRAGMENT, side: 2,
    uniforms: { ...uniforms, screen: { value: new Vector2(1, 1) }, shade: { value: 1 } },
  });
}
