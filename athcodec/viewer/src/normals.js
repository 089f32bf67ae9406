// Normals of a mesh whose vertices move on their own, for the worker and the decoder, which takes the text of this file in.

/** Smooth unit normals, 3 numbers per vertex: each face adds its normal, as long as twice its area, to its corners. Where that
 * is nothing, as of twigs without thickness, they point away from the middle: a zero normal is drawn black.
 * faces: {array, columns} or {array, counts}. */
export function normals(positions, { array, columns = 0, counts = null }) {
  const out = new Float64Array(positions.length), faces = counts ? counts.length : array.length / columns, middle = [0, 0, 0];
  for (let face = 0, first = 0; face < faces; face++) {
    const size = counts ? Number(counts[face]) : columns;
    for (let k = 1; k + 1 < size; k++)
      add(out, positions, Number(array[first]), Number(array[first + k]), Number(array[first + k + 1]));
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

function add(out, p, a, b, c) {
  a *= 3;
  b *= 3;
  c *= 3;
  const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
  const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
  const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  for (const at of [a, b, c]) {
    out[at] += nx;
    out[at + 1] += ny;
    out[at + 2] += nz;
  }
}
