// Runs the three passes over WebGPU: what the three.js package draws forests with, the tests run, and a host to read beside
// docs/gpu.md.
//
//     const passes = new Passes(device, new Kernels(device, {blocks, time, hierarchy, finish, vertices}), level, {slots, shown})
//     const segment = passes.segment(words)
//     passes.run(places, shows)   places: [{sources: [{segment, frame, weight}], slot, strength}], passes 1 and 2: each a frame,
//                                 or a blend of frames, once for all that show it; shows: [{slots, weight, previous,
//                                 previousWeight}], pass 3: each a plant at a time
//     await passes.read(shows)    the same shows, read back
//
// `level` and `words` are the blocks of core/include/ath_gpu.h, as Uint32Array.

const STORAGE = 0x80 | 4 | 8; // GPUBufferUsage.STORAGE | COPY_SRC | COPY_DST
const UNIFORM = 0x40 | 8;
const READ = 1 | 8;
const [VERTEX_COUNT, BODY_COUNT, POSITION_COUNT, MATRIX_COUNT, DEPTH_COUNT, DEPTHS] = [2, 3, 4, 5, 6, 10];
const [ROW_COUNT, CORRECTED_COUNT, BAKED] = [5, 6, 19];
const WORKGROUP = 64, PLACE_WORDS = 8, SOURCE_WORDS = 4, SHOW_WORDS = 12, VERTEX_FLOATS = 9;
const groups = (count) => Math.ceil(count / WORKGROUP);

/** The pipelines of a device, which all levels share. */
export class Kernels {
  constructor(device, { blocks, time, hierarchy, finish, vertices }) {
    const module = (...texts) => device.createShaderModule({ code: texts.join("\n") });
    const kernel = (of, entryPoint = "main") =>
      device.createComputePipeline({ layout: "auto", compute: { module: of, entryPoint } });
    const finishing = module(blocks, finish);
    this.time = kernel(module(blocks, time));
    this.hierarchy = kernel(module(blocks, hierarchy));
    this.bodies = kernel(finishing, "bodies");
    this.corrections = kernel(finishing, "corrections");
    this.baked = kernel(finishing, "baked");
    this.vertices = kernel(module(vertices));
  }
}

/** A level of a file. slots: frames that are kept at once; shown: plants that pass 3 writes, into `vertices`, a buffer of nine
 * floats of each of their vertices, or one that it makes; across: workgroups that go side by side. */
export class Passes {
  uploaded = 0; // bytes
  #sets = new Map();
  #rows = 0;      // most of any segment, which is what scratch has room for
  #corrected = 0;
  #used = 0;      // words of `segments`

  constructor(device, kernels, level, { slots = 2, shown = 1, vertices = null, across = device.limits.maxComputeWorkgroupsPerDimension } = {}) {
    Object.assign(this, { device, kernels, words: level, slots, shown, across });
    this.size = { positions: 3 * level[POSITION_COUNT], matrices: 12 * level[MATRIX_COUNT], bodies: 12 * level[BODY_COUNT],
      vertices: VERTEX_FLOATS * level[VERTEX_COUNT] };
    this.baked = false;
    const { positions, matrices, bodies } = this.size;
    this.buffers = {
      level: this.#upload(level), segments: this.#buffer(1), places: this.#buffer((PLACE_WORDS + SOURCE_WORDS) * slots),
      shows: this.#buffer(SHOW_WORDS * shown), amplitudes: this.#buffer(1), positions: this.#buffer(slots * positions),
      matrices: this.#buffer(slots * matrices), modes: this.#buffer(slots * positions), bodies: this.#buffer(slots * bodies),
      corners: this.#buffer(1), vertices: vertices ?? this.#buffer(shown * this.size.vertices),
    };
    this.ownsVertices = !vertices;
    this.depths = Array.from({ length: level[DEPTH_COUNT] }, (_, depth) => {
      const [first, end] = level.subarray(level[DEPTHS] + depth);
      return { count: end - first, uniform: this.#number(depth) };
    });
    this.ordinals = []; // uniforms: 0, 1, 2, ...
    this.hasCorners = false;
  }

  /** Bytes on the GPU. */
  get bytes() {
    return Object.values(this.buffers).reduce((sum, { size }) => sum + size, 0);
  }

  #buffer(words, usage = STORAGE) {
    return this.device.createBuffer({ size: Math.max(16, 4 * words), usage });
  }

  #upload(words, usage = STORAGE) {
    const buffer = this.#buffer(words.length, usage);
    this.#write(buffer, words);
    return buffer;
  }

  #number(value) {
    return this.#upload(new Uint32Array([value, 0, 0, 0]), UNIFORM);
  }

  #write(buffer, words, at = 0, length = words.length) {
    this.uploaded += 4 * length;
    this.device.queue.writeBuffer(buffer, 4 * at, words.buffer, words.byteOffset, 4 * length);
  }

  // Another buffer in place of one, larger; what it holds is copied where `kept` words say so.
  #grow(name, words, kept = 0) {
    const old = this.buffers[name], { device } = this;
    if (4 * words <= old.size) return;
    const buffer = this.#buffer(words);
    if (kept > 0) {
      const encoder = device.createCommandEncoder();
      encoder.copyBufferToBuffer(old, 0, buffer, 0, 4 * kept);
      device.queue.submit([encoder.finish()]);
    }
    old.destroy();
    this.buffers[name] = buffer;
    this.#sets.clear();
  }

  /** Uploads a segment, once. What it returns is what places name. */
  segment(words) {
    const at = this.#used;
    if (at + words.length > this.buffers.segments.size / 4) this.#grow("segments", 2 * (at + words.length), at);
    this.#write(this.buffers.segments, words, at);
    this.#used += words.length;
    this.#rows = Math.max(this.#rows, words[ROW_COUNT]);
    this.#corrected = Math.max(this.#corrected, words[CORRECTED_COUNT]);
    this.baked ||= words[BAKED] !== 0;
    return at;
  }

  /** Triangles at each vertex, for normals: see normal_at in vertices.wgsl. */
  setCorners(words) {
    this.buffers.corners.destroy();
    this.buffers.corners = this.#upload(words);
    this.hasCorners = true;
    this.#sets.clear();
  }

  #dispatch(pass, kernel, [x, y], names, uniform = null) {
    if (x === 0 || y === 0) return;
    const key = uniform ?? kernel;
    if (!this.#sets.has(key)) {
      const entries = names.flatMap((name, binding) => (name ? [{ binding, resource: { buffer: this.buffers[name] } }] : []));
      if (uniform) entries.push({ binding: names.length, resource: { buffer: uniform } });
      const layout = this.kernels[kernel].getBindGroupLayout(0);
      this.#sets.set(key, this.device.createBindGroup({ layout, entries }));
    }
    pass.setPipeline(this.kernels[kernel]);
    pass.setBindGroup(0, this.#sets.get(key));
    const across = Math.min(x, this.across);
    pass.dispatchWorkgroups(across, y, Math.ceil(x / across));
  }

  /** All passes, at most `slots` places and `shown` shows. Results of a show are at its index, or at `at`. */
  run(places, shows) {
    const encoder = this.device.createCommandEncoder(), pass = encoder.beginComputePass();
    if (places.length > 0) this.#place(pass, places);
    if (shows.length > 0) this.#show(pass, shows);
    pass.end();
    this.device.queue.submit([encoder.finish()]);
  }

  #place(pass, places) {
    const { positions, bodies } = this.size, count = places.length;
    this.#writePlaces(places);
    if (this.baked) {
      this.#dispatch(pass, "baked", [groups(positions), count], ["level", "segments", "places", "positions"]);
      return;
    }
    this.#dispatch(pass, "time", [groups(this.#rows), count], [null, "segments", "places", "amplitudes"]);
    const outputs = ["amplitudes", "positions", "matrices", "modes", "bodies"];
    for (const depth of this.depths)
      this.#dispatch(pass, "hierarchy", [depth.count, count], ["level", "segments", "places", ...outputs], depth.uniform);
    this.#dispatch(pass, "bodies", [this.words[BODY_COUNT], count], ["level", "segments", "places", "positions", "matrices"]);
    const most = Math.max(...places.map(({ sources }) => sources.length));
    while (this.ordinals.length < most) this.ordinals.push(this.#number(this.ordinals.length));
    for (const which of this.ordinals.slice(0, most)) // one after the other: they add to the same positions
      this.#dispatch(pass, "corrections", [groups(this.#corrected), count], [null, "segments", "places", "positions", null], which);
  }

  #writePlaces(places) {
    const { positions, matrices, bodies } = this.size, total = places.reduce((sum, { sources }) => sum + sources.length, 0);
    const numbers = new Uint32Array(PLACE_WORDS * places.length + SOURCE_WORDS * total), floats = new Float32Array(numbers.buffer);
    let at = PLACE_WORDS * places.length, used = 0;
    places.forEach(({ sources, slot, strength = 1 }, i) => {
      numbers.set([at, sources.length, slot * positions, slot * matrices, i * positions, i * bodies], PLACE_WORDS * i);
      floats[PLACE_WORDS * i + 6] = strength;
      for (const { segment, frame, weight = 1 } of sources) {
        numbers.set([segment, frame, 3 * this.#rows * used++], at);
        floats[at + 3] = weight;
        at += SOURCE_WORDS;
      }
    });
    this.#grow("places", numbers.length);
    this.#grow("amplitudes", 3 * this.#rows * total);
    this.#write(this.buffers.places, numbers);
  }

  #show(pass, shows) {
    const { positions, matrices, vertices } = this.size, numbers = new Uint32Array(SHOW_WORDS * shows.length);
    const floats = new Float32Array(numbers.buffer);
    shows.forEach(({ slots, weight, previous = slots, previousWeight = weight, at = null }, i) => {
      const to = SHOW_WORDS * i;
      [...slots, ...previous].forEach((slot, k) => {
        numbers[to + k] = slot * positions;
        numbers[to + 4 + k] = slot * matrices;
      });
      floats[to + 8] = weight;
      floats[to + 9] = previousWeight;
      numbers[to + 10] = this.hasCorners ? 1 : 0;
      numbers[to + 11] = (at ?? i) * vertices;
    });
    this.#write(this.buffers.shows, numbers);
    this.#dispatch(pass, "vertices", [groups(this.words[VERTEX_COUNT]), shows.length],
      ["level", "corners", "shows", "positions", "matrices", "vertices"]);
  }

  /** Pass 3, read back: nine floats of each vertex of each show. */
  async read(shows) {
    this.run([], shows);
    const encoder = this.device.createCommandEncoder(), bytes = 4 * this.size.vertices * shows.length;
    const read = this.device.createBuffer({ size: bytes, usage: READ });
    encoder.copyBufferToBuffer(this.buffers.vertices, 0, read, 0, bytes);
    this.device.queue.submit([encoder.finish()]);
    await read.mapAsync(1);
    const floats = new Float32Array(read.getMappedRange().slice(0));
    read.destroy();
    return floats;
  }

  dispose() {
    for (const uniform of [...this.depths.map((depth) => depth.uniform), ...this.ordinals]) uniform.destroy();
    for (const [name, buffer] of Object.entries(this.buffers)) if (name !== "vertices" || this.ownsVertices) buffer.destroy();
  }
}
