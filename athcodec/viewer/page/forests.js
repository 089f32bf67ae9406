// Forests: many instances of the plant that is open.

import { Color, DoubleSide, LineBasicMaterial, MeshLambertMaterial } from "three";
import { ATHForest } from "athcodec-three";

import { app, loader, main, state } from "./app.js";
import { nodeColour } from "./colours.js";
import { feet, forestReach, treePlaces } from "./places.js";
import { Floor, ground, shadowed } from "./grove.js";
import { outlined, surfaceMaterial } from "./surfaces.js";
import { $, countText, note } from "./ui.js";

let floor = null;

const chosenCount = () => state.forestCount ?? Math.round(10 ** ($("forest-count").value / 25));

const forestRadius = () => forestReach(app.plants[0].ath, chosenCount(), Number($("forest-spread").value));

function instances(count) {
  const { ath } = app.plants[0], { clips } = ath.motion, clipOf = (i) => ($("forest-mix").checked ? i % clips.length : undefined);
  return treePlaces(ath, count, forestRadius()).map((place, i) => ({ ...place, clip: clipOf(i) }));
}

const surfaces = () => (app.colour.value === "plant" ? app.plants[0].surfaces : null);

function forestMaterial(lines, of) {
  if (surfaces() && !lines) return surfaceMaterial(surfaces());
  const material = lines ? new LineBasicMaterial() : new MeshLambertMaterial({ side: DoubleSide });
  tintForest(material, lines, of);
  return app.plants[0].surfaces && !lines ? outlined(material, app.plants[0].surfaces) : material;
}

// Bark, leaves or the file's own colours; by level where nodes are told apart.
function tintForest(material, lines, of) {
  const plain = app.colour.value === "plant", stored = lines || app.plants[0].ath.geometry.hasAttribute("color");
  if (material.vertexColors !== (plain && stored)) material.needsUpdate = true;
  material.vertexColors = plain && stored;
  material.color = plain ? new Color(stored ? 0xffffff : 0x6f8f4a) : new Color().setRGB(...nodeColour(of + 1));
}

function colourForest() {
  if (state.forest && app.plants[0].surfaces) forestOn(); // in other materials
  else state.forest?.children.forEach((drawn) => tintForest(drawn.material, drawn.isLineSegments, drawn.userData.level));
}

function forestOn() {
  const [plant] = app.plants;
  state.forest?.removeFromParent();
  state.forest?.dispose();
  const forest = shadowed(new ATHForest(plant.ath, { geometry: plant.forestGeometry(), material: forestMaterial, depthMaterial: plant.depthMaterial }));
  state.forest = forest;
  forest.levelOfDetail = $("forest-lod").checked;
  forest.addEventListener("level", () => { state.dirty = true; });
  plant.root.add(forest);
  app.setLoop(state.loop);
  plantForest();
  for (const child of plant.root.children) if (child !== forest) child.visible = false;
  plant.motion.setLevel(plant.motion.levelCount - 1); // near instances show all of it
}

function plantForest() {
  const trees = instances(chosenCount()), { ath } = app.plants[0], mixed = $("forest-mix").checked;
  state.forest.setInstances(trees);
  app.place();
  growFloor(feet(trees, ath), forestRadius() / Math.sqrt(chosenCount()), ath.motion.clip.name, mixed);
  state.dirty = true;
}

function forestOff() {
  state.forest.removeFromParent();
  state.forest.dispose();
  state.forest = null;
  floor?.clear();
  $("forest").checked = false;
  $("forest-rows").hidden = true;
  app.plants[0].setShow(app.show.value);
  app.setLevel(app.level.value);
  app.setLoop(state.loop);
  app.place();
}

function forestSwitch(on) {
  if (on === Boolean(state.forest)) return;
  if (on && app.opened[0]?.model) {
    $("forest").checked = false;
    note("A forest takes an .ath file");
    return;
  }
  $("forest").checked = on;
  $("forest-rows").hidden = !on;
  if (on && app.plants.length > 1) {
    app.compare.set("off");
    for (const each of app.opened.splice(1)) each.dispose();
    app.arrange();
  }
  if (on) forestOn();
  else forestOff();
  app.windControl();
  app.frameView();
}

/** So many instances, whatever the slider allows. */
function forestOf(count, levelOfDetail = true) {
  state.forestCount = count;
  $("forest-lod").checked = levelOfDetail;
  if (!state.forest) forestSwitch(true);
  if (!state.forest) return; // a GLB
  state.forest.levelOfDetail = levelOfDetail;
  plantForest();
  app.frameView();
  forestNumbers();
}

function forestNumbers() {
  const count = countText(chosenCount()), spread = Number($("forest-spread").value).toFixed(1);
  $("forest-count-value").value = count;
  $("forest-count").setAttribute("aria-valuetext", `${count} plants`);
  $("forest-spread-value").value = `${spread}×`;
  $("forest-spread").setAttribute("aria-valuetext", `${spread} times as far apart`);
}

function forestBars() {
  const { counts, culled } = state.forest, most = Math.max(1, ...counts, culled);
  const { motion } = main(), all = [...counts.map((count, of) => [of < motion.levelCount - 1 ? `Detail ${of}` : "Full", count]), ["Unseen", culled]];
  if ($("forest-bars").children.length !== all.length)
    $("forest-bars").replaceChildren(...all.map(() => {
      const row = document.createElement("div");
      row.append(...["span", "i", "b"].map((name) => document.createElement(name)));
      return row;
    }));
  all.forEach(([name, count], i) => {
    const [label, bar, number] = $("forest-bars").children[i].children;
    label.textContent = name;
    bar.style.width = `${(100 * count) / most}%`;
    number.textContent = countText(count);
  });
}

/** Plants the floor between trees at [x, z]. */
function growFloor(trees, reach, clip, mixed) {
  if (app.floor.length === 0) return;
  floor ??= new Floor(app.floor, loader, () => { state.dirty = true; });
  floor.grow(trees, reach, clip, mixed, (plant, forest) => {
    if (!state.forest) return;
    const { scene } = app.stage.panes[0];
    forest.levelOfDetail = state.forest.levelOfDetail;
    ground(plant, scene.getObjectByName("ground").position.y);
    scene.add(plant.root);
  });
}

/** All forests that are shown, that of the trees first. */
const forests = () => (state.forest ? [state.forest, ...floor?.forests ?? []] : []);

/** Gets what has come of them ready to be drawn: once per frame. */
function bakeForests() {
  state.forest.bakeReady();
  floor?.bakeReady();
}

/** Before each picture. */
function updateForests(seconds) {
  for (const forest of forests()) forest.update(app.stage.camera, app.stage.pixels, seconds);
}

export default function begin() {
  Object.assign(app, { forests, bakeForests, updateForests, forestRadius, colourForest, forestOn, plantForest, forestOff, forestSwitch, forestOf, forestBars });
  $("forest").addEventListener("change", () => forestSwitch($("forest").checked));
  for (const id of ["forest-count", "forest-spread"]) $(id).addEventListener("input", () => { delete state.forestCount; forestNumbers(); plantForest(); });
  $("forest-count").addEventListener("change", app.frameView);
  $("forest-mix").addEventListener("change", plantForest);
  $("forest-lod").addEventListener("change", () => { for (const forest of forests()) forest.levelOfDetail = $("forest-lod").checked; state.dirty = true; });
  forestNumbers();
}
