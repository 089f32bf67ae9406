// Explains to a person what went wrong.

import { detailText } from "./ui.js";

const NETWORK = ["The file cannot be fetched", "The server did not answer, or it has no such file. Check the address, and whether you are online."];
const CUT = ["The file is cut off too early", "Its end is missing, as after a download that was interrupted. Get it again."];

const WORDS = {
  NOT_AN_ATH_FILE: ["This is not an .ath file", "It begins as another kind of file. If it came from the web, its address may lead to a page about the file and not to the file."],
  NO_MOTION: ["This GLB holds no plant that moves", "athcodec encode FILE.glb --into OUT.glb puts the motion of its animation into it."],
  UNSUPPORTED_VERSION: ["This file is of another version of the format", "A newer viewer may show it, or the file can be made again from its source."],
  HTTP: NETWORK, NETWORK, MISSING: CUT, TRUNCATED: CUT,
  NEEDS_HOST_MESH: ["This file needs the mesh that it was made for", "It holds the motion alone. Open it together with its mesh: athcodec view FILE --host-mesh MESH."],
  UNSUPPORTED_FEATURE: ["This file uses something newer than this viewer", "A newer viewer may show it."],
  WRONG_HOST_MESH: ["The mesh is not the one that this file was made for", "The file fits one mesh alone, point for point."],
  CLIP: ["The file has no such clip", "The address names a clip that is not in the file."],
  CHANGED: ["The file has changed", "While it was loading, another one took its place. Load it again."],
  WORKER: ["The decoder cannot be started", "The page is not complete: ath_worker.js belongs beside it."],
  GRAPHICS: ["This browser cannot draw in 3D", "The page needs WebGL 2. It may be turned off in the browser's settings."],
};
const DAMAGED = ["The file is damaged", "Some of its bytes are not what they were when it was made. Get it again."];

const PASSING = ["HTTP", "NETWORK", "MISSING", "TRUNCATED", "CHANGED", "WORKER"];

// What other files begin with, and what they are called.
const KINDS = [[/^Ogawa/, "Alembic"], [/^PXR-USDC|^#usda/, "USD"], [/^\x89HDF\r\n/, "HDF5"], [/^\x93NUMPY/, "NumPy"], [/^POINTCACHE2/, "a PC2 point cache"],
  [/^FOR[48]/, "a Maya cache"], [/^\s*(<\?xml|<VTKFile|<Xdmf)/, "XML"]];
const SUFFIXES = { abc: "Alembic", usd: "USD", usda: "USD", usdc: "USD", usdz: "USD", h5: "HDF5", hdf5: "HDF5", npz: "NumPy", gltf: "glTF", mdd: "an MDD point cache",
  pc2: "a PC2 point cache", vtu: "VTK", vtp: "VTK", vtkhdf: "VTK HDF", xdmf: "XDMF", mtg: "MTG", obj: "OBJ", ply: "PLY" };

// A name as a shell takes it.
const quoted = (name) => (/^[\w.,+-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`);

/** Describes a file of another program, from its first bytes and its name, as `wordsOf` does; null: its kind is not known. */
export function otherKind(head, name) {
  const text = String.fromCharCode(...head), suffix = /\.(\w+)$/.exec(name)?.[1].toLowerCase();
  const kind = KINDS.find(([begins]) => begins.test(text))?.[1] ?? SUFFIXES[suffix];
  if (!kind) return null;
  const made = /\.\w+$/.test(name) ? name.replace(/\.\w+$/, ".ath") : `${name}.ath`;
  return { title: `This is ${kind}`, advice: `Make an .ath file of it: athcodec encode ${quoted(name)} ${quoted(made)}`, passing: false };
}

/** Describes a failure: {title, advice, passing}; `passing`: whether it may be gone when it is tried again. */
export function wordsOf(codeName) {
  const [title, advice] = WORDS[codeName] ?? DAMAGED;
  return { title, advice, passing: PASSING.includes(codeName) };
}

/** Shows what can be shown in spite of a failure. */
export function shownWithout({ type, codeName, level }, motion) {
  if (type === "stopped") return `${wordsOf(codeName).title}. What is here plays on.`;
  if (level === null) return "The file is damaged: colours, radii or textures are missing.";
  return `The file is damaged: parts of it stay at less detail${level > 0 ? ` (${detailText(motion, level - 1)})` : ""}.`;
}
