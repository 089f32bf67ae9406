// The stage: renderer, camera and light, and one or two panes, each with its own scene; two share the view, on either side of a split.

import { ACESFilmicToneMapping, Box3, DirectionalLight, Fog, HemisphereLight, NoToneMapping, PerspectiveCamera, Scene, Vector3 } from "three";

import { Easel } from "./easel.js";
import { blow, meadow, thin, tintMeadow } from "./ground.js";
import { layShadow, shadowDisc } from "./shadow.js";
import { discard } from "./sky.js";

const TONE = { toneMapping: ACESFilmicToneMapping, toneMappingExposure: 0.82 }, PLAIN = { toneMapping: NoToneMapping };
const SLOW_MS = 20, PATIENCE = 24; // pictures that are slow, one behind the other, before there is less to draw
const SHADED = 12; // plants, across a forest
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i;
const QUALITY = [{ ratio: 2, shadows: true, grass: 1 }, { ratio: 1.25, shadows: true, grass: 1 }, { ratio: 1, shadows: false, grass: 0.2 }]; // grass: share of the blades
const EYE = 0.14, EYE_WIDE = 0.2; // Height of the eye over the ground, in heights of the plant or in its widths, whichever is more: the crown stands
// against the sky, and of a low wide plant the ground under it is seen.
const TALL = 0.7, WIDE = 1.02; // Size of the plant in the free part of the picture.
const FROM = new Vector3(0.35, 0, 0.92).normalize();
const LEAST_ROOM = 60; // CSS pixels beside the cards; where there are fewer, the plant stands behind them
const HAZE_FROM = 0.4, HAZE_TO = 4.5; // Distances where the ground begins and ends to fade, in sizes of the ground.

// Whether there is no graphics processor, so that each picture takes long.
function isSoftware(gl) {
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  return SOFTWARE.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

export class Stage {
  panes = [];

  split = 0.5; // share of the picture that is the left one of two panes

  less = 0; // how many of QUALITY are passed over
  steady = new URLSearchParams(location.search).get("quality") === "full";

  slow = 0; // pictures, one behind the other

  moved = false; // by hand, since the whole was last in view

  cards = [];

  shape = 1; // Width of what is looked at, over its height.

  #toned = null;

  #sized = new ResizeObserver(() => this.fit());

  /** easel: what draws it, by default one on the canvas itself. scenery: sky, meadow and shadows, or light alone. */
  constructor(canvas, changed, resized, easel = new Easel(canvas), scenery = true) {
    Object.assign(this, { canvas, easel, scenery, sky: easel.sky, tone: scenery ? TONE : PLAIN });
    Object.assign(this.renderer, this.tone);
    easel.stages.add(this);
    this.steady ||= !scenery;
    if (!this.steady && isSoftware(this.renderer.getContext())) this.less = QUALITY.length - 1;
    this.camera = new PerspectiveCamera(38, 1, 0.01, 1000);
    this.controls = { target: new Vector3(), maxDistance: Infinity, update: () => this.camera.lookAt(this.controls.target), dispose() {} };
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.#toned = () => {
      this.#tint();
      changed();
    };
    this.dark.addEventListener("change", this.#toned);
    this.changed = changed;
    this.resized = resized;
    this.#sized.observe(canvas.parentElement);
    this.#resize();
  }

  /** Lets the view be turned by hand from now on. */
  steer(OrbitControls) {
    const { target, maxDistance } = this.controls, controls = this.controls = new OrbitControls(this.camera, this.canvas);
    controls.target.copy(target);
    Object.assign(controls, { maxDistance, enableDamping: true, dampingFactor: 0.12 }).update();
    controls.addEventListener("change", this.changed);
    controls.addEventListener("start", () => { this.moved = true; });
  }

  dispose() {
    this.#sized.disconnect();
    this.dark.removeEventListener("change", this.#toned);
    this.controls.dispose();
    this.setPanes([]);
    this.easel.leave(this);
  }

  get renderer() {
    return this.easel.renderer;
  }

  /** After a context was lost, what had been drawn for later has to be drawn again. */
  restore() {
    this.#tint();
    this.changed();
  }

  /** Takes the size that the page leaves. */
  fit() {
    if (!this.#resize()) return;
    this.resized();
    this.changed();
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const ratio = Math.min(devicePixelRatio, this.quality.ratio), room = this.#free(width, height);
    if (String([width, height, ratio, room]) === String([this.width, this.height, this.ratio, this.room])) return false;
    if (width !== this.width || height !== this.height || ratio !== this.ratio)
      Object.assign(this.canvas, { width: Math.floor(width * ratio), height: Math.floor(height * ratio) });
    Object.assign(this, { width, height, ratio, room });
    const { style } = this.canvas.parentElement, insets = { left: room[0], top: room[1], right: width - room[2], bottom: height - room[3] };
    for (const [side, inset] of Object.entries(insets)) style.setProperty(`--${side}`, `${inset}px`);
    return true;
  }

  // The part of the picture beside the cards where the plant is largest, [left, top, right, bottom]: each card takes all that lies on one side of it.
  #free(width, height) {
    const { x, y } = this.canvas.parentElement.getBoundingClientRect(), value = ([l, t, r, b]) => Math.min(TALL * (b - t), (WIDE * (r - l)) / this.shape) + 0.01 * (r - l);
    let rooms = [[0, 0, width, height]];
    for (const card of this.cards.filter((each) => each.checkVisibility({ visibilityProperty: true }))) {
      const rect = card.getBoundingClientRect(), [left, right] = card === this.follower ? [0, width] : [rect.left - x, rect.right - x], [top, bottom] = [rect.top - y, rect.bottom - y];
      rooms = rooms.flatMap(([l, t, r, b]) => (left >= r || right <= l || top >= b || bottom <= t ? [[l, t, r, b]]
        : [[l, t, left, b], [right, t, r, b], [l, t, r, top], [l, bottom, r, b]]));
    }
    const best = rooms.reduce((one, other) => (value(other) > value(one) ? other : one), [0, 0, 0, 0]);
    return Math.min(best[2] - best[0], best[3] - best[1]) < LEAST_ROOM ? [0, 0, width, height] : best;
  }

  /** Elements that lie over the picture: what is looked at keeps clear of them. `follower`: the one that stands below what is looked at, and would flee from a plant beside it. */
  keepClear(cards, follower) {
    Object.assign(this, { cards: [...cards], follower });
    for (const card of cards) this.#sized.observe(card);
  }

  /** Has what plants are drawn with compiled before there are any; nothing waits for it. */
  warm(objects) {
    this.kept = this.scene(objects); // programs live as long as a material that uses them
    this.renderer.compile(this.kept, this.camera);
  }

  /** Resolves once all is compiled that these objects are drawn with; the page answers in the meantime, where the browser can do so. */
  async compile(objects) {
    const scene = this.scene(objects);
    if (this.renderer.extensions.has("KHR_parallel_shader_compile")) await this.renderer.compileAsync(scene, this.camera);
    else this.renderer.compile(scene, this.camera);
    scene.remove(...objects);
    discard(scene);
  }

  /** A pane's scene; `content` is added to it. */
  scene(content) {
    const scene = new Scene(), plain = new DirectionalLight(0xfff2dd, 2.4);
    plain.position.set(0.6, 1, 0.7);
    if (!this.scenery) return scene.add(new HemisphereLight(0xeaf2ff, 0x8a8371, 1.9), plain, ...content);
    scene.add(meadow(), shadowDisc(), ...content);
    scene.fog = new Fog(this.sky.haze, 1, 2);
    this.#tint([scene]);
    return scene;
  }

  #tint(scenes = this.panes.map(({ scene }) => scene)) {
    if (!this.scenery) return;
    this.sky.dark = this.dark.matches;
    for (const scene of scenes) {
      this.sky.light(scene);
      tintMeadow(scene.getObjectByName("ground"), this.sky.dark);
      scene.fog.color.copy(this.sky.haze);
    }
    this.#draw(scenes);
  }

  /** Returns the part of QUALITY that there is time for. */
  get quality() {
    return QUALITY[this.less];
  }

  // Shadows and blades, as far as there is time for them.
  #draw(scenes = this.panes.map(({ scene }) => scene)) {
    for (const scene of scenes) {
      scene.getObjectByName("sun").castShadow = this.quality.shadows;
      thin(scene.getObjectByName("ground"), this.quality.grass);
    }
  }

  /** Milliseconds since the picture before, while one follows the other. */
  took(ms) {
    this.slow = ms > SLOW_MS ? this.slow + 1 : 0;
    if (this.steady || this.slow < PATIENCE || this.less >= QUALITY.length - 1) return;
    this.slow = 0;
    this.less++;
    this.#draw();
    this.#resize();
    this.changed();
  }

  setPanes(panes) {
    for (const { scene } of this.panes) for (const name of ["ground", "sky", "under"]) discard(scene.getObjectByName(name));
    this.panes = panes;
    this.#tint();
    this.changed();
  }

  /** The whole of a box (in the world) in view, from any side; `ground`: its height and size. */
  look(box, ground) {
    const { x, y, z } = box.getSize(new Vector3());
    this.shape = Math.max(0.1, Math.hypot(x * FROM.z, z * FROM.x) / Math.max(y, 1e-6));
    this.#resize();
    const distance = this.#placeEye(box);
    this.camera.near = distance / 500;
    this.camera.far = distance * 60;
    this.controls.maxDistance = distance * 20;
    this.placeGround(ground.height, ground.size, ground.plant);
    this.controls.update();
    this.changed();
  }

  // As near as the plant has its share of the free part of the picture; the tips of a crown are in its middle, its sides at half its height.
  #placeEye(box) {
    const { camera, controls: { target } } = this, [left, top, right, bottom] = this.room, size = box.getSize(new Vector3());
    const half = Math.tan(camera.fov * Math.PI / 360), across = 0.5 * Math.max(Math.hypot(size.x * FROM.z, size.z * FROM.x), 1e-6);
    box.getCenter(target);
    const eye = box.min.y + Math.max(EYE * size.y, EYE_WIDE * 2 * across) - target.y, view = new Vector3(), seen = (distance) => {
      view.copy(FROM).multiplyScalar(distance).setY(eye).normalize(); // towards the eye
      const tips = [0.5, -0.5].map((part) => (part * size.y * Math.hypot(view.x, view.z)) / (Math.hypot(distance, eye) - part * size.y * view.y));
      return Math.max((tips[0] - tips[1]) / (2 * half * TALL), across / ((distance - 0.3 * across) * half * WIDE * (right - left) / (bottom - top)));
    };
    let near = 0.55 * Math.max(size.y, across, 1e-6), far = 100 * near;
    for (let i = 0; i < 40; i++) {
      const middle = Math.sqrt(near * far);
      if (seen(middle) > 1) near = middle;
      else far = middle;
    }
    camera.position.copy(target).addScaledVector(FROM, far).setY(target.y + eye);
    return far;
  }

  /** Returns the near part of a forest that reaches so far; box: the box of one plant. */
  lookOver(box, reach) {
    const size = box.getSize(new Vector3()), most = Math.max(size.x, size.y, size.z), far = Math.max(reach, most), near = Math.min(far, 1.7 * most);
    const part = new Box3(new Vector3(-near, box.min.y, -near), new Vector3(near, box.max.y, near));
    this.look(part, { height: box.min.y, size: 2.6 * far, plant: 1.9 * most });
    this.controls.maxDistance = 6 * far;
    this.camera.far = 12 * far + 20 * most;
    this.fog(this.camera.position.distanceTo(this.controls.target) * 0.7, 7 * far + 12 * most);
  }

  /** size: of all that stands on it; plant: of a single plant, which the blades of grass are as large as. */
  placeGround(height, size, plant = size) {
    if (!this.scenery) return;
    for (const { scene, foot = null } of this.panes) {
      const ground = scene.getObjectByName("ground");
      layShadow(scene.getObjectByName("under"), size === plant ? foot : null, size, this.quality.shadows);
      ground.position.y = height;
      ground.scale.setScalar(size);
      ground.getObjectByName("grass").scale.setScalar(Math.sqrt(plant / size));
      const wide = Math.min(size, SHADED * plant); // Size of the part that has shadows.
      this.sky.shade(scene, new Vector3(0, height + 0.25 * wide, 0), 0.75 * wide);
    }
    this.fog(0, 0);
  }

  /** Haze from one distance to another; where both are 0 only the ground far off is in it. */
  fog(near, far) {
    for (const { scene } of this.panes) {
      const size = scene.getObjectByName("ground").scale.x, [from, to] = far > 0 ? [near, far] : [HAZE_FROM * size, HAZE_TO * size];
      scene.fog = new Fog(this.sky.haze, from, to);
    }
  }

  /** The wind in the grass: seconds that passed, strength from 0 to 1, heading in degrees. */
  breeze(seconds, strength, heading) {
    if (this.scenery) for (const { scene } of this.panes) blow(scene.getObjectByName("ground"), seconds, strength, heading);
  }

  /** Height of what is looked at in pixels of the device. */
  get pixels() {
    return (this.room[3] - this.room[1]) * this.ratio;
  }

  // The part behind the cards is drawn too, and counts for nothing else.
  render() {
    this.easel.draw(this.canvas, this.scenery, this.tone, (renderer) => this.#paint(renderer));
  }

  #paint(renderer) {
    const { camera, canvas, panes, width, height, ratio, room: [left, top, right, bottom] } = this, middle = ratio * (left + this.split * (right - left));
    camera.aspect = (right - left) / (bottom - top);
    camera.setViewOffset(right - left, bottom - top, -left, -top, width, height);
    camera.updateMatrixWorld();
    renderer.setScissorTest(panes.length > 1);
    for (const { scene } of panes) {
      const dome = scene.getObjectByName("dome");
      dome?.position.copy(camera.position);
      dome?.scale.setScalar(camera.far * 0.5);
    }
    panes.forEach(({ scene, before }, i) => {
      before?.(canvas.width, canvas.height);
      if (panes.length > 1) renderer.setScissor(i * middle, 0, i === 0 ? middle : canvas.width - middle, canvas.height);
      renderer.render(scene, camera);
    });
  }
}
