// The sky by day and at dusk: a dome behind everything, the light that comes from all of it, and the sun.

import { BackSide, Color, DirectionalLight, HemisphereLight, Mesh, PMREMGenerator, Scene, ShaderMaterial, SphereGeometry, Vector3 } from "three";

export const SUN = new Vector3(-0.62, 0.72, 0.32).normalize();
const SHADOW_PIXELS = 2048;

const DAY = { zenith: 0x8fb9dd, horizon: 0xe9eee9, glow: 0xfff0d6, grass: 0x9aa86f, sun: 0xfff1d8, sunlight: 3.4, above: 0xdcebf8, below: 0x8c8f62, fill: 0.55,
  around: 0.75 };
const DUSK = { zenith: 0x18202f, horizon: 0x4a5260, glow: 0x96806c, grass: 0x3a4332, sun: 0xffd9b0, sunlight: 4.2, above: 0xa9bfe0, below: 0x59604c, fill: 1.9,
  around: 3.2 };

const VERTEX = "varying vec3 way; void main() { way = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }";
const FRAGMENT = /* glsl */`
uniform vec3 zenith, horizon, glow, grass, sun;
uniform float ground;
varying vec3 way;
void main() {
  vec3 w = normalize(way);
  vec3 c = mix(horizon, zenith, pow(clamp(w.y, 0.0, 1.0), 0.55));
  float toward = max(dot(w, sun), 0.0);
  c = mix(c, glow, 0.45 * pow(toward, 6.0) + 0.4 * pow(toward, 60.0));
  c = mix(c, grass, ground * smoothstep(0.02, -0.06, w.y));
  gl_FragColor = vec4(c, 1.0);
  #include <colorspace_fragment>
}`;

function dome(sky, ground) {
  const uniforms = Object.fromEntries(["zenith", "horizon", "glow", "grass"].map((name) => [name, { value: new Color(sky[name]) }]));
  const material = new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, side: BackSide, depthWrite: false, depthTest: false,
    uniforms: { ...uniforms, sun: { value: SUN }, ground: { value: ground ? 1 : 0 } } });
  return new Mesh(new SphereGeometry(1, 48, 24), material);
}

export class Sky {
  dark = false;
  #around = new Map(); // the light from all sides, by day and at dusk

  constructor(renderer) {
    this.renderer = renderer;
  }

  get colours() {
    return this.dark ? DUSK : DAY;
  }

  get horizon() {
    return new Color(this.colours.horizon);
  }

  get #environment() {
    if (!this.#around.has(this.dark)) {
      const maker = new PMREMGenerator(this.renderer), scene = new Scene().add(dome(this.colours, true));
      this.#around.set(this.dark, maker.fromScene(scene, 0, 0.1, 10).texture);
      maker.dispose();
    }
    return this.#around.get(this.dark);
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
