// How thick branches are.

/** Radius of every vertex: the file's, or by the pipe model, so that the trunk is a fiftieth of the plant's size. */
export function radii(ath) {
  const stored = ath.attributes.radius, count = ath.rest.length / 3;
  if (stored?.array.length === count) return Float32Array.from(stored.array, Number);
  const beyond = new Float32Array(count).fill(1), { first, count: stem, attach } = ath.branches, source = ath.channel.vertexSource;
  for (let b = first.length - 1; b >= 0; b--) {
    for (let i = first[b] + stem[b] - 2; i >= first[b]; i--) beyond[source[i]] += beyond[source[i + 1]];
    if (attach[b] >= 0) beyond[source[attach[b]]] += beyond[source[first[b]]];
  }
  const most = beyond.reduce((a, b) => Math.max(a, b), 1), thick = ath.sphere.radius / 50;
  return beyond.map((value) => thick * Math.sqrt(value / most));
}
