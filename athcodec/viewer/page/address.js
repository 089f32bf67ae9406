// The address holds what is looked at: view, clip, wind, detail, colours and, where it is paused, the time.

import { app, main, state } from "./app.js";
import { colour, compare, level, setLevel, setSplit, show } from "./look.js";
import { seek, setPlaying } from "./time.js";
import { playClip } from "./clips.js";
import { forestOf } from "./forests.js";
import { setWind } from "./wind.js";

const choices = () => Object.entries({ colour, show });
const MOST_TREES = 10000;
const PRESET = { colour: "plain", show: "mesh" };

const short = (value) => String(Number(value.toPrecision(5)));

/** As the part of an address behind "#". */
export function looked() {
  const { camera, controls, moved, split } = app.stage, { motion } = app.plants[0], out = new URLSearchParams();
  if (moved) out.set("view", [...camera.position, ...controls.target].map(short).join(" "));
  if (state.wind) out.set("wind", state.wind.map(short).join(" "));
  else if (motion.clip.index > 0) out.set("clip", motion.clip.name);
  if (level.value !== "auto") out.set("detail", level.value);
  for (const [name, { value }] of choices()) if (value !== PRESET[name]) out.set(name, value);
  if (compare.value === "levels") out.set("split", `${motion.target} ${short(split)}`);
  if (!state.playing) out.set("t", short(state.time));
  return String(out);
}

/** Writes it into the address, where it differs. */
export function write() {
  if (app.plants.length === 0 || state.forest) return;
  const hash = looked();
  if (hash === location.hash.slice(1)) return;
  history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
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
  compare.pick("levels");
  if (Number.isFinite(left)) document.getElementById("compare-level").value = left;
  setLevel(level.value);
  if (Number.isFinite(share)) setSplit(share);
}

/** Applies the address once the first file is shown. Names that the file lacks are passed over. */
export function restore() {
  const wanted = new URLSearchParams(location.hash.slice(1)), get = (name, use) => { if (wanted.has(name)) use(wanted.get(name)); };
  const { clips, levelCount } = main().motion;
  get("clip", (name) => {
    const clip = clips.find((each) => each.name === name);
    if (clip && clip !== main().motion.clip) playClip(clip.index);
  });
  get("wind", (text) => { if (numbers(text).every(Number.isFinite)) setWind(...numbers(text)); });
  get("detail", (value) => { if (Number(value) >= 0 && Number(value) < levelCount) setLevel(String(Number(value))); });
  for (const [name, choice] of choices())
    get(name, (value) => { if (choice.buttons.some((button) => button.dataset.value === value)) choice.pick(value); });
  get("split", restoreSplit);
  get("view", restoreView);
  get("forest", (text) => { if (Number(text) >= 1) plantAll(Math.min(MOST_TREES, Math.round(Number(text)))); });
  get("t", (text) => { if (Number.isFinite(Number(text))) stopAt(Number(text)); });
}

// Once all is here that plants are drawn with.
async function plantAll(count) {
  const { ath } = main();
  await ath.arrays.catch(() => {});
  if (main()?.ath === ath) forestOf(count);
}

// A clip that is waited for begins at its start.
function stopAt(seconds) {
  const { motion } = main(), begun = () => {
    motion.removeEventListener("clip", begun);
    seek(seconds);
  };
  setPlaying(false);
  seek(seconds);
  if (motion.switching) motion.addEventListener("clip", begun);
}
