// A plant that is lines, drawn as wood: each edge is a strip that faces the camera, as wide as the branch, lit as a
// cylinder. Widths are the attribute "radius" or, without one, follow from how much grows beyond an edge.

import { BufferAttribute, BufferGeometry, ShaderMaterial, Vector2 } from "three";
import { MOTION_PARS } from "athcodec-three";

const VERTEX = /* glsl */`
attribute vec3 other;
attribute float athPartOther, radius, side;
attribute vec3 color;
uniform vec2 screen;
varying vec3 vColor;
varying float vSide;
varying vec3 vAcross;
${MOTION_PARS}
void main() {
  vec4 p = modelViewMatrix * vec4(athMoved(position, athPart), 1.0);
  vec4 q = modelViewMatrix * vec4(athMoved(other, athPartOther), 1.0);
  vec2 along = (p.xy / -p.z - q.xy / -q.z) * sign(side);
  vec2 across = length(along) > 1e-9 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  float pixel = -p.z * 2.0 / (projectionMatrix[1][1] * screen.y);
  p.xy += across * sign(side) * (abs(side) > 1.5 ? -1.0 : 1.0) * max(radius, 0.55 * pixel);
  gl_Position = projectionMatrix * p;
  vColor = color;
  vSide = sign(side) * (abs(side) > 1.5 ? -1.0 : 1.0);
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

/** Radius of every vertex: the file's, or by the pipe model, so that the trunk is a fiftieth of the plant's size. */
export function radii(ath) {
  const stored = ath.attributes.radius, count = ath.rest.length / 3;
  if (stored?.array.length === count) return Float32Array.from(stored.array, Number);
  const beyond = new Float32Array(count).fill(1), { first, count: stem, attach } = ath.branches, source = ath.channel.vertexSource;
  for (let b = first.length - 1; b >= 0; b--) {
    for (let i = first[b] + stem[b] - 2; i >= first[b]; i--) beyond[source[i]] += beyond[source[i + 1]];
    if (attach[b] >= 0) beyond[source[attach[b]]] += beyond[source[first[b]]];
  }
  const most = beyond.reduce((a, b) => Math.max(a, b), 1), thick = ath.sphere.radius / 50;
  return beyond.map((value) => thick * Math.sqrt(value / most));
}

/** Does ahead of limbGeometry() what takes longest of it. */
export function prepareLimbs(ath) {
  if (!ath.hasFaces) ath.limbs = limbs(ath);
}

/** Four vertices per edge. */
export function limbGeometry(ath, radius) {
  const geometry = ath.limbs ?? limbs(ath);
  ath.limbs = null;
  setRadii(geometry, radius);
  return geometry;
}

function limbs(ath) {
  const edges = ath.skeleton, count = edges.length / 2, source = new Uint32Array(4 * count), other = new Uint32Array(4 * count);
  const side = new Float32Array(4 * count), index = new Uint32Array(6 * count);
  for (let e = 0, at = 0, corner = 0; e < edges.length; e += 2, at += 4) {
    source[at] = source[at + 1] = other[at + 2] = other[at + 3] = edges[e];
    other[at] = other[at + 1] = source[at + 2] = source[at + 3] = edges[e + 1];
    side[at] = 1; // sign: which end; size: which side
    side[at + 1] = 2;
    side[at + 2] = -2;
    side[at + 3] = -1;
    index[corner++] = at;
    index[corner++] = at + 1;
    index[corner++] = at + 2;
    index[corner++] = at + 2;
    index[corner++] = at + 1;
    index[corner++] = at + 3;
  }
  const geometry = new BufferGeometry();
  geometry.setIndex(new BufferAttribute(index, 1));
  geometry.setAttribute("position", pointsOf(ath.rest, source));
  geometry.setAttribute("other", pointsOf(ath.rest, other));
  geometry.setAttribute("side", new BufferAttribute(side, 1));
  geometry.userData = { source, other };
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
  return new BufferAttribute(out, 3);
}

export function setRadii(geometry, perVertex) {
  const { source } = geometry.userData;
  const out = new Float32Array(source.length);
  for (let i = 0; i < source.length; i++) out[i] = perVertex[source[i]];
  geometry.setAttribute("radius", new BufferAttribute(out, 1));
}

export function limbMaterial(uniforms) {
  return new ShaderMaterial({
    vertexShader: VERTEX, fragmentShader: FRAGMENT, side: 2,
    uniforms: { ...uniforms, screen: { value: new Vector2(1, 1) }, shade: { value: 1 } },
  });
}
