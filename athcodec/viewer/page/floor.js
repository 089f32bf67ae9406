// The floor of a forest: plants of other files, which come when a forest is first shown.

import { app, loader, state } from "./app.js";
import { forestOfPlant, ground } from "./grove.js";
import { floorPlaces, rooted } from "./places.js";
import { Plant } from "./plant.js";

const growing = []; // {plant, forest, each}
let coming = null;

async function load() {
  for (const { source, each } of app.floor) {
    const ath = await (typeof source === "string" ? loader.loadAsync(source) : loader.parseAsync(source)).catch(() => null);
    await ath?.arrays.catch(() => {});
    if (!ath?.hasFaces) continue; // a forest is one without it too
    const plant = new Plant(ath);
    growing.push({ plant, forest: forestOfPlant(plant, () => { state.dirty = true; }), each });
  }
}

/** Plants them between trees at [x, z], in the world, in the clip of that name where they have it, or each in another. */
export async function growFloor(trees, reach, clip, mixed) {
  if (app.floor.length === 0) return;
  await (coming ??= load());
  if (!state.forest) return;
  const { scene } = app.stage.panes[0], height = scene.getObjectByName("ground").position.y;
  growing.forEach(({ plant, forest, each }, kind) => {
    const { ath, root } = plant, { motion } = ath;
    if (motion.clips.some(({ name }) => name === clip) && motion.clip.name !== clip) motion.play(clip);
    forest.levelOfDetail = state.forest.levelOfDetail;
    const clipOf = (i) => (mixed ? i % motion.clips.length : undefined);
    forest.setInstances(rooted(floorPlaces(trees, each, reach, kind), ath).map((place, i) => ({ ...place, clip: clipOf(i) })));
    ground(plant, height);
    scene.add(root);
  });
  state.dirty = true;
}

export function clearFloor() {
  for (const { plant } of growing) plant.root.removeFromParent();
}

/** All forests that are shown, that of the trees first. */
export function forests() {
  return state.forest ? [state.forest, ...growing.filter(({ plant }) => plant.root.parent).map(({ forest }) => forest)] : [];
}

/** Gets what has come of them ready to be drawn: once per frame. */
export function bakeForests() {
  for (const { plant: { ath: { motion } } } of growing) motion.setTime(motion.start);
  for (const forest of forests()) forest.bakeReady();
}

/** Before each picture. */
export function updateForests(seconds) {
  for (const forest of forests()) forest.update(app.stage.camera, app.stage.pixels, seconds);
}
