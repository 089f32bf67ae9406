// Bundles src and page into the folder given: `node build.mjs FOLDER`, with the packages of package.json on NODE_PATH.
// build_viewer.py calls it.

import { copyFileSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, dirname, join } from "node:path";
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
  "USE_(LOGARITHMIC|REVERSED)_DEPTH_BUFFER", "USE_DIFFUSE_ROUGHNESS\\w*", "NUM_(RECT_AREA|SPOT|POINT|SUN)_LIGHT\\w*", "NUM_(CLIPPING_PLANES|LIGHT_PROBE_GRIDS)", "SHADOWMAP_TYPE_(VSM|BASIC)", "DITHERING", "PREMULTIPLIED_ALPHA", "ENVMAP_\\w+", "FLAT_SHADED", "IS_POINTS"].join("|")})$`);
const NOT_DRAWN = /(vsm|cube|ShaderLib.shadow|meshtoon|meshmatcap|meshphong|meshnormal|sprite|linedashed|equirect|backgroundCube|background)\.glsl\.js$/;

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

/** Takes the functions out of a shader's text that are not used. */
function withoutFunctions(text, uses) {
  let out = "", at = 0;
  for (const { index, 0: { length }, 1: name } of text.matchAll(/^(?:highp )?\w+ (\w+)\([^()]*\)\s*\{/gm)) {
    if (index < at || uses.has(name)) continue;
    let end = index + length;
    for (let depth = 1; depth > 0 && end < text.length; end++) depth += { "{": 1, "}": -1 }[text[end]] ?? 0;
    out += text.slice(at, index);
    at = end;
  }
  return out + text.slice(at);
}

const CHUNKS = join(modules, "three/src/renderers/shaders/ShaderChunk");
const glslOf = (file) => /`([^`]*)`/.exec(short(readFileSync(join(CHUNKS, file), "utf8")))?.[1] ?? "";

// Chunks by file, without what the pages' own shaders have no use for.
function leanChunks() {
  const chunks = Object.fromEntries(readdirSync(CHUNKS).map((file) => [file, pruned(glslOf(file))]));
  const callers = [join(here, "src"), join(here, "page"), join(CHUNKS, "../ShaderLib")].flatMap((folder) => readdirSync(folder).filter((file) => /\.js$/.test(file) && !NOT_DRAWN.test(file))
    .map((file) => readFileSync(join(folder, file), "utf8"))).join("\n") + readFileSync(join(CHUNKS, "../../webgl/WebGLProgram.js"), "utf8").replace(/\b(?!ACESFilmic)\w+ToneMapping/g, ""); // the one that pages ask for
  for (let before = ""; before !== JSON.stringify(chunks);) {
    before = JSON.stringify(chunks);
    const words = `${callers}\n${Object.values(chunks).join("\n")}`.match(/\w+/g), counts = new Map();
    for (const word of words) counts.set(word, (counts.get(word) ?? 0) + 1);
    for (const [file, text] of Object.entries(chunks)) {
      const defined = new Map();
      for (const [, name] of text.matchAll(/^(?:highp )?\w+ (\w+)\([^()]*\)\s*\{/gm)) defined.set(name, (defined.get(name) ?? 0) + 1);
      chunks[file] = withoutFunctions(text, { has: (name) => counts.get(name) > (defined.get(name) ?? 0) });
    }
  }
  return chunks;
}
const CHUNK = leanChunks();
const wholeChunks = () => Object.fromEntries(Object.entries(CHUNK).map(([file, lean]) => [file.replace(".glsl.js", ""), glslOf(file), lean]).filter(([, text, lean]) => lean !== text));

// What no page here asks of three.js: virtual reality, maps of surroundings, post-processing, blocks of uniforms, several cameras.
const UNUSED = {
  WebXRManager: `export class WebXRManager {
    enabled = false; isPresenting = false; cameraAutoUpdate = false;
    addEventListener() {} removeEventListener() {} setAnimationLoop() {} dispose() {} getCamera() {}
    hasDepthSensing() { return false; } getEnvironmentBlendMode() { return null; } getDepthSensingMesh() { return null; }
  }`,
  WebGLEnvironments: "export function WebGLEnvironments() { return { get: (texture) => texture ?? null, dispose() {} }; }",
  WebGLOutput: "export class WebGLOutput {}",
  WebGLUniformsGroups: "export class WebGLUniformsGroups { dispose() {} }",
  FrustumArray: "export class FrustumArray {}",
  CubeCamera: "export class CubeCamera {}",
};

// Methods of the classes of three.js, and of its renderer, as its sources lay them out; those that no bundle calls are left out.
const CLASSES = /three.src.(animation|cameras|core|extras|geometries|lights|loaders|materials|math|objects|scenes|textures|renderers.WebGL)\w*.*\.js$/;
const METHOD = /\n\t(?:static |async )*(?:[gs]et )?(\w+)\([^\n]*\)? \{\n[^]*?\n\t\}(?=\n)/g, ASSIGNED = /\n\t\tthis\.(\w+) = (?:async )?function[^\n]*\{\n[^]*?\n\t\t\};(?=\n)/g;
const NO_METHOD = /^(constructor|if|for|while|switch|function)$/, NEVER_CALLED = /^(toJSON|fromJSON|raycast)$/; // Such methods only call each other.
const DEFINED = /(?<=[{};*]|\b(?:get|set|static|async) )\w+(?=\()|(?<=this\.)\w+(?==(?:async )?function)/g;
const CALLED_BY_SCRIPTS = ["getDistance", "project", "readRenderTargetPixels"]; // which look at what is drawn
const wordsIn = (text) => new Set(text.replace(DEFINED, "").match(/[A-Za-z_$][\w$]*/g));
const without = (text, uses) => [METHOD, ASSIGNED].reduce((left, methods) => left.replace(methods, (all, name) => ((uses.has(name) && !NEVER_CALLED.test(name)) || NO_METHOD.test(name) ? all : "")), text);

// Marks of classes, as in `isSprite`: where no bundle has the class, none of its objects come, and what three.js does with them is left out.
const MARK = /[A-Za-z_$][\w$]*(?:\.[A-Za-z_$][\w$]*|\[[^\]\n]*\])*\.(is[A-Z]\w+)\b(?! =[^=])/g, MARKED = /this\.(is[A-Z]\w+) = true/g, MARKS = new Set();
for (const file of readdirSync(join(modules, "three/src"), { recursive: true }))
  if (/\.js$/.test(file)) for (const [, mark] of readFileSync(join(modules, "three/src", file), "utf8").matchAll(MARKED)) MARKS.add(mark);
const marksIn = (text) => new Set([...text.matchAll(/\b(is[A-Z]\w+)[=:]!0/g)].map(([, mark]) => mark));
const withoutMarks = (text, marks) => text.replace(MARK, (all, mark) => (MARKS.has(mark) && !marks.has(mark) ? "false" : all));

const WARNINGS = /^\t+(warn|warnOnce)\( .* \);$/gm; // for who writes pages with three.js

const fewBytes = (text, callers) => ({ name: "few bytes", setup: ({ onLoad }) => {
  const uses = wordsIn(text), marks = marksIn(text), called = wordsIn(callers);
  const sourceOf = (path) => {
    const folder = basename(dirname(path)), name = basename(path).replace(/(\.glsl)?\.js$/, "");
    if (name in UNUSED) return UNUSED[name];
    const source = readFileSync(path, "utf8").replace(WARNINGS, "");
    if (NOT_DRAWN.test(path)) return source.replace(/`[^`]*`/g, '""');
    if (folder === "ShaderLib") return short(source);
    if (folder === "ShaderChunk") return short(source).replace(/`[^`]*`/, () => `\`${CHUNK[`${name}.glsl.js`]}\``);
    if (name === "MathUtils") return source.replace(/\n\t(\w+): \1,?/g, (all, member) => (called.has(member) ? all : ""));
    const left = withoutMarks(CLASSES.test(path) ? without(source, uses) : source, marks);
    return name === "Color" ? left.replace(/(_colorKeywords = )\{[^}]*\}/, "$1{}") : left;
  };
  onLoad({ filter: /three.src.*\.js$/ }, ({ path }) => ({ contents: sourceOf(path) }));
} });

// Pages name the files beside them and need no import map, which a site's policy may forbid.
const BESIDE = { three: "./three.js", "three/webgpu": "./three.webgpu.js", "athcodec-three/model": "./model.js" };
const INSIDE = { "athcodec-three": join(here, "src/index.js"), "athcodec-three/webgpu": join(here, "src/webgpu.js") };
const forPages = (three) => ({ name: "pages", setup: ({ onResolve }) => onResolve({ filter: /^(three|athcodec-three)(\/|$)/ }, ({ path }) => {
  if (path in INSIDE) return { path: INSIDE[path] };
  return path in BESIDE ? { path: path === "three" ? three : BESIDE[path], external: true } : null;
}) });

const OPTIONS = { format: "esm", bundle: true, minify: true, target: "es2022", nodePaths: [modules], loader: { ".wgsl": "text" }, legalComments: "none", charset: "utf8", logLevel: "error" };

async function bundle(entry, name, external) {
  await esbuild.build({ ...OPTIONS, ...entry, outfile: join(out, name), external, plugins: [glsl, ...entry.plugins ?? []] });
  return readFileSync(join(out, name), "utf8");
}

// viewer.js, and later.js, which comes behind the first picture. It names the page's main module, so all that both need is in one
// chunk, which becomes viewer.js; what is left of the entry only imports it.
async function bundlePage() {
  const { outputFiles } = await esbuild.build({ ...OPTIONS, entryPoints: { entry: join(here, "page/main.js") }, outdir: out, splitting: true, chunkNames: "[name]", write: false,
    plugins: [glsl, forPages(BESIDE.three)] });
  const texts = Object.fromEntries(outputFiles.map(({ path, text }) => [basename(path), text.replaceAll('"./chunk.js"', '"./viewer.js"')]));
  for (const [name, from] of [["viewer.js", "chunk.js"], ["later.js", "later.js"]]) writeFileSync(join(out, name), texts[from]);
  return texts["chunk.js"] + texts["later.js"];
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
const viewer = await bundlePage();
await bundle({ entryPoints: [join(here, "page/start.js")], format: "iife" }, "start.js", []);
const gltf = "three/addons/loaders/GLTFLoader.js", alias = { [gltf]: join(modules, gltf.replace("addons", "examples/jsm")) };
const controls = await bundle({ entryPoints: [join(modules, "three/examples/jsm/controls/OrbitControls.js")] }, "OrbitControls.js", ["three"]);
// Models and scripts that look at what is drawn take these. All but Points are in the bundle anyway.
const inside = ["ColorManagement", "Line", "Material", "MeshBasicMaterial", "OrthographicCamera", "Points", "ShaderChunk", "Texture", "WebGLRenderTarget"];
const used = [...new Set([loader, viewer, element, controls].flatMap(names)), ...inside].sort();
await bundle({ entryPoints: [join(here, "page/model.js")], alias, plugins: [onlyModels(used)] }, "model.js", ["./three.js"]);
const model = readFileSync(join(out, "model.js"), "utf8"), callers = [loader, viewer, element, controls, model, CALLED_BY_SCRIPTS.join(" ")].join("\n");
for (let three = "", before = null; before !== three;) { // What is kept calls others, which the next round keeps.
  before = three;
  three = await bundle({ stdin: { contents: `export { ${used.join(", ")} } from "three/src/Three.js";`, resolveDir: modules }, plugins: [fewBytes(`${callers}\n${three}`, callers)] }, "three.js", []);
}
await bundle({ entryPoints: [join(here, "page/forest.js")], plugins: [forPages(BESIDE["three/webgpu"])] }, "forest.js", []);
await bundle({ stdin: { contents: 'export * from "three/webgpu";', resolveDir: modules } }, "three.webgpu.js", []);

for (const name of ["forest.css", "gallery.css", "index.html", "forest.html"]) copyFileSync(join(here, "page", name), join(out, name));
await bundle({ entryPoints: [join(here, "page/viewer.css")] }, "viewer.css", []);
copyFileSync(join(here, "src/index.d.ts"), join(out, "ATHLoader.d.ts"));
copyFileSync(join(here, "src/element.d.ts"), join(out, "ath-viewer.d.ts"));
copyFileSync(join(here, "src/webgpu.d.ts"), join(out, "ATHForestGPU.d.ts"));
const packages = [["three", "three.js, three.webgpu.js, OrbitControls.js, model.js"], ["fzstd", "zstd.js, in ath_worker.js and ath_decoder.mjs"]];
const licences = [`athcodec (all that is not named below)\n\n${readFileSync(join(here, "../../LICENSE"), "utf8")}`,
  ...packages.map(([name, where]) => `${name} ${version(name)} (${where})\n\n${licence(name)}\n`)];
writeFileSync(join(out, "LICENSES.txt"), licences.join(`\n${"-".repeat(80)}\n\n`));
