// Static data of a file: METADATA and ATTRIBUTE chunks, as FORMAT.md has them, and its polygons. Chunks come from
// AthFile.chunkBytes(), which has verified their checksums; everything else about them is checked here.

import { decompress } from "fzstd";
import { LoadError } from "./source.js";

export const ATTRIBUTE = 0x8020;
const METADATA = 0x8004;
const MOST_BYTES = 2 ** 30; // Largest size of one array, bytes.
const MOST_TEXT = 2 ** 24;
// Typed arrays of kinds and sizes of elements (FORMAT.md, "ATTRIBUTE"); others have none: halves, pairs, texts.
const NUMBERS = [
  { 1: Uint8Array },
  { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array, 8: BigUint64Array },
  { 1: Int8Array, 2: Int16Array, 4: Int32Array, 8: BigInt64Array },
  { 4: Float32Array, 8: Float64Array },
];
const text = new TextDecoder("utf-8", { fatal: true });

function wrong(what) {
  return new LoadError(`BAD_CHUNK: ${what}`, "BAD_CHUNK");
}

// Returns the content size that a zstd frame declares; -1 where it declares none.
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

// A static array as {name, shape, array}; `array` is null where its type has no typed array.
function readArray(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const start = bytes.length < 8 ? 8 : 8 + 4 * bytes[1], end = start + (bytes.length < 8 ? 0 : view.getUint16(2, true));
  if (end > bytes.length) throw wrong("static array: got less than its head");
  const size = view.getUint32(4, true), Type = NUMBERS[bytes[0] & 7]?.[size];
  const shape = Array.from({ length: bytes[1] }, (_, k) => view.getUint32(8 + 4 * k, true));
  const name = readName(bytes.subarray(start, end)), count = shape.reduce((product, n) => product * n, 1);
  if (!Type) return { name, shape, array: null };
  if (count * size > MOST_BYTES) throw wrong(`static array ${name}: got a shape of ${count} numbers`);
  if (count === 0) return { name, shape, array: new Type(0) };
  const frame = bytes.subarray(end);
  if (contentSize(frame) !== count * size) throw wrong(`static array ${name}: got a frame of another size`);
  const values = unshuffle(unpack(frame, count * size), count, size);
  if (bytes[0] & 8) swap(values, size);
  return { name, shape, array: new Type(values.buffer, values.byteOffset, count) };
}

function readName(bytes) {
  try {
    return text.decode(bytes);
  } catch {
    throw wrong("static array: got a name that is no text");
  }
}

// The edges of a plant without stored ones, (u, v) for every vertex v but a root's first, in source order.
function derivedEdges(file) {
  const { first, count, attach } = file.branches(), source = file.vertexSource(), before = new Int32Array(source.length);
  for (let b = 0; b < first.length; b++) {
    before[first[b]] = attach[b];
    for (let i = first[b] + 1; i < first[b] + count[b]; i++) before[i] = i - 1;
  }
  const previous = new Int32Array(file.info.vertexCount).fill(-1);
  source.forEach((vertex, i) => { previous[vertex] = before[i] < 0 ? -1 : source[before[i]]; });
  const edges = [];
  previous.forEach((u, v) => { if (u >= 0) edges.push(u, v); });
  return Uint32Array.from(edges);
}

/** Reads what stands in front of the motion: {metadata, faces, edges, skeleton}. `skeleton` is always there: the
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

/** Named arrays of numbers, as far as they are here: {name: {array, shape}}. */
export function readAttributes(file) {
  const attributes = {};
  for (const [index, { kind, fed }] of file.chunks().entries()) {
    if (kind !== ATTRIBUTE || !fed) continue;
    const { name, shape, array } = readArray(file.chunkBytes(index));
    if (array) attributes[name] = { array, shape };
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

/** The chunks, all or those of a kind, that are not here, as ranges. */
export function missingChunks(file, only) {
  return file.chunks().filter(({ kind, fed }) => !fed && kind === (only ?? kind)).map(({ offset, length }) => ({ offset, size: length }));
}
