// Bundles src and page into the folder given: `node build.mjs FOLDER`, with the packages of package.json on NODE_PATH.
// build_viewer.py calls it.

import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url)), [out] = process.argv.slice(2);
const modules = process.env.NODE_PATH, require = createRequire(join(modules, "x.js"));
const esbuild = require("esbuild");
mkdirSync(out, { recursive: true });

// Shaders without comments and indentation, which esbuild leaves in texts.
const short = (module) => module.replace(/\/\* glsl \*\/`[^`]*/g, (text) => text.replace(/[ \t]*\/\/.*/g, "").replace(/\n\s+/g, "\n")
  .replace(/^[^#\n]+$/gm, (line) => line.replace(/ ?([,;{}=*<>?:+/]) ?/g, "$1").replace(/\b0\.(?=\d)/g, ".").replace(/(\d)\.0\b/g, "$1.")));
const glsl = { name: "glsl", setup: ({ onLoad }) => onLoad({ filter: /viewer.(src|page).\w+\.js$/ },
  ({ path }) => ({ contents: short(readFileSync(path, "utf8")) })) };

// What only models need of three.js comes from its sources, and the classes that these import from the bundle of all pages.
const page = { path: "./three.js", external: true, sideEffects: false };
const onlyModels = (used) => ({ name: "three", setup({ onResolve, onLoad }) {
  onResolve({ filter: /^three$/ }, () => ({ path: "three", namespace: "split", sideEffects: false }));
  onResolve({ filter: /^page$/, namespace: "split" }, () => page);
  onResolve({ filter: /^\..*\/[A-Z]\w+\.js$/ }, ({ path, importer }) => // except in files that list others
    (!/(Core|Geometries|Materials|Curves)\.js$/.test(importer) && used.includes(/(\w+)\.js$/.exec(path.replace("MathUtils", ""))?.[1]) ? page : null));
  onLoad({ filter: /Three.Core\.js$/ }, ({ path }) => // without its warning of a second three.js in the page
    ({ contents: readFileSync(path, "utf8").match(/^export .*/gm).join("\n"), resolveDir: dirname(path) }));
  onLoad({ filter: /./, namespace: "split" }, () => ({
    contents: `export { ${used.join(", ")} } from "page"; export * from "three/src/Three.Core.js";`, resolveDir: modules }));
} });

// three.js from its sources: without virtual reality and maps of surroundings, which no page here has, and with shaders in few bytes.
const NO_XR = `export class WebXRManager {
  enabled = false; isPresenting = false; cameraAutoUpdate = false;
  addEventListener() {} removeEventListener() {} setAnimationLoop() {} dispose() {} getCamera() {}
  hasDepthSensing() { return false; } getEnvironmentBlendMode() { return null; } getDepthSensingMesh() { return null; }
}`;
const fewBytes = { name: "few bytes", setup: ({ onLoad }) => {
  onLoad({ filter: /WebXRManager\.js$/ }, () => ({ contents: NO_XR }));
  onLoad({ filter: /WebGLEnvironments\.js$/ }, ({ path }) => // pages have lights and no maps of surroundings
    ({ contents: readFileSync(path, "utf8").replace(/^import .*PMREMGenerator.*$/m, "class PMREMGenerator {}") }));
  onLoad({ filter: /(ShaderChunk|ShaderLib).\w+\.glsl\.js$/ }, ({ path }) => ({ contents: short(readFileSync(path, "utf8")) }));
} };

// Pages name the files beside them and need no import map, which a site's policy may forbid.
const BESIDE = { three: "./three.js", "three/webgpu": "./three.webgpu.js", "athcodec-three/model": "./model.js" };
const INSIDE = { "athcodec-three": join(here, "src/index.js"), "athcodec-three/webgpu": join(here, "src/webgpu.js") };
const forPages = (three) => ({ name: "pages", setup: ({ onResolve }) => onResolve({ filter: /^(three|athcodec-three)(\/|$)/ }, ({ path }) => {
  if (path in INSIDE) return { path: INSIDE[path] };
  return path in BESIDE ? { path: path === "three" ? three : BESIDE[path], external: true } : null;
}) });

async function bundle(entry, name, external) {
  await esbuild.build({
    format: "esm", ...entry, outfile: join(out, name), bundle: true, minify: true, target: "es2022", external,
    nodePaths: [modules], plugins: [glsl, ...entry.plugins ?? []], loader: { ".wgsl": "text" }, legalComments: "none", charset: "utf8", logLevel: "error",
  });
  return readFileSync(join(out, name), "utf8");
}

// Names that a bundle imports from three.js.
function names(text) {
  return [...text.matchAll(/import\s*{([^}]*)}\s*from\s*"(?:\.\/three\.js|three)"/g)]
    .flatMap(([, list]) => list.split(",").map((name) => name.trim().split(" as ")[0]));
}

const licence = (name) => readFileSync(join(modules, name, "LICENSE"), "utf8").trim();
const version = (name) => JSON.parse(readFileSync(join(modules, name, "package.json"), "utf8")).version;

// build_decoder.py puts this into the decoder, which then is whole without a package; the notice goes with it.
await esbuild.build({ stdin: { contents: 'export { decompress } from "fzstd";', resolveDir: modules }, outfile: join(out, "zstd.js"), bundle: true,
  minify: true, format: "iife", globalName: "zstd", target: "es2022", banner: { js: `/*! fzstd ${version("fzstd")}\n${licence("fzstd")} */` },
  nodePaths: [modules], legalComments: "none", charset: "utf8", logLevel: "error" });

const orbit = "three/addons/controls/OrbitControls.js", outside = ["three", "three/webgpu", "athcodec-three", "athcodec-three/webgpu", "athcodec-three/model", orbit];
const loader = await bundle({ entryPoints: [join(here, "src/index.js")] }, "ATHLoader.js", outside);
await bundle({ entryPoints: [join(here, "src/webgpu.js")] }, "ATHForestGPU.js", outside);
await bundle({ entryPoints: [join(here, "src/ath_worker.js")] }, "ath_worker.js", []);
const element = await bundle({ entryPoints: [join(here, "src/element.js")] }, "ath-viewer.js", outside);
const viewer = await bundle({ entryPoints: [join(here, "page/main.js")], plugins: [forPages(BESIDE.three)] }, "viewer.js", []);
await bundle({ entryPoints: [join(here, "page/start.js")], format: "iife" }, "start.js", []);
const gltf = "three/addons/loaders/GLTFLoader.js", alias = { [gltf]: join(modules, gltf.replace("addons", "examples/jsm")) };
const controls = await bundle({ entryPoints: [join(modules, "three/examples/jsm/controls/OrbitControls.js")] }, "OrbitControls.js", ["three"]);
// Models and scripts that look at what is drawn take these. All but Points are in the bundle anyway.
const inside = ["ColorManagement", "Line", "Material", "MeshBasicMaterial", "OrthographicCamera", "Points", "Texture", "WebGLRenderTarget"];
const used = [...new Set([loader, viewer, element, controls].flatMap(names)), ...inside].sort();
await bundle({ entryPoints: [join(here, "page/model.js")], alias, plugins: [onlyModels(used)] }, "model.js", ["./three.js"]);
await bundle({ stdin: { contents: `export { ${used.join(", ")} } from "three/src/Three.js";`, resolveDir: modules }, plugins: [fewBytes] }, "three.js", []);
await bundle({ entryPoints: [join(here, "page/forest.js")], plugins: [forPages(BESIDE["three/webgpu"])] }, "forest.js", []);
await bundle({ stdin: { contents: 'export * from "three/webgpu";', resolveDir: modules } }, "three.webgpu.js", []);

for (const name of ["viewer.css", "forest.css", "gallery.css", "index.html", "forest.html"]) copyFileSync(join(here, "page", name), join(out, name));
copyFileSync(join(here, "src/index.d.ts"), join(out, "ATHLoader.d.ts"));
copyFileSync(join(here, "src/element.d.ts"), join(out, "ath-viewer.d.ts"));
copyFileSync(join(here, "src/webgpu.d.ts"), join(out, "ATHForestGPU.d.ts"));
const packages = [["three", "three.js, three.webgpu.js, OrbitControls.js, model.js"], ["fzstd", "zstd.js, in ath_worker.js and ath_decoder.mjs"]];
const licences = [`athcodec (all that is not named below)\n\n${readFileSync(join(here, "../../LICENSE"), "utf8")}`,
  ...packages.map(([name, where]) => `${name} ${version(name)} (${where})\n\n${licence(name)}\n`)];
writeFileSync(join(out, "LICENSES.txt"), licences.join(`\n${"-".repeat(80)}\n\n`));
