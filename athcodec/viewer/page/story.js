// The page's account of the file: how small it is, how much of it is here, and how that looks.

import { app, counters, main, state } from "./app.js";
import { $, bytesText, countText, detailText, lengthText, paintReady, rateText, rows } from "./ui.js";

const SHAPES = 0x13, REFINED_REST = 0x15, NO_LEVEL = 255; // chunks that are of no clip alone
const SOURCE_REST = 0x21; // which nothing that is shown needs
const FLOAT3 = 12; // bytes of a position as float32

let bandwidth = null; // Bits per second of the loading that is played again.

function describe() {
  const [ath] = app.opened, { info, clips } = ath.motion, counts = [...new Set(clips.map((clip) => clip.frameCount))];
  const frames = clips.length > 1 && counts.length === 1 ? `${countText(counts[0])} frames each` : `${countText(info.frameCount)} frames`;
  $("name").textContent = app.opened.map((each) => each.fileName).join("  ·  ");
  document.title = `${ath.fileName} – athcodec`;
  $("summary").textContent = [`${countText(info.vertexCount)} points`, `${countText(info.branchCount)} branches`,
    clips.length > 1 ? `${clips.length} clips, ${frames}` : frames].join(", ");
}

/** How much smaller the file is than the positions of its source. */
function tellSizes() {
  const { info } = app.opened[0].motion, source = info.vertexCount * info.frameCount * FLOAT3, times = source / info.fileLength;
  $("source-size").textContent = bytesText(source);
  $("file-size").textContent = bytesText(info.fileLength);
  $("times").textContent = `${times < 10 ? times.toFixed(1) : countText(Math.round(times))} times smaller`;
  $("sizes").title = `${countText(info.vertexCount)} points × ${countText(info.frameCount)} frames × ${FLOAT3} bytes of float32, `
    + `against the whole file of ${countText(info.fileLength)} bytes`;
  $("sizes").hidden = $("replay").hidden = false;
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

/** Returns how many bytes of the file the clip that plays can need. */
function needed({ channel }, { clip, bytesTotal }) {
  const end = clip.firstSegment + clip.segmentCount;
  const others = channel.chunks.filter(({ kind, level, segment }) => kind === SOURCE_REST || (!state.wind && level !== NO_LEVEL
    && kind !== SHAPES && kind !== REFINED_REST && (segment < clip.firstSegment || segment >= end)));
  return others.reduce((sum, { length }) => sum - length, bytesTotal);
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
  const { ath, motion } = main(), wanted = needed(ath, motion), { bytesFetched, bytesTotal } = motion;
  const share = Math.min(1, bytesFetched / wanted), shown = Math.max(motion.level, 0), { first, whole } = counters.arrived;
  const bar = $("progress"), settled = motion.level >= motion.target || motion.failure;
  bar.firstElementChild.style.width = `${100 * share}%`;
  bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
  bar.setAttribute("aria-valuetext", `${bytesText(bytesFetched)} of ${bytesText(wanted)}`);
  const here = bytesFetched >= bytesTotal ? "All here" : whole ? `${bytesText(bytesFetched)}, all this clip needs` : `${bytesText(bytesFetched)} here`;
  $("arrived").textContent = `${here}: ${detailText(motion, shown)}, error up to ${app.within(main(), shown)}${settled ? "" : ", sharpening…"}`;
  $("timing").hidden = !bandwidth;
  $("timing").textContent = `First picture after ${seconds(first)}${whole ? `, full detail after ${seconds(whole)}` : ""}`;
}

function tellFacts() {
  const { motion, ath } = main(), { unit } = ath.metadata, shown = Math.max(motion.level, 0);
  rows($("facts"), [
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
