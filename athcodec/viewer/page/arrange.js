// Arranges the stage: plants for the files that are open and what is chosen, and the view of them.

import { Box3, Vector3 } from "three";

import { app, counters, main, state } from "./app.js";
import { Plant } from "./plant.js";

/** Plants and panes; under the split the right one is asked about. `first`: that of the first file, if there is one. */
function arrange(first = null) {
  const { stage, opened, plants: before } = app;
  for (const plant of before) {
    plant.dispose();
    if (plant.motion !== plant.ath.motion) plant.motion.dispose();
  }
  const [ath] = opened, plants = [first ?? new Plant(ath)];
  if (app.compare.value === "levels") plants.unshift(new Plant(ath, ath.motion.clone()));
  if (app.compare.value === "file" && opened[1]) plants.push(new Plant(opened[1]));
  app.plants = plants;
  for (const plant of plants) {
    if (plant.show !== app.show.value) plant.setShow(app.show.value);
    if (plant.colour !== app.colour.value) plant.setColour(app.colour.value);
    plant.beside = plants;
    plant.onPaint = () => { state.dirty = true; };
    plant.motion.addEventListener("frame", () => pictured(plant));
    plant.motion.addEventListener("clip", app.fromTheStart);
    plant.motion.addEventListener("ready", () => { state.dirty = true; });
  }
  if (plants.length > 1 && state.forest) app.forestSwitch(false);
  stage.setPanes(plants.map((plant) => ({
    scene: stage.scene([plant.root]), foot: plant.foot, before: (width, height) => plant.prepare(width, height),
  })));
  place();
  app.levelControls();
  app.setLevel(app.level.value ?? "auto");
  app.clipControls();
  app.windControl();
  app.applyWind();
  app.setLoop(state.loop);
  app.describe();
  app.enableControls(true);
  app.splitLabels();
  app.tellLegend();
  if (state.forest) app.forestOn();
}

function pictured(plant) {
  state.dirty = true;
  if (plant === main()) counters.pictures++;
}

/** Takes what is on the stage away, before a file is loaded anew. */
function clear() {
  if (state.forest) app.forestOff();
  for (const plant of app.plants.splice(0)) plant.dispose();
  app.enableControls(false);
  app.stage.setPanes([{ scene: app.stage.scene([]) }]);
  app.stage.render();
}

/** The meadow alone, where no file is open. */
function bare() {
  const { stage } = app;
  if (!stage || app.plants.length > 0) return;
  stage.setPanes([{ scene: stage.scene([]) }]);
  stage.look(new Box3(new Vector3(-1, 0, -1), new Vector3(1, 2, 1)), { height: 0, size: 4 });
}

// The world's box of all rest poses.
function box() {
  const all = new Box3();
  for (const { box } of app.plants) all.union(box);
  return all;
}

function place() {
  const all = box(), size = all.getSize(new Vector3());
  const plant = 1.9 * Math.max(size.x, size.y, size.z);
  app.stage.placeGround(all.min.y, state.forest ? Math.max(plant, 2.6 * app.forestRadius()) : plant, plant);
}

/** The whole plant, or of a forest what is near, in view. */
function frameView() {
  const { stage } = app, all = box(), size = all.getSize(new Vector3()), most = Math.max(size.x, size.y, size.z);
  if (!state.forest) {
    stage.fog(0, 0);
    stage.look(all, { height: all.min.y, size: 1.9 * most });
  } else stage.lookOver(all, app.forestRadius());
  centre();
}

/** Frames the view anew, as long as nobody moved it by hand. */
function reframe() {
  if (app.plants.length > 0 && !app.stage.moved) frameView();
  else centre();
}

// The playback stands below the middle of what is looked at.
function centre() {
  const { room: [left, , right] } = app.stage;
  document.documentElement.style.setProperty("--centre", `${(left + right) / 2}px`);
}

function resetView() {
  app.stage.moved = false;
  frameView();
}

export default function begin() {
  Object.assign(app, { arrange, clear, bare, place, frameView, reframe, resetView });
}
