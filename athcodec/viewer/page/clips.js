// The clips of a file.

import { app, state } from "./app.js";
import { plantForest } from "./forests.js";
import { fromTheStart, limit, setLoop, setPlaying } from "./time.js";
import { $ } from "./ui.js";
import { windControl } from "./wind.js";

const FADE = 0.4; // seconds, from one clip to the next

export function clipControls() {
  const { clips, clip } = app.opened[0].motion, select = $("clip");
  select.replaceChildren(...clips.map(({ index, name, loop }) => new Option(loop ? `${name} ↻` : name, index)));
  select.value = clip.index;
  select.hidden = $("forest-mix-row").hidden = clips.length < 2;
}

/** A second file may have no clip of that name. */
export function playIn(motion, name) {
  if (motion.clips.some((clip) => clip.name === name)) motion.play(name, { fade: state.playing && !state.forest ? FADE : 0 });
}

export function playClip(index) {
  const ended = state.time >= limit(), [{ motion }] = app.plants;
  state.wind = null;
  for (const plant of app.plants) playIn(plant.motion, motion.clips[index].name);
  clipControls();
  $("clip").value = index;
  fromTheStart();
  setLoop(null);
  windControl();
  if (ended) setPlaying(true);
  if (state.forest) plantForest();
  state.dirty = true;
}

export function nextClip(by) {
  const { clips, clip } = app.plants[0].motion;
  playClip((clip.index + by + clips.length) % clips.length);
}

$("clip").addEventListener("change", () => playClip(Number($("clip").value)));
