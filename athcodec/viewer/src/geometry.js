// BufferGeometries of a file: faces as triangles, edges as lines. A geometry's vertices are the file's, in source
// order, or, where uv or normals are stored per corner, one per corner: `userData.source` says which vertex each is.

import { BufferAttribute, BufferGeometry, InstancedBufferAttribute, ShapeUtils, Vector2, Vector3 } from "three";

import { normals } from "./normals.js";

/** The polygons of FACES, or of the two attributes that hold polygons of different sizes; null where there are
 * none. */
export function polygonsOf(statics, attributes) {
  const { face_vertex_counts: counts, face_vertex_indices: indices } = attributes;
  if (statics.faces) return statics.faces;
  return counts && indices ? { array: Uint32Array.from(indices.array, Number), counts: counts.array } : null;
}

/** Stands an object of a file upright, in the axes of three.js, in which y is up. */
export function upright(object, { up_axis: up }) {
  if (up === "z") object.rotation.x = -Math.PI / 2;
  if (up === "x") object.rotation.z = Math.PI / 2;
  return object;
}

/** Puts an upright object where the plant is in its file. */
export function atOrigin(object, { metadata, origin }) {
  upright(object, metadata).position.fromArray(origin).applyEuler(object.rotation);
  return object;
}

/** Puts numbers into an attribute: another one in its place would leave the buffer of the first on the GPU. */
export function setValues(geometry, name, values, size) {
  const there = geometry.getAttribute(name), Attribute = geometry.isInstancedBufferGeometry ? InstancedBufferAttribute : BufferAttribute;
  if (there?.array.length !== values.length) geometry.setAttribute(name, new Attribute(values, size));
  else Object.assign(there, { array: values, needsUpdate: true });
}

/** A mesh; `normal` is always there, computed where the file has none. */
export function meshGeometry(ath, faces) {
  const { rest, statics: { metadata } } = ath, domains = metadata.domains ?? {};
  const corners = [domains.uv, domains.normals, domains.colors].includes("corner");
  const source = corners ? faces.array : Uint32Array.from({ length: rest.length / 3 }, (_, i) => i);
  const geometry = withPositions(rest, source);
  geometry.setIndex(new BufferAttribute(triangles(rest, faces, corners), 1));
  Object.assign(geometry.userData, { corners, faces });
  setNormals(geometry, normals(rest, faces));
  return geometry;
}

/** Lines, from edges (u, v). */
export function lineGeometry(ath, edges) {
  const { rest } = ath, geometry = withPositions(rest, Uint32Array.from({ length: rest.length / 3 }, (_, i) => i));
  geometry.setIndex(new BufferAttribute(edges, 1));
  return geometry;
}

/** Another rest pose in place of the one that a geometry was made of: in "rest" and "restOther" where it has them. */
export function setRest(geometry, rest) {
  const { source, other, faces } = geometry.userData;
  const places = other ? [["rest", source, rest], ["restOther", other, rest]] : [["position", source, rest]];
  if (faces) places.push(["normal", source, normals(rest, faces)]);
  for (const [name, vertices, values] of places) {
    const attribute = geometry.getAttribute(name);
    gather(attribute.array, values, vertices, 3);
    attribute.needsUpdate = true;
  }
}

/** Positions of which the vertex shader is given those of the rest pose, and whoever reads them one by one, as rays and boxes
 * do, those that are shown. */
export class Followed extends BufferAttribute {
  #source;
  #moved = () => null;

  /** source: the file's vertex of each; moved(): all of these where they are shown, null before. */
  follow(source, moved) {
    this.#source = source;
    this.#moved = moved;
    return this;
  }

  getComponent(index, k) {
    const moved = this.#moved();
    return moved ? moved[3 * this.#source[index] + k] : super.getComponent(index, k);
  }

  getX(index) {
    return this.getComponent(index, 0);
  }

  getY(index) {
    return this.getComponent(index, 1);
  }

  getZ(index) {
    return this.getComponent(index, 2);
  }
}

function withPositions(rest, source) {
  const geometry = new BufferGeometry(), position = new Float32Array(3 * source.length);
  gather(position, rest, source, 3);
  geometry.setAttribute("position", new BufferAttribute(position, 3));
  geometry.userData.source = source;
  return geometry;
}

/** out[i] = values[source[i]], `size` numbers each. */
export function gather(out, values, source, size) {
  for (let i = 0; i < source.length; i++)
    for (let k = 0; k < size; k++) out[size * i + k] = Number(values[size * source[i] + k]);
  return out;
}

function setNormals(geometry, perVertex) {
  const { source } = geometry.userData;
  geometry.setAttribute("normal", new BufferAttribute(gather(new Float32Array(3 * source.length), perVertex, source, 3), 3));
}

/** Adds what came behind the motion: uv, normals, colors. Arrays that fit neither vertices nor corners are left. */
export function addAttributes(geometry, ath, attributes) {
  const domains = ath.statics.metadata.domains ?? {};
  for (const [name, attribute, sizes] of [["uv", "uv", [2]], ["normals", "normal", [3]], ["colors", "color", [3, 4]]]) {
    const stored = attributes[name], size = stored?.shape.at(-1);
    if (!stored || stored.shape.length !== 2 || !sizes.includes(size)) continue;
    const { source, corners } = geometry.userData, perCorner = domains[name] === "corner";
    const rows = stored.shape[0], wanted = perCorner ? source.length : ath.rest.length / 3;
    if (rows !== wanted || (perCorner && !corners)) continue;
    const scale = stored.array instanceof Uint8Array ? 1 / 255 : 1;
    const order = perCorner ? Uint32Array.from({ length: rows }, (_, i) => i) : source;
    const values = gather(new Float32Array(size * source.length), stored.array, order, size).map((value) => value * scale);
    setValues(geometry, attribute, values, size);
    if (name === "normals") geometry.userData.faces = null; // The normals of `setRest` are computed.
  }
}

// Corners of triangles: numbers of vertices, or, with `corners`, of corners.
function triangles(rest, { array, columns = 0, counts = null }, corners) {
  const out = [], faces = counts ? counts.length : array.length / columns;
  for (let face = 0, first = 0; face < faces; face++) {
    const size = counts ? Number(counts[face]) : columns;
    for (const [a, b, c] of split(rest, array, first, size))
      out.push(...[a, b, c].map((k) => (corners ? first + k : Number(array[first + k]))));
    first += size;
  }
  return Uint32Array.from(out);
}

// A polygon's triangles, by its corners: triangles as they are, quads along the shorter diagonal, others by ears.
function split(rest, array, first, size) {
  if (size < 3) return [];
  if (size === 3) return [[0, 1, 2]];
  const points = Array.from({ length: size }, (_, k) => new Vector3().fromArray(rest, 3 * Number(array[first + k])));
  if (size === 4) {
    const along = points[0].distanceToSquared(points[2]) <= points[1].distanceToSquared(points[3]);
    return along ? [[0, 1, 2], [0, 2, 3]] : [[0, 1, 3], [1, 2, 3]];
  }
  return ears(points) ?? Array.from({ length: size - 2 }, (_, k) => [0, k + 1, k + 2]);
}

function ears(points) {
  const normal = new Vector3(), x = new Vector3(), y = new Vector3();
  points.forEach((point, k) => normal.add(new Vector3().crossVectors(point, points[(k + 1) % points.length])));
  if (normal.lengthSq() === 0) return null;
  normal.normalize();
  x.set(Math.abs(normal.x) > 0.9 ? 0 : 1, Math.abs(normal.x) > 0.9 ? 1 : 0, 0).cross(normal).normalize();
  y.crossVectors(normal, x);
  const triangles = ShapeUtils.triangulateShape(points.map((point) => new Vector2(point.dot(x), point.dot(y))), []);
  return triangles.length > 0 ? triangles : null;
}

/** The geometry with fewer vertices: those in one cell of `size`, of one part, become the first of them. */
export function clustered(geometry, rest, size, partOf) {
  const { source } = geometry.userData, corners = geometry.index.array, lines = !geometry.getAttribute("normal");
  const cells = new Map(), step = lines ? 2 : 3, out = [], seen = new Set();
  const cell = (vertex) => {
    const at = 3 * source[vertex], place = (k) => Math.floor(rest[at + k] / size) & 0xfff; // far cells may share a number
    const key = (((partOf[source[vertex]] + 1) & 0xffff) * 4096 + place(0)) * 16777216 + place(1) * 4096 + place(2);
    if (!cells.has(key)) cells.set(key, vertex);
    return cells.get(key);
  };
  for (let i = 0; i < corners.length; i += step) {
    const all = Array.from(corners.subarray(i, i + step), cell);
    const [a, b, c] = all;
    if (a === b || (!lines && (b === c || c === a))) continue;
    const [low, middle, high] = [...all].sort((p, q) => p - q), key = lines ? low * 2 ** 26 + middle : `${low},${middle},${high}`;
    if (seen.has(key)) continue;
    seen.add(key);
    out.push(...all);
  }
  if (out.length === 0) out.push(...corners.subarray(0, step)); // something has to be there to see
  return compacted(geometry, Uint32Array.from(out));
}

// Only the vertices that an index uses.
function compacted(geometry, index) {
  const used = Uint32Array.from(new Set(index)).sort(), place = new Map(Array.from(used, (vertex, i) => [vertex, i]));
  const small = new BufferGeometry();
  for (const [name, { array, itemSize }] of Object.entries(geometry.attributes))
    small.setAttribute(name, new BufferAttribute(gather(new array.constructor(itemSize * used.length), array, used, itemSize),
      itemSize));
  small.setIndex(new BufferAttribute(index.map((vertex) => place.get(vertex)), 1));
  small.userData.source = used.map((vertex) => geometry.userData.source[vertex]);
  return small;
}
