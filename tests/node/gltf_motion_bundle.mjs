// The page of gltf_motion_page.mjs as one file: node gltf_motion_bundle.mjs VIEWER OUT.js
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const [viewer, out] = process.argv.slice(2), here = fileURLToPath(new URL(".", import.meta.url));
await build({ entryPoints: [join(here, "gltf_motion_page.mjs")], outfile: out, bundle: true, format: "esm", logLevel: "error",
  alias: { viewer }, nodePaths: [join(here, "node_modules")] });
