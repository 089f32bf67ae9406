// Where ATHBones puts a mesh: node bones.mjs VIEWER PLANT.ath BOUND.glb OUT.bin
// OUT is float32, frames by vertices by 3, in the world, of all frames of the plant. It prints how many bones there are, and what a pose
// allocates.
import { readFileSync, writeFileSync } from "node:fs";
import { register } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

// The package finds three.js as if it were installed beside it.
const [viewer, plant, bound, out] = process.argv.slice(2), here = import.meta.url;
register(`data:text/javascript,${encodeURIComponent(`export const resolve = (name, context, next) =>
  name.startsWith("three") ? next(name, { ...context, parentURL: ${JSON.stringify(here)} }) : next(name, context);`)}`);
const at = (name) => pathToFileURL(join(viewer, name)).href;

globalThis.self = globalThis;
const { Vector3 } = await import("three"), { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { AthFile, ready } = await import(at("ath_decoder.mjs")), { ATHBones } = await import(at("gltf/bones.js"));
await ready;
const file = AthFile.open(new Uint8Array(readFileSync(plant))), segments = [];
for (let i = 0; i < file.info.segmentCount; i++) segments.push(file.prepare(i, file.info.levelCount - 1));
const { scene } = await new GLTFLoader().parseAsync(new Uint8Array(readFileSync(bound)).buffer, "");
const bones = new ATHBones(scene), points = [], point = new Vector3();
for (let frame = 0; frame < file.info.frameCount; frame++) {
  bones.pose(file.positions(segments, frame));
  scene.updateMatrixWorld(true);
  const seen = new Set(); // Primitives of one mesh share their vertices.
  scene.traverse((object) => {
    const places = object.geometry?.getAttribute("position");
    if (!object.isSkinnedMesh || seen.has(places)) return;
    seen.add(places);
    object.skeleton.update();
    for (let vertex = 0; vertex < places.count; vertex++) {
      object.getVertexPosition(vertex, point).applyMatrix4(object.matrixWorld);
      points.push(...point);
    }
  });
}
writeFileSync(out, new Uint8Array(Float32Array.from(points).buffer));
// Bytes that a pose allocates once the engine has compiled it: the median, as rounds in which garbage is collected have fewer.
const last = file.positions(segments, file.info.frameCount - 1), rounds = [];
for (let round = 0; round < 40; round++) {
  const before = process.memoryUsage().heapUsed;
  for (let i = 0; i < 50; i++) bones.pose(last);
  rounds.push((process.memoryUsage().heapUsed - before) / 50);
}
const [allocated] = rounds.slice(20).sort((a, b) => a - b).slice(10);
console.log(JSON.stringify({ bones: bones.vertices.length, allocated }));
