// The viewer: opens a file by ?file=URL, by dropping it, or one that the page itself carries, and plays it.

import { BufferGeometry, LineSegments, Mesh } from "three";
import { dataTexture, injectMotion, limbMaterial, motionUniforms } from "athcodec-three";

import address from "./address.js";
import { app, counters, loader, state } from "./app.js";
import arrange from "./arrange.js";
import clips from "./clips.js";
import files from "./files.js";
import intro from "./intro.js";
import look from "./look.js";
import panel from "./panel.js";
import { lineMaterial, meshMaterial } from "./plant.js";
import scripts from "./scripts.js";
import { Stage } from "./stage.js";
import story from "./story.js";
import time from "./time.js";
import { $, note } from "./ui.js";
import wind from "./wind.js";

const TELL_MS = 250, PATIENCE_MS = 2000;

let last = 0;

function setStage() {
  const stage = app.stage = new Stage($("canvas"), () => { state.dirty = true; }, app.reframe);
  stage.keepClear(document.querySelectorAll("header, nav, #panel, footer, #scale"), document.querySelector("footer"));
  const unmoved = motionUniforms();
  unmoved.athData.value = dataTexture(new Float32Array(4096));
  stage.warm([new Mesh(new BufferGeometry(), limbMaterial(unmoved)), new Mesh(new BufferGeometry(), injectMotion(meshMaterial(), unmoved)),
    new LineSegments(new BufferGeometry(), injectMotion(lineMaterial(), unmoved))]);
}

function tick(now) {
  requestAnimationFrame(tick);
  const passed = Math.min(1, (now - last) / 1000), { stage, plants } = app; // a page that was hidden goes on from where it was
  last = now;
  if (state.playing && plants.length > 0) stage.took(1000 * passed);
  if (plants.length === 0) {
    if (state.dirty && stage.panes.length > 0) draw();
    return;
  }
  stage.controls.update();
  if (state.playing) app.advance(passed);
  for (const { ath: { others = [] }, motion, space } of plants) {
    for (const other of others) other.motion.update(stage.camera, stage.pixels, space).setTime(other.motion.start + state.time);
    if (!state.forest) motion.update(stage.camera, stage.pixels, space).setTime(motion.start + state.time);
    else motion.setTime(motion.start);
  }
  if (state.forest) {
    app.bakeForests();
    state.dirty ||= app.forests().some(({ fading }) => fading);
    if (state.playing || state.dirty) app.updateForests(state.turns + state.time);
  }
  if (state.dirty || (state.playing && state.forest)) draw();
  count(now);
}

function draw() {
  state.dirty = false;
  const start = performance.now();
  app.stage.breeze(state.turns + state.time, ...app.breeze());
  app.stage.render();
  $("canvas").classList.add("drawn");
  if (app.plants.length > 0) app.markFirst();
  if (counters.firstPicture) complete();
  counters.frames++;
  counters.frameMs = counters.frameMs * 0.8 + 0.2 * (performance.now() - start);
}

function count(now) {
  const passed = now - counters.since;
  if (passed < TELL_MS) return;
  counters.fps = (counters.frames * 1000) / passed;
  Object.assign(counters, { frames: 0, since: now });
  for (const tell of [app.tellFacts, app.tellLevel, app.tellScale, app.tellTime, app.splitLabels, app.write]) tell();
}

const complete = () => app.later().catch(() => note("Parts of this page cannot be fetched. Load it again."));

const painted = () => new Promise((done) => { requestAnimationFrame(() => setTimeout(done)); });
const late = () => new Promise((done) => { setTimeout(done, PATIENCE_MS); });

// Setting the stage takes long without a graphics processor, and workers start and fetch only while the page does nothing.
async function setUp() {
  await Promise.race([Promise.all([painted(), app.coming]), late()]);
  try {
    setStage();
    app.setSplit(0.5);
    requestAnimationFrame(tick);
  } catch (error) {
    app.refuse(Object.assign(error, { codeName: "GRAPHICS" }));
  }
}

let rest = null;

/** Fetches what the first picture does not need, once; resolves when it can be used. */
app.later = () => rest ??= import("./later.js").then(({ begin }) => begin());

for (const begin of [address, arrange, clips, files, intro, look, panel, story, time, wind, scripts]) begin();
if (matchMedia("(prefers-reduced-motion: reduce)").matches) app.setPlaying(false);
app.openAddress();
loader.preload();
app.staged = setUp();
late().then(complete); // a file may never come
