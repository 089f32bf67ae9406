// Other forms of a GLB, by glTF-Transform: node transform.mjs IN.glb OUT.glb quantize|sparse|meshopt|separate
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { dedup, meshopt, quantize, sparse } from "@gltf-transform/functions";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";

await Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]);
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  "meshopt.decoder": MeshoptDecoder, "meshopt.encoder": MeshoptEncoder,
});
const [input, output, how] = process.argv.slice(2);
const document = await io.read(input);
const steps = {
  quantize: [dedup(), quantize({ quantizePosition: 16 })],
  sparse: [sparse({ ratio: 0.9 })],
  meshopt: [meshopt({ encoder: MeshoptEncoder, quantizePosition: 16, level: "high" })],
  separate: [],
};
await document.transform(...steps[how]);
await io.write(output, document);
