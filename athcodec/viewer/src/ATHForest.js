// Many instances of one plant, each with a place, size, turn, clip and time of its own, drawn at the level that its
// distance asks for: a few draw calls per frame and clip. The motion of a clip at a level lies in one texture for all
// instances of it.

import { DynamicDrawUsage, Frustum, Group, InstancedBufferAttribute, InstancedBufferGeometry, LineBasicMaterial, LineSegments,
  Matrix4, Mesh, MeshStandardMaterial, Sphere, Vector3, BufferAttribute, DoubleSide } from "three";

import { dataTexture, roundOf } from "./ATHMotion.js";
import { clustered, gather } from "./geometry.js";
import { injectMotion, motionUniforms } from "./shader.js";

const MOST_TEXELS = 4 << 20; // of one level: 64 MiB; longer clips are played at fewer frames a second
const TALLEST = 4096;        // rows of a texture that every device has
const CELL = 1.5;            // side of the cells of simplified geometry, in pixels' worth of error
const COARSER = 2;           // from one geometry to the next
const FEWER = 0.85;          // of the vertices before, for a geometry to be worth it
const MOTIONS = -1;          // in place of a clip's number: the one that the motion plays

const plainMaterial = (lines) => (lines ? new LineBasicMaterial({ color: 0x6b5b45 })
  : new MeshStandardMaterial({ color: 0x8a9a6b, roughness: 0.8, side: DoubleSide }));
const breath = () => new Promise((done) => { setTimeout(done); });

export class ATHForest extends Group {
  levelOfDetail = true;
  pixels = 1;
  measure = "p99"; // of the errors of levels that `pixels` is about; before the first bake()
  counts = [];     // instances drawn, by level
  vertices = 0;    // drawn, all instances
  culled = 0;

  #ath;
  #bins = new Map();    // of every clip, the finest first: {level, tolerance, drawn, place, turn, size, uniforms, filled,
                        // rows, perRow}
  #shown = [];          // those that the motion's clip was drawn with last
  #baking = new Set();
  #baked = new Map();   // of every clip: levels
  #motions = new Map(); // of clips that only instances play: what has them fetched
  #places = new Float32Array(0);
  #turns = new Float32Array(0); // cosine, sine, seconds ahead, clip
  #material;
  #geometry;

  /** geometry: what is drawn (default: the file's faces, else lines). material(isLines, level): makes the material of a
   * level (default: like ath.object's). */
  constructor(ath, { geometry = ath.geometry ?? ath.lines, material = plainMaterial } = {}) {
    super();
    this.#ath = ath;
    this.#geometry = geometry;
    this.#material = material;
    this.name = "ath forest";
  }

  get count() {
    return this.#places.length / 4;
  }

  /** Levels of the motion's clip that can be drawn. */
  get baked() {
    return this.#baked.get(this.#ath.motion.clip.index) ?? [];
  }

  /** instances: {x, y, z, size, angle, seconds, clip} in the units and axes of the file. */
  setInstances(instances) {
    const { motion } = this.#ath;
    for (const { clip } of instances) if (clip !== undefined && !this.#motions.has(clip))
      this.#motions.set(clip, motion.clone().play(clip).setLevel(motion.levelCount - 1));
    const numberOf = (clip) => this.#motions.get(clip)?.clip.index ?? MOTIONS;
    this.#places = Float32Array.from(instances.flatMap(({ x, y, z, size }) => [x, y, z, size]));
    this.#turns = Float32Array.from(instances.flatMap(({ angle, seconds, clip }) =>
      [Math.cos(angle), Math.sin(angle), seconds, numberOf(clip)]));
    for (const bin of this.#allBins()) this.#makeRoom(bin);
  }

  #allBins() {
    return [...this.#bins.values()].flat();
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
    if (!baked.data || !this.#ath) {
      this.#baking.delete(key);
      return;
    }
    const uniforms = motionUniforms(), { nodeCount, exactCount } = known.parts;
    uniforms.athData.value = dataTexture(baked.data);
    uniforms.athForest.value.set(baked.texels, metadata.up_axis === "z" ? 1 : 0);
    uniforms.athStride.value = exactCount > 0 ? (known.texels - 3 * nodeCount) / exactCount : 1;
    await this.#draw(level, clip, known, { uniforms, rows: baked.rows, perRow: roundOf(clip) / baked.rows || 1 });
    this.#baked.set(clip.index, [...this.#baked.get(clip.index) ?? [], level]);
    this.dispatchEvent({ type: "level", level });
  }

  // Geometries of a level: the finest for where its error is a pixel, coarser ones up to where the level before takes over.
  async #draw(level, clip, known, played) {
    const { channel, motion, rest, sphere } = this.#ath, deepest = level === motion.levelCount - 1;
    const error = (of) => clip.errors[of][this.measure];
    const least = error(level), most = level > 0 ? error(level - 1) : sphere.radius / 4;
    const node = channel.nodeNumbers(known), texel = channel.partOfVertices(known);
    node.forEach((_, vertex) => { if (texel[vertex] < 0) node[vertex] = -1; }); // exact runs: one space
    const material = injectMotion(this.#material(!this.#geometry.hasAttribute("normal"), level), played.uniforms, true);
    const place = (geometry, tolerance) => this.#addBin(clip, geometry, texel, material, { ...played, level, tolerance });
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

  #addBin(clip, base, texel, material, played) {
    const geometry = new InstancedBufferGeometry(), { source } = base.userData, lines = !base.hasAttribute("normal");
    geometry.setIndex(base.index);
    for (const [name, attribute] of Object.entries(base.attributes))
      if (name !== "athPart") geometry.setAttribute(name, attribute);
    geometry.setAttribute("athPart", new BufferAttribute(gather(new Float32Array(source.length), texel, source, 1), 1));
    const drawn = lines ? new LineSegments(geometry, material) : new Mesh(geometry, material);
    Object.assign(drawn.userData, { level: played.level, clip: clip.index });
    drawn.frustumCulled = false; // instances are, one by one
    const bin = { ...played, drawn, size: source.length, filled: 0 };
    this.#makeRoom(bin);
    this.add(drawn);
    this.#bins.set(clip.index, [...this.#bins.get(clip.index) ?? [], bin].sort((a, b) => a.tolerance - b.tolerance));
  }

  // A geometry keeps the number of instances that it was first drawn with: another number takes another one.
  #makeRoom(bin) {
    const old = bin.drawn.geometry, geometry = new InstancedBufferGeometry();
    geometry.setIndex(old.index);
    for (const [name, attribute] of Object.entries(old.attributes)) geometry.setAttribute(name, attribute);
    for (const [key, name] of [["place", "athPlace"], ["turn", "athTurn"]]) {
      bin[key] = new InstancedBufferAttribute(new Float32Array(Math.max(4, this.#places.length)), 4);
      geometry.setAttribute(name, bin[key].setUsage(DynamicDrawUsage));
    }
    geometry.instanceCount = 0;
    bin.drawn.geometry = geometry;
    old.dispose();
  }

  /** Chooses what to draw: once per frame. height: of the screen, in pixels. */
  update(camera, height, seconds) {
    const bins = this.#allBins(), sphere = new Sphere(), view = new Frustum(), place = sphere.center, reach = this.#reach();
    this.updateWorldMatrix(true, false);
    const eye = new Vector3().setFromMatrixPosition(camera.matrixWorld).applyMatrix4(new Matrix4().copy(this.matrixWorld).invert());
    view.setFromProjectionMatrix(new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
      .multiply(this.matrixWorld));
    const pixel = 2 * Math.tan(camera.fov * Math.PI / 360) / height; // at distance 1
    this.culled = 0;
    for (const bin of bins) bin.filled = 0;
    this.#shown = this.#bins.get(this.#ath.motion.clip.index) ?? this.#shown;
    for (let i = 0; i < this.#places.length && bins.length > 0; i += 4) {
      const size = this.#places[i + 3];
      place.fromArray(this.#places, i);
      sphere.radius = reach * size;
      if (!view.intersectsSphere(sphere)) {
        this.culled++;
        continue;
      }
      const distance = Math.max(eye.distanceTo(place) - 0.5 * reach * size, 1e-6);
      const own = this.#bins.get(this.#turns[i + 3]) ?? this.#shown, tolerance = this.pixels * pixel * distance / size;
      if (own.length > 0) this.#put(i, own[this.levelOfDetail ? this.#choose(own, tolerance) : 0], seconds);
    }
    this.counts = new Array(this.#ath.motion.levelCount).fill(0);
    this.vertices = 0;
    for (const bin of bins) this.#show(bin);
  }

  // An instance, whose numbers begin at `i`, into the next place of a bin.
  #put(i, bin, seconds) {
    const { place, turn, rows, perRow } = bin, at = 4 * bin.filled++;
    const row = Math.fround(((seconds + this.#turns[i + 2]) / perRow) % rows), shown = row < 0 ? row + rows : row;
    for (let k = 0; k < 4; k++) place.array[at + k] = this.#places[i + k];
    turn.array[at] = this.#turns[i];
    turn.array[at + 1] = this.#turns[i + 1];
    turn.array[at + 2] = shown < rows ? shown : 0; // a fraction may have been rounded up
    turn.array[at + 3] = (Math.floor(turn.array[at + 2]) + 1) % rows;
  }

  // How far from its place an instance of size 1 can be seen: the rest pose's sphere, whatever the turn, and room to move.
  #reach() {
    const { center, radius } = this.#ath.sphere;
    return center.length() + 1.2 * radius;
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
    for (const attribute of [bin.place, bin.turn]) {
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
      drawn.material.dispose();
    }
    this.#bins.clear();
    this.#ath = null;
  }
}
