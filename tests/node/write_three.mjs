// A scene that three.js animates in every way it has, written by its exporter: node write_three.mjs OUT.glb
import { writeFileSync } from "node:fs";

globalThis.self = globalThis;
globalThis.FileReader = class {
  async #read(blob, convert) { this.result = convert(await blob.arrayBuffer()); this.onloadend(); }
  readAsArrayBuffer(blob) { this.#read(blob, (bytes) => bytes); }
  readAsDataURL(blob) {
    this.#read(blob, (bytes) => "data:application/octet-stream;base64," + Buffer.from(bytes).toString("base64"));
  }
};
const THREE = await import("three");
const { GLTFExporter } = await import("three/addons/exporters/GLTFExporter.js");

const range = (count, call) => Array.from({ length: count }, (_, i) => call(i));
const stem = new THREE.CylinderGeometry(1, 0.6, 8, 7, 12);
const count = stem.attributes.position.count, joints = [], weights = [];
for (let i = 0; i < count; i++) {
  const along = (stem.attributes.position.getY(i) + 4) / 2, joint = Math.min(Math.floor(along), 3);
  joints.push(joint, joint + 1, 0, 0);
  weights.push(1 - (along - joint), along - joint, 0, 0);
}
stem.setAttribute("skinIndex", new THREE.Uint16BufferAttribute(joints, 4));
stem.setAttribute("skinWeight", new THREE.Float32BufferAttribute(weights, 4));
stem.morphAttributes.position = [1, 3].map((k) =>
  new THREE.Float32BufferAttribute(range(3 * count, (i) => Math.sin(k * i) / k), 3));
stem.morphTargetsRelative = true;
const bones = range(5, (i) => Object.assign(new THREE.Bone(), { name: `bone${i}` }));
bones.forEach((bone, i) => { bone.position.y = i ? 2 : -4; if (i) bones[i - 1].add(bone); });
const scene = new THREE.Scene();
const skinned = new THREE.SkinnedMesh(stem, new THREE.MeshStandardMaterial());
skinned.name = "stem";
skinned.add(bones[0]);
skinned.bind(new THREE.Skeleton(bones));
skinned.position.set(1, 2, 3);
skinned.rotation.z = 0.3;
scene.add(skinned);
const holder = new THREE.Group();
holder.scale.set(2, 1, 0.5);
holder.rotation.y = 0.7;
scene.add(holder);
const leaf = new THREE.Mesh(new THREE.PlaneGeometry(1, 2, 3, 3), new THREE.MeshStandardMaterial());
leaf.name = "leaf";
const twin = leaf.clone();
twin.name = "twin";
twin.position.x = 5;
holder.add(leaf, twin);

const times = range(25, (i) => i / 24), turn = new THREE.Quaternion(), angles = new THREE.Euler();
const turns = (phase) => times.flatMap((t) =>
  turn.setFromEuler(angles.set(Math.sin(3 * t + phase), Math.cos(2 * t), phase * t)).toArray());
const tracks = [
  ...bones.map((bone, i) => new THREE.QuaternionKeyframeTrack(`${bone.name}.quaternion`, times, turns(0.3 * i))),
  new THREE.NumberKeyframeTrack("stem.morphTargetInfluences", times, times.flatMap((t) => [Math.sin(t), 1 - t])),
  new THREE.VectorKeyframeTrack("leaf.position", [0, 0.25, 1], [0, 0, 0, 1, 2, 3, -1, 0, 2], THREE.InterpolateDiscrete),
  new THREE.VectorKeyframeTrack("twin.scale", [0, 0.5, 1], [1, 1, 1, 2, 1, 3, 1, 0.5, 2], THREE.InterpolateSmooth),
];
const animations = [new THREE.AnimationClip("sway", -1, tracks)];
const glb = await new Promise((done, failed) =>
  new GLTFExporter().parse(scene, done, failed, { binary: true, animations }));
writeFileSync(process.argv[2], new Uint8Array(glb));
