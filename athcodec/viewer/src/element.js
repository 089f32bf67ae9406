// <ath-viewer src="oak.ath">: see element.d.ts.

import { Box3, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { ATHLoader } from "athcodec-three";

import { Plant } from "../page/plant.js";

const STYLE = ":host { display: block; position: relative; min-height: 150px; } canvas { width: 100%; height: 100%; display: block; position: absolute; inset: 0; outline-offset: -2px; }";
const LONGEST = 0.5; // seconds that pass at most from a picture to the next, as in a tab that was hidden

let loader = null;

export class ATHViewerElement extends HTMLElement {
  static observedAttributes = ["src", "clip", "level", "wind", "paused", "alt", "camera-controls"];

  /** Whose settings hold for elements that load later. */
  static get loader() {
    return loader ??= new ATHLoader();
  }

  #canvas = document.createElement("canvas");
  #renderer = null;
  #controls = null;
  #camera = new PerspectiveCamera(38, 1, 0.01, 1000);
  #scene = new Scene();
  #plant = null;
  #seconds = 0;
  #last = 0;
  #frame = 0;
  #seen = false;
  #dirty = false;
  #wish = 0; // the newest file that was asked for
  #sized = new ResizeObserver(() => this.#resize());
  #inView = new IntersectionObserver(([{ isIntersecting }]) => {
    this.#seen = isIntersecting;
    this.#go();
  });

  constructor() {
    super();
    const style = new CSSStyleSheet(), root = this.attachShadow({ mode: "open" });
    style.replaceSync(STYLE);
    root.adoptedStyleSheets = [style];
    root.append(this.#canvas);
    this.#canvas.setAttribute("role", "img");
    const sun = new DirectionalLight(0xfff2dd, 2.4);
    sun.position.set(0.6, 1, 0.7);
    this.#scene.add(new HemisphereLight(0xeaf2ff, 0x8a8371, 1.9), sun);
  }

  connectedCallback() {
    this.#renderer = new WebGLRenderer({ canvas: this.#canvas, antialias: true, alpha: true });
    this.#controls = new OrbitControls(this.#camera, this.#canvas);
    this.#controls.enableDamping = true;
    this.#controls.addEventListener("change", () => { this.#dirty = true; });
    this.#sized.observe(this);
    this.#inView.observe(this);
    this.#canvas.setAttribute("aria-label", this.getAttribute("alt") ?? "Moving plant");
    this.#steer();
    if (this.src) this.#load();
  }

  disconnectedCallback() {
    this.#sized.disconnect();
    this.#inView.disconnect();
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.#seen = false;
    this.#clear();
    this.#controls.dispose();
    this.#renderer.dispose();
    this.#renderer = null;
  }

  attributeChangedCallback(name, before, value) {
    if (!this.#renderer || before === value) return;
    if (name === "src") this.#load();
    if (name === "clip" || name === "wind") this.#play();
    if (name === "level") this.#setLevel();
    if (name === "alt") this.#canvas.setAttribute("aria-label", value ?? "Moving plant");
    if (name === "camera-controls") this.#steer();
    this.#last = 0;
    this.#go();
  }

  get src() {
    return this.getAttribute("src");
  }

  set src(url) {
    this.setAttribute("src", url);
  }

  get paused() {
    return this.hasAttribute("paused");
  }

  set paused(paused) {
    this.toggleAttribute("paused", paused);
  }

  play() {
    this.paused = false;
  }

  pause() {
    this.paused = true;
  }

  get currentTime() {
    return this.#seconds;
  }

  set currentTime(seconds) {
    this.#seconds = seconds;
    this.#dirty = true;
  }

  /** The file, null before its first picture. */
  get ath() {
    return this.#plant?.ath ?? null;
  }

  get camera() {
    return this.#camera;
  }

  #steer() {
    this.#controls.enabled = this.hasAttribute("camera-controls");
    this.#canvas.style.touchAction = this.#controls.enabled ? "none" : "auto";
    if (this.#controls.enabled) this.#canvas.tabIndex = 0;
    else this.#canvas.removeAttribute("tabindex");
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  async #load() {
    const wish = ++this.#wish, { src } = this;
    if (!src) {
      this.#clear();
      return;
    }
    try {
      ATHViewerElement.loader.setClip(this.getAttribute("clip"));
      const loading = ATHViewerElement.loader.loadAsync(new URL(src, document.baseURI).href);
      ATHViewerElement.loader.setClip(null);
      const ath = await loading;
      if (wish === this.#wish) this.#show(ath);
      else ath.dispose();
    } catch (error) {
      if (wish === this.#wish) this.#tell("error", error);
    }
  }

  #clear() {
    this.#wish++;
    this.#plant?.dispose();
    this.#plant?.root.removeFromParent();
    this.#plant?.ath.dispose();
    this.#plant = null;
  }

  #show(ath) {
    this.#clear();
    const plant = this.#plant = new Plant(ath), { motion } = ath, changed = () => { this.#dirty = true; };
    plant.onPaint = changed;
    for (const type of ["frame", "ready"]) motion.addEventListener(type, changed);
    motion.addEventListener("progress", ({ loaded, total }) => this.#tell("progress", { loaded, total }));
    for (const type of ["stopped", "damaged"]) motion.addEventListener(type, (event) => this.#tell("error", event));
    this.#scene.add(plant.root);
    this.#seconds = 0;
    if (this.hasAttribute("wind")) this.#play();
    this.#setLevel();
    this.#resize();
    this.#fit();
    this.#go();
    this.#tell("load", { ath });
  }

  #play() {
    const motion = this.#plant?.ath.motion, wind = this.getAttribute("wind"), clip = this.getAttribute("clip");
    if (!motion) return;
    if (wind !== null) motion.wind(...wind.split(/[\s,]+/).map(Number));
    else motion.play(clip ?? 0, { fade: 0.4 });
    this.#dirty = true;
  }

  #setLevel() {
    const level = this.getAttribute("level") ?? "auto";
    this.#plant?.ath.motion.setLevel(level === "auto" ? level : Number(level));
    this.#dirty = true;
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this;
    if (!this.#renderer || width === 0 || height === 0) return;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#dirty = true;
  }

  // The whole plant in view.
  #fit() {
    const { ath, root } = this.#plant, box = ath.box.clone().applyMatrix4(root.matrixWorld), size = box.getSize(new Vector3());
    const half = Math.tan(this.#camera.fov * Math.PI / 360), across = Math.hypot(size.x, size.z);
    const distance = 0.35 * across + 0.6 * Math.max(size.y, across / this.#camera.aspect, 1e-6) / half;
    box.getCenter(this.#controls.target);
    this.#camera.position.copy(this.#controls.target).add(new Vector3(0.35, 0.16, 0.92).normalize().multiplyScalar(distance));
    Object.assign(this.#camera, { near: distance / 500, far: distance * 60 }).updateProjectionMatrix();
    this.#controls.update();
  }

  #go() {
    if (this.#frame === 0 && this.#seen && this.#plant) {
      this.#last = 0;
      this.#frame = requestAnimationFrame((now) => this.#tick(now));
    }
  }

  #tick(now) {
    this.#frame = 0;
    if (!this.#seen || !this.#plant) return;
    this.#frame = requestAnimationFrame((next) => this.#tick(next));
    const passed = this.#last ? Math.min(LONGEST, (now - this.#last) / 1000) : 0, { ath: { motion }, root } = this.#plant;
    this.#last = now;
    if (!this.paused) this.#seconds += passed * (Number(this.getAttribute("speed")) || 1);
    const height = this.#canvas.height;
    this.#controls.update();
    motion.update(this.#camera, height, root).setTime(this.#seconds);
    if (!this.#dirty) return;
    this.#dirty = false;
    this.#plant.prepare(this.#canvas.width, height);
    this.#renderer.render(this.#scene, this.#camera);
  }
}

if (!customElements.get("ath-viewer")) customElements.define("ath-viewer", ATHViewerElement);
