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

/** The clip that a file opens with: the one that was asked for, else that of the strongest wind, else the first. */
function usualClip({ isAsked, channel, metadata, motion: { clips } }) {
  const strength = ({ name }) => metadata.clips?.[name]?.strength ?? metadata.strength ?? 0;
  return isAsked ? clips[channel.first] : clips.reduce((most, clip) => (strength(clip) > strength(most) ? clip : most));
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
  Object.assign(app, { usualClip, clipControls, playIn, playClip, nextClip });
  $("clip").addEventListener("change", () => playClip(Number($("clip").value)));
}
