// Jobs decodes segments in short steps, first what the views show. It keeps them up to a limit, and pictures are made of them.

import { around, clipAt, segmentAt } from "./frames.js";
import { pause } from "./pause.js";

const STEPS = 8, SLICE_MS = 6; // Decoding looks at the clock every 8 steps and at the messages every 6 ms.
const MOST_PREPARED = 256 << 20; // Largest size of the decoded segments that are kept, bytes.
const COARSE = 1 / 8; // Largest share of a level's bytes that a coarser level has which is decoded before it.

export class Jobs {
  #file; #views; #firstSegment; #signal; #tell;
  #prepared = new Map(); // {"segment/level": Segment}: the most recently used is the last.
  #failed = new Set();   // These "segment/level" need a damaged chunk.
  #busy = false;
  #underway = new Set(); // These "segment/level" are in preparation: one runs, and the others wait for it.
  #read = new Set();     // The preparations under way read these segments.
  #bytes = [];           // bytes of the motion at each level, once they are asked for

  /** tell: functions that are called when a segment is `kept`, when it was `decoded` in steps, when it is found `damaged`. */
  constructor(file, views, firstSegment, signal, tell) {
    this.#file = file;
    this.#views = views;
    this.#firstSegment = firstSegment;
    this.#signal = signal;
    this.#tell = tell;
  }

  /** Returns the deepest level up to `most` that a segment can be shown at: its bytes are here and are not damaged; -1: none. */
  readyLevel(segment, most = Infinity) {
    let level = Math.min(most, this.#file.readyLevel(segment));
    while (level >= 0 && this.#failed.has(`${segment}/${level}`)) level--;
    return level;
  }

  /** Decodes what the views want and is here, one segment after another. */
  async run() {
    if (this.#busy) return;
    this.#busy = true;
    try {
      for (let job = this.#job(); job && !this.#signal.aborted; job = this.#job()) await this.#prepareInSteps(...job);
    } finally {
      this.#busy = false;
    }
  }

  // Returns what to decode next, if it is coarser than `level`.
  #job(level = Infinity) {
    const job = [...this.#jobs()].find(([segment, wish]) => wish >= 0 && !this.#prepared.has(`${segment}/${wish}`));
    return job && job[1] < level && !this.#underway.has(job.join("/")) ? job : null;
  }

  // Yields segments and levels to decode: coarse levels of what the views show and of what comes next, so that no boundary of
  // segments shows level 0, then the levels that are asked for; at first what a view begins with.
  * #jobs() {
    if (this.#views.size === 0 && this.#prepared.size === 0) yield [this.#firstSegment, this.readyLevel(this.#firstSegment)];
    const now = [], blended = [], next = [];
    for (const { level: most, frames } of this.#views.values())
      for (const frame of frames) {
        const [segment, other = -1] = around(this.#file, frame), level = this.readyLevel(segment, most);
        const { firstSegment, segmentCount } = clipAt(this.#file, frame), after = firstSegment + (segment - firstSegment + 1) % segmentCount;
        now.push([segment, level]);
        if (other >= 0 && this.readyLevel(other, level) === level) blended.push([other, level]);
        next.push([after, this.readyLevel(after, most)]);
      }
    for (const [segment, level] of [...now, ...next]) yield* this.#coarse(segment, level);
    yield* now;
    yield* blended;
    yield* next;
  }

  // Returns the levels of a segment to decode before a level, the coarsest first, unless a deeper one than these is decoded.
  #coarse(segment, level) {
    const coarse = [];
    for (let finer = level, l = level - 1; l >= 0 && !this.#prepared.has(`${segment}/${l + 1}`); l--) {
      const isHere = () => !this.#failed.has(`${segment}/${l}`) && this.#file.ranges(l, segment, segment).length === 0;
      if (this.#size(l) > COARSE * this.#size(finer) || !isHere()) continue;
      coarse.unshift([segment, l]);
      finer = l;
    }
    return coarse;
  }

  #size(level) {
    const { segmentCount } = this.#file.info;
    return this.#bytes[level] ??= this.#file.ranges(level, 0, segmentCount - 1, true).reduce((sum, { size }) => sum + size, 0);
  }

  // What is wanted sooner, in the middle of it, is decoded first: a long preparation does not hold up a coarse level.
  async #prepareInSteps(segment, level) {
    const key = `${segment}/${level}`;
    let from = null;
    this.#underway.add(key);
    try {
      const known = this.#known(segment, level), preparation = this.#file.preparation(segment, level, known);
      this.#read.add(from = known.from);
      let start = performance.now();
      while (!preparation.step(STEPS)) {
        if (performance.now() - start < SLICE_MS) continue;
        await pause();
        for (let job; !this.#signal.aborted && (job = this.#job(level));) await this.#prepareInSteps(...job);
        if (this.#signal.aborted) return;
        start = performance.now();
      }
      this.#keep(preparation.segment);
      this.#tell.decoded(segment, level);
    } catch (error) {
      this.#damaged(segment, level, error);
    } finally {
      this.#read.delete(from);
      this.#underway.delete(key);
    }
  }

  // Returns what a preparation may go on from, the segment at the deepest level decoded so far, and the segment that it is joined to.
  #known(index, level) {
    const following = this.#prepared.get(`${this.#file.joinedTo(index, level)}/${level}`) ?? null;
    let from = null;
    while (!from && level > 0) from = this.#prepared.get(`${index}/${--level}`);
    return { from, keep: true, following };
  }

  // Leaves out what needs the chunk that is damaged, in all segments.
  #damaged(segment, level, error) {
    const file = this.#file, { levelCount, segmentCount } = file.info, chunk = file.chunks()[error.chunk];
    const known = this.#failed.size, bad = chunk?.level < levelCount ? Math.min(level, chunk.level) : level;
    this.#failed.add(`${segment}/${level}`);
    for (let s = 0; chunk && s < segmentCount; s++)
      for (let l = bad; l < levelCount; l++)
        if (file.ranges(l, s, s, true).some(({ offset, size }) => offset <= chunk.offset && chunk.offset < offset + size)) this.#failed.add(`${s}/${l}`);
    this.#tell.damaged(segment, bad, error, this.#failed.size > known);
  }

  #keep(segment) {
    this.#tell.kept(segment);
    this.#use(segment);
    const { frameCount, segmentCount, placeCount } = this.#file.info;
    const shown = [...this.#views.values()].reduce((sum, { frames }) => sum + frames.length, 0);
    const most = Math.max(6, 2 * shown + 2, Math.floor(MOST_PREPARED / (16 * placeCount * (frameCount / segmentCount))));
    const wanted = new Set(Array.from(this.#jobs(), (job) => job.join("/")));
    for (const [oldest, old] of this.#prepared) {
      if (this.#prepared.size <= most) break;
      if (this.#read.has(old) || old === segment || wanted.has(oldest)) continue;
      old.free();
      this.#prepared.delete(oldest);
    }
    return segment;
  }

  #use(segment) {
    if (!segment) return null;
    const key = `${segment.index}/${segment.level}`, old = this.#prepared.get(key);
    if (old !== segment) old?.free();
    this.#prepared.delete(key);
    this.#prepared.set(key, segment);
    return segment;
  }

  #segment(index, level) {
    return this.#use(this.#prepared.get(`${index}/${level}`));
  }

  /** Returns a decoded segment of a level, whichever it is, and keeps it from being let go of. */
  anyAt(level) {
    return this.#use([...this.#prepared.values()].find((segment) => segment.level === level));
  }

  /** Returns what shows `frame`, {frame, level, segments}: at the deepest level that is decoded or, where nothing is, at the
   * coarsest; where the segment of the frame is not to be had, that of the frame that it blends into will do. */
  show(frame, level) {
    let picture = null;
    for (let shown = level; !picture && shown >= 0; shown--) picture = this.decoded(frame, shown);
    picture ??= this.coarser(frame, 0);
    for (let shown = level; !picture && shown >= 0; shown--) picture = this.decoded(frame, shown, true);
    return picture;
  }

  /** Returns what show() does, but while a coarser level than `now` is asked for and is not decoded, `now` stays. */
  showNext(frame, level, now) {
    return (now > level && !this.isDecoded(frame, level) && this.decoded(frame, now)) || this.show(frame, level);
  }

  /** Returns what shows `frame` at this level if that is decoded; else null. blended: the frame that it blends into will do. */
  decoded(frame, level, blended = false) {
    const segments = around(this.#file, frame).map((index) => this.#segment(index, level));
    return segments[0] || (blended && segments[1]) ? { frame, level, segments } : null;
  }

  /** Returns what shows `frame` at this level, decoded now. Throws where that cannot be. */
  exactly(frame, level) {
    return { frame, level, segments: around(this.#file, frame).map((index) => this.#now(index, level)) };
  }

  /** Returns what shows `frame` at this level, decoded now; null where that cannot be. */
  coarser(frame, level) {
    const [index, next] = around(this.#file, frame).map((segment) => (this.readyLevel(segment) < level ? -1 : segment));
    if (index < 0) return null;
    try {
      return { frame, level, segments: [this.#now(index, level), this.#segment(next, level)] };
    } catch (error) {
      this.#damaged(index, level, error);
      return null;
    }
  }

  #now(index, level) {
    return this.#segment(index, level) ?? this.#keep(this.#file.prepare(index, level, this.#known(index, level)));
  }

  /** Returns whether the segment of `frame` is decoded as deep as it is here, up to a level. */
  isDecoded(frame, level) {
    const index = segmentAt(this.#file, frame);
    return this.#prepared.has(`${index}/${this.readyLevel(index, level)}`);
  }
}
