// The wind between the clips of a file, where these say which wind they show: one weight, from the calmest to the strongest.

import { app, state } from "./app.js";
import { $ } from "./ui.js";

const LIGHT = 0.35; // breeze, where none is told
let range = null; // {least, most, heading} of the clips

function windsOf({ clips, metadata }) {
  return clips.map(({ name }) => ({ ...metadata, ...metadata.clips?.[name] })).filter(({ strength }) => Number.isFinite(strength));
}

/** Where the clips allow it. */
function windControl() {
  const [ath] = app.opened, winds = windsOf({ clips: ath.motion.clips, metadata: ath.metadata });
  const strengths = winds.map(({ strength }) => strength), least = Math.min(...strengths), most = Math.max(...strengths);
  range = most > least ? { least, most, heading: winds[0].heading ?? 0 } : null;
  $("wind-section").hidden = !range || Boolean(state.forest);
  if (range) mark();
}

// The wind that plays.
function strengthNow() {
  const { metadata, motion: { clip } } = app.opened[0];
  return state.wind ?? { ...metadata, ...metadata.clips?.[clip.name] }.strength ?? range.least;
}

/** The wind of what plays, as the grass has it: strength from 0 to 1, heading. */
function breeze() {
  return range && app.opened.length > 0 ? [strengthNow() / range.most, range.heading] : [LIGHT, 0];
}

function mark() {
  const share = (strengthNow() - range.least) / (range.most - range.least), slider = $("wind");
  slider.value = share;
  slider.setAttribute("aria-valuetext", `${Math.round(100 * share)} % of the way from the calmest to the strongest`);
}

/** Shows the plants in the wind that is chosen, if one is. */
function applyWind() {
  if (state.wind === null || !range || state.forest) return;
  for (const { motion } of app.plants) motion.wind(state.wind, range.heading);
  const select = $("clip");
  if (!select.querySelector("[value=wind]")) select.append(new Option("wind", "wind"));
  select.value = "wind";
}

function setWind(strength) {
  if (!range) return;
  state.wind = Math.max(range.least, Math.min(strength, range.most));
  applyWind();
  mark();
  state.dirty = true;
}

export default function begin() {
  Object.assign(app, { windControl, breeze, applyWind, setWind });
  $("wind").addEventListener("input", () => setWind(range.least + Number($("wind").value) * (range.most - range.least)));
}
