// Sky, sun and ground of the forest, as nodes.

import { Color, DirectionalLight, Fog, HemisphereLight, Mesh, MeshStandardNodeMaterial, PlaneGeometry, TSL, Vector3 } from "three/webgpu";

const { Fn, clamp, color, dot, max, mix, mx_noise_float, normalWorldGeometry, positionWorld, pow, smoothstep, vec3 } = TSL;

export const SUN = new Vector3(-0.62, 0.72, 0.32).normalize();
const ZENITH = 0x6fa6da, HORIZON = 0xe4ebe8, GLOW = 0xfff0d6, SHADOW_PIXELS = 2048;
const SHADOW_REACH = 9; // Reach of shadows, in radii of a plant.

const sky = Fn(() => {
  const up = clamp(normalWorldGeometry.y, 0, 1), toward = max(dot(normalWorldGeometry, vec3(SUN.x, SUN.y, SUN.z)), 0);
  return mix(mix(color(HORIZON), color(ZENITH), pow(up, 0.55)), color(GLOW), pow(toward, 6).mul(0.4));
});

// Grass and moss, in patches of several sizes.
const meadow = (size) => Fn(() => {
  const at = positionWorld.xz.div(size), noise = (k) => mx_noise_float(vec3(at.x.mul(k), at.y.mul(k), k));
  const patches = smoothstep(-0.5, 0.6, noise(0.35).add(noise(1.9).mul(0.5))), blades = noise(23).mul(0.5).add(noise(61).mul(0.5));
  const grass = mix(vec3(0.085, 0.12, 0.03), vec3(0.16, 0.19, 0.055), patches);
  return mix(grass, vec3(0.13, 0.1, 0.05), smoothstep(0.25, 0.75, noise(0.8)).mul(0.5)).mul(blades.mul(0.5).add(1));
})();

export class Stage {
  /** radius: of a plant. */
  constructor(scene, radius) {
    const wide = 260 * radius, reach = SHADOW_REACH * radius;
    this.sun = new DirectionalLight(0xfff1d8, 3.2);
    this.ground = new Mesh(new PlaneGeometry(4 * wide, 4 * wide), new MeshStandardNodeMaterial({ roughness: 1 }));
    this.ground.material.colorNode = meadow(radius);
    this.ground.rotation.x = -Math.PI / 2;
    this.ground.receiveShadow = true;
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * reach, far: 5 * reach });
    Object.assign(this.sun.shadow, { bias: -0.0005, normalBias: 0.004 * radius });
    this.sun.shadow.mapSize.setScalar(SHADOW_PIXELS);
    this.reach = reach;
    scene.backgroundNode = sky();
    scene.fog = new Fog(new Color(HORIZON), 10 * radius, 0.55 * wide);
    scene.add(this.ground, this.sun, this.sun.target, new HemisphereLight(0xdcebf8, 0x8c8f62, 1.3));
  }

  set shadows(on) {
    this.sun.castShadow = on;
  }

  /** Light and shadow around a place, in steps of a texel so that the edges of shadows stand still. */
  around(place) {
    const step = 2 * this.reach / SHADOW_PIXELS * 16, snap = (number) => Math.round(number / step) * step;
    this.sun.target.position.set(snap(place.x), 0, snap(place.z));
    this.sun.position.copy(this.sun.target.position).addScaledVector(SUN, 2.5 * this.reach);
  }
}
