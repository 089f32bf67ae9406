// A GLB with ATH_motion through glTF-Transform: node gltf_motion_transform.mjs VIEWER IN.glb OUT.glb STEP...
// A step "aside:NAME" leaves the meshes with a motion alone. Prints what was refused.
import { register } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { dedup, flatten, join as merge, meshopt, prune, quantize, reorder, weld } from "@gltf-transform/functions";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";

const here = import.meta.url, [viewer, input, output, ...steps] = process.argv.slice(2);
register(`data:text/javascript,${encodeURIComponent(`export const resolve = (name, context, next) =>
  /^@gltf-transform/.test(name) ? next(name, { ...context, parentURL: ${JSON.stringify(here)} }) : next(name, context);`)}`);
const { ATHMotionExtension, aside } = await import(pathToFileURL(join(viewer, "gltf/transform.js")).href);
await Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]);
const io = new NodeIO().registerExtensions([...ALL_EXTENSIONS, ATHMotionExtension]).registerDependencies({
  "meshopt.decoder": MeshoptDecoder, "meshopt.encoder": MeshoptEncoder,
});
const known = {
  copy: () => () => {}, prune: () => prune(), dedup: () => dedup(), quantize: () => quantize(), weld: () => weld(), flatten: () => flatten(),
  join: () => merge(), reorder: () => reorder({ encoder: MeshoptEncoder }), meshopt: () => meshopt({ encoder: MeshoptEncoder, level: "medium" }),
};
const document = await io.read(input);
const made = (step) => (step.startsWith("aside:") ? aside(known[step.slice(6)]()) : known[step]());
await document.transform(...steps.map(made));
let refused = null;
try {
  await io.write(output, document);
} catch (error) {
  refused = error.message;
}
console.log(JSON.stringify({ refused }));
