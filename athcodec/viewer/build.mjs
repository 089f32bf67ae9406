// Bundles src and page into the folder given: `node build.mjs FOLDER`, with the packages of package.json on NODE_PATH.
// build_viewer.py calls it.

import { copyFileSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
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
  onResolve({ filter: /^whole-shaders$/ }, ({ path }) => ({ path, namespace: "shaders" }));
  onLoad({ filter: /./, namespace: "shaders" }, () => ({
    contents: `import { ShaderChunk } from "three"; Object.assign(ShaderChunk, ${JSON.stringify(wholeChunks())});`, resolveDir: modules }));
  onLoad({ filter: /./, namespace: "split" }, () => ({
    contents: `export { ${used.join(", ")} } from "page"; export * from "three/src/Three.Core.js";`, resolveDir: modules }));
} });

// What the materials of plants, sky and ground never have; those of models can have it, so model.js brings whole shaders.
const NEVER = new RegExp(`^(${["USE_(CLEARCOAT|SHEEN|IRIDESCENCE|TRANSMISSION|ANISOTROPY|ENVMAP|MORPH|BATCHING|LIGHT_PROBES|SKINNING|DISPERSION|RETROREFLECT)\\w*",
  "USE_(ALPHA|AO|BUMP|DISPLACEMENT|EMISSIVE|LIGHT|METALNESS|NORMAL|ROUGHNESS|SPECULAR\\w*|THICKNESS)_?MAP\\w*", "USE_NORMALMAP_\\w+", "USE_(MAP|MATCAP|GRADIENTMAP|ALPHAHASH)",
  "USE_(LOGARITHMIC|REVERSED)_DEPTH_BUFFER", "USE_DIFFUSE_ROUGHNESS\\w*", "NUM_(RECT_AREA|SPOT|POINT|SUN)_LIGHT\\w*", "DITHERING", "PREMULTIPLIED_ALPHA", "ENVMAP_\\w+", "FLAT_SHADED", "IS_POINTS"].join("|")})$`);
const NOT_DRAWN = /(meshtoon|meshmatcap|meshphong|meshnormal|sprite|linedashed|equirect|backgroundCube|background)\.glsl\.js$/;

// Whether a condition can only be false: alternatives of such names, or a conjunction with one of them.
function isNever(line) {
  const [, word, condition] = /^#(ifdef|if)\s+(.*)$/.exec(line) ?? [];
  if (!word || (condition.includes("&&") && condition.includes("||"))) return false;
  const terms = condition.split(/&&|\|\|/).map((term) => term.replace(/[()\s]|defined/g, "").replace(/>0$/, "")), isOne = (term) => NEVER.test(term);
  return condition.includes("&&") ? terms.some(isOne) : terms.every(isOne);
}

/** Takes the branches out that such conditions hide. */
function pruned(text) {
  const out = [], open = []; // of each condition that is open: whether it is cut, and whether its branch is left out
  for (const line of text.split("\n")) {
    const word = /^\s*#\s*(\w+)/.exec(line)?.[1], hidden = open.some(({ out: isOut }) => isOut);
    if (word?.startsWith("if")) {
      const never = !hidden && isNever(line.trim());
      open.push({ cut: never, out: never });
      if (!hidden && !never) out.push(line);
    } else if (word === "elif" && open.at(-1).cut) {
      const last = open.at(-1), outer = open.slice(0, -1).some(({ out: isOut }) => isOut);
      if (last.out && !outer) {
        Object.assign(last, { cut: false, out: false });
        out.push(line.replace("elif", "if"));
      }
    } else if (word === "else" && open.at(-1).cut) open.at(-1).out = !open.at(-1).out;
    else if (word === "endif") {
      const { cut } = open.pop();
      if (!cut && !open.some(({ out: isOut }) => isOut)) out.push(line);
    } else if (!hidden) out.push(line);
  }
  return out.join("\n");
}

const CHUNKS = join(modules, "three/src/renderers/shaders/ShaderChunk");
const glslOf = (file) => /`([^`]*)`/.exec(short(readFileSync(join(CHUNKS, file), "utf8")))?.[1] ?? "";
const wholeChunks = () => Object.fromEntries(readdirSync(CHUNKS).map((file) => [file.replace(".glsl.js", ""), glslOf(file)]).filter(([, text]) => pruned(text) !== text));

// three.js from its sources: without virtual reality and maps of surroundings, which no page here has, and with shaders in few bytes.
const NO_XR = `export class WebXRManager {
  enabled = false; isPresenting = false; cameraAutoUpdate = false;
  addEventListener() {} removeEventListener() {} setAnimationLoop() {} dispose() {} getCamera() {}
  hasDepthSensing() { return false; } getEnvironmentBlendMode() { return null; } getDepthSensingMesh() { return null; }
}`;
// Methods that no page calls: scenes as JSON.
const UNUSED = /\n\t(?:toJSON|fromJSON)\([^\n]*\{\n[^]*?\n\t\}(?=\n)/g;
const fewBytes = { name: "few bytes", setup: ({ onLoad }) => {
  onLoad({ filter: /WebXRManager\.js$/ }, () => ({ contents: NO_XR }));
  onLoad({ filter: /WebGLEnvironments\.js$/ }, ({ path }) => // pages have lights and no maps of surroundings
    ({ contents: readFileSync(path, "utf8").replace(/^import .*PMREMGenerator.*$/m, "class PMREMGenerator {}") }));
  onLoad({ filter: /three.src.(animation|core|extras|lights|materials|objects|textures|cameras|math).*\.js$/ }, ({ path }) =>
    ({ contents: readFileSync(path, "utf8").replace(UNUSED, "") }));
  onLoad({ filter: NOT_DRAWN }, ({ path }) => ({ contents: readFileSync(path, "utf8").replace(/`[^`]*`/g, '""') }));
  onLoad({ filter: /ShaderLib.\w+\.glsl\.js$/ }, ({ path }) => ({ contents: short(readFileSync(path, "utf8")) }));
  onLoad({ filter: /ShaderChunk.\w+\.glsl\.js$/ }, ({ path }) => ({ contents: short(readFileSync(path, "utf8")).replace(/`([^`]*)`/, (_, text) => `\`${pruned(text)}\``) }));
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
const inside = ["ColorManagement", "Line", "Material", "MeshBasicMaterial", "OrthographicCamera", "Points", "ShaderChunk", "Texture", "WebGLRenderTarget"];
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
