// Wind as one round control, where the clips of a file say which wind they show: away from the middle it is stronger, around it
// another heading. A heading is blended of clips that have several; where all have one, a plant cannot be known in another, and
// it is turned as a whole, with the wind that it is in.

import { app, state } from "./app.js";
import { $ } from "./ui.js";

const ROUND = 40; // radius of the disc, in its own units
const LIGHT = 0.35; // breeze, where none is told
let range = null; // {least, most, headings} of the clips

function windsOf({ clips, metadata }) {
  return clips.map(({ name }) => ({ ...metadata, ...metadata.clips?.[name] })).filter(({ strength }) => Number.isFinite(strength));
}

const isTurned = () => range.headings.length === 1;

/** Where the clips allow it. */
function windControl() {
  const [ath] = app.opened, winds = windsOf({ clips: ath.motion.clips, metadata: ath.metadata });
  const strengths = [...new Set(winds.map(({ strength }) => strength))], headings = [...new Set(winds.map(({ heading = 0 }) => heading))];
  range = strengths.length > 1 || headings.length > 1 ? { least: Math.min(...strengths), most: Math.max(...strengths), headings } : null;
  $("wind-section").hidden = !range || Boolean(state.forest);
  turnPlants();
  if (!range) return;
  $("wind-note").hidden = !isTurned();
  $("wind-clips").replaceChildren(...winds.map(({ strength, heading = 0 }) => dot(strength, heading)));
  mark();
}

function turnPlants() {
  const turn = range && state.wind && !state.forest && isTurned() ? state.wind[1] - range.headings[0] : 0;
  for (const plant of app.plants) plant.turn(turn);
}

/** The wind of what plays, as the grass has it: strength from 0 to 1, heading. */
function breeze() {
  if (!range || app.opened.length === 0) return [LIGHT, 0];
  const [strength, heading] = now();
  return [strength / range.most, heading];
}

const radiusOf = (strength) => ROUND * Math.max(strength, 0) / range.most;

function placeOf(strength, heading) {
  const angle = heading * Math.PI / 180, radius = radiusOf(strength);
  return [radius * Math.sin(angle), -radius * Math.cos(angle)];
}

function dot(strength, heading) {
  const circle = document.createElementNS("http://www.w3.org/2000/svg", "circle"), [x, y] = placeOf(strength, heading);
  for (const [name, value] of Object.entries({ cx: x, cy: y, r: 2 })) circle.setAttribute(name, value);
  return circle;
}

// The wind that plays.
function now() {
  if (state.wind) return state.wind;
  const { metadata, motion: { clip } } = app.opened[0], { strength = range.least, heading = 0 } = { ...metadata, ...metadata.clips?.[clip.name] };
  return [strength, heading];
}

function mark() {
  const disc = $("wind"), [strength, heading] = now(), [x, y] = placeOf(strength, heading), handle = $("wind-handle"), arrow = $("wind-arrow");
  handle.setAttribute("cx", x);
  handle.setAttribute("cy", y);
  arrow.setAttribute("x2", x);
  arrow.setAttribute("y2", y);
  const text = `${strength.toFixed(1)}, to ${Math.round(heading) % 360}°`;
  $("wind-text").value = text;
  disc.setAttribute("aria-valuemin", range.least);
  disc.setAttribute("aria-valuemax", range.most);
  disc.setAttribute("aria-valuenow", strength.toFixed(1));
  disc.setAttribute("aria-valuetext", `strength ${text.replace("to", "heading")}`);
}

/** Shows the plants in the wind that is chosen, if one is. */
function applyWind() {
  if (!state.wind || !range || state.forest) return;
  const [strength, heading] = state.wind;
  for (const { motion } of app.plants) motion.wind(strength, isTurned() ? range.headings[0] : heading);
  turnPlants();
  const select = $("clip");
  if (!select.querySelector("[value=wind]")) select.append(new Option("wind", "wind"));
  select.value = "wind";
}

function setWind(strength, heading) {
  if (!range) return;
  state.wind = [Math.max(range.least, Math.min(strength, range.most)), ((heading % 360) + 360) % 360];
  applyWind();
  mark();
  state.dirty = true;
}

function dragTo({ clientX, clientY }) {
  const { left, top, width, height } = $("wind").getBoundingClientRect(), scale = 100 / width;
  const x = (clientX - left - width / 2) * scale, y = (clientY - top - height / 2) * scale;
  setWind(range.most * Math.hypot(x, y) / ROUND, Math.atan2(x, -y) * 180 / Math.PI);
}

export default function begin() {
  Object.assign(app, { windControl, breeze, applyWind, setWind });
  const disc = $("wind");
  disc.addEventListener("pointerdown", (event) => {
    disc.setPointerCapture(event.pointerId);
    disc.focus({ preventScroll: true });
    dragTo(event);
  });
  disc.addEventListener("pointermove", (event) => { if (disc.hasPointerCapture(event.pointerId)) dragTo(event); });
  disc.addEventListener("keydown", (event) => {
    const by = { ArrowUp: [0.05, 0], ArrowDown: [-0.05, 0], ArrowLeft: [0, -10], ArrowRight: [0, 10] }[event.key];
    if (!by) return;
    event.preventDefault();
    const [strength, heading] = now();
    setWind(strength + by[0] * (range.most - range.least), heading + by[1]);
  });
}
