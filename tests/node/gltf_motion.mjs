// What plays ATH_motion shows: node gltf_motion.mjs three|babylon VIEWER FILE.glb TIMES.json OUT.bin [CLIP]
// OUT is float32, times by vertices by 3, in the world; VIEWER the folder of the package. It prints what else came of it.
import { readFileSync, writeFileSync } from "node:fs";
import { register } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

// The package finds its peers as if it were installed beside them.
const [engine, viewer, path, timesPath, out, wanted] = process.argv.slice(2), here = import.meta.url;
register(`data:text/javascript,${encodeURIComponent(`export const resolve = (name, context, next) =>
  /^(three|@babylonjs|@gltf-transform)/.test(name) ? next(name, { ...context, parentURL: ${JSON.stringify(here)} }) : next(name, context);`)}`);
const at = (name) => pathToFileURL(join(viewer, name)).href;

globalThis.self = globalThis;
const program = new Function("self", readFileSync(join(viewer, "web/ath_worker.js"), "utf8"));
globalThis.Worker = class {
  #scope = { postMessage: (message, transfer = []) => this.#hand(message, transfer, (event) => this.onmessage?.(event)) };

  constructor() {
    program(this.#scope);
  }

  #hand(message, transfer, to) {
    const data = structuredClone(message, { transfer });
    setImmediate(() => to({ data }));
  }

  postMessage(message, transfer = []) {
    this.#hand(message, transfer, (event) => this.#scope.onmessage(event));
  }

  terminate() {}
};

const data = new Uint8Array(readFileSync(path)), times = JSON.parse(readFileSync(timesPath)), warnings = [];
console.warn = (...words) => { if (!/^BJS/.test(words[0])) warnings.push(words.join(" ")); }; // Babylon's own are notes
console.error = () => {}; // textures, which Node cannot show
const shown = [], engines = {};

engines.three = async () => {
  const three = await import("three"), { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
  const { MeshoptDecoder } = await import("three/addons/libs/meshopt_decoder.module.js");
  const { ATHLoader } = await import(at("web/ATHLoader.js")), { athMotion } = await import(at("gltf/three.js"));
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).register(athMotion(new ATHLoader().setWorkerLimit(1)));
  const gltf = await loader.parseAsync(data.buffer, "");
  const [ath] = gltf.userData.ATH_motion ?? [], mixer = new three.AnimationMixer(gltf.scene), point = new three.Vector3();
  const clip = gltf.animations.find(({ name }) => !wanted || name === wanted);
  if (clip) Object.assign(mixer.clipAction(clip), { clampWhenFinished: true }).setLoop(three.LoopOnce).play();
  const camera = new three.PerspectiveCamera(), renderer = { getDrawingBufferSize: (size) => size.set(100, 100) };
  ath?.motion.setLevel("auto").setLevel(ath.motion.levelCount - 1);
  if (ath) await ath.loaded;
  const moved = [];
  gltf.scene.traverse((object) => { if (object.userData.ATH_motion) moved.push(object); });
  for (const time of times) {
    mixer.setTime(time);
    gltf.scene.updateMatrixWorld(true);
    for (const object of moved) object.onBeforeRender(renderer, gltf.scene, camera);
    if (ath) {
      ath.motion.setLevel(ath.motion.levelCount - 1);
      await ath.motion.show(ath.motion.time);
    }
    for (const object of moved) {
      const position = object.geometry.getAttribute("position");
      for (let i = 0; i < position.count; i++)
        shown.push(...point.fromBufferAttribute(position, i).applyMatrix4(object.matrixWorld));
    }
  }
  const every = [];
  gltf.scene.traverse((object) => { if (object.isMesh) every.push([object.type, Object.keys(object.geometry.attributes).sort(), object.material.isMaterial]); });
  return { meshes: every, moved: moved.length, animations: gltf.animations.map(({ name, duration }) => [name, duration]),
    clips: ath?.motion.clips.map(({ name }) => name) ?? null };
};

engines.babylon = async () => {
  const { NullEngine } = await import("@babylonjs/core/Engines/nullEngine.js"), { Scene } = await import("@babylonjs/core/scene.js");
  const { Vector3 } = await import("@babylonjs/core/Maths/math.vector.js"), { FreeCamera } = await import("@babylonjs/core/Cameras/freeCamera.js");
  const { ImportMeshAsync } = await import("@babylonjs/core/Loading/sceneLoader.js");
  await import("@babylonjs/loaders/glTF/index.js");
  await import(at("gltf/babylon.js"));
  const scene = new Scene(new NullEngine());
  scene.useRightHandedSystem = true;
  new FreeCamera("camera", Vector3.Zero(), scene);
  const loaded = await ImportMeshAsync(data, scene, { pluginExtension: ".glb" });
  const moved = loaded.meshes.filter((mesh) => mesh.metadata?.ATH_motion || mesh.sourceMesh?.metadata?.ATH_motion);
  const group = loaded.animationGroups.find(({ name }) => !wanted || name === wanted);
  for (const each of loaded.animationGroups) each.stop();
  group?.start(false, 1, 0, group.to);
  group?.pause();
  for (const time of times) {
    group?.goToFrame(time * 60);
    scene.render();
    for (const mesh of moved) {
      const positions = mesh.getVerticesData("position"), matrix = mesh.computeWorldMatrix(true);
      for (let i = 0; i < positions.length; i += 3) {
        const point = Vector3.TransformCoordinates(Vector3.FromArray(positions, i), matrix);
        shown.push(point.x, point.y, point.z);
      }
    }
  }
  return { moved: moved.length, skeletons: loaded.skeletons.length, animations: loaded.animationGroups.map(({ name, from, to }) => [name, from, to]) };
};

const facts = await engines[engine]();
writeFileSync(out, new Uint8Array(Float32Array.from(shown).buffer));
console.log(JSON.stringify({ ...facts, warnings }));
process.exit();
