// Random seeks, levels and clips while bytes come in random pieces, some of them damaged: node --expose-gc random_loading.mjs
// FIRST COUNT FILE..., of seeds the first and how many. Whatever happened, once all bytes are there a plant shows what the decoder says of the time that was asked for last,
// and every promise is settled. Prints the runs that went wrong, as JSON.

import { AthFile, ATHLoader, Line, pause, read, thrown, until } from "./loading.mjs";

const REFINED_REST = 0x15, NO_LEVEL = 255, TOLERANCE = 2e-6;

// Numbers in [0, 1) that a seed alone makes.
function randomOf(seed) {
  let state = (seed * 0x9e3779b9) >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let x = Math.imul(state ^ (state >>> 15), state | 1);
    x ^= x + Math.imul(x ^ (x >>> 7), x | 61);
    return ((x ^ (x >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** What a decoder that has all bytes of a file, some of them damaged, shows. */
class Expected {
  static #known = new Map();
  #segments = new Map();

  static of(path, damaged) {
    if (damaged >= 0) return new Expected(path, damaged);
    if (!Expected.#known.has(path)) Expected.#known.set(path, new Expected(path));
    return Expected.#known.get(path);
  }

  constructor(path, damaged = -1) {
    this.data = read(path);
    this.motion = AthFile.open(this.data).chunks().filter(({ level }) => level !== NO_LEVEL);
    if (damaged >= 0) this.data[this.motion[damaged % this.motion.length].offset] ^= 1;
    this.file = AthFile.open(this.data);
    this.refined = this.motion.some(({ kind, level }) => kind === REFINED_REST && level === 1);
  }

  // Null where it is damaged.
  segment(index, level) {
    const key = `${index}/${level}`;
    if (!this.#segments.has(key)) this.#segments.set(key, this.#prepared(index, level));
    return this.#segments.get(key);
  }

  #prepared(index, level) {
    try {
      return this.file.prepare(index, level);
    } catch {
      return null;
    }
  }

  // {level, positions} of the best picture up to a level; level -1: there is none, or a deeper one.
  picture(frame, most, drawn) {
    const { firstFrame, frameCount } = this.file.clips.findLast((clip) => clip.firstFrame <= frame), low = Math.floor(frame);
    const own = this.file.segmentOf(low), next = frame > low ? this.file.segmentOf(firstFrame + (low + 1 - firstFrame) % frameCount) : own;
    for (const index of [own, next]) {
      for (let level = most; level >= 0; level--) {
        const segments = [own, next].map((each) => this.segment(each, level));
        if (!this.segment(index, level)) continue;
        return { level, positions: drawn && level === 0 && this.refined ? this.#onFinerRest(segments, frame) : this.file.positions(segments, frame) };
      }
      for (let level = most + 1; level < this.file.info.levelCount; level++)
        if (this.segment(index, level)) return { level: -1, positions: null }; // whatever was shown before may be
    }
    return { level: -1, positions: null };
  }

  // The matrices of level 0 on the rest pose of the levels above, with which a page draws it.
  #onFinerRest(segments, frame) {
    const file = this.file, { branch, first, count, index } = file.parts(0), source = file.vertexSource();
    const out = file.positions(segments, frame), m = file.matrices(segments, frame), rest = this.#finerRest();
    if (!rest) return out;
    for (let part = 0; part < branch.length; part++)
      for (let i = first[part]; branch[part] >= 0 && i < first[part] + count[part]; i++)
        for (let k = 0; k < 3; k++) {
          const at = 12 * index[part] + 4 * k, v = 3 * source[i];
          out[v + k] = m[at] * rest[v] + m[at + 1] * rest[v + 1] + m[at + 2] * rest[v + 2] + m[at + 3];
        }
    return out;
  }

  #finerRest() {
    try {
      return this.file.levelRest(1);
    } catch {
      return null;
    }
  }
}

function sizeOf(numbers) {
  let most = 0;
  for (const number of numbers) most = Math.max(most, Math.abs(number));
  return most;
}

function apart(a, b) {
  let most = 0;
  for (let i = 0; i < a.length; i++) most = Math.max(most, Math.abs(a[i] - b[i]));
  return a.length === b.length ? most : Infinity;
}

async function runOf(seed, paths) {
  const random = randomOf(seed), whole = (count) => Math.floor(random() * count), oneOf = (list) => list[whole(list.length)];
  const path = oneOf(paths), damaged = random() < 0.3 ? whole(1000) : -1, expected = Expected.of(path, damaged);
  const { file, data } = expected, { clips, info } = file, times = file.times(), mode = oneOf(["matrices", "positions"]);
  const line = new Line(data, { ranges: random() < 0.8 }), loader = new ATHLoader().setWorkerLimit(1).setMode(mode);
  const said = [`${path.split("/").at(-1)} damaged ${damaged} ${mode} ranges ${line.ranges}`], asked = [];
  const wrong = (what) => ({ seed, what, said });
  const ended = async (failure = null) => {
    loader.dispose();
    line.close();
    return failure ?? (thrown.length > 0 ? wrong(`threw ${thrown.splice(0).map(({ stack }) => stack)}`) : null);
  };
  const bytes = () => oneOf([whole(40), whole(400), whole(4000), oneOf(expected.motion).length]);
  const more = () => { const count = bytes(); said.push(`allow ${count}`); line.allow(count); };
  const idle = () => (random() < 0.5 ? pause(whole(200)) : new Promise((done) => { setImmediate(done); }));

  let ath = null, refused = null;
  loader.loadAsync(line.url).then((found) => { ath = found; }, (error) => { refused = error; });
  line.allow(whole(2) * info.preludeLength);
  for (let i = 0; i < 400 && !ath && !refused; i++) {
    more();
    await idle();
  }
  line.allow(ath || refused ? 0 : Infinity);
  await until(() => ath || refused);
  if (refused) {
    const first = expected.picture(clips[0].firstFrame, 0).level < 0;
    return ended(first && refused.codeName?.startsWith("BAD") ? null : wrong(`refused: ${refused.stack}`));
  }
  if (!ath) return ended(wrong("is not loaded"));

  const motions = [ath.motion], { geometry, lines } = ath;
  // Seconds of the clip, often about the end of a segment.
  const seconds = ({ clip: { index, firstFrame, frameCount, firstSegment, segmentCount } }) => {
    const last = firstFrame + frameCount - 1, at = Math.min(last, file.segmentStart(firstSegment + 1 + whole(segmentCount)));
    const frame = random() < 0.7 ? Math.max(firstFrame, at - oneOf([0, 0.5, random(), 1, 1.5])) : firstFrame + random() * (frameCount - 1);
    const low = Math.floor(frame), step = times[Math.min(low + 1, last)] - times[low];
    return times[low] + (frame - low) * step - times[firstFrame] + (random() < 0.1 ? (random() - 0.3) * 10 : 0);
  };
  const settled = (promise) => asked.push(promise.then(() => null, (error) => (error.codeName ? null : error.stack)));
  const steps = {
    more, seek: (motion, at = seconds(motion)) => { said.push(`seek ${at}`); motion.setTime(motion.start + at); },
    play: (motion) => { const step = random() * 0.2; said.push(`go on ${step}`); motion.setTime(motion.time + step); },
    level: (motion) => { const level = oneOf(["auto", whole(info.levelCount), info.levelCount - 1]); said.push(`level ${level}`); motion.setLevel(level); },
    clip: (motion) => { const index = whole(clips.length), fade = oneOf([0, 0.3]); said.push(`clip ${index} ${fade}`); motion.play(index, { fade }); },
    wrap: (motion) => { motion.wrap = oneOf(["marked", "loop", "clamp", "pingpong"]); said.push(motion.wrap); },
    fade: (motion) => { motion.fade = oneOf([0, 0.2, 1]); said.push(`fade ${motion.fade}`); },
    heat: (motion) => { motion.heat = random() < 0.5; },
    show: (motion) => { said.push("show"); settled(motion.show(motion.start + seconds(motion), whole(info.levelCount))); },
    positions: (motion) => { said.push("positions"); settled(motion.positions(motion.start + seconds(motion), whole(info.levelCount))); },
    nodes: (motion) => { said.push("nodes"); settled(motion.nodeNumbers(whole(info.levelCount))); },
    clone: () => { if (motions.length < 3) motions.push(motions[0].clone().setMode(mode)); },
  };
  const names = [...Object.keys(steps), ...Array(6).fill("seek"), ...Array(8).fill("more"), "play", "play"];
  for (let i = whole(30); i >= 0; i--) {
    steps[oneOf(names)](oneOf(motions));
    await idle();
  }

  line.allow(Infinity);
  for (const motion of motions) {
    if (motion.switching && !(await until(() => motion.switching !== "waiting", 4000))) said.push("clip is damaged");
    if (motion.switching) motion.setTime(motion.time + 1);
    for (let i = 0; i < 3; i++) {
      steps.seek(motion);
      const level = motion.setLevel(whole(info.levelCount)).target, before = motion.frame;
      said.push(`at last level ${level}`);
      const frame = file.frameAt(motion.time - motion.start, motion.wrap, motion.clip.index), picture = expected.picture(frame, level, true);
      if (picture.level < 0 || motion.switching) continue;
      const { positions } = expected.picture(frame, level, mode === "matrices"), size = sizeOf(positions);
      const drawn = mode === "matrices" ? null : geometry ?? lines;
      const off = () => (mode === "matrices" ? apart(motion.uploaded(), positions)
        : motion === ath.motion ? apart(Array.from(drawn.userData.source).flatMap((v) => [...positions.subarray(3 * v, 3 * v + 3)]), drawn.attributes.position.array) : 0) / size;
      const met = () => motion.level === picture.level && !motion.fading && Math.abs(motion.frame - frame) < 1e-9 && off() <= TOLERANCE;
      if (!(await until(met)))
        return ended(wrong(`at frame ${frame}: got level ${motion.level} of frame ${motion.frame}, ${motion.level < 0 ? "" : off()} off, held ${motion.held}, `
          + `expected level ${picture.level}; ready ${motion.readyLevels}; ${motion.failure?.message}; ${thrown.splice(0).map(({ stack }) => stack)}`));
    }
  }
  const late = Symbol();
  for (const promise of asked) {
    const error = await Promise.race([promise, pause(200_000).then(() => late)]);
    if (error !== null) return ended(wrong(error === late ? "a promise is not settled" : error));
  }
  ath.dispose();
  return ended();
}

const [first, count, ...paths] = process.argv.slice(2), failures = [];
for (let seed = Number(first); seed < Number(first) + Number(count) && failures.length < 5; seed++) {
  const failure = await runOf(seed, paths);
  if (seed % 20 === 0) globalThis.gc?.(); // memory of WebAssembly alone is no reason for it
  if (failure) failures.push(failure);
}
console.log(JSON.stringify(failures, null, 1));
process.exit();
