// ATH_motion for the glTF loader of Babylon.js: import it, or call registerATHMotion(). Vertices are decoded where they
// are asked for, by an AnimationGroup of each clip's name, or by setSeconds().

import { Animation } from "@babylonjs/core/Animations/animation.js";
import { AnimationGroup } from "@babylonjs/core/Animations/animationGroup.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData.js";
import { registerGLTFExtension, unregisterGLTFExtension } from "@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js";

import { AthFile, ready } from "../ath_decoder.mjs";
import { EXTENSION, VERTEX, keysOf, motionsOf, primitivesOf, restOf, referenceOf, startOf, verticesOf, withoutFallback } from "./parts.js";

const RATE = 60; // frames per second of the animations' keys, between which seconds run on

/** Lets all glTF files that are loaded from now on play their motions. */
export function registerATHMotion() {
  unregisterGLTFExtension(EXTENSION);
  registerGLTFExtension(EXTENSION, true, (loader) => new ATHMotionExtension(loader));
}

/** A motion, and the meshes that it moves; in metadata.ATH_motion of each of them. */
export class ATHBabylonMotion {
  /** The level to show; the deepest by default. */
  level;
  #file;
  #meshes = [];    // {mesh, vertices}
  #segments = new Map(); // the level and segment, of the last two
  #shown = "";

  constructor(file) {
    this.#file = file;
    this.level = file.info.levelCount - 1;
  }

  get clips() {
    return this.#file.clips;
  }

  get levelCount() {
    return this.#file.info.levelCount;
  }

  /** The coarsest level whose error is at most `pixels` of a camera that is `distance` away: see AthFile.levelFor. */
  levelFor(distance, fov, height, pixels = 1) {
    return this.#file.levelFor(distance, fov, height, pixels);
  }

  attach(mesh, vertices) {
    mesh.metadata = { ...mesh.metadata, [EXTENSION]: this };
    for (const kind of [VertexBuffer.PositionKind, VertexBuffer.NormalKind])
      if (mesh.isVerticesDataPresent(kind)) mesh.setVerticesData(kind, Float32Array.from(mesh.getVerticesData(kind)), true);
    this.#meshes.push({ mesh, vertices });
  }

  /** Shows a clip, by its number or name, so many seconds after its first frame. */
  setSeconds(seconds, clip = 0) {
    const number = this.clips.findIndex(({ name }, index) => clip === index || clip === name);
    if (number < 0) throw new RangeError(`clip: got ${clip}, expected one of ${this.clips.map(({ name }) => name).join(", ")}`);
    const shown = `${seconds} ${number} ${this.level}`;
    if (shown === this.#shown) return this;
    this.#shown = shown;
    const positions = this.#positions(this.#file.frameAt(seconds, "marked", number), this.clips[number]);
    for (const each of this.#meshes) if (!each.mesh.isDisposed()) write(each, positions);
    return this;
  }

  // Between the last and the first frame of a loop two segments are needed that are not neighbours.
  #positions(frame, { firstFrame, frameCount }) {
    const next = Math.ceil(frame) < firstFrame + frameCount ? Math.ceil(frame) : firstFrame;
    const wanted = new Set([Math.floor(frame), next].map((each) => this.#file.segmentOf(each)));
    const keys = new Map([...wanted].map((segment) => [`${this.level} ${segment}`, segment]));
    for (const [key, segment] of this.#segments)
      if (!keys.has(key)) {
        segment.free();
        this.#segments.delete(key);
      }
    for (const [key, segment] of keys)
      if (!this.#segments.has(key)) this.#segments.set(key, this.#file.prepare(segment, this.level));
    return this.#file.positions([...this.#segments.values()], frame);
  }
}

function write({ mesh, vertices }, positions) {
  const moved = new Float32Array(3 * vertices.length), low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < vertices.length; i++)
    for (let k = 0; k < 3; k++) {
      const value = moved[3 * i + k] = positions[3 * vertices[i] + k];
      if (value < low[k]) low[k] = value;
      if (value > high[k]) high[k] = value;
    }
  mesh.updateVerticesData(VertexBuffer.PositionKind, moved);
  if (mesh.isVerticesDataPresent(VertexBuffer.NormalKind)) {
    const normals = new Float32Array(moved.length);
    VertexData.ComputeNormals(moved, mesh.getIndices(), normals, { useRightHandedSystem: true });
    mesh.updateVerticesData(VertexBuffer.NormalKind, normals);
  }
  mesh.buildBoundingInfo(new Vector3(...low), new Vector3(...high), mesh.getWorldMatrix());
}

class ATHMotionExtension {
  name = EXTENSION;
  order = 100;
  #plants = []; // For each motion {player, vertices: Map}, null where it does not play.
  #attached = new Set();

  constructor(loader) {
    this.loader = loader;
    this.enabled = loader.isExtensionUsed(EXTENSION);
  }

  dispose() {
    this.loader = null;
  }

  loadSceneAsync(context, scene) {
    return this.#load(context, scene);
  }

  // Motions are opened first: one that cannot be leaves its meshes as they are without the extension.
  async #load(context, scene) {
    const { gltf } = this.loader, motions = motionsOf(gltf);
    await ready;
    this.#plants = await Promise.all(motions.map((motion, number) => this.#open(motion, number).catch((error) => {
      console.warn(`${EXTENSION}: motion ${number} does not play: ${error.message}`);
      return null;
    })));
    withoutFallback(gltf, new Set(this.#plants.flatMap((plant, number) => (plant ? [number] : []))));
    await this.#rest(context, scene);
    for (const [number, plant] of this.#plants.entries())
      for (const clip of plant?.player.clips ?? []) this.#animate(plant.player, clip, startOf(motions[number], clip.name));
  }

  // The loader asks its extensions once more, of which this one has done its part.
  async #rest(context, scene) {
    const load = this.loadSceneAsync;
    this.loadSceneAsync = () => null;
    try {
      return await this.loader.loadSceneAsync(context, scene);
    } finally {
      this.loadSceneAsync = load;
    }
  }

  async #open(motion, number) {
    const { gltf } = this.loader, view = gltf.bufferViews?.[motion.bufferView];
    if (!view) throw new RangeError(`bufferView: got ${motion.bufferView}, expected one of the file`);
    const parts = await Promise.all(primitivesOf(gltf, number).map((each) => this.#part(each)));
    const rest = restOf(parts), data = await this.loader.loadBufferViewAsync(`/bufferViews/${view.index}`, view);
    const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength), file = AthFile.open(bytes, { hostMesh: rest });
    file.feed(bytes, 0);
    if (file.info.vertexCount !== rest.length / 3)
      throw new RangeError(`vertices: got ${rest.length / 3} in primitives, expected ${file.info.vertexCount}`);
    const player = new ATHBabylonMotion(file);
    player.level = Math.max(file.readyLevel(0), 0);
    return { player, vertices: new Map(parts.map(({ key, vertices }) => [key, vertices])) };
  }

  async #part({ mesh, primitive, attributes, reference }) {
    const [positions, numbers] = await Promise.all([attributes.POSITION, attributes[VERTEX]].map((index) => this.#numbers(index)));
    return { key: `${mesh} ${primitive}`, positions,
      vertices: verticesOf(positions.length / 3, reference, numbers && ((i) => numbers[i])) };
  }

  // As numbers that lie one after the other; null where there is no such attribute.
  #numbers(index) {
    const accessor = this.loader.gltf.accessors?.[index];
    if (index === undefined) return null;
    if (!accessor) throw new RangeError(`accessor: got ${index}, expected one of the file`);
    return this.loader._loadFloatAccessorAsync(`/accessors/${accessor.index}`, accessor);
  }

  _loadMeshPrimitiveAsync(context, name, node, mesh, primitive, assign) {
    const plant = this.#plants[referenceOf(primitive)?.motion], key = `${mesh.index} ${primitive.index}`;
    if (!plant) return null;
    return this.loader._loadMeshPrimitiveAsync(context, name, node, mesh, primitive, assign).then((made) => {
      const source = made.sourceMesh ?? made; // instances follow it
      if (!this.#attached.has(source)) plant.player.attach(source, plant.vertices.get(key));
      this.#attached.add(source);
      return made;
    });
  }

  // Into the group of its name, or into one of its own, which the loader counts among those of the file.
  #animate(player, clip, start) {
    const { gltf, babylonScene } = this.loader, animations = gltf.animations ??= [];
    const target = { metadata: null, get seconds() { return 0; }, set seconds(value) { player.setSeconds(value, clip.name || 0); } };
    const keys = keysOf(start, clip).map(([at, value]) => ({ frame: RATE * at, value }));
    const track = new Animation(`${EXTENSION} ${clip.name}`, "seconds", RATE, Animation.ANIMATIONTYPE_FLOAT, Animation.ANIMATIONLOOPMODE_CYCLE);
    track.setKeys(keys.length > 1 ? keys : [keys[0], { ...keys[0], frame: keys[0].frame + 1 }]);
    const there = animations.find((each) => each.name === clip.name && each._babylonAnimationGroup?.targetedAnimations.length > 0);
    const group = there?._babylonAnimationGroup ?? new AnimationGroup(clip.name || EXTENSION, babylonScene);
    if (!there) animations.push({ index: animations.length, name: clip.name, channels: [], samplers: [], _babylonAnimationGroup: group });
    group.addTargetedAnimation(track, target);
  }
}

registerATHMotion();
