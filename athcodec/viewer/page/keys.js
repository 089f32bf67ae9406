// Keys of the whole page; those of the view and of sliders are theirs.

import { app, state } from "./app.js";
import { resetView } from "./arrange.js";
import { zoom } from "./camera.js";
import { nextClip } from "./clips.js";
import { forestSwitch } from "./forests.js";
import { changeLevel, colour, compare, setLevel, show } from "./look.js";
import { togglePanel } from "./panel.js";
import { fullscreen, picture, video } from "./sharing.js";
import { changeSpeed, seek, setPlaying, step, toEnd } from "./time.js";
import { $ } from "./ui.js";

const KEYS = {
  " ": () => setPlaying(!state.playing), ArrowLeft: (event) => step(event.shiftKey ? -10 : -1), ArrowRight: (event) => step(event.shiftKey ? 10 : 1),
  ",": () => step(-1), ".": () => step(1), "<": () => changeSpeed(-1), ">": () => changeSpeed(1), Home: () => seek(0), End: toEnd,
  l: () => $("loop").click(), n: (event) => nextClip(event.shiftKey ? -1 : 1),
  "+": () => zoom(true), "=": () => zoom(true), "-": () => zoom(false), "[": () => changeLevel(-1), "]": () => changeLevel(1), a: () => setLevel("auto"),
  c: () => colour.next(), s: () => show.next(), d: () => compare.pick(compare.value === "off" ? "levels" : "off"),
  f: () => forestSwitch(!state.forest), r: resetView, p: picture, v: video, h: togglePanel, w: fullscreen, "?": () => $("keys").showModal(),
};

// Where a key means something already: letters in a list, arrows in sliders, the space bar on what can be pressed.
function isTaken({ target, key }) {
  if (target.matches("select")) return true;
  if (target.matches("input, [role=slider]") && /^(Arrow|Home|End|Page)/.test(key)) return true;
  return key === " " && target.matches("button, input[type=checkbox], summary");
}

addEventListener("keydown", (event) => {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || app.plants.length === 0 || $("keys").open || isTaken(event)) return;
  const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action) return;
  event.preventDefault();
  action(event);
});
$("help").addEventListener("click", () => $("keys").showModal());
