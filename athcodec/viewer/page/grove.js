// A forest in a scene of its own, as <ath-viewer> has them: trees, and plants of other files between them.

import { DoubleSide, MeshLambertMaterial } from "three";
import { ATHForest } from "athcodec-three";

import { feet, floorPlaces, forestReach, rooted, treePlaces } from "./places.js";
import { Plant } from "./plant.js";
import { surfaceMaterial } from "./surfaces.js";

const GREEN = 0x6f8f4a;

/** A forest whose plants cast shadows on the ground and each other. */
export const shadowed = (forest) => Object.assign(forest, { castShadow: true, receiveShadow: true });

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
export function ground({ ath, root }, height) {
  root.updateMatrixWorld(true);
  root.position.y += height - ath.box.clone().applyMatrix4(root.matrixWorld).min.y;
  root.updateMatrixWorld(true);
}

export class Grove {
  #parts; // {plant, forest}

  /** changed(): what calls for a new picture. */
  constructor(plant, count, changed) {
    const { ath } = plant, forest = forestOfPlant(plant, changed);
    this.changed = changed;
    this.reach = forestReach(ath, count);
    this.trees = treePlaces(ath, count, this.reach);
    forest.setInstances(this.trees);
    this.#parts = [{ plant, forest }];
  }

  get forests() {
    return this.#parts.map(({ forest }) => forest);
  }

  /** files: {source, each}; each plant is given to `add` once it is there. */
  async grow(files, loader, add) {
    const [{ plant: { ath: tree } }] = this.#parts, near = this.reach / Math.sqrt(this.trees.length);
    for (const [kind, { source, each }] of files.entries()) {
      const ath = await loader.loadAsync(source);
      await ath.arrays.catch(() => {});
      if (this.#parts.length === 0 || !ath.hasFaces) { // taken away in the meantime
        ath.dispose();
        continue;
      }
      const plant = new Plant(ath), forest = forestOfPlant(plant, this.changed), { name } = tree.motion.clip;
      if (ath.motion.clips.some((clip) => clip.name === name)) ath.motion.play(name);
      forest.setInstances(rooted(floorPlaces(feet(this.trees, tree), each, near, kind), ath));
      this.#parts.push({ plant, forest });
      add(plant);
    }
  }

  update(camera, pixels, seconds) {
    for (const { plant: { ath: { motion } }, forest } of this.#parts) {
      motion.setTime(motion.start);
      forest.bakeReady();
      forest.update(camera, pixels, seconds);
    }
  }

  /** All but the trees' own file. */
  dispose() {
    this.#parts.forEach(({ plant, forest }, i) => {
      forest.dispose();
      if (i === 0) return;
      plant.dispose();
      plant.root.removeFromParent();
      plant.ath.dispose();
    });
    this.#parts = [];
  }
}
