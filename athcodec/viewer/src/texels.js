// Texels fills textures for the GPU: nodes' matrices, then exact vertices, with rotations of normals where the mesh has faces.

import { normals } from "./normals.js";
import { pause } from "./pause.js";

export const WIDTH = 1024; // Width of a texture in texels, each of four numbers.
export const BLENDED = -1; // In place of a level: all vertices are exact, as blended clips leave them.
const REFINED_REST = 0x15;

export class Texels {
  #file; #order; #places; #relative;
  #faces = null; // By places in file order.
  #parts = new Map();
  #finerRest; // The rest pose is level 0's, and levels above have another.
  #restNormals = null;

  /** relative: whether positions are less the file's origin. */
  constructor(file, faces, relative = false) {
    this.#file = file;
    this.#relative = relative;
    this.#order = file.vertexSource();
    this.#places = file.vertexPlaces();
    this.faces = faces;
    const exactCount = file.info.placeCount, [none, zero, all] = [-1, 0, exactCount].map((number) => Int32Array.of(number));
    this.#parts.set(BLENDED, { nodeCount: 0, exactCount, branch: none, first: zero, count: all, index: zero });
    this.#finerRest = file.chunks().some(({ kind, level }) => kind === REFINED_REST && level === 1);
    this.rest = this.refine(file.readyLevel(0)) ?? this.#levelRest(0);
  }

  // All vertices of a place turn alike, and so do their normals.
  set faces(faces) {
    this.#faces = faces && { ...faces, array: Int32Array.from(faces.array, (vertex) => this.#places[Number(vertex)]) };
    this.#restNormals = null;
  }

  /** Takes the rest pose of the levels above 0 once one of them is here, for level 0 as well. Returns the pose if it is new. */
  refine(level) {
    if (!this.#finerRest || level <= 0) return null;
    this.#finerRest = false;
    try {
      this.#restNormals = null;
      return this.rest = this.#levelRest(1);
    } catch {
      return null; // The chunk is damaged: levels that need it will say so.
    }
  }

  #levelRest(level) {
    return this.#file.levelRest(level, "source", { relative: this.#relative });
  }

  parts(level) {
    if (!this.#parts.has(level)) this.#parts.set(level, this.#file.parts(level));
    return this.#parts.get(level);
  }

  /** Returns the number of texels of a level: three per node, then one per exact vertex, two with the rotation of its normal. */
  count(level) {
    const { nodeCount, exactCount } = this.parts(level);
    return 3 * nodeCount + (this.#faces ? 2 : 1) * exactCount;
  }

  /** Returns the texture of a level for what shows a frame. buffer: an old texture's, to be written over where it fits. */
  pack(shown, level, buffer) {
    return this.#fill(this.#room(level, buffer), 0, shown, level);
  }

  /** Returns the texture of positions in source order, all vertices as exact ones. */
  packExact(xyz, buffer) {
    const data = this.#room(BLENDED, buffer), shown = this.#inFileOrder(xyz), stride = this.#faces ? 8 : 4;
    for (let from = 0, to = 0; from < shown.length; from += 3, to += stride) data.set(shown.subarray(from, from + 3), to);
    if (this.#faces) this.#fillTurns(data, 0, BLENDED, shown);
    return data;
  }

  #inFileOrder(xyz) {
    const out = new Float32Array(3 * this.#order.length);
    this.#order.forEach((vertex, i) => {
      for (let k = 0; k < 3; k++) out[3 * i + k] = xyz[3 * vertex + k];
    });
    return out;
  }

  /** Returns every `step`-th frame of a clip at a level, one behind the other: what a forest plays. shownAt: what shows a frame. */
  async bake({ firstFrame, frameCount }, level, step, shownAt, signal) {
    const texels = this.count(level), rows = Math.ceil(frameCount / step);
    const data = new Float32Array(4 * WIDTH * Math.ceil((rows * texels) / WIDTH));
    for (let row = 0; row < rows; row++) {
      this.#fill(data, 4 * row * texels, shownAt(firstFrame + row * step), level);
      if (row % 4 === 3) await pause();
      signal.throwIfAborted();
    }
    return { rows, texels, data };
  }

  #room(level, buffer) {
    const size = 4 * WIDTH * Math.ceil(this.count(level) / WIDTH);
    return buffer?.byteLength === 4 * size ? new Float32Array(buffer) : new Float32Array(size);
  }

  #fill(data, at, { frame, segments, fade = null }, level) {
    const { nodeCount, exactCount } = this.parts(level), exactAt = at + 12 * nodeCount;
    const relative = this.#relative, positions = () => this.#file.positions(segments, frame, { fade, order: "file", relative });
    this.#file.matrices(segments, frame, { out: data.subarray(at, exactAt), fade, relative });
    if (exactCount === 0) return data;
    const exact = relative ? this.#exactOf(positions(), level) : this.#file.exact(segments, frame, { fade }), stride = this.#faces ? 8 : 4;
    for (let i = 0, from = 0, to = exactAt; i < exactCount; i++, to += stride) {
      data[to] = exact[from++];
      data[to + 1] = exact[from++];
      data[to + 2] = exact[from++];
    }
    if (this.#faces) this.#fillTurns(data, exactAt, level, positions());
    return data;
  }

  // The positions, in file order, of the exact vertices of a level.
  #exactOf(positions, level) {
    const { branch, first, count, index, exactCount } = this.parts(level), out = new Float32Array(3 * exactCount);
    branch.forEach((node, part) => {
      if (node < 0) out.set(positions.subarray(3 * first[part], 3 * (first[part] + count[part])), 3 * index[part]);
    });
    return out;
  }

  // How the normal of every exact vertex has turned since the rest pose. positions: in file order.
  #fillTurns(data, at, level, positions) {
    this.#restNormals ??= normals(this.#inFileOrder(this.rest), this.#faces);
    const { branch, first, count, index } = this.parts(level), now = normals(positions, this.#faces);
    for (let part = 0; part < branch.length; part++) {
      if (branch[part] >= 0) continue;
      for (let i = 0; i < count[part]; i++)
        turns(this.#restNormals, now, first[part] + i, data, at + 8 * (index[part] + i) + 4);
    }
  }
}

// Writes the smallest rotation that takes normal `vertex` of `from` to that of `to`, as a quaternion at out[at].
function turns(from, to, vertex, out, at) {
  const i = 3 * vertex, ax = from[i], ay = from[i + 1], az = from[i + 2], bx = to[i], by = to[i + 1], bz = to[i + 2];
  const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx, w = 1 + ax * bx + ay * by + az * bz;
  const length = Math.hypot(x, y, z, w);
  if (length < 1e-6) { // opposite: half a turn about anything across
    const across = Math.hypot(ax, ay) || 1;
    out.set(Math.hypot(ax, ay) > 1e-3 ? [-ay / across, ax / across, 0, 0] : [1, 0, 0, 0], at);
    return;
  }
  out[at] = x / length;
  out[at + 1] = y / length;
  out[at + 2] = z / length;
  out[at + 3] = w / length;
}
