// Keys of the whole page; those of the view and of sliders are theirs.

import { app, state } from "./app.js";
import { $ } from "./ui.js";

// Where a key means something already: letters in a list, arrows in sliders, the space bar on what can be pressed.
function isTaken({ target, key }) {
  if (target.matches("select")) return true;
  if (target.matches("input, [role=slider]") && /^(Arrow|Home|End|Page)/.test(key)) return true;
  return key === " " && target.matches("button, input[type=checkbox], summary");
}

export default function begin() {
  const actions = {
    " ": () => app.setPlaying(!state.playing), ArrowLeft: (event) => app.step(event.shiftKey ? -10 : -1), ArrowRight: (event) => app.step(event.shiftKey ? 10 : 1),
    ",": () => app.step(-1), ".": () => app.step(1), "<": () => app.changeSpeed(-1), ">": () => app.changeSpeed(1), Home: () => app.seek(0), End: app.toEnd,
    l: () => $("loop").click(), n: (event) => app.nextClip(event.shiftKey ? -1 : 1),
    "+": () => app.zoom(true), "=": () => app.zoom(true), "-": () => app.zoom(false), "[": () => app.changeLevel(-1), "]": () => app.changeLevel(1), a: () => app.setLevel("auto"),
    c: () => app.colour.next(), s: () => app.show.next(), d: () => app.compare.pick(app.compare.value === "off" ? "levels" : "off"),
    f: () => app.forestSwitch(!state.forest), r: app.resetView, p: app.picture, v: app.video, h: app.togglePanel, w: app.fullscreen, "?": () => $("keys").showModal(),
  };
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || app.plants.length === 0 || $("keys").open || isTaken(event)) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
  $("help").addEventListener("click", () => $("keys").showModal());
}
