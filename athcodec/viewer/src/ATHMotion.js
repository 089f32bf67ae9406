// The motion of one loaded plant: what time and level it shows, what of it is here, and how it gets into a material.
// Decoding is the worker's; this holds the textures that the vertex shaders read.

import { Box3, DataTexture, EventDispatcher, FloatType, MathUtils, NearestFilter, RGBAFormat, Sphere,
  Vector3 } from "three";

import { Followed, setRest, setValues } from "./geometry.js";
import { injectMotion, motionUniforms, shadowMaterials } from "./shader.js";
import { WIDTH } from "./texels.js";

const centre = new Vector3(), scale = new Vector3();

export function dataTexture(data) {
  const texture = new DataTexture(data, WIDTH, data.length / 4 / WIDTH, RGBAFormat, FloatType);
  texture.magFilter = texture.minFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

/** Seconds of a clip and of the way from its last frame back to the first, whether it is marked as a loop or not. */
export function roundOf({ lastTime, frameCount }) {
  return frameCount > 1 ? lastTime + lastTime / (frameCount - 1) : 0;
}

const CLOSED = { message: "ath: got a request after dispose(), expected none", codeName: "CLOSED" };

/** The error of a message of the worker. */
export const failureOf = ({ message, codeName }) =>
  Object.assign(new Error(message ?? "MISSING: bytes are still to come"), { codeName: codeName ?? "MISSING" });

const FRAME_MS = 33; // between pictures of a fade that nobody asks for

/** Returns the share of the next level when `passed` of a fade's time has gone: it begins and ends at rest. */
export function eased(passed) {
  return passed < 1 ? passed * passed * (3 - 2 * passed) : 1;
}

const SHAPES = 0x13, REFINED_REST = 0x15; // chunks that serve all segments

/** Events: "frame" (a new picture is shown), "level" (another level is), "clip" (another clip is), "progress" (bytes
 * came), "ready" (what can be shown changed), "stopped", "damaged" and "error" (with `message`: what is here goes on playing). */
export class ATHMotion extends EventDispatcher {
  clip;               // The clip that plays, one of `clips`.
  time = 0;           // seconds, as asked for
  start = 0;          // the time of the clip's first frame
  wrap;               // "marked", "clamp", "loop", "pingpong"
  frame = 0;          // Frame of the picture that is shown; -1: none yet.
  level = -1;
  held = false;
  automatic = true;
  target = 0;         // the level that is asked for
  pixels = 1;         // error on the screen that automatic level allows
  measure = "p99";    // which error
  fade = 0.2;         // seconds that a change of the level takes; 0: none
  fading = false;     // whether one is under way
  heat = false;       // whether pictures come with `distances`
  distances = null;   // per vertex, from the deepest position that is here
  mode = "matrices";
  milliseconds = 0;   // Time that the worker took for the last picture.
  uniforms = motionUniforms();

  #channel;
  #id;
  #geometries = new Set();
  #known = null;          // Channel's `known` of the level that is shown.
  #moved = null;          // all vertices of the picture that is shown, once somebody asks for them
  #bounds = new Box3();   // Bounds of that picture.
  #shadows = null;
  #textures = new Map();
  #spare = null;
  #asked = null;          // Key of the last request to the worker, "" while it is at work.
  #pending = false;
  #stale = false;
  #timer = 0;
  #old = null;            // the clip before, as long as it is shown: {clip, seconds, wrap, at, fade, passed, begun}
  #wind = null;           // [strength, heading] of the clips that are blended
  #answers = new Map();
  #next = 1;

  constructor(channel, id, clip) {
    super();
    this.#channel = channel;
    this.#id = id;
    this.clip = clip;
    this.target = channel.info.levelCount - 1;
    this.wrap = this.usualWrap;
    channel.views.set(id, this);
  }

  // ---- what there is ----

  get info() {
    return this.#channel.info;
  }

  get clips() {
    return this.#channel.clips;
  }

  /** A file that marks no clip as a loop says nothing of how they are played. */
  get usualWrap() {
    return this.clips.some(({ loop }) => loop) ? "marked" : "loop";
  }

  /** Whether the clip's first frame follows its last. */
  get loops() {
    return this.wrap === "loop" || (this.wrap === "marked" && this.clip.loop);
  }

  /** Seconds until the clip repeats or, where it does not, ends. */
  get duration() {
    if (this.loops) return roundOf(this.clip);
    return this.clip.lastTime * (this.wrap === "pingpong" ? 2 : 1);
  }

  /** Whether the clip before is still shown: "waiting" for the one that plays, "fading" into it, else null. */
  get switching() {
    return this.#old && (this.#old.begun ? "fading" : "waiting");
  }

  get levelCount() {
    return this.info.levelCount;
  }

  /** Describes a level for people. */
  levelName(level) {
    return this.info.levelNames[level];
  }

  /** The last of the events "stopped" and "damaged", null where there was none. */
  get failure() {
    return this.#channel.failure;
  }

  get bytesFetched() {
    return this.#channel.state.fetched;
  }

  get bytesTotal() {
    return this.info.fileLength;
  }

  get requests() {
    return this.#channel.state.requests;
  }

  /** Bytes of the clip's motion up to a level. */
  motionBytes(level) {
    const { firstSegment, segmentCount } = this.clip;
    const needed = this.#channel.chunks.filter((chunk) => chunk.level <= level
      && ([SHAPES, REFINED_REST].includes(chunk.kind) || (chunk.segment >= firstSegment && chunk.segment < firstSegment + segmentCount)));
    return needed.reduce((sum, { length }) => sum + length, 0);
  }

  /** Bits per second of motion at a level. */
  bitRate(level = Math.max(this.level, 0)) {
    return this.clip.duration > 0 ? 8 * this.motionBytes(level) / this.clip.duration : 0;
  }

  /** Errors of a level in the clip: {max, p99, rms}. */
  error(level) {
    return this.clip.errors[level];
  }

  /** How far off the step from a loop's last frame to its first is at a level, at most; 0 where the clip is none. */
  seamError(level) {
    return this.clip.seams[level];
  }

  /** The parts of the clip that can be shown at `level`, in seconds from its first frame: [{start, end}]. */
  ready(level) {
    const { times, segments } = this.#channel, { firstFrame, frameCount, firstSegment } = this.clip, spans = [];
    const last = firstFrame + frameCount - 1;
    const at = (segment) => times[Math.min(segments[segment], last)] - times[firstFrame];
    this.readyLevels.forEach((ready, i) => {
      if (ready < level) return;
      const start = at(firstSegment + i), end = at(firstSegment + i + 1);
      if (spans.at(-1)?.end === start) spans.at(-1).end = end;
      else spans.push({ start, end });
    });
    return spans;
  }

  /** The deepest level that each segment of the clip can be shown at; -1: none. */
  get readyLevels() {
    const { firstSegment, segmentCount } = this.clip;
    return this.#channel.state.ready.subarray(firstSegment, firstSegment + segmentCount);
  }

  /** The deepest level that every part of the clip can be shown at; -1: none. */
  get readyLevel() {
    return Math.min(...this.readyLevels);
  }

  get complete() {
    return this.readyLevel === this.levelCount - 1;
  }

  // ---- what is shown ----

  /** Shows the clip at `seconds`, as soon as the worker has it. */
  setTime(seconds) {
    const passed = Math.max(0, seconds - this.time), old = this.#old;
    this.time = seconds;
    if (old) {
      old.seconds += passed;
      if (old.begun) old.passed += passed;
      this.#endFade();
    }
    this.#ask();
    return this;
  }

  /** Plays another clip, its number or name. See index.d.ts. */
  play(clip, { fade = 0, at = 0 } = {}) {
    const next = this.clips.find(({ index, name }) => clip === index || clip === name);
    if (!next) throw new RangeError(`clip: got ${clip}, expected one of ${this.clips.map(({ name }) => name).join(", ")}`);
    this.#wind = null;
    if (this.level >= 0) this.#old = { ...this.#mostlyShown(), at, fade, passed: 0, begun: false };
    Object.assign(this, { clip: next, start: this.time - at });
    this.#ask();
    return this;
  }

  /** Blends clips for a wind. See index.d.ts. */
  wind(strength, heading = 0) {
    if (![strength, heading].every(Number.isFinite)) throw new RangeError(`wind: got ${strength} and ${heading}, expected two finite numbers`);
    this.#wind = [strength, heading];
    this.#old = null;
    this.#ask();
    return this;
  }

  #mostlyShown() {
    const old = this.#old;
    return old && (!old.begun || 2 * old.passed < old.fade) ? old : this.#place(this.time);
  }

  #endFade() {
    if (this.#old.begun && this.#old.passed >= this.#old.fade) this.#old = null;
  }

  /** A level from 0 on, or "auto": update() then chooses it by the error on the screen. */
  setLevel(level) {
    this.automatic = level === "auto";
    if (!this.automatic) this.target = MathUtils.clamp(level, 0, this.levelCount - 1);
    this.#ask();
    return this;
  }

  /** "matrices" (default): the vertex shader moves the vertices. "positions": the worker does, and every picture
   * writes the position attributes, for materials that injectMotion() cannot change. Before any bind(); a WebGPURenderer that draws
   * the object goes over to it. */
  setMode(mode) {
    this.mode = mode;
    return this;
  }

  /** The coarsest level whose error by `measure` is at most `pixels` on a screen `height` pixels high. */
  levelFor(camera, height, matrixWorld = null, pixels = this.pixels) {
    const perUnit = this.#pixelsPerUnit(camera, height, matrixWorld);
    for (let level = 0; level < this.levelCount; level++)
      if (this.error(level)[this.measure] * perUnit <= pixels) return level;
    return this.levelCount - 1;
  }

  /** How many pixels the error of a level by `measure` is there. */
  pixelError(level, camera, height, matrixWorld = null) {
    return this.error(level)[this.measure] * this.#pixelsPerUnit(camera, height, matrixWorld);
  }

  // Where the plant is nearest.
  #pixelsPerUnit(camera, height, matrixWorld) {
    const sphere = this.#channel.sphere;
    centre.copy(sphere.center);
    let size = 1;
    if (matrixWorld) {
      centre.applyMatrix4(matrixWorld);
      size = matrixWorld.getMaxScaleOnAxis();
    }
    if (camera.isOrthographicCamera) return size * height * camera.zoom / (camera.top - camera.bottom);
    const distance = Math.max(centre.distanceTo(scale.setFromMatrixPosition(camera.matrixWorld)) - sphere.radius * size, 1e-9);
    return size * height / (2 * Math.tan(MathUtils.degToRad(camera.fov) / 2) / camera.zoom * distance);
  }

  /** Automatic level for a camera; once per frame, before setTime(). */
  update(camera, height, object = null) {
    if (this.automatic) this.target = this.levelFor(camera, height, object?.matrixWorld ?? null);
    return this;
  }

  /** The clip at `seconds` and `level`, decoded there and then: resolves when it is shown. Rejects where bytes of it
   * are missing. */
  show(seconds, level = this.target) {
    return this.#exactly(seconds, { level, heat: this.heat, positions: this.mode === "positions" });
  }

  /** All vertices at `seconds` and `level` in source order, 3 numbers each, whatever is shown. */
  async positions(seconds, level = this.target) {
    const picture = await this.#exactly(seconds, { level, positions: true, aside: true });
    return picture.data;
  }

  #exactly(seconds, message) {
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      if (!this.#channel.views.has(this.#id)) throw failureOf(CLOSED);
      this.#answers.set(id, { resolve, reject, aside: message.aside });
      this.#channel.send({ type: "picture", view: this.#id, id, exactly: true, ...this.#place(seconds), wind: this.#wind, ...message });
    });
  }

  #place(seconds) {
    return { clip: this.clip.index, seconds: seconds - this.start, wrap: this.wrap };
  }

  // One request at a time; the newest wishes go with the next.
  #ask() {
    const old = this.#old, waits = this.switching === "waiting";
    const { clip, seconds, wrap } = this.#place(waits ? this.start + old.at : this.time);
    const fading = old && { clip: old.clip, seconds: old.seconds, wrap: old.wrap, begun: old.begun,
      share: old.fade > 0 ? 1 - old.passed / old.fade : 0 };
    const wish = `${clip} ${seconds} ${wrap} ${this.target} ${this.heat} ${JSON.stringify([fading, this.#wind])}`;
    if (this.#pending) {
      this.#stale = wish !== this.#asked;
      return;
    }
    if (wish === this.#asked && !this.#stale && !this.fading) return;
    this.#asked = wish;
    this.#stale = false;
    this.#pending = true;
    const buffer = this.#spare;
    this.#spare = null;
    this.#channel.send({
      type: "picture", view: this.#id, id: 0, clip, seconds, wrap, old: fading, wind: this.#wind, level: this.target, heat: this.heat,
      positions: this.mode === "positions", buffer, now: performance.now(), fade: this.fade,
      coarsely: this.#channel.easing,
    }, buffer ? [buffer] : []);
  }

  /** Asks again for what is shown: there may be a deeper picture now. */
  refresh() {
    this.#asked = null;
    this.#ask();
  }

  /** A picture of the worker: data is a texture (see texels.js) or, in mode "positions", all vertices. */
  picture(message) {
    const answer = this.#answers.get(message.id), { shown, codeName } = message;
    this.#answers.delete(message.id);
    if (!answer) this.#pending = false;
    if (shown < 0) answer?.reject(failureOf(message));
    else if (!answer?.aside) this.#take(message);
    if (shown >= 0) answer?.resolve(message);
    if (!answer && message.message) this.dispatchEvent({ type: "error", message: message.message, codeName });
    if (!answer && this.#stale) this.#ask();
  }

  /** A listener that throws keeps nothing else from being told or shown. */
  dispatchEvent(event) {
    try {
      super.dispatchEvent(event);
    } catch (error) {
      queueMicrotask(() => { throw error; });
    }
  }

  #take({ shown, cut: of = shown, frame, data, heat, ms, held, clip, exactly, fading, whole }) {
    const changed = shown !== this.level, known = this.#channel.known.get(of), cut = known !== this.#known;
    Object.assign(this, { frame, held, fading, milliseconds: ms, distances: heat ?? null, level: shown });
    this.#known = known;
    if (shown > 0) this.#channel.endEasing();
    clearTimeout(this.#timer);
    if (fading) this.#timer = setTimeout(() => this.refresh(), FRAME_MS); // time may stand still
    this.#moved = whole ? data : null;
    if (!whole) this.#upload(of, data);
    this.#setBounds(data);
    if (this.mode === "positions") this.#write(this.uploaded());
    if (cut) for (const geometry of this.#geometries) this.#setParts(geometry);
    if (changed) this.dispatchEvent({ type: "level", level: shown });
    if (this.switching === "waiting" && clip === this.clip.index) this.#begin(this.#old);
    if (exactly) this.#old = null;
    this.dispatchEvent({ type: "frame", frame, level: shown });
  }

  // The clip that plays is seen for the first time.
  #begin(old) {
    old.begun = true;
    this.start = this.time - old.at;
    this.#endFade();
    this.dispatchEvent({ type: "clip", clip: this.clip });
  }

  #upload(level, data) {
    const old = this.#textures.get(level);
    if (old && old.image.data.length === data.length) {
      this.#spare = old.image.data.buffer;
      old.image.data = data;
      old.needsUpdate = true;
    } else {
      old?.dispose();
      this.#textures.set(level, dataTexture(data));
    }
    const { texels, parts: { nodeCount, exactCount } } = this.#known;
    this.uniforms.athData.value = this.#textures.get(level);
    this.uniforms.athStride.value = exactCount > 0 ? (texels - 3 * nodeCount) / exactCount : 1;
  }

  #write(data) {
    for (const geometry of this.#geometries) {
      const { source } = geometry.userData, { position, normal } = geometry.attributes;
      for (let i = 0; i < source.length; i++)
        for (let k = 0; k < 3; k++) position.array[3 * i + k] = data[3 * source[i] + k];
      position.needsUpdate = true;
      if (normal) geometry.computeVertexNormals();
    }
  }

  // The box of the picture: of the exact vertices, and of what nodes make of the boxes of their parts.
  #setBounds(data) {
    const { min, max } = this.#bounds.makeEmpty(), { boxes } = this.#known, low = [...min], high = [...max];
    const add = (k, a, b) => {
      if (a < low[k]) low[k] = a;
      if (b > high[k]) high[k] = b;
    };
    const points = (from, to, step) => { for (let at = from; at < to; at += step) for (let k = 0; k < 3; k++) add(k, data[at + k], data[at + k]); };
    if (this.#moved) points(0, data.length, 3);
    else {
      const { parts: { nodeCount, exactCount } } = this.#known, stride = 4 * this.uniforms.athStride.value;
      points(12 * nodeCount, 12 * nodeCount + stride * exactCount, stride);
      for (const [at, x, y, z, u, v, w] of boxes) // Each box is its middle and half its size.
        for (let k = 0; k < 3; k++) {
          const [a, b, c, d] = data.subarray(at + 4 * k, at + 4 * k + 4), middle = a * x + b * y + c * z + d;
          const half = Math.abs(a) * u + Math.abs(b) * v + Math.abs(c) * w;
          add(k, middle - half, middle + half);
        }
    }
    min.fromArray(low);
    max.fromArray(high);
    for (const geometry of this.#geometries) this.#setBox(geometry);
  }

  #setBox(geometry) {
    geometry.boundingBox = (geometry.boundingBox ?? new Box3()).copy(this.#bounds);
    geometry.boundingSphere = this.#bounds.getBoundingSphere(geometry.boundingSphere ?? new Sphere());
  }

  /** The vertices of the picture that is shown, 3 numbers each, in source order: what the shader makes of the texture; null
   * where none is shown yet. */
  uploaded() {
    if (this.#moved || !this.uniforms.athData.value) return this.#moved;
    const { data } = this.uniforms.athData.value.image, { rest } = this.#channel, { vertices } = this.#known;
    const out = this.#moved = new Float32Array(rest.length);
    for (let vertex = 0, i = 0; vertex < vertices.length; vertex++) {
      const part = vertices[vertex], x = rest[i], y = rest[i + 1], z = rest[i + 2];
      for (let at = 4 * (Math.abs(part) - 1), k = 0; k < 3; k++, i++, at += part < 0 ? 1 : 4)
        out[i] = part < 0 ? data[at] : data[at] * x + data[at + 1] * y + data[at + 2] * z + data[at + 3];
    }
    return out;
  }

  // ---- materials and geometries ----

  /** Lets a material draw this motion. In mode "positions" any material does. */
  bind(material) {
    return this.mode === "positions" ? material : injectMotion(material, this.uniforms);
  }

  /** Lets shadows of an object move as it does. */
  bindShadows(object) {
    if (this.mode === "positions") return object;
    const { clone } = Object.getPrototypeOf(object); // which leaves out what is added here
    return Object.assign(object, this.#shadows ??= shadowMaterials(this.uniforms), {
      onBeforeRender: this.#forNodes, clone: (...words) => this.bindShadows(clone.apply(object, words)),
    });
  }

  // Node renderers pass over what bind() does to a material: there the worker moves the vertices.
  #forNodes = ({ isWebGPURenderer }) => {
    if (!isWebGPURenderer || this.mode === "positions") return;
    this.setMode("positions");
    if (this.level >= 0) this.#write(this.uploaded());
  };

  /** Keeps a geometry made by the loader (`userData.source`) in step with what is shown: its vertices, and what boxes and rays
   * find of them. */
  attach(geometry) {
    const { source, other } = geometry.userData, position = geometry.getAttribute("position");
    if (this.mode !== "positions" && !other)
      geometry.setAttribute("position", new Followed(position.array, 3).follow(source, () => this.uploaded()));
    if (this.level < 0) this.#bounds.copy(this.#channel.box);
    this.#geometries.add(geometry);
    this.#setBox(geometry);
    this.#setParts(geometry);
    return geometry;
  }

  /** Puts the rest pose into the geometries again. */
  setRest() {
    if (this.mode === "positions") return;
    for (const geometry of this.#geometries) setRest(geometry, this.#channel.rest);
    this.#moved = null;
    const texture = this.uniforms.athData.value; // After a change of the mode there is none until the next picture.
    if (texture) this.#setBounds(texture.image.data);
  }

  detach(geometry) {
    this.#geometries.delete(geometry);
  }

  #setParts(geometry) {
    if (this.mode === "positions") return;
    const { source, other } = geometry.userData;
    this.#setPart(geometry, "athPart", source);
    if (other) this.#setPart(geometry, "athPartOther", other); // Part of the far end, where a vertex draws a line's side.
  }

  #setPart(geometry, name, source) {
    const array = geometry.getAttribute(name)?.array ?? new Float32Array(source.length), parts = this.#known?.vertices;
    if (parts) for (let i = 0; i < source.length; i++) array[i] = parts[source[i]];
    setValues(geometry, name, array, 1);
  }

  /** Per vertex in source order, the branch (file order) whose node moves it at a level; its own where it moves alone. */
  async nodeNumbers(level = this.level) {
    return this.#channel.nodeNumbers(await this.#channel.parts(level));
  }

  /** A second view of the same file, with a clip, a time and a level of its own. */
  clone() {
    return this.#channel.view(this.clip);
  }

  dispose() {
    clearTimeout(this.#timer);
    for (const texture of this.#textures.values()) texture.dispose();
    for (const material of Object.values(this.#shadows ?? {})) material.dispose();
    this.#textures.clear();
    this.#channel.dropView(this.#id);
    this.fail(failureOf(CLOSED));
  }

  /** No more answers come. */
  fail(error) {
    for (const { reject } of this.#answers.values()) reject(error);
    this.#answers.clear();
  }
}

/** The box of the rest pose, and the sphere about it. */
export function restBounds(rest) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < rest.length; i += 3) {
    for (let k = 0; k < 3; k++) {
      if (rest[i + k] < low[k]) low[k] = rest[i + k];
      if (rest[i + k] > high[k]) high[k] = rest[i + k];
    }
  }
  const box = new Box3(new Vector3(...low), new Vector3(...high));
  return { box, sphere: box.getBoundingSphere(new Sphere()) };
}
