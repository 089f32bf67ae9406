/**
 * Plays .ath files, the motion of plants with levels of detail. The decoder is inside, as WebAssembly:
 * nothing is fetched. Decoded positions have the same bits as those of the C library and of Python.
 *
 *     import { AthFile, ready } from "./ath_decoder.mjs";
 *
 *     await ready;
 *     const file = AthFile.open(bytes);
 *     const { firstSegment, segmentCount } = file.clips[0];
 *     const last = firstSegment + segmentCount - 1, segments = [];
 *     const level = file.levelFor(distance, fov, height, 1, firstSegment, last);
 *     for (let i = firstSegment; i <= last; i++) segments.push(file.prepare(i, level));
 *     const xyz = file.positions(segments, file.frameAt(seconds, "loop", 0));
 *
 * Units and layout. Positions and errors are in the file's scene units, time is in seconds. Frames and segments
 * count from 0 over the whole file, whose clips come one after the other. Positions are x, y, z of one vertex
 * after the other. Matrices are 3x4, row-major, 12 numbers:
 * x' = m[0] x + m[1] y + m[2] z + m[3] and so on. Order "file": every subtree of the plant is one range of
 * vertices; branches and parts refer to it. Order "source": as in the clip that was encoded; FACES and EDGES
 * refer to it.
 *
 * Every returned array is a copy. Arguments out of range throw a RangeError or TypeError; a file that cannot
 * be decoded throws an AthError.
 */

/** Whether this host can run the decoder: WebAssembly with SIMD. */
export const supported: boolean;

/** Resolves when the decoder is compiled; before that, AthFile's functions throw. Rejects where
 * `supported` is false. */
export const ready: Promise<void>;

/** The fault of a file, or what it lacks; `message` says where, what was found and what is allowed, in the words
 * of C and Python. */
export class AthError extends Error {
  /** Number in FORMAT.md, "Errors", if below 64; 66: bytes are missing; 67: no segment that was passed has the frame; 68: the
   * host has no memory left. */
  readonly code: number;
  /** Such as "BAD_CHECKSUM", "NOT_AN_ATH_FILE", "MISSING", "NOT_PREPARED", "NO_MEMORY". */
  readonly codeName: string;
  /** Index of the chunk at fault, see AthFile.chunks(); -1: none. */
  readonly chunk: number;
  /** With "MISSING" from AthFile.open(): how many bytes of the file's front to come back with. More may be
   * needed then. */
  readonly needed: number;
}

/** "file" or "source", see above. */
/** Measures of the error over all vertices in all frames. "max": the largest. "p99": at most 1 % of them exceed it, which is closer
 * to what one sees if a few vertices stray. "rms": the root of the mean square. */
export type Measure = "max" | "p99" | "rms";
export type Errors = Record<Measure, number>;
export type Order = "file" | "source";

/** How a clip goes on after its last frame: it stays; the first, blended into; the same way back; "loop" where the
 * clip is marked as one, else "clamp". */
export type Wrap = "clamp" | "loop" | "pingpong" | "marked";

export interface AthInfo {
  /** Bytes of the whole file. */
  readonly fileLength: number;
  /** Bytes in front of the first motion chunk: what open() needs. */
  readonly preludeLength: number;
  /** Largest distance of any vertex in any frame from the clip that was encoded, promised for the deepest
   * level of the file as encoded (fullLevelCount - 1). */
  readonly maxError: number;
  /** x, y, z that the file's numbers are relative to. Positions are absolute unless you ask for `relative` ones. */
  readonly origin: readonly [number, number, number];
  /** Vertices of the source, which order "source" has. */
  readonly vertexCount: number;
  /** Places of vertices, which order "file" has: as many, or fewer where vertices coincide. */
  readonly placeCount: number;
  readonly branchCount: number;
  /** Counted over all clips. */
  readonly frameCount: number;
  readonly segmentCount: number;
  readonly clipCount: number;
  /** Levels in this file, 0 to levelCount - 1; those that encoding made. */
  readonly levelCount: number;
  readonly fullLevelCount: number;
  /** Layers of precision of the file as encoded; 1: no level refines another. */
  readonly layerCount: number;
  /** Levels of the first layer: those from depthLevels on refine the whole plant. */
  readonly depthLevels: number;
  readonly nodeCount: number;
  readonly chunkCount: number;
  /** Whether positions are double in the file's own arithmetic; a Float64Array then holds more than a
   * Float32Array. */
  readonly isFloat64: boolean;
  /** All levels but level 0 are predicted motion. */
  readonly isPredicted: boolean;
  /** The rest pose in this form. */
  readonly restIsFloat64: boolean;
  /** Whether the rest pose is a mesh that the host has, for setHostMesh(); of that mesh the checksum, 16 hexadecimal
   * digits, else null. */
  readonly restIsHost: boolean;
  readonly hostChecksum: string | null;
}

/** A motion of the plant: frames firstFrame to firstFrame + frameCount - 1 of the file, segments likewise. */
export interface Clip {
  /** Empty where the only clip of a file has none. */
  readonly name: string;
  /** Seconds of the clip played once: for a loop a whole round, with the way from its last frame back to its first. */
  readonly duration: number;
  /** Seconds from the first frame to the last. */
  readonly lastTime: number;
  readonly firstFrame: number;
  readonly frameCount: number;
  readonly firstSegment: number;
  readonly segmentCount: number;
  /** Whether its first frame follows its last. */
  readonly loop: boolean;
}

/** One entry per branch, parents before children; the subtree of b is the branches b to b + subtree[b] -
 * 1. */
export interface Branches {
  /** Branch; -1 for a root. */
  readonly parent: Int32Array;
  /** First vertex in file order, and number of vertices, of its stem. */
  readonly first: Int32Array;
  readonly count: Int32Array;
  /** Branches in its subtree, itself included. */
  readonly subtree: Int32Array;
  readonly depth: Int32Array;
  /** Layers, from the first on, in which its pieces turn and move as they are. */
  readonly rigid: Int32Array;
  /** 0, or its largest step of the rest pose, in half octaves about 128. */
  readonly detail: Int32Array;
  /** Vertices of each ring of a tube, which move alike; 0: it has no rings. */
  readonly ring: Int32Array;
  /** Vertex (file order) of the parent's stem that it hangs on; -1 for a root. */
  readonly attach: Int32Array;
  /** 1: flat or compact; 2: not attached; 4: its subtree moves as one. Added up. */
  readonly flags: Int32Array;
  /** Number of the rest pose's predictor. */
  readonly lag: Int32Array;
}

/** How a level cuts the plant: parts ascend, and hold every vertex once. */
export interface Parts {
  readonly partCount: number;
  /** Matrices of this level. */
  readonly nodeCount: number;
  /** Vertices that have positions of their own. */
  readonly exactCount: number;
  /** First vertex (file order) and number of vertices of each part. */
  readonly first: Int32Array;
  readonly count: Int32Array;
  /** Branch whose subtree moves by one matrix; -1: an exact run, vertices with positions of their own. */
  readonly branch: Int32Array;
  /** Index of the part's matrix, or of the run's first vertex among the exact ones. */
  readonly index: Int32Array;
}

export interface Polygons {
  array: Uint32Array;
  columns: number;
  counts: Uint32Array | null;
  derived: boolean;
}

/** A static array of the source, row by row. Booleans are a Uint8Array in which 0 is false, halves a Float32Array, integers of 8
 * bytes a BigInt64Array or BigUint64Array, texts strings. */
export interface Attribute {
  readonly array: Uint8Array | Uint16Array | Uint32Array | Int8Array | Int16Array | Int32Array | Float32Array | Float64Array
    | BigInt64Array | BigUint64Array | string[];
  /** Rows, then numbers per row; empty for a single element. */
  readonly shape: readonly number[];
}

/** What an engine's buffers hold beside positions and normals. A vertex of the source is one vertex of the mesh, or several where uv or
 * colors are stored per corner and differ between its faces. */
export interface Mesh {
  /** The vertex of the source that each vertex of the mesh is. */
  readonly source: Uint32Array;
  /** Three vertices of the mesh each, in the order of the faces; faces of more corners are fans. Empty: the file has no faces. */
  readonly triangles: Uint32Array;
  /** Texture coordinates as the source has them, 2 numbers per vertex of the mesh; null: the file has none. */
  readonly uv: Float32Array | null;
  /** Red, green, blue and alpha from 0 to 1, 4 numbers per vertex of the mesh; null: the file has none. */
  readonly colors: Float32Array | null;
  /** Positions or normals of the source's vertices, 3 numbers each, as those of the mesh. They go to `out` if given. */
  gather(values: ArrayLike<number>, out?: Float32Array): Float32Array;
}

/** Kinds and what they hold: FORMAT.md, "Chunk table". For METADATA 0x8004 see AthFile.metadata(), for ATTRIBUTE 0x8020
 * attribute(), for FACES 0x8005 and EDGES 0x8006 polygons(). */
export interface Chunk {
  readonly kind: number;
  /** 255: not of a level. */
  readonly level: number;
  readonly segment: number;
  /** Bytes, from the file's beginning. */
  readonly offset: number;
  readonly length: number;
  /** CRC-32C of its bytes. */
  readonly checksum: number;
  /** Whether its bytes are here. */
  readonly fed: boolean;
}

/** Bytes of a file. */
export interface ByteRange {
  readonly offset: number;
  readonly size: number;
}

/** Levels that are shown together, at most four, and the share of each; they add up to 1. */
export interface Fading {
  readonly levels: readonly number[];
  readonly weights: readonly number[];
}

/** Goes from level to level over a moment, without the jump by the distance of the two. Once per drawn frame:
 *
 *     fade.to(segment.level, seconds / 0.2);
 *     file.positions([segment, before], frame, { fade }); // or matrices() and exact()
 *
 * Levels are blended, with weights that change smoothly, also where a change overtakes the one before. */
export class AthFade implements Fading {
  /** The one that is gone to last; one may be there twice. Of one nothing fades. */
  readonly levels: readonly number[];
  readonly weights: readonly number[];
  /** The deepest of them; -1: there is none yet. */
  readonly cut: number;
  /** The level to show, prepared by now, and the time since the last call as a share of what a fade takes. A share of 1 or
   * more, and the first level of all, show the level at once. */
  to(level: number, share: number): this;
}

/** How a preparation goes on from others, and others from it: see prepare(). */
export type GoingOn = { from?: Segment | null; keep?: boolean; following?: Segment | null };

/** A range of frames, decoded at one level. It holds its own memory: free() it, or let go of the whole
 * file. */
export interface Segment {
  readonly index: number;
  readonly level: number;
  readonly freed: boolean;
  /** Frees its memory for further ones. Playing passes over it from then on. */
  free(): void;
}

export type Segments = readonly (Segment | null)[];

/** A segment in the making. */
export interface Preparation {
  readonly index: number;
  readonly level: number;
  /** Null until step() has returned true. */
  readonly segment: Segment | null;
  /** The share of its steps that are done, from 0 to 1. It may end early, since steps are counted as if it took the most. */
  readonly progress: number;
  /** Goes on for `steps` (default 16) bounded pieces of work, of at most 64 vertices or one matrix over
   * the segment's frames. True: done. Throws AthError where the file is damaged; nothing is left to clean
   * up then. */
  step(steps?: number): boolean;
  /** Ends it before it is done, and frees its memory. */
  cancel(): void;
}

/** An opened file, in WebAssembly memory of its own. It is freed with the object, like any other. */
export class AthFile {
  private constructor();

  /** Whether `bytes`, the front of a file, are enough for open(), and how many are needed: the exact
   * number where ready is true, else a number to come back with. Throws AthError where no more bytes can
   * help. */
  static front(bytes: Uint8Array): { ready: boolean; needed: number };

  /** Opens a file from its front; what follows the prelude is fed. Copies what it keeps. Throws AthError,
   * "MISSING" with `needed` where the front is too short. hostMesh: for setHostMesh(). profile: whose limits a file
   * has to keep (FORMAT.md, "Limits"); "small" suits telephones, "full" is the default. */
  static open(bytes: Uint8Array, options?: { hostMesh?: Float32Array | null; profile?: "full" | "small" }): AthFile;

  /** Gives the mesh that is the rest pose of a file that does not hold one (info.restIsHost): three numbers per vertex as
   * they were in the source, bit for bit and in its order. Copies them; other files pass it over. Throws AthError,
   * "WRONG_HOST_MESH". Without it all that takes the rest pose, which is rest(), preparing and playing, throws
   * "NEEDS_HOST_MESH". */
  setHostMesh(mesh: Float32Array): void;
  /** Whether it is still to be given. */
  readonly needsHostMesh: boolean;

  readonly info: AthInfo;
  /** At least one. Where a function takes a clip it takes its number here, or its name. */
  readonly clips: readonly Clip[];

  /** Whether the last positions(), matrices() or exact() showed the nearer frame in place of a blend,
   * because the other one is in a segment that was not handed over at the same level. */
  readonly held: boolean;

  branches(): Branches;
  /** The first vertex of the source that is at each of placeCount vertices in file order. */
  vertexSource(): Int32Array;
  /** The vertex in file order whose position each of vertexCount vertices of the source has. */
  vertexPlaces(): Int32Array;
  /** File branch i is branch branchSource()[i] of the source. */
  branchSource(): Int32Array;
  /** Seconds, one per frame, increasing within a clip. */
  times(): Float64Array;
  /** The rest pose of the source, 3 numbers per vertex; order "source" by default. Where the source gave none it is the
   * finest reference pose that has been read; after levelRest() of a deeper level it is closer to the source's. Throws
   * MISSING where its chunk, SOURCE_REST, which stands behind the motion, is still to come: no player needs it. */
  rest(order?: Order, options?: { relative?: boolean }): Float32Array;
  rest<T extends Float32Array | Float64Array>(order: Order, options: { out: T; relative?: boolean }): T;
  /** The reference pose of a level, which it moves and which its matrices apply to. It is the same for all levels with
   * nodes above 0. Throws MISSING where bytes of it are still to come. */
  levelRest(level: number, order?: Order, options?: { relative?: boolean }): Float32Array;
  levelRest<T extends Float32Array | Float64Array>(level: number, order: Order, options: { out: T; relative?: boolean }): T;
  /** Error of showing a level, measured by the encoder, over the segments `first` to `last` (default: all). */
  levelError(level: number, first?: number, last?: number): Errors;
  /** Describes a level for people: "depth 1", "layer 2 of 3", "all branches", "lossless". */
  levelName(level: number): string;
  /** How well a level keeps the step of a loop from its last frame to its first: the most that any vertex's is
   * off; 0 for clips that are no loops. Known of all fullLevelCount levels, stored or not. */
  seamError(clip: number | string, level: number): number;
  /** First frame of a segment; of segmentCount: frameCount. */
  segmentStart(segment: number): number;
  segmentOf(frame: number): number;
  /** The chunk table, in file order. */
  chunks(): Chunk[];
  /** The bytes of a chunk as stored, its checksum verified; null where they are not here. */
  chunkBytes(index: number): Uint8Array | null;
  /** Faces or edges, null where the file has none: vertices in source order, of `columns` corners each or, where there are
   * `counts`, of these. Edges that are `derived` are not stored: they follow from the branches. */
  polygons(name: "faces" | "edges"): Polygons | null;

  /** What the source said of itself, such as { unit: "m", up_axis: "y" }: a JSON object, empty where it said nothing. */
  metadata(): Record<string, any>;
  /** Names of the static arrays whose bytes are here, such as "uv" or "radius". */
  attributeNames(): string[];
  /** Bytes of static arrays that are not here. No level needs them; they may stand behind the motion. */
  attributeRanges(): ByteRange[];
  /** A static array, unpacked; null where the file has none of that name. Throws AthError: "MISSING" while the array may be among
   * those that are still to come, "BAD_CHECKSUM", "BAD_CHUNK", "LIMIT_EXCEEDED". */
  attribute(name: string): Attribute | null;

  /** The faces as triangles, three vertices of the source each; faces of more corners are fans. Null: the file has no faces. */
  triangles(): Uint32Array | null;
  /** Unit normals of vertices at `positions`, both in the source's order, 3 numbers each: those of the triangles around each, weighted
   * by area. A vertex without triangles gets one that points away from the middle. They go to `out` if given. */
  normals(positions: ArrayLike<number>, options?: { out?: Float32Array }): Float32Array;
  /** Triangles, texture coordinates and colours for an engine. Feed attributeRanges() before: throws AthError, "MISSING", as
   * attribute() does. */
  mesh(): Mesh;

  /** Hands over `bytes`, the file's from `offset` on. Chunks that lie inside can be used from now on; one
   * that begins inside goes on with the piece that continues it, so the pieces of one download can be fed
   * as they come. Chunks that are here already are left alone. Copies what it keeps. */
  feed(bytes: Uint8Array, offset: number): void;
  /** Forgets motion chunks that touch this range, and frees their memory. Throws Error where one is in
   * preparation. */
  drop(offset: number, size: number): void;
  /** Bytes that segments `first` to `last` (default: all) need for `level` and that are not here; with
   * `all` those that are, too, those of segments that they are joined to among them; with `after` without what only
   * levels up to that need, and of these segments alone. Ascending, neighbours joined. */
  ranges(level: number, first?: number, last?: number, all?: boolean, after?: number): ByteRange[];
  /** The deepest level that a segment can be prepared at with what is here; -1: none. */
  readyLevel(segment: number): number;

  parts(level: number): Parts;
  /** The coarsest level whose error by `measure` (default: "max"), seen from `distance` (scene units) under a vertical field of
   * view of `fov` (radians) on a screen `height` pixels high, is at most `pixels` in the segments `first` to
   * `last` (default: all); the deepest where none is. */
  levelFor(distance: number, fov: number, height: number, pixels: number, first?: number, last?: number,
           measure?: Measure): number;

  /** The segment that one goes on from the end of at a level, so that motion does not tick where they meet; -1: none. */
  joinedTo(segment: number, level: number): number;
  /** Decodes a segment at a level. Throws AthError: "MISSING", "BAD_CHECKSUM", "BAD_CHUNK", "NO_MEMORY".
   * keep: so that a level that refines this one can be prepared `from` it, in less time and without the bytes of the
   * levels up to its own; takes about a hundredth of the segment's memory. `from` is of no use where it is of another
   * segment, of a level below info.depthLevels - 1, or prepared without `keep`: then decoding starts anew. It can be
   * shown whatever comes of it, and is freed after the preparation.
   * following: the segment that this one is joined to, prepared at the same level, so that its end is not decoded again;
   * of no use where it is another. */
  prepare(segment: number, level: number, options?: GoingOn): Segment;
  /** Prepares a segment in steps, to be spread over frames. Throws AthError: "MISSING", "NO_MEMORY". */
  preparation(segment: number, level: number, options?: GoingOn): Preparation;

  /** Where on the frames a time, in seconds since the first frame of the clip (default: the first clip), is: from
   * that to the clip's last and, for a loop, on to the frame behind it, as the last frame blends into the first
   * over the mean frame time. */
  frameAt(seconds: number, wrap?: Wrap, clip?: number | string): number;

  /*
   * These methods return the pose at a frame number, which may be fractional (3.25). Pass any number of prepared
   * segments; null and freed ones are skipped. The result goes to `out` if given, else to a new array. If no segment
   * holds the frame, they leave `out` as it was and throw an AthError, "NOT_PREPARED", which names the segment to
   * prepare: segmentOf(Math.floor(frame)). Pass segments of one level if you want matrices or exact vertices: of
   * several levels, nothing tells which one is shown.
   *
   * With `fade`, the blend of its levels, segments of each of which are handed over; matrices and exact vertices are those
   * of the cut of the deepest, of which one segment has to be there. "NOT_PREPARED": a level that has a weight lacks the
   * frame.
   */

  /** All vertices, 3 numbers each; order "source" by default. relative: less info.origin, for an object that an engine puts there.
   * Floats of positions far from 0, such as UTM coordinates, are too coarse; these are not. */
  positions(segments: Segments, frame: number, options?: { order?: Order; fade?: Fading | null; relative?: boolean }): Float32Array;
  positions(segments: Segments, frame: number,
            options: { out: Float32Array; order?: Order; fade: Fading; relative?: boolean }): Float32Array;
  positions<T extends Float32Array | Float64Array>(segments: Segments, frame: number,
                                                   options: { out: T; order?: Order; relative?: boolean }): T;
  /** Up to four clips blended along the branches, each at its own frame and level: branches stay attached, edges of stems
   * are as long as those of the clips in their weighted mean. Weights need not add up to 1; a share of none is passed over,
   * and one that is left alone has the bits of positions(). */
  blended(
    shares: readonly { segments: Iterable<Segment | null>; frame: number; weight: number }[],
    options?: { out?: Float32Array; order?: "source" | "file" },
  ): Float32Array;
  /** Weights of clips for a wanted wind, of which at most four are above 0, given the wind of each: its metadata "strength"
   * and "heading", in degrees. Bilinear in both, held beyond the calmest and the wildest. */
  windWeights(
    winds: readonly ({ strength: number; heading?: number } | null)[],
    strength: number,
    heading: number,
  ): number[];

  /** For skinning on the GPU: parts().nodeCount matrices of 12 numbers, from levelRest(level, "file") to
   * positions; with `relative`, which takes no fade, from relative ones to relative ones.
   * Vertices of exact runs have none, exact() has them. */
  matrices(segments: Segments, frame: number, options?: { out?: Float32Array; fade?: Fading | null }): Float32Array;
  matrices<T extends Float32Array | Float64Array>(segments: Segments, frame: number,
                                                  options: { out?: T; relative?: boolean }): T;
  /** parts().exactCount positions of 3 numbers, in file order. */
  exact(segments: Segments, frame: number, options?: { out?: Float32Array; fade?: Fading | null }): Float32Array;

  /** The GPU form of a level (core/include/ath_gpu.h, docs/gpu.md): a block of words that goes to the GPU as it is. */
  gpuLevel(level: number): Uint32Array;
  /** Bytes that a segment takes at a level; its bytes have to be here. */
  gpuSegment(segment: number, level: number): Uint32Array;
  /** Which of the coded frames of its segment shows a frame of the file. */
  gpuFrame(frame: number): number;

  /** Lets go of the memory at once instead of with the object; nothing but free() and cancel() may be
   * called then. */
  dispose(): void;
}
