// What React draws of a plant that useLoader of @react-three/fiber loads: node use_loader.mjs PACKAGES FILE, in whose folder
// PACKAGES react, react-dom and @react-three/fiber are installed. Prints as JSON what was drawn.
import { createRequire } from "node:module";
import { join } from "node:path";
import { Writable } from "node:stream";
import { pathToFileURL } from "node:url";

import { ATHLoader, Line, read } from "./loading.mjs";

const [packages, path] = process.argv.slice(2), { resolve } = createRequire(join(packages, "here.js"));
const of = (name) => import(pathToFileURL(resolve(name)).href);
const [{ createElement, Suspense }, { renderToPipeableStream }, { useLoader }] =
  await Promise.all(["react", "react-dom/server", "@react-three/fiber"].map(of));

const data = read(path), line = new Line(data);

function Plant() {
  const { object, motion } = useLoader(ATHLoader, line.url);
  return createElement("p", null, `${object.type} of ${motion.levelCount} levels`);
}

const found = { drawn: "", errors: [] };
const sink = new Writable({ write: (bytes, _, done) => { found.drawn += bytes; done(); } });
const fallback = createElement("p", null, "loading");
await new Promise((done) => {
  sink.on("finish", done);
  const stream = renderToPipeableStream(createElement(Suspense, { fallback }, createElement(Plant)), {
    onShellReady: () => { stream.pipe(sink); line.allow(data.length); },
    onError: (error) => { found.errors.push(String(error)); },
  });
});
console.log(JSON.stringify(found));
process.exit();
