// Time: what plays, how fast, and where the clip ends.

import { app, state } from "./app.js";
import { $ } from "./ui.js";

const SPEEDS = ["0.1", "0.25", "0.5", "1", "2", "4"];

const loops = () => app.plants.some(({ motion }) => motion.loops);

function setPlaying(playing) {
  if (playing && !loops() && state.time >= limit()) state.time = 0;
  state.playing = playing;
  document.body.classList.toggle("paused", !playing);
  $("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  state.dirty = true;
}

function seek(seconds) {
  state.time = Math.max(0, Math.min(seconds, limit()));
  state.dirty = true;
}

/** Where the clip ends: a loop has the way back to its first frame too. */
function limit() {
  return Math.max(...app.plants.map(({ motion }) => motion.duration), 0);
}

/** By frames; pauses. */
function step(frames) {
  setPlaying(false);
  const { lastTime, frameCount } = app.plants[0].motion.clip, rate = lastTime > 0 ? (frameCount - 1) / lastTime : 1;
  seek(Math.min((Math.round(state.time * rate) + frames) / rate, lastTime));
}

function toEnd() {
  setPlaying(false);
  seek(app.plants[0].motion.clip.lastTime);
}

function advance(seconds) {
  state.time += seconds * state.speed;
  const beyond = state.time - limit();
  if (beyond < 0) return;
  if (loops() && limit() > 0) {
    state.time %= limit();
    state.turns += beyond + limit() - state.time;
  } else if (!app.plants.some(({ motion }) => motion.switching)) {
    state.time = limit();
    setPlaying(false);
  }
}

function fromTheStart() {
  Object.assign(state, { time: 0, turns: 0 });
}

/** null: as is usual for the file. A forest always loops. */
function setLoop(loop) {
  state.loop = loop;
  for (const { motion } of app.plants) motion.wrap = state.forest || loop ? "loop" : loop === null ? motion.usualWrap : "clamp";
  $("loop").setAttribute("aria-pressed", String(loops()));
  $("loop").disabled = Boolean(state.forest);
}

function changeSpeed(by) {
  const at = SPEEDS.indexOf($("speed").value) + by;
  $("speed").value = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at))];
  state.speed = Number($("speed").value);
}

/** The slider and the clock as they are now. */
function tellTime() {
  const [{ motion }] = app.plants, slider = $("time"), end = limit();
  const time = motion.switching === "waiting" ? 0 : Math.min(state.time, end);
  slider.max = end;
  if (document.activeElement !== slider || state.playing) slider.value = time;
  slider.setAttribute("aria-valuetext", `${time.toFixed(2)} of ${end.toFixed(2)} seconds`);
  $("clock").value = `${time.toFixed(2)} s`;
}

export default function begin() {
  Object.assign(app, { setPlaying, seek, limit, step, toEnd, advance, fromTheStart, setLoop, changeSpeed, tellTime });
  $("play").addEventListener("click", () => setPlaying(!state.playing));
  $("loop").addEventListener("click", () => setLoop(!loops()));
  $("speed").addEventListener("change", () => { state.speed = Number($("speed").value); });
  $("time").addEventListener("input", () => seek(Number($("time").value)));
  $("time").addEventListener("keydown", (event) => {
    const frames = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
    if (!frames) return;
    event.preventDefault();
    step(event.shiftKey ? 10 * frames : frames);
  });
}
