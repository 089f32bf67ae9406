/**
 * athcodec-three/webgpu: forests for WebGPURenderer. A segment is uploaded once; compute passes place the plants of every frame,
 * one of each clip and phase, and choose which shape each instance is drawn with.
 *
 *     const renderer = new WebGPURenderer();
 *     await renderer.init();
 *     const ath = await new ATHLoader().loadAsync("tree.ath");
 *     const forest = new ATHForest(renderer, ath);
 *     forest.setInstances([{ x: 0, y: 0, z: 0 }, { x: 4, y: 0, z: 1, size: 1.3, angle: 2, seconds: 1.5 }]);
 *     scene.add(forest);
 *     // every frame: forest.update(camera, height, seconds), then renderer.render(scene, camera)
 */

import { BufferGeometry, Camera, Group, Material } from "three";
import { ATH } from "athcodec-three";

export interface ForestInstance {
  x: number;
  y: number;
  z: number;
  /** 1 by default. */
  size?: number;
  /** Radians about the axis that is up. */
  angle?: number;
  /** How far ahead it is, to the next of the forest's phases. */
  seconds?: number;
  /** Name or number of its clip; by default that which the motion plays. */
  clip?: string | number;
  /** A colour, such as 0xffeecc, that its material's is multiplied by. */
  tint?: number;
  /** How many times as far as in the file everything is from the rest pose; 1 by default, 0: it stands still. Above 1 lengths grow. */
  amplitude?: number;
}

export class ATHForest extends Group {
  /** renderer: a WebGPURenderer on which init() has been awaited. shape: what is drawn in place of the geometry and of each of
   * its simplifications; an attribute "athOffset" of it is added to positions, and `userData.vertices` says the vertex of each. */
  constructor(renderer: object, ath: ATH, options?: {
    geometry?: BufferGeometry;
    material?: (isLines: boolean, level: number) => Material;
    shape?: (simple: BufferGeometry, tolerance: number) => BufferGeometry;
  });
  /** Error on the screen that a level may have, 1 by default. */
  pixels: number;
  measure: "max" | "p99" | "rms";
  /** In which instances of a clip can be, evenly over its time (default 8): set before setInstances(). */
  phases: number;
  readonly count: number;
  /** Plants that are computed: one of each clip and phase in use. */
  readonly plantCount: number;
  /** For each of them: the name of its clip and its phase, 0 to 1 of the clip. */
  readonly plants: [string, number][];
  /** Names of the clips that are shown, or will be once they are here. */
  readonly clips: string[];
  /** On the GPU, but for shapes. */
  readonly bytes: number;
  /** Uploaded so far: levels and segments, each once. */
  readonly bytesOfMotion: number;
  /** Uploaded so far: which frames are shown, and the view. */
  readonly bytesOfParameters: number;
  setInstances(instances: ForestInstance[]): this;
  /** Seconds in which two thirds of a change of weights have happened (default 0.2); 0: at once. */
  ease: number;
  /** Shows a weighted blend of these clips in place of each instance's own. The card blends them before it places branches, which
   * therefore stay attached and keep their lengths. null: each instance shows its own clip again. A clip takes part as soon as its
   * bytes have arrived. Throws RangeError if a clip does not exist or no weight is above 0. */
  blend(weights: Record<string, number> | null): this;
  /** Blends up to four clips for a wind: those whose own strength and heading (metadata "strength" and "heading", degrees) are
   * nearest, as ATHMotion.wind() does. Where no clip names a wind, the first is shown. Rejects with RangeError where a number is
   * not finite. */
  wind(strength: number, heading?: number): Promise<this>;
  /** strength: that motion is multiplied by, 1: as in the file. heading: how far about the axis that is up the motion is turned from
   * the file's own, radians, whatever the angle of an instance; null (default): each blows as it is turned itself. A turned motion
   * keeps no lengths where it is large. */
  sway(strength: number, heading?: number | null): this;
  /** Shows `seconds`: to be called once per frame, before rendering. height: the screen's, in pixels. */
  update(camera: Camera, height: number, seconds: number): void;
  /** Instances drawn by the last update(), by level: read back. */
  drawn(): Promise<number[]>;
  /** Vertices of all plants at a level, in file order: position, normal and previous position, read back. */
  vertices(level: number): Promise<Float32Array>;
  dispose(): void;
}
