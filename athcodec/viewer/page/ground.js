// The ground: grass that fades into the haze of the horizon, and its blades, which sway, where the plant stands.

import { BufferAttribute, BufferGeometry, CircleGeometry, Color, Group, InstancedMesh, Matrix4, Mesh, MeshLambertMaterial, Object3D, Vector3 } from "three";

import { chance } from "./chance.js";

const REACH = 60; // Radius of the disc, over the radius of the meadow.
const BLADES = 26000, TALL = 0.015, WIDE = 0.0015; // Number of blades; height and width over the meadow's radius.
const COLOURS = { day: [0x5f7a44, 0x86985a], dusk: [0x3d4d39, 0x556447] };

const NOISE = /* glsl */`
varying vec2 athMeadow;
uniform vec3 athOther;
float athHash2(vec2 p) { p = fract(p * vec2(123.34, 456.21)); p += dot(p, p + 45.32); return fract(p.x * p.y); }
float athNoise2(vec2 x) {
  vec2 i = floor(x), f = fract(x);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(athHash2(i), athHash2(i + vec2(1, 0)), f.x), mix(athHash2(i + vec2(0, 1)), athHash2(i + vec2(1, 1)), f.x), f.y);
}
`;

// Patches of all sizes, each as long as it is wider than a pixel; seen from low above the ground they would be streaks.
const PATCHES = /* glsl */`
{
  float shade = 0.0, wide = length(fwidth(athMeadow)), low = dot(normalize(vViewPosition), normalize(vNormal));
  for (int i = 0; i < 6; i++) {
    float often = exp2(1.4 * float(i)) * 1.3;
    shade += (athNoise2(athMeadow * often + 7.0 * float(i)) - 0.5) * 0.24 * (1.0 - smoothstep(0.05, 0.3, wide * often));
  }
  shade *= smoothstep(0.0, 0.3, low);
  diffuseColor.rgb = mix(diffuseColor.rgb, athOther, clamp(0.4 + shade, 0.0, 1.0)) * (0.92 + 0.3 * shade);
}
`;

function disc() {
  const material = new MeshLambertMaterial(), other = { value: new Color() };
  material.onBeforeCompile = (shader) => {
    shader.uniforms.athOther = other;
    shader.vertexShader = shader.vertexShader.replace("#include <common>", "#include <common>\nvarying vec2 athMeadow;")
      .replace("#include <begin_vertex>", `#include <begin_vertex>\nathMeadow = position.xy * ${REACH}.0;`);
    shader.fragmentShader = shader.fragmentShader.replace("#include <common>", `#include <common>\n${NOISE}`)
      .replace("#include <map_fragment>", PATCHES);
  };
  material.userData.other = other;
  const mesh = new Mesh(new CircleGeometry(1, 96), material);
  mesh.name = "disc";
  mesh.scale.setScalar(REACH);
  mesh.receiveShadow = true;
  return mesh;
}

// A blade: two quads and a tip, bent; it is lit as the ground is.
function blade() {
  const geometry = new BufferGeometry(), rows = [[1, 0, 0], [0.75, 0.5, 0.1], [0, 1, 0.42]], points = [], colours = [];
  for (const [half, up, bent] of rows)
    for (const side of half > 0 ? [-1, 1] : [0]) {
      points.push(side * half * WIDE, bent * TALL, up * TALL);
      const light = 0.8 + 0.5 * up;
      colours.push(light, light, light * (1 - 0.2 * up));
    }
  geometry.setAttribute("position", new BufferAttribute(Float32Array.from(points), 3));
  geometry.setAttribute("color", new BufferAttribute(Float32Array.from(colours), 3));
  geometry.setAttribute("normal", new BufferAttribute(Float32Array.from(points, (_, i) => (i % 3 === 2 ? 1 : 0)), 3));
  geometry.setIndex([0, 1, 2, 2, 1, 3, 2, 3, 4, 2, 1, 0, 3, 1, 2, 4, 3, 2]); // Both sides are drawn: a blade that is turned over would be dark.
  return geometry;
}

// Gusts that go over the meadow, and each blade's own trembling.
const SWAY = /* glsl */`
vec4 mvPosition = instanceMatrix * vec4(transformed, 1.0);
{
  vec2 way = vec2(cos(athBreeze.z), sin(athBreeze.z)), at = instanceMatrix[3].xy;
  float own = fract(43.0 * at.x + 71.0 * at.y), up = mvPosition.z / ${TALL};
  float gust = sin(11.0 * dot(at, way) + 2.0 * sin(5.0 * dot(at, way.yx)) - 2.1 * athBreeze.x) * 0.5 + 0.5;
  float lean = athBreeze.y * (0.25 + 0.75 * gust + 0.2 * sin((5.0 + 3.0 * own) * athBreeze.x + 6.28 * own));
  mvPosition.xy += way * lean * up * up * ${TALL};
  mvPosition.z -= 0.3 * lean * lean * up * up * ${TALL};
}
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;
`;

function bladeMaterial() {
  const material = new MeshLambertMaterial({ vertexColors: true }), breeze = { value: new Vector3() };
  material.userData.breeze = breeze.value;
  material.onBeforeCompile = (shader) => {
    shader.uniforms.athBreeze = breeze;
    shader.vertexShader = shader.vertexShader.replace("#include <common>", "#include <common>\nuniform vec3 athBreeze;")
      .replace("#include <project_vertex>", SWAY);
  };
  return material;
}

/** Sets the wind that the blades of a meadow sway in. strength: 0 to 1; heading: degrees, clockwise from above. */
export function blow(ground, seconds, strength, heading) {
  ground.getObjectByName("grass").material.userData.breeze.set(seconds, strength, (90 - heading) * Math.PI / 180);
}

/** Leaves a share of the blades, spread as all of them. */
export function thin(ground, share) {
  ground.getObjectByName("grass").count = Math.round(share * BLADES);
}

function grass() {
  const mesh = new InstancedMesh(blade(), bladeMaterial(), BLADES), at = new Object3D(), matrix = new Matrix4();
  for (let i = 0; i < BLADES; i++) {
    const far = chance(i, 1) ** 0.72 * 0.98, turn = 2 * Math.PI * chance(i, 2);
    const x = far * Math.cos(turn), y = far * Math.sin(turn), clump = 0.5 + 0.5 * Math.sin(9 * x + 3 * Math.sin(7 * y)) * Math.sin(8 * y);
    const tall = (0.35 + 0.65 * chance(i, 3)) * (0.45 + 0.75 * clump) * Math.min(1, 2.2 * (1 - far));
    at.position.set(x, y, 0);
    at.rotation.set(0, 0, 2 * Math.PI * chance(i, 4));
    at.scale.set(0.7 + 0.6 * chance(i, 5), tall, tall);
    at.updateMatrix();
    mesh.setMatrixAt(i, matrix.copy(at.matrix));
    const shade = (0.85 + 0.4 * chance(i, 6)) * Math.min(1, 0.75 + 0.8 * (1 - far)); // at the rim as the ground is
    mesh.setColorAt(i, new Color(shade, shade, 0.9 * shade));
  }
  mesh.name = "grass";
  mesh.receiveShadow = true;
  mesh.frustumCulled = false;
  return mesh;
}

/** In the plane of x and y of what it stands in, of radius 1 as far as there are blades. */
export function meadow() {
  const ground = new Group().add(disc(), grass());
  ground.name = "ground";
  ground.rotation.x = -Math.PI / 2;
  return ground;
}

export function tintMeadow(ground, dark) {
  const [first, other] = dark ? COLOURS.dusk : COLOURS.day, { material } = ground.getObjectByName("disc");
  material.color.set(first);
  material.userData.other.value.set(other);
  ground.getObjectByName("grass").material.color.set(first).lerp(new Color(other), 0.45);
}
