// The address holds what is looked at: view, clip, wind, detail, colours and, where it is paused, the time.

import { app, main, state } from "./app.js";

const choices = () => Object.entries({ colour: app.colour, show: app.show });
const MOST_TREES = 10000;
const PRESET = { colour: "plain", show: "mesh" };

const short = (value) => String(Number(value.toPrecision(5)));

/** As the part of an address behind "#". */
function looked() {
  const { camera, controls, moved, split } = app.stage, { motion } = app.plants[0], out = new URLSearchParams();
  if (moved) out.set("view", [...camera.position, ...controls.target].map(short).join(" "));
  if (state.wind) out.set("wind", state.wind.map(short).join(" "));
  else if (motion.clip.index > 0) out.set("clip", motion.clip.name);
  if (app.level.value !== "auto") out.set("detail", app.level.value);
  for (const [name, { value }] of choices()) if (value !== PRESET[name]) out.set(name, value);
  if (app.compare.value === "levels") out.set("split", `${motion.target} ${short(split)}`);
  if (!state.playing) out.set("t", short(state.time));
  return String(out);
}

let known = ""; // the part of the address that is looked at

/** Writes it into the address, where it differs; an address that was changed by hand is followed. */
function write() {
  if (app.plants.length === 0) return;
  if (location.hash !== known) {
    restore();
    return;
  }
  const hash = looked();
  if (!state.forest && hash !== known.slice(1)) history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
  known = location.hash;
}

const numbers = (text) => text.split(" ").map(Number);

function restoreView(text) {
  const values = numbers(text), { camera, controls } = app.stage;
  if (values.length !== 6 || !values.every(Number.isFinite)) return;
  camera.position.fromArray(values);
  controls.target.fromArray(values, 3);
  controls.update();
  app.stage.moved = true;
}

function restoreSplit(text) {
  const [left, share] = numbers(text);
  app.compare.pick("levels");
  if (Number.isFinite(left)) document.getElementById("compare-level").value = left;
  app.setLevel(app.level.value);
  if (Number.isFinite(share)) app.setSplit(share);
}

/** Applies the address. What it does not name is as in a page that was just opened; names that the file lacks are passed over. */
function restore() {
  const wanted = new URLSearchParams(location.hash.slice(1)), get = (name) => wanted.get(name) ?? "";
  const { clips, levelCount } = main().motion, detail = get("detail"), wind = numbers(get("wind")), trees = Number(get("forest"));
  const clip = clips.find(({ name }) => name === get("clip")) ?? clips[main().ath.channel.first];
  if (state.forest && !(trees >= 1)) app.forestSwitch(false);
  if (clip !== main().motion.clip || state.wind) app.playClip(clip.index);
  if (wind.length === 2 && wind.every(Number.isFinite)) app.setWind(...wind);
  app.setLevel(detail && Number(detail) >= 0 && Number(detail) < levelCount ? String(Number(detail)) : "auto");
  for (const [name, choice] of choices()) {
    const value = choice.buttons.some((button) => button.dataset.value === get(name)) ? get(name) : PRESET[name];
    if (choice.value !== value) choice.pick(value);
  }
  if (get("split")) restoreSplit(get("split"));
  else if (app.compare.value === "levels") app.compare.pick("off");
  if (get("view")) restoreView(get("view"));
  else if (app.stage.moved) app.resetView();
  if (trees >= 1) plantAll(Math.min(MOST_TREES, Math.round(trees)));
  if (get("t") && Number.isFinite(Number(get("t")))) stopAt(Number(get("t")));
  else if (known) app.setPlaying(true);
  known = location.hash;
}

// Once all is here that plants are drawn with.
async function plantAll(count) {
  const { ath } = main();
  await ath.arrays.catch(() => {});
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
