// The stage: renderer, camera and light, and one or two panes, each with its own scene; two share the view, on either side of a split.

import { BufferAttribute, Color, DirectionalLight, Fog, HemisphereLight, Mesh, PerspectiveCamera, PlaneGeometry, Scene, ShaderMaterial, Vector3,
  WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const GROUND = /* glsl */`
varying vec2 at;
uniform vec3 tint;
uniform float strength;
void main() {
  float d = length(at);
  gl_FragColor = vec4(tint, strength * pow(max(1.0 - d, 0.0), 1.8));
}`;

export class Stage {
  panes = [];

  split = 0.5; // share of the picture that is the left one of two panes

  moved = false; // by hand, since the whole was last in view

  constructor(canvas, changed, resized) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.camera = new PerspectiveCamera(38, 1, 0.01, 1000);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.addEventListener("change", changed);
    this.controls.addEventListener("start", () => { this.moved = true; });
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.dark.addEventListener("change", () => {
      this.#readBack();
      this.#tint();
      changed();
    });
    this.#readBack();
    this.changed = changed;
    this.resized = resized;
    new ResizeObserver(() => this.fit()).observe(canvas.parentElement);
    this.#resize();
  }

  /** Takes the size that the page leaves. */
  fit() {
    if (!this.#resize()) return;
    this.resized();
    this.changed();
  }

  // The page's own background; once, as it makes the page lay itself out.
  #readBack() {
    this.back = getComputedStyle(document.documentElement).getPropertyValue("--back").trim() || "#ffffff";
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const ratio = Math.min(devicePixelRatio, 2);
    const inset = parseInt(getComputedStyle(this.canvas.parentElement).getPropertyValue("--inset"), 10) || 0;
    const sized = width !== this.width || height !== this.height || ratio !== this.renderer.getPixelRatio();
    if (!sized && inset === this.inset) return false;
    if (sized) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
    }
    Object.assign(this, { width, height, inset });
    return true;
  }

  /** Compiles what plants are drawn with before there are any, and draws it once: what waits for the graphics
   * processor waits here. */
  warm(objects) {
    this.kept = this.scene(objects); // programs live as long as a material that uses them
    for (const object of objects) {
      object.geometry.setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
      object.frustumCulled = false;
    }
    this.renderer.render(this.kept, this.camera);
  }

  /** A pane's scene; `content` is added to it. */
  scene(content) {
    const scene = new Scene(), sun = new DirectionalLight(0xfff2dd, 2.4);
    sun.position.set(0.6, 1, 0.7);
    scene.add(new HemisphereLight(0xeaf2ff, 0x8a8371, 1.9), sun, this.#ground(), ...content);
    this.#tint([scene]);
    return scene;
  }

  #ground() {
    const material = new ShaderMaterial({
      vertexShader: "varying vec2 at; void main() { at = position.xy * 2.0; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
      fragmentShader: GROUND, transparent: true, depthWrite: false,
      uniforms: { tint: { value: new Color(0, 0, 0) }, strength: { value: 0.16 } },
    });
    const ground = new Mesh(new PlaneGeometry(1, 1), material);
    ground.name = "ground";
    ground.rotation.x = -Math.PI / 2;
    ground.renderOrder = -1;
    return ground;
  }

  #tint(scenes = this.panes.map(({ scene }) => scene)) {
    for (const scene of scenes) {
      scene.background = new Color(this.back);
      scene.fog?.color.copy(scene.background);
      const { tint, strength } = scene.getObjectByName("ground").material.uniforms;
      tint.value.set(0, 0, 0);
      strength.value = this.dark.matches ? 0.5 : 0.16;
    }
  }

  setPanes(panes) {
    this.panes = panes;
    this.#tint();
    this.changed();
  }

  /** The whole of a box (in the world) in view, from any side; `ground`: its height and size. */
  look(box, ground) {
    const size = box.getSize(new Vector3()), across = Math.hypot(size.x, size.z), half = Math.tan(this.camera.fov * Math.PI / 360);
    const aspect = (this.width - this.inset) / this.height;
    const distance = 0.35 * across + 0.68 * Math.max(size.y, 0.9 * across / aspect, 1e-6) / half;
    box.getCenter(this.controls.target);
    this.camera.position.copy(this.controls.target).add(new Vector3(0.35, 0.16, 0.92).normalize().multiplyScalar(distance));
    this.camera.near = distance / 500;
    this.camera.far = distance * 60;
    this.controls.maxDistance = distance * 20;
    this.placeGround(ground.height, ground.size);
    this.controls.update();
    this.changed();
  }

  placeGround(height, size) {
    for (const { scene } of this.panes) {
      const ground = scene.getObjectByName("ground");
      ground.position.y = height;
      ground.scale.setScalar(size);
    }
  }

  /** Haze from one distance to another; none where both are 0. */
  fog(near, far) {
    for (const { scene } of this.panes) scene.fog = far > 0 ? new Fog(scene.background, near, far) : null;
  }

  /** Height of the picture in pixels of the device. */
  get pixels() {
    return this.height * this.renderer.getPixelRatio();
  }

  // What lies behind the settings is drawn too, and counts for nothing else.
  render() {
    const { renderer, camera, panes, width, height } = this, seen = width - this.inset, left = this.split * seen;
    camera.aspect = seen / height;
    camera.setViewOffset(seen, height, 0, 0, width, height);
    camera.updateMatrixWorld();
    renderer.setScissorTest(panes.length > 1);
    panes.forEach(({ scene, before }, i) => {
      before?.(width * renderer.getPixelRatio(), this.pixels);
      if (panes.length > 1) renderer.setScissor(i * left, 0, i === 0 ? left : width - left, height);
      renderer.render(scene, camera);
    });
  }
}
