// The viewer: opens a file by ?file=URL, by dropping it, or one that the page itself carries, and plays it.

import { BufferGeometry, LineSegments, Mesh } from "three";
import { dataTexture, injectMotion, motionUniforms } from "athcodec-three";

import { write } from "./address.js";
import { app, counters, loader, state } from "./app.js";
import { reframe } from "./arrange.js";
import { begin, refuse } from "./files.js";
import { bakeForests, forests, updateForests } from "./floor.js";
import { limbMaterial } from "../src/limbs.js";
import { setSplit, splitLabels, tellLevel, tellScale } from "./look.js";
import { togglePanel } from "./panel.js";
import { lineMaterial, meshMaterial } from "./plant.js";
import { Stage } from "./stage.js";
import { markFirst, tellFacts } from "./story.js";
import { advance, tellTime } from "./time.js";
import { $ } from "./ui.js";
import { breeze } from "./wind.js";
import "./camera.js";
import "./keys.js";
import "./scripts.js";
import "./sharing.js";

const TELL_MS = 250, PATIENCE_MS = 2000;

let last = 0;

function setStage() {
  const stage = app.stage = new Stage($("canvas"), () => { state.dirty = true; }, reframe);
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
  if (state.playing) advance(passed);
  for (const { motion, root } of plants) {
    if (!state.forest) motion.update(stage.camera, stage.pixels, root).setTime(motion.start + state.time);
    else motion.setTime(motion.start);
  }
  if (state.forest) {
    bakeForests();
    state.dirty ||= forests().some(({ fading }) => fading);
    if (state.playing || state.dirty) updateForests(state.turns + state.time);
  }
  if (state.dirty || (state.playing && state.forest)) draw();
  count(now);
}

function draw() {
  state.dirty = false;
  const start = performance.now();
  app.stage.breeze(state.turns + state.time, ...breeze());
  app.stage.render();
  $("canvas").classList.add("drawn");
  if (app.plants.length > 0) markFirst();
  counters.frames++;
  counters.frameMs = counters.frameMs * 0.8 + 0.2 * (performance.now() - start);
}

function count(now) {
  const passed = now - counters.since;
  if (passed < TELL_MS) return;
  counters.fps = (counters.frames * 1000) / passed;
  Object.assign(counters, { frames: 0, since: now });
  for (const tell of [tellFacts, tellLevel, tellScale, tellTime, splitLabels, write]) tell();
}

const painted = () => new Promise((done) => { requestAnimationFrame(() => setTimeout(done)); });
const late = () => new Promise((done) => { setTimeout(done, PATIENCE_MS); });

// Setting the stage takes long without a graphics processor, and workers start and fetch only while the page does nothing.
async function setUp() {
  await Promise.race([Promise.all([painted(), app.coming]), late()]);
  try {
    setStage();
    setSplit(0.5);
    requestAnimationFrame(tick);
  } catch (error) {
    refuse(Object.assign(error, { codeName: "GRAPHICS" }));
  }
}

if (matchMedia("(max-width: 680px)").matches) togglePanel();
begin();
loader.preload();
app.staged = setUp();
