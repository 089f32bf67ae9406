// The address holds what is looked at: view, clip, wind, detail, colours and, where it is paused, the time.

import { app, main, state } from "./app.js";
import { note } from "./ui.js";

const choices = () => Object.entries({ colour: app.colour, show: app.show });
const MOST_TREES = 10000;
const PRESET = { colour: "plant", show: "plant" };

const short = (value) => String(Number(value.toPrecision(5)));

/** As the part of an address behind "#". */
function looked() {
  const { camera, controls, moved, split } = app.stage, { motion } = app.plants[0], out = new URLSearchParams();
  if (moved) out.set("view", [...camera.position, ...controls.target].map(short).join(" "));
  if (state.wind !== null) out.set("wind", short(state.wind));
  else if (motion.clip !== app.usualClip(app.opened[0])) out.set("clip", motion.clip.name);
  if (app.level.value !== "auto") out.set("detail", app.level.value);
  for (const [name, { value }] of choices()) if (value !== PRESET[name]) out.set(name, value);
  if (app.compare.value === "levels" && !state.intro) out.set("split", `${motion.target} ${short(split)}`);
  if (!state.playing) out.set("t", short(state.time));
  return String(out);
}

let known = ""; // the part of the address that is looked at
let fixed = false; // in a frame that may not change its address, such as a notebook's

function put(hash) {
  try {
    history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
  } catch {
    fixed = true;
  }
}

/** Writes it into the address, where it differs; an address that was changed by hand is followed. */
function write() {
  if (app.plants.length === 0) return;
  if (location.hash !== known) {
    restore();
    return;
  }
  const hash = looked();
  if (!state.forest && !fixed && hash !== known.slice(1)) put(hash);
  known = location.hash;
}

const numbers = (text, count) => {
  const values = text.split(" ").map((part) => (part === "" ? NaN : Number(part)));
  return values.length === count && values.every(Number.isFinite) ? values : null;
};
const whole = (text, least, most) => (/^\d+$/.test(text) && Number(text) >= least && Number(text) <= most ? Number(text) : null);

/** What each word of the part behind "#" can say: its text becomes a value, or null where it is not understood. */
const WORDS = {
  view: (text) => numbers(text, 6),
  clip: (text) => main().motion.clips.find(({ name }) => name === text) ?? null,
  wind: (text) => numbers(text, 1)?.[0] ?? null,
  detail: (text) => (text === "auto" ? text : whole(text, 0, main().motion.levelCount - 1)),
  colour: (text) => (app.colour.buttons.some(({ dataset }) => dataset.value === text) ? text : null),
  show: (text) => (app.show.buttons.some(({ dataset }) => dataset.value === text) ? text : null),
  split: (text) => {
    const [left, share = 0.5, ...more] = text.split(" ").map(Number);
    return whole(text.split(" ")[0], 0, main().motion.levelCount - 1) !== null && share > 0 && share < 1 && more.length === 0 ? [left, share] : null;
  },
  t: (text) => numbers(text, 1)?.[0] ?? null,
  forest: (text) => whole(text, 1, MOST_TREES),
};
const SEARCH = ["file", "clip", "compare", "mesh", "floor", "each", "quality", "intro"];

function restoreView([...values]) {
  const { camera, controls } = app.stage;
  camera.position.fromArray(values);
  controls.target.fromArray(values, 3);
  controls.update();
  app.stage.moved = true;
}

function restoreSplit([left, share]) {
  app.compare.pick("levels");
  app.setLeft(left);
  app.setSplit(share);
}

// The values that the address names, and the parts of it that are not understood.
function read() {
  const values = {}, unknown = [...new URLSearchParams(location.search)].filter(([name]) => !SEARCH.includes(name));
  for (const [name, text] of new URLSearchParams(location.hash.slice(1))) {
    const value = Object.hasOwn(WORDS, name) ? WORDS[name](text) : null;
    if (value === null) unknown.push([name, text]);
    else values[name] = value;
  }
  return [values, unknown];
}

/** Applies the address. What it does not name is as in a page that was just opened; a line says what is not understood. */
function restore() {
  const [wanted, unknown] = read();
  const clip = wanted.clip ?? app.usualClip(app.opened[0]);
  if (state.forest && !wanted.forest) app.forestSwitch(false);
  if (clip !== main().motion.clip || state.wind !== null) app.playClip(clip.index);
  if ("wind" in wanted) app.setWind(wanted.wind);
  app.setLevel(String(wanted.detail ?? "auto"));
  for (const [name, choice] of choices()) {
    const value = wanted[name] ?? PRESET[name];
    if (choice.value !== value) choice.pick(value);
  }
  if (wanted.split) restoreSplit(wanted.split);
  else if (app.compare.value === "levels") app.compare.pick("off");
  if (wanted.view) restoreView(wanted.view);
  else if (app.stage.moved) app.resetView();
  if (wanted.forest) plantAll(wanted.forest);
  if ("t" in wanted) stopAt(wanted.t);
  else if (known) app.setPlaying(true);
  if (unknown.length > 0) note(`Not understood in the address: ${unknown.map((part) => part.join("=")).join(", ")}`);
  known = location.hash;
}

// Once all is here that plants are drawn with.
async function plantAll(count) {
  const { ath } = main();
  await Promise.all([app.later(), ath.arrays.catch(() => {})]);
  if (main()?.ath === ath) app.forestOf(count);
}

// A clip that is waited for begins at its start.
function stopAt(seconds) {
  const { motion } = main(), begun = () => {
    motion.removeEventListener("clip", begun);
    app.seek(seconds);
  };
  app.setPlaying(false);
  app.seek(seconds);
  if (motion.switching) motion.addEventListener("clip", begun);
}

export default function begin() {
  Object.assign(app, { looked, write, restore });
}
