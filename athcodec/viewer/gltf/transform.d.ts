/**
 * ATH_motion for glTF-Transform.
 *
 *     import { ATHMotionExtension, aside } from "athcodec-three/gltf/transform";
 *
 *     const io = new NodeIO().registerExtensions([...ALL_EXTENSIONS, ATHMotionExtension]);
 *     const document = await io.read("tree_motion.glb");
 *     await document.transform(dedup(), prune(), aside(meshopt({ encoder: MeshoptEncoder })));
 *     await io.write("small.glb", document);
 *
 * Motions go through as they are. Steps that change vertices (quantize, meshopt, reorder, simplify, join) are given to aside(), which
 * leaves meshes with a motion alone. A document whose vertices are not those of its motions any more is not written: io.write()
 * throws an Error that names the meshes.
 */
import { Document, Extension, ExtensionProperty, ReaderContext, Transform, WriterContext } from "@gltf-transform/core";

export interface MotionClip {
  name: string;
  /** Seconds, on the clock of the animation of this name, at which the clip begins (default 0). */
  start?: number;
}

/** An .ath file. */
export class Motion extends ExtensionProperty {
  readonly extensionName: "ATH_motion";
  readonly propertyType: "Motion";
  readonly parentTypes: string[];
  protected init(): void;
  getBytes(): Uint8Array;
  setBytes(bytes: Uint8Array): this;
  getClips(): MotionClip[];
  setClips(clips: MotionClip[]): this;
}

/** The motions of a document: document.getRoot().getExtension("ATH_motion"). */
export class MotionList extends ExtensionProperty {
  readonly extensionName: "ATH_motion";
  readonly propertyType: "MotionList";
  readonly parentTypes: string[];
  protected init(): void;
  listMotions(): Motion[];
  addMotion(motion: Motion): this;
  removeMotion(motion: Motion): this;
}

/** A primitive's extension: primitive.getExtension("ATH_motion"). */
export class PrimitiveMotion extends ExtensionProperty {
  readonly extensionName: "ATH_motion";
  readonly propertyType: "PrimitiveMotion";
  readonly parentTypes: string[];
  protected init(): void;
  getMotion(): Motion | null;
  setMotion(motion: Motion | null): this;
  /** The motion's vertex of the primitive's first; the attribute _ATH_VERTEX goes before that. */
  getFirstVertex(): number;
  setFirstVertex(vertex: number): this;
}

export class ATHMotionExtension extends Extension {
  static readonly EXTENSION_NAME: "ATH_motion";
  constructor(document: Document);
  createMotion(): Motion;
  createMotionList(): MotionList;
  createPrimitiveMotion(): PrimitiveMotion;
  read(context: ReaderContext): this;
  write(context: WriterContext): this;
}

/** A step that takes others on all meshes but those with a motion. */
export function aside(...steps: Transform[]): Transform;
