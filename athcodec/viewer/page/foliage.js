// Bark and leaves for plants that are lines: strips along edges, crossed, and leaves on the thin ones.

import { BufferAttribute, BufferGeometry, Color, Vector3 } from "three";

import { chance } from "./chance.js";

const BARK = new Color(0x6a543c), LEAVES = [0x4f7a34, 0x6b9440, 0x86a94a].map((hex) => new Color(hex));
const MOST_LEAVES = 2600;

/** A function that makes leafed geometry of lines. Fewer lines carry fewer, larger leaves, that together cover as much. */
export function foliage(ath, radius) {
  const { rest, sphere } = ath, thin = [...radius].sort((a, b) => a - b)[Math.floor(0.7 * radius.length)];
  const size = 0.026 * sphere.radius;
  const isThin = (vertex) => radius[vertex] <= thin;
  const at = (vertex) => new Vector3().fromArray(rest, 3 * vertex);
  return (lines) => {
    const { source } = lines.userData, index = lines.index.array, out = { offset: [], normal: [], color: [], vertices: [], index: [] };
    const corner = (vertex, offset, normal, color) => {
      out.vertices.push(vertex);
      out.offset.push(offset.x, offset.y, offset.z);
      out.normal.push(normal.x, normal.y, normal.z);
      out.color.push(color.r, color.g, color.b);
      return out.vertices.length - 1;
    };
    const strip = (a, b, across, normal) => {
      const side = (vertex, way) => corner(vertex, across.clone().multiplyScalar(way * radius[vertex]), normal, BARK);
      const first = [side(a, -1), side(a, 1), side(b, -1), side(b, 1)];
      out.index.push(first[0], first[1], first[2], first[2], first[1], first[3]);
    };
    const edges = Array.from({ length: index.length / 2 }, (_, e) => [source[index[2 * e]], source[index[2 * e + 1]]]);
    for (const [a, b] of edges) {
      const along = at(b).sub(at(a)).normalize(), u = new Vector3(along.y, -along.x, along.z * 0.1).cross(along).normalize();
      const v = new Vector3().crossVectors(along, u);
      strip(a, b, u, v);
      if (!isThin(b)) strip(a, b, v, u);
    }
    const bearing = edges.map(([, b]) => b).filter(isThin), count = Math.min(MOST_LEAVES, 2 * bearing.length);
    const large = size * Math.sqrt(MOST_LEAVES / Math.max(count, 60));
    for (let i = 0; i < count; i++) {
      const vertex = bearing[Math.floor(i * bearing.length / count)], turn = 2 * Math.PI * chance(i, 1), rise = chance(i, 2) - 0.35;
      const way = new Vector3(Math.cos(turn), rise, Math.sin(turn)).normalize().multiplyScalar(large);
      const across = new Vector3(-Math.sin(turn), 0.6 * (chance(i, 3) - 0.5), Math.cos(turn)).multiplyScalar(0.42 * large);
      const normal = at(vertex).sub(sphere.center).normalize().add(new Vector3(0, 0.7, 0)).normalize(); // as a crown's, which is softer
      const color = LEAVES[i % 3].clone().multiplyScalar(0.8 + 0.4 * chance(i, 4)), middle = way.clone().multiplyScalar(0.5);
      const first = corner(vertex, new Vector3(), normal, color);
      corner(vertex, middle.clone().add(across), normal, color);
      corner(vertex, middle.clone().sub(across), normal, color);
      corner(vertex, way, normal, color);
      out.index.push(first, first + 1, first + 2, first + 2, first + 1, first + 3);
    }
    const geometry = new BufferGeometry();
    for (const [name, values] of [["athOffset", out.offset], ["normal", out.normal], ["color", out.color]])
      geometry.setAttribute(name, new BufferAttribute(Float32Array.from(values), 3));
    geometry.setIndex(new BufferAttribute(Uint32Array.from(out.index), 1));
    geometry.userData.vertices = Uint32Array.from(out.vertices);
    return geometry;
  };
}
