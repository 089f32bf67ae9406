// Bark and leaves of forests on WebGPU: what surfaces.js draws, in less detail, as nodes.

import { DoubleSide, MeshStandardNodeMaterial, TSL } from "three/webgpu";

import { surfacesOf } from "./surfaces.js";

const { Fn, abs, attribute, clamp, dot, float, floor, fract, fwidth, max, mix, mx_noise_float, normalWorld, pow, select, sin, smoothstep, vec3 } = TSL;

// Half the width of a leaf at v, from stalk to tip.
function halfWidth(leaf, v) {
  if (leaf === "blades") return float(2);
  if (leaf === "pinnae") return float(0.97).sub(pow(abs(sin(v.mul(40.84).add(1.5708))), 3).mul(0.55).mul(v.mul(-0.6).add(1)));
  const along = clamp(v.sub(0.1).div(0.9), 0, 1);
  return max(pow(sin(pow(along, 0.8).mul(Math.PI)), 0.8).mul(0.92), select(v.lessThan(0.2), float(0.04), float(0)));
}

/** For meshes of a file. sun: where its light comes from, a Vector3 of the world. */
export function forestMaterial(metadata, sun) {
  const surfaces = surfacesOf(metadata), material = new MeshStandardNodeMaterial({ color: surfaces ? 0xffffff : 0x7f9a55, roughness: 0.8, side: DoubleSide });
  if (!surfaces) return material;
  const [stem, leaf] = surfaces, at = attribute("uv", "vec2"), u = at.x, v = at.y, isLeaf = u.greaterThanEqual(1);
  const shade = floor(u.sub(1).mul(0.5)).div(7), across = fract(u.sub(1).mul(0.5)).mul(4).sub(1);
  const green = Fn(() => {
    const tone = mix(vec3(0.062, 0.155, 0.018), vec3(0.145, 0.255, 0.03), shade).toVar();
    if (leaf === "blades") tone.mulAssign(smoothstep(0, 0.45, v).mul(0.6).add(0.5));
    const rib = smoothstep(0.08, 0, abs(across)).mul(smoothstep(0.12, 0.03, fwidth(v)));
    return mix(tone, tone.mul(1.5).add(0.015), rib.mul(0.5));
  });
  const bark = Fn(() => {
    if (stem === "stalks") return mix(vec3(0.1, 0.075, 0.03), vec3(0.12, 0.17, 0.04), clamp(v.mul(0.02), 0, 1));
    const ridges = mx_noise_float(vec3(u.mul(11), v.mul(2.6), 4)).mul(0.6).add(mx_noise_float(vec3(u.mul(18), v.mul(16), 9)).mul(0.3)).add(0.45);
    return mix(vec3(0.05, 0.037, 0.027), vec3(0.27, 0.215, 0.165), clamp(ridges, 0, 1));
  });
  const colour = select(isLeaf, green(), bark());
  material.colorNode = colour;
  const inside = Fn(() => {
    const edge = halfWidth(leaf, v).sub(abs(across)), soft = max(fwidth(edge), 1e-4);
    return select(isLeaf, edge.div(soft).add(0.5), float(1));
  });
  material.opacityNode = inside();
  material.alphaTest = 0.5;
  const behind = max(dot(normalWorld, vec3(sun.x, sun.y, sun.z)).negate(), 0); // light that comes through a leaf
  material.emissiveNode = select(isLeaf, colour.mul(vec3(1.5, 1.45, 0.45)).mul(behind).mul(0.8), vec3(0));
  return material;
}
