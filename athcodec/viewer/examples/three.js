// A plant in three.js: its loader fetches, decodes in workers, and moves the vertices on the GPU.
import { ATHLoader } from "athcodec-three";

export async function addPlant(scene, url) {
  const ath = await new ATHLoader().loadAsync(url);
  scene.add(ath.object);
  const show = (seconds, camera, renderer) => ath.motion.update(camera, renderer.domElement.height, ath.object).setTime(seconds);
  return { ath, show };
}
