// Normals of a mesh whose vertices move on their own, for the worker and the decoder, which takes the text of this file in.

/** Smooth unit normals, 3 numbers per vertex: each face adds its normal, as long as twice its area, to its corners. Where that
 * is nothing, as of twigs without thickness, they point away from the middle: a zero normal is drawn black.
 * faces: {array, columns} or {array, counts}. */
export function normals(positions, { array, columns = 0, counts = null }) {
  const out = new Float64Array(positions.length), faces = counts ? counts.length : array.length / columns, middle = [0, 0, 0];
  for (let face = 0, first = 0; face < faces; face++) {
    const size = counts ? Number(counts[face]) : columns, normal = [0, 0, 0];
    for (let k = 1; k + 1 < size; k++)
      add(normal, positions, 3 * Number(array[first]), 3 * Number(array[first + k]), 3 * Number(array[first + k + 1]));
    for (let corner = first; corner < first + size; corner++)
      for (let k = 0; k < 3; k++) out[3 * Number(array[corner]) + k] += normal[k];
    first += size;
  }
  for (let i = 0; i < out.length; i++) middle[i % 3] += 3 * positions[i] / out.length;
  for (let at = 0; at < out.length; at += 3) {
    const some = out[at] || out[at + 1] || out[at + 2];
    for (let k = 0; !some && k < 3; k++) out[at + k] = positions[at + k] - middle[k] || 1e-9;
    const length = Math.hypot(out[at], out[at + 1], out[at + 2]);
    for (let k = 0; k < 3; k++) out[at + k] /= length;
  }
  return Float32Array.from(out);
}

// Adds the normal of the triangle whose corners begin at p[a], p[b] and p[c], as long as twice its area.
function add(normal, p, a, b, c) {
  const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
  const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
  normal[0] += uy * vz - uz * vy;
  normal[1] += uz * vx - ux * vz;
  normal[2] += ux * vy - uy * vx;
}
