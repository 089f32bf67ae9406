// Where a plant stands on the ground: its foot and, under a trunk that is cut off flat there, a flared root.

import { BufferAttribute, BufferGeometry, Vector3 } from "three";

const NEAR = 0.012; // Height of what counts as the foot, over the plant's height.
const TALL = 0.045, DEEP = 0.006; // Height of the flare above ground and below it, over the plant's height.
const THICKEST = 0.08; // Radius of a trunk at most, over the plant's height.
const WIDE = 1.3, AROUND = 28, RINGS = 8;

// The vertices of a branch between two heights: their middle and mean distance from it in the plane; null: there are too few.
function band({ rest, vertexBranch }, branch, up, low, high) {
  const middle = new Vector3(), point = new Vector3(), inside = [];
  for (let i = 0; i < vertexBranch.length; i++) if (vertexBranch[i] === branch && rest[3 * i + up] >= low && rest[3 * i + up] <= high) inside.push(i);
  if (inside.length < 3) return null;
  for (const i of inside) middle.add(point.fromArray(rest, 3 * i));
  middle.divideScalar(inside.length);
  const far = inside.reduce((sum, i) => {
    point.fromArray(rest, 3 * i).sub(middle).setComponent(up, 0);
    return sum + point.length();
  }, 0);
  return { middle, radius: far / inside.length };
}

/** Returns the foot of a plant in the axes of its file: {foot, trunk}; trunk: what `flare` is made from, or null. */
export function footOf(ath) {
  const { rest, metadata, branches: { depth }, vertexBranch } = ath, up = metadata.up_axis === "z" ? 2 : 1, roots = depth.filter((order) => order === 0).length;
  let low = Infinity, high = -Infinity, first = 0;
  for (let i = up; i < rest.length; i += 3) {
    if (rest[i] < low) [low, first] = [rest[i], (i - up) / 3];
    high = Math.max(high, rest[i]);
  }
  const tall = high - low, branch = vertexBranch[first], bottom = band(ath, branch, up, low, low + NEAR * tall);
  const stem = bottom?.middle.clone() ?? new Vector3().fromArray(rest, 3 * first), foot = roots === 1 ? stem : ath.box.getCenter(new Vector3());
  foot.setComponent(up, low);
  const above = bottom && band(ath, branch, up, low + (TALL - NEAR) * tall, low + (TALL + 2 * NEAR) * tall);
  const isTrunk = roots === 1 && ath.hasFaces && above && bottom.radius > 1e-4 * tall && bottom.radius < THICKEST * tall;
  return { foot, trunk: isTrunk ? { up, low, tall, bottom, above } : null };
}

/** Returns a geometry with the texture coordinates of a stem, which goes from the trunk into the ground. */
export function flare({ up, low, tall, bottom, above }) {
  const points = [], uvs = [], index = [], side = up === 1 ? 2 : 1, at = new Vector3();
  for (let ring = 0; ring <= RINGS; ring++)
    for (let i = 0; i <= AROUND; i++) {
      const t = ring / RINGS, a = 2 * Math.PI * i / AROUND, lobes = 1 + 0.35 * Math.cos(5 * a + 0.6) + 0.2 * Math.cos(3 * a);
      const radius = (bottom.radius + t * (above.radius - bottom.radius)) * (1.01 + WIDE * (1 - t) ** 3 * lobes);
      at.lerpVectors(bottom.middle, above.middle, t);
      at.setComponent(up, low - DEEP * tall + t * (TALL + DEEP) * tall);
      at.x += radius * Math.cos(a);
      at.setComponent(side, at.getComponent(side) + radius * Math.sin(a) * (up === 1 ? -1 : 1));
      points.push(...at);
      uvs.push(i / AROUND * 0.999, 0.6 * t);
      if (ring < RINGS && i < AROUND) {
        const corner = ring * (AROUND + 1) + i, over = corner + AROUND + 1;
        index.push(corner, corner + 1, over, over, corner + 1, over + 1);
      }
    }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(Float32Array.from(points), 3));
  geometry.setAttribute("uv", new BufferAttribute(Float32Array.from(uvs), 2));
  geometry.setIndex(index);
  geometry.computeVertexNormals();
  return geometry;
}
