// A forest of one plant in the wind, on WebGPU. The address says what is shown: ?file=URL&count=10000, and on its floor
// &floor=URL&each=4

import * as three from "three/webgpu";
import * as loading from "athcodec-three";
import { ATHLoader, radii } from "athcodec-three";
import { ATHForest } from "athcodec-three/webgpu";
import { ACESFilmicToneMapping, DoubleSide, MeshStandardNodeMaterial, PerspectiveCamera, Scene, WebGPURenderer } from "three/webgpu";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { chance } from "./chance.js";
import { foliage } from "./foliage.js";
import { Stage, SUN } from "./forest_stage.js";
import { forestMaterial } from "./forest_surfaces.js";
import { feet, floorOf, floorPlaces, forestReach, rooted, treePlaces } from "./places.js";
import { wordsOf } from "./trouble.js";

const $ = (id) => document.getElementById(id), asked = new URLSearchParams(location.search);
const COUNT = Number(asked.get("count") ?? 10000);
const SPREAD = 0.85; // How far plants are apart: see forestReach.
const SLOW_MS = 40, SLOW_FRAMES = 12; // After so many pictures as slow as this, less is drawn.
const state = { modules: { three, loading }, frames: 0, milliseconds: 0, forest: null, ath: null, error: null };
window.athcodecForest = state;

const tintOf = (i) => (Math.floor(200 + 55 * chance(i, 3)) << 16) | (Math.floor(215 + 40 * chance(i, 6)) << 8) | 205;

// How strong the clips' own winds are; null: they are not told apart.
function windsOf({ motion: { clips }, metadata }) {
  const strengths = clips.map(({ name }) => metadata.clips?.[name]?.strength).filter(Number.isFinite);
  const [calm, wild] = [Math.min(...strengths), Math.max(...strengths)];
  return wild > calm ? { calm, wild } : null;
}

// Plants between the trees that the address names.
function floors(renderer, trees, reach) {
  return Promise.all(floorOf(asked).map(async ({ source, each }, kind) => {
    const ath = await new ATHLoader().loadAsync(source), winds = windsOf(ath), { clips } = ath.motion;
    const material = () => forestMaterial(ath.metadata, SUN);
    const forest = new ATHForest(renderer, ath, { material }), clipOf = (i) => clips[winds ? 0 : i % clips.length].name;
    forest.setInstances(rooted(floorPlaces(trees, each, reach, kind), ath).map((place, i) => ({ ...place, clip: clipOf(i) })));
    return { forest, winds };
  }));
}

// The renderer, where the browser has WebGPU.
async function makeRenderer() {
  if (!await navigator.gpu?.requestAdapter()) return null;
  const renderer = new WebGPURenderer({ canvas: $("canvas"), antialias: true });
  return renderer.init().then(() => (renderer.backend.isWebGPUBackend ? renderer : null), () => null);
}

async function start() {
  const renderer = await makeRenderer();
  if (!renderer) {
    location.replace(`index.html${location.search}#forest=${COUNT}`); // the viewer, which draws forests on WebGL
    return;
  }
  const ath = await new ATHLoader().loadAsync(asked.get("file"));
  const isMesh = ath.hasFaces, { radius } = ath.sphere;
  const forest = new ATHForest(renderer, ath, {
    shape: isMesh ? undefined : foliage(ath, radii(ath)),
    material: () => (isMesh ? forestMaterial(ath.metadata, SUN) : new MeshStandardNodeMaterial({ roughness: 0.85, side: DoubleSide })),
  });
  const winds = windsOf(ath), { clips } = ath.motion;
  const kinds = winds ? 1 : clips.length, trees = treePlaces(ath, COUNT, forestReach(ath, COUNT, SPREAD))
    .map((place, i) => ({ ...place, clip: clips[i % kinds].name, tint: tintOf(i) }));
  forest.setInstances(trees);
  const floor = await floors(renderer, feet(trees, ath), 0.9 * radius);
  const scene = new Scene(), camera = new PerspectiveCamera(40, 1, 0.02 * radius, 400 * radius), controls = new OrbitControls(camera, $("canvas"));
  const stage = new Stage(scene, radius), isSoftware = /swiftshader|llvmpipe/i.test(renderer.backend.device.adapterInfo?.architecture ?? "");
  renderer.toneMapping = ACESFilmicToneMapping;
  renderer.shadowMap.enabled = true;
  stage.shadows = asked.get("quality") === "full" || !isSoftware;
  scene.add(forest, ...floor.map((each) => each.forest));
  camera.position.set(3 * radius, 2.4 * radius, 8 * radius);
  controls.target.set(0, 0.9 * radius, 0);
  controls.maxPolarAngle = 0.49 * Math.PI;
  controls.maxDistance = 150 * radius;
  controls.enableDamping = true;
  Object.assign(state, { ath, forest, floor: floor.map((each) => each.forest), renderer, camera, controls, scene, time: null, seconds: 0, playing: true });
  const moves = (on) => {
    state.moves = on;
    $("play").textContent = on ? "Pause" : "Play";
  };
  moves(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  $("play").addEventListener("click", () => moves(!state.moves));
  if (winds) Object.assign($("strength"), { min: winds.calm, max: winds.wild, step: (winds.wild - winds.calm) / 100, value: winds.wild });
  const blow = () => {
    const strength = Number($("strength").value), degrees = Number($("heading").value);
    $("strength-value").textContent = strength.toFixed(1);
    $("heading-value").textContent = `${degrees}°`;
    for (const { forest: each, winds: own } of [{ forest, winds }, ...floor]) {
      if (own) each.wind(winds ? strength : own.calm + 0.5 * strength * (own.wild - own.calm));
      each.sway(own || winds ? 1 : strength, degrees * Math.PI / 180);
    }
  };
  for (const id of ["strength", "heading"]) $(id).addEventListener("input", blow);
  blow();
  let before = null, slow = 0;
  // Shadows first, then fewer pixels, where pictures take long.
  const keepUp = (passed) => {
    slow = passed > SLOW_MS ? slow + 1 : 0;
    if (slow < SLOW_FRAMES || asked.get("quality") === "full") return;
    slow = 0;
    if (stage.sun.castShadow) stage.shadows = false;
    else renderer.setPixelRatio(1);
  };
  const draw = (ms) => {
    const passed = before === null ? 0 : ms - before;
    before = ms;
    keepUp(passed);
    stage.around(controls.target);
    const { clientWidth: width, clientHeight: height } = $("canvas");
    if (width !== state.width || height !== state.height) {
      Object.assign(state, { width, height });
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
    }
    controls.update();
    const begun = performance.now();
    if (state.moves) state.seconds += passed / 1000;
    for (const each of [forest, ...state.floor]) each.update(camera, height, state.time ?? state.seconds);
    state.milliseconds = performance.now() - begun;
    renderer.render(scene, camera);
    state.frames++;
  };
  const tell = () => {
    const kilobytes = [forest, ...state.floor].reduce((sum, { bytesOfMotion }) => sum + bytesOfMotion, 0) / 1000;
    $("status").textContent = `${COUNT.toLocaleString("en")} plants, ${Math.round(kilobytes).toLocaleString("en")} kB of motion on the graphics card`;
  };
  for (const each of [forest, ...state.floor]) each.addEventListener("level", tell);
  renderer.setAnimationLoop((ms) => { if (state.playing) draw(ms); });
  state.draw = draw;
}

start().catch((error) => {
  const { title, advice } = wordsOf(error.codeName);
  state.error = error.message;
  Object.assign($("status"), { textContent: error.codeName ? `${title}. ${advice}` : error.message, title: error.message, className: "wrong" });
  $("controls").hidden = true; // which would move nothing
});
