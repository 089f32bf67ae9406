// What test_loader.py asks of the loader: node loader_cases.mjs NAME FILE prints, as JSON, what came of it.


import { AthFile, ATHLoader, Line, pause, read, three, thrown, until } from "./loading.mjs";

const [name, path, ...words] = process.argv.slice(2), data = read(path);
const refusal = (promise) => promise.then(() => null, (error) => error.codeName ?? error.name);
const refusalOf = (call) => { try { call(); return null; } catch (error) { return error.name; } };

// A file of which `here` bytes have come, loaded.
async function load(here = Infinity, { bytes = data, mode = "matrices", ...options } = {}) {
  const line = new Line(bytes, options), loader = new ATHLoader().setWorkerLimit(1).setMode(mode);
  line.allow(here);
  const ath = await loader.loadAsync(line.url);
  return { line, loader, ath, motion: ath.motion };
}

const cases = {};

// Seeks between segments of which one is not here: those after which the plant does not show the decoder's picture.
cases.between = async () => {
  const file = AthFile.open(data), times = file.times(), stuck = [];
  const motionBytes = file.chunks().filter(({ level }) => level < 255).map(({ offset }) => offset + 1).slice(1);
  for (const mode of ["matrices", "positions"])
    for (let i = 0; i < motionBytes.length; i += 1 + (motionBytes.length >> 3)) {
      const { line, loader, motion } = await load(motionBytes[i], { mode });
      for (let segment = 1; segment < file.info.segmentCount; segment++) {
        const last = file.segmentStart(segment) - 1;
        for (const share of [0, 0.3, 0.5, 0.7, 1]) motion.setTime(times[last] + share * (times[last + 1] - times[last]) - times[0]);
        await pause(60);
      }
      const first = file.segmentStart(1), seconds = (times[first - 1] + times[first]) / 2 - times[0];
      motion.setTime(seconds);
      await pause(200);
      line.allow(Infinity);
      if (!(await until(() => motion.frame === first - 0.5 && motion.level === file.info.levelCount - 1 && !motion.fading && !motion.held)))
        stuck.push([mode, motionBytes[i], motion.frame, motion.level]);
      loader.dispose();
    }
  return (stuck);
};

// Plays 60 pictures a second by a clock of its own, on which decoding the deepest level of a segment takes `cost` times as long as the
// segment, and other levels a tenth of that: the segment and the level of each picture.
cases.boundaries = async () => {
  const [cost, rounds] = words.map(Number), { info, clips: [clip] } = AthFile.open(data), { Instance } = WebAssembly;
  const alone = AthFile.open(data).preparation(0, info.levelCount - 1), deepest = info.levelCount - 1, levels = new Map();
  let clock = 0, most = 1, done = 0;
  while (!alone.step(1)) most++;
  WebAssembly.Instance = new Proxy(Instance, { construct(target, given) {
    const { exports } = new target(...given), { ath_prepare_step, ath_prepare_start, ath_prepare_onward } = exports;
    return { exports: { ...exports,
      ath_prepare_start: (...at) => (levels.set(at[0], at[4]), ath_prepare_start(...at)),
      ath_prepare_onward: (...at) => (levels.set(at[0], at[5]), ath_prepare_onward(...at)),
      ath_prepare_step(work, count) {
        if (count < most) clock += (levels.get(work) === deepest ? 1 : 0.1) * count * 1000 * cost * clip.lastTime / info.segmentCount / most;
        done++; // What is decoded at once, for a picture, takes no time.
        return ath_prepare_step(work, count);
      } } };
  } });
  performance.now = () => clock;
  globalThis.MessageChannel = class { // The page gets a turn at each pause.
    port1 = {};
    port2 = { postMessage: () => setImmediate(() => this.port1.onmessage()) };
  };
  const { ath, motion } = await load(), shown = [], file = AthFile.open(data), turn = () => new Promise((over) => { setImmediate(over); });
  await ath.loaded;
  motion.fade = 0;
  for (let picture = 0, start = clock; picture / 60 < rounds * clip.lastTime; picture++) {
    motion.setTime(picture / 60);
    for (let idle = 0, before = -1; clock < start + 1000 * picture / 60 && idle < 9; before = done) {
      await turn();
      idle = done === before ? idle + 1 : 0;
    }
    clock = Math.max(clock, start + 1000 * picture / 60);
    shown.push([file.segmentOf(Math.floor(Math.max(motion.frame, 0))), motion.level]);
  }
  return { shown, deepest };
};

// Where a plant is, and what each level shows of it: what the shader makes of the texture, and positions alone.
cases.far = async () => {
  const { ath, motion } = await load(), shown = [], some = (numbers) => Array.from(numbers).filter((_, i) => i % 27 < 3);
  await ath.loaded;
  motion.fade = 0;
  for (let level = 0; level < motion.levelCount; level++)
    for (const seconds of words.map(Number)) {
      await motion.show(seconds, level);
      shown.push({ level, frame: motion.frame, drawn: some(motion.uploaded()), alone: some(await motion.positions(seconds, level)) });
    }
  return { origin: ath.origin, place: ath.object.position.toArray(), box: [ath.box.min.toArray(), ath.box.max.toArray()], rest: some(ath.rest), shown };
};

// Two pictures under way, the first of a level that is not known yet: whether the second is shown.
cases.overtaken = async () => {
  const { motion } = await load();
  motion.fade = 0;
  motion.setLevel(1).setTime(0.5);
  await until(() => motion.level === 1 && motion.readyLevel === motion.levelCount - 1);
  const shown = motion.show(1, 2); // whose parts are not known yet
  motion.setTime(0.75);
  await shown;
  return (await until(() => motion.level === 1 && Math.abs(motion.frame - AthFile.open(data).frameAt(0.75, "loop")) < 1e-9));
};

// A picture that the worker cannot make, and listeners that throw.
cases.unanswerable = async () => {
  const { motion } = await load(), errors = [];
  motion.addEventListener("error", ({ message, codeName }) => errors.push([message, codeName]));
  motion.addEventListener("frame", () => { throw new Error("of a listener"); });
  const uncaught = [];
  process.on("uncaughtException", (error) => uncaught.push(error.message));
  motion.wrap = "backwards";
  motion.setTime(0.5);
  await until(() => errors.length > 0);
  motion.wrap = "loop";
  motion.setTime(0.75);
  const moved = await until(() => motion.frame > 1);
  return ({ moved, error: errors[0], uncaught: [...new Set(uncaught)],
    refused: [await refusal(motion.show(0, 99)), await refusal(motion.positions(0, -1)), await refusal(motion.nodeNumbers(0))] });
};

// The vertices that are drawn in each frame.
cases.presence = async () => {
  const { ath, motion } = await load(), times = AthFile.open(data).times(), drawn = [];
  await ath.arrays;
  const { index, userData: { source } } = ath.geometry;
  for (let frame = 0; frame < times.length; frame++) {
    motion.setTime(times[frame] - times[0]);
    await until(() => motion.frame === frame);
    const vertices = new Set();
    for (let i = 0; i < index.count; i += 3)
      if (index.array[i] !== index.array[i + 1]) for (let k = 0; k < 3; k++) vertices.add(source[index.array[i + k]]);
    drawn.push([...vertices].sort((a, b) => a - b));
  }
  return drawn;
};

// The levels that four segments reach, and what is said.
cases.damaged = async () => {
  const { ath, motion } = await load(), failures = [], note = ({ message, codeName, level }) => failures.push([message, codeName, level]);
  motion.fade = 0;
  if (motion.failure) note(motion.failure); // the next segment may have been decoded before the page could listen
  motion.addEventListener("damaged", note);
  const reached = [], file = AthFile.open(data);
  await ath.loaded;
  for (const segment of [0, 1, 2, 3]) {
    const at = ath.motion.clip.duration * (segment + 0.5) / 4;
    motion.setTime(at);
    await until(() => Math.abs(motion.frame - file.frameAt(at)) < 1e-9 && motion.level === motion.readyLevels[segment]);
    reached.push(motion.level);
  }
  return ({ reached, failures, whole: await ath.loaded.then((found) => found === ath) });
};

// Whether `loaded` waits for all bytes, of files that are whole, cut off, and too short for a picture.
cases.loaded = async () => {
  const { line, ath, motion } = await load(data.length >> 1);
  motion.setLevel(0); // which needs none of it
  let whole = false;
  const loaded = ath.loaded.then((found) => { whole = found === ath; });
  await pause(300);
  const early = whole;
  line.allow(Infinity);
  await loaded;
  const short = await load(Infinity, { bytes: data.subarray(0, data.length - 9) });
  const cut = await load(Infinity, { bytes: data.subarray(0, data.length - 9), ranges: false });
  const file = AthFile.open(data), first = file.chunks().find(({ level }) => level === 0);
  return ({ early, whole, same: ath.loaded === ath.loaded,
    ready: file.chunks().length > 0 && [...motion.readyLevels].every((level) => level === motion.levelCount - 1),
    short: [await refusal(short.ath.loaded), short.motion.failure?.codeName], cut: await refusal(cut.ath.loaded),
    none: await refusal(load(Infinity, { bytes: data.subarray(0, first.offset + 1) })) });
};

// Downloads that are ended before and after the first picture.
cases.aborted = async () => {
  const half = await load(data.length >> 1), { ath, motion, loader } = half, loaded = refusal(ath.loaded);
  await until(() => motion.readyLevel >= 0);
  ath.abort();
  const codes = [await loaded];
  await until(() => motion.failure);
  codes.push(motion.failure.codeName);
  motion.setLevel(0).setTime(0.4);
  const plays = await until(() => motion.frame > 1 && motion.level === 0);
  const waiting = new Line(data), loading = refusal(loader.loadAsync(waiting.url));
  await pause(50);
  loader.abort();
  codes.push(await loading);
  ath.dispose();
  codes.push(await refusal(motion.show(0, 0)));
  return ({ codes, plays, files: loader.workerPool[0].files, channels: loader.workerPool[0].channels.size });
};

// Pictures in winds against the decoder's, in both modes, what a clip shows after that, and what is refused.
cases.winds = async () => {
  const file = AthFile.open(data), level = file.info.levelCount - 1, off = [];
  const segments = Array.from({ length: file.info.segmentCount }, (_, segment) => file.prepare(segment, level));
  const winds = file.clips.map((_, i) => ({ strength: 2 + 6 * (i > 0), heading: 90 * i }));
  for (const mode of ["matrices", "positions"]) {
    const { ath, motion, loader } = await load(Infinity, { mode });
    ath.geometry ?? ath.lines;
    motion.fade = 0;
    for (const [strength, heading, seconds] of [[2, 0, 0.1], [5, 100, 0.31], [8, 135, 0.33], [99, 260, 0.7]]) {
      const shares = file.windWeights(winds, strength, heading).map((weight, clip) =>
        ({ segments, weight, frame: file.frameAt(seconds, motion.wrap, clip) })).filter(({ weight }) => weight > 0);
      const wanted = file.blended(shares), apart = (found) => Math.max(...wanted.map((number, i) => Math.abs(number - found[i])));
      motion.wind(strength, heading).setTime(seconds);
      const here = () => motion.level === level && apart(motion.uploaded()) === 0;
      if (!(await until(here))) off.push([mode, strength, heading, motion.level]);
      off.push(...(apart(await motion.positions(seconds)) > 0 ? [[mode, "positions"]] : []));
    }
    motion.play(0).setTime(0.9);
    const alone = () => file.positions(segments, file.frameAt(motion.time - motion.start, motion.wrap, 0));
    const plays = () => !motion.switching && alone().every((number, i) => Math.abs(number - motion.uploaded()[i]) < 1e-4);
    if (!(await until(plays))) off.push([mode, "play"]);
    loader.dispose();
  }
  const { ath, motion } = await load();
  ath.geometry ?? ath.lines;
  motion.fade = 0;
  await until(() => motion.wind(8, 0).setTime(0.3).level === level); // all clips are decoded
  const alone = file.positions(segments, file.frameAt(0.3, motion.wrap, 0));
  motion.play(0, { at: 0.3 });
  await until(() => alone.every((number, i) => Math.abs(number - motion.uploaded()[i]) < 1e-4));
  const seen = [motion.uploaded().slice()], last = () => seen.at(-1);
  motion.fade = 1; // second, which is ten pictures, however busy the machine is
  let now = performance.now();
  performance.now = () => now;
  motion.addEventListener("frame", () => { now += 100; });
  motion.wind(8, 0); // from the clip that was shown alone
  await until(() => {
    if (motion.uploaded().some((number, i) => number !== last()[i])) seen.push(motion.uploaded().slice());
    return seen.length > 1 && !motion.fading;
  });
  const far = (a, b) => Math.max(...a.map((number, i) => Math.abs(number - b[i])));
  const largest = Math.max(...seen.slice(1).map((picture, i) => far(picture, seen[i]))) / far(seen[0], last());
  return ({ off, eased: seen.length > 4 && largest < 0.9,
    refused: [refusalOf(() => motion.wind(NaN)), refusalOf(() => motion.wind(1, Infinity))] });
};

// Buffers and views of all kinds.
cases.parsed = async () => {
  const loader = new ATHLoader().setWorkerLimit(1), shared = new Uint8Array(new SharedArrayBuffer(data.length + 7), 7);
  shared.set(data);
  const padded = new Uint8Array(data.length + 16);
  padded.set(data, 8);
  const inside = padded.subarray(8, 8 + data.length), whole = new SharedArrayBuffer(data.length);
  new Uint8Array(whole).set(data);
  const positions = [];
  for (const buffer of [data.slice().buffer, inside, new DataView(inside.buffer, 8, data.length), shared, whole, Buffer.from(data)]) {
    const ath = await loader.parseAsync(buffer);
    await ath.loaded;
    positions.push([...await ath.motion.positions(0.5)]);
  }
  const wrong = [];
  for (const buffer of [null, "text", [1, 2], inside.subarray(1)]) wrong.push(await refusal(loader.parseAsync(buffer)));
  return ({ same: positions.every((each) => String(each) === String(positions[0])), kept: inside.length === data.length, wrong });
};

// What bound materials make of a shader.
cases.bound = async () => {
  const { motion } = await load(), { MeshLambertMaterial } = three, compiled = (material) => {
    const shader = { uniforms: {}, vertexShader: "#include <common>\n#include <begin_vertex>" };
    material.onBeforeCompile(shader);
    return { uses: Object.values(shader.uniforms).includes(motion.uniforms.athData), times: shader.vertexShader.split("uniform highp sampler2D athData;").length - 1 };
  };
  const twice = motion.bind(motion.bind(new MeshLambertMaterial())), other = motion.clone();
  return { twice: compiled(twice), other: compiled(motion.bind(other.bind(new MeshLambertMaterial()))), clone: compiled(twice.clone().clone()) };
};

// Boxes, spheres and rays against the vertices that are shown.
cases.rays = async () => {
  const found = {};
  for (const mode of ["matrices", "positions"]) {
    const { ath, motion } = await load(Infinity, { mode }), [drawn] = ath.object.children, { Ray, Vector3 } = three, rows = [];
    for (const [seconds, level] of [[0, 0], [0.4, 0], [0.9, motion.levelCount - 1], [0.3, motion.levelCount - 1]]) {
      await motion.show(seconds, level);
      const at = motion.uploaded(), { boundingBox: box, boundingSphere: sphere } = drawn.geometry;
      const point = new Vector3(), end = 3 * (at.length / 3 - 1), size = box.getSize(new Vector3()).length();
      let inside = true;
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (let i = 0; i < at.length; i += 3) {
        point.fromArray(at, i);
        inside &&= box.distanceToPoint(point) < 1e-5 * size && sphere.distanceToPoint(point) < 1e-5 * size;
        for (let k = 0; k < 3; k++) { low[k] = Math.min(low[k], at[i + k]); high[k] = Math.max(high[k], at[i + k]); }
      }
      const exact = new three.Box3().setFromBufferAttribute(drawn.geometry.attributes.position);
      const off = Math.max(...["x", "y", "z"].map((k, i) => Math.max(Math.abs(exact.min[k] - low[i]), Math.abs(exact.max[k] - high[i]))));
      // A ray straight down on a corner of the last edge or face.
      const hits = [], ray = new Ray(new Vector3().fromArray(at, end).add(new Vector3(0, 0, 5 * size)), new Vector3(0, 0, -1));
      const near = drawn.isMesh ? new Vector3().fromArray(at, 0).sub(new Vector3().fromArray(at, end)).setZ(0).setLength(1e-3 * size) : new Vector3();
      ray.origin.add(near);
      drawn.raycast({ ray, near: 0, far: Infinity, params: { Line: { threshold: 1e-3 * size } } }, hits);
      rows.push({ inside, off: off / size, hit: hits.length > 0, loose: size / Math.hypot(...high.map((h, k) => h - low[k])) });
    }
    found[mode] = rows;
  }
  return (found);
};

// What a program sets on the object lasts, whatever arrives behind it, and clones are whole.
cases.object = async () => {
  const early = Number(words[0]), { line, ath, motion } = await load(early), { Box3, Vector3 } = three, { object } = ath, [first] = object.children;
  const size = new Box3().setFromObject(object).getSize(new Vector3()), found = { default: [first.castShadow, first.receiveShadow], size: size.toArray() };
  object.traverse((each) => Object.assign(each, { castShadow: false, renderOrder: 7, name: "mine" }));
  line.allow(Infinity);
  await ath.arrays;
  const [drawn] = object.children, twin = object.clone().clone().children[0], { customDepthMaterial, customDistanceMaterial } = drawn;
  found.kept = [object.children.length, drawn.castShadow, drawn.receiveShadow, drawn.renderOrder, drawn.name];
  found.same = drawn === first;
  found.look = [drawn.isMesh === true, drawn.material.vertexColors, drawn.geometry.hasAttribute("color")];
  found.twin = customDepthMaterial !== undefined && twin !== drawn && twin.customDepthMaterial === customDepthMaterial
    && twin.customDistanceMaterial === customDistanceMaterial && twin.onBeforeRender === drawn.onBeforeRender && twin.geometry === drawn.geometry;
  const normals = ath.geometry.getAttribute("normal").array;
  found.flat = normals.filter((_, i) => i % 3 === 0 && !(Math.hypot(...normals.subarray(i, i + 3)) > 0.999)).length;
  return found;
};

// Fifty loads: how many instances of the decoder are left after every ten.
cases.memory = async () => {
  const { Instance } = WebAssembly, alive = new Set(), gone = new FinalizationRegistry((key) => alive.delete(key));
  let made = 0;
  WebAssembly.Instance = new Proxy(Instance, { construct(target, words) {
    const instance = new target(...words);
    alive.add(made);
    gone.register(instance, made++);
    return instance;
  } });
  const loader = new ATHLoader().setWorkerLimit(1), used = [];
  const settled = async () => { for (let i = 0; i < 6; i++) { await pause(200); gc(); } };
  const line = new Line(data);
  line.allow(Infinity);
  for (let i = 0; i < 50; i++) {
    const ath = await loader.loadAsync(line.url), { motion } = ath;
    ath.object.children.length;
    const other = motion.clone();
    other.setTime(0.4);
    if (i % 2) await ath.loaded;
    motion.show(0.3, 1).catch(() => {});
    ath.dispose();
    if (i % 10 === 9) {
      await settled();
      used.push(alive.size);
    }
  }
  return ({ made, used, files: loader.workerPool[0].files, channels: loader.workerPool[0].channels.size });
};

const found = await cases[name]();
if (thrown.length > 0) throw thrown[0];
console.log(JSON.stringify(found));
process.exit();
