// Loads .ath files for three.js: a Loader with the conventions of DRACOLoader and KTX2Loader. The decoder is in
// ath_worker.js, beside this module.

import { Box3, Group, LineBasicMaterial, LineSegments, Loader, Mesh, MeshStandardMaterial, EventDispatcher, DoubleSide,
  LoaderUtils, Object3D, Vector3 } from "three";

import { ATHMotion, eased, failureOf, restBounds } from "./ATHMotion.js";
import { addAttributes, atOrigin, lineGeometry, meshGeometry, polygonsOf } from "./geometry.js";
import { Presence } from "./presence.js";

const EASING_MS = 16; // between two steps of the rest pose

let files = 0;

// The positions of a mesh, three numbers per vertex.
function numbersOf(mesh) {
  if (mesh === null || (mesh instanceof Float32Array && mesh.length % 3 === 0)) return mesh;
  const position = mesh?.isBufferGeometry ? mesh.getAttribute("position") : null;
  if (!position) throw new TypeError("mesh: got something else, expected three numbers per vertex or a BufferGeometry");
  return Float32Array.from({ length: 3 * position.count }, (_, i) => position.getComponent(Math.floor(i / 3), i % 3));
}

// A copy of the bytes of a buffer or of a view of one, which may be shared.
function bytesOf(data) {
  if (ArrayBuffer.isView(data)) return new Uint8Array(data.buffer, data.byteOffset, data.byteLength).slice();
  if (!/Buffer/.test(Object.prototype.toString.call(data))) throw new TypeError("buffer: got something else, expected an ArrayBuffer or a view of one");
  return new Uint8Array(data).slice();
}

const noWorker = (message) => ({ codeName: "WORKER",
  message: `ath_worker.js: got no worker (${message ?? "not found or not allowed"}), expected it beside the loader or where setDecoderPath() says` });

const aborted = () => failureOf({ message: "loading was aborted", codeName: "AbortError" });

/** A file that is open in a worker: what the page knows of it, and the way there. */
class Channel {
  views = new Map();
  state = { fetched: 0, requests: 0, ready: new Int8Array(1).fill(-1) };
  failure = null;
  sent = 0; // when the worker sent what came last, by the page's clock: the page may have been busy since
  decodedAt = null; // when the first of the motion was
  known = new Map();  // level: {parts, texels, vertices, boxes}
  #asked = new Map(); // Requests under way, by key: {promise, resolve, reject}.
  #nextView = 1;
  #nextWork = 1;
  #toRest = null;     // {to, timer}: the finer rest pose, as long as the one that is shown goes to it

  constructor(worker, release) {
    this.id = ++files;
    this.worker = worker;
    this.release = release;
    this.settle = {};
    for (const name of ["opened", "whole", "arrays"]) {
      this[name] = new Promise((resolve, reject) => { this.settle[name] = { resolve, reject }; });
      this[name].catch(() => {}); // whoever waits gets the error
    }
    worker.channels.set(this.id, this);
  }

  // Promises that are not settled never will be.
  #fail(error) {
    for (const { reject } of [this.settle.opened, this.settle.whole, ...this.#asked.values()]) reject(error);
    this.#asked.clear();
  }

  send(message, transfer = []) {
    this.worker.postMessage({ ...message, file: this.id }, transfer);
  }

  receive(message) {
    const { type } = message;
    this.sent = message.sent - performance.timeOrigin;
    if (type === "opened") {
      Object.assign(this, message, { type: undefined }, restBounds(message.rest));
      this.state.ready = new Int8Array(message.info.segmentCount).fill(-1);
      this.settle.opened.resolve(this);
    } else if (type === "rest") {
      this.#easeRest(message.rest);
    } else if (type === "failed") {
      const error = failureOf(message);
      this.#fail(error);
      for (const view of this.views.values()) view.fail(error);
      this.#failed({ ...message, type: "stopped" });
    } else if (type === "attributes") {
      this.settle.arrays.resolve(message.attributes);
    } else if (type === "state") {
      this.#changed(message);
    } else if (type === "picture") {
      this.views.get(message.view)?.picture(message);
    } else if (type === "parts") {
      this.#learn(message);
    } else if (type === "decoded") {
      this.decodedAt ??= this.sent;
      for (const view of this.views.values()) view.refresh();
    } else if (type === "baked") {
      this.#answer(`bake ${message.id}`, message);
    } else if (type === "gpu" || type === "wind") {
      this.#answer(`${type} ${message.id}`, message);
    } else {
      if (type === "stopped") this.settle.whole.reject(failureOf(message));
      this.#failed(message);
    }
  }

  #failed({ type, level = null, message, codeName }) {
    this.failure = { type, level, message, codeName };
    this.#tell(this.failure); // "stopped", "damaged"
  }

  // vertices: athPart of every vertex, in source order.
  #learn({ level, parts, texels }) {
    const known = { parts, texels, vertices: this.#partOfVertices(parts, texels), boxes: this.#boxes(parts) };
    this.known.set(level, known);
    this.#answer(`parts ${level}`, known);
  }

  // For every node: where its matrix is in a texture, and the middle and half the size of the box of what it moves.
  #boxes({ branch, first, count, index }) {
    const { rest, vertexSource } = this, point = new Vector3(), box = new Box3(), half = new Vector3(), boxes = [];
    for (let part = 0; part < branch.length; part++) {
      if (branch[part] < 0) continue;
      box.makeEmpty();
      for (let i = first[part]; i < first[part] + count[part]; i++) box.expandByPoint(point.fromArray(rest, 3 * vertexSource[i]));
      boxes.push([12 * index[part], ...box.getCenter(point), ...box.getSize(half).multiplyScalar(0.5)]);
    }
    return boxes;
  }

  #changed(message) {
    const ready = message.ready.some((level, segment) => level !== this.state.ready[segment]);
    this.state = message;
    this.#tell({ type: "progress", loaded: message.fetched, total: message.total });
    if (message.whole) this.settle.whole.resolve();
    if (!ready) return;
    this.#tell({ type: "ready" });
    for (const view of this.views.values()) view.refresh();
  }

  /** Whether the rest pose is on its way to the finer one; level 0 moves both, levels above only that. */
  get easing() {
    return this.#toRest !== null;
  }

  // Plants that are shown at level 0 go with it over the time of a fade; without any it happens at once.
  #easeRest(to) {
    const from = this.rest.slice(), start = performance.now();
    const seconds = Math.max(0, ...[...this.views.values()].map(({ level, fade }) => (level === 0 ? fade : 0)));
    const step = () => {
      const weight = eased((performance.now() - start) / 1000 / seconds);
      if (weight === 1) this.endEasing();
      else this.#setRest(to.map((value, i) => from[i] + weight * (value - from[i])));
    };
    this.#toRest = { to, timer: setInterval(step, EASING_MS) };
    step();
  }

  endEasing() {
    if (!this.easing) return;
    const { to, timer } = this.#toRest;
    clearInterval(timer);
    this.#toRest = null;
    this.#setRest(to);
    for (const view of this.views.values()) view.refresh();
  }

  #setRest(rest) {
    this.rest.set(rest);
    const { box, sphere } = restBounds(rest);
    this.box.copy(box);
    this.sphere.copy(sphere);
    for (const known of this.known.values()) known.boxes = this.#boxes(known.parts);
    for (const view of this.views.values()) view.setRest();
  }

  #tell(event) {
    for (const view of this.views.values()) view.dispatchEvent({ ...event });
  }

  /** How a level cuts the plant. */
  async parts(level) {
    return this.known.get(level) ?? this.#ask(`parts ${level}`, { type: "parts", level });
  }

  bake(clip, level, step) {
    const id = this.#nextWork++;
    return this.#ask(`bake ${id}`, { type: "bake", id, clip, level, step });
  }

  /** The GPU form of a level, or of a segment at it: {words, coded}. Rejects where bytes of it are missing or damaged. */
  async gpu(level, segment = null) {
    const id = this.#nextWork++, answer = await this.#ask(`gpu ${id}`, { type: "gpu", id, level, segment });
    if (!answer.words) throw failureOf(answer);
    return answer;
  }

  /** Returns the weight of each clip for a wind: {weights}. */
  windWeights(strength, heading) {
    const id = this.#nextWork++;
    return this.#ask(`wind ${id}`, { type: "wind", id, strength, heading });
  }

  #ask(key, message) {
    if (!this.#asked.has(key)) {
      const asked = {};
      asked.promise = new Promise((resolve, reject) => { Object.assign(asked, { resolve, reject }); });
      this.#asked.set(key, asked);
      this.send(message);
    }
    return this.#asked.get(key).promise;
  }

  #answer(key, message) {
    this.#asked.get(key)?.resolve(message);
    this.#asked.delete(key);
  }

  /** Has all bytes fetched; resolves when they are here. */
  fetchAll() {
    this.send({ type: "all" });
    return this.whole;
  }

  abort() {
    this.settle.opened.reject(aborted());
    this.settle.whole.reject(aborted());
    this.send({ type: "abort" });
  }

  #partOfVertices({ nodeCount, exactCount, branch, first, count, index }, texels) {
    const out = new Float32Array(this.info.placeCount), stride = exactCount > 0 ? (texels - 3 * nodeCount) / exactCount : 1;
    for (let part = 0; part < branch.length; part++)
      for (let i = 0; i < count[part]; i++)
        out[first[part] + i] = branch[part] >= 0 ? 1 + 3 * index[part] : -(1 + 3 * nodeCount + stride * (index[part] + i));
    return this.#ofVertices(out);
  }

  // Numbers of the vertices in source order, by those of their places in file order.
  #ofVertices(numbers) {
    return numbers.constructor.from(this.vertexPlaces, (place) => numbers[place]);
  }

  // The branch that a vertex moves with: that of its node, or its own where its position is exact.
  nodeNumbers({ parts: { branch, first, count } }) {
    const out = this.#branchOfPlaces();
    for (let part = 0; part < branch.length; part++)
      if (branch[part] >= 0) out.fill(branch[part], first[part], first[part] + count[part]);
    return this.#ofVertices(out);
  }

  /** Number (file order) of the branch of every vertex, in source order. */
  get vertexBranch() {
    return this.#ofVertices(this.#branchOfPlaces());
  }

  #branchOfPlaces() {
    const { branches: { first, count } } = this, out = new Int32Array(this.info.placeCount);
    for (let b = 0; b < first.length; b++) out.fill(b, first[b], first[b] + count[b]);
    return out;
  }

  view(clip = this.clips[this.first]) {
    return new ATHMotion(this, this.#nextView++, clip);
  }

  dropView(id) {
    if (this.views.delete(id)) this.send({ type: "drop", view: id });
  }

  close() {
    if (!this.worker.channels.delete(this.id)) return;
    clearInterval(this.#toRest?.timer);
    this.send({ type: "close" });
    for (const view of [...this.views.values()]) view.dispose();
    this.#fail(aborted());
    this.release();
  }
}

/** The result of load(): see index.d.ts. Objects to draw are made when they are first asked for. */
export class ATH extends EventDispatcher {
  attributes = {};
  #channel;
  #faces;
  #geometry = null;
  #lines = null;
  #object = null;
  #drawn = null;
  #material = null;
  #loaded = null;
  #presence = new Presence();

  constructor(channel, mode) {
    super();
    this.#channel = channel;
    this.motion = channel.view().setMode(mode);
    this.motion.addEventListener("frame", () => this.#hide(false));
    this.metadata = channel.statics.metadata;
    this.#faces = polygonsOf(channel.statics, {});
    this.arrays = channel.arrays.then((attributes) => this.#addArrays(attributes));
  }

  /** Resolves when all bytes of the file are here, which are fetched once it is asked for. */
  get loaded() {
    return this.#loaded ??= this.#channel.fetchAll().then(() => this);
  }

  /** Ends the downloads; what is here goes on playing. */
  abort() {
    this.#channel.abort();
  }

  get hasFaces() {
    return this.#faces !== null;
  }

  /** Faces as triangles; null where there are none. */
  get geometry() {
    if (!this.#geometry && this.#faces) {
      this.#geometry = this.motion.attach(meshGeometry(this.#channel, this.#faces));
      addAttributes(this.#geometry, this.#channel, this.attributes);
      this.#hide(true);
    }
    return this.#geometry;
  }

  /** Edges as lines: those of the file or, where it has neither edges nor faces, of the branches. */
  get lines() {
    const { statics } = this.#channel;
    if (!this.#lines && (statics.edges || !this.#faces)) {
      this.#lines = this.motion.attach(lineGeometry(this.#channel, statics.edges ?? statics.skeleton));
      this.#hide(true);
    }
    return this.#lines;
  }

  /** Something to add to a scene, upright: a Mesh of the faces, LineSegments where there are none. */
  get object() {
    if (!this.#object) {
      this.#object = atOrigin(new Group(), this);
      this.#object.name = "ath";
      this.#draw();
    }
    return this.#object;
  }

  #hide(fresh) {
    this.#presence.show(this, [this.#geometry, this.#lines].filter(Boolean), fresh);
  }

  // Arrays that come later change what is drawn, which stays the object that it is; only lines give way to faces.
  #draw() {
    const { geometry, motion } = this, old = this.#drawn;
    if (!old || (geometry && !old.isMesh)) {
      const material = geometry ? new MeshStandardMaterial({ color: 0x8a9a6b, roughness: 0.8, side: DoubleSide }) : new LineBasicMaterial({ color: 0x6b5b45 });
      this.#material = motion.bind(material);
      this.#drawn = geometry ? new Mesh(geometry, material) : new LineSegments(this.lines, material);
      if (old) Object3D.prototype.copy.call(this.#drawn, old);
      else this.#drawn.castShadow = this.#drawn.receiveShadow = true;
      this.#object.add(motion.bindShadows(this.#drawn));
      old?.removeFromParent();
      old?.material.dispose();
    }
    const { vertexColors } = this.#material;
    if (!geometry?.hasAttribute("color") || vertexColors) return;
    this.#material.color.set(0xffffff);
    Object.assign(this.#material, { vertexColors: true, needsUpdate: true });
  }

  /** Edges (u, v) in any case, the file's or those that follow from the branches. */
  get skeleton() {
    return this.#channel.statics.skeleton;
  }

  /** What all positions are relative to, in the axes of the file: 0, 0, 0 unless the plant is far from there. */
  get origin() {
    return this.#channel.origin;
  }

  /** Finer once levels above 0 are here, in the same array. */
  get rest() {
    return this.#channel.rest;
  }

  get branches() {
    return this.#channel.branches;
  }

  /** Number (file order) of the branch of every vertex, in source order. */
  get vertexBranch() {
    return this.#channel.vertexBranch;
  }

  /** The sphere about the rest pose. */
  get sphere() {
    return this.#channel.sphere;
  }

  /** The box of the rest pose. */
  get box() {
    return this.#channel.box;
  }

  get channel() {
    return this.#channel;
  }

  #addArrays(attributes) {
    this.attributes = attributes;
    this.#faces ??= polygonsOf(this.#channel.statics, attributes);
    if (this.#geometry) addAttributes(this.#geometry, this.#channel, attributes);
    if (this.#object && this.#faces) this.#draw();
    this.#hide(true);
    this.dispatchEvent({ type: "arrays" });
    return attributes;
  }

  dispose() {
    for (const geometry of [this.#geometry, this.#lines]) geometry?.dispose();
    this.#material?.dispose();
    this.#channel.close();
  }
}

export class ATHLoader extends Loader {
  constructor(manager) {
    super(manager);
    this.workerLimit = 4;
    this.workerPool = [];
    this.workerURL = null;
    this.mode = "matrices";
    this.clip = null;
    this.hostMesh = null;
    this.bandwidth = null;
    this.begun = null;
  }

  /** Where ath_worker.js is, if not beside this module: its folder, or its URL. */
  setDecoderPath(path) {
    this.workerURL = /\/$/.test(path) ? `${path}ath_worker.js` : path;
    return this;
  }

  /** At most so many workers; a file lives in one of them. */
  setWorkerLimit(limit) {
    this.workerLimit = limit;
    return this;
  }

  /** "matrices", or "positions" for renderers other than WebGLRenderer: see ATHMotion.setMode. */
  setMode(mode) {
    this.mode = mode;
    return this;
  }

  /** The name of the clip to begin with, of which alone more than the first bytes are fetched; null: the file's first. */
  setClip(name) {
    this.clip = name;
    return this;
  }

  /** The mesh that is the rest pose of files that do not hold one: a Float32Array of three numbers per vertex, in the
   * order that the file was made from, or a BufferGeometry whose positions are these. Other files pass it over. */
  setHostMesh(mesh) {
    this.hostMesh = numbersOf(mesh);
    return this;
  }

  /** Bits a second at which bytes of files that are loaded from now on come at most, from memory too, as over a slow line;
   * null: as fast as they do. */
  setBandwidth(bandwidth) {
    this.bandwidth = bandwidth;
    return this;
  }

  /** Starts a worker before there is a file for it. */
  preload() {
    if (this.workerPool.length === 0) this.#start();
    return this;
  }

  /** Takes what a page has begun before this module was there: a `worker` that runs ath_worker.js and, where the `url` of a file
   * is known, its `front`, a promise of {status, headers, port} of an answer to a request for its first bytes, or of null. */
  takeOver({ worker, url = null, front = null }) {
    this.#add(worker);
    this.begun = { url, front };
    return this;
  }

  /** Starts to load. onLoad gets an ATH when its first picture can be shown; the rest goes on arriving. */
  load(url, onLoad, onProgress, onError) {
    const whole = this.manager.resolveURL(LoaderUtils.resolveURL(url, this.path));
    const options = { headers: this.requestHeader, credentials: this.withCredentials ? "include" : "same-origin" };
    this.manager.itemStart(url);
    const done = (call, value) => {
      if (call === onError) this.manager.itemError(url);
      call?.(value);
      this.manager.itemEnd(url);
    };
    this.#openUrl(new URL(whole, globalThis.location?.href).href, options, onProgress)
      .then((ath) => done(onLoad, ath), (error) => {
        if (!onError) console.error(error);
        done(onError, error);
      });
  }

  /** Opens bytes that are here: a buffer or a view of one, of which the worker gets a copy. */
  parse(buffer, onLoad, onError = (error) => console.error(error)) {
    this.parseAsync(buffer).then(onLoad, onError);
  }

  async parseAsync(buffer) {
    const { buffer: bytes } = bytesOf(buffer);
    return this.#open({ bytes }, [bytes]);
  }

  /** Ends all downloads: what is not shown yet fails, all else goes on playing what is here. */
  abort() {
    for (const { channels } of this.workerPool) for (const channel of [...channels.values()]) channel.abort();
    return this;
  }

  // The front that a page has begun to fetch serves the first file of that address.
  async #openUrl(url, options, onProgress) {
    const { clip, hostMesh, bandwidth, begun } = this, front = begun?.url === url && bandwidth === null ? await begun.front : null;
    this.begun = null;
    return this.#open({ url, options: { ...options, front }, clip, hostMesh, bandwidth }, front ? [front.port] : [], onProgress);
  }

  async #open(message, transfer, onProgress) {
    const worker = this.#worker(), signal = this.manager.abortController?.signal, abort = () => channel.abort();
    const channel = new Channel(worker, () => {
      worker.files--;
      signal?.removeEventListener("abort", abort);
    });
    signal?.addEventListener("abort", abort);
    worker.files++;
    try {
      channel.send({ type: "open", clip: this.clip, hostMesh: this.hostMesh, bandwidth: this.bandwidth, ...message }, transfer);
      await channel.opened;
      const ath = new ATH(channel, this.mode);
      if (onProgress) ath.motion.addEventListener("progress", ({ loaded, total }) => onProgress({ loaded, total, lengthComputable: true }));
      await this.#firstPicture(ath.motion);
      return ath;
    } catch (error) {
      channel.close();
      throw error;
    }
  }

  // Where something is wrong, what is here may do for one.
  #firstPicture(motion) {
    return new Promise((resolve, reject) => {
      const failed = (event) => { if (motion.level < 0) motion.show(0, 0).catch(() => reject(failureOf(event))); };
      motion.addEventListener("frame", resolve);
      motion.addEventListener("stopped", failed);
      motion.addEventListener("damaged", failed);
      motion.setTime(0);
    });
  }

  // The worker with the fewest files; a new one as long as there may be more.
  #worker() {
    const idle = this.workerPool.find((worker) => worker.files === 0);
    if (idle) return idle;
    if (this.workerPool.length < this.workerLimit) return this.#start();
    return this.workerPool.reduce((least, worker) => (worker.files < least.files ? worker : least));
  }

  #start() {
    return this.#add(this.#make());
  }

  #add(worker) {
    Object.assign(worker, { files: 0, channels: new Map() });
    worker.onmessage = ({ data }) => worker.channels.get(data.file)?.receive(data);
    worker.onerror = ({ message }) => {
      this.workerPool.splice(this.workerPool.indexOf(worker), 1); // the next file tries anew
      for (const channel of worker.channels.values()) channel.receive({ type: "failed", ...noWorker(message) });
    };
    this.workerPool.push(worker);
    return worker;
  }

  // A page may start workers of its own origin alone: elsewhere a module of its memory imports the script.
  #make() {
    const { href, origin } = globalThis.location ?? {};
    try {
      const url = new URL(this.workerURL ?? new URL("./ath_worker.js", import.meta.url), href), isHere = url.protocol === "blob:" || url.origin === origin || !/^http/.test(origin);
      const script = isHere ? url : URL.createObjectURL(new Blob([`import ${JSON.stringify(url.href)};`], { type: "text/javascript" }));
      // a page from the disk may have no module as a worker from its own memory; the bundle is both
      return new Worker(script, { type: url.protocol === "blob:" ? "classic" : "module" });
    } catch ({ message }) {
      throw failureOf(noWorker(message));
    }
  }

  /** Ends all workers; what was loaded shows its last picture from then on. */
  dispose() {
    for (const worker of this.workerPool) worker.terminate();
    this.workerPool.length = 0;
    return this;
  }
}
