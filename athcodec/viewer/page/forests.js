// Forests: many instances of the plant that is open.

import { Color, DoubleSide, LineBasicMaterial, MeshLambertMaterial } from "three";
import { ATHForest } from "athcodec-three";

import { app, main, state } from "./app.js";
import { arrange, frameView, place } from "./arrange.js";
import { nodeColour } from "./colours.js";
import { colour, compare, level, setLevel, show } from "./look.js";
import { surfaceMaterial } from "./surfaces.js";
import { setLoop } from "./time.js";
import { $, countText } from "./ui.js";
import { windControl } from "./wind.js";

const GOLDEN = Math.PI * (3 - Math.sqrt(5));

const chosenCount = () => state.forestCount ?? Math.round(10 ** ($("forest-count").value / 25));

export function forestRadius() {
  return 2 * app.plants[0].ath.sphere.radius * Number($("forest-spread").value) * Math.sqrt(chosenCount()) * 0.55;
}

function instances(count) {
  const { ath } = app.plants[0], { rest } = ath, up = ath.metadata.up_axis === "z" ? 2 : 1, spread = forestRadius();
  const duration = ath.motion.duration || 1, foot = [rest[0], rest[1], rest[2]], { clips } = ath.motion;
  const clipOf = (i) => ($("forest-mix").checked ? i % clips.length : undefined);
  return Array.from({ length: count }, (_, i) => {
    const far = spread * Math.sqrt((i + 0.3) / count), angle = i * GOLDEN + 0.5 * Math.sin(i * 12.9898);
    const size = 0.75 + 0.5 * (Math.sin(i * 78.233) * 0.5 + 0.5), x = far * Math.cos(angle), y = far * Math.sin(angle);
    const at = up === 2 ? { x, y, z: foot[2] * (1 - size) } : { x, y: foot[1] * (1 - size), z: y };
    return { ...at, size, clip: clipOf(i), angle: i * 2.4, seconds: (i * 0.7548776662 % 1) * duration };
  });
}

const hasSurfaces = () => colour.value === "plain" && app.plants[0].hasSurfaces;

function forestMaterial(lines, of) {
  if (hasSurfaces() && !lines) return surfaceMaterial();
  const material = lines ? new LineBasicMaterial() : new MeshLambertMaterial({ side: DoubleSide });
  tintForest(material, lines, of);
  return material;
}

// Bark, leaves or the file's own colours; by level where nodes are told apart.
function tintForest(material, lines, of) {
  const plain = colour.value === "plain", stored = lines || app.plants[0].ath.geometry.hasAttribute("color");
  if (material.vertexColors !== (plain && stored)) material.needsUpdate = true;
  material.vertexColors = plain && stored;
  material.color = plain ? new Color(stored ? 0xffffff : 0x6f8f4a) : new Color().setRGB(...nodeColour(of + 1));
}

export function colourForest() {
  if (state.forest && app.plants[0].hasSurfaces) forestOn(); // in other materials
  else state.forest?.children.forEach((drawn) => tintForest(drawn.material, drawn.isLineSegments, drawn.userData.level));
}

export function forestOn() {
  const [plant] = app.plants;
  state.forest?.removeFromParent();
  state.forest?.dispose();
  const forest = new ATHForest(plant.ath, { geometry: plant.forestGeometry(), material: forestMaterial });
  state.forest = forest;
  forest.levelOfDetail = $("forest-lod").checked;
  forest.addEventListener("level", () => { state.dirty = true; });
  plant.root.add(forest);
  setLoop(state.loop);
  plantForest();
  for (const child of plant.root.children) if (child !== forest) child.visible = false;
  plant.motion.setLevel(plant.motion.levelCount - 1); // near instances show all of it
}

export function plantForest() {
  state.forest.setInstances(instances(chosenCount()));
  place();
  state.dirty = true;
}

export function forestOff() {
  state.forest.removeFromParent();
  state.forest.dispose();
  state.forest = null;
  $("forest").checked = false;
  $("forest-rows").hidden = true;
  app.plants[0].setShow(show.value);
  setLevel(level.value);
  setLoop(state.loop);
  place();
}

export function forestSwitch(on) {
  if (on === Boolean(state.forest)) return;
  $("forest").checked = on;
  $("forest-rows").hidden = !on;
  if (on && app.plants.length > 1) {
    compare.set("off");
    for (const each of app.opened.splice(1)) each.dispose();
    arrange();
  }
  if (on) forestOn();
  else forestOff();
  windControl();
  frameView();
}

/** So many instances, whatever the slider allows. */
export function forestOf(count, levelOfDetail = true) {
  state.forestCount = count;
  $("forest-lod").checked = levelOfDetail;
  if (!state.forest) forestSwitch(true);
  state.forest.levelOfDetail = levelOfDetail;
  plantForest();
  frameView();
  forestNumbers();
}

function forestNumbers() {
  const count = countText(chosenCount()), spread = Number($("forest-spread").value).toFixed(1);
  $("forest-count-value").value = count;
  $("forest-count").setAttribute("aria-valuetext", `${count} plants`);
  $("forest-spread-value").value = `${spread}×`;
  $("forest-spread").setAttribute("aria-valuetext", `${spread} times as far apart`);
}

export function forestBars() {
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

$("forest").addEventListener("change", () => forestSwitch($("forest").checked));
for (const id of ["forest-count", "forest-spread"]) $(id).addEventListener("input", () => { delete state.forestCount; forestNumbers(); plantForest(); });
$("forest-count").addEventListener("change", frameView);
$("forest-mix").addEventListener("change", plantForest);
$("forest-lod").addEventListener("change", () => { state.forest.levelOfDetail = $("forest-lod").checked; state.dirty = true; });
forestNumbers();
