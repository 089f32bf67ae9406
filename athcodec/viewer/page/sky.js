// The sky by day and at dusk: a dome behind everything, with hills far off and clouds; the sun, and the light from all other sides.

import { BackSide, Color, DirectionalLight, HemisphereLight, Mesh, Scene, ShaderMaterial, SphereGeometry, Vector3 } from "three";

export const SUN = new Vector3(-0.62, 0.72, 0.32).normalize();
const SHADOW_PIXELS = 2048;

// Haze: the one colour that sky, hills and ground end in. `back`: the light from the side of the eye, where the sun is not.
const DAY = { zenith: 0x7fb2e2, haze: 0xcfe0e8, glow: 0xfff0d6, cloud: 0xffffff, hills: 0x7d9a8c, sun: 0xfff1d8, sunlight: 3.0, above: 0xdcebf8, below: 0x8c8f62, fill: 1.7,
  back: 0.9 };
const DUSK = { zenith: 0x131b2a, haze: 0x39455a, glow: 0x6b6470, cloud: 0x59606f, hills: 0x1f2937, sun: 0xffcf9e, sunlight: 2.0, above: 0xb4c4e4, below: 0x6a7060, fill: 2.8,
  back: 2.2 };

const VERTEX = "varying vec3 way; void main() { way = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }";
const FRAGMENT = /* glsl */`
uniform vec3 zenith, haze, glow, sun, cloud, hills;
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
  float up = max(w.y, 0.0), clear = smoothstep(0.0, 0.35, up); // near the horizon all is haze
  vec3 c = mix(haze, zenith, pow(clear, 0.8) * (0.45 + 0.55 * smoothstep(0.1, 0.9, up)));
  float toward = max(dot(w, sun), 0.0);
  c = mix(c, glow, (0.3 * pow(toward, 6.0) + 0.3 * pow(toward, 60.0)) * clear);
  if (w.y > 0.0) {
    vec2 at = w.xz / (w.y + 0.12);
    float thick = 0.55 * noise(at * 1.1 + 3.0) + 0.27 * noise(at * 2.7) + 0.13 * noise(at * 6.1) + 0.05 * noise(at * 13.0);
    c = mix(c, cloud, 0.6 * smoothstep(0.46, 0.8, thick) * smoothstep(0.04, 0.3, w.y));
    vec2 around = normalize(w.xz);
    float soft = max(fwidth(w.y), 1e-4), far = ridge(around, vec2(7.3, 2.1)) + 0.014, near = ridge(around, vec2(1.7, 8.4));
    c = mix(c, mix(haze, hills, 0.16 * smoothstep(0.0, 0.03, w.y)), smoothstep(soft, -soft, w.y - far));
    c = mix(c, mix(haze, hills, 0.34 * smoothstep(0.0, 0.03, w.y)), smoothstep(soft, -soft, w.y - near));
  }
  gl_FragColor = vec4(c, 1.0);
  #include <colorspace_fragment>
}`;

function dome(sky) {
  const uniforms = Object.fromEntries(["zenith", "haze", "glow", "cloud", "hills"].map((name) => [name, { value: new Color(sky[name]) }]));
  const material = new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, side: BackSide, depthWrite: false, depthTest: false,
    uniforms: { ...uniforms, sun: { value: SUN } } });
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

  get colours() {
    return this.dark ? DUSK : DAY;
  }

  get haze() {
    return new Color(this.colours.haze);
  }

  /** Dome and lights of a scene, for the theme; those before are taken away. */
  light(scene) {
    const { sun: colour, sunlight, above, below, fill, back: opposite } = this.colours, old = scene.getObjectByName("sky");
    old?.removeFromParent();
    const sun = new DirectionalLight(colour, sunlight), back = dome(this.colours), shade = new DirectionalLight(above, opposite);
    sun.name = "sun";
    sun.shadow.mapSize.setScalar(SHADOW_PIXELS);
    sun.shadow.radius = 2.5;
    back.name = "dome";
    back.renderOrder = -2;
    back.frustumCulled = false;
    const sky = new Scene().add(back, sun, sun.target, new HemisphereLight(above, below, fill), shade);
    shade.position.set(-SUN.x, 0.25, 1);
    sky.name = "sky";
    if (old) this.#reach(sun, old.getObjectByName("sun"));
    scene.add(sky);
    discard(old);
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
