// A forest in a scene of its own, as <ath-viewer> has them: trees, and plants of other files between them.

import { DoubleSide, MeshLambertMaterial } from "three";
import { ATHForest } from "athcodec-three";

import { feet, floorPlaces, forestReach, rooted, treePlaces } from "./places.js";
import { Plant } from "./plant.js";
import { surfaceMaterial } from "./surfaces.js";

const GREEN = 0x6f8f4a;

/** A forest within a plant's root, which stands upright for it, whose plants cast shadows on the ground and each other. */
export function shadowed(forest) {
  forest.rotation.set(0, 0, 0);
  return Object.assign(forest, { castShadow: true, receiveShadow: true });
}

/** A forest of a plant, with its surfaces, in place of the plant itself. */
export function forestOfPlant(plant, changed) {
  const { ath, root, surfaces } = plant;
  const material = surfaces ? () => surfaceMaterial(surfaces) : ath.hasFaces ? () => new MeshLambertMaterial({ color: GREEN, side: DoubleSide }) : undefined;
  const forest = shadowed(new ATHForest(ath, { geometry: plant.forestGeometry(), material, depthMaterial: plant.depthMaterial }));
  for (const child of root.children) child.visible = false;
  root.add(forest);
  ath.motion.wrap = "loop";
  ath.motion.setLevel(ath.motion.levelCount - 1);
  forest.addEventListener("level", changed);
  return forest;
}

/** Stands a plant's root on the ground. */
export function ground(plant, height) {
  const { root } = plant;
  root.position.y += height - plant.box.min.y;
  root.updateMatrixWorld(true);
}

/** Plants of other files between the trees of a forest, which come when it is first shown. */
export class Floor {
  #parts = []; // {plant, forest, each}
  #coming = null;

  /** files: {source, each}, a URL or bytes and how many to a tree; changed(): what calls for a new picture. */
  constructor(files, loader, changed) {
    Object.assign(this, { files, loader, changed });
  }

  async #load() {
    for (const { source, each } of this.files) {
      const ath = await (typeof source === "string" ? this.loader.loadAsync(source) : this.loader.parseAsync(source)).catch(() => null);
      await ath?.arrays.catch(() => {});
      if (!this.files.length || !ath?.hasFaces) { // taken away in the meantime; a forest is one without it too
        ath?.dispose();
        continue;
      }
      const plant = new Plant(ath);
      this.#parts.push({ plant, forest: forestOfPlant(plant, this.changed), each });
    }
  }

  /** Plants them between trees at [x, z], in the world, in the clip of that name where they have it, or each in another; each
   * kind is given to `add`. */
  async grow(trees, reach, clip, mixed, add) {
    await (this.#coming ??= this.#load());
    this.#parts.forEach(({ plant, forest, each }, kind) => {
      const { ath } = plant, { motion } = ath, clipOf = (i) => (mixed ? i % motion.clips.length : undefined);
      if (motion.clips.some(({ name }) => name === clip) && motion.clip.name !== clip) motion.play(clip);
      forest.setInstances(rooted(floorPlaces(trees, each, reach, kind), ath).map((place, i) => ({ ...place, clip: clipOf(i) })));
      add(plant, forest);
    });
    this.changed();
  }

  /** Those that are shown. */
  get forests() {
    return this.#parts.filter(({ plant }) => plant.root.parent).map(({ forest }) => forest);
  }

  /** Gets what has come of them ready to be drawn: once per frame. */
  bakeReady() {
    for (const { plant: { ath: { motion } }, forest } of this.#parts) {
      motion.setTime(motion.start);
      forest.bakeReady();
    }
  }

  clear() {
    for (const { plant } of this.#parts) plant.root.removeFromParent();
  }

  dispose() {
    this.clear();
    this.files = [];
    for (const { plant, forest } of this.#parts.splice(0)) for (const each of [forest, plant, plant.ath]) each.dispose();
  }
}

export class Grove {
  #plant;
  #forest;
  #floor;

  /** files, loader and changed: as of Floor. */
  constructor(plant, count, files, loader, changed) {
    const { ath } = plant;
    this.reach = forestReach(ath, count);
    this.trees = treePlaces(ath, count, this.reach);
    this.#plant = plant;
    this.#forest = forestOfPlant(plant, changed);
    this.#forest.setInstances(this.trees);
    this.#floor = new Floor(files, loader, changed);
  }

  get forests() {
    return [this.#forest, ...this.#floor.forests];
  }

  grow(add) {
    const { ath } = this.#plant;
    return this.#floor.grow(feet(this.trees, ath), this.reach / Math.sqrt(this.trees.length), ath.motion.clip.name, false, add);
  }

  update(camera, pixels, seconds) {
    const { motion } = this.#plant.ath;
    motion.setTime(motion.start);
    this.#forest.bakeReady();
    this.#floor.bakeReady();
    for (const forest of this.forests) forest.update(camera, pixels, seconds);
  }

  /** All but the trees' own file. */
  dispose() {
    this.#forest.dispose();
    this.#floor.dispose();
  }
}
