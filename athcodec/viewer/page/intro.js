// The story of a file, told once as it opens: under the split, on the left what has come of it, on the right all of it.

import { app, main, state } from "./app.js";
import { $ } from "./ui.js";

const SECONDS = 6;
let timers = [], isOver = false;

/** Begins, where nobody has asked for anything else: once, with a file that has several levels, for who likes motion. */
function beginIntro() {
  const { motion } = main(), last = motion.levelCount - 1, isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (isOver || last === 0 || isStill || location.hash || app.opened.length > 1 || app.opened[0].model) return;
  isOver = state.intro = true;
  app.compare.pick("levels");
  leave(0);
  // Errors fall by about the same factor from level to level, so each gets the same time.
  timers = Array.from({ length: last + 1 }, (_, level) => setTimeout(() => leave(level), (1000 * SECONDS * level) / (last + 1)));
  timers.push(setTimeout(endIntro, 1000 * SECONDS));
}

function leave(level) {
  $("compare-level").value = level;
  app.setLevel(app.level.value);
  app.splitLabels();
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
