// A forest of one plant in the wind, on WebGPU. The address says what is shown: ?file=URL&count=10000; with &drawn=0 it is only
// computed, for measurements

import { ATHLoader } from "athcodec-three";
import { ATHForest } from "athcodec-three/webgpu";
import { Color, DirectionalLight, DoubleSide, Fog, HemisphereLight, Mesh, MeshStandardNodeMaterial, PerspectiveCamera, PlaneGeometry, Scene,
  WebGPURenderer } from "three/webgpu";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { foliage } from "./foliage.js";
import { radii } from "../src/radii.js";

const $ = (id) => document.getElementById(id), asked = new URLSearchParams(location.search);
const SKY = new Color(0xcfdde4), GROUND = 0x7c8a58, SPACING = 1.5; // of plants, in radii of one
const state = { frames: 0, milliseconds: 0, forest: null, ath: null, error: null };
window.athcodecForest = state;

const chance = (i, salt) => {
  const x = Math.sin(12.9898 * (i + 1) + 78.233 * salt) * 43758.5453;
  return x - Math.floor(x);
};

// Plants on a spiral, so that any number of them is round and even, a little off their places.
function planted(count, spacing, clips, flat) {
  return Array.from({ length: count }, (_, i) => {
    const away = spacing * 0.62 * Math.sqrt(i + 0.5), turn = 2.399963 * i + 0.25 * chance(i, 1), size = 0.7 + 0.6 * chance(i, 2);
    const x = away * Math.cos(turn), z = away * Math.sin(turn), tint = Math.floor(200 + 55 * chance(i, 3));
    return { ...flat(x, z), size, angle: 2 * Math.PI * chance(i, 4), seconds: 100 * chance(i, 5), clip: clips[i % clips.length].name,
      tint: (tint << 16) | (Math.floor(215 + 40 * chance(i, 6)) << 8) | 205 };
  });
}

async function start() {
  if (!navigator.gpu) throw new Error("This browser has no WebGPU");
  const renderer = new WebGPURenderer({ canvas: $("canvas"), antialias: true });
  await renderer.init();
  if (!renderer.backend.isWebGPUBackend) throw new Error("This browser gives no WebGPU device");
  const ath = await new ATHLoader().loadAsync(asked.get("file"));
  const isMesh = ath.hasFaces, upright = ath.metadata.up_axis === "z", { radius } = ath.sphere, spacing = SPACING * radius;
  const count = Number(asked.get("count") ?? 10000), isDrawn = asked.get("drawn") !== "0";
  const forest = new ATHForest(renderer, ath, {
    shape: isMesh ? undefined : foliage(ath, radii(ath)),
    material: () => new MeshStandardNodeMaterial({ color: isMesh ? 0x7f9a55 : 0xffffff, roughness: 0.85, side: DoubleSide }),
  });
  forest.setInstances(planted(count, spacing, ath.motion.clips, upright ? (x, z) => ({ x, y: -z, z: 0 }) : (x, z) => ({ x, y: 0, z })));
  const scene = new Scene(), camera = new PerspectiveCamera(40, 1, 0.02 * radius, 400 * radius), controls = new OrbitControls(camera, $("canvas"));
  const sun = new DirectionalLight(0xfff0d0, 2.6), wide = 260 * radius;
  const ground = new Mesh(new PlaneGeometry(4 * wide, 4 * wide), new MeshStandardNodeMaterial({ color: GROUND, roughness: 1 }));
  ground.rotation.x = -Math.PI / 2;
  if (upright) forest.rotation.x = -Math.PI / 2;
  sun.position.set(0.7, 1, 0.35);
  scene.background = SKY;
  scene.fog = new Fog(SKY, 12 * radius, wide * 0.6);
  scene.add(forest, ground, sun, new HemisphereLight(0xdcecff, 0x6f7048, 1.5));
  camera.position.set(3 * radius, 3.2 * radius, 9 * radius);
  controls.target.set(0, 0.9 * radius, 0);
  controls.maxPolarAngle = 0.49 * Math.PI;
  controls.maxDistance = 150 * radius;
  controls.enableDamping = true;
  Object.assign(state, { ath, forest, renderer, camera, controls, scene, time: null, playing: true });
  const blow = () => {
    const strength = Number($("strength").value), degrees = Number($("heading").value);
    $("strength-value").textContent = strength.toFixed(1);
    $("heading-value").textContent = `${degrees}°`;
    forest.wind(strength, degrees * Math.PI / 180);
  };
  for (const id of ["strength", "heading"]) $(id).addEventListener("input", blow);
  blow();
  const draw = (ms) => {
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
    forest.update(camera, height, state.time ?? ms / 1000);
    state.milliseconds = performance.now() - begun;
    if (isDrawn) renderer.render(scene, camera);
    state.frames++;
    if (state.frames % 20 === 0 && forest.levels.length > 0)
      $("status").textContent = `${count.toLocaleString("en")} plants, level ${forest.levels.length - 1}, ${(forest.bytesOfMotion / 1000).toFixed(0)} kB uploaded once`;
  };
  renderer.setAnimationLoop((ms) => { if (state.playing) draw(ms); });
  state.draw = draw;
}

start().catch((error) => {
  state.error = error.message;
  $("status").textContent = error.message;
  $("status").className = "wrong";
});
