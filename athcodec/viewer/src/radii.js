// How thick branches are.

/** Radius of every vertex: the file's, or by the pipe model, so that the trunk is a fiftieth of the plant's size, and blades, which have
 * none, a tenth of that. */
export function radii(ath) {
  const stored = ath.attributes.radius, count = ath.rest.length / 3;
  if (stored?.array.length === count) return Float32Array.from(stored.array, Number);
  const { branches: { first, count: stem, attach, depth }, channel: { info, vertexPlaces } } = ath;
  const beyond = new Float32Array(info.placeCount).fill(1); // in file order
  for (let b = first.length - 1; b >= 0; b--) {
    for (let i = first[b] + stem[b] - 2; i >= first[b]; i--) beyond[i] += beyond[i + 1];
    if (attach[b] >= 0) beyond[attach[b]] += beyond[first[b]];
  }
  const most = beyond.reduce((a, b) => Math.max(a, b), 1), isTuft = depth.length > 1 && depth.every((order) => order === 0), thick = ath.sphere.radius / (isTuft ? 500 : 50);
  return Float32Array.from(vertexPlaces, (place) => thick * Math.sqrt(beyond[place] / most));
}
