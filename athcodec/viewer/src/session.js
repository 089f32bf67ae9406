// A session is one file in a worker. It takes the messages of the page, whose types a table lists, and answers by `post`. It knows
// the views; bytes are fetched by Download, decoded by Jobs, mixed by Mixing and packed for the GPU by Texels.

import { Download } from "./download.js";
import { clipAt } from "./frames.js";
import { Jobs } from "./jobs.js";
import { Mixing, sharesOf, sumOf } from "./mixing.js";
import { LoadError } from "./source.js";
import { readAttributes, readPrelude } from "./statics.js";
import { BLENDED, Texels } from "./texels.js";

const STATE_MS = 50; // Least time between two messages about the state.

export class Session {
  // What the page may ask for, by the type of its message.
  static #tasks = new Map([
    ["picture", (session, message) => session.#picture(message)],
    ["parts", (session, message) => session.#parts(message)],
    ["bake", (session, message) => session.#bake(message)],
    ["gpu", (session, message) => session.#gpu(message)],
    ["wind", (session, message) => session.#wind(message)],
    ["drop", (session, message) => session.#drop(message)],
    ["all", (session) => session.#download.look(true)],
    ["abort", (session) => session.#download.abort()],
    ["close", (session) => session.close()],
  ]);

  #post; #clip; #download;
  #file; #texels; #jobs;  // These are there once the file's front is.
  #views = new Map();     // {id: {level, frames, wanted, mixing}}: #view explains them.
  #relative;              // Positions are less the file's origin, as floats would break the file's bound there.
  #winds;                 // {strength, heading} for each clip; null: it has none.
  #known = new Set();     // The page knows the parts of these levels.
  #stateAt = 0; #stateTimer = 0;
  #closing = new AbortController();

  /** clip: name of the clip to begin with, null: the first. hostMesh: a Float32Array, for a file without its rest pose. */
  constructor(source, post, clip = null, hostMesh = null) {
    this.#post = post;
    this.#clip = clip;
    this.#download = new Download(source, hostMesh, this.#views, {
      came: (complete) => {
        if (!this.#jobs) return;
        this.#refine(this.#file.readyLevel(0)); // The look of level 0 must not depend on the order of events.
        this.#jobs.run();
        this.#state(complete);
      },
      attributes: () => this.#readAttributes(),
      stopped: (error) => this.#post({ type: "stopped", ...describe(error) }),
    });
  }

  async run() {
    try {
      this.#open(await this.#download.open());
    } catch (error) {
      this.#post({ type: "failed", ...describe(error) });
      this.close();
    }
  }

  /** Does what a message of the page asks for. */
  take(message) {
    const task = Session.#tasks.get(message.type);
    if (!task) throw new TypeError(`message: got the type ${message.type}, expected one of ${[...Session.#tasks.keys()].join(", ")}`);
    task(this, message);
  }

  #open(file) {
    const { info } = file, statics = readPrelude(file), clips = clipsOf(file);
    const levelNames = Array.from({ length: info.levelCount }, (_, level) => file.levelName(level));
    const first = this.#clip === null ? 0 : clips.findIndex(({ name }) => name === this.#clip);
    if (first < 0) {
      const names = clips.map(({ name }) => name).join(", ");
      throw new LoadError(`clip: got ${this.#clip}, expected one of ${names}`, "CLIP");
    }
    this.#file = file;
    this.#winds = clips.map(({ name }) => windOf({ ...statics.metadata, ...statics.metadata.clips?.[name] }));
    this.#relative = isFar(info);
    this.#texels = new Texels(file, statics.faces, this.#relative);
    this.#post({
      type: "opened", origin: this.#relative ? info.origin : [0, 0, 0], info: { ...info, levelNames }, statics, rest: this.#texels.rest, times: file.times(), branches: file.branches(),
      vertexSource: file.vertexSource(), vertexPlaces: file.vertexPlaces(), branchSource: file.branchSource(), clips, first,
      chunks: file.chunks().map(({ kind, level, segment, length }) => ({ kind, level, segment, length })),
      segments: Array.from({ length: info.segmentCount + 1 }, (_, s) => file.segmentStart(s)),
    });
    this.#jobs = new Jobs(file, this.#views, clips[first].firstSegment, this.#closing.signal, {
      kept: ({ level }) => this.#refine(level),
      decoded: (segment, level) => this.#post({ type: "decoded", segment, level }),
      damaged: (segment, level, error, isNews) => {
        if (isNews) this.#post({ type: "damaged", segment, level, ...describe(error) });
        this.#state(true);
      },
    });
    this.#state(true);
    this.#jobs.run();
    this.#download.run(clips[first].firstFrame);
  }

  #refine(level) {
    const rest = this.#texels.refine(level);
    if (rest) this.#post({ type: "rest", rest });
  }

  #readAttributes() {
    try {
      const attributes = readAttributes(this.#file);
      if (attributes.face_vertex_counts && attributes.face_vertex_indices) {
        this.#texels.faces = { counts: attributes.face_vertex_counts.array, array: attributes.face_vertex_indices.array };
        this.#known.clear(); // A level has more texels now.
      }
      this.#post({ type: "attributes", attributes });
    } catch (error) {
      this.#post({ type: "damaged", level: null, ...describe(error) });
    }
  }

  // Tells the page, but not at every piece.
  #state(now) {
    const wait = now ? 0 : this.#stateAt + STATE_MS - performance.now();
    if (wait > 0) {
      this.#stateTimer ||= setTimeout(() => this.#state(true), wait);
      return;
    }
    clearTimeout(this.#stateTimer);
    this.#stateTimer = 0;
    this.#stateAt = performance.now();
    const ready = Int8Array.from({ length: this.#file.info.segmentCount }, (_, segment) => this.#jobs.readyLevel(segment));
    this.#post({ type: "state", ...this.#download.progress(), ready });
  }

  // A view shows `frames` from now on. Bytes of the clips of `wanted` are fetched.
  #view({ view, level }, frames, wanted) {
    this.#views.set(view, { level, frames, wanted, mixing: this.#mixing(view) });
    this.#download.look();
    this.#jobs.run();
  }

  #drop({ view }) {
    this.#views.delete(view);
  }

  #mixing(id) {
    return this.#views.get(id)?.mixing ?? new Mixing(this.#file, this.#jobs);
  }

  // Tells of the parts of a level that the page does not know.
  #parts({ level }) {
    if (this.#known.has(level)) return;
    this.#known.add(level);
    this.#post({ type: "parts", level, parts: this.#texels.parts(level), texels: this.#texels.count(level) });
  }

  // Answers ATHMotion's #ask, whatever goes wrong: a picture that cannot be made as asked for is made without what fades.
  #picture(message) {
    const { view, id, clip, seconds, level, exactly = false } = message, start = performance.now();
    const answer = { type: "picture", view, id, shown: -1, exactly };
    try {
      Object.assign(answer, this.#answer(message));
    } catch (error) {
      Object.assign(answer, describe(error));
      try {
        if (!exactly) {
          answer.message = `picture of clip ${clip} at ${seconds} s, level ${level}: ${answer.message}`;
          this.#drop(message);
          Object.assign(answer, this.#answer({ ...message, old: null, heat: false, buffer: null }));
        }
      } catch {
        // The answer holds an error already.
      }
    }
    if (answer.shown >= 0) this.#parts({ level: answer.cut ?? answer.shown });
    answer.ms = performance.now() - start;
    this.#post(answer, [answer.data, answer.heat]);
  }

  #answer(message) {
    const { view, clip, seconds, wrap, level, exactly, aside, heat, positions = false, buffer, now, fade } = message;
    if (message.wind) return this.#inWind(message);
    const file = this.#file, mixing = aside ? new Mixing(file, this.#jobs) : this.#mixing(view), frame = file.frameAt(seconds, wrap, clip);
    mixing.last = null;
    const shown = exactly ? this.#jobs.exactly(frame, level) : this.#viewed(message, frame, mixing);
    if (!shown) return { frame };
    const relative = this.#relative; // Matrices of such files do not fade.
    mixing.fading.goTo(shown.level, now, exactly || relative ? 0 : fade);
    const { terms, cut } = mixing.faded(shown), data = sumOf(terms, positions
      ? (term) => file.positions(term.segments, term.frame, { fade: term.fade, relative })
      : (term, i) => this.#texels.pack(term, cut, i === 0 ? buffer : null));
    return { shown: cut, frame: shown.frame, fading: mixing.fading.underWay, clip: file.clips.indexOf(clipAt(file, shown.frame)),
      held: file.held, whole: positions, data, ...(heat && { heat: this.#distances(shown) }) };
  }

  // Each share is shown at the deepest level that is decoded of it; those of which nothing is are left out.
  #inWind(message) {
    const { view, clip, seconds, wrap, level, exactly, aside, positions = false, buffer, coarsely } = message;
    const file = this.#file, jobs = this.#jobs, frame = file.frameAt(seconds, wrap, clip);
    const used = sharesOf(file, this.#winds, message), frames = used.map((share) => share.frame);
    if (!aside) this.#view(message, frames, frames);
    const shares = used.flatMap((share) => {
      const shown = exactly ? jobs.exactly(share.frame, level) : jobs.show(share.frame, coarsely ? 0 : level);
      return shown ? { ...share, ...shown } : [];
    });
    if (shares.length === 0) return { frame };
    const mixing = this.#mixing(view), eases = !exactly && !aside, shown = Math.min(...shares.map((share) => share.level));
    const mixed = eases ? mixing.eased(message, shares) : { shares, fading: false }, xyz = this.#blended(mixed.shares);
    if (!aside) mixing.fading.goTo(shown);
    return { shown, cut: BLENDED, frame, fading: mixed.fading, clip, held: file.held, whole: positions,
      data: positions ? xyz : this.#texels.packExact(xyz, buffer) };
  }

  // The core blends floats. Far from the origin vertices are blended one by one, which keeps lengths less well.
  #blended(shares) {
    if (!this.#relative) return this.#file.blended(shares);
    const whole = shares.reduce((sum, { weight }) => sum + weight, 0), terms = shares.map((share) => ({ ...share, share: share.weight / whole }));
    return sumOf(terms, ({ segments, frame }) => this.#file.positions(segments, frame, { relative: true }));
  }

  // coarsely: level 0 for now, whatever is wanted.
  #viewed(message, frame, mixing) {
    const { level, old, coarsely } = message;
    if (old) old.frame = this.#file.frameAt(old.seconds, old.wrap, old.clip);
    this.#view(message, old ? [frame, old.frame] : [frame], [frame]);
    return mixing.change(frame, coarsely ? 0 : level, old);
  }

  // Returns how far the shown position of each vertex is from the position at the deepest level that is here.
  #distances({ frame, segments }) {
    const file = this.#file, deepest = this.#jobs.show(frame, file.info.levelCount - 1);
    const [a, b] = [segments, deepest.segments].map((each) => file.positions(each, frame, { relative: this.#relative }));
    return Float32Array.from({ length: a.length / 3 }, (_, i) =>
      Math.hypot(a[3 * i] - b[3 * i], a[3 * i + 1] - b[3 * i + 1], a[3 * i + 2] - b[3 * i + 2]));
  }

  // Tells of all frames of a clip at a level, or every `step`-th of them: see Texels.
  async #bake({ id, clip, level, step }) {
    try {
      const shownAt = (frame) => this.#jobs.exactly(frame, level);
      const baked = await this.#texels.bake(this.#file.clips[clip], level, step, shownAt, this.#closing.signal);
      this.#post({ type: "baked", id, level, step, ...baked }, [baked.data]);
    } catch (error) {
      this.#post({ type: "baked", id, level, data: null, ...describe(error) });
    }
  }

  // Tells the GPU form of a level. With `segment`, tells that of a segment at the level, and for each of the segment's frames the
  // coded frame that shows it.
  #gpu({ id, level, segment = null }) {
    const file = this.#file, answer = { type: "gpu", id, words: null, coded: null };
    try {
      answer.words = segment === null ? file.gpuLevel(level) : file.gpuSegment(segment, level);
      if (segment !== null) {
        const first = file.segmentStart(segment);
        answer.coded = Int32Array.from({ length: file.segmentStart(segment + 1) - first }, (_, i) => file.gpuFrame(first + i));
      }
    } catch (error) {
      Object.assign(answer, describe(error));
    }
    this.#post(answer, [answer.words, answer.coded]);
  }

  // Answers with the weight of each clip for a wind.
  #wind({ id, strength, heading }) {
    this.#post({ type: "wind", id, weights: this.#file.windWeights(this.#winds, strength, heading) });
  }

  close() {
    this.#post = () => {};
    clearTimeout(this.#stateTimer);
    this.#closing.abort();
    this.#download.abort();
  }
}

// Returns whether floats of positions are too coarse for the bound of a file or, if it has none, for its positions. A mesh that the
// host has stays where it is.
function isFar({ origin, maxError, isFloat64, restIsHost }) {
  const away = restIsHost ? 0 : Math.max(...origin.map(Math.abs));
  return maxError > 0 ? away * 2 ** -24 > maxError / 4 : isFloat64 && away > 0;
}

// Returns the clips with their numbers, and for every level the error and the one at the seam.
function clipsOf(file) {
  const levels = Array.from({ length: file.info.levelCount }, (_, level) => level);
  return file.clips.map((clip, index) => ({
    ...clip, index, seams: levels.map((level) => file.seamError(index, level)),
    errors: levels.map((level) => file.levelError(level, clip.firstSegment, clip.firstSegment + clip.segmentCount - 1)),
  }));
}

// A clip has a wind only if both are numbers.
function windOf({ strength, heading = 0 }) {
  return Number.isFinite(strength) && Number.isFinite(heading) ? { strength, heading } : null;
}

export function describe(error) {
  return { message: error.message, codeName: error.codeName ?? error.name };
}
