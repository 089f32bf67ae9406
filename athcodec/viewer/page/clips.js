// The clips of a file.

import { app, state } from "./app.js";
import { $ } from "./ui.js";

const FADE = 0.4; // seconds, from one clip to the next

function clipControls() {
  const { clips, clip } = app.opened[0].motion, select = $("clip");
  select.replaceChildren(...clips.map(({ index, name, loop }) => new Option(loop ? `${name} ↻` : name, index)));
  select.value = clip.index;
  select.hidden = $("forest-mix-row").hidden = clips.length < 2;
}

/** A second file may have no clip of that name. */
function playIn(motion, name) {
  if (motion.clips.some((clip) => clip.name === name)) motion.play(name, { fade: state.playing && !state.forest ? FADE : 0 });
}

function playClip(index) {
  const ended = state.time >= app.limit(), [{ motion }] = app.plants;
  state.wind = null;
  for (const plant of app.plants) playIn(plant.motion, motion.clips[index].name);
  clipControls();
  $("clip").value = index;
  app.fromTheStart();
  app.setLoop(null);
  app.windControl();
  if (ended) app.setPlaying(true);
  if (state.forest) app.plantForest();
  state.dirty = true;
}

function nextClip(by) {
  const { clips, clip } = app.plants[0].motion;
  playClip((clip.index + by + clips.length) % clips.length);
}

export default function begin() {
  Object.assign(app, { clipControls, playIn, playClip, nextClip });
  $("clip").addEventListener("change", () => playClip(Number($("clip").value)));
}
