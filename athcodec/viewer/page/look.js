// How the plant is looked at: its detail, its colours, what of it is shown, and two of it under one split.

import { app, main, state } from "./app.js";
import { heatGradient, orderCss } from "./colours.js";
import { $, bytesText, Choice, detailText, lengthText, shortLength, upper } from "./ui.js";

const MOST_BUTTONS = 9, LEGEND = 7; // colours of orders, which then come again

/** The error of a level in its clip, as text. */
const within = ({ ath, motion }, of) => lengthText(motion.error(of).max, ath.metadata.unit);

function levelControls() {
  const most = Math.max(...app.plants.map(({ motion }) => motion.levelCount)) - 1;
  const deepest = app.plants.find(({ motion }) => motion.levelCount > most), bytesOf = (level) => app.levelText(deepest, level)[0];
  // A level gets no chip where the next one is as small, in the same figures, and better.
  const worth = Array.from({ length: most + 1 }, (_, level) => level).filter((level) => level === most || bytesOf(level) !== bytesOf(level + 1));
  const values = ["auto", ...worth.map(String)];
  const titles = values.slice(1).map((value) => `${upper(detailText(deepest.motion, Number(value)))}, error up to ${within(deepest, value)}`);
  const chips = values.slice(1).map((value) => app.levelText(deepest, Number(value)).join("\n")), areFew = values.length <= MOST_BUTTONS;
  if (areFew) app.level.fill(values, ["Auto", ...chips], ["As much detail as can be seen", ...titles]);
  else app.level.fill(["auto"], ["Auto"], ["As much detail as can be seen"]);
  $("level").hidden = areFew;
  for (const id of ["level", "compare-level"]) $(id).max = most;
  $("compare-level").value = Math.min(1, most);
  $("level").value = most;
}

/** A level as bytes and error: the file's up to it, and the largest in the clip. */
function levelText({ ath: { channel, metadata }, motion }, of) {
  const { chunks, info } = channel, isLast = of >= motion.levelCount - 1; // only all of it has the arrays
  const bytes = isLast ? info.fileLength : chunks.reduce((sum, { level, length }) => sum + (level <= of ? length : 0), info.preludeLength);
  return [bytesText(bytes), shortLength(motion.error(of).max, metadata.unit)];
}

function setLevel(value) {
  app.level.set(value);
  const right = main();
  for (const plant of app.plants) {
    const left = plant !== right && app.compare.value === "levels";
    plant.motion.setLevel(left ? Number($("compare-level").value) : value === "auto" ? "auto" : Number(value));
  }
  if (value !== "auto") $("level").value = value;
  if (right) readOut();
  state.dirty = true;
}

// Sliders say what they mean.
function readOut() {
  for (const id of ["level", "compare-level"]) {
    const plant = app.plants[id === "level" ? app.plants.length - 1 : 0], of = Math.min(Number($(id).value), plant.motion.levelCount - 1);
    $(id).setAttribute("aria-valuetext", `${detailText(plant.motion, of)}, error up to ${within(plant, of)}`);
  }
  $("compare-level-value").value = $("compare-level").value;
  $("compare-level-row").hidden = app.compare.value !== "levels";
}

function changeLevel(by) {
  const { motion } = main(), from = motion.automatic ? motion.target : Number(app.level.value);
  setLevel(String(Math.max(0, Math.min(motion.levelCount - 1, from + by))));
}

/** Says which level is shown, in the figures of its chip, and what that means on the screen; marks the chips of what is here. */
function tellLevel() {
  const { motion, space } = main(), shown = Math.max(motion.level, 0), [bytes, error] = levelText(main(), shown);
  const { camera, pixels } = app.stage, off = motion.pixelError(shown, camera, pixels, space.matrixWorld);
  const means = motion.level < motion.target && !motion.failure ? ", sharpening…" : off <= 1 ? ", under a pixel" : "";
  $("arrived").textContent = state.forest ? "Each plant as its distance asks for" : `Shown: ${bytes}, at most ${error} off${means}`;
  $("arrived").title = off <= 1 ? "Under a pixel for 99 of 100 points" : "";
  const chips = app.level.buttons.slice(1).map(({ dataset: { value } }) => Number(value)), marked = chips.find((level) => level >= shown);
  for (const { dataset } of app.level.buttons) {
    dataset.here = dataset.value === "auto" || Number(dataset.value) <= motion.readyLevel;
    dataset.shown = !state.forest && dataset.value === String(marked);
  }
  if (motion.automatic) $("level").value = motion.target;
  readOut();
}

// ---- the split ----

function setSplit(share) {
  app.stage.split = Math.max(0.02, Math.min(share, 0.98));
  $("stage").style.setProperty("--split", app.stage.split);
  $("split").setAttribute("aria-valuenow", Math.round(100 * app.stage.split));
  $("split").setAttribute("aria-valuetext", `${Math.round(100 * app.stage.split)} % of the picture on the left`);
  app.stage.changed();
}

// Of the side of a split between two levels: the left one is of a level that is chosen, the right one of what is seen without it.
function sideName(side) {
  if (side > 0) return main().motion.automatic ? "Auto" : "Chosen";
  const [left, right] = app.plants.map(({ motion }) => motion.level);
  return state.intro ? "What has come" : left < right ? "Less detail" : left > right ? "More detail" : "The same detail";
}

/** Sets what is on either side. */
function splitLabels() {
  const two = app.plants.length > 1;
  $("split-view").hidden = !two;
  if (!two) return;
  app.plants.forEach(({ ath, motion }, i) => {
    const of = Math.max(motion.level, 0), [bytes, error] = app.levelText(app.plants[i], of);
    const name = app.compare.value === "file" ? ath.fileName : of >= motion.levelCount - 1 ? "All of it" : sideName(i);
    const text = `${name}: ${bytes}, ${error} off`;
    const tag = $(i === 0 ? "split-left" : "split-right");
    if (tag.textContent !== text) tag.textContent = text;
  });
}

// ---- the heat map's legend ----

function tellScale() {
  if (app.colour.value !== "error") return;
  const plant = main(), { unit } = plant.ath.metadata, { motion, heatMost } = plant, none = !(heatMost > 0) || motion.level >= motion.levelCount - 1;
  const text = (length) => lengthText(length, unit), onlyRight = none && app.plants.length < 2;
  $("scale-title").textContent = onlyRight ? "This is the full detail: choose less to see its error" : "Error against the full detail: 99\u00a0% of the points, and more";
  $("scale-low").textContent = text(0);
  $("scale-middle").textContent = text(heatMost / 4);
  $("scale-high").textContent = `${text(heatMost)}, more`;
}

// ---- the legend of parts and orders ----

const ORDERS = ["trunk", "limbs", "branches", "twigs"];

/** Says what the colours of parts and orders mean. */
function tellLegend() {
  const { value } = app.colour, legend = $("legend"), plant = main();
  legend.hidden = !plant || (value !== "part" && value !== "order");
  if (legend.hidden) return;
  if (value === "part") {
    legend.textContent = "Each colour moves as one piece at this level";
    return;
  }
  const { depth, ring } = plant.ath.branches, most = depth.reduce((a, b) => Math.max(a, b), 0);
  const tubes = new Set(depth.filter((_, branch) => ring[branch] > 1)), isLeaf = (order) => tubes.size > 0 && !tubes.has(order);
  legend.replaceChildren(...Array.from({ length: Math.min(most + 1, LEGEND) }, (_, order) => {
    const entry = document.createElement("span"), colour = document.createElement("i");
    colour.style.background = orderCss(order);
    entry.append(colour, plant.isTuft ? "blades" : isLeaf(order) ? "leaves" : ORDERS[order] ?? `order ${order}`);
    return entry;
  }));
}

export default function begin() {
  Object.assign(app, { tellLegend, within, levelControls, levelText, setLevel, changeLevel, tellLevel, setSplit, splitLabels, tellScale });
  app.level = new Choice($("level-choice"), (value) => setLevel(value));
  app.colour = new Choice($("colour"), (value) => {
    for (const plant of app.plants) plant.setColour(value);
    $("scale").hidden = value !== "error";
    tellLegend();
    if (state.forest) app.colourForest();
    state.dirty = true;
  });
  app.show = new Choice($("show"), (value) => {
    for (const plant of app.plants) plant.setShow(value);
    state.dirty = true;
  });
  app.compare = new Choice($("compare"), (value) => {
    if (value === "file") {
      app.choose("yes");
      app.compare.set(app.plants.length > 1 && app.opened.length > 1 ? "file" : "off");
      return;
    }
    for (const each of app.opened.splice(1)) each.dispose();
    app.arrange();
  });
  app.colour.set("plant");
  app.show.set("plant");
  app.compare.set("off");
  $("scale").querySelector("i").style.background = heatGradient;
  $("level").addEventListener("input", () => setLevel($("level").value));
  $("compare-level").addEventListener("input", () => setLevel(app.level.value));
  const split = $("split");
  split.addEventListener("pointerdown", (event) => {
    split.setPointerCapture(event.pointerId);
    event.preventDefault();
    split.focus({ preventScroll: true });
  });
  split.addEventListener("pointermove", (event) => {
    if (!split.hasPointerCapture(event.pointerId)) return;
    const { left, width } = $("split-view").getBoundingClientRect();
    setSplit((event.clientX - left) / width);
  });
  split.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 }[event.key];
    if (!by) return;
    event.preventDefault();
    setSplit(app.stage.split + by);
  });
}
