// <ath-viewer src="oak.ath">: see element.d.ts.

import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { ATHLoader } from "athcodec-three";

import { Easel } from "../page/easel.js";
import { ground, Grove } from "../page/grove.js";
import { floorIn } from "../page/places.js";
import { Plant } from "../page/plant.js";
import { Stage } from "../page/stage.js";
import { wordsOf } from "../page/trouble.js";

const STYLE = `:host { display: block; position: relative; min-height: 150px; overflow: hidden; }
div, canvas, ::slotted(*) { position: absolute; inset: 0; width: 100%; height: 100%; }
button, p { position: absolute; left: 12px; bottom: 12px; margin: 0; padding: 8px 14px; max-width: calc(100% - 24px); border: 0; border-radius: 12px;
  background: Canvas; color: CanvasText; font: 14px/1.4 system-ui, sans-serif; }
button { cursor: pointer; }
::slotted(*) { object-fit: cover; }
canvas { display: block; outline-offset: -2px; opacity: 0; transition: opacity .5s; }
canvas.drawn { opacity: 1; }
@media (prefers-reduced-motion: reduce) { canvas { transition: none; } }`;
const LONGEST = 0.5; // seconds that pass at most from a picture to the next, as in a tab that was hidden
const NEAR = "120px"; // Distance from the view within which an element loads.
const BREEZE = 0.5; // in the grass of the scenery
const MOST_TREES = 10000;
const FORGET_MS = 4000; // out of view, after which a lazy one gives back what it takes

let loader = null;

const easel = new Easel(); // of all elements

// The viewer's stage, with its scenery or without.
class Stand extends Stage {
  constructor(canvas, changed, scenery) {
    super(canvas, changed, () => this.#fit(), easel, scenery);
    this.steer(OrbitControls);
  }

  #box = null;
  #reach = 0; // Reach of a forest.

  #fit() {
    if (!this.#box || this.moved) return;
    if (this.#reach > 0) {
      this.lookOver(this.#box, this.#reach);
      return;
    }
    const size = this.#box.getSize(new Vector3());
    this.look(this.#box, { height: this.#box.min.y, size: 1.9 * Math.max(size.x, size.y, size.z) });
  }

  show(plant, reach) {
    this.#reach = reach;
    this.setPanes([{ scene: this.scene([plant.root]), foot: plant.foot, before: (width, height) => plant.prepare(width, height) }]);
    this.#box = plant.box;
    this.#fit();
  }

  add(plant) {
    ground(plant, this.#box.min.y);
    this.panes[0].scene.add(plant.root);
  }
}

// Node has no elements: there the page's modules are only read.
export class ATHViewerElement extends (globalThis.HTMLElement ?? Object) {
  static tag = "ath-viewer";

  static observedAttributes = ["src", "clip", "level", "wind", "paused", "alt", "camera-controls"];

  /** Whose settings hold for elements that load later. */
  static get loader() {
    return loader ??= new ATHLoader();
  }

  #stand = document.createElement("div"); // Frame of the canvas.
  #notice = null;  // What is wrong, or a button.
  #still = matchMedia("(prefers-reduced-motion: reduce)").matches; // until somebody wants motion
  #canvas = null;
  #stage = null; // null where it is lazy and out of view
  #plant = null;
  #grove = null; // where it is a forest
  #unseen = new PerspectiveCamera();
  #seconds = 0;
  #last = 0;
  #frame = 0;
  #seen = false;
  #dirty = false;
  #wish = 0; // the newest file that was asked for
  #forgetting = 0;
  #inView = new IntersectionObserver((seen) => this.#look(seen.at(-1).isIntersecting), { rootMargin: NEAR });

  constructor() {
    super();
    const style = new CSSStyleSheet(), root = this.attachShadow({ mode: "open" });
    style.replaceSync(STYLE);
    root.adoptedStyleSheets = [style];
    root.append(document.createElement("slot"), this.#stand);
  }

  connectedCallback() {
    this.#inView.observe(this);
    if (!this.#isLazy) this.#wake();
  }

  disconnectedCallback() {
    this.#inView.disconnect();
    this.#look(false);
    this.#sleep();
  }

  get #isLazy() {
    return this.getAttribute("loading") === "lazy";
  }

  #look(seen) {
    this.#seen = seen;
    clearTimeout(this.#forgetting);
    if (seen) this.#wake();
    else if (this.#isLazy) this.#forgetting = setTimeout(() => this.#sleep(), FORGET_MS);
    this.#go();
  }

  #wake() {
    if (this.#stage || !this.isConnected) return;
    this.#canvas = document.createElement("canvas");
    this.#canvas.setAttribute("role", "img");
    this.#canvas.setAttribute("aria-label", this.getAttribute("alt") ?? "Moving plant");
    this.#stand.replaceChildren(this.#canvas);
    try {
      this.#stage = new Stand(this.#canvas, () => { this.#dirty = true; }, this.hasAttribute("scenery"));
    } catch (error) { // a browser without WebGL
      this.#canvas.remove();
      this.#fail(Object.assign(error, { codeName: "GRAPHICS" }));
      return;
    }
    this.#steer();
    if (this.src) this.#load();
  }

  #sleep() {
    clearTimeout(this.#forgetting);
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    if (!this.#stage) return;
    this.#clear();
    this.#stage.dispose();
    this.#stage = null;
    this.#canvas.remove();
  }

  attributeChangedCallback(name, before, value) {
    if (!this.#stage || before === value) return;
    if (name === "src") this.#load();
    if (name === "paused" && value === null) this.#start();
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
    this.#start();
  }

  #start() {
    this.#still = false;
    this.#say();
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

  /** Returns what is drawn of a forest: the trees, and each plant of its floor. */
  get forests() {
    return this.#grove?.forests ?? [];
  }

  get camera() {
    return this.#stage?.camera ?? this.#unseen;
  }

  #steer() {
    const { controls } = this.#stage, wanted = this.getAttribute("camera-controls");
    controls.enabled = wanted !== null;
    controls.enableZoom = controls.enablePan = wanted !== "turn";
    this.#canvas.style.touchAction = wanted === null ? "auto" : wanted === "turn" ? "pan-y" : "none";
    if (controls.enabled) this.#canvas.tabIndex = 0;
    else this.#canvas.removeAttribute("tabindex");
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  // In front of the picture, in place of the notice before.
  #say(element = null, words = {}) {
    this.#notice?.remove();
    this.#notice = element && Object.assign(document.createElement(element), words);
    if (element) this.shadowRoot.append(this.#notice);
  }

  #fail(error) {
    this.#say("p", { role: "alert", textContent: wordsOf(error.codeName).title, title: error.message });
    this.#tell("error", error);
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
      if (this.#trees > 0) await ath.arrays.catch(() => {}); // which a forest is drawn with from the start
      if (wish === this.#wish) this.#show(ath);
      else ath.dispose();
    } catch (error) {
      if (wish === this.#wish) this.#fail(error);
    }
  }

  #clear() {
    this.#say();
    this.#wish++;
    this.#grove?.dispose();
    this.#grove = null;
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
    this.#seconds = 0;
    if (this.#trees > 0) {
      const files = floorIn(this.getAttribute("floor") ?? "").map(({ source, each }) => ({ source: new URL(source, document.baseURI).href, each }));
      this.#grove = new Grove(plant, this.#trees, files, ATHViewerElement.loader, changed);
    }
    this.#stage.show(plant, this.#grove?.reach ?? 0);
    if (this.#grove) this.#grove.grow((each) => this.#stage.add(each));
    else this.#setLevel();
    if (this.hasAttribute("wind") && !this.#grove) this.#play();
    if (this.#still && !this.paused) this.#say("button", { textContent: "▶ Play", onclick: () => this.play() });
    this.#dirty = true;
    this.#go();
    this.#tell("load", { ath });
  }

  get #trees() {
    return this.hasAttribute("scenery") ? Math.round(Math.min(MOST_TREES, Number(this.getAttribute("forest")) || 0)) : 0;
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
    const plays = !this.paused && !this.#still;
    if (plays) this.#seconds += passed * (Number(this.getAttribute("speed")) || 1);
    const { controls, camera, pixels } = this.#stage;
    controls.update();
    if (this.#grove) {
      this.#dirty ||= plays || this.#grove.forests.some(({ fading }) => fading);
      this.#grove.update(camera, pixels, this.#seconds);
    } else motion.update(camera, pixels, root).setTime(this.#seconds);
    if (!this.#dirty) return;
    this.#dirty = false;
    if (plays) this.#stage.took(1000 * passed);
    this.#stage.breeze(this.#seconds, BREEZE, 0);
    this.#stage.render();
    this.#canvas.classList.add("drawn");
  }
}

if (globalThis.customElements && !customElements.get(ATHViewerElement.tag)) customElements.define(ATHViewerElement.tag, ATHViewerElement);
