// As engines_page.mjs, with the example for three.js.
import * as three from "three";
import { addPlant } from "athcodec-three/examples/three.js";

const packed = (values) => btoa(Array.from(new Uint8Array(values.buffer), (byte) => String.fromCharCode(byte)).join(""));
const FOV = 0.8, SLOWEST = 60_000, frame = () => new Promise((done) => requestAnimationFrame(done));
globalThis.engines = {
  async three(canvas, url, height) {
    const renderer = new three.WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true }), scene = new three.Scene();
    renderer.setSize(canvas.width, canvas.height, false);
    const camera = new three.PerspectiveCamera(FOV * 180 / Math.PI, canvas.width / canvas.height, 0.1, 1000);
    scene.background = new three.Color(0x4080c0);
    scene.add(new three.HemisphereLight(0xffffff, 0x404040, 3));
    const { ath, show } = await addPlant(scene, url), { motion } = ath;
    await ath.loaded;
    motion.fade = 0;
    const draw = (seconds, distance) => {
      camera.position.set(0, height, distance);
      camera.lookAt(0, height, 0);
      camera.updateMatrixWorld();
      show(seconds, camera, renderer);
      renderer.render(scene, camera);
    };
    return {
      async play(seconds, distance) {
        const began = performance.now();
        do {
          await frame();
          draw(seconds, distance);
          if (performance.now() - began > SLOWEST) throw new Error(`got level ${motion.level} at ${distance}`);
        } while (motion.level !== motion.levelFor(camera, canvas.height, ath.object.matrixWorld));
        await motion.show(seconds, motion.level);
        const start = performance.now(), context = renderer.getContext();
        draw(seconds, distance);
        context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));
        const ms = performance.now() - start, positions = motion.uploaded();
        const source = Uint32Array.from({ length: positions.length / 3 }, (_, i) => i);
        return { level: motion.level, positions: packed(positions), source: packed(source), ms };
      },
      picture(seconds, distance) {
        draw(seconds, distance);
        return canvas.toDataURL("image/png");
      },
    };
  },
};
