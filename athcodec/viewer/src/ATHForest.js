// Many instances of one plant, each with a place, size, turn and time of its own, drawn at the depth that its distance
// asks for: a few draw calls per frame. The motion of a depth lies in one texture for all instances of it.

import { DynamicDrawUsage, Frustum, Group, InstancedBufferAttribute, InstancedBufferGeometry, LineBasicMaterial, LineSegments,
  Matrix4, Mesh, MeshStandardMaterial, Sphere, Vector3, BufferAttribute, DoubleSide } from "three";

import { dataTexture } from "./ATHMotion.js";
import { clustered, gather } from "./geometry.js";
import { injectMotion, motionUniforms } from "./shader.js";

const MOST_TEXELS = 4 << 20; // of one depth: 64 MiB; longer clips are played at fewer frames a second
const TALLEST = 4096;        // rows of a texture that every device has
const CELL = 1.5;            // side of the cells of simplified geometry, in pixels' worth of error

const plainMaterial = (lines) => (lines ? new LineBasicMaterial({ color: 0x6b5b45 })
  : new MeshStandardMaterial({ color: 0x8a9a6b, roughness: 0.8, side: DoubleSide }));

export class ATHForest extends Group {
  levelOfDetail = true;
  pixels = 1;
  counts = [];     // instances drawn, by depth
  vertices = 0;    // drawn, all instances
  culled = 0;

  #ath;
  #depths = [];    // per depth: {uniforms, mesh, place, turn} once it is baked
  #baking = new Set();
  #places = new Float32Array(0);
  #turns = new Float32Array(0);
  #material;
  #geometry;

  /** geometry: what is drawn (default: the file's faces, else lines). material(isLines, depth): makes the material of a
   * depth (default: like ath.object's). */
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

  /** instances: {x, y, z, size, angle, seconds} in the units and axes of the file. */
  setInstances(instances) {
    const upIsZ = this.#ath.metadata.up_axis === "z" ? 1 : 0;
    this.#places = Float32Array.from(instances.flatMap(({ x, y, z, size }) => [x, y, z, size]));
    this.#turns = Float32Array.from(instances.flatMap(({ angle, seconds }) => [Math.cos(angle), Math.sin(angle), seconds, upIsZ]));
    for (const depth of this.#depths) if (depth) this.#makeRoom(depth);
  }

  /** Gets a depth ready to be drawn; all bytes of it have to be here. */
  async bake(level) {
    if (this.#baking.has(level)) return;
    this.#baking.add(level);
    const { motion, channel } = this.#ath, known = await channel.parts(level), { frameCount } = motion.info;
    const step = Math.max(1, Math.ceil(frameCount * known.texels / Math.min(MOST_TEXELS, 1024 * TALLEST)));
    const baked = await channel.bake(level, step);
    if (!baked.data) {
      this.#baking.delete(level);
      return;
    }
    const uniforms = motionUniforms(), { nodeCount, exactCount } = known.parts;
    uniforms.athData.value = dataTexture(baked.data);
    uniforms.athClip.value.set(baked.texels, baked.rows, motion.duration / baked.rows, 0);
    uniforms.athStride.value = exactCount > 0 ? (known.texels - 3 * nodeCount) / exactCount : 1;
    const depth = { level, uniforms, ...this.#draw(level, known, uniforms) };
    this.#makeRoom(depth);
    this.add(depth.drawn);
    this.#depths[level] = depth;
    this.dispatchEvent({ type: "depth", level });
  }

  #draw(level, known, uniforms) {
    const { channel, motion } = this.#ath, whole = this.#geometry, lines = !whole.hasAttribute("normal");
    const deepest = level === motion.depthCount - 1;
    const parts = channel.nodeNumbers(known), texel = channel.partOfVertices(known);
    parts.forEach((part, vertex) => { if (texel[vertex] < 0) parts[vertex] = -1; }); // exact runs: one space
    const less = deepest ? whole : clustered(whole, this.#ath.rest, CELL * motion.error(level).max, parts);
    const geometry = new InstancedBufferGeometry();
    geometry.setIndex(less.index);
    for (const [name, attribute] of Object.entries(less.attributes))
      if (name !== "athPart") geometry.setAttribute(name, attribute);
    geometry.setAttribute("athPart", new BufferAttribute(
      gather(new Float32Array(less.userData.source.length), texel, less.userData.source, 1), 1));
    geometry.instanceCount = 0;
    const material = injectMotion(this.#material(lines, level), uniforms, true);
    const drawn = lines ? new LineSegments(geometry, material) : new Mesh(geometry, material);
    drawn.userData.depth = level;
    drawn.frustumCulled = false; // instances are, one by one
    return { drawn, geometry, size: less.userData.source.length };
  }

  #makeRoom(depth) {
    const { geometry } = depth;
    for (const [key, name] of [["place", "athPlace"], ["turn", "athTurn"]]) {
      geometry.deleteAttribute(name);
      depth[key] = new InstancedBufferAttribute(new Float32Array(Math.max(4, this.#places.length)), 4).setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, depth[key]);
    }
  }

  /** Chooses what to draw: once per frame. height: of the screen, in pixels. */
  update(camera, height, seconds) {
    const filled = this.#depths.map(() => 0), sphere = new Sphere(), view = new Frustum();
    const place = new Vector3(), eye = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    this.updateWorldMatrix(true, false);
    const inverse = new Matrix4().copy(this.matrixWorld).invert();
    eye.applyMatrix4(inverse);
    view.setFromProjectionMatrix(new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
      .multiply(this.matrixWorld));
    const there = this.#depths.flatMap((depth, level) => (depth ? [level] : []));
    this.culled = 0;
    const half = 2 * Math.tan(camera.fov * Math.PI / 360) / height;
    const reach = this.#reach();
    for (let i = 0; i < this.#places.length && there.length > 0; i += 4) {
      const size = this.#places[i + 3];
      place.fromArray(this.#places, i);
      sphere.center.copy(place);
      sphere.radius = reach * size;
      if (!view.intersectsSphere(sphere)) {
        this.culled++;
        continue;
      }
      const distance = Math.max(eye.distanceTo(place) - 0.5 * reach * size, 1e-6);
      const depth = this.#depths[this.#choose(there, size / (half * distance))];
      depth.place.array.set(this.#places.subarray(i, i + 4), 4 * filled[depth.level]);
      depth.turn.array.set(this.#turns.subarray(i, i + 4), 4 * filled[depth.level]++);
    }
    this.counts = Array.from({ length: this.#ath.motion.depthCount }, (_, level) => filled[level] ?? 0);
    this.vertices = 0;
    for (const depth of this.#depths) if (depth) this.#show(depth, filled[depth.level], seconds);
  }

  // How far from its place an instance of size 1 can be seen: the rest pose's sphere, whatever the turn, and room to move.
  #reach() {
    const { center, radius } = this.#ath.sphere;
    return center.length() + 1.2 * radius;
  }

  #choose(there, perUnit) {
    if (!this.levelOfDetail) return there.at(-1);
    return there.find((level) => this.#ath.motion.error(level).max * perUnit <= this.pixels) ?? there.at(-1);
  }

  #show(depth, count, seconds) {
    depth.geometry.instanceCount = count;
    depth.drawn.visible = count > 0;
    depth.uniforms.athClip.value.w = seconds;
    this.vertices += count * depth.size;
    for (const attribute of [depth.place, depth.turn]) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, 4 * count);
      attribute.needsUpdate = count > 0;
    }
  }

  dispose() {
    for (const depth of this.#depths) {
      if (!depth) continue;
      depth.uniforms.athData.value.dispose();
      depth.geometry.dispose();
      depth.drawn.material.dispose();
    }
    this.#depths = [];
  }
}
