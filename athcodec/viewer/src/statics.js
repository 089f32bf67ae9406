// Static data of a file: METADATA and ATTRIBUTE chunks, as FORMAT.md has them, and its polygons. Chunks come from
// AthFile.chunkBytes(), which has verified their checksums; everything else about them is checked here.

import { decompress } from "fzstd";

const METADATA = 0x8004, ATTRIBUTE = 0x8020;
const MOST_BYTES = 2 ** 30; // of one array
const MOST_TEXT = 2 ** 24;
const NUMBERS = {
  "|b1": Uint8Array, "i1": Int8Array, "u1": Uint8Array, "i2": Int16Array, "u2": Uint16Array, "i4": Int32Array,
  "u4": Uint32Array, "f4": Float32Array, "f8": Float64Array, "i8": BigInt64Array, "u8": BigUint64Array,
};
const text = new TextDecoder("utf-8", { fatal: true });

function wrong(what) {
  return Object.assign(new Error(`BAD_CHUNK: ${what}`), { codeName: "BAD_CHUNK" });
}

// What a zstd frame says its content has; -1 where it does not say it.
function contentSize(frame) {
  if (frame.length < 6 || frame[0] !== 0x28 || frame[1] !== 0xb5 || frame[2] !== 0x2f || frame[3] !== 0xfd)
    throw wrong("static data: got no zstd frame, expected one");
  const descriptor = frame[4], single = (descriptor >> 5) & 1;
  const bytes = [single, 2, 4, 8][descriptor >> 6];
  const at = 5 + (single ? 0 : 1) + [0, 1, 2, 4][descriptor & 3];
  if (bytes === 0 || at + bytes > frame.length) return -1;
  let size = 0;
  for (let i = bytes - 1; i >= 0; i--) size = size * 256 + frame[at + i];
  return bytes === 2 ? size + 256 : size;
}

function unpack(frame, size) {
  let content;
  try {
    content = decompress(frame);
  } catch (error) {
    throw wrong(`static data: got a damaged zstd frame (${error.message})`);
  }
  if (content.length !== size) throw wrong(`static data: got ${content.length} bytes in a zstd frame, expected ${size}`);
  return content;
}

function readMetadata(bytes) {
  let body = bytes.subarray(1);
  if (bytes[0] === 1) {
    const size = contentSize(body);
    if (size < 0 || size > MOST_TEXT) throw wrong(`metadata: got a text of ${size} bytes, expected at most ${MOST_TEXT}`);
    body = unpack(body, size);
  }
  return parse(body, "metadata");
}

function parse(bytes, what) {
  try {
    return JSON.parse(text.decode(bytes));
  } catch {
    throw wrong(`${what}: got something else, expected a JSON object`);
  }
}

function unshuffle(planes, count, size) {
  if (size === 1) return planes;
  const out = new Uint8Array(count * size);
  for (let k = 0; k < size; k++)
    for (let i = 0, from = k * count, to = k; i < count; i++, to += size) out[to] = planes[from + i];
  return out;
}

function swap(bytes, size) {
  for (let at = 0; at < bytes.length; at += size) bytes.subarray(at, at + size).reverse();
}

// A static array as {name, dtype, shape, array, derived}; `array` is null where there is none, or where its
// Type has no typed array (records, text, halves).
function readArray(bytes) {
  if (bytes.length < 2) throw wrong("static array: got less than its head");
  const headLength = bytes[0] | (bytes[1] << 8);
  if (2 + headLength > bytes.length) throw wrong("static array: got less than its head");
  const head = parse(bytes.subarray(2, 2 + headLength), "static array");
  const { name, dtype, shape = [], derived } = head;
  const Type = typeof dtype === "string" ? NUMBERS[dtype] ?? NUMBERS[dtype.slice(1)] : undefined;
  if (!Type) return { name, dtype, shape, array: null, derived: dtype === undefined ? derived : undefined };
  const whole = Array.isArray(shape) && shape.every((n) => Number.isInteger(n) && n >= 0);
  const count = whole ? shape.reduce((product, n) => product * n, 1) : -1, size = Type.BYTES_PER_ELEMENT;
  if (count < 0 || count * size > MOST_BYTES) throw wrong(`static array ${name ?? ""}: got a shape of ${count} numbers`);
  if (count === 0) return { name, dtype, shape, array: new Type(0) };
  const frame = bytes.subarray(2 + headLength);
  if (contentSize(frame) !== count * size) throw wrong(`static array ${name ?? ""}: got a frame of another size`);
  const values = unshuffle(unpack(frame, count * size), count, size);
  if (dtype[0] === ">") swap(values, size);
  return { name, dtype, shape, array: new Type(values.buffer, values.byteOffset, count) };
}

// The edges of a plant without stored ones, (u, v) for every vertex v but a root's first, in source order.
function derivedEdges(file) {
  const { first, count, attach } = file.branches(), source = file.vertexSource(), before = new Int32Array(source.length);
  for (let b = 0; b < first.length; b++) {
    before[first[b]] = attach[b];
    for (let i = first[b] + 1; i < first[b] + count[b]; i++) before[i] = i - 1;
  }
  const previous = new Int32Array(source.length);
  source.forEach((vertex, i) => { previous[vertex] = before[i] < 0 ? -1 : source[before[i]]; });
  const edges = [];
  previous.forEach((u, v) => { if (u >= 0) edges.push(u, v); });
  return Uint32Array.from(edges);
}

/** What stands in front of the motion: {metadata, faces, edges, skeleton}. `skeleton` is always there: the
 * stored edges, or those that follow from the branches. */
export function readPrelude(file) {
  const index = file.chunks().findIndex(({ kind }) => kind === METADATA), edges = file.polygons("edges");
  const found = {
    metadata: index < 0 ? {} : readMetadata(file.chunkBytes(index)),
    faces: file.polygons("faces"),
    edges: edges?.derived ? derivedEdges(file) : edges?.array ?? null,
  };
  return { ...found, skeleton: found.edges ?? derivedEdges(file) };
}

/** Named arrays, as far as they are here: {name: {array, shape, dtype}}. */
export function readAttributes(file) {
  const attributes = {};
  for (const [index, { kind, fed }] of file.chunks().entries()) {
    if (kind !== ATTRIBUTE || !fed) continue;
    const { name, dtype, shape, array } = readArray(file.chunkBytes(index));
    if (array && typeof name === "string") attributes[name] = { array, shape, dtype };
  }
  checkPolygons(attributes, file.info.vertexCount);
  return attributes;
}

// Polygons of different sizes are two attributes that have to fit each other.
function checkPolygons({ face_vertex_counts: counts, face_vertex_indices: indices }, vertexCount) {
  if (!counts || !indices) return;
  let corners = 0;
  for (const count of counts.array) corners += Number(count);
  if (corners !== indices.array.length)
    throw wrong(`face_vertex_counts: got ${corners} corners, expected ${indices.array.length}`);
  for (const vertex of indices.array)
    if (!(vertex >= 0 && vertex < vertexCount)) throw wrong(`face_vertex_indices: got vertex ${vertex}`);
}

/** The chunks of named arrays that are not here, as ranges. */
export function attributeRanges(file) {
  return file.chunks().filter(({ kind, fed }) => kind === ATTRIBUTE && !fed)
    .map(({ offset, length }) => ({ offset, size: length }));
}
