// The page's account of the file: how small it is, how much of it is here, and how that looks.

import { app, counters, main, state } from "./app.js";
import { $, bytesText, countText, lengthText, paintReady, rateText, rows, shortLength } from "./ui.js";

const FLOAT3 = 12; // bytes of a position as float32
const JOINT = 28; // bytes of a rotation and a translation as float32, as a GLB has them for each joint and frame

let bandwidth = null; // Bits per second of the loading that is played again.

function describe() {
  const [ath] = app.opened;
  $("name").textContent = app.opened.map((each) => each.fileName).join("  ·  ");
  document.title = `${ath.fileName} – athcodec`;
}

/** What the file holds and how small it is, in one sentence of figures that are all of the whole file. */
function tellSizes() {
  const { metadata, motion: { info, clips, levelCount } } = app.opened[0], seconds = clips.reduce((sum, { duration }) => sum + duration, 0);
  const error = Math.max(...clips.map(({ errors }) => errors[levelCount - 1].max));
  const points = `${countText(info.vertexCount)} ${info.vertexCount === 1 ? "point" : "points"}`;
  $("what").textContent = `A plant's motion${levelCount > 1 ? ", streamed in levels" : ""}`;
  $("extent").textContent = `${Number(seconds.toPrecision(2))} s, ${points}, within ${shortLength(error, metadata.unit)} of the source`;
  $("file-size").textContent = bytesText(info.fileLength);
  const others = [[info.vertexCount * FLOAT3, "uncompressed"], [info.branchCount * JOINT, "as GLB"]].map(([each, name]) => [info.frameCount * each, name]);
  const larger = others.filter(([bytes]) => bytes > info.fileLength);
  $("instead").replaceChildren(...larger.map(([bytes, name], i) => Object.assign(document.createElement("li"), { textContent: `${i ? "or" : "instead of"} ${bytesText(bytes)} ${name}` })));
  $("sizes").title = `The whole file: ${countText(info.fileLength)} bytes. Uncompressed, as float32: ${countText(info.vertexCount)} points × ${countText(info.frameCount)} frames × ${FLOAT3} bytes. `
    + `GLB: a rotation and a translation of a joint for each of ${countText(info.branchCount)} branches × ${countText(info.frameCount)} frames × ${JOINT} bytes, before its meshes`;
  $("sizes").hidden = $("levels").hidden = $("replay").hidden = false;
}

/** From now on this file is loading; null: none is. */
function loadingStory(name) {
  document.body.classList.toggle("loading", name !== null);
  if (app.opened.length === 0) $("name").textContent = name ?? "athcodec";
  $("story").hidden = name === null && app.opened.length === 0;
  $("arrived").textContent = name === null ? "" : "Loading…";
}

function replayed(bits) {
  bandwidth = bits;
  for (const button of $("replay").querySelectorAll("button")) button.setAttribute("aria-pressed", String(1e6 * button.dataset.mbit === bits));
}

/** When the first picture was drawn, and the first that differs from it. */
function markFirst() {
  const { motion } = main();
  if (motion.level < 0 || counters.firstMotion) return;
  const now = { ms: performance.now() - counters.started, bytes: motion.bytesFetched, frame: motion.frame };
  if (!counters.firstPicture) document.body.classList.remove("loading");
  counters.firstPicture ??= now;
  if (motion.frame !== counters.firstPicture.frame) counters.firstMotion = now;
}

/** From now on it is told when the bytes of a file have come; the first picture is decoded. Drawing it takes time of its own. */
function watchArrival({ motion, channel }) {
  const now = () => channel.sent - counters.started;
  const whole = () => { if (motion.complete) counters.arrived.whole ??= now(); };
  counters.arrived = { first: (channel.decodedAt ?? channel.sent) - counters.started };
  motion.addEventListener("ready", whole);
  whole();
}

const seconds = (ms) => `${(ms / 1000).toFixed(ms < 9950 ? 1 : 0)} s`;

function tellArrived() {
  const { bytesFetched, bytesTotal, complete } = main().motion; // complete without the other clips, too
  const share = complete ? 1 : bytesFetched / bytesTotal, { first, whole } = counters.arrived, bar = $("progress");
  bar.firstElementChild.style.width = `${100 * share}%`;
  bar.classList.toggle("full", share === 1);
  bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
  bar.setAttribute("aria-valuetext", `${bytesText(bytesFetched)} of ${bytesText(bytesTotal)}`);
  $("timing").hidden = !bandwidth;
  $("timing").textContent = `First picture after ${seconds(first)}${whole ? `, full detail after ${seconds(whole)}` : ""}`;
}

function tellFacts() {
  const { motion, ath } = main(), { unit } = ath.metadata, shown = Math.max(motion.level, 0);
  rows($("facts"), [
    ["Points, branches", `${countText(motion.info.vertexCount)}, ${countText(motion.info.branchCount)}`],
    ["Clips, frames", `${motion.clips.length}, ${countText(motion.info.frameCount)}`],
    ["Fetched", `${bytesText(motion.bytesFetched)} of ${bytesText(motion.bytesTotal)}`],
    ["Motion as shown", `${rateText(motion.bitRate(shown))}`],
    ["Detail", `${shown} of ${motion.levelCount - 1}: ${motion.levelName(shown)}`],
    ["Error up to", app.within(main(), shown)],
    ...(motion.clip.loop ? [["Loop seam", lengthText(motion.seamError(shown), unit)]] : []),
    ["Decoding", `${motion.milliseconds.toFixed(1)} ms`],
    ["Frames", `${counters.fps.toFixed(0)} per second`],
    ["Points drawn", countText((state.forest ? app.forests() : app.plants).reduce((sum, { vertices }) => sum + vertices, 0))],
  ]);
  tellArrived();
  paintReady($("ready"), [...motion.readyLevels], motion.levelCount);
  if (state.forest) app.forestBars();
}

export default function begin() {
  Object.assign(app, { describe, tellSizes, loadingStory, replayed, markFirst, watchArrival, tellFacts });
  $("replay").addEventListener("click", ({ target }) => {
    const button = target.closest("button");
    if (button && app.opened.length > 0) app.loadAgain(1e6 * button.dataset.mbit);
  });
}
