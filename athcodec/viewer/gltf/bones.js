// Meshes that `athcodec decode --onto MESH --bind` wrote, moved by the positions of the plant's own file. Frames turn along the stems by
// the smallest rotations, as athcodec/binding/chains.py turns them.

import { Quaternion, Vector3 } from "three";

const GROWTH = 0.1, LEAST = 1e-9; // As chains.py has them; the second is a share of the plant's diagonal.

/** For the scene of a GLB: moves its bones as the plant of an .ath file stands. */
export class ATHBones {
  #bones;
  #list;  // {vertex, before, after, first, error}
  #rest;
  #restTangent;
  #tangent;
  #centre;
  #turn;
  #stemStarts; // The bones that are the first of their stem.
  #restLength;
  #least;

  constructor(scene) {
    let above = null;
    const skeletons = new Set();
    scene.traverse((object) => {
      if (object.userData.ATH_bones) above = object;
      if (!object.isSkinnedMesh) return;
      skeletons.add(object.skeleton);
      object.frustumCulled = false; // three.js knows the bounds of the rest pose alone.
    });
    if (!above || !skeletons.size) throw new TypeError("scene: got no bones of a plant, expected a GLB that `athcodec decode --onto MESH --bind` wrote");
    this.#list = above.userData.ATH_bones;
    this.#bones = [...skeletons][0].bones;
    const count = this.#bones.length;
    this.#rest = new Float64Array(3 * count);
    this.#bones.forEach(({ position }, bone) => position.toArray(this.#rest, 3 * bone));
    this.#centre = new Float64Array(3 * count);
    this.#tangent = new Float64Array(3 * count);
    this.#restTangent = new Float64Array(3 * count);
    this.#turn = Array.from({ length: count }, () => new Quaternion());
    this.#stemStarts = new Set(this.#list.first);
    this.#least = LEAST * extent(this.#rest);
    this.#tangents(this.#rest, this.#restTangent);
    this.#restLength = this.#lengths(this.#rest);
  }

  /** Vertices of the plant, in the source's order, that the bones follow. */
  get vertices() {
    return Int32Array.from(this.#list.vertex);
  }

  /** Moves the bones to where the plant is. positions: x, y, z of all its vertices in the source's order. */
  pose(positions) {
    const { vertex, before } = this.#list, centre = this.#centre, tangent = this.#tangent;
    for (let bone = 0; bone < vertex.length; bone++)
      for (let k = 0; k < 3; k++) centre[3 * bone + k] = positions[3 * vertex[bone] + k];
    this.#tangents(centre, tangent);
    const length = this.#lengths(centre);
    for (let bone = 0; bone < vertex.length; bone++) {
      const turn = this.#turn[bone], inherited = before[bone] >= 0 ? this.#turn[before[bone]] : STILL;
      carried.fromArray(this.#restTangent, 3 * bone).applyQuaternion(inherited);
      now.fromArray(tangent, 3 * bone);
      turn.copy(inherited);
      if (carried.lengthSq() > 0.5 && now.lengthSq() > 0.5) turn.premultiply(smallest.setFromUnitVectors(carried.normalize(), now));
      const object = this.#bones[bone];
      object.position.fromArray(centre, 3 * bone);
      object.quaternion.copy(turn);
      object.scale.setScalar(this.#growth(length[bone], this.#restLength[bone]));
    }
    return this;
  }

  // Unit tangents of parabolas through each bone and its neighbours; 0 where nothing tells.
  #tangents(centre, tangent) {
    const { before, after } = this.#list;
    for (let bone = 0; bone < before.length; bone++) {
      here.fromArray(centre, 3 * bone);
      into.set(0, 0, 0);
      out.set(0, 0, 0);
      if (before[bone] >= 0) into.fromArray(centre, 3 * before[bone]).sub(here).negate();
      if (after[bone] >= 0) out.fromArray(centre, 3 * after[bone]).sub(here);
      const arrives = into.length(), leaves = out.length();
      into.multiplyScalar(arrives > this.#least ? (leaves > this.#least ? leaves : 1) / arrives : 0);
      out.multiplyScalar(leaves > this.#least ? (arrives > this.#least ? arrives : 1) / leaves : 0);
      into.add(out).normalize().toArray(tangent, 3 * bone);
    }
  }

  // The lengths of the elements of its own stem at each bone, added up.
  #lengths(centre) {
    const { before } = this.#list, sum = new Float64Array(before.length);
    for (let bone = 0; bone < before.length; bone++) {
      if (before[bone] < 0) continue;
      const length = here.fromArray(centre, 3 * bone).distanceTo(into.fromArray(centre, 3 * before[bone]));
      sum[bone] += length;
      if (!this.#stemStarts.has(bone)) sum[before[bone]] += length;
    }
    return sum;
  }

  // The scale of what hangs on a bone: the stretch of its stem, as far as it is growth and no error.
  #growth(length, rest) {
    if (!(rest > this.#least)) return 1;
    const slack = GROWTH + 4 * this.#list.error / rest, stretch = length / rest;
    return stretch / Math.min(Math.max(stretch, Math.max(1 - slack, 1e-30)), 1 + slack);
  }
}

const STILL = new Quaternion(), smallest = new Quaternion();
const here = new Vector3(), into = new Vector3(), out = new Vector3(), carried = new Vector3(), now = new Vector3();

function extent(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  points.forEach((value, at) => {
    low[at % 3] = Math.min(low[at % 3], value);
    high[at % 3] = Math.max(high[at % 3], value);
  });
  return Math.hypot(...high.map((value, axis) => value - low[axis])) || 1;
}
