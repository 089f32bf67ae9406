// How the plant is looked at: its detail, its colours, what of it is shown, and two of it under one split.

import { app, main, state } from "./app.js";
import { heatGradient, orderCss } from "./colours.js";
import { $, bytesText, Choice, detailText, lengthText, shortLength, upper } from "./ui.js";

const MOST_CHIPS = 8, LEGEND = 7; // colours of orders, which then come again

/** The error of a level in its clip, as text. */
const within = ({ ath, motion }, of) => lengthText(motion.error(of).max, ath.metadata.unit);

function levelControls() {
  const most = Math.max(...app.plants.map(({ motion }) => motion.levelCount)) - 1;
  const deepest = app.plants.find(({ motion }) => motion.levelCount > most), bytesOf = (level) => app.levelText(deepest, level)[0];
  // A level gets no chip where the next one is as small, in the same figures, and better; nor do some of very many.
  const worth = Array.from({ length: most + 1 }, (_, level) => level).filter((level) => level === most || bytesOf(level) !== bytesOf(level + 1));
  const each = Math.ceil(worth.length / MOST_CHIPS), values = worth.filter((_, i) => (worth.length - 1 - i) % each === 0).map(String);
  const titles = values.map((value) => `${upper(detailText(deepest.motion, Number(value)))}, error up to ${within(deepest, value)}`);
  const chips = values.map((value) => app.levelText(deepest, Number(value)).join("\n±"));
  for (const choice of [app.level, app.left]) choice.fill(values, chips, titles);
  app.left.set(String(Math.min(1, most)));
  $("levels-title").textContent = most > 0 ? `Plays from ${bytesOf(0)} on, then sharpens` : "One level";
  app.compare.buttons[1].disabled = most === 0;
}

/** A level as bytes and error: the file's up to it, and the largest in the clip. */
function levelText({ ath: { channel, metadata }, motion }, of) {
  const { chunks, info } = channel, isLast = of >= motion.levelCount - 1; // only all of it has the arrays
  const bytes = isLast ? info.fileLength : chunks.reduce((sum, { level, length }) => sum + (level <= of ? length : 0), info.preludeLength);
  return [bytesText(bytes), shortLength(motion.error(of).max, metadata.unit)];
}

function setLevel(value) {
  app.level.set(value);
  $("auto").checked = value === "auto";
  for (const plant of app.plants) if (!isLeft(plant)) plant.motion.setLevel(value === "auto" ? value : Number(value));
  setLeft();
  state.dirty = true;
}

// Whether it is the left one of a split between levels.
const isLeft = (plant) => app.compare.value === "levels" && plant !== main();

/** The left side shows this level, or a neighbour of it where the right side is to show the same. */
function setLeft(level = Number(app.left.value)) {
  app.left.set(String(level));
  const left = app.plants.find(isLeft);
  $("left-row").hidden = !left;
  if (!left) return;
  const { target } = main().motion, other = level !== target ? level : Math.abs(target - 1);
  if (left.motion.automatic || left.motion.target !== other) left.motion.setLevel(other);
  markShown(app.left, other);
}

// The chip of a level, or of the next one that has a chip.
function markShown({ buttons }, level) {
  const shown = buttons.find(({ dataset: { value } }) => Number(value) >= level);
  for (const button of buttons) button.ariaCurrent = String(button === shown);
}

function changeLevel(by) {
  const { motion } = main(), from = motion.automatic ? motion.target : Number(app.level.value);
  setLevel(String(Math.max(0, Math.min(motion.levelCount - 1, from + by))));
}

/** Says what has come and which level is shown, in the figures of its chip; marks the chips of what is here. */
function tellLevel() {
  const { motion, space } = main(), shown = Math.max(motion.level, 0), [bytes, error] = levelText(main(), shown);
  const { camera, pixels } = app.stage, off = motion.pixelError(shown, camera, pixels, space.matrixWorld), { bytesFetched, bytesTotal } = motion;
  const isComing = motion.level < motion.target && !motion.failure, isAll = shown === motion.levelCount - 1;
  const [here, total] = [bytesFetched, bytesTotal].map(bytesText), count = here.slice(-2) === total.slice(-2) ? here.slice(0, -3) : here;
  const come = isComing ? `Streaming: ${count} of ${total}` : isAll ? `All ${bytes} shown` : `First ${bytes} shown`;
  $("arrived").textContent = state.forest ? "Each plant as its distance asks for" : `${come}, within ${error} of the source`;
  $("arrived").title = off <= 1 ? "Under a pixel for 99 of 100 points" : "";
  for (const { dataset } of app.level.buttons) dataset.here = Number(dataset.value) <= motion.readyLevel;
  markShown(app.level, state.forest ? Infinity : shown);
  setLeft();
}

// ---- the split ----

function setSplit(share) {
  app.stage.split = Math.max(0.02, Math.min(share, 0.98));
  $("stage").style.setProperty("--split", app.stage.split);
  $("split").setAttribute("aria-valuenow", Math.round(100 * app.stage.split));
  $("split").setAttribute("aria-valuetext", `${Math.round(100 * app.stage.split)} % of the picture on the left`);
  app.stage.changed();
}

/** Says what is on either side, as long as that differs. */
function splitLabels() {
  const [left, right] = app.plants, same = !right || (left.ath === right.ath && left.motion.level === right.motion.level);
  $("split-view").hidden = same;
  if (same) return;
  app.plants.forEach((plant, i) => {
    const { ath, motion } = plant, of = Math.max(motion.level, 0), [bytes, error] = levelText(plant, of);
    const name = left.ath !== right.ath ? `${ath.fileName}, ` : of < motion.levelCount - 1 ? "First " : "All ";
    const text = `${name}${bytes}: within ${error} of the source`, tag = $(i === 0 ? "split-left" : "split-right");
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
  Object.assign(app, { tellLegend, within, levelControls, levelText, setLevel, setLeft, changeLevel, tellLevel, setSplit, splitLabels, tellScale });
  app.level = new Choice($("level-choice"), (value) => setLevel(value));
  app.left = new Choice($("left-choice"), (value) => setLeft(Number(value)));
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
  $("auto").addEventListener("change", () => setLevel($("auto").checked ? "auto" : String(main().motion.target)));
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
