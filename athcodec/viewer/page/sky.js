// The sky by day and at dusk: a dome behind everything, with hills far off and clouds, the light that comes from all of it, and the sun.

import { BackSide, Color, DirectionalLight, HemisphereLight, Mesh, PMREMGenerator, Scene, ShaderMaterial, SphereGeometry, Vector3 } from "three";

export const SUN = new Vector3(-0.62, 0.72, 0.32).normalize();
const SHADOW_PIXELS = 2048;

const DAY = { zenith: 0x8fb9dd, horizon: 0xe9eee9, glow: 0xfff0d6, grass: 0x9aa86f, cloud: 0xffffff, hills: 0x7d9a8c, sun: 0xfff1d8, sunlight: 3.4, above: 0xdcebf8, below: 0x8c8f62, fill: 0.55,
  around: 0.75 };
const DUSK = { zenith: 0x18202f, horizon: 0x4a5260, glow: 0x96806c, grass: 0x3a4332, cloud: 0x6f6a70, hills: 0x2b3644, sun: 0xffd9b0, sunlight: 4.2, above: 0xa9bfe0, below: 0x59604c, fill: 1.9,
  around: 3.2 };

const VERTEX = "varying vec3 way; void main() { way = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }";
const FRAGMENT = /* glsl */`
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
}`;

function dome(sky, ground) {
  const uniforms = Object.fromEntries(["zenith", "horizon", "glow", "grass", "cloud", "hills"].map((name) => [name, { value: new Color(sky[name]) }]));
  const material = new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, side: BackSide, depthWrite: false, depthTest: false,
    uniforms: { ...uniforms, sun: { value: SUN }, ground: { value: ground ? 1 : 0 } } });
  return new Mesh(new SphereGeometry(1, 48, 24), material);
}

/** Frees what an object and those in it take on the GPU. */
export function discard(object) {
  object?.traverse((each) => {
    const textures = Object.values(each.material ?? {}).filter((value) => value?.isTexture);
    for (const part of [each, each.geometry, each.material, ...textures]) part?.dispose?.();
  });
}

export class Sky {
  dark = false;
  #around = new Map(); // the light from all sides, by day and at dusk

  /** rendererOf(): the renderer that draws the light. */
  constructor(rendererOf) {
    this.rendererOf = rendererOf;
  }

  get colours() {
    return this.dark ? DUSK : DAY;
  }

  get horizon() {
    return new Color(this.colours.horizon);
  }

  get #environment() {
    if (!this.#around.has(this.dark)) {
      const maker = new PMREMGenerator(this.rendererOf()), scene = new Scene().add(dome(this.colours, true));
      this.#around.set(this.dark, maker.fromScene(scene, 0, 0.1, 10).texture);
      maker.dispose();
    }
    return this.#around.get(this.dark);
  }

  /** Lets go of what a renderer has drawn. */
  forget() {
    for (const texture of this.#around.values()) texture.dispose();
    this.#around.clear();
  }

  /** Dome and lights of a scene, for the theme; those before are taken away. */
  light(scene) {
    const { sun: colour, sunlight, above, below, fill } = this.colours, old = scene.getObjectByName("sky");
    old?.removeFromParent();
    const sun = new DirectionalLight(colour, sunlight), back = dome(this.colours, false);
    sun.name = "sun";
    sun.shadow.mapSize.setScalar(SHADOW_PIXELS);
    sun.shadow.radius = 2.5;
    back.name = "dome";
    back.renderOrder = -2;
    back.frustumCulled = false;
    const sky = new Scene().add(back, sun, sun.target, new HemisphereLight(above, below, fill));
    sky.name = "sky";
    sky.children.at(-1).name = "fill";
    if (old) this.#reach(sun, old.getObjectByName("sun"));
    scene.add(sky);
    discard(old);
  }

  /** The light of the whole sky, or more of what fills shadows in its place. */
  surround(scene, whole) {
    const { fill, around } = this.colours;
    scene.environment = whole ? this.#environment : null;
    scene.environmentIntensity = around;
    scene.getObjectByName("fill").intensity = whole ? fill : fill + 0.8 * around;
  }

  #reach(sun, like) {
    sun.position.copy(like.position);
    sun.target.position.copy(like.target.position);
    sun.shadow.camera.copy(like.shadow.camera);
    sun.shadow.normalBias = like.shadow.normalBias;
    sun.castShadow = like.castShadow;
  }

  /** Shadows of a sphere: what stands in it casts them. */
  shade(scene, centre, radius) {
    const sun = scene.getObjectByName("sun"), { camera } = sun.shadow;
    sun.target.position.copy(centre);
    sun.position.copy(SUN).multiplyScalar(3 * radius).add(centre);
    Object.assign(camera, { left: -radius, right: radius, top: radius, bottom: -radius, near: 0.5 * radius, far: 5.5 * radius });
    camera.updateProjectionMatrix();
    sun.shadow.normalBias = 0.0015 * radius;
  }
}
