// In a browser: draw(engine, url, seconds, box) gives the picture of a GLB at a time of its first animation, 4 numbers per
// pixel, from the front of a box or, where box.side is -1, from behind.
// Bundled by gltf_motion_bundle.mjs.
import * as three from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { Scene } from "@babylonjs/core/scene.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import "@babylonjs/loaders/glTF/index.js";
import { ATHLoader } from "viewer/web/ATHLoader.js";
import { athMotion } from "viewer/gltf/three.js";
import "viewer/gltf/babylon.js";

const SIZE = 256;

// A canvas of its own for each picture.
function canvas() {
  return Object.assign(document.createElement("canvas"), { width: SIZE, height: SIZE });
}

function pixels(from) {
  const flat = canvas().getContext("2d");
  flat.drawImage(from, 0, 0);
  return [...flat.getImageData(0, 0, SIZE, SIZE).data];
}

// Where the camera stands, so that a box is in the picture.
const stand = (box) => ({ centre: box.centre, away: 1.5 * Math.max(...box.size) * (box.side ?? 1) });

const engines = {
  async three(url, seconds, box) {
    const renderer = new three.WebGLRenderer({ canvas: canvas(), preserveDrawingBuffer: true });
    const gltf = await new GLTFLoader().register(athMotion(new ATHLoader().setDecoderPath("/viewer/web/"))).loadAsync(url);
    const scene = new three.Scene(), camera = new three.PerspectiveCamera(50, 1, 0.01, 1000), { centre, away } = stand(box);
    scene.add(gltf.scene, new three.HemisphereLight(0xffffff, 0x000000, 3));
    scene.background = new three.Color(0x4080c0);
    camera.position.set(centre[0], centre[1], centre[2] + away);
    camera.lookAt(...centre);
    const mixer = new three.AnimationMixer(gltf.scene);
    mixer.clipAction(gltf.animations[0]).play();
    mixer.setTime(seconds);
    for (const ath of gltf.userData.ATH_motion ?? []) {
      ath.motion.setLevel(ath.motion.levelCount - 1);
      ath.motion.fade = 0;
      await ath.loaded;
      renderer.render(scene, camera);
      await ath.motion.show(ath.motion.time);
    }
    renderer.render(scene, camera);
    return pixels(renderer.domElement);
  },

  async babylon(url, seconds, box) {
    const engine = new Engine(canvas(), false, { preserveDrawingBuffer: true }), scene = new Scene(engine), { centre, away } = stand(box);
    scene.useRightHandedSystem = true;
    const { animationGroups } = await ImportMeshAsync(url, scene);
    const camera = new FreeCamera("camera", new Vector3(centre[0], centre[1], centre[2] + away), scene);
    camera.setTarget(new Vector3(...centre));
    new HemisphericLight("light", Vector3.Up(), scene);
    for (const group of animationGroups) group.stop();
    animationGroups[0].start(false, 1, 0, animationGroups[0].to);
    animationGroups[0].pause();
    animationGroups[0].goToFrame(60 * seconds);
    await scene.whenReadyAsync();
    scene.render();
    return pixels(engine.getRenderingCanvas());
  },
};

globalThis.draw = (engine, url, seconds, box) => engines[engine](url, seconds, box);
