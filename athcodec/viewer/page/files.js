// Files: where they come from, how they are opened, and what is said where they cannot be.

import { app, counters, loader, state } from "./app.js";
import { Plant } from "./plant.js";
import { floorOf } from "./places.js";
import { discard } from "./sky.js";
import { otherKind, shownWithout, wordsOf } from "./trouble.js";
import { $ } from "./ui.js";

let first = true, asked = 0; // whether nothing has been open yet; the newest wish to open a file

// A page that carries its file and its worker: see serve.py.
function embedded() {
  const worker = $("ath-worker"), file = $("ath-file");
  if (worker) loader.setDecoderPath(URL.createObjectURL(new Blob([worker.textContent], { type: "text/javascript" })));
  if (!file) return false;
  const mesh = $("ath-mesh");
  if (mesh) loader.setHostMesh(new Float32Array(bytesOf(mesh)));
  app.floor = [...document.querySelectorAll(".ath-floor")].map((each) => ({ source: bytesOf(each), each: Number(each.dataset.each) }));
  openFirst({ bytes: bytesOf(file) }, file.dataset.name, file.dataset.clip);
  return true;
}

function bytesOf(element) {
  return Uint8Array.from(atob(element.textContent.trim()), (character) => character.charCodeAt(0)).buffer;
}

async function fetched(url) {
  const answer = await fetch(url).catch(({ message: status }) => ({ ok: false, status }));
  if (!answer.ok) throw Object.assign(new Error(`${url}: got status ${answer.status}`), { codeName: "HTTP" });
  return answer.arrayBuffer();
}

// The mesh of a file that does not hold its rest pose: binary32, as it was in the file's source.
const fetchMesh = async (url) => loader.setHostMesh(new Float32Array(await fetched(url)));

// With one of its clips.
function openFirst(source, name, clip = null) {
  return open(source, name, false, null, clip);
}

const nameOf = (path) => decodeURIComponent(path.split("/").pop().split("?")[0]);

/** Opens what the page carries or its address names. */
function openAddress() {
  if (embedded()) return;
  const wanted = new URLSearchParams(location.search), url = wanted.get("file"), second = wanted.get("compare");
  app.floor = floorOf(wanted);
  const mesh = wanted.get("mesh"), ready = mesh ? fetchMesh(mesh) : null;
  const openIt = () => openFirst(url, nameOf(url), wanted.get("clip"));
  if (url) (ready?.then(openIt, refuse) ?? openIt()).then(() => second && app.opened.length && open(second, nameOf(second), true));
  else ask();
}

function ask() {
  say("Plants in motion", "Look at one of these, or open an .ath file, or a GLB that holds one. A file of yours stays on this device.");
  app.loadingStory(null);
  app.later().then(() => { if (asked === 0) app.beginStart(); });
}

function say(title, text, technical = "", again = null) {
  const message = $("message");
  message.querySelector("h2").textContent = title;
  message.querySelector("p").textContent = text;
  message.querySelector("small").textContent = technical;
  $("again").hidden = !again;
  $("again").onclick = again;
  message.hidden = false;
  app.endStart?.();
  breath().then(() => app.staged).then(app.bare);
}

/** Says that nothing can be shown. */
function refuse(error, again = null, words = wordsOf(error.codeName)) {
  const { title, advice, passing } = words;
  say(title, advice, error.message, passing ? again : null);
  app.loadingStory(null);
}

// A fault of the file that is shown stays in view as long as the file does.
function complain(failure, motion, again) {
  const box = $("trouble");
  box.querySelector("span").textContent = shownWithout(failure, motion);
  box.title = failure.message;
  box.querySelector("button").hidden = failure.type !== "stopped" || !again;
  box.querySelector("button").onclick = again;
  box.hidden = false;
}

const HEAD_BYTES = 16; // which tell kinds of files apart

async function headOf(source) {
  if (typeof source !== "string") return new Uint8Array(source.bytes.slice(0, HEAD_BYTES));
  const answer = await fetch(source, { headers: { Range: `bytes=0-${HEAD_BYTES - 1}` } }).catch(() => null);
  return answer?.status === 206 ? new Uint8Array(await answer.arrayBuffer()) : new Uint8Array(0);
}

// A URL, or {bytes}; a GLB comes whole.
async function load(source) {
  const byName = typeof source === "string", isModel = byName ? /\.glb([?#]|$)/i.test(source) : new TextDecoder().decode(source.bytes.slice(0, 4)) === "glTF";
  if (!isModel) return byName ? loader.loadAsync(source) : loader.parseAsync(source.bytes);
  const { bandwidth, clip } = loader, { openModel } = await import("athcodec-three/model"); // settings of this file
  const bytes = byName ? await fetched(source) : source.bytes, opening = openModel(bytes, loader.setBandwidth(bandwidth).setClip(clip));
  return opening.finally(() => loader.setBandwidth(null).setClip(null));
}

function close(files) {
  for (const each of files) {
    discard(each.model);
    for (const ath of [each, ...each.others ?? []]) ath.dispose();
  }
}

/** Opens a URL or {bytes}, in place of what is open or beside it. `again`: what is to stay as it is, of a file that is loaded anew. */
async function open(source, name, beside = false, again = null, clip = null) {
  const wish = ++asked, retry = () => open(source, name, beside, again, clip);
  $("message").hidden = true;
  app.endStart?.();
  if (!beside) {
    Object.assign(counters, { started: performance.now(), firstPicture: null, firstMotion: null, arrived: {}, pictures: 0 });
    $("trouble").hidden = true;
    app.loadingStory(name);
  }
  let ath;
  try {
    loader.setClip(clip);
    const loading = load(source);
    loader.setClip(null);
    app.coming ??= loading.catch(() => {});
    ath = await loading;
  } catch (error) {
    const words = error.codeName === "NOT_AN_ATH_FILE" ? otherKind(await headOf(source), name) : null;
    if (wish === asked) refuse(error, typeof source === "string" ? retry : null, words ?? undefined);
    return;
  }
  if (wish !== asked) {
    ath.dispose();
    return;
  }
  Object.assign(ath, { fileName: name, source, isAsked: clip !== null });
  if (!beside && !ath.isAsked) ath.motion.play(app.usualClip(ath).index, { fade: 0 });
  if (!beside) app.watchArrival(ath);
  if (beside) {
    close(app.opened.splice(1));
    app.playIn(ath.motion, app.opened[0].motion.clip.name);
  } else {
    close(app.opened.splice(0));
    Object.assign(state, { time: 0, turns: 0, loop: null, wind: null }, again);
  }
  app.opened.push(ath);
  const tell = (failure) => complain(failure, ath.motion, typeof source === "string" ? retry : null);
  for (const type of ["stopped", "damaged"]) ath.motion.addEventListener(type, tell);
  if (ath.motion.failure) tell(ath.motion.failure);
  app.compare.set(beside ? "file" : "off");
  await show(ath, beside, again, () => wish === asked);
}

async function show(ath, beside, again, isWanted) {
  await app.staged;
  if (!app.stage) return; // a browser that cannot draw
  if (!again) app.stage.moved = false;
  await breath();
  const plant = beside ? null : new Plant(ath);
  plant?.prepare(1, 1);
  if (plant) await app.stage.compile([plant.root]);
  if (!isWanted()) {
    plant?.dispose();
    return;
  }
  app.arrange(plant);
  if (!app.stage.moved) app.frameView();
  app.tellSizes();
  if (first) app.restore();
  if (first) app.beginIntro();
  first = false;
}

// Lets the page answer between two pieces of work.
const breath = () => new Promise((done) => { setTimeout(done); });

/** Plays the loading of the first file again, at so many bits a second. */
async function loadAgain(bandwidth) {
  const [{ source, fileName, motion: { clip } }] = app.opened;
  app.clear();
  close(app.opened.splice(0));
  app.replayed(bandwidth);
  loader.setBandwidth(bandwidth);
  const done = open(source, fileName, false, { loop: state.loop }, clip.name || null);
  loader.setBandwidth(null);
  await done;
}

async function openFile(file, beside) {
  if (!file) return;
  app.replayed(null);
  await open({ bytes: await file.arrayBuffer() }, file.name, beside && app.opened.length > 0);
}

/** Asks for a file. */
function choose(beside = "") {
  $("file").dataset.beside = beside;
  $("file").click();
}

export default function begin() {
  Object.assign(app, { nameOf, openAddress, refuse, open, loadAgain, choose });
  $("open").addEventListener("click", () => choose());
  $("message-open").addEventListener("click", () => choose());
  $("file").addEventListener("change", async () => {
    await openFile($("file").files[0], $("file").dataset.beside === "yes");
    $("file").value = "";
  });
  let dragging = 0;
  addEventListener("dragenter", (event) => { event.preventDefault(); dragging++; $("drop").hidden = false; });
  addEventListener("dragleave", () => { if (--dragging <= 0) $("drop").hidden = true; });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", async (event) => {
    event.preventDefault();
    dragging = 0;
    $("drop").hidden = true;
    const files = [...event.dataTransfer.files];
    await openFile(files[0], event.shiftKey);
    if (files[1]) await openFile(files[1], true);
  });
}
