// ATH_motion for glTF-Transform: io.registerExtensions([ATHMotionExtension]). Motions go through a document as they are. Steps that
// change the vertices they belong to (quantize, meshopt, simplify ...) are told to leave these alone by aside(); where
// such a change comes to be written all the same, writing is refused and names the mesh.

import { Extension, ExtensionProperty, PropertyType, RefList } from "@gltf-transform/core";

import { EXTENSION, VERTEX, motionsOf, restOf, referenceOf, verticesOf } from "./parts.js";

const GLB_BUFFER = "@glb.bin";

/** An .ath file: its bytes, and `clips` as the extension's text has them. */
export class Motion extends ExtensionProperty {
  static EXTENSION_NAME = EXTENSION;

  init() {
    this.extensionName = EXTENSION;
    this.propertyType = "Motion";
    this.parentTypes = ["MotionList", "PrimitiveMotion"];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { bytes: new Uint8Array(), clips: [], rest: "" });
  }

  getBytes() {
    return this.get("bytes");
  }

  setBytes(bytes) {
    return this.set("bytes", bytes);
  }

  getClips() {
    return this.get("clips");
  }

  setClips(clips) {
    return this.set("clips", clips);
  }
}

/** The motions of a document, in the extension of its root. */
export class MotionList extends ExtensionProperty {
  static EXTENSION_NAME = EXTENSION;

  init() {
    this.extensionName = EXTENSION;
    this.propertyType = "MotionList";
    this.parentTypes = [PropertyType.ROOT];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { motions: new RefList() });
  }

  listMotions() {
    return this.listRefs("motions");
  }

  addMotion(motion) {
    return this.addRef("motions", motion);
  }

  removeMotion(motion) {
    return this.removeRef("motions", motion);
  }
}

/** The motion of a primitive, and the motion's vertex of its first; the attribute _ATH_VERTEX goes before that. */
export class PrimitiveMotion extends ExtensionProperty {
  static EXTENSION_NAME = EXTENSION;

  init() {
    this.extensionName = EXTENSION;
    this.propertyType = "PrimitiveMotion";
    this.parentTypes = [PropertyType.PRIMITIVE];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { motion: null, firstVertex: 0 });
  }

  getMotion() {
    return this.getRef("motion");
  }

  setMotion(motion) {
    return this.setRef("motion", motion);
  }

  getFirstVertex() {
    return this.get("firstVertex");
  }

  setFirstVertex(vertex) {
    return this.set("firstVertex", vertex);
  }
}

export class ATHMotionExtension extends Extension {
  static EXTENSION_NAME = EXTENSION;
  extensionName = EXTENSION;
  prewriteTypes = [PropertyType.BUFFER];

  createMotion() {
    return new Motion(this.document.getGraph());
  }

  createMotionList() {
    return new MotionList(this.document.getGraph());
  }

  createPrimitiveMotion() {
    return new PrimitiveMotion(this.document.getGraph());
  }

  read(context) {
    const { json } = context.jsonDoc, list = this.createMotionList();
    const motions = motionsOf(json).map((def) => this.#readMotion(context, def));
    for (const motion of motions) list.addMotion(motion);
    this.document.getRoot().setExtension(EXTENSION, list);
    (json.meshes ?? []).forEach(({ primitives }, mesh) => primitives.forEach((def, primitive) => {
      const reference = referenceOf(def);
      if (!reference) return;
      if (!motions[reference.motion]) throw new RangeError(`${EXTENSION}: got motion ${reference.motion}, expected one below ${motions.length}`);
      const motion = this.createPrimitiveMotion().setMotion(motions[reference.motion]).setFirstVertex(reference.firstVertex ?? 0);
      context.meshes[mesh].listPrimitives()[primitive].setExtension(EXTENSION, motion);
    }));
    for (const motion of motions) motion.set("rest", digest(this.#rest(motion)));
    return this;
  }

  #readMotion({ jsonDoc: { json, resources } }, { bufferView, clips = [], name = "", extras = {} }) {
    const { buffer, byteOffset = 0, byteLength } = json.bufferViews[bufferView];
    const data = resources[json.buffers[buffer].uri ?? GLB_BUFFER];
    return this.createMotion().setName(name).setExtras(extras).setClips(clips).setBytes(data.slice(byteOffset, byteOffset + byteLength));
  }

  // Returns the primitives that a motion moves and whose meshes are in the document.
  #primitives(motion) {
    return this.document.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives()
      .filter((primitive) => primitive.getExtension(EXTENSION)?.getMotion() === motion)
      .map((primitive) => ({ mesh, primitive, reference: primitive.getExtension(EXTENSION) })));
  }

  #rest(motion) {
    return restOf(this.#primitives(motion).map(({ primitive, reference }) => {
      const position = primitive.getAttribute("POSITION"), numbers = primitive.getAttribute(VERTEX), positions = position.getArray();
      if (!(positions instanceof Float32Array)) throw new RangeError("POSITION: got other numbers than float32");
      return { positions, vertices: verticesOf(position.getCount(), { firstVertex: reference.getFirstVertex() },
        numbers && ((i) => numbers.getScalar(i))) };
    }));
  }

  #motions() {
    return this.document.getRoot().getExtension(EXTENSION)?.listMotions() ?? [];
  }

  prewrite(context) {
    const [buffer] = this.document.getRoot().listBuffers();
    for (const motion of this.#motions()) {
      this.#check(motion);
      const there = context.otherBufferViews.get(buffer) ?? [];
      context.otherBufferViews.set(buffer, [...there, motion.getBytes()]);
    }
    return this;
  }

  #check(motion) {
    const names = [...new Set(this.#primitives(motion).map(({ mesh }) => nameOf(mesh)))].join(", ");
    let rest = null, reason = "their positions are others";
    try {
      rest = digest(this.#rest(motion));
    } catch (error) {
      reason = error.message;
    }
    if (rest === null || (motion.get("rest") !== "" && motion.get("rest") !== rest))
      throw new Error(`${EXTENSION}: the vertices of ${names || "a motion"} are not those of their motion any more (${reason}); ` +
        "give aside() the steps that change vertices, such as quantize, meshopt, reorder, simplify and flatten");
  }

  write(context) {
    const { json } = context.jsonDoc, motions = this.#motions();
    if (motions.length === 0) return this;
    json.extensions ??= {};
    json.extensions[EXTENSION] = { motions: motions.map((motion) => ({
      bufferView: context.otherBufferViewsIndexMap.get(motion.getBytes()),
      ...(motion.getClips().length > 0 && { clips: motion.getClips() }), ...(motion.getName() && { name: motion.getName() }),
      ...(Object.keys(motion.getExtras()).length > 0 && { extras: motion.getExtras() }),
    })) };
    for (const mesh of this.document.getRoot().listMeshes())
      mesh.listPrimitives().forEach((primitive, i) => {
        const reference = primitive.getExtension(EXTENSION), first = reference?.getFirstVertex();
        if (!reference) return;
        const def = json.meshes[context.meshIndexMap.get(mesh)].primitives[i];
        def.extensions = { ...def.extensions,
          [EXTENSION]: { motion: motions.indexOf(reference.getMotion()), ...(first > 0 && { firstVertex: first }) } };
      });
    return this;
  }
}

// Its own or that of a node that shows it.
function nameOf(mesh) {
  return [mesh, ...mesh.listParents()].map((each) => each.getName()).find(Boolean) ?? "a mesh without a name";
}

/** A step that takes others while meshes with a motion are aside: `document.transform(aside(quantize(), reorder(...)))`. */
export function aside(...steps) {
  return async function aside(document) {
    const root = document.getRoot(), before = root.listMeshes();
    const moved = before.filter((mesh) => mesh.listPrimitives().some((primitive) => primitive.getExtension(EXTENSION)));
    for (const mesh of moved) root.removeRef("meshes", mesh); // A mesh outside the document's list is not seen.
    try {
      await document.transform(...steps);
    } finally {
      const left = root.listMeshes();
      for (const mesh of left) root.removeRef("meshes", mesh);
      const kept = before.filter((mesh) => moved.includes(mesh) || left.includes(mesh));
      for (const mesh of new Set([...kept, ...left])) root.addRef("meshes", mesh);
    }
  };
}

// Tells one rest pose from another: FNV-1a of 32 bits over its words, twice.
function digest(rest) {
  const words = new Uint32Array(rest.buffer, rest.byteOffset, rest.length);
  let a = 0x811c9dc5, b = 0x01000193 ^ rest.length;
  for (const word of words) {
    const bits = word === 0x80000000 ? 0 : word;
    a = Math.imul(a ^ bits, 0x01000193);
    b = Math.imul(b ^ (bits >>> 16) ^ (bits << 16), 0x01000193) + 1 | 0;
  }
  return `${a >>> 0} ${b >>> 0}`;
}
