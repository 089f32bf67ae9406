// Plays .ath files: the C decoder of athcodec as WebAssembly, and a wrapper around it. ath_decoder.d.ts
// documents what is exported, athcodec/core/include/ath.h what happens below. No dependencies, no fetch; browsers,
// workers, Node. ath_decoder.mjs is made from ath_decoder.template.mjs by build_decoder.py: edit the
// template.

const WASM = "@WASM@"; // zstd, base64

// @include web/zstd.js
// @include src/normals.js

const OK = 0, BAD_CHUNK = 9, MORE = 64, HELD = 65, MISSING = 66, NOT_PREPARED = 67, NO_MEMORY = 68, BAD_ARGUMENT = 69;
const ORDERS = { file: 0, source: 1 };
const MEASURES = { max: 0, p99: 1, rms: 2 };
const WRAPS = { clamp: 0, loop: 1, pingpong: 2, marked: 3 };
const HEADER_SIZE = 24, NO_LEVEL = 255, PAGE = 65536, MOST_STEPS = 0x7fffffff;

// The structs of ath.h, in order of declaration; wasm.c asserts that nothing has moved.
const INFO = {
  fileLength: "u64", preludeLength: "u64", maxError: "f64", originX: "f64", originY: "f64", originZ: "f64",
  vertexCount: "i32", placeCount: "i32", branchCount: "i32", frameCount: "i32", segmentCount: "i32", clipCount: "i32",
  levelCount: "i32", fullLevelCount: "i32", layerCount: "i32", depthLevels: "i32", nodeCount: "i32",
  chunkCount: "i32", isFloat64: "i32", restIsFloat64: "i32", restIsHost: "i32", meshForwards: "u32", meshBackwards: "u32",
  isPredicted: "i32",
};
const INFO_SIZE = 120;
const CLIP = {
  name: "u32", lastTime: "f64", firstFrame: "i32", frameCount: "i32", firstSegment: "i32", segmentCount: "i32",
  loop: "i32",
};
const CLIP_SIZE = 40;
const CHUNK = {
  fed: "u64", offset: "u64", length: "u32", checksum: "u32", segment: "u32", kind: "u16", level: "u8",
};
const CHUNK_SIZE = 32;
const BRANCH = ["parent", "count", "attach", "flags", "lag", "first", "subtree", "depth", "rigid", "detail", "ring"];
const PART = ["first", "count", "branch", "index"];
const FAULT = { code: "i32", field: "i32", chunk: "i32" }; // ath_fault_text reads the rest
const FAULT_SIZE = 56, LIMITS_SIZE = 40, FAULT_TEXT = 256, LEVEL_NAME = 32;
const POLYGONS = { faceCount: "u32", cornerCount: "u32", columns: "u32", isMixed: "u8", isDerived: "u8" };
const POLYGONS_SIZE = 16, POLYGON_KINDS = { faces: 5, edges: 0x8006 };
const METADATA = 0x8004, ATTRIBUTE = 0x8020;
const PACKED_ARRAY = {
  name: "u32", packed: "u32", packedBytes: "u64", bytes: "u64", nameBytes: "u32", kind: "u32", size: "u32", dimensions: "u32",
};
const PACKED_ARRAY_SIZE = 168, SHAPE = 40; // offset of the shape
const PACKED_TEXT = { packed: "u32", packedBytes: "u64", bytes: "u64", isPacked: "i32" };
const PACKED_TEXT_SIZE = 32;
// The arrays that hold the elements of each kind, by their bytes. Halves are widened, and texts become strings.
const [FLOATS, TEXTS] = [3, 4], ELEMENTS = [
  { 1: Uint8Array },
  { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array, 8: BigUint64Array },
  { 1: Int8Array, 2: Int16Array, 4: Int32Array, 8: BigInt64Array },
  { 2: Uint16Array, 4: Float32Array, 8: Float64Array },
];
const RANGE = { offset: "u64", size: "u64" };
const RANGE_SIZE = 16;
const SHARE_SIZE = 24, BLEND_CLIPS = 4;
const GPU_ROOM_SIZE = 28;
const FADE = { levels: 4, weights: 24, passed: 56 }, FADE_SIZE = 88, FADE_LEVELS = 4; // offsets of arrays
const TYPES = {
  u8: [1, (view, at) => view.getUint8(at)],
  u16: [2, (view, at) => view.getUint16(at, true)],
  u32: [4, (view, at) => view.getUint32(at, true)],
  i32: [4, (view, at) => view.getInt32(at, true)],
  f32: [4, (view, at) => view.getFloat32(at, true)],
  f64: [8, (view, at) => view.getFloat64(at, true)],
  u64: [8, (view, at) => Number(view.getBigUint64(at, true))],
};

// ---- the module ----

// A function that returns a vector: SIMD came to browsers last of all that the decoder needs.
const SIMD = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0,
  253, 15, 253, 98, 11];

export const supported = typeof WebAssembly === "object" && WebAssembly.validate(new Uint8Array(SIMD));

let module = null, shared = null;

async function compile() {
  if (!supported) throw new Error("ath_decoder: got no WebAssembly SIMD");
  const packed = Uint8Array.from(atob(WASM), (character) => character.charCodeAt(0));
  module = await WebAssembly.compile(zstd.decompress(packed));
}

export const ready = compile();
ready.catch(() => {}); // whoever awaits `ready` gets the error

export class AthError extends Error {
  constructor(code, codeName, message, { chunk = -1, needed = 0 } = {}) {
    super(`${codeName}: ${message}`);
    this.name = "AthError";
    this.code = code;
    this.codeName = codeName;
    this.chunk = chunk;
    this.needed = needed;
  }
}

// One instance and its memory, of which it hands out blocks aligned to 16. Memory moves when it grows: no
// view of it outlives a call.
class Core {
  constructor() {
    if (!module) throw new Error("ath_decoder: got a call before `await ready`");
    this.c = new WebAssembly.Instance(module).exports;
    this.end = Math.ceil(this.c.__heap_base.value / 16) * 16;
    this.free = []; // {at, size}, ascending, never neighbours
    this.sizes = new Map();
    this.small = 0;
  }

  take(bytes) {
    const size = Math.max(16, Math.ceil(bytes / 16) * 16);
    const i = this.free.findIndex((block) => block.size >= size);
    let at = this.end;
    if (i >= 0) {
      const block = this.free[i];
      at = block.at;
      block.at += size;
      block.size -= size;
      if (block.size === 0) this.free.splice(i, 1);
    } else {
      this.ensure(at + size);
      this.end += size;
    }
    this.sizes.set(at, size);
    return at;
  }

  ensure(end) {
    const missing = end - this.c.memory.buffer.byteLength;
    if (missing <= 0) return;
    try {
      this.c.memory.grow(Math.ceil(missing / PAGE));
    } catch {
      throw this.error(NO_MEMORY, `got no ${missing} bytes more from the host, expected ${end} in all`);
    }
  }

  // 0: nothing.
  give(at) {
    if (!at) return;
    const block = { at, size: this.sizes.get(at) };
    this.sizes.delete(at);
    let i = this.free.findIndex((other) => other.at > at);
    if (i < 0) i = this.free.length;
    const after = this.free[i], before = this.free[i - 1];
    if (after && at + block.size === after.at) block.size += this.free.splice(i, 1)[0].size;
    if (before && before.at + before.size === at) {
      before.size += block.size;
    } else {
      this.free.splice(i, 0, block);
    }
    const last = this.free[this.free.length - 1];
    if (last.at + last.size === this.end) this.end = this.free.pop().at;
  }

  // The first bytes of a block, moved to one of their size; 0: none.
  shrunk(at, bytes) {
    const kept = this.copy(Uint8Array, at, bytes);
    this.give(at);
    return bytes > 0 ? this.put(kept) : 0;
  }

  // A copy of a typed array, in memory.
  // The Buffer of Node.js is a Uint8Array, but warns when it is made from memory.
  put(array) {
    const at = this.take(array.byteLength);
    this.view(array instanceof Uint8Array ? Uint8Array : array.constructor, at, array.length).set(array);
    return at;
  }

  view(Type, at, length) {
    return new Type(this.c.memory.buffer, at, length);
  }

  copy(Type, at, length) {
    return this.view(Type, at >>> 0, length).slice();
  }

  // Returns what `call` returns, given `size` bytes of memory for its results.
  with(size, call) {
    const at = this.take(size);
    try {
      return call(at);
    } finally {
      this.give(at);
    }
  }

  struct(fields, at) {
    const view = new DataView(this.c.memory.buffer), result = {};
    for (const [name, type] of Object.entries(fields)) {
      const [size, read] = TYPES[type];
      at = Math.ceil(at / size) * size;
      result[name] = read(view, at);
      at += size;
    }
    return result;
  }

  // The ath_fade of an AthFade, at `at`; what it says.
  putFade(at, { levels, weights, passed = [] }) {
    this.view(Int32Array, at, 1 + FADE_LEVELS).set([levels.length, ...levels]);
    this.view(Float64Array, at + FADE.weights, FADE_LEVELS).set(weights);
    this.view(Float64Array, at + FADE.passed, FADE_LEVELS).set(passed);
  }

  fadeAt(at) {
    const [count] = this.view(Int32Array, at, 1), doubles = (from) => [...this.view(Float64Array, at + from, count)];
    return { levels: [...this.view(Int32Array, at + FADE.levels, count)], weights: doubles(FADE.weights),
      passed: doubles(FADE.passed) };
  }

  // An array of structs of int32 as an object of arrays.
  columns(names, at, count) {
    const rows = this.view(Int32Array, at >>> 0, count * names.length);
    return Object.fromEntries(names.map((name, k) =>
      [name, Int32Array.from({ length: count }, (_, i) => rows[i * names.length + k])]));
  }

  // A string that ends with a zero, of at most 255 bytes.
  text(at) {
    const bytes = new Uint8Array(this.c.memory.buffer).subarray(at >>> 0, (at >>> 0) + 256);
    return new TextDecoder("utf-8", { ignoreBOM: true }).decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  error(code, message, more) {
    return new AthError(code, this.text(this.c.ath_result_name(code)), message, more);
  }

  // The error of an ath_fault_info.
  faultError(at, more) {
    const { code, chunk } = this.struct(FAULT, at);
    const message = this.with(FAULT_TEXT, (text) => {
      this.c.ath_fault_text(at, text, FAULT_TEXT);
      return this.text(text);
    });
    return this.error(code, message, { chunk, ...more });
  }

  // Where the ath_limits of a profile stand; 0 for "full", whose limits are the default.
  limits(profile) {
    if (profile === "full") return 0;
    if (profile !== "small") throw new RangeError(`profile: got ${profile}, expected "full" or "small"`);
    if (!this.small) this.c.ath_small_limits(this.small = this.take(LIMITS_SIZE));
    return this.small;
  }

  // Looks at more and more of the front: {needed, error, memory, at}; `at` is a copy of the prelude if error is null.
  front(bytes, limits = 0) {
    return this.with(FAULT_SIZE + 8, (fault) => {
      const sizes = fault + FAULT_SIZE;
      let needed = HEADER_SIZE, code, memory;
      do {
        const available = Math.min(bytes.length, Math.max(needed, HEADER_SIZE));
        const at = this.put(bytes.subarray(0, available));
        code = this.c.ath_front(at, available, limits, sizes, sizes + 4, fault);
        [needed, memory] = this.copy(Uint32Array, sizes, 2);
        if (code === OK) return { needed, error: null, memory, at };
        this.give(at);
      } while (code === MISSING && needed <= bytes.length);
      return { needed, error: this.faultError(fault, code === MISSING ? { needed } : {}) };
    });
  }
}

// ---- arguments ----

function whole(value, low, high, what, hint = "") {
  if (Number.isInteger(value) && value >= low && value <= high) return value;
  throw new RangeError(`${what}: got ${value}, expected a whole number from ${low} to ${high}${hint}`);
}

function number(value, what) {
  if (typeof value === "number") return value;
  throw new TypeError(`${what}: got ${value}, expected a number`);
}

function choice(value, choices, what) {
  if (Object.hasOwn(choices, value)) return choices[value];
  throw new RangeError(`${what}: got ${value}, expected one of ${Object.keys(choices).join(", ")}`);
}

function asBytes(bytes) {
  if (bytes instanceof Uint8Array) return bytes;
  throw new TypeError("bytes: got something else, expected a Uint8Array");
}

function asOut(out, length, types) {
  const target = out === undefined ? new types[0](length) : out;
  if (types.some((Type) => target instanceof Type) && target.length >= length) return target;
  const names = types.map((Type) => Type.name).join(" or ");
  const got = `${target?.constructor?.name} of ${target?.length}`;
  throw new RangeError(`out: got ${got}, expected ${names} of ${length}`);
}

// ---- static data ----

const utf8 = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });

// Puts planes of bytes back into elements of `size` bytes.
function unshuffle(planes, count, size) {
  if (size === 1) return planes;
  const out = new Uint8Array(count * size);
  for (let k = 0; k < size; k++)
    for (let i = 0, from = k * count, to = k; i < count; i++, to += size) out[to] = planes[from + i];
  return out;
}

function widened(halves) {
  return Float32Array.from(halves, (bits) => {
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return sign * (exponent ? (1 + fraction / 1024) * 2 ** (exponent - 15) : fraction * 2 ** -24);
  });
}

function stringsOf(bytes, size) {
  return Array.from({ length: bytes.length / size }, (_, i) =>
    new TextDecoder().decode(bytes.subarray(i * size, (i + 1) * size)).replace(/\0+$/, ""));
}

// Returns the triangles of polygons as fans, as the C player makes them: `at(k)` is what stands for corner k.
function fans({ array, columns, counts }, at) {
  const faces = counts ? counts.length : array.length / (columns || 1), sizeOf = (face) => (counts ? counts[face] : columns);
  let count = 0, to = 0;
  for (let face = 0; face < faces; face++) count += Math.max(sizeOf(face) - 2, 0);
  const out = new Uint32Array(3 * count);
  for (let face = 0, first = 0; face < faces; first += sizeOf(face++))
    for (let k = 2; k < sizeOf(face); k++, to += 3) out.set([at(first), at(first + k - 1), at(first + k)], to);
  return out;
}

class Mesh {
  constructor(source, triangles, uv, colors) {
    Object.assign(this, { source, triangles, uv, colors });
  }

  gather(values, out) {
    const { source } = this, result = asOut(out, 3 * source.length, [Float32Array]);
    for (let i = 0; i < source.length; i++)
      for (let k = 0; k < 3; k++) result[3 * i + k] = values[3 * source[i] + k];
    return result;
  }
}

// ---- from level to level ----

export class AthFade {
  #state = { levels: [], weights: [], passed: [] };

  get levels() {
    return this.#state.levels;
  }

  get weights() {
    return this.#state.weights;
  }

  get cut() {
    return Math.max(-1, ...this.levels);
  }

  to(level, share) {
    whole(level, 0, NO_LEVEL - 1, "level");
    number(share, "share");
    shared ??= new Core();
    this.#state = shared.with(FADE_SIZE, (at) => {
      shared.putFade(at, this.#state);
      shared.c.ath_fade_to(at, level, share);
      return shared.fadeAt(at);
    });
    return this;
  }
}

// ---- segments ----

class Segment {
  #release;

  constructor(index, level, release) {
    this.index = index;
    this.level = level;
    this.#release = release;
  }

  get freed() {
    return this.#release === null;
  }

  free() {
    const release = this.#release;
    this.#release = null;
    if (release) release(this);
  }
}

class Preparation {
  #step;
  #cancel;
  #steps; // the largest number that it takes
  #done = 0;

  constructor(index, level, steps, step, cancel) {
    this.index = index;
    this.level = level;
    this.segment = null;
    this.#steps = steps;
    this.#step = step;
    this.#cancel = cancel;
  }

  get progress() {
    return this.segment ? 1 : Math.min(this.#done / this.#steps, 1);
  }

  step(steps = 16) {
    if (this.segment) return true;
    if (!this.#step) throw new Error("step: got a preparation that has ended, expected one under way");
    whole(steps, 1, MOST_STEPS, "steps");
    try {
      this.segment = this.#step(steps);
      this.#done += steps;
    } catch (error) {
      this.#step = null;
      throw error;
    }
    return this.segment !== null;
  }

  cancel() {
    if (this.#step && !this.segment) this.#cancel();
    this.#step = null;
  }
}

// ---- files ----

export class AthFile {
  info = null;
  clips = [];
  held = false;
  needsHostMesh = true;   // until the rest pose is known
  #own = null;            // the Core, until dispose()
  #at = 0;                // the ath_file
  #chunks = [];           // as chunks() has them; `at`: a copy of their bytes, of which `filled` are there
  #pointers = new Map();  // By prepared segment: {at, kept}.
  #preparing = new Map(); // index of a segment: how many preparations that may read it are under way
  #works = [];            // ath_works that nobody uses
  #scratch = { at: 0, size: 0 };
  #cutSizes = [];
  #triangles = null;      // those of normals()

  static front(bytes) {
    shared ??= new Core();
    const front = shared.front(asBytes(bytes));
    if (front.error && front.error.code !== MISSING) throw front.error;
    if (!front.error) shared.give(front.at);
    return { ready: !front.error, needed: front.needed };
  }

  static open(bytes, { hostMesh = null, profile = "full" } = {}) {
    const file = new AthFile();
    file.#open(asBytes(bytes), profile);
    if (hostMesh) file.setHostMesh(hostMesh);
    return file;
  }

  #open(bytes, profile) {
    const core = new Core(), c = core.c, limits = core.limits(profile);
    const front = core.front(bytes, limits);
    if (front.error) throw front.error;
    this.#own = core;
    this.#at = core.take(front.memory);
    this.#checkFault((fault) => c.ath_open(this.#at, front.memory, front.at, front.needed, limits, fault));
    this.info = this.#info();
    this.#chunks = this.#chunkTable();
    this.clips = this.#clipTable();
    if (!this.info.restIsHost) this.#build();
    this.feed(bytes, 0);
  }

  #build() {
    const c = this.#c, size = c.ath_build_size(this.#at) >>> 0;
    this.#check(c.ath_build(this.#at, this.#core.take(size), size), `the bases of the motion, ${size} bytes`);
    this.needsHostMesh = false;
  }

  setHostMesh(mesh) {
    const c = this.#c;
    if (!(mesh instanceof Float32Array) || mesh.length % 3 !== 0)
      throw new TypeError("mesh: got something else, expected a Float32Array of three numbers per vertex");
    if (!this.needsHostMesh) return;
    const at = this.#core.put(mesh);
    try {
      this.#checkFault((fault) => c.ath_set_host_mesh(this.#at, at, 12, mesh.length / 3, fault));
    } finally {
      this.#core.give(at);
    }
    this.#build();
  }

  #info() {
    const info = this.#core.with(INFO_SIZE, (at) => {
      this.#core.c.ath_get_info(this.#at, at);
      return this.#core.struct(INFO, at);
    });
    const { originX, originY, originZ, isFloat64, restIsFloat64, restIsHost, isPredicted, meshForwards, meshBackwards, ...rest } = info;
    const origin = [originX, originY, originZ], hex = (number) => number.toString(16).padStart(8, "0");
    return Object.freeze({ ...rest, origin, isFloat64: isFloat64 !== 0, restIsFloat64: restIsFloat64 !== 0,
      restIsHost: restIsHost !== 0, isPredicted: isPredicted !== 0, hostChecksum: restIsHost ? hex(meshForwards) + hex(meshBackwards) : null });
  }

  #clipTable() {
    const at = this.#core.c.ath_clips(this.#at) >>> 0;
    return Object.freeze(Array.from({ length: this.info.clipCount }, (_, i) => {
      const { name, loop, ...clip } = this.#core.struct(CLIP, at + i * CLIP_SIZE), { lastTime, frameCount } = clip;
      const back = loop && frameCount > 1 ? lastTime / (frameCount - 1) : 0; // from the last frame to the first
      return Object.freeze({ name: this.#core.text(name), loop: loop !== 0, duration: lastTime + back, ...clip });
    }));
  }

  #chunkTable() {
    const at = this.#core.c.ath_chunks(this.#at) >>> 0, chunks = [];
    for (let i = 0; i < this.info.chunkCount; i++) {
      const chunk = this.#core.struct(CHUNK, at + i * CHUNK_SIZE);
      chunk.fed = (chunk.fed >>> 0) !== 0; // the upper half is no part of the pointer
      chunks.push({ ...chunk, at: 0, filled: 0 }); // the prelude's are in the copy that ath_open has
    }
    return chunks;
  }

  get #core() {
    if (this.#own) return this.#own;
    throw new Error("AthFile: got a call after dispose(), expected none");
  }

  get #c() {
    return this.#core.c;
  }

  #check(code, what) {
    if (code !== OK) throw this.#core.error(code, what);
  }

  // Returns what `call` returns, given the address of a fault; throws that fault unless the code is `allowed`.
  #checkFault(call, allowed = OK) {
    return this.#core.with(FAULT_SIZE, (fault) => {
      const code = call(fault);
      if (code !== OK && code !== allowed) throw this.#core.faultError(fault);
      return code;
    });
  }

  #checkWork(code, work) {
    if (code === OK) return;
    throw this.#core.with(FAULT_SIZE, (fault) => {
      this.#c.ath_work_fault(work, fault);
      return this.#core.faultError(fault);
    });
  }

  #level(level) {
    return whole(level, 0, this.info.levelCount - 1, "level", level === undefined ? "; levelFor() and readyLevel() return one" : "");
  }

  #segment(segment) {
    return whole(segment, 0, this.info.segmentCount - 1, "segment");
  }

  // Its number, given that or its name.
  #clip(clip) {
    if (typeof clip !== "string") return whole(clip, 0, this.clips.length - 1, "clip");
    const index = this.clips.findIndex(({ name }) => name === clip);
    if (index >= 0) return index;
    throw new RangeError(`clip: got ${clip}, expected one of ${this.clips.map(({ name }) => name).join(", ")}`);
  }

  // ---- what it holds ----

  branches() {
    return this.#core.columns(BRANCH, this.#c.ath_branches(this.#at), this.info.branchCount);
  }

  vertexSource() {
    return this.#core.copy(Int32Array, this.#c.ath_vertex_source(this.#at), this.info.placeCount);
  }

  vertexPlaces() {
    return this.#core.copy(Int32Array, this.#c.ath_vertex_places(this.#at), this.info.vertexCount);
  }

  branchSource() {
    return this.#core.copy(Int32Array, this.#c.ath_branch_source(this.#at), this.info.branchCount);
  }

  times() {
    return this.#core.copy(Float64Array, this.#c.ath_times(this.#at), this.info.frameCount);
  }

  rest(order = "source", { out, relative = false } = {}) {
    this.#checkFault((fault) => this.#c.ath_read_rest(this.#at, fault));
    return this.#pose(out, order, relative, (which, at) => this.#c.ath_rest_float64(this.#at, which, at, 24));
  }

  levelRest(level, order = "source", { out, relative = false } = {}) {
    this.#refineSize(this.#level(level));
    return this.#pose(out, order, relative, (which, at) => this.#c.ath_level_rest(this.#at, level, which, at, 24));
  }

  // Its number, and the numbers of all its vertices.
  #order(order) {
    const which = choice(order, ORDERS, "order");
    return [which, 3 * (which === ORDERS.file ? this.info.placeCount : this.info.vertexCount)];
  }

  #pose(out, order, relative, fill) {
    const [which, length] = this.#order(order), result = asOut(out, length, [Float32Array, Float64Array]);
    const pose = this.#fill(new Float64Array(length), length, (at) => fill(which, at));
    result.set(relative ? this.#relative(pose) : pose);
    return result;
  }

  // Takes the origin from positions, before they become floats.
  #relative(positions) {
    const { origin } = this.info;
    for (let i = 0; i < positions.length; i++) positions[i] -= origin[i % 3];
    return positions;
  }

  levelError(level, first = 0, last = this.info.segmentCount - 1) {
    this.#level(level);
    this.#segment(first);
    this.#segment(last);
    const error = (measure) => this.#c.ath_level_error(this.#at, level, first, last, measure);
    return { max: error(MEASURES.max), p99: error(MEASURES.p99), rms: error(MEASURES.rms) };
  }

  levelName(level) {
    this.#level(level);
    return this.#core.with(LEVEL_NAME, (text) => {
      this.#c.ath_level_name(this.#at, level, text, LEVEL_NAME);
      return this.#core.text(text);
    });
  }

  seamError(clip, level) {
    whole(level, 0, this.info.fullLevelCount - 1, "level");
    return this.#c.ath_seam_error(this.#at, this.#clip(clip), level);
  }

  segmentStart(segment) {
    return this.#c.ath_segment_start(this.#at, whole(segment, 0, this.info.segmentCount, "segment"));
  }

  segmentOf(frame) {
    return this.#c.ath_segment_of(this.#at, whole(frame, 0, this.info.frameCount - 1, "frame"));
  }

  chunks() {
    return this.#chunks.map(({ kind, level, segment, offset, length, checksum, fed }) =>
      ({ kind, level, segment, offset, length, checksum, fed }));
  }

  chunkBytes(index) {
    const c = this.#c;
    whole(index, 0, this.info.chunkCount - 1, "index");
    if (this.#checkFault((fault) => c.ath_check_chunk(this.#at, index, fault), MISSING) === MISSING) return null;
    const at = (c.ath_chunks(this.#at) >>> 0) + index * CHUNK_SIZE;
    return this.#core.copy(Uint8Array, this.#core.view(Uint32Array, at, 1)[0], this.#chunks[index].length);
  }

  polygons(name) {
    const c = this.#c, core = this.#core, kind = choice(name, POLYGON_KINDS, "polygons");
    if (!this.#chunks.some((chunk) => chunk.kind === kind)) return null;
    const { faceCount, cornerCount, columns, isMixed, isDerived } = core.with(POLYGONS_SIZE, (at) => {
      this.#checkFault((fault) => c.ath_polygons_of(this.#at, kind, at, fault));
      return core.struct(POLYGONS, at);
    });
    const size = c.ath_polygons_size(this.#at), corners = Math.ceil(size / 16) * 16, counts = corners + 4 * cornerCount;
    return core.with(counts + 4 * isMixed * faceCount, (at) => {
      this.#checkFault((fault) =>
        c.ath_read_polygons(this.#at, kind, at, size, isMixed ? at + counts : 0, at + corners, fault));
      return {
        array: core.copy(Uint32Array, at + corners, cornerCount),
        columns,
        counts: isMixed ? core.copy(Uint32Array, at + counts, faceCount) : null,
        derived: isDerived === 1,
      };
    });
  }

  // ---- static data ----

  #wrong(index, what, code = BAD_CHUNK) {
    return this.#core.error(code, what, { chunk: index });
  }

  // What the frame of a chunk holds, whose head the core has checked.
  #unpacked(index, { packed, packedBytes, bytes }) {
    let content = null;
    try {
      content = zstd.decompress(this.#core.copy(Uint8Array, packed, packedBytes));
    } catch {
      // A frame that is damaged gives no content.
    }
    if (content?.length === bytes) return content;
    throw this.#wrong(index, `chunk ${index}: got a damaged zstd frame, expected ${bytes} bytes in it`);
  }

  metadata() {
    const index = this.#chunks.findIndex(({ kind }) => kind === METADATA), core = this.#core;
    if (index < 0) return {};
    const text = core.with(PACKED_TEXT_SIZE, (at) => {
      this.#checkFault((fault) => this.#c.ath_metadata_of(this.#at, at, fault));
      return core.struct(PACKED_TEXT, at);
    });
    const bytes = text.isPacked ? this.#unpacked(index, text) : core.copy(Uint8Array, text.packed, text.packedBytes);
    try {
      return JSON.parse(utf8.decode(bytes));
    } catch {
      throw this.#wrong(index, "metadata: got something else, expected a JSON object in UTF-8");
    }
  }

  // The static array of a chunk: its head, and where its frame stands.
  #array(index) {
    const core = this.#core;
    return core.with(PACKED_ARRAY_SIZE, (at) => {
      this.#checkFault((fault) => this.#c.ath_array_of(this.#at, index, at, fault));
      const array = core.struct(PACKED_ARRAY, at), shape = [...core.view(Uint32Array, at + SHAPE, array.dimensions)];
      return { ...array, name: utf8.decode(core.copy(Uint8Array, array.name, array.nameBytes)), shape };
    });
  }

  // The chunks of static arrays, as {index, fed}.
  #arrays() {
    return this.#chunks.flatMap(({ kind, fed }, index) => (kind === ATTRIBUTE ? [{ index, fed }] : []));
  }

  attributeNames() {
    return this.#arrays().filter(({ fed }) => fed).map(({ index }) => this.#array(index).name);
  }

  attributeRanges() {
    return this.#ranges((at, capacity) => this.#c.ath_array_ranges(this.#at, at, capacity));
  }

  attribute(name) {
    const arrays = this.#arrays(), left = arrays.find(({ fed }) => !fed);
    let failure = null; // of an array before, whose name may be this one
    for (const { index } of arrays.filter(({ fed }) => fed)) {
      try {
        if (this.#array(index).name !== name) continue;
      } catch (error) {
        failure ??= error;
        continue;
      }
      return this.#elements(index);
    }
    if (failure) throw failure;
    if (left) throw this.#core.error(MISSING, `static array ${name}: got no bytes of chunk ${left.index}, which may hold it; expected those `
      + "of attributeRanges()", { chunk: left.index });
    return null;
  }

  #elements(index) {
    const head = this.#array(index), { kind, size, shape } = head, count = head.bytes / size;
    const bytes = count > 0 ? unshuffle(this.#unpacked(index, head), count, size) : new Uint8Array(0);
    if (kind === TEXTS) return { array: stringsOf(bytes, size), shape };
    const whole = bytes.byteOffset % size ? bytes.slice() : bytes, array = new ELEMENTS[kind][size](whole.buffer, whole.byteOffset, count);
    return { array: kind === FLOATS && size === 2 ? widened(array) : array, shape };
  }

  // ---- surfaces ----

  // The faces of FACES, or of the two arrays that other programs keep faces of different sizes in; null where there are none.
  #faces() {
    const faces = this.polygons("faces"), names = faces ? [] : this.attributeNames();
    if (faces || !["face_vertex_counts", "face_vertex_indices"].every((name) => names.includes(name))) return faces;
    const [counts, array] = ["face_vertex_counts", "face_vertex_indices"].map((name) => Uint32Array.from(this.attribute(name).array, Number));
    const corners = counts.reduce((sum, count) => sum + count, 0), vertex = array.find((each) => each >= this.info.vertexCount);
    if (corners === array.length && vertex === undefined) return { array, columns: 0, counts };
    throw this.#core.error(BAD_CHUNK, `face_vertex_indices: got ${array.length} corners${vertex === undefined ? "" : ` and vertex ${vertex}`}, `
      + `expected ${corners} of ${this.info.vertexCount} vertices`);
  }

  triangles() {
    const faces = this.#faces();
    return faces && fans(faces, (corner) => faces.array[corner]);
  }

  normals(positions, { out } = {}) {
    const result = asOut(out, positions.length, [Float32Array]);
    if (positions.length !== 3 * this.info.vertexCount)
      throw new RangeError(`positions: got ${positions.length} numbers, expected ${3 * this.info.vertexCount}, in the source's order`);
    this.#triangles ??= this.triangles() ?? new Uint32Array(0);
    result.set(normals(positions, { array: this.#triangles, columns: 3 }));
    return result;
  }

  // An array with a row per corner or vertex, as floats; null where there is none that fits.
  #rows(name, sizes, perCorner, rows) {
    const stored = this.attribute(name), { shape, array } = stored ?? {};
    if (shape?.length !== 2 || shape[0] !== rows || !sizes.includes(shape[1]) || typeof array[0] !== "number") return null;
    const scale = array instanceof Uint8Array ? 1 / 255 : 1;
    return { values: Float32Array.from(array, (value) => value * scale), size: shape[1], perCorner };
  }

  mesh() {
    const faces = this.#faces() ?? { array: new Uint32Array(0), columns: 3, counts: null };
    const domains = this.metadata().domains ?? {}, { vertexCount } = this.info, corners = faces.array;
    const [uv, colors] = [["uv", [2]], ["colors", [3, 4]]].map(([name, sizes]) =>
      this.#rows(name, sizes, domains[name] === "corner", domains[name] === "corner" ? corners.length : vertexCount));
    const split = [uv, colors].filter((rows) => rows?.perCorner);
    let source = Uint32Array.from({ length: vertexCount }, (_, i) => i), first = source, at = (corner) => corners[corner];
    if (split.length > 0) { // corners of one vertex and one look are one vertex of the mesh
      const numbers = new Map(), of = new Uint32Array(corners.length), kept = [];
      corners.forEach((vertex, corner) => {
        const look = split.flatMap(({ values, size }) => [...values.subarray(corner * size, (corner + 1) * size)]), key = `${vertex},${look}`;
        if (!numbers.has(key)) numbers.set(key, kept.push(corner) - 1);
        of[corner] = numbers.get(key);
      });
      first = Uint32Array.from(kept);
      source = first.map((corner) => corners[corner]);
      at = (corner) => of[corner];
    }
    const rowsOfCorners = (rows, size) => rows && Float32Array.from({ length: size * source.length }, (_, i) => {
      const from = rows.perCorner ? first[Math.floor(i / size)] : source[Math.floor(i / size)], k = i % size;
      return k < rows.size ? rows.values[from * rows.size + k] : 1;
    });
    return new Mesh(source, fans(faces, at), rowsOfCorners(uv, 2), rowsOfCorners(colors, 4));
  }

  // ---- bytes ----

  // First chunk that ends behind `offset`.
  #chunkAt(offset) {
    let low = 0, high = this.#chunks.length;
    while (low < high) {
      const middle = (low + high) >> 1, chunk = this.#chunks[middle];
      if (chunk.offset + chunk.length <= offset) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // Chunks are copied one by one, so that each can be dropped; one that ends in a later piece waits for it.
  feed(bytes, offset) {
    const c = this.#c, end = whole(offset, 0, Number.MAX_SAFE_INTEGER, "offset") + asBytes(bytes).length;
    for (let i = this.#chunkAt(offset); i < this.#chunks.length && this.#chunks[i].offset < end; i++) {
      const chunk = this.#chunks[i], start = chunk.offset + chunk.filled;
      if (chunk.fed || start < offset || start >= end) continue;
      if (!chunk.at) chunk.at = this.#core.take(chunk.length);
      const piece = bytes.subarray(start - offset, Math.min(end, chunk.offset + chunk.length) - offset);
      this.#core.view(Uint8Array, chunk.at + chunk.filled, piece.length).set(piece);
      chunk.filled += piece.length;
      chunk.fed = chunk.filled === chunk.length;
      if (chunk.fed) c.ath_feed(this.#at, chunk.at, BigInt(chunk.offset), chunk.length);
    }
  }

  drop(offset, size) {
    const c = this.#c, end = whole(offset, 0, Number.MAX_SAFE_INTEGER, "offset") + number(size, "size");
    const dropped = [];
    for (let i = this.#chunkAt(offset); i < this.#chunks.length && this.#chunks[i].offset < end; i++)
      if (this.#chunks[i].at) dropped.push(this.#chunks[i]);
    const busy = dropped.find((chunk) => chunk.level !== NO_LEVEL && this.#preparing.has(chunk.segment));
    if (busy) throw new Error(`drop: got bytes of segment ${busy.segment}, which is in preparation`);
    for (const chunk of dropped) {
      c.ath_drop(this.#at, BigInt(chunk.offset), BigInt(chunk.length));
      this.#core.give(chunk.at);
      Object.assign(chunk, { at: 0, filled: 0, fed: false });
    }
  }

  ranges(level, first = 0, last = this.info.segmentCount - 1, all = false, after = -1) {
    const c = this.#c;
    this.#level(level);
    this.#segment(first);
    this.#segment(last);
    whole(after, -1, level, "after");
    const list = (at, capacity) => (after < 0 ? c.ath_ranges(this.#at, level, first, last, all ? 1 : 0, at, capacity)
      : c.ath_onward_ranges(this.#at, after, level, first, last, all ? 1 : 0, at, capacity));
    return this.#ranges(list);
  }

  // list: as ath_ranges.
  #ranges(list) {
    const count = list(0, 0);
    return this.#core.with(count * RANGE_SIZE, (at) => {
      list(at, count);
      return Array.from({ length: count }, (_, i) => this.#core.struct(RANGE, at + i * RANGE_SIZE));
    });
  }

  readyLevel(segment) {
    return this.#c.ath_ready_level(this.#at, this.#segment(segment));
  }

  // ---- levels ----

  // Numbers of parts, nodes and exact vertices; they take a walk over the plant.
  #cutSize(level) {
    const c = this.#c;
    return this.#cutSizes[level] ??= this.#core.with(12, (at) => {
      c.ath_cut_size(this.#at, level, at, at + 4, at + 8);
      return this.#core.copy(Int32Array, at, 3);
    });
  }

  parts(level) {
    const c = this.#c, [count, nodeCount, exactCount] = this.#cutSize(this.#level(level));
    return this.#core.with(count * 4 * PART.length, (at) => {
      c.ath_cut(this.#at, level, at);
      return { partCount: count, nodeCount, exactCount, ...this.#core.columns(PART, at, count) };
    });
  }

  levelFor(distance, fov, height, pixels, first = 0, last = this.info.segmentCount - 1, measure = "max") {
    return this.#c.ath_level_for(this.#at, this.#segment(first), this.#segment(last),
      choice(measure, MEASURES, "measure"), number(distance, "distance"), number(fov, "fov"),
      number(height, "height"), number(pixels, "pixels"));
  }

  // ---- preparing ----

  joinedTo(segment, level) {
    return this.#c.ath_joined_to(this.#at, this.#segment(segment), this.#level(level));
  }

  preparation(segment, level, { from = null, keep = false, following = null } = {}) {
    const c = this.#c, core = this.#core;
    this.#segment(segment);
    this.#level(level);
    const workSize = c.ath_work_size(this.#at) >>> 0, size = c.ath_segment_size(this.#at, level) >>> 0;
    let before = this.#pointer(from) && from.index === segment ? this.#pointers.get(from) : null, at = 0, kept = 0;
    const work = this.#works.pop() ?? core.take(workSize);
    const reads = [segment, this.joinedTo(segment, level)].filter((index) => index >= 0);
    let steps = c.ath_prepare_steps(this.#at, segment, level); // half of which decode the segment that this one is joined to
    const end = () => {
      this.#works.push(work);
      for (const index of reads) {
        const left = this.#preparing.get(index) - 1;
        if (left > 0) this.#preparing.set(index, left);
        else this.#preparing.delete(index);
      }
    };
    const fail = () => {
      end();
      core.give(at);
      core.give(kept);
    };
    const step = (count) => {
      if (before && from.freed) {
        fail();
        throw new Error("step: got a freed segment");
      }
      const code = this.#c.ath_prepare_step(work, count);
      if (code === MORE) return null;
      try {
        this.#checkWork(code, work);
      } catch (error) {
        fail();
        throw error;
      }
      end();
      return this.#prepared(segment, level, at, kept && core.shrunk(kept, this.#c.ath_kept_size(kept) >>> 0));
    };
    for (const index of reads) this.#preparing.set(index, (this.#preparing.get(index) ?? 0) + 1);
    try {
      this.#refine(level);
      at = core.take(size);
      let code = BAD_ARGUMENT; // Such a segment cannot be gone on from.
      if (before) code = c.ath_prepare_onward(work, workSize, this.#at, before.at, before.kept, level, at, size);
      if (code === BAD_ARGUMENT) {
        before = null;
        code = c.ath_prepare_start(work, workSize, this.#at, segment, level, at, size);
      }
      if (code === MISSING) this.#checkWork(code, work);
      this.#check(code, `segment ${segment} at level ${level}`);
      const room = keep ? Math.min(c.ath_keep_size(this.#at, level) >>> 0, size >>> 1) : 0; // a hundredth is usual
      if (room >= 16) c.ath_keep(work, kept = core.take(room), room);
      const follows = this.#pointer(following) && c.ath_follow(work, this.#pointers.get(following).at) === OK; // or decodes it anew
      if (follows && reads.length > 1) steps = Math.ceil(steps / 2);
    } catch (error) {
      fail();
      throw error;
    }
    return new Preparation(segment, level, steps, step, fail);
  }

  // Builds what the segments share at a level, in memory that stays as long as the file.
  #refine(level) {
    const size = this.#refineSize(level);
    const code = this.#c.ath_refine(this.#at, level, size > 0 ? this.#core.take(size) : 0, size);
    this.#check(code, `the layers of level ${level}, ${size} bytes`);
  }

  // The bytes for that, once the rest poses up to the level's are read.
  #refineSize(level) {
    return this.#core.with(4, (at) => {
      this.#checkFault((fault) => this.#c.ath_refine_size(this.#at, level, at, fault));
      return this.#core.copy(Uint32Array, at, 1)[0];
    });
  }

  #prepared(index, level, at, kept) {
    const segment = new Segment(index, level, (freed) => {
      this.#pointers.delete(freed);
      this.#own?.give(at);
      this.#own?.give(kept);
    });
    this.#pointers.set(segment, { at, kept });
    return segment;
  }

  prepare(segment, level, options) {
    const preparation = this.preparation(segment, level, options);
    while (!preparation.step(MOST_STEPS));
    return preparation.segment;
  }

  // ---- playing ----

  frameAt(seconds, wrap = "clamp", clip = 0) {
    return this.#c.ath_frame_at(this.#at, this.#clip(clip), number(seconds, "seconds"), choice(wrap, WRAPS, "wrap"));
  }

  // The memory that results pass through, `bytes` at least.
  #passage(bytes) {
    if (bytes > this.#scratch.size) {
      this.#core.give(this.#scratch.at);
      this.#scratch = { at: 0, size: 0 };
      this.#scratch = { at: this.#core.take(bytes), size: bytes };
    }
    return this.#scratch.at;
  }

  // lacking: says which segment `call` lacks, where it does.
  #fill(out, length, call, lacking) {
    const at = this.#passage(length * out.BYTES_PER_ELEMENT), code = call(at);
    this.held = code === HELD;
    if (code === NOT_PREPARED) throw this.#core.error(NOT_PREPARED, lacking());
    if (code !== HELD) this.#check(code, "playing");
    out.set(this.#core.view(out.constructor, at, length));
    return out;
  }

  // Returns what `call` shows of segments, given the address of an array of pointers to them, and their number. levels: those
  // of a fade.
  #show(segments, frame, out, length, call, levels) {
    number(frame, "frame");
    const pointers = Array.from(segments, (segment) => this.#pointer(segment));
    return this.#core.with(4 * pointers.length, (array) => {
      this.#core.view(Uint32Array, array, pointers.length).set(pointers);
      return this.#fill(out, length, (at) => call(array, pointers.length, at), () => this.#lacking(segments, frame, levels));
    });
  }

  // What is wrong where none of the segments has a frame, and what prepares one that has. levels: those that are needed.
  #lacking(segments, frame, levels = []) {
    const there = Array.from(segments).filter((segment) => segment && !segment.freed), segmentOfFrame = this.#segmentAt(frame);
    const got = there.map(({ index, level }) => `segment ${index} at level ${level}`).join(", ") || "no segment";
    const wanted = levels.length > 0 ? levels : [there[0]?.level ?? Math.max(this.readyLevel(segmentOfFrame), 0)];
    const calls = [...new Set(wanted)].map((level) => `prepare(${segmentOfFrame}, ${level})`).join(" and ");
    return `frame ${frame}: got ${got}, expected segment ${segmentOfFrame}, the one of ${this.info.segmentCount} that has this frame: pass `
      + `what ${calls} returns; segmentOf(Math.floor(frame)) is its number`;
  }

  // The segment that has a frame, which may be fractional or beyond the file's.
  #segmentAt(frame) {
    return this.segmentOf(Math.min(Math.max(Math.floor(frame) || 0, 0), this.info.frameCount - 1));
  }

  #pointer(segment) {
    const at = segment ? this.#pointers.get(segment)?.at : 0;
    if (at !== undefined) return at;
    if (segment instanceof Segment && segment.freed) return 0;
    throw new TypeError("segments: got something else, expected what prepare() of this file returned");
  }

  // Returns what `call` shows, given the address of an ath_fade, too: levels and their weights.
  #showFaded(fade, segments, frame, out, length, call) {
    whole(fade.levels.length, 1, FADE_LEVELS, "levels of fade");
    if (!(out instanceof Float32Array)) throw new TypeError("out: got something else, expected a Float32Array of a fade");
    return this.#core.with(FADE_SIZE, (at) => {
      this.#core.putFade(at, fade);
      const deepest = Math.max(...fade.levels), levels = fade.levels.filter((level, i) => fade.weights[i] > 0 || level === deepest);
      return this.#show(segments, frame, out, length, (array, count, to) => call(array, count, at, to), levels);
    });
  }

  // The largest of column `k` of #cutSize over the levels: of a fade, of segments where there is none.
  #most(segments, fade, k) {
    if (fade) return this.#cutSize(this.#level(Math.max(...fade.levels)))[k];
    const levels = new Set(Array.from(segments).filter(Boolean).map((segment) => segment.level));
    return Math.max(0, ...Array.from(levels, (level) => this.#cutSize(this.#level(level))[k]));
  }

  positions(segments, frame, { out, order = "source", fade = null, relative = false } = {}) {
    const c = this.#c, [which, length] = this.#order(order);
    const result = asOut(out, length, [Float32Array, Float64Array]);
    if (relative) return this.#relativePositions(segments, frame, result, length, order, fade);
    if (fade) return this.#showFaded(fade, segments, frame, result, length, (array, count, faded, at) =>
      c.ath_faded_positions(this.#at, array, count, frame, faded, which, at, 12));
    return this.#show(segments, frame, result, length, (array, count, at) => result instanceof Float64Array
      ? c.ath_positions_float64(this.#at, array, count, frame, which, at, 24)
      : c.ath_positions(this.#at, array, count, frame, which, at, 12));
  }

  // The levels of a fade are added up here, as the core adds up floats, which are too coarse far from the origin.
  #relativePositions(segments, frame, result, length, order, fade) {
    const shown = (some) => this.#relative(this.positions(some, frame, { out: new Float64Array(length), order }));
    if (!fade) {
      result.set(shown(segments));
      return result;
    }
    const shares = new Map();
    fade.levels.forEach((level, i) => shares.set(level, (shares.get(level) ?? 0) + fade.weights[i]));
    const sum = new Float64Array(length), all = Array.from(segments).filter((segment) => segment && !segment.freed);
    for (const [level, weight] of shares) {
      if (weight === 0) continue;
      const segmentsOfLevel = all.filter((segment) => segment.level === level);
      if (segmentsOfLevel.length === 0) throw this.#core.error(NOT_PREPARED, this.#lacking(segments, frame, [level]));
      shown(segmentsOfLevel).forEach((value, i) => { sum[i] += weight * value; });
    }
    result.set(sum);
    return result;
  }

  // Shares are { segments, frame, weight }.
  blended(shares, { out, order = "source" } = {}) {
    const c = this.#c, core = this.#core, [which, length] = this.#order(order);
    const result = asOut(out, length, [Float32Array]), count = whole(shares.length, 1, BLEND_CLIPS, "clips to blend");
    const pointers = shares.map(({ segments }) => Array.from(segments, (segment) => this.#pointer(segment)));
    const table = count * SHARE_SIZE, scratch = c.ath_blend_size(this.#at) >>> 0;
    const start = Math.ceil((table + 4 * pointers.flat().length) / 16) * 16;
    return core.with(start + scratch, (at) => {
      let next = at + table;
      for (const [i, { frame, weight }] of shares.entries()) {
        const pointer = pointers[i];
        core.view(Uint32Array, next, pointer.length).set(pointer);
        core.view(Int32Array, at + i * SHARE_SIZE, 2).set([next, pointer.length]);
        core.view(Float64Array, at + i * SHARE_SIZE + 8, 2).set([number(frame, "frame"), number(weight, "weight")]);
        next += 4 * pointer.length;
      }
      return this.#fill(result, length, (to) =>
        c.ath_blended_positions(this.#at, at, count, which, to, 12, at + start, scratch), () => {
        const has = ({ segments, frame }) => Array.from(segments).some((segment) => segment && !segment.freed
          && [frame, Math.ceil(frame)].some((each) => segment.index === this.#segmentAt(each)));
        const { segments, frame } = shares.find((share) => share.weight > 0 && !has(share)) ?? shares[0];
        return this.#lacking(segments, frame);
      });
    });
  }

  // Weights of clips, given { strength, heading } of each, null for one without.
  windWeights(winds, strength, heading) {
    const c = this.#c, count = winds.length;
    return this.#core.with(24 * count, (at) => {
      this.#core.view(Float64Array, at, 2 * count).set(winds.flatMap((wind) =>
        wind ? [number(wind.strength, "strength"), number(wind.heading ?? 0, "heading")] : [NaN, 0]));
      c.ath_wind_weights(at, count, number(strength, "strength"), number(heading, "heading"), at + 16 * count);
      return Array.from(this.#core.view(Float64Array, at + 16 * count, count));
    });
  }

  matrices(segments, frame, { out, fade = null, relative = false } = {}) {
    const c = this.#c, length = 12 * this.#most(segments, fade, 1);
    const result = asOut(out, length, [Float32Array, Float64Array]);
    if (relative && fade) throw new TypeError("relative: got true and a fade, expected one of the two");
    if (relative) return this.#relativeMatrices(segments, frame, result, length);
    if (fade) return this.#showFaded(fade, segments, frame, result, length, (array, count, faded, at) =>
      c.ath_faded_matrices(this.#at, array, count, frame, faded, at, 48));
    return this.#show(segments, frame, result, length, (array, count, at) => result instanceof Float64Array
      ? c.ath_matrices_float64(this.#at, array, count, frame, at, 96)
      : c.ath_matrices(this.#at, array, count, frame, at, 48));
  }

  // Matrices that take a rest pose less the origin to positions less the origin.
  #relativeMatrices(segments, frame, result, length) {
    const m = this.matrices(segments, frame, { out: new Float64Array(length) }), { origin: [x, y, z] } = this.info;
    for (let i = 0; i < length; i += 4) m[i + 3] += m[i] * x + m[i + 1] * y + m[i + 2] * z - this.info.origin[i / 4 % 3];
    result.set(m);
    return result;
  }

  exact(segments, frame, { out, fade = null } = {}) {
    const c = this.#c, length = 3 * this.#most(segments, fade, 2);
    const result = asOut(out, length, [Float32Array]);
    if (fade) return this.#showFaded(fade, segments, frame, result, length, (array, count, faded, at) =>
      c.ath_faded_exact(this.#at, array, count, frame, faded, at, 12));
    return this.#show(segments, frame, result, length, (array, count, at) =>
      c.ath_exact(this.#at, array, count, frame, at, 12));
  }

  // ---- the GPU form ----

  gpuLevel(level) {
    const c = this.#c, core = this.#core;
    this.#refine(this.#level(level));
    const size = c.ath_gpu_level_size(this.#at, level) >>> 0;
    return core.with(size, (at) => {
      this.#check(c.ath_gpu_build_level(this.#at, level, at, size), `the block of level ${level}`);
      return this.#block(at);
    });
  }

  // The first try has no room, and tells how much there has to be.
  gpuSegment(segment, level) {
    const core = this.#core;
    this.#segment(segment);
    this.#refine(this.#level(level));
    return core.with(GPU_ROOM_SIZE, (room) => {
      core.view(Uint32Array, room, GPU_ROOM_SIZE / 4).fill(0);
      return this.#recorded(segment, level, room) ?? this.#recorded(segment, level, room);
    });
  }

  gpuFrame(frame) {
    return this.#c.ath_gpu_frame(this.#at, whole(frame, 0, this.info.frameCount - 1, "frame"));
  }

  // The block of a segment where there is room for it, else null, and what it needs in `room`.
  #recorded(segment, level, room) {
    const c = this.#c, core = this.#core, size = c.ath_segment_size(this.#at, level) >>> 0;
    const workSize = c.ath_work_size(this.#at) >>> 0, recordSize = c.ath_gpu_record_size(this.#at, level, room) >>> 0;
    const work = this.#works.pop() ?? core.take(workSize);
    try {
      return core.with(size, (at) => core.with(recordSize, (record) => {
        this.#checkWork(c.ath_prepare_start(work, workSize, this.#at, segment, level, at, size), work);
        this.#check(c.ath_gpu_record(work, room, record, recordSize), `the block of segment ${segment}`);
        this.#checkWork(c.ath_prepare_step(work, MOST_STEPS), work);
        const block = c.ath_gpu_recorded(record, room) >>> 0;
        return block ? this.#block(block) : null;
      }));
    } finally {
      this.#works.push(work);
    }
  }

  // A copy of a block, whose first word is the number of its words.
  #block(at) {
    return this.#core.copy(Uint32Array, at, this.#core.view(Uint32Array, at, 1)[0]);
  }

  dispose() {
    this.#own = null;
  }
}
