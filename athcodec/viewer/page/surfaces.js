// Stems and leaves as they look near by: colour, bumps, roughness and the leaf's outline by code in the shader, from the
// texture coordinates of a file whose metadata name both, such as `surfaces: "bark, leaves"`. On stems u is 0 to 1; on
// leaves it is 1 + 2 k to 2 + 2 k across the leaf, k being one of eight shades, and v runs from stalk to tip.

import { DoubleSide, MeshDepthMaterial, MeshStandardMaterial, RGBADepthPacking } from "three";

const STEMS = ["bark", "stalks"], LEAVES = ["leaves", "blades", "pinnae"];

/** Returns how the metadata of a file name its surfaces, as [of stems, of leaves]; null where they name none that is known. */
export function surfacesOf({ surfaces }) {
  const [stem, leaf] = typeof surfaces === "string" ? surfaces.split(", ") : [];
  return STEMS.includes(stem) && LEAVES.includes(leaf) ? [stem, leaf] : null;
}

const SHAPE = /* glsl */`
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
`;

const LOOK = /* glsl */`
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
`;

const EDGE = /* glsl */`
float athIn = athInside();
diffuseColor.a = clamp(athIn / max(fwidth(athIn), 1e-4) + 0.5, 0.0, 1.0);
#ifdef ALPHA_TO_COVERAGE
if (diffuseColor.a < 0.02) discard;
#else
if (diffuseColor.a < 0.5) discard;
#endif
`;

const SURFACE = /* glsl */`
${EDGE}
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
  vec3 bark = mix(vec3(0.09, 0.07, 0.05), vec3(0.3, 0.24, 0.18), athBump);
  bark = mix(bark, bark * vec3(0.85, 0.92, 0.8), age);
  diffuseColor.rgb = mix(bark, vec3(0.17, 0.19, 0.12), 0.35 * lichen * athBump);
#endif
}
`;

const BUMP = /* glsl */`
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
`;

// Light shines through a leaf from behind, yellower than what it reflects: the sun's, shadowed as it is on the leaf, and that of the sky.
const THROUGH = /* glsl */`
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
#if NUM_HEMI_LIGHTS > 0
  reflectedLight.indirectDiffuse += 0.45 * athThin * getHemisphereLightIrradiance(hemisphereLights[0], -normal) * BRDF_Lambert(through);
#endif
  reflectedLight.directDiffuse += athThin * (0.55 * behind + 0.25 * toward) * lit * directionalLights[0].color * through;
}
#endif
`;

function given(shader, fragment, [stem, leaf]) {
  shader.vertexShader = shader.vertexShader
    .replace("#include <common>", "#include <common>\nvarying vec2 athUv;\nvarying vec3 athGrown;")
    .replace("#include <uv_vertex>", "#include <uv_vertex>\nathUv = uv;\nathGrown = position;");
  shader.fragmentShader = `#define ATH_STEM ${STEMS.indexOf(stem)}\n#define ATH_LEAF ${LEAVES.indexOf(leaf)}\n${fragment}`;
}

// Soft edges, where something is behind all of the picture: only a scene with a sky has haze.
function soften(material) {
  material.onBeforeRender = (renderer, scene) => {
    material.alphaToCoverage = scene.fog !== null;
    material.onBeforeRender = () => {};
  };
  return material;
}

/** Bark and leaves as the viewer draws them, for geometries with texture coordinates and the metadata of their file; not yet bound to a
 * motion. Where the metadata name no surfaces that are known, it is a plain material in the colour of leaves. */
export class ATHPlantMaterial extends MeshStandardMaterial {
  constructor(metadata = {}) {
    const surfaces = surfacesOf(metadata);
    super(surfaces ? { side: DoubleSide, shadowSide: DoubleSide } : { side: DoubleSide, color: 0x6f8f4a, roughness: 0.8 });
    if (!surfaces) return;
    this.onBeforeCompile = (shader) => given(shader, shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${SHAPE}${LOOK}`)
      .replace("#include <map_fragment>", SURFACE)
      .replace("#include <roughnessmap_fragment>", "float roughnessFactor = athIsLeaf ? 0.62 : 0.95;")
      .replace("#include <normal_fragment_maps>", BUMP)
      .replace("#include <lights_fragment_end>", `#include <lights_fragment_end>\n${THROUGH}`), surfaces);
    this.customProgramCacheKey = () => `ath surface ${surfaces}`;
    soften(this);
  }
}

export const surfaceMaterial = (surfaces) => new ATHPlantMaterial({ surfaces: surfaces.join(", ") });

/** Returns the material with the leaves' outlines, in colours that tell something. */
export function outlined(material, surfaces) {
  const { onBeforeCompile: before } = material;
  material.onBeforeCompile = (shader) => {
    before(shader);
    given(shader, shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${SHAPE}`).replace("#include <map_fragment>", EDGE), surfaces);
  };
  material.customProgramCacheKey = () => `ath outlines ${surfaces}`;
  return soften(material);
}

/** Returns the material of shadows, which then have the leaves' outlines. */
export function surfaceDepth(surfaces) {
  const material = new MeshDepthMaterial({ depthPacking: RGBADepthPacking, side: DoubleSide });
  material.onBeforeCompile = (shader) => given(shader, shader.fragmentShader
    .replace("#include <common>", `#include <common>\n${SHAPE}`)
    .replace("#include <map_fragment>", "if (athInside() < 0.0) discard;"), surfaces);
  material.customProgramCacheKey = () => `ath surface depth ${surfaces}`;
  return material;
}
