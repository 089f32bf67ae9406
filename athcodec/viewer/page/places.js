// Where the plants of a forest stand: trees evenly and a little off their places, those of the floor in groups between them.

import { chance } from "./chance.js";

const MOST = 12000; // Plants of one kind at most; in large forests only the trees in the middle have them.

const GOLDEN = Math.PI * (3 - Math.sqrt(5));

/** How far a forest of so many of a plant reaches; spread: how far they are apart, 1 is usual. */
export const forestReach = ({ sphere }, count, spread = 1) => 1.1 * sphere.radius * spread * Math.sqrt(count);

/** The trees of a forest, the middle first, in the axes of their file. */
export function treePlaces({ metadata, motion, rest }, count, reach) {
  const duration = motion.duration || 1, isUpright = metadata.up_axis === "z";
  return Array.from({ length: count }, (_, i) => {
    const far = reach * Math.sqrt((i + 0.3) / count), angle = i * GOLDEN + 0.5 * Math.sin(i * 12.9898);
    const size = 0.75 + 0.5 * (Math.sin(i * 78.233) * 0.5 + 0.5), x = far * Math.cos(angle), y = far * Math.sin(angle);
    const at = isUpright ? { x, y, z: rest[2] * (1 - size) } : { x, y: rest[1] * (1 - size), z: y };
    return { ...at, size, angle: i * 2.4, seconds: (i * 0.7548776662 % 1) * duration };
  });
}

/** Where trees stand in the world: [x, z] of each. */
export const feet = (trees, { metadata }) => trees.map(({ x, y, z }) => (metadata.up_axis === "z" ? [x, -y] : [x, z]));

/** So many to each tree. trees: [x, z] of each, the middle first; reach: how far from its tree a plant stands at most; kind: a
 * number, by which kinds of plants stand apart. */
export function floorPlaces(trees, each, reach, kind) {
  return Array.from({ length: Math.min(MOST, Math.round(each * trees.length)) }, (_, i) => {
    const [x, z] = trees[Math.floor(i / each)], group = Math.floor((i % each) / 3), salt = 20 * kind;
    const turn = 2 * Math.PI * chance(Math.floor(i / each) * 7 + group + 1, salt), far = reach * (0.12 + 0.88 * chance(Math.floor(i / each) * 5 + group + 1, salt + 1));
    const apart = 0.16 * reach * Math.sqrt(chance(i + 1, salt + 2)), way = 2 * Math.PI * chance(i + 1, salt + 3);
    return { x: x + far * Math.cos(turn) + apart * Math.cos(way), z: z + far * Math.sin(turn) + apart * Math.sin(way),
      size: 0.8 + 0.8 * chance(i + 1, salt + 4), angle: 2 * Math.PI * chance(i + 1, salt + 5), seconds: 100 * chance(i + 1, salt + 6) };
  });
}

/** As `floorPlaces`, in the axes of the plant that stands there; its foot: the first vertex of its rest pose. */
export function rooted(places, { metadata, rest }) {
  if (metadata.up_axis === "z") return places.map(({ x, z, size, ...more }) => ({ ...more, size, x, y: -z, z: rest[2] * (1 - size) }));
  return places.map(({ size, ...more }) => ({ ...more, size, y: rest[1] * (1 - size) }));
}

const EACH = 4;

/** Returns what an attribute names for the floor: files with spaces between them, each with `=COUNT` behind it, or none. */
export function floorIn(text) {
  return (text.match(/\S+/g) ?? []).map((each) => /^(.*?)(?:=([\d.]+))?$/.exec(each)).map(([, source, count]) => ({ source, each: Number(count) || EACH }));
}

/** Returns what an address names for the floor: `floor=URL`, one or several, each with an `each=COUNT` behind it, or none. */
export function floorOf(wanted) {
  const counts = wanted.getAll("each").map(Number);
  return wanted.getAll("floor").map((source, i) => ({ source, each: counts[i] > 0 ? counts[i] : EACH }));
}
