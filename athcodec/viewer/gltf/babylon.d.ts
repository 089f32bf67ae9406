/**
 * ATH_motion for the glTF loader of Babylon.js.
 *
 *     import "@babylonjs/loaders/glTF";
 *     import "athcodec-three/gltf/babylon";
 *
 *     const { meshes, animationGroups } = await ImportMeshAsync("tree_motion.glb", scene);
 *     animationGroups.find(({ name }) => name === "storm").start(true);
 *
 * Each clip is an AnimationGroup of its name, or plays with the file's own group of that name. Vertices are decoded on the
 * page's own thread, at the frame that is shown. `mesh.metadata.ATH_motion` is the motion of a mesh. A motion that cannot be
 * played is told of by a warning: its meshes are as they were without the extension.
 */
import type { Clip } from "../ath_decoder.d.ts";

/** Lets glTF files that are loaded from now on play their motions. Importing the module has done so. */
export function registerATHMotion(): void;

export class ATHBabylonMotion {
  private constructor();
  readonly clips: readonly Clip[];
  readonly levelCount: number;
  /** The level to show, from 0 to levelCount - 1; the deepest by default. */
  level: number;
  /** The coarsest level whose error is at most `pixels` on a screen `height` pixels high, seen from `distance` (in the space
   * of the mesh) under a vertical field of view of `fov` radians. */
  levelFor(distance: number, fov: number, height: number, pixels?: number): number;
  /** Shows a clip, by its number or name, so many seconds after its first frame. Throws RangeError where there is no such clip,
   * AthError where its bytes are damaged. */
  setSeconds(seconds: number, clip?: number | string): this;
}
