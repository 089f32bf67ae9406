// In a browser: engines[name](canvas, url, centre) draws the plant of an example, at many times, and resolves to a player:
// { play(seconds, distance): {level, wanted, positions, source, ms}, picture(): numbers of the canvas }. Bundled by engines_bundle.mjs.
import * as pc from "playcanvas";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { Scene } from "@babylonjs/core/scene.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { Color3 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { addPlant } from "athcodec-three/examples/babylon.js";
import { AthPlant } from "athcodec-three/examples/playcanvas.js";

const FOV = 0.8, packed = (values) => btoa(Array.from(new Uint8Array(values.buffer), (byte) => String.fromCharCode(byte)).join(""));
const SLOWEST = 60_000, PLACES = [[0, 0, 0], [6, 0, -4]];
const frame = () => new Promise((done) => requestAnimationFrame(done));

// Draws until the wanted level of a time is shown, then measures one drawing of it.
function player(canvas, { draw, level, wanted, positions, plant }) {
  const context = canvas.getContext("webgl2");
  return {
    async play(seconds, distance) {
      const began = performance.now();
      do {
        await frame();
        draw(seconds, distance);
        if (performance.now() - began > SLOWEST) throw new Error(`got level ${level()} at ${distance}, expected ${wanted(distance)}`);
      } while (level() !== wanted(distance));
      const start = performance.now();
      draw(seconds, distance);
      context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4)); // waits for the card
      const ms = performance.now() - start;
      const at = Float32Array.from(positions(), (value, i) => value + plant().origin[i % 3]);
      return { level: level(), positions: packed(at), source: packed(plant().mesh.source), ms };
    },
    picture(seconds, distance) {
      draw(seconds, distance);
      return canvas.toDataURL("image/png");
    },
  };
}

const wantedOf = ({ file, origin: [x, y, z], clip = file.clips[0] }, canvas, distance, height) =>
  file.levelFor(Math.hypot(x, y - height, z - distance), FOV, canvas.height, 1, clip.firstSegment, clip.firstSegment + clip.segmentCount - 1, "p99");

export const engines = {
  async playcanvas(canvas, url, height) {
    const app = new pc.Application(canvas, { graphicsDeviceOptions: { antialias: false, preserveDrawingBuffer: true } });
    const [camera, light, tree] = ["camera", "light", "tree"].map((name) => new pc.Entity(name));
    camera.addComponent("camera", { fov: FOV * pc.math.RAD_TO_DEG, clearColor: new pc.Color(0.25, 0.5, 0.75) });
    light.addComponent("light", { type: "directional", intensity: 1.5 });
    light.setEulerAngles(40, 30, 0);
    tree.addComponent("script");
    for (const each of [camera, light, tree]) app.root.addChild(each);
    app.scene.ambientLight = new pc.Color(0.4, 0.4, 0.4);
    app.timeScale = 0;
    const script = tree.script.create(AthPlant, { properties: { url, camera, budget: 50 } });
    app.start();
    while (!script.object) await frame();
    return player(canvas, {
      draw(seconds, distance) {
        camera.setPosition(0, height, distance);
        camera.lookAt(0, height, 0);
        script.seconds = seconds;
        app.update(0);
        app.render();
      },
      level: () => script.shown?.level ?? -1,
      wanted: (distance) => wantedOf(script.plant, canvas, distance, height),
      positions: () => { const out = []; script.mesh.getPositions(out); return out; },
      plant: () => script.plant,
    });
  },

  async babylon(canvas, url, height) {
    const engine = new Engine(canvas, false, { preserveDrawingBuffer: true }), scene = new Scene(engine);
    scene.useRightHandedSystem = true;
    scene.clearColor.set(0.25, 0.5, 0.75, 1);
    const camera = new FreeCamera("camera", new Vector3(0, height, 20), scene);
    camera.fov = FOV;
    new HemisphericLight("light", new Vector3(0.3, 1, 0.5), scene);
    const { plant, mesh, show } = await addPlant(scene, url, { places: PLACES.map((place) => new Vector3(...place)), budget: 50 });
    const material = mesh.material = new StandardMaterial("leaves", scene);
    material.backFaceCulling = false;
    material.twoSidedLighting = true;
    material.specularColor = Color3.Black();
    let shown = null;
    return player(canvas, {
      draw(seconds, distance) {
        camera.position.set(0, height, distance);
        camera.setTarget(new Vector3(0, height, 0));
        camera.computeWorldMatrix(true);
        shown = show(seconds);
        scene.render();
      },
      level: () => shown?.level ?? -1,
      wanted: (distance) => wantedOf(plant, canvas, distance, height),
      positions: () => mesh.getVerticesData("position"),
      plant: () => plant,
    });
  },
};

globalThis.engines = engines;
