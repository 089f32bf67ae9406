/**
 * athcodec-three: plays .ath files, the motion of plants with levels of detail, in three.js.
 *
 *     import { ATHLoader } from "athcodec-three";
 *
 *     const loader = new ATHLoader();
 *     const ath = await loader.loadAsync("tree.ath"); // resolves at the first picture; the rest goes on arriving
 *     scene.add(ath.object);
 *     renderer.setAnimationLoop((ms) => {
 *       ath.motion.update(camera, renderer.domElement.height, ath.object).setTime(ms / 1000);
 *       renderer.render(scene, camera);
 *     });
 *
 * A file holds one clip or several of one plant: `ath.motion.clips`, `ath.motion.play("storm", { fade: 0.5 })`.
 *
 * Files are fetched by HTTP ranges, level by level and ahead of the time that is shown, as deep as is asked for, and only
 * the clips that play; from a server without ranges in one download, which plays while it grows. Workers decode (ath_worker.js, beside the module).
 * Levels and errors are those of the file; positions are in its units, `metadata.unit`, and its axes,
 * `metadata.up_axis`; nothing is scaled or turned. Materials work with WebGLRenderer and, as `object`, WebGPURenderer; for others see setMode().
 */

import {
  Box3, BufferGeometry, Camera, ColorRepresentation, DataTexture, EventDispatcher, Group, IUniform, Loader, LoadingManager, Material,
  Matrix4, Mesh, MeshStandardMaterial, Object3D, Sphere,
} from "three";

export class ATHLoader extends Loader<ATH> {
  constructor(manager?: LoadingManager);
  /** Folder (ending in "/") or URL of ath_worker.js, if it is not beside this module. */
  setDecoderPath(path: string): this;
  /** At most so many workers (default 4); a file lives in one of them. */
  setWorkerLimit(limit: number): this;
  /** How vertices move: "matrices" (default) in the vertex shader, by textures; "positions" in the worker, by position
   * attributes that every picture writes, for materials without onBeforeCompile; so do objects of bindShadows() that a WebGPURenderer
   * draws. */
  setMode(mode: "matrices" | "positions"): this;
  /** The name of the clip to begin with (default, and null: the file's first). Loading fails where a file has none of
   * that name. */
  setClip(name: string | null): this;
  /** The mesh that is the rest pose of files that do not hold one (`athcodec encode --rest host`): its positions as
   * they were in the source, bit for bit and in that order, or a geometry that has them, as GLTFLoader gives it. Without it
   * such a file fails with the codeName "NEEDS_HOST_MESH", with another mesh "WRONG_HOST_MESH"; other files pass it over. */
  setHostMesh(mesh: Float32Array | BufferGeometry | null): this;
  /** Bits a second at which bytes of files that are loaded from now on come at most, from memory too, as over a slow line
   * (default null: as fast as they do). To show how a file loads, not to share a line: a range is fetched at once, and passed on slowly. */
  setBandwidth(bandwidth: number | null): this;
  /** Starts a worker before there is a file for it. */
  preload(): this;
  /** onLoad: at the first picture. onProgress: {loaded, total} bytes, as long as bytes come. */
  load(url: string, onLoad: (ath: ATH) => void, onProgress?: (event: ProgressEvent) => void,
       onError?: (error: unknown) => void): void;
  loadAsync(url: string, onProgress?: (event: ProgressEvent) => void): Promise<ATH>;
  /** Opens a whole file in memory, or the front of one: a buffer, shared or not, or any view of one. It stays as it is. */
  parse(buffer: ArrayBufferLike | ArrayBufferView, onLoad: (ath: ATH) => void, onError?: (error: unknown) => void): void;
  parseAsync(buffer: ArrayBufferLike | ArrayBufferView): Promise<ATH>;
  /** Ends all downloads of this loader, as `abort()` of its manager does. What has no picture yet fails, "AbortError"; all else
   * plays what is here. */
  abort(): this;
  /** Ends all workers. */
  dispose(): this;
}

/** The fault of a file or of its way here. */
export interface ATHFailure extends Error {
  /** A name of FORMAT.md, "Errors", "MISSING" where the file ends too early, or "HTTP", "NETWORK", "CHANGED", "WORKER", "CLIP",
   * "AbortError" after abort(), "CLOSED" after dispose(). */
  readonly codeName: string;
}

export interface StaticArray {
  /** A typed array of the source's type. */
  readonly array: ArrayLike<number | bigint>;
  readonly shape: number[];
}

/** A loaded file. Event: "arrays", when what is stored behind the motion is here (uv, normals, colors, radius, polygons of
 * different sizes); `geometry` has them from then on. */
export class ATH extends EventDispatcher<{ arrays: {} }> {
  readonly motion: ATHMotion;
  readonly metadata: { unit?: string; up_axis?: "x" | "y" | "z"; fps?: number; [name: string]: unknown };
  /** Named arrays, {} until they are here. */
  readonly attributes: Record<string, StaticArray>;
  /** Resolves with `attributes`. */
  readonly arrays: Promise<Record<string, StaticArray>>;
  /** A Mesh of the faces, or LineSegments where there are none, that casts and receives shadows; with materials that can be replaced
   * by bound ones. It is turned so that y is up where `metadata.up_axis` is another axis. Its clones are other plants in the same
   * motion. */
  readonly object: Group;
  readonly hasFaces: boolean;
  /** Faces as triangles, normals computed where the file has none; null where there are no faces. `userData.source`: the
   * vertex of the file that each one is. */
  readonly geometry: BufferGeometry | null;
  /** Edges; null where the file has faces and no edges. */
  readonly lines: BufferGeometry | null;
  /** Edges (u, v) in source order, stored or following from the branches. */
  readonly skeleton: Uint32Array;
  /** x, y, z in the axes of the file that all positions are relative to: 0, 0, 0 unless the plant is so far from there that floats would
   * break the file's bound, as in map coordinates. `object` and ATHLimbs stand there; put objects of your own there, too. Instances of
   * forests are relative to it. Levels of such a file change without a fade. */
  readonly origin: readonly [number, number, number];
  /** Rest pose in source order, 3 numbers per vertex. In files whose level 1 refines it, the numbers change when that
   * level is here, and attributes, `box` and `sphere` with them. */
  readonly rest: Float32Array;
  readonly box: Box3;
  readonly sphere: Sphere;
  /** One entry per branch in file order: see ath_decoder.d.ts. */
  readonly branches: Record<"parent" | "first" | "count" | "subtree" | "depth" | "attach" | "flags" | "lag" | "rigid" | "detail" | "ring", Int32Array>;
  /** Branch of every vertex in source order. */
  readonly vertexBranch: Int32Array;
  /** Resolves when all bytes of the file are here, of all levels and clips: they are fetched, behind what is wanted for pictures,
   * once this is asked for. Rejects where no more bytes come: after abort() and dispose(), where the file ends too early and
   * where the network fails. Damage is no such failure: see the event "damaged". */
  readonly loaded: Promise<ATH>;
  /** Ends its downloads; what is here goes on playing. */
  abort(): void;
  /** Ends its downloads and frees its memory, that of clones of its motion, too. */
  dispose(): void;
}

/** One of the motions of a plant that a file holds. */
export interface ATHClip {
  readonly index: number;
  /** Empty where the only clip of a file has none. */
  readonly name: string;
  /** Seconds of the clip played once: for a loop a whole round, with the way from its last frame back to its first. */
  readonly duration: number;
  /** Seconds from the first frame to the last. */
  readonly lastTime: number;
  readonly frameCount: number;
  /** The frames of a file are numbered over all its clips. */
  readonly firstFrame: number;
  /** Whether it is marked as a loop: its first frame follows its last. */
  readonly loop: boolean;
}

export interface ATHMotionEvents {
  /** A new picture is in the textures. */
  frame: { frame: number; level: number };
  /** Another level is shown. */
  level: { level: number };
  /** A clip that play() asked for begins: it is shown, or fades in. */
  clip: { clip: ATHClip };
  /** Bytes came. */
  progress: { loaded: number; total: number };
  /** More or less can be shown now: see ready(). */
  ready: {};
  /** No more bytes come; what is here goes on playing. */
  stopped: { message: string; codeName: string };
  /** A part of the file is damaged; what is whole goes on playing. level: from which on; null: a static array. */
  damaged: { message: string; codeName: string; level: number | null };
  /** A picture could not be made as it was asked for; the message says of which clip, time and level, and why. What can be shown
   * is, and the next picture can be asked for. */
  error: { message: string; codeName: string };
}

export class ATHMotion extends EventDispatcher<ATHMotionEvents> {
  /** Facts of the file: see AthInfo in ath_decoder.d.ts. */
  readonly info: { vertexCount: number; branchCount: number; frameCount: number; segmentCount: number; levelCount: number;
    depthLevels: number; fileLength: number; maxError: number; [name: string]: unknown };
  /** At least one. */
  readonly clips: readonly ATHClip[];
  /** The clip that plays. */
  readonly clip: ATHClip;
  /** Plays another clip, by its number or name: what of it is not here is fetched, and until its first segment is decoded
   * the clip before goes on. Then it begins, `at` (default 0) seconds from its first frame. fade: for so many seconds of
   * time that passes in setTime() the two are blended, vertex by vertex and matrix by matrix. Throws RangeError where
   * there is no such clip. */
  play(clip: string | number, options?: { fade?: number; at?: number }): this;
  /** Blends up to four clips for a wind from now on, until play(): those whose own strength and heading (metadata "strength" and
   * "heading", in degrees) are next to these, by how near they are, all at the time that is set. Branches stay attached and edges of
   * stems as long as in the clips. Bytes of all of these clips are fetched; those that are not here yet are left out. Weights
   * and levels change over `fade` seconds. Where no clip names a wind, the first is shown. Throws RangeError where a number is not finite. */
  wind(strength: number, heading?: number): this;
  /** Whether the clip before is still shown: "waiting" for the one that plays, "fading" into it; else null. */
  readonly switching: "waiting" | "fading" | null;
  /** Seconds until the clip repeats (in a loop the last frame blends into the first) or, where it does not, ends. */
  readonly duration: number;
  readonly levelCount: number;
  /** Describes a level for people: "depth 1" shows branches down to an order, "all branches" or "layer 2 of 3" all of them,
   * the further the layer the more precisely; "lossless". */
  levelName(level: number): string;

  /** Seconds, as asked for; those of the clip's first frame. */
  readonly time: number;
  readonly start: number;
  /** After the last frame: "marked" (as "loop" where the clip is marked as one, else "clamp"), "loop", "clamp" or
   * "pingpong". By default usualWrap: "marked" where the file marks a clip as a loop, else "loop". */
  wrap: "marked" | "loop" | "clamp" | "pingpong";
  readonly usualWrap: "marked" | "loop";
  /** Whether the clip repeats from its first frame, by that. */
  readonly loops: boolean;
  setTime(seconds: number): this;
  /** A level, or "auto": the coarsest whose error by `measure` is at most `pixels` on the screen, by update(). What is not
   * here or not decoded yet is shown at the deepest level that is. */
  setLevel(level: number | "auto"): this;
  pixels: number;
  /** A measure of the errors of all vertices: the largest, the 99th percentile (default: single vertices that stray do not keep
   * finer levels on the screen), or the root mean square. */
  measure: "max" | "p99" | "rms";
  /** Seconds that going from a level to another takes (default 0.2; 0: at once), by the clock: the two are blended, so that the
   * plant does not jump, whether the camera came near or bytes have come. Pictures that are asked for by show() are exact. */
  fade: number;
  /** Whether it is under way: `level` is the deepest that is shown then. Else what is shown is exactly that level. */
  readonly fading: boolean;
  /** Chooses the automatic level: once per frame, before setTime(). height: of the picture in pixels. */
  update(camera: Camera, height: number, object?: Object3D): this;
  levelFor(camera: Camera, height: number, matrixWorld?: Matrix4 | null, pixels?: number): number;
  /** How many pixels the error of a level is on the screen, by `measure`, where the plant is nearest to the camera. */
  pixelError(level: number, camera: Camera, height: number, matrixWorld?: Matrix4 | null): number;
  /** Decodes this very time and level and shows it. Rejects where bytes are missing or damaged. */
  show(seconds: number, level?: number): Promise<unknown>;
  /** All vertices in source order, 3 numbers each; what is shown stays. Rejects like show(). */
  positions(seconds: number, level?: number): Promise<Float32Array>;

  /** The level and frame of the file (with a fraction) that are shown; level -1: none yet. */
  readonly level: number;
  readonly frame: number;
  /** The level that is wanted. */
  readonly target: number;
  readonly automatic: boolean;
  /** Whether the nearer frame is shown in place of a blend, its neighbour not being decoded yet. */
  readonly held: boolean;
  /** Milliseconds that the worker took for the last picture. */
  readonly milliseconds: number;
  /** Whether pictures come with `distances`: per vertex, from the deepest position that is here. */
  heat: boolean;
  readonly distances: Float32Array | null;

  /** Returns the part of the clip that can be shown at a level, in seconds from its first frame. */
  ready(level: number): { start: number; end: number }[];
  /** The deepest level that is here for each segment of the clip, and for all of it; -1: none. */
  readonly readyLevels: Int8Array;
  readonly readyLevel: number;
  /** Whether all of the clip is here. */
  readonly complete: boolean;
  /** The last of the events "stopped" and "damaged", of which one may have come before there was a listener. */
  readonly failure: { type: "stopped" | "damaged"; message: string; codeName: string; level: number | null } | null;
  readonly bytesFetched: number;
  readonly bytesTotal: number;
  readonly requests: number;
  /** Figures of the clip: bytes up to a level; bits per second; error, in the file's units; how far off the step from a loop's
   * last frame to its first is, at most. */
  motionBytes(level: number): number;
  bitRate(level?: number): number;
  error(level: number): { max: number; p99: number; rms: number };
  seamError(level: number): number;
  /** Per vertex in source order, the branch whose node moves it at a level; its own where it moves alone. */
  nodeNumbers(level?: number): Promise<Int32Array>;
  refresh(): void;
  /** The vertices that are shown, in source order: what the vertex shader makes of the texture, computed here when it is asked
   * for. Null before the first picture. */
  uploaded(): Float32Array | null;

  /** Lets a material draw geometries of this motion (by onBeforeCompile, after what is there already). Once is enough; a
   * material moves by the motion that it was bound to last. Clones of it are not bound. */
  bind<T extends Material>(material: T): T;
  /** Gives an object the customDepthMaterial and customDistanceMaterial by which its shadows move; `ath.object` has them. */
  bindShadows<T extends Object3D>(object: T): T;
  /** Keeps a geometry in step: `userData.source` holds the file's vertex of each of its vertices. Its boundingBox and
   * boundingSphere are those of what is shown, and so is what raycasters find of its `position`, whose array stays the rest pose. */
  attach<T extends BufferGeometry>(geometry: T): T;
  detach(geometry: BufferGeometry): void;
  readonly uniforms: Record<"athData" | "athStride" | "athForest", IUniform>;
  /** A second motion of the same file, with a clip, a time and a level of its own. */
  clone(): ATHMotion;
  dispose(): void;
}

export interface ATHInstance {
  /** Place in the units and axes of the file. */
  x: number; y: number; z: number;
  size: number;
  /** Turn about the up axis, radians. */
  angle: number;
  /** How far ahead in the clip it is. */
  seconds: number;
  /** Number or name of the clip that it plays, over and over; default: the one that `ath.motion` plays. */
  clip?: string | number;
  /** How many times as far as in the file everything is from the rest pose; 1 by default, 0: it stands still. Above 1 lengths grow. */
  amplitude?: number;
  /** A colour, such as 0xffeecc, that its material's is multiplied by. */
  tint?: number;
}

/** Instances of one file, each drawn at the level that its distance asks for. One whose clip is not here yet plays the
 * motion's. Event: "level", when one can be drawn. */
export class ATHForest extends Group {
  constructor(ath: ATH, options?: {
    geometry?: BufferGeometry;
    material?: (isLines: boolean, level: number) => Material;
    /** Material of its shadows, where `castShadow` is set before the first bake(), as for `receiveShadow`. */
    depthMaterial?: (() => Material) | null;
  });
  setInstances(instances: ATHInstance[]): void;
  /** Gets ready what is here of all clips that instances play: once per frame, until it is done. */
  bakeReady(): void;
  /** Gets a level of the motion's clip ready, all of whose bytes are here (motion.readyLevel). */
  bake(level: number): Promise<void>;
  /** Chooses levels and what is in view: once per frame. */
  update(camera: Camera, height: number, seconds: number): void;
  levelOfDetail: boolean;
  /** Error on the screen that is allowed, in pixels. */
  pixels: number;
  /** As of ATHMotion, before the first bake(). */
  measure: "max" | "p99" | "rms";
  readonly count: number;
  /** Seconds that an instance takes from its level to another (default 0.2; 0: none); whether one is on its way, so that
   * update() is to be called again though time stands still. */
  fade: number;
  readonly fading: boolean;
  /** Levels of the motion's clip that can be drawn. */
  readonly baked: number[];
  /** Instances drawn, by level; those out of view; vertices drawn. */
  readonly counts: number[];
  readonly culled: number;
  readonly vertices: number;
  dispose(): void;
}

/** Bark and leaves as the viewer draws them, made in the shader from texture coordinates, where the metadata of a file name its
 * `surfaces`; else a plain material in the colour of leaves: `ath.motion.bind(new ATHPlantMaterial(ath.metadata))`. For WebGLRenderer. */
export class ATHPlantMaterial extends MeshStandardMaterial {
  constructor(metadata?: { surfaces?: unknown; [name: string]: unknown });
}

/** The branches of a file without faces as round limbs, each edge a strip that faces the camera, lit as a cylinder by a light of its own;
 * as thick as the attribute "radius" says or, without one, as follows from how much grows beyond an edge. For WebGLRenderer. */
export class ATHLimbs extends Mesh {
  constructor(ath: ATH, options?: { motion?: ATHMotion; color?: LimbColor });
  setColor(color: LimbColor): this;
  dispose(): void;
}

/** One colour, or linear red, green and blue of a vertex of the source. */
export type LimbColor = ColorRepresentation | ((vertex: number) => [number, number, number]);

/** As ATHMotion.bind(), by uniforms. */
export function injectMotion<T extends Material>(material: T, uniforms: Record<string, IUniform>, forest?: boolean): T;
export function motionUniforms(): Record<"athData" | "athStride" | "athForest", IUniform>;
/** GLSL for materials of one's own: vec3 athMoved(vec3 position, float athPart), vec3 athTurned(vec3 normal, float athPart). */
export const MOTION_PARS: string;
export function dataTexture(data: Float32Array): DataTexture;
