// Reads ATH_motion in a glTF file: which primitives a motion moves, and which of its vertices theirs are. Every
// number is checked here; spec/gltf/README.md of athcodec describes the extension.

export const EXTENSION = "ATH_motion", VERTEX = "_ATH_VERTEX";

const isCount = (value) => Number.isSafeInteger(value) && value >= 0;

/** The motions of a file, empty where it has none. */
export function motionsOf(json) {
  const motions = json.extensions?.[EXTENSION]?.motions;
  return Array.isArray(motions) ? motions : [];
}

/** Returns the extension of a primitive; null where it has none. */
export function referenceOf(primitive) {
  return primitive.extensions?.[EXTENSION] ?? null;
}

/** The primitives of a motion: [{mesh, primitive, attributes, reference}], the first two being places in the file. */
export function primitivesOf(json, motion) {
  return (json.meshes ?? []).flatMap(({ primitives }, mesh) => primitives
    .map((each, primitive) => ({ mesh, primitive, attributes: each.attributes, reference: referenceOf(each) }))
    .filter(({ reference }) => reference?.motion === motion));
}

/** The motion's vertex of each of a primitive's `count`; numberOf(i): that of the attribute, where there is one. */
export function verticesOf(count, reference, numberOf = null) {
  const first = reference.firstVertex ?? 0;
  if (!isCount(first)) throw new RangeError(`firstVertex: got ${first}, expected a whole number`);
  const numbers = Array.from({ length: count }, (_, i) => (numberOf ? numberOf(i) : first + i));
  const wrong = numbers.find((vertex) => !isCount(vertex) || vertex > 0xffffffff);
  if (wrong !== undefined) throw new RangeError(`vertices: got ${wrong}, expected whole numbers of vertices`);
  return Uint32Array.from(numbers);
}

/** The rest pose of a motion, of all its primitives: [{vertices, positions}]. */
export function restOf(parts) {
  const total = parts.reduce((sum, { vertices }) => sum + vertices.length, 0);
  let count = 0;
  for (const { vertices } of parts) for (const vertex of vertices) if (vertex >= count) count = vertex + 1;
  if (count === 0 || count > total) throw new RangeError(`vertices: got ${count} of the motion, expected 1 to ${total}, those in primitives`);
  const rest = new Float32Array(3 * count).fill(NaN);
  for (const { vertices, positions } of parts)
    vertices.forEach((vertex, i) => {
      for (let k = 0; k < 3; k++) rest[3 * vertex + k] = positions[3 * i + k];
    });
  const missing = rest.findIndex((value) => !Number.isFinite(value));
  if (missing >= 0) throw new RangeError(`POSITION: got none for vertex ${Math.floor(missing / 3)} of the motion`);
  return rest;
}

/** Seconds at which a clip begins, on the clock of its animation. */
export function startOf(motion, name) {
  const stated = (motion.clips ?? []).find((clip) => clip.name === name)?.start;
  return Number.isFinite(stated) ? stated : 0;
}

/** Two keys, [seconds of the animation, seconds of the clip], between which both run alike; one of a clip without duration. */
export function keysOf(start, { duration: round }) {
  const first = Math.max(start, 0);
  return round > first - start ? [[first, first - start], [start + round, round]] : [[first, 0]];
}

/** Changes the file's structure so that nodes show the meshes of these motions without skin and morph targets. */
export function withoutFallback(json, played) {
  const isMoved = (mesh) => json.meshes[mesh]?.primitives.some((primitive) => played.has(referenceOf(primitive)?.motion));
  const moved = new Set((json.nodes ?? []).flatMap(({ mesh }, node) => (mesh !== undefined && isMoved(mesh) ? [node] : [])));
  for (const node of moved) {
    delete json.nodes[node].skin;
    delete json.nodes[node].weights;
    const mesh = json.meshes[json.nodes[node].mesh];
    delete mesh.weights;
    delete mesh.extras?.targetNames;
    for (const primitive of mesh.primitives) delete primitive.targets;
  }
  const isKept = ({ target }) => target.path !== "weights" || !moved.has(target.node);
  json.animations &&= json.animations.map((each) => ({ ...each, channels: each.channels.filter(isKept) }))
    .filter(({ channels }) => channels.length > 0);
  return moved;
}
