// Where three.js puts the vertices of a GLB: node play.mjs FILE.glb TIMES.json OUT.bin [ANIMATION]
// OUT is float32, times by vertices by 3, the meshes in the order of the scene.
import { readFileSync, writeFileSync } from "node:fs";

globalThis.self = globalThis;
const { AnimationMixer, LoopOnce, Matrix4, Vector3 } = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { MeshoptDecoder } = await import("three/addons/libs/meshopt_decoder.module.js");

const [path, timesPath, out, wanted] = process.argv.slice(2);
const times = JSON.parse(readFileSync(timesPath));
const data = new Uint8Array(readFileSync(path)).buffer;
console.error = () => {}; // textures, which Node cannot show
const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
const gltf = await new Promise((done, failed) => loader.parse(data, "", done, failed));
const mixer = new AnimationMixer(gltf.scene);
for (const clip of gltf.animations) {
  if (wanted && clip.name !== wanted) continue;
  const action = mixer.clipAction(clip);
  action.setLoop(LoopOnce);
  action.clampWhenFinished = true;
  action.play();
}
const meshes = [];
gltf.scene.traverse((each) => { if (each.isMesh) meshes.push(each); });
const placesOf = (mesh) => Array.from({ length: mesh.isInstancedMesh ? mesh.count : 1 }, (_, i) => {
  const matrix = new Matrix4();
  if (mesh.isInstancedMesh) mesh.getMatrixAt(i, matrix);
  return matrix.premultiply(mesh.matrixWorld);
});
const count = meshes.reduce((sum, mesh) => sum + mesh.geometry.attributes.position.count * (mesh.count ?? 1), 0);
const all = new Float32Array(times.length * count * 3);
const point = new Vector3();
let place = 0;
for (const time of times) {
  mixer.setTime(time);
  gltf.scene.updateMatrixWorld(true);
  for (const mesh of meshes) {
    if (mesh.isSkinnedMesh) mesh.skeleton.update();
    for (const matrix of placesOf(mesh)) {
      for (let i = 0; i < mesh.geometry.attributes.position.count; i++) {
        mesh.getVertexPosition(i, point).applyMatrix4(matrix).toArray(all, place); // by applyBoneTransform
        place += 3;
      }
    }
  }
}
writeFileSync(out, new Uint8Array(all.buffer));
console.log(JSON.stringify({ vertices: count, animations: gltf.animations.map((clip) => clip.name) }));
