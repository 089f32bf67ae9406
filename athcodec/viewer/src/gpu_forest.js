// Many instances of one plant for WebGPURenderer. What moves is a few plants, one of each clip and phase, which the passes of
// athcodec/gpu place and turn into vertices, all in the same dispatches; instances are drawn with the vertices of theirs. Which
// shape an instance is drawn with is chosen on the GPU.

import { Box3, BufferAttribute, DoubleSide, Group, IndirectStorageBufferAttribute, LineBasicNodeMaterial, LineSegments, Mesh,
  MeshStandardNodeMaterial, Frustum, Matrix4, StorageBufferAttribute, TSL, Vector3, WebGPUCoordinateSystem } from "three/webgpu";

import blocks from "../../gpu/blocks.wgsl";
import choose from "../../gpu/choose.wgsl";
import finish from "../../gpu/finish.wgsl";
import hierarchy from "../../gpu/hierarchy.wgsl";
import time from "../../gpu/time.wgsl";
import vertices from "../../gpu/vertices.wgsl";
import { Kernels, Passes } from "../../gpu/passes.mjs";
import { roundOf } from "./ATHMotion.js";
import { clustered, upright } from "./geometry.js";
import { framesAt, Mixture } from "./gpu_blend.js";

const MOST_SHAPES = 32;
const INSTANCE = 12;      // Numbers of an instance, as choose.wgsl has them.
const SLOTS = 4;          // frames that a plant keeps: two that are shown, and two that were before
const CELL = 1.5;         // side of the cells of simplified geometry, in pixels' worth of error
const COARSER = 2;        // from one shape to the next
const FEWER = 0.85;       // A shape is made if it has at most this share of the vertices of the one before.
const VIEW_WORDS = 40, FLOATS = 9;
const MEASURED = 1 << 16, WORKGROUP = 64; // Largest number of invocations that look for the furthest vertex, and those of a workgroup.
const WHITE = 0xffffff;

const plainMaterial = (lines) => (lines ? new LineBasicNodeMaterial({ color: 0x6b5b45 })
  : new MeshStandardNodeMaterial({ color: 0x8a9a6b, roughness: 0.8, side: DoubleSide }));

export class ATHForest extends Group {
  pixels = 1;      // error on the screen that a level may have
  measure = "p99";
  phases = 8;      // in which instances of a clip can be, evenly over its time
  ease = 0.2;      // seconds in which two thirds of a change of weights have happened; 0: at once
  bytesOfMotion = 0;     // uploaded so far: segments and levels, once each
  bytesOfParameters = 0; // and what says which frames are shown, every frame
  levels = [];     // Levels that can be drawn: {level, passes, ...}.

  #renderer;
  #ath;
  #geometry;
  #material;
  #shape;
  #device;
  #kernels;
  #choose;
  #measure;
  #motions = new Map(); // By clip that is shown: a view that has its bytes fetched.
  #plants = [];         // {clip, phase}: what instances show, one of each clip and phase in use; phase: 0 to 1
  #times = [];          // For each plant at this frame: [{frame, weight}].
  #mixture = new Mixture();
  #eased = 0;           // when weights were advanced, milliseconds
  #instances = null;    // StorageBufferAttribute
  #draws = null;
  #lists = null;
  #set = null;
  #shapes = [];         // {level, tolerance, list, drawn}, the finest first
  #box = new Box3();
  #size = 1;            // Size of the largest instance.
  #count = 0;
  #loading = false;
  #version = 0;
  #inView = new Float32Array(VIEW_WORDS);
  #beyond = 0;          // how far a shape's own vertices are from the plant's
  #zeros = null;
  #asked = null;        // the wind that was asked for last
  #strength = 1;
  #heading = TSL.uniform(new Vector3(1, 0, 0)); // cosine, sine, 1 where the motion has a heading of its own

  /** renderer: a WebGPURenderer on which init() has been awaited. geometry: as in ATHForest of athcodec-three; shape(geometry,
   * tolerance): what is drawn of each of its simplifications (default: it). */
  constructor(renderer, ath, { geometry = ath.geometry ?? ath.lines, material = plainMaterial, shape = (simple) => simple } = {}) {
    super();
    this.name = "ath forest";
    this.#device = renderer.backend.device;
    if (!this.#device) throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");
    this.#renderer = renderer;
    this.#ath = ath;
    upright(this, ath.metadata);
    this.#geometry = geometry;
    this.#material = material;
    this.#shape = shape;
    this.#kernels = new Kernels(this.#device, { blocks, time, hierarchy, finish, vertices });
    const module = this.#device.createShaderModule({ code: choose });
    [this.#choose, this.#measure] = ["main", "measure"].map((entryPoint) => this.#device.createComputePipeline({ layout: "auto", compute: { module, entryPoint } }));
    this.reach = this.#device.createBuffer({ size: 4, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
    this.view = this.#device.createBuffer({ size: 4 * VIEW_WORDS, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
    this.tolerances = this.#device.createBuffer({ size: 8 * MOST_SHAPES, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
  }

  get count() {
    return this.#count;
  }

  /** Plants that are computed: one of each clip and phase in use. */
  get plantCount() {
    return this.#plants.length;
  }

  /** For each plant that is computed: the name of its clip and its phase, 0 to 1. */
  get plants() {
    return this.#plants.map(({ clip, phase }) => [clip.name, phase]);
  }

  /** Names of the clips whose bytes are wanted. */
  get clips() {
    return Array.from(this.#motions.keys(), ({ name }) => name);
  }

  /** Bytes on the GPU, but for shapes. */
  get bytes() {
    return this.levels.reduce((sum, { passes }) => sum + passes.bytes, 0);
  }

  /** instances: {x, y, z, size, angle, seconds, clip, tint, amplitude} in the units and axes of the file; tint: a colour such as 0xffeecc. */
  setInstances(instances) {
    const { motion, channel } = this.#ath, { limits } = this.#device, numbers = new Float32Array(INSTANCE * Math.max(1, instances.length));
    this.#forget();
    const clipOf = (name) => this.#clip(name) ?? motion.clip, clips = new Set(instances.map(({ clip }) => clipOf(clip)));
    const most = Math.floor(limits.maxStorageBufferBindingSize / (12 * SLOTS * channel.info.placeCount) / Math.max(1, clips.size));
    const phases = Math.max(1, Math.min(this.phases, most)), plants = new Map();
    const plantOf = (clip, seconds = 0) => {
      const round = roundOf(clip) || 1, phase = Math.floor(((seconds / round) % 1 + 1) % 1 * phases), key = clip.index * phases + phase;
      if (!plants.has(key)) plants.set(key, { index: plants.size, clip, phase: phase / phases });
      return plants.get(key).index;
    };
    instances.forEach(({ x, y, z, size = 1, angle = 0, seconds, clip, tint = WHITE, amplitude = 1 }, i) => {
      numbers.set([x, y, z, size, Math.cos(angle), Math.sin(angle), plantOf(clipOf(clip), seconds), tint, amplitude], INSTANCE * i);
      this.#box.expandByPoint(new Vector3(x, y, z));
      this.#size = Math.max(this.#size, size);
    });
    this.#plants = [...plants.values()];
    this.#count = instances.length;
    for (const clip of [...clips, ...this.#mixture.clips]) this.#fetch(clip);
    this.#instances = this.#storage(numbers, 4);
    this.#draws = new IndirectStorageBufferAttribute(new Uint32Array(5 * MOST_SHAPES), 5);
    this.#renderer.backend.createIndirectStorageAttribute(this.#draws);
    this.#lists = this.#storage(new Uint32Array(MOST_SHAPES * Math.max(1, this.#count)), 1);
    this.#zeros = new Uint32Array(5 * MOST_SHAPES);
    this.#set = this.#setOf(this.#choose, { 0: this.#bufferOf(this.#instances), 1: this.view, 2: this.tolerances,
      3: this.#bufferOf(this.#draws), 4: this.#bufferOf(this.#lists), 5: this.reach });
    return this;
  }

  // buffers: by the numbers of their bindings
  #setOf(pipeline, buffers) {
    const entries = Object.entries(buffers).map(([binding, buffer]) => ({ binding: Number(binding), resource: { buffer } }));
    return this.#device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries });
  }

  #clip(name) {
    return this.#ath.motion.clips.find(({ index, name: clipName }) => name === index || name === clipName);
  }

  // Has a clip's bytes fetched, as far as levels are shown.
  #fetch(clip) {
    if (this.#motions.has(clip)) return;
    this.#motions.set(clip, this.#ath.motion.clone().play(clip.index).setLevel(Math.max(0, this.levels.length - 1)).setTime(0));
  }

  // An attribute of which the buffer is there from now on.
  #storage(array, size) {
    const attribute = new StorageBufferAttribute(array, size);
    this.#renderer.backend.createStorageAttribute(attribute);
    return attribute;
  }

  #bufferOf(attribute) {
    return this.#renderer.backend.get(attribute).buffer;
  }

  /** Shows clips at once, in place of each instance's own. See webgpu.d.ts. */
  blend(weights) {
    const shares = Object.entries(weights ?? {}).map(([name, weight]) => [this.#clip(name), weight]);
    const wrong = shares.findIndex(([clip, weight]) => !clip || !(weight >= 0 && weight < Infinity));
    if (wrong >= 0 || (weights && !shares.some(([, weight]) => weight > 0)))
      throw new RangeError(`blend: got ${JSON.stringify(weights)}, expected weights of clips, ${this.#ath.motion.clips.map(({ name }) => name).join(", ")}`);
    for (const [clip, weight] of shares) if (weight > 0) this.#fetch(clip);
    this.#mixture.set(weights && new Map(shares));
    return this;
  }

  /** Shows the clips whose own wind is nearest. See webgpu.d.ts. */
  async wind(strength, heading = 0) {
    if (![strength, heading].every(Number.isFinite)) throw new RangeError(`wind: got ${strength} and ${heading}, expected two finite numbers`);
    const asked = this.#asked = {}, { weights } = await this.#ath.channel.windWeights(strength, heading), { clips } = this.#ath.motion;
    if (asked === this.#asked) this.blend(Object.fromEntries(clips.map(({ name }, i) => [name, weights[i]])));
    return this;
  }

  /** How far plants move, 1: as in the file; heading: where to, radians about the axis that is up, of all instances alike; null:
   * each as it is turned itself. */
  sway(strength, heading = null) {
    this.#strength = strength;
    this.#heading.value.set(Math.cos(heading ?? 0), Math.sin(heading ?? 0), heading === null ? 0 : 1);
    return this;
  }

  // ---- levels ----

  // Uploads what levels that are shown lack of clips that came later; then the next level, once its bytes are here and an instance
  // is so near that the one before does not do.
  #loadNext(hidden) {
    const next = this.levels.length, { motion } = this.#ath;
    if (this.#loading) return;
    for (const levelState of this.levels) for (const [clip, { readyLevel }] of this.#motions)
      if (!levelState.clips.has(clip) && readyLevel >= levelState.level) return this.#begin(() => this.#loadClip(levelState, clip));
    if (next >= motion.levelCount || (next > 0 && this.#error(next - 1) <= hidden)) return;
    for (const view of this.#motions.values()) if (view.target < next) view.setLevel(next);
    if ([...this.#motions.values()].every(({ readyLevel }) => readyLevel >= next)) this.#begin(() => this.#load(next));
  }

  #begin(work) {
    this.#loading = true;
    work().catch(({ message, codeName }) => this.#ath.motion.dispatchEvent({ type: "error", message, codeName }));
  }

  // Counted over all clips that are played.
  #error(level) {
    return Math.max(...Array.from(this.#motions.keys(), ({ errors }) => errors[level][this.measure]));
  }

  async #load(level) {
    const { channel } = this.#ath, version = this.#version, is = () => version === this.#version;
    const [known, { words }] = [await channel.parts(level), await channel.gpu(level)];
    if (!is()) return;
    const shown = this.#plants.length, shared = this.#storage(new Float32Array(FLOATS * words[2] * shown), 1);
    const passes = new Passes(this.#device, this.#kernels, words, { slots: SLOTS * shown, shown, vertices: this.#bufferOf(shared) });
    const measured = this.#setOf(this.#measure, { 1: this.view, 5: this.reach, 6: this.#bufferOf(shared) });
    const levelState = { level, passes, shared, measured, clips: new Set(), places: new Map(), uploaded: 0, bytesOfMotion: 0, bytesOfParameters: 0, strength: NaN,
      slots: this.#plants.map(() => new Array(SLOTS).fill(-1)), before: this.#plants.map(() => null) };
    if (this.#ath.hasFaces) passes.setCorners(cornersOf(this.#ath.geometry, channel));
    for (const clip of this.#motions.keys()) {
      if (!await this.#upload(levelState, clip, is)) {
        passes.dispose();
        return;
      }
    }
    this.levels.push(levelState);
    this.#addShapes(levelState, known);
    this.#loading = false;
    this.dispatchEvent({ type: "level", level });
  }

  async #loadClip(levelState, clip) {
    const version = this.#version;
    if (await this.#upload(levelState, clip, () => version === this.#version)) this.#loading = false;
  }

  // The segments of a clip at a level; false: nobody wants them any more. places: of frames of the file, {segment, frame}.
  async #upload(levelState, clip, is) {
    const { channel } = this.#ath, { passes, level, places } = levelState;
    for (let s = clip.firstSegment; s < clip.firstSegment + clip.segmentCount; s++) {
      const { words, coded } = await channel.gpu(level, s);
      if (!is()) return false;
      const segment = passes.segment(words);
      this.#account(levelState, "bytesOfMotion");
      coded.forEach((frame, i) => places.set(channel.segments[s] + i, { segment, frame }));
    }
    levelState.clips.add(clip);
    return true;
  }

  // Bytes that have been uploaded since the last time.
  #account(levelState, kind) {
    this[kind] += levelState.passes.uploaded - levelState.uploaded;
    levelState[kind] += levelState.passes.uploaded - levelState.uploaded;
    levelState.uploaded = levelState.passes.uploaded;
  }

  // Geometries of a level: the finest for where its error is a pixel, coarser ones up to where the level before takes over.
  #addShapes(levelState, known) {
    const { channel, motion, rest, sphere } = this.#ath, { level } = levelState, least = this.#error(level);
    const most = level > 0 ? this.#error(level - 1) : sphere.radius / 4, node = channel.nodeNumbers(known);
    known.vertices.forEach((texel, vertex) => { if (texel < 0) node[vertex] = -1; }); // exact runs: one space
    let before = level === motion.levelCount - 1 ? this.#geometry : clustered(this.#geometry, rest, CELL * least, node);
    this.#addShape(levelState, before, least);
    for (let tolerance = Math.max(COARSER * least, sphere.radius / 2000); tolerance < most; tolerance *= COARSER) {
      const less = clustered(this.#geometry, rest, CELL * tolerance, node);
      if (less.userData.source.length > FEWER * before.userData.source.length) continue;
      this.#addShape(levelState, less, tolerance);
      before = less;
    }
    const list = Float32Array.from({ length: 2 * this.#shapes.length }), lists = new Uint32Array(list.buffer);
    this.#shapes.sort((a, b) => a.tolerance - b.tolerance).forEach((shape, i) => {
      list[2 * i] = shape.tolerance;
      lists[2 * i + 1] = shape.list;
    });
    this.#device.queue.writeBuffer(this.tolerances, 0, list);
  }

  #addShape(levelState, simple, tolerance) {
    const list = this.#shapes.length;
    if (list === MOST_SHAPES) return;
    const geometry = this.#shape(simple, tolerance).clone(), { source } = simple.userData, lines = !geometry.hasAttribute("normal");
    const place = this.#ath.channel.vertexPlaces, vertexOf = geometry.userData.vertices ?? source, offsets = geometry.getAttribute("athOffset");
    for (let i = 0; i < (offsets?.count ?? 0); i++) this.#beyond = Math.max(this.#beyond, Math.hypot(offsets.getX(i), offsets.getY(i), offsets.getZ(i)));
    geometry.setAttribute("athVertex", new BufferAttribute(Uint32Array.from(vertexOf, (vertex) => place[vertex]), 1));
    geometry.setAttribute("position", new BufferAttribute(Float32Array.from({ length: 3 * vertexOf.length },
      (_, i) => this.#ath.rest[3 * vertexOf[Math.floor(i / 3)] + i % 3]), 3)); // the rest pose: not what rays find
    geometry.setIndirect(this.#draws, 20 * list);
    this.#zeros[5 * list] = geometry.index.count;
    const material = this.#material(lines, levelState.level), drawn = lines ? new LineSegments(geometry, material) : new Mesh(geometry, material);
    this.#bind(material, geometry, levelState, list);
    drawn.frustumCulled = false; // instances are, one by one
    drawn.castShadow = drawn.receiveShadow = !lines;
    this.#shapes.push({ level: levelState.level, tolerance, list, drawn, size: geometry.index.count });
    this.add(drawn);
  }

  // The vertices of the plant that an instance shows, turned as it is and at its place; those of the image before, too.
  #bind(material, geometry, { passes, shared }, list) {
    const { Fn, storage, uint, float, vec3, attribute, instanceIndex, positionGeometry, positionPrevious, normalLocal, normalGeometry, select } = TSL;
    const { metadata, channel: { info }, origin: less } = this.#ath;
    const upright = metadata.up_axis === "z", heading = this.#heading, origin = vec3(...info.origin.map((value, k) => value - less[k])), count = uint(passes.words[2]);
    const vertices = storage(shared, "float", shared.count).toReadOnly();
    const instances = storage(this.#instances, "vec4", INSTANCE / 4 * Math.max(1, this.#count)).toReadOnly();
    const lists = storage(this.#lists, "uint", this.#lists.count).toReadOnly();
    const spun = (v, c, s) => (upright ? vec3(c.mul(v.x).sub(s.mul(v.y)), s.mul(v.x).add(c.mul(v.y)), v.z)
      : vec3(c.mul(v.x).add(s.mul(v.z)), v.y, c.mul(v.z).sub(s.mul(v.x))));
    const number = () => lists.element(uint(list * Math.max(1, this.#count)).add(instanceIndex));
    const hasOffset = geometry.hasAttribute("athOffset"), hasNormals = passes.hasCorners && !geometry.userData.vertices;
    material.positionNode = Fn((_, builder) => {
      const which = number().toVar(), part = (k) => instances.element(which.mul(INSTANCE / 4).add(k)).toVar();
      const place = part(0), turn = part(1), amplitude = part(2).x;
      const at = uint(turn.z).mul(count).add(attribute("athVertex", "uint")).mul(FLOATS).toVar();
      const three = (from) => vec3(...[0, 1, 2].map((k) => vertices.element(at.add(from + k))));
      const placed = (moved) => {
        const bent = moved.add(origin).sub(positionGeometry).mul(amplitude).toVar();
        const c = heading.x.mul(turn.x).add(heading.y.mul(turn.y)), s = heading.y.mul(turn.x).sub(heading.x.mul(turn.y)); // beside its own
        const headed = positionGeometry.add(spun(bent, c, s)), shown = select(heading.z.greaterThan(0.5), headed, positionGeometry.add(bent)).toVar();
        const whole = hasOffset ? shown.add(attribute("athOffset", "vec3")) : shown;
        return spun(whole, turn.x, turn.y).mul(place.w).add(place.xyz);
      };
      const turned = () => (hasNormals ? normalGeometry.add(three(3).sub(normalGeometry).mul(amplitude)) : normalGeometry);
      if (geometry.hasAttribute("normal")) normalLocal.assign(spun(turned(), turn.x, turn.y));
      if (builder.needsPreviousData?.()) positionPrevious.assign(placed(three(6)));
      return placed(three(0));
    })();
    const tint = Fn(() => {
      const packed = uint(instances.element(number().mul(INSTANCE / 4).add(1)).w), byte = (shift) => float(packed.shiftRight(uint(shift)).bitAnd(uint(255))).div(255);
      return vec3(byte(16), byte(8), byte(0));
    })();
    material.colorNode = TSL.varying(tint).mul(material.colorNode ?? (geometry.hasAttribute("color") ? attribute("color", "vec3") : TSL.materialColor));
  }

  // ---- frames ----

  /** Shows `seconds`: to be called once per frame, before rendering. height: the screen's, in pixels. */
  update(camera, height, seconds) {
    if (!this.#set) return;
    const hidden = this.#look(camera, height);
    this.#loadNext(hidden);
    this.#place(seconds);
    const shown = this.levels.filter(({ level }) => level === 0 || this.#error(level - 1) > hidden);
    for (const levelState of this.levels)
      if (shown.includes(levelState)) this.#show(levelState);
      else levelState.before.fill(null); // What a level showed earlier is not the image before the one that shows it again.
    this.#select(shown);
  }

  // Where the camera is, for the shader. How large an error is hidden at the nearest instance that there may be.
  #look(camera, height) {
    this.updateWorldMatrix(true, false);
    camera.updateMatrixWorld();
    const { sphere, origin: less, channel: { info } } = this.#ath, numbers = this.#inView, rest = sphere.center.length() + sphere.radius + this.#beyond;
    const near = sphere.center.length() + 1.2 * sphere.radius;
    const eye = new Vector3().setFromMatrixPosition(camera.matrixWorld).applyMatrix4(new Matrix4().copy(this.matrixWorld).invert());
    const view = new Frustum().setFromProjectionMatrix(new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
      .multiply(this.matrixWorld), camera.coordinateSystem ?? WebGPUCoordinateSystem);
    view.planes.forEach(({ normal, constant }, k) => numbers.set([normal.x, normal.y, normal.z, constant], 4 * k));
    const pixel = this.pixels * 2 * Math.tan(camera.fov * Math.PI / 360) / height, distance = this.#box.distanceToPoint(eye);
    numbers.set([eye.x, eye.y, eye.z, pixel], 24);
    new Uint32Array(numbers.buffer).set([this.#count, this.#shapes.length], 28);
    numbers[30] = near;
    new Uint32Array(numbers.buffer)[31] = Math.max(1, this.#count);
    numbers.set([...info.origin.map((value, k) => value - less[k]), this.#beyond, rest], 32);
    new Uint32Array(numbers.buffer)[37] = this.#heading.value.z;
    return pixel * Math.max(distance - 0.5 * near * this.#size, 1e-6) / this.#size;
  }

  // The frames of the file that each plant shows. Clips are blended once all levels have them.
  #place(seconds) {
    const now = performance.now(), share = this.ease > 0 ? 1 - Math.exp((this.#eased - now) / (1000 * this.ease)) : 1;
    this.#eased = now;
    this.#mixture.advance(share, (clip) => this.levels.every((levelState) => levelState.clips.has(clip)));
    const { times } = this.#ath.channel;
    this.#times = this.#plants.map(({ clip: clipOfPlant, phase }) => [...this.#mixture.of(clipOfPlant)].flatMap(([clip, part]) =>
      framesAt(times, clip, seconds + phase * roundOf(clip)).map(({ frame, weight }) => ({ frame, weight: part * weight }))));
  }

  // A level at that time: what is not there yet is placed, and all plants shown.
  #show(levelState) {
    const places = [], shows = [], strength = this.#strength, changed = levelState.strength !== strength;
    levelState.strength = strength;
    this.#times.forEach((frames, plant) => {
      const before = levelState.before[plant];
      if (changed) levelState.slots[plant].fill(-1);
      const shown = frames.length > 2 ? this.#blended(levelState, plant, frames, places) : this.#between(levelState, plant, frames, places);
      shows.push({ ...shown, previous: before?.slots ?? shown.slots, previousWeight: before?.weight ?? shown.weight });
      levelState.before[plant] = shown;
    });
    levelState.passes.run(places, shows);
    this.#account(levelState, "bytesOfParameters");
  }

  // At most two frames, of which each is placed once for all times around it.
  #between(levelState, plant, frames, places) {
    const kept = levelState.slots[plant], first = SLOTS * plant, names = frames.map(({ frame }) => frame);
    const slots = names.map((frame) => {
      let slot = kept.indexOf(frame);
      if (slot < 0) {
        slot = kept.findIndex((old, k) => !names.includes(old) && !levelState.before[plant]?.slots.includes(first + k));
        kept[slot] = frame;
        places.push({ sources: [levelState.places.get(frame)], slot: first + slot, strength: levelState.strength });
      }
      return first + slot;
    });
    return { slots: [slots[0], slots.at(-1)], weight: frames.length > 1 ? frames[1].weight : 0 };
  }

  // Several, which are blended before branches are placed: at this time alone.
  #blended(levelState, plant, frames, places) {
    const kept = levelState.slots[plant], first = SLOTS * plant;
    const slot = kept.findIndex((_, k) => !levelState.before[plant]?.slots.includes(first + k));
    kept[slot] = -1;
    const sources = frames.filter(({ weight }) => weight > 0).map(({ frame, weight }) => ({ ...levelState.places.get(frame), weight }));
    places.push({ sources, slot: first + slot, strength: levelState.strength });
    return { slots: [first + slot, first + slot], weight: 0 };
  }

  #select(levels) {
    const { queue } = this.#device, encoder = this.#device.createCommandEncoder();
    queue.writeBuffer(this.view, 0, this.#inView);
    queue.writeBuffer(this.#bufferOf(this.#draws), 0, this.#zeros);
    queue.writeBuffer(this.reach, 0, new Uint32Array(1));
    this.bytesOfParameters += this.#inView.byteLength + this.#zeros.byteLength + 4;
    const pass = encoder.beginComputePass();
    pass.setPipeline(this.#measure);
    for (const { measured, shared } of levels) {
      pass.setBindGroup(0, measured);
      pass.dispatchWorkgroups(Math.ceil(Math.min(MEASURED, shared.count / FLOATS) / WORKGROUP));
    }
    pass.setPipeline(this.#choose);
    pass.setBindGroup(0, this.#set);
    pass.dispatchWorkgroups(Math.ceil(Math.max(1, this.#count) / 64));
    pass.end();
    queue.submit([encoder.finish()]);
  }

  /** Instances that the last update() drew, by level: read back, for tests and figures. */
  async drawn() {
    const size = this.#zeros.byteLength, read = this.#device.createBuffer({ size, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
    const encoder = this.#device.createCommandEncoder(), counts = new Array(this.#ath.motion.levelCount).fill(0);
    encoder.copyBufferToBuffer(this.#bufferOf(this.#draws), 0, read, 0, size);
    this.#device.queue.submit([encoder.finish()]);
    await read.mapAsync(GPUMapMode.READ);
    const numbers = new Uint32Array(read.getMappedRange().slice(0));
    read.destroy();
    for (const { level, list } of this.#shapes) counts[level] += numbers[5 * list + 1];
    return counts;
  }

  /** Vertices of plants at a level as the last update() showed them, in file order: nine floats of each, read back. */
  async vertices(level) {
    const { shared } = this.levels[level];
    return new Float32Array(await this.#renderer.getArrayBufferAsync(shared));
  }

  #forget() {
    this.#version++;
    this.#loading = false;
    for (const { drawn } of this.#shapes) {
      drawn.removeFromParent();
      drawn.geometry.dispose();
      drawn.material.dispose();
    }
    for (const { passes, shared } of this.levels) {
      passes.dispose();
      this.#renderer.backend.destroyAttribute(shared);
    }
    for (const attribute of [this.#instances, this.#draws, this.#lists].filter(Boolean)) this.#renderer.backend.destroyAttribute(attribute);
    for (const motion of this.#motions.values()) motion.dispose();
    this.#motions.clear();
    this.levels = [];
    this.#shapes = [];
    this.#set = null;
    this.#box.makeEmpty();
    this.#size = 1e-9;
  }

  dispose() {
    this.#forget();
    this.view.destroy();
    this.reach.destroy();
    this.tolerances.destroy();
  }
}

// Corners that vertices.wgsl takes normals from: see `corners_of` in athcodec/gpu.
function cornersOf(geometry, { vertexPlaces, info: { placeCount: count } }) {
  const index = Uint32Array.from(geometry.index.array, (i) => vertexPlaces[geometry.userData.source[i]]);
  const next = new Uint32Array(count + 1), out = new Uint32Array(count + 1 + 2 * index.length);
  for (const vertex of index) next[vertex + 1]++;
  for (let v = 0; v < count; v++) next[v + 1] += next[v];
  for (let v = 0; v <= count; v++) out[v] = count + 1 + 2 * next[v];
  for (let i = 0; i < index.length; i++) {
    const first = i - i % 3, at = count + 1 + 2 * next[index[i]]++;
    out[at] = index[first + (i + 1) % 3];
    out[at + 1] = index[first + (i + 2) % 3];
  }
  return out;
}
