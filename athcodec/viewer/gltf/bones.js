// Meshes that `athcodec decode --onto MESH --bind` wrote, moved by the positions of the plant's own file. Frames turn along the stems by
// the smallest rotations, and slices of surfaces by the rotations that fit their vertices best, as athcodec/binding/chains.py turns them.

import { Matrix4, Quaternion, Vector3 } from "three";

const GROWTH = 0.1, LEAST = 1e-9, PRIOR = 1e-3; // As chains.py has them; the second is a share of the plant's diagonal.

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
  #length;
  #least;
  #slices; // Of each bone that is a slice of a surface: its vertices, their offsets at rest, and what is known of both; else null.
  #stems;  // Runs [first, stop) of bones that are slices of one surface, with the moment of each.

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
    this.#restLength = this.#lengths(this.#rest, new Float64Array(count));
    this.#length = new Float64Array(count);
    this.#slices = slicesOf(this.#list.slices, count);
    const firsts = [...this.#list.first, count];
    this.#stems = this.#list.first.map((first, at) => ({ first, stop: firsts[at + 1], moment: new Float64Array(9) }))
      .filter(({ first }) => this.#slices[first]);
  }

  /** Vertices of the plant, in the source's order, that the bones follow; of a slice of a surface one of its vertices. */
  get vertices() {
    return Int32Array.from(this.#list.vertex);
  }

  /** Moves the bones to where the plant is. positions: x, y, z of all its vertices in the source's order. No array or object is allocated. */
  pose(positions) {
    const { vertex, before } = this.#list, centre = this.#centre, tangent = this.#tangent;
    for (let bone = 0; bone < vertex.length; bone++) {
      const slice = this.#slices[bone];
      for (let k = 0; k < 3; k++) {
        let sum = slice ? 0 : positions[3 * vertex[bone] + k];
        for (let i = 0; slice && i < slice.vertices.length; i++) sum += positions[3 * slice.vertices[i] + k];
        centre[3 * bone + k] = sum / (slice ? slice.vertices.length : 1);
      }
    }
    this.#fit(positions);
    this.#tangents(centre, tangent);
    const length = this.#lengths(centre, this.#length);
    for (let bone = 0; bone < vertex.length; bone++) {
      const turn = this.#turn[bone], inherited = before[bone] >= 0 ? this.#turn[before[bone]] : STILL;
      const slice = this.#slices[bone], object = this.#bones[bone];
      if (!slice) {
        carried.fromArray(this.#restTangent, 3 * bone).applyQuaternion(inherited);
        now.fromArray(tangent, 3 * bone);
        turn.copy(inherited);
        if (carried.lengthSq() > 0.5 && now.lengthSq() > 0.5) turn.premultiply(smallest.setFromUnitVectors(carried.normalize(), now));
      }
      object.position.fromArray(centre, 3 * bone);
      object.quaternion.copy(turn);
      object.scale.setScalar(slice ? slice.size : this.#growth(length[bone], this.#restLength[bone]));
    }
    return this;
  }

  // Turns and sizes of slices. A slice is turned with those before and behind it, near the turn of its whole surface, which decides
  // where they leave a turn free; and that of all surfaces decides for a surface.
  #fit(positions) {
    const centre = this.#centre, rest = this.#rest, least = this.#least ** 2;
    ofAll.fill(0);
    for (let stem = 0; stem < this.#stems.length; stem++) {
      const { first, stop, moment } = this.#stems[stem];
      let count = 0;
      moment.fill(0);
      middle.fill(0);
      restMiddle.fill(0);
      for (let bone = first; bone < stop; bone++) {
        const slice = this.#slices[bone], weight = slice.vertices.length;
        slice.measure(positions, centre, 3 * bone, least);
        count += weight;
        for (let k = 0; k < 3; k++) {
          middle[k] += weight * centre[3 * bone + k];
          restMiddle[k] += weight * rest[3 * bone + k];
        }
      }
      for (let k = 0; k < 3; k++) { middle[k] /= count; restMiddle[k] /= count; }
      for (let bone = first; bone < stop; bone++) this.#slices[bone].addTo(moment, centre, rest, 3 * bone, middle, restMiddle, 0);
      for (let at = 0; at < 9; at++) ofAll[at] += moment[at];
    }
    bestTurn(ofAll, STILL, ofPlant);
    for (let stem = 0; stem < this.#stems.length; stem++) {
      const { first, stop, moment } = this.#stems[stem];
      bestTurn(moment, ofPlant, ofStem);
      for (let bone = first; bone < stop; bone++) {
        ofThree.fill(0);
        for (let next = -1; next <= 1; next++) { // At an end it is itself its neighbour.
          const other = Math.min(Math.max(bone + next, first), stop - 1);
          this.#slices[other].addTo(ofThree, centre, rest, 3 * other, centre, rest, 3 * bone);
        }
        bestTurn(ofThree, ofStem, this.#turn[bone]);
      }
    }
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

  // Writes the lengths of the elements of its own stem at each bone, added up.
  #lengths(centre, sum) {
    const { before } = this.#list;
    sum.fill(0);
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

// A slice of a surface: the vertices that stand for it.
class Slice {
  constructor(vertices, offsets) {
    this.vertices = vertices;
    this.offsets = offsets;
    this.spread = offsets.reduce((sum, value) => sum + value * value, 0);
    this.size = 1;
    this.moment = new Float64Array(9); // Of the places and the offsets at rest, about the centre: a row for x, y and z.
  }

  measure(positions, centre, at, least) {
    const { vertices, offsets, moment } = this;
    let spread = 0;
    moment.fill(0);
    for (let number = 0; number < vertices.length; number++)
      for (let row = 0; row < 3; row++) {
        const off = positions[3 * vertices[number] + row] - centre[at + row];
        spread += off * off;
        for (let column = 0; column < 3; column++) moment[3 * row + column] += off * offsets[3 * number + column];
      }
    this.size = this.spread > least ? Math.sqrt(spread / this.spread) : 1;
  }

  // Adds its moment about another place.
  addTo(sum, centre, rest, at, middle, restMiddle, middleAt) {
    const weight = this.vertices.length;
    for (let row = 0; row < 3; row++) {
      const off = weight * (centre[at + row] - middle[middleAt + row]);
      for (let column = 0; column < 3; column++)
        sum[3 * row + column] += this.moment[3 * row + column] + off * (rest[at + column] - restMiddle[middleAt + column]);
    }
  }
}

function slicesOf(list, count) {
  const slices = new Array(count).fill(null);
  let at = 0;
  list?.bone.forEach((bone, number) => {
    const end = at + list.count[number];
    slices[bone] = new Slice(list.vertex.slice(at, end), list.offset.slice(3 * at, 3 * end));
    at = end;
  });
  return slices;
}

// The rotation that fits a moment best, near `prior` where it leaves one free: the largest eigenvector of Horn's matrix (J. Opt. Soc. Am.
// A 4(4), 1987), by Jacobi's method.
function bestTurn(moment, prior, out) {
  const { elements } = matrix.makeRotationFromQuaternion(prior); // by columns
  let squares = 0;
  for (let at = 0; at < 9; at++) squares += moment[at] ** 2;
  const size = Math.sqrt(squares) || 1;
  for (let at = 0; at < 9; at++) S[at] = moment[at] / size + PRIOR * elements[4 * (at % 3) + Math.floor(at / 3)];
  a[0] = S[0] + S[4] + S[8];
  a[5] = S[0] - S[4] - S[8];
  a[10] = S[4] - S[0] - S[8];
  a[15] = S[8] - S[0] - S[4];
  a[1] = a[4] = S[7] - S[5];
  a[2] = a[8] = S[2] - S[6];
  a[3] = a[12] = S[3] - S[1];
  a[6] = a[9] = S[1] + S[3];
  a[7] = a[13] = S[2] + S[6];
  a[11] = a[14] = S[5] + S[7];
  v.fill(0);
  for (let k = 0; k < 4; k++) v[5 * k] = 1;
  for (let sweep = 0; sweep < SWEEPS; sweep++)
    for (let p = 0; p < 3; p++)
      for (let q = p + 1; q < 4; q++) {
        if (Math.abs(a[4 * p + q]) < 1e-15) continue;
        const theta = (a[5 * q] - a[5 * p]) / (2 * a[4 * p + q]);
        const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1)), c = 1 / Math.sqrt(t * t + 1), s = t * c;
        for (let k = 0; k < 4; k++) {
          const x = a[4 * k + p], y = a[4 * k + q];
          a[4 * k + p] = c * x - s * y;
          a[4 * k + q] = s * x + c * y;
        }
        for (let k = 0; k < 4; k++) {
          const x = a[4 * p + k], y = a[4 * q + k], u = v[4 * k + p], w = v[4 * k + q];
          a[4 * p + k] = c * x - s * y;
          a[4 * q + k] = s * x + c * y;
          v[4 * k + p] = c * u - s * w;
          v[4 * k + q] = s * u + c * w;
        }
      }
  let best = 0;
  for (let k = 1; k < 4; k++) if (a[5 * k] > a[5 * best]) best = k;
  out.set(v[4 + best], v[8 + best], v[12 + best], v[best]).normalize();
}

const SWEEPS = 8; // Jacobi's method converges within them.
const STILL = new Quaternion(), ofPlant = new Quaternion(), ofStem = new Quaternion(), matrix = new Matrix4(), smallest = new Quaternion();
const ofAll = new Float64Array(9), ofThree = new Float64Array(9), middle = new Float64Array(3), restMiddle = new Float64Array(3);
const S = new Float64Array(9), a = new Float64Array(16), v = new Float64Array(16); // of bestTurn: 3 and 4 rows
const here = new Vector3(), into = new Vector3(), out = new Vector3(), carried = new Vector3(), now = new Vector3();

function extent(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  points.forEach((value, at) => {
    low[at % 3] = Math.min(low[at % 3], value);
    high[at % 3] = Math.max(high[at % 3], value);
  });
  return Math.hypot(...high.map((value, axis) => value - low[axis])) || 1;
}
