/**
 * Meshes that `athcodec decode PLANT.ath BOUND.glb --onto MESH --bind` wrote, moved in three.js by the file of the plant.
 *
 *     import { AthFile, ready } from "athcodec-three/decoder";
 *     import { ATHBones } from "athcodec-three/gltf/bones";
 *
 *     await ready;
 *     const file = AthFile.open(bytes), segments = [file.prepare(0, file.info.levelCount - 1)];
 *     const bones = new ATHBones((await new GLTFLoader().loadAsync("bound.glb")).scene);
 *     // every frame
 *     bones.pose(file.positions(segments, file.frameAt(seconds, "loop")));
 *
 * Any number of meshes, such as levels of detail, move by one file: pose those that are shown.
 */
import type { Object3D } from "three";

export class ATHBones {
  /** scene: of a loaded GLB, or an object in it that has the bones and their meshes. Throws a TypeError where there are none. */
  constructor(scene: Object3D);
  /** Vertices of the plant, in the source's order, that the bones follow; of a slice of a surface one of its vertices. */
  readonly vertices: Int32Array;
  /** Moves the bones to where the plant is. positions: x, y, z of all vertices of the plant, in the source's order. */
  pose(positions: Float32Array | Float64Array): this;
}
