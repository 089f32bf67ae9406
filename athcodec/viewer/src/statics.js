// Static data of a file for the page: metadata, polygons and named arrays, which the decoder reads and checks.

import { LoadError } from "./source.js";

export const ATTRIBUTE = 0x8020;

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
  const edges = file.polygons("edges");
  const attributes = {
    metadata: file.metadata(),
    faces: file.polygons("faces"),
    edges: edges?.derived ? derivedEdges(file) : edges?.array ?? null,
  };
  return { ...attributes, skeleton: attributes.edges ?? derivedEdges(file) };
}

/** Named arrays of numbers, as far as they are here: {name: {array, shape}}. */
export function readAttributes(file) {
  const all = file.attributeNames().map((name) => [name, file.attribute(name)]);
  const attributes = Object.fromEntries(all.filter(([, { array }]) => !Array.isArray(array)));
  checkPolygons(attributes, file.info.vertexCount);
  return attributes;
}

const wrong = (what) => new LoadError(`BAD_CHUNK: ${what}`, "BAD_CHUNK");

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
