// Many instances of one plant, each with a place, size, turn, clip and time of its own, drawn at the level that its
// distance asks for: a few draw calls per frame and clip. The motion of a clip at a level lies in one texture for all
// instances of it.

import { DynamicDrawUsage, Frustum, Group, InstancedBufferAttribute, InstancedBufferGeometry, LineBasicMaterial, LineSegments,
  Matrix4, Mesh, MeshStandardMaterial, Sphere, Vector3, BufferAttribute, DoubleSide } from "three";

import { dataTexture, eased, roundOf } from "./ATHMotion.js";
import { clustered, gather, upright } from "./geometry.js";
import { injectMotion, motionUniforms, shadowMaterials } from "./shader.js";

const MOST_TEXELS = 4 << 20; // Texels of one level: 64 MiB. Longer clips are played at fewer frames a second.
const TALLEST = 4096;        // rows of a texture that every device has
const CELL = 1.5;            // side of the cells of simplified geometry, in pixels' worth of error
const COARSER = 2;           // from one geometry to the next
const FEWER = 0.85;          // A geometry is made if it has at most this share of the vertices of the one before.
const MOTIONS = -1;          // in place of a clip's number: the one that the motion plays

const plainMaterial = (lines) => (lines ? new LineBasicMaterial({ color: 0x6b5b45 })
  : new MeshStandardMaterial({ color: 0x8a9a6b, roughness: 0.8, side: DoubleSide }));
const breath = () => new Promise((done) => { setTimeout(done); });

export class ATHForest extends Group {
  levelOfDetail = true;
  pixels = 1;
  measure = "p99"; // Measure of the errors that `pixels` limits; set it before the first bake().
  fade = 0.2;      // seconds that an instance takes to another level; 0: none
  fading = false;  // whether one does
  counts = [];     // instances drawn, by level
  vertices = 0;    // drawn, all instances
  culled = 0;

  #ath;
  #bins = new Map();    // By clip, the finest first: {level, tolerance, drawn, place, turn, size, uniforms, filled,
                        // rows, perRow, texel, fades}; fades: of levels that instances fade in from, the same and `from`
  #shown = [];          // Bins that the motion's clip was drawn with last.
  #baking = new Set();
  #baked = new Map();   // By clip: its baked levels.
  #motions = new Map(); // By clip that only instances play: the motion that fetches it.
  #places = new Float32Array(0);
  #turns = new Float32Array(0); // cosine, sine, seconds ahead, clip
  #looks = new Float32Array(0); // amplitude, tint
  #moved = 0;           // How far from its place an instance of size 1 and amplitude 1 is seen in any baked frame.
  #states = [];         // For every instance in view: {clip, level, from, since}; from: -1, or what it fades in from
  #material;
  #depthMaterial;
  #geometry;
  #now = 0;             // Time of the last update(), milliseconds.

  /** geometry: what is drawn (default: the file's faces, else lines). material(isLines, level): makes the material of a
   * level (default: like ath.object's); depthMaterial(): what its shadows are drawn with, where `castShadow` is set. */
  constructor(ath, { geometry = ath.geometry ?? ath.lines, material = plainMaterial, depthMaterial = null } = {}) {
    super();
    this.#ath = ath;
    this.#geometry = geometry;
    this.#material = material;
    this.#depthMaterial = depthMaterial;
    this.name = "ath forest";
    upright(this, ath.metadata);
  }

  get count() {
    return this.#places.length / 4;
  }

  /** Levels of the motion's clip that can be drawn. */
  get baked() {
    return this.#baked.get(this.#ath.motion.clip.index) ?? [];
  }

  /** instances: {x, y, z, size, angle, seconds, clip, amplitude, tint} in the units and axes of the file. */
  setInstances(instances) {
    const { motion } = this.#ath;
    for (const { clip } of instances) if (clip !== undefined && !this.#motions.has(clip))
      this.#motions.set(clip, motion.clone().play(clip).setLevel(motion.levelCount - 1));
    const numberOf = (clip) => this.#motions.get(clip)?.clip.index ?? MOTIONS;
    this.#places = Float32Array.from(instances.flatMap(({ x, y, z, size }) => [x, y, z, size]));
    this.#turns = Float32Array.from(instances.flatMap(({ angle, seconds, clip }) =>
      [Math.cos(angle), Math.sin(angle), seconds, numberOf(clip)]));
    this.#looks = Float32Array.from(instances.flatMap(({ amplitude = 1, tint = 0xffffff }) =>
      [amplitude, ...[16, 8, 0].map((shift) => ((tint >> shift) & 255) / 255)]));
    this.#states = [];
    for (const bin of this.#allBins()) this.#makeRoom(bin);
  }

  #allBins() {
    return [...this.#bins.values()].flat().flatMap((bin) => [bin, ...bin.fades.values()]);
  }

  /** Gets all levels ready to be drawn that are here, of all clips that instances play: once per frame. */
  bakeReady() {
    for (const motion of [this.#ath.motion, ...this.#motions.values()])
      for (let level = 0; level <= motion.readyLevel; level++) this.#bake(level, motion.clip);
  }

  /** Gets a level ready to be drawn; all bytes of it have to be here. */
  bake(level) {
    return this.#bake(level, this.#ath.motion.clip);
  }

  async #bake(level, clip) {
    const key = `${clip.index}/${level}`;
    if (this.#baking.has(key)) return;
    this.#baking.add(key);
    const { channel, metadata } = this.#ath, known = await channel.parts(level);
    const step = Math.max(1, Math.ceil(clip.frameCount * known.texels / Math.min(MOST_TEXELS, 1024 * TALLEST)));
    const baked = await channel.bake(clip.index, level, step);
    if (!baked.data || baked.texels !== known.texels || !this.#ath) {
      this.#baking.delete(key);
      return;
    }
    const uniforms = motionUniforms(), { nodeCount, exactCount } = known.parts;
    uniforms.athData.value = dataTexture(baked.data);
    uniforms.athForest.value.set(baked.texels, metadata.up_axis === "z" ? 1 : 0);
    uniforms.athStride.value = exactCount > 0 ? (known.texels - 3 * nodeCount) / exactCount : 1;
    this.#moved = Math.max(this.#moved, furthest(baked, known, uniforms.athStride.value));
    await this.#draw(level, clip, known, { uniforms, rows: baked.rows, perRow: roundOf(clip) / baked.rows || 1 });
    this.#baked.set(clip.index, [...this.#baked.get(clip.index) ?? [], level]);
    this.dispatchEvent({ type: "level", level });
  }

  // Geometries of a level: the finest for where its error is a pixel, coarser ones up to where the level before takes over.
  async #draw(level, clip, known, played) {
    const { channel, motion, rest, sphere } = this.#ath, deepest = level === motion.levelCount - 1;
    const error = (of) => clip.errors[of][this.measure];
    const least = error(level), most = level > 0 ? error(level - 1) : sphere.radius / 4;
    const node = channel.nodeNumbers(known), texel = known.vertices;
    node.forEach((_, vertex) => { if (texel[vertex] < 0) node[vertex] = -1; }); // exact runs: one space
    const material = injectMotion(this.#material(!this.#geometry.hasAttribute("normal"), level), played.uniforms, true);
    const place = (geometry, tolerance) => this.#addBin(clip, geometry, material, { ...played, texel, level, tolerance });
    let before = deepest ? this.#geometry : clustered(this.#geometry, rest, CELL * least, node);
    place(before, least);
    for (let tolerance = Math.max(COARSER * least, sphere.radius / 2000); tolerance < most; tolerance *= COARSER) {
      await breath();
      if (!this.#ath) return;
      const less = clustered(this.#geometry, rest, CELL * tolerance, node);
      if (less.userData.source.length > FEWER * before.userData.source.length) continue;
      place(less, tolerance);
      before = less;
    }
  }

  #addBin(clip, base, material, played) {
    const bin = this.#newBin(clip.index, base, material, { ...played, base, fades: new Map() });
    this.#bins.set(clip.index, [...this.#bins.get(clip.index) ?? [], bin].sort((a, b) => a.tolerance - b.tolerance));
  }

  #newBin(clip, base, material, played) {
    const geometry = new InstancedBufferGeometry(), { source } = base.userData, lines = !base.hasAttribute("normal");
    const parts = ({ texel }) => new BufferAttribute(gather(new Float32Array(source.length), texel, source, 1), 1);
    geometry.setIndex(base.index);
    for (const [name, attribute] of Object.entries(base.attributes))
      if (name !== "athPart") geometry.setAttribute(name, attribute);
    geometry.setAttribute("athPart", parts(played));
    if (played.from) geometry.setAttribute("athPartBefore", parts(played.from));
    const drawn = lines ? new LineSegments(geometry, material) : new Mesh(geometry, material);
    Object.assign(drawn, shadowMaterials(played.uniforms, true), { castShadow: this.castShadow, receiveShadow: this.receiveShadow });
    if (this.#depthMaterial) drawn.customDepthMaterial = injectMotion(this.#depthMaterial(), played.uniforms, true);
    Object.assign(drawn.userData, { level: played.level, clip });
    drawn.frustumCulled = false; // instances are, one by one
    const bin = { ...played, drawn, size: source.length, filled: 0 };
    this.#makeRoom(bin);
    this.add(drawn);
    return bin;
  }

  // Draws instances of a bin that fade in from the level of another.
  #fadingBin(clip, bin, from) {
    if (!bin.fades.has(from.level)) {
      const { athData, athForest, athStride } = from.uniforms, lines = !bin.base.hasAttribute("normal");
      const uniforms = { ...bin.uniforms, athDataBefore: athData, athBefore: { value: athForest.value.clone().setY(athStride.value) } };
      const material = injectMotion(this.#material(lines, bin.level), uniforms, true);
      bin.fades.set(from.level, this.#newBin(clip, bin.base, material, { ...bin, uniforms, from, fades: new Map() }));
    }
    return bin.fades.get(from.level);
  }

  // A geometry keeps the number of instances that it was first drawn with: another number takes another one.
  #makeRoom(bin) {
    const old = bin.drawn.geometry, geometry = new InstancedBufferGeometry();
    geometry.setIndex(old.index);
    for (const [name, attribute] of Object.entries(old.attributes)) geometry.setAttribute(name, attribute);
    for (const [key, name] of [["place", "athPlace"], ["turn", "athTurn"], ["look", "athLook"], ...(bin.from ? [["share", "athFading"]] : [])]) {
      bin[key] = new InstancedBufferAttribute(new Float32Array(Math.max(4, this.#places.length)), 4);
      geometry.setAttribute(name, bin[key].setUsage(DynamicDrawUsage));
    }
    geometry.instanceCount = 0;
    bin.drawn.geometry = geometry;
    old.dispose();
  }

  /** Chooses what to draw: once per frame. height: of the screen, in pixels. */
  update(camera, height, seconds) {
    const bins = this.#allBins(), sphere = new Sphere(), view = new Frustum(), place = sphere.center, still = this.#reach();
    this.updateWorldMatrix(true, false);
    const eye = new Vector3().setFromMatrixPosition(camera.matrixWorld).applyMatrix4(new Matrix4().copy(this.matrixWorld).invert());
    view.setFromProjectionMatrix(new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
      .multiply(this.matrixWorld));
    const pixel = 2 * Math.tan(camera.fov * Math.PI / 360) / height; // at distance 1
    this.#now = performance.now();
    this.culled = 0;
    this.fading = false;
    for (const bin of bins) bin.filled = 0;
    this.#shown = this.#bins.get(this.#ath.motion.clip.index) ?? this.#shown;
    for (let i = 0; i < this.#places.length && bins.length > 0; i += 4) {
      const size = this.#places[i + 3], reach = this.#reach(this.#looks[i]);
      place.fromArray(this.#places, i);
      sphere.radius = reach * size;
      if (!view.intersectsSphere(sphere)) {
        this.culled++;
        this.#states[i / 4] = null;
        continue;
      }
      const distance = Math.max(eye.distanceTo(place) - 0.5 * still * size, 1e-6);
      const binsOfClip = this.#bins.get(this.#turns[i + 3]) ?? this.#shown, tolerance = this.pixels * pixel * distance / size;
      if (binsOfClip.length > 0) this.#putInstance(i, binsOfClip, this.levelOfDetail ? tolerance : 0, seconds);
    }
    this.counts = new Array(this.#ath.motion.levelCount).fill(0);
    this.vertices = 0;
    for (const bin of this.#allBins()) this.#show(bin);
  }

  // An instance, whose numbers begin at `i`, by the bins of its clip.
  #putInstance(i, binsOfClip, tolerance, seconds) {
    const wanted = binsOfClip[this.#choose(binsOfClip, tolerance)], { clip } = wanted.drawn.userData, state = this.#stateOf(i / 4, clip, wanted.level);
    const bin = state.level === wanted.level ? wanted : this.#likeIt(binsOfClip, state.level, tolerance);
    const from = state.from < 0 ? null : binsOfClip.find(({ level }) => level === state.from);
    if (!from) {
      this.#put(i, bin, seconds);
      return;
    }
    this.fading = true;
    this.#put(i, this.#fadingBin(clip, bin, from), seconds, 1 - eased(this.#passed(state)));
  }

  // The coarsest geometry of a level that is good enough; its finest where none is.
  #likeIt(binsOfClip, level, tolerance) {
    const bins = binsOfClip.filter((bin) => bin.level === level);
    return bins[this.#choose(bins, tolerance)];
  }

  // The level of an instance, and that which it fades in from: a change waits until the one before is over.
  #stateOf(instance, clip, level) {
    let state = this.#states[instance];
    if (!state || state.clip !== clip) state = this.#states[instance] = { clip, level, from: -1, since: 0 };
    if (state.from >= 0 && this.#passed(state) >= 1) state.from = -1;
    if (state.from < 0 && state.level !== level)
      Object.assign(state, { level, from: this.fade > 0 ? state.level : -1, since: this.#now });
    return state;
  }

  #passed({ since }) {
    return (this.#now - since) / 1000 / this.fade;
  }

  // Into the next place of a bin; share: that of the level before.
  #put(i, bin, seconds, share = 0) {
    const { place, turn, look } = bin, at = 4 * bin.filled++;
    for (let k = 0; k < 4; k++) place.array[at + k] = this.#places[i + k];
    for (let k = 0; k < 4; k++) look.array[at + k] = this.#looks[i + k];
    turn.array[at] = this.#turns[i];
    turn.array[at + 1] = this.#turns[i + 1];
    this.#putRow(turn.array, at + 2, bin, seconds + this.#turns[i + 2]);
    if (!bin.from) return;
    this.#putRow(bin.share.array, at, bin.from, seconds + this.#turns[i + 2]);
    bin.share.array[at + 2] = share;
  }

  // The row of a texture that a time is at, and the one behind it.
  #putRow(out, at, { rows, perRow }, seconds) {
    const row = Math.fround((seconds / perRow) % rows), shown = row < 0 ? row + rows : row;
    out[at] = shown < rows ? shown : 0; // a fraction may have been rounded up
    out[at + 1] = (Math.floor(out[at]) + 1) % rows;
  }

  // How far from its place an instance of size 1 can be seen, whatever its turn. Vertices are on the lines from the rest pose through
  // where they are at amplitude 1, as many times as far along.
  #reach(amplitude = 1) {
    const { center, radius } = this.#ath.sphere, rest = center.length() + radius, beyond = Math.max(Math.abs(amplitude - 0.5) - 0.5, 0);
    return Math.max(rest, this.#moved) + beyond * (rest + this.#moved);
  }

  // The coarsest that is good enough; the finest where none is.
  #choose(bins, tolerance) {
    let chosen = 0;
    while (chosen + 1 < bins.length && bins[chosen + 1].tolerance <= tolerance) chosen++;
    return chosen;
  }

  #show(bin) {
    const { filled, drawn } = bin;
    drawn.geometry.instanceCount = filled;
    drawn.visible = filled > 0;
    this.counts[bin.level] += filled;
    this.vertices += filled * bin.size;
    for (const attribute of [bin.place, bin.turn, bin.look, bin.share].filter(Boolean)) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, 4 * filled);
      attribute.needsUpdate = filled > 0;
    }
  }

  dispose() {
    for (const motion of this.#motions.values()) motion.dispose();
    for (const { uniforms, drawn } of this.#allBins()) {
      uniforms.athData.value.dispose();
      drawn.geometry.dispose();
      for (const material of [drawn.material, drawn.customDepthMaterial, drawn.customDistanceMaterial]) material.dispose();
    }
    this.#bins.clear();
    this.#ath = null;
  }
}

// The largest distance of anything from 0 in baked frames: nodes by the boxes of what they move, exact vertices by themselves.
function furthest({ data, rows, texels }, { parts: { nodeCount, exactCount }, boxes }, stride) {
  let most = 0;
  for (let row = 0; row < rows; row++) {
    const start = 4 * row * texels;
    for (const [at, x, y, z, a, b, c] of boxes) {
      let sum = 0;
      for (let m = start + at, k = 0; k < 3; k++, m += 4) {
        const middle = data[m] * x + data[m + 1] * y + data[m + 2] * z + data[m + 3];
        sum += (Math.abs(middle) + Math.abs(data[m]) * a + Math.abs(data[m + 1]) * b + Math.abs(data[m + 2]) * c) ** 2;
      }
      most = Math.max(most, sum);
    }
    for (let i = 0, at = start + 12 * nodeCount; i < exactCount; i++, at += 4 * stride)
      most = Math.max(most, data[at] ** 2 + data[at + 1] ** 2 + data[at + 2] ** 2);
  }
  return Math.sqrt(most);
}
