// The story of a file, told once as it opens: under the split, on the left each level in turn, on the right the best that has come.

import { app, state } from "./app.js";

const SECONDS = 6;
let timers = [], isOver = false;

/** Begins, where nobody has asked for anything else: once, with a file that has several levels, for who likes motion. */
function beginIntro() {
  const lower = app.left.buttons.slice(0, -1).map(({ dataset }) => Number(dataset.value)), isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (isOver || lower.length === 0 || isStill || location.hash || app.opened.length > 1 || app.opened[0].model) return;
  isOver = state.intro = true;
  app.compare.pick("levels");
  // Errors fall by about the same factor from level to level, so each gets the same time.
  timers = lower.map((level, i) => setTimeout(() => app.setLeft(level), (1000 * SECONDS * i) / lower.length));
  timers.push(setTimeout(endIntro, 1000 * SECONDS));
}

/** Ends at once, as soon as somebody does anything. */
function endIntro() {
  if (!state.intro) return;
  for (const timer of timers.splice(0)) clearTimeout(timer);
  state.intro = false;
  if (app.compare.value === "levels") app.compare.pick("off");
}

export default function begin() {
  Object.assign(app, { beginIntro, endIntro });
  isOver = new URLSearchParams(location.search).get("intro") === "off";
  for (const type of ["pointerdown", "keydown", "wheel"]) addEventListener(type, endIntro, { capture: true, passive: true });
}
