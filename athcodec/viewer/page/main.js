// The viewer: opens a file by ?file=URL, by dropping it, or one that the page itself carries, and plays it.

import { Box3, BufferGeometry, Color, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, Vector3 } from "three";
import { ATHForest, ATHLoader, dataTexture, injectMotion, motionUniforms } from "athcodec-three";

import { heatGradient, nodeColour } from "./colours.js";
import { limbMaterial } from "./limbs.js";
import { lineMaterial, meshMaterial, Plant } from "./plant.js";
import { readback } from "./readback.js";
import { Stage } from "./stage.js";
import { $, bytesText, Choice, countText, lengthText, paintReady, rateText, rows, upper } from "./ui.js";

const SPEEDS = ["0.1", "0.25", "0.5", "1", "2", "4"];
const GOLDEN = Math.PI * (3 - Math.sqrt(5));
const FADE = 0.4; // seconds, from one clip to the next

const loader = new ATHLoader();
// `time` is that of the clip, `turns` that of the rounds before; `loop`: null, as is usual for the file, or what was chosen.
const state = { playing: true, speed: 1, loop: null, time: 0, turns: 0, forest: null, dirty: true, name: "" };
const counters = { frames: 0, fps: 0, frameMs: 0, since: performance.now(), pictures: 0, started: 0, firstPicture: null, firstMotion: null };
let plants = [], opened = [], last = 0;

const words = { NOT_AN_ATH_FILE: "This is not an .ath file", UNSUPPORTED_VERSION: "This file is of another version of the format",
  HTTP: "The file cannot be fetched", NETWORK: "The file cannot be fetched", MISSING: "The file is cut off too early", TRUNCATED: "The file is cut off too early",
  NEEDS_HOST_MESH: "This file needs the mesh that it was made for", WRONG_HOST_MESH: "The mesh is not the one that this file was made for",
  CLIP: "The file has no such clip", CHANGED: "The file has changed", WORKER: "The decoder cannot be started" };

begin(); // the file is on its way while the stage is set up, which takes longer
loader.preload();
const stage = new Stage($("canvas"), () => { state.dirty = true; }, () => { if (plants.length > 0 && !stage.moved) frameView(); });
const unmoved = motionUniforms();
unmoved.athData.value = dataTexture(new Float32Array(4096));
stage.warm([new Mesh(new BufferGeometry(), limbMaterial(unmoved)), new Mesh(new BufferGeometry(), injectMotion(meshMaterial(), unmoved)),
  new LineSegments(new BufferGeometry(), injectMotion(lineMaterial(), unmoved))]);
if (matchMedia("(max-width: 680px)").matches) togglePanel();

// ---- files ----

// A page that carries its file and its worker: see serve.py.
function embedded() {
  const worker = $("ath-worker"), file = $("ath-file");
  if (worker) loader.setDecoderPath(URL.createObjectURL(new Blob([worker.textContent], { type: "text/javascript" })));
  if (!file) return false;
  const mesh = $("ath-mesh");
  if (mesh) loader.setHostMesh(new Float32Array(bytesOf(mesh)));
  openFirst({ bytes: bytesOf(file) }, file.dataset.name, file.dataset.clip);
  return true;
}

function bytesOf(element) {
  return Uint8Array.from(atob(element.textContent.trim()), (character) => character.charCodeAt(0)).buffer;
}

// The mesh of a file that does not hold its rest pose: binary32, as it was in the file's source.
async function fetchMesh(url) {
  const answer = await fetch(url).catch(({ message }) => ({ ok: false, status: message }));
  if (!answer.ok) throw Object.assign(new Error(`${url}: got status ${answer.status}`), { codeName: "HTTP" });
  loader.setHostMesh(new Float32Array(await answer.arrayBuffer()));
}

// With one of its clips.
function openFirst(source, name, clip = null) {
  loader.setClip(clip);
  const done = open(source, name);
  loader.setClip(null);
  return done;
}

function begin() {
  if (embedded()) return;
  const wanted = new URLSearchParams(location.search), url = wanted.get("file"), second = wanted.get("compare");
  const mesh = wanted.get("mesh"), ready = mesh ? fetchMesh(mesh) : null;
  const nameOf = (path) => decodeURIComponent(path.split("/").pop().split("?")[0]);
  const first = () => openFirst(url, nameOf(url), wanted.get("clip"));
  if (url) (ready?.then(first, refuse) ?? first()).then(() => second && opened.length && open(second, nameOf(second), true));
  else refuse({ message: "Drop an .ath file here, or open one. It stays on this computer.", codeName: "none" });
  if (!url) $("message").querySelector("h2").textContent = "No file yet";
}

function refuse(error) {
  console.warn(`athcodec: ${error.message}`);
  $("message").querySelector("h2").textContent = words[error.codeName] ?? "The file is damaged";
  $("message").querySelector("p").textContent = error.message;
  $("message").hidden = false;
}

function note(text) {
  $("note").textContent = text;
  $("note").hidden = false;
  clearTimeout(note.timer);
  note.timer = setTimeout(() => { $("note").hidden = true; }, 6000);
}

// A URL, or {bytes}.
function load(source) {
  if (typeof source === "string") return loader.loadAsync(source);
  return loader.parseAsync(source.bytes);
}

async function open(source, name, beside = false) {
  $("message").hidden = true;
  if (!beside) Object.assign(counters, { started: performance.now(), firstPicture: null, firstMotion: null, pictures: 0 });
  let ath;
  try {
    ath = await load(source);
  } catch (error) {
    refuse(error);
    return;
  }
  ath.fileName = name;
  if (!beside) {
    for (const each of opened) each.dispose();
    opened = [];
    Object.assign(state, { time: 0, turns: 0, loop: null });
  } else {
    for (const each of opened.splice(1)) each.dispose();
    playIn(ath.motion, opened[0].motion.clip.name);
  }
  opened.push(ath);
  const tell = ({ type, message }) => note(type === "damaged" ? `Shown without what is damaged: ${message}` : message);
  for (const type of ["stopped", "damaged"]) ath.motion.addEventListener(type, tell);
  if (ath.motion.failure) tell(ath.motion.failure);
  compare.set(beside ? "file" : "off");
  stage.moved = false;
  await breath();
  const plant = beside ? null : new Plant(ath);
  plant?.prepare(1, 1);
  await breath();
  arrange(plant);
  await breath();
  frameView();
}

// Lets the page answer between two pieces of work.
const breath = () => new Promise((done) => { setTimeout(done); });

function describe() {
  const [ath] = opened, { info, clips } = ath.motion, counts = [...new Set(clips.map((clip) => clip.frameCount))];
  const frames = clips.length > 1 && counts.length === 1 ? `${countText(counts[0])} frames each` : `${countText(info.frameCount)} frames`;
  $("name").textContent = opened.map((each) => each.fileName).join("  ·  ");
  document.title = `${ath.fileName} – athcodec`;
  $("summary").textContent = [`${countText(info.vertexCount)} vertices`, `${countText(info.branchCount)} branches`,
    clips.length > 1 ? `${clips.length} clips, ${frames}` : frames].join(", ");
}

// ---- what is on the stage ----

// Plants and panes for the files that are open and what is chosen. `first`: that of the first file, if there is one.
function arrange(first = null) {
  for (const plant of plants) {
    plant.dispose();
    if (plant.motion !== plant.ath.motion) plant.motion.dispose();
  }
  const [ath] = opened;
  plants = [first ?? new Plant(ath)];
  if (compare.value === "levels") plants = [new Plant(ath, ath.motion.clone()), ...plants];
  if (compare.value === "file" && opened[1]) plants.push(new Plant(opened[1]));
  for (const plant of plants) {
    if (plant.show !== show.value) plant.setShow(show.value);
    if (plant.colour !== colour.value) plant.setColour(colour.value);
    plant.beside = plants;
    plant.onPaint = () => { state.dirty = true; };
    plant.motion.addEventListener("frame", () => pictured(plant));
    plant.motion.addEventListener("clip", fromTheStart);
    plant.motion.addEventListener("ready", () => { state.dirty = true; });
  }
  if (plants.length > 1) forestSwitch(false);
  stage.setPanes(plants.map((plant) => ({
    scene: stage.scene([plant.root]), before: (width, height) => plant.prepare(width, height),
  })));
  place();
  levelControls();
  setLevel(level.value ?? "auto");
  clipControls();
  setLoop(state.loop);
  describe();
  $("compare-level-row").hidden = compare.value !== "levels";
  labels();
  if (state.forest) forestOn();
}

function pictured(plant) {
  state.dirty = true;
  if (plant !== plants.at(-1)) return;
  counters.pictures++;
}

// When the first picture was drawn, and the first that differs from it.
function markFirst() {
  const { motion } = plants.at(-1);
  if (motion.level < 0 || counters.firstMotion) return;
  const now = { ms: performance.now() - counters.started, bytes: motion.bytesFetched, frame: motion.frame };
  counters.firstPicture ??= now;
  if (motion.frame !== counters.firstPicture.frame) counters.firstMotion = now;
}

// The world's box of all rest poses.
function box() {
  const all = new Box3();
  for (const { ath, root } of plants) {
    root.updateMatrixWorld(true);
    all.union(ath.box.clone().applyMatrix4(root.matrixWorld));
  }
  return all;
}

function place() {
  const all = box(), size = all.getSize(new Vector3());
  stage.placeGround(all.min.y, (state.forest ? 2.6 * forestRadius() : 1.9 * Math.max(size.x, size.y, size.z)));
}

function frameView() {
  const all = box(), size = all.getSize(new Vector3()), most = Math.max(size.x, size.y, size.z);
  if (!state.forest) {
    stage.fog(0, 0);
    stage.look(all, { height: all.min.y, size: 1.9 * most });
    return;
  }
  const reach = Math.max(forestRadius(), most), near = Math.min(reach, 2.2 * most);
  const part = new Box3(new Vector3(-near, all.min.y, -near), new Vector3(near, all.max.y, near));
  stage.look(part, { height: all.min.y, size: 2.6 * reach });
  stage.controls.maxDistance = 6 * reach;
  stage.camera.far = 12 * reach + 20 * most;
  stage.fog(stage.camera.position.distanceTo(stage.controls.target) * 0.7, 3.2 * reach + 4 * most);
}

// ---- level, colour, what is shown ----

const level = new Choice($("level-choice"), (value) => setLevel(value));
const colour = new Choice($("colour"), (value) => {
  for (const plant of plants) plant.setColour(value);
  $("scale").hidden = value !== "distance";
  colourForest();
  state.dirty = true;
});
const show = new Choice($("show"), (value) => {
  for (const plant of plants) plant.setShow(value);
  state.dirty = true;
});
const compare = new Choice($("compare"), (value) => {
  if (value === "file") {
    $("file").dataset.beside = "yes";
    $("file").click();
    compare.set(plants.length > 1 && opened.length > 1 ? "file" : "off");
    return;
  }
  for (const each of opened.splice(1)) each.dispose();
  arrange();
  frameView();
});
colour.set("plain");
show.set("mesh");
compare.set("off");
$("scale").querySelector("i").style.background = heatGradient;

const within = ({ ath, motion }, level) => lengthText(motion.error(level).max, ath.metadata.unit);

function levelControls() {
  const most = Math.max(...plants.map(({ motion }) => motion.levelCount)) - 1;
  const values = ["auto", ...Array.from({ length: most + 1 }, (_, i) => String(i))];
  const deepest = plants.find(({ motion }) => motion.levelCount > most);
  const titles = values.slice(1).map((value) => `${upper(deepest.motion.levelName(value))}, to ${within(deepest, value)}`);
  if (values.length <= 9) level.fill(values, ["Auto", ...values.slice(1)], ["Automatic", ...titles]);
  else level.fill(["auto"], ["Automatic"]);
  for (const id of ["level", "compare-level"]) $(id).max = most;
  $("compare-level").value = Math.min(1, most);
  $("level").value = most;
}

function setLevel(value) {
  level.set(value);
  const main = plants.at(-1);
  for (const plant of plants) {
    const left = plants.length > 1 && plant !== main && compare.value === "levels";
    plant.motion.setLevel(left ? Number($("compare-level").value) : value === "auto" ? "auto" : Number(value));
  }
  $("compare-level-value").value = $("compare-level").value;
  if (value !== "auto") $("level").value = value;
  state.dirty = true;
}

$("level").addEventListener("input", () => setLevel($("level").value));
$("compare-level").addEventListener("input", () => setLevel(level.value));

function labels() {
  const names = plants.length < 2 ? [] : plants.map(({ ath, motion }) => (compare.value === "file" ? `${ath.fileName}, level ${motion.level}`
    : `${upper(motion.levelName(Math.max(motion.level, 0)))} · ${rateText(motion.bitRate())}`));
  const text = names.join("|");
  if (labels.text === text) return;
  labels.text = text;
  const tags = names.map((name, i) => {
    const tag = Object.assign(document.createElement("span"), { textContent: name });
    tag.style.left = `${((i + 0.5) * 100) / names.length}%`;
    return tag;
  });
  if (tags.length) {
    const line = document.createElement("i");
    line.style.left = "50%";
    tags.push(line);
  }
  $("labels").replaceChildren(...tags);
}

// ---- forest ----

const forestCount = () => Math.round(10 ** ($("forest-count").value / 25));

function forestRadius() {
  const count = state.forestCount ?? forestCount();
  return 2 * plants[0].ath.sphere.radius * Number($("forest-spread").value) * Math.sqrt(count) * 0.55;
}

function instances(count) {
  const { ath } = plants[0], { rest } = ath, up = ath.metadata.up_axis === "z" ? 2 : 1, spread = forestRadius();
  const duration = ath.motion.duration || 1, foot = [rest[0], rest[1], rest[2]], { clips } = ath.motion;
  const clipOf = (i) => ($("forest-mix").checked ? i % clips.length : undefined);
  return Array.from({ length: count }, (_, i) => {
    const far = spread * Math.sqrt((i + 0.3) / count), angle = i * GOLDEN + 0.5 * Math.sin(i * 12.9898);
    const size = 0.75 + 0.5 * (Math.sin(i * 78.233) * 0.5 + 0.5), x = far * Math.cos(angle), y = far * Math.sin(angle);
    const at = up === 2 ? { x, y, z: foot[2] * (1 - size) } : { x, y: foot[1] * (1 - size), z: y };
    return { ...at, size, clip: clipOf(i), angle: i * 2.4, seconds: (i * 0.7548776662 % 1) * duration };
  });
}

function forestMaterial(lines, level) {
  const material = lines ? new LineBasicMaterial() : new MeshLambertMaterial({ side: DoubleSide });
  tintForest(material, lines, level);
  return material;
}

// Bark, leaves or the file's own colours; by level where nodes are told apart.
function tintForest(material, lines, level) {
  const plain = colour.value === "plain", stored = lines || plants[0].ath.geometry.hasAttribute("color");
  if (material.vertexColors !== (plain && stored)) material.needsUpdate = true;
  material.vertexColors = plain && stored;
  material.color = plain ? new Color(stored ? 0xffffff : 0x6f8f4a) : new Color().setRGB(...nodeColour(level + 1));
}

function colourForest() {
  state.forest?.children.forEach((drawn) => tintForest(drawn.material, drawn.isLineSegments, drawn.userData.level));
}

function forestOn() {
  const [plant] = plants;
  state.forest?.removeFromParent();
  state.forest?.dispose();
  const forest = new ATHForest(plant.ath, { geometry: plant.forestGeometry(), material: forestMaterial });
  state.forest = forest;
  forest.levelOfDetail = $("forest-lod").checked;
  forest.addEventListener("level", () => { state.dirty = true; });
  plant.root.add(forest);
  setLoop(state.loop);
  plantForest();
  for (const child of plant.root.children) if (child !== forest) child.visible = false;
  plant.motion.setLevel(plant.motion.levelCount - 1); // near instances show all of it
}

function plantForest() {
  state.forest.setInstances(instances(state.forestCount ?? forestCount()));
  place();
  state.dirty = true;
}

function forestOff() {
  state.forest.removeFromParent();
  state.forest.dispose();
  state.forest = null;
  plants[0].setShow(show.value);
  setLevel(level.value);
  setLoop(state.loop);
  place();
}

function forestSwitch(on) {
  if (on === Boolean(state.forest)) return;
  $("forest").checked = on;
  $("forest-rows").hidden = !on;
  if (on && plants.length > 1) {
    compare.set("off");
    for (const each of opened.splice(1)) each.dispose();
    arrange();
  }
  if (on) forestOn();
  else forestOff();
  frameView();
}

$("forest").addEventListener("change", () => forestSwitch($("forest").checked));
for (const id of ["forest-count", "forest-spread"]) $(id).addEventListener("input", () => { delete state.forestCount; forestNumbers(); plantForest(); });
$("forest-count").addEventListener("change", frameView);
$("forest-mix").addEventListener("change", plantForest);
$("forest-lod").addEventListener("change", () => { state.forest.levelOfDetail = $("forest-lod").checked; state.dirty = true; });

function forestNumbers() {
  $("forest-count-value").value = countText(state.forestCount ?? forestCount());
  $("forest-spread-value").value = `${Number($("forest-spread").value).toFixed(1)}×`;
}
forestNumbers();

function forestBars() {
  const { counts, culled } = state.forest, most = Math.max(1, ...counts, culled);
  const { motion } = plants.at(-1), all = [...counts.map((count, level) => [upper(motion.levelName(level)), count]), ["Unseen", culled]];
  if ($("forest-bars").children.length !== all.length)
    $("forest-bars").replaceChildren(...all.map(() => {
      const row = document.createElement("div");
      row.append(...["span", "i", "b"].map((name) => document.createElement(name)));
      return row;
    }));
  all.forEach(([name, count], i) => {
    const [label, bar, number] = $("forest-bars").children[i].children;
    label.textContent = name;
    bar.style.width = `${(100 * count) / most}%`;
    number.textContent = countText(count);
  });
}

// ---- clips ----

function clipControls() {
  const { clips, clip } = opened[0].motion;
  $("clip").replaceChildren(...clips.map(({ index, name, loop }) => new Option(loop ? `${name} ↻` : name, index)));
  $("clip").value = clip.index;
  $("clip").hidden = $("forest-mix-row").hidden = clips.length < 2;
}

// A second file may have no clip of that name.
function playIn(motion, name) {
  if (motion.clips.some((clip) => clip.name === name)) motion.play(name, { fade: state.playing && !state.forest ? FADE : 0 });
}

function playClip(index) {
  const ended = state.time >= limit(), [{ motion }] = plants;
  for (const plant of plants) playIn(plant.motion, motion.clips[index].name);
  $("clip").value = index;
  fromTheStart();
  setLoop(null);
  if (ended) setPlaying(true);
  if (state.forest) plantForest();
  state.dirty = true;
}

function fromTheStart() {
  Object.assign(state, { time: 0, turns: 0 });
}

function nextClip(by) {
  const { clips, clip } = plants[0].motion;
  playClip((clip.index + by + clips.length) % clips.length);
}

$("clip").addEventListener("change", () => playClip(Number($("clip").value)));

// ---- time ----

const loops = () => plants.some(({ motion }) => motion.loops);

function setPlaying(playing) {
  if (playing && !loops() && state.time >= limit()) state.time = 0;
  state.playing = playing;
  document.body.classList.toggle("paused", !playing);
  $("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  state.dirty = true;
}

function seek(seconds) {
  state.time = Math.max(0, Math.min(seconds, limit()));
  state.dirty = true;
}

// Where the clip ends: a loop has the way back to its first frame too.
function limit() {
  return Math.max(...plants.map(({ motion }) => motion.duration), 0);
}

function step(frames) {
  setPlaying(false);
  const { duration, frameCount } = plants[0].motion.clip, rate = duration > 0 ? (frameCount - 1) / duration : 1;
  seek(Math.min((Math.round(state.time * rate) + frames) / rate, duration));
}

function advance(seconds) {
  state.time += seconds * state.speed;
  const beyond = state.time - limit();
  if (beyond < 0) return;
  if (loops() && limit() > 0) {
    state.time %= limit();
    state.turns += beyond + limit() - state.time;
  } else if (!plants.some(({ motion }) => motion.switching)) {
    state.time = limit();
    setPlaying(false);
  }
}

// null: as is usual for the file. A forest always loops.
function setLoop(loop) {
  state.loop = loop;
  for (const { motion } of plants) motion.wrap = state.forest || loop ? "loop" : loop === null ? motion.usualWrap : "clamp";
  $("loop").setAttribute("aria-pressed", String(loops()));
  $("loop").disabled = Boolean(state.forest);
}

$("play").addEventListener("click", () => setPlaying(!state.playing));
$("loop").addEventListener("click", () => setLoop(!loops()));
$("speed").addEventListener("change", () => { state.speed = Number($("speed").value); });
$("time").addEventListener("input", () => seek(Number($("time").value)));

// ---- every frame ----

function tick(now) {
  requestAnimationFrame(tick);
  const passed = Math.min(0.1, (now - last) / 1000);
  last = now;
  if (plants.length === 0) return;
  stage.controls.update();
  if (state.playing) advance(passed);
  for (const { motion, root } of plants) {
    if (!state.forest) motion.update(stage.camera, stage.pixels, root).setTime(motion.start + state.time);
    else motion.setTime(motion.start);
  }
  if (state.forest) {
    state.forest.bakeReady();
    state.dirty ||= state.forest.fading;
    if (state.playing || state.dirty) state.forest.update(stage.camera, stage.pixels, state.turns + state.time);
  }
  if (state.dirty || (state.playing && state.forest)) draw();
  count(now);
}

function draw() {
  state.dirty = false;
  const start = performance.now();
  stage.render();
  markFirst();
  counters.frames++;
  counters.frameMs = counters.frameMs * 0.8 + 0.2 * (performance.now() - start);
}

function count(now) {
  const passed = now - counters.since;
  if (passed < 250) return;
  counters.fps = (counters.frames * 1000) / passed;
  Object.assign(counters, { frames: 0, since: now });
  tell();
}

function tell() {
  const main = plants.at(-1), { motion, ath } = main, { unit } = ath.metadata, share = motion.bytesFetched / motion.bytesTotal;
  $("progress").firstElementChild.style.width = `${100 * Math.min(1, share)}%`;
  $("progress").setAttribute("aria-valuenow", String(Math.round(100 * Math.min(1, share))));
  const shown = Math.max(motion.level, 0);
  rows($("facts"), [
    ["Fetched", `${bytesText(motion.bytesFetched)} of ${bytesText(motion.bytesTotal)}`],
    ["This view", `${rateText(motion.bitRate(shown))}`],
    ["Level", `${shown} of ${motion.levelCount - 1}: ${motion.levelName(shown)}`],
    ["Within", within(main, shown)],
    ...(motion.clip.loop ? [["Loop seam", lengthText(motion.seamError(shown), unit)]] : []),
    ["Decoding", `${motion.milliseconds.toFixed(1)} ms`],
    ["Frames", `${counters.fps.toFixed(0)} per second`],
    ["Vertices", countText(state.forest ? state.forest.vertices : plants.reduce((sum, plant) => sum + plant.vertices, 0))],
  ]);
  $("level-hint").textContent = motion.automatic && !state.forest ? `Automatic: ${motion.levelName(shown)} keeps the error below a pixel`
    : motion.level < motion.target ? `Level ${motion.target}, ${motion.levelName(motion.target)}, is still on its way` : `${upper(motion.levelName(shown))}: no vertex is further off than ${within(main, shown)}`;
  if (motion.automatic) $("level").value = motion.target;
  $("scale-title").textContent = "Distance from the deepest level";
  $("scale-middle").textContent = lengthText(main.heatMost / 4, unit);
  $("scale-high").textContent = lengthText(main.heatMost, unit);
  $("time").max = limit();
  const time = motion.switching === "waiting" ? 0 : Math.min(state.time, limit());
  if (document.activeElement !== $("time") || state.playing) $("time").value = time;
  $("clock").value = `${time.toFixed(2)} s`;
  paintReady($("ready"), [...motion.readyLevels], motion.levelCount);
  labels();
  if (state.forest) forestBars();
}

// ---- pictures, files, keys ----

function picture() {
  draw();
  $("canvas").toBlob((blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${opened[0].fileName.replace(/\.ath$/, "")}_${state.time.toFixed(2)}s.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}

async function openFile(file, beside) {
  if (file) await open({ bytes: await file.arrayBuffer() }, file.name, beside && opened.length > 0);
}

function choose(beside = "") {
  $("file").dataset.beside = beside;
  $("file").click();
}

$("open").addEventListener("click", () => choose());
$("message").querySelector("button").addEventListener("click", () => choose());
$("file").addEventListener("change", async () => {
  await openFile($("file").files[0], $("file").dataset.beside === "yes");
  $("file").value = "";
});
$("picture").addEventListener("click", picture);
$("help").addEventListener("click", () => $("keys").showModal());
$("toggle-panel").addEventListener("click", togglePanel);

function togglePanel() {
  const hidden = document.body.classList.toggle("no-panel");
  $("toggle-panel").setAttribute("aria-expanded", String(!hidden));
  stage.fit();
}

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

function changeSpeed(by) {
  const at = SPEEDS.indexOf($("speed").value) + by;
  $("speed").value = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at))];
  state.speed = Number($("speed").value);
}

function changeLevel(by) {
  const { motion } = plants.at(-1), from = motion.automatic ? motion.target : Number(level.value);
  setLevel(String(Math.max(0, Math.min(motion.levelCount - 1, from + by))));
}

const KEYS = {
  " ": () => setPlaying(!state.playing), ArrowLeft: (event) => step(event.shiftKey ? -10 : -1), ArrowRight: (event) => step(event.shiftKey ? 10 : 1),
  Home: () => seek(0), End: () => { setPlaying(false); seek(plants[0].motion.clip.duration); },
  ",": () => changeSpeed(-1), ".": () => changeSpeed(1), l: () => $("loop").click(), n: (event) => nextClip(event.shiftKey ? -1 : 1),
  "-": () => changeLevel(-1), "+": () => changeLevel(1), "=": () => changeLevel(1), a: () => setLevel("auto"),
  c: () => colour.next(), s: () => show.next(), d: () => compare.pick(compare.value === "off" ? "levels" : "off"),
  f: () => forestSwitch(!state.forest), r: () => { stage.moved = false; frameView(); }, p: picture, h: togglePanel, "?": () => $("keys").showModal(),
};

addEventListener("keydown", (event) => {
  const { target, key } = event, typing = target.matches("select") || (target.matches("input") && key.startsWith("Arrow"));
  const pressing = target.matches("button, input[type=checkbox]") && key === " ";
  if (event.ctrlKey || event.metaKey || event.altKey || typing || pressing || plants.length === 0 || $("keys").open) return;
  const action = KEYS[key.length === 1 ? key.toLowerCase() : key];
  if (!action) return;
  event.preventDefault();
  action(event);
});

requestAnimationFrame(tick);

/** For scripts and tests. */
globalThis.athcodecViewer = {
  counters, state, stage, open, seek, setPlaying, setLevel, playClip, forestSwitch, frameView,
  get plants() { return plants; },
  get motion() { return plants.at(-1)?.motion; },
  async shown(seconds, level) {
    setPlaying(false);
    const { motion } = plants.at(-1);
    await motion.show(motion.start + seconds, level);
    return { level: motion.level, frame: motion.frame };
  },
  decoded: async (seconds, level) => {
    const { motion } = plants.at(-1);
    return [...await motion.positions(motion.start + seconds, level)];
  },
  uploaded: () => [...plants.at(-1).motion.uploaded()],
  onGraphics(what = "positions") {
    const { ath, motion } = plants.at(-1), normals = what === "normals" ? ath.geometry.getAttribute("normal").array : null;
    return [...readback(stage.renderer, ath, motion, normals)];
  },
  /** Milliseconds from choosing what to draw until it is drawn: the fastest of some frames. */
  timeForest(frames) {
    const gl = stage.renderer.getContext(), pixel = new Uint8Array(4), times = [];
    for (let i = 0; i < frames; i++) {
      const start = performance.now();
      state.forest.update(stage.camera, stage.pixels, state.time + i / 30);
      stage.render();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for the picture
      times.push(performance.now() - start);
    }
    const { counts, culled, vertices } = state.forest;
    return { ms: Math.min(...times), counts, unseen: culled, vertices };
  },
  forestOf(count, levelOfDetail = true) {
    state.forestCount = count;
    $("forest-lod").checked = levelOfDetail;
    if (!state.forest) forestSwitch(true);
    state.forest.levelOfDetail = levelOfDetail;
    plantForest();
    frameView();
    forestNumbers();
  },
};
