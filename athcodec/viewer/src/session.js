// One file in a worker: fetches what the views need of the clips that they play, level by level and ahead of the playhead
// first; decodes it in short steps between the pictures that are asked for; packs pictures for the GPU. The page is told
// by `post`.

import { AthFile } from "../ath_decoder.mjs";
import { Fading } from "./fading.js";
import { normals, turns } from "./normals.js";
import { attributeRanges, readAttributes, readPrelude } from "./statics.js";

const FIRST_BYTES = 12 << 10;     // of the first request: prelude and coarse levels of a plant of 8,000 vertices
const LEAST_REQUEST = 16 << 10, MOST_REQUEST = 2 << 20;
const REQUEST_SECONDS = 0.15;     // what a request should take, by the speed of those before
const LANES = 2;                  // requests at once
const AHEAD_SECONDS = 8;          // what is fetched in full before what comes later
const STEPS = 8, SLICE_MS = 6;    // of decoding between two looks at the messages
const MOST_PREPARED = 256 << 20;  // bytes of decoded segments that are kept
const STATE_MS = 50;
const WIDTH = 1024;               // of the texture, in texels of four numbers
const REFINED_REST = 0x15;
const MOST_BLENDED = 4;           // shares
const GONE = 1e-3;                // a weight that is seen no more
const LOOKED_AWAY = 1;            // seconds without a picture, after which weights are at once what they are wanted to be
const BLENDED = -1;               // in place of a level: all vertices are exact, as blended clips leave them

const channel = new MessageChannel(), waiting = [];
channel.port1.onmessage = () => waiting.shift()();
const turn = () => new Promise((done) => { waiting.push(done); channel.port2.postMessage(0); });

export class Session {
  #file = null;
  #front = new Uint8Array(0);
  #came = 0;              // bytes from the file's beginning on
  #views = new Map();     // id: {level, frames, wanted, fading}, the frame of a clip that fades out, which is not fetched, last
  #mixtures = new Map();  // of views: shares that were shown last and when, see #eased
  #prepared = new Map();  // "segment/level": Segment, those used last at the end
  #underway = [];         // ranges that are being fetched
  #parts = new Map();
  #told = new Set();      // levels whose parts the page knows
  #attributes = "missing"; // "here"
  #speed = 0;             // bytes a second
  #busy = false;
  #goingOnFrom = null;    // the segment that the preparation under way reads
  #failed = new Set();    // "segment/level" that need a damaged chunk
  #everything = false;    // whether all bytes are wanted, whatever the views show
  #whole = false;         // whether they are here
  #stopped = false;       // no more bytes come
  #cut = new Set();       // ranges that the end of the file cuts, which have been asked for
  #ended = false;         // the page knows that the file is too short
  #wake = null;
  #stateAt = 0;
  #stateTimer = 0;
  #closed = false;
  #opened = false;
  #hasFront = null;
  #order = null;
  #rest = null;           // that matrices are applied to
  #finerRest = false;     // whether that is level 0's, and levels above have another
  #restNormals = null;
  #faces = null;
  #first = 0;             // the clip to begin with
  #winds = [];            // of each clip {strength, heading}, null: it has none

  /** clip: the name of the one to begin with, null: the file's first. hostMesh: of a file that does not hold its rest
   * pose, a Float32Array. */
  constructor(source, post, clip = null, hostMesh = null) {
    this.source = source;
    this.post = post;
    this.clip = clip;
    this.hostMesh = hostMesh;
  }

  // ---- opening ----

  async run() {
    const opened = new Promise((done) => { this.#hasFront = done; });
    const reading = this.#readFront();
    try {
      await Promise.race([opened, reading]);
      this.#tellOfFile();
    } catch (error) {
      reading.catch(() => {});
      this.source.abort();
      if (!this.#closed) this.post({ type: "failed", ...describe(error) });
      return;
    }
    try {
      await reading; // without ranges: the whole file
      this.#readAttributes();
    } catch (error) {
      this.#stop(error);
      return;
    }
    await Promise.all(Array.from({ length: LANES }, () => this.#lane()));
  }

  async #readFront() {
    for (let needed = FIRST_BYTES; !this.#file;) {
      const have = this.#front.length;
      await this.source.read(have, needed - have, (bytes, offset) => this.#take(bytes, offset));
      if (this.#file) return;
      if (this.#front.length === 0) throw Object.assign(new Error("NOT_AN_ATH_FILE: got no bytes"), { codeName: "NOT_AN_ATH_FILE" });
      if (this.#front.length < needed) AthFile.open(this.#front); // throws what is missing
      needed = Math.max(AthFile.front(this.#front).needed, this.#front.length + 1);
    }
  }

  #tellOfFile() {
    const file = this.#file, { info } = file, statics = readPrelude(file), clips = this.#clips();
    const levelNames = Array.from({ length: info.levelCount }, (_, level) => file.levelName(level));
    this.#faces = statics.faces;
    this.#winds = clips.map(({ name }) => windOf({ ...statics.metadata, ...statics.metadata.clips?.[name] }));
    this.#first = this.clip === null ? 0 : clips.findIndex(({ name }) => name === this.clip);
    if (this.#first < 0) {
      const names = clips.map(({ name }) => name).join(", ");
      throw Object.assign(new Error(`clip: got ${this.clip}, expected one of ${names}`), { codeName: "CLIP" });
    }
    this.#order = file.vertexSource();
    this.#finerRest = file.chunks().some(({ kind, level }) => kind === REFINED_REST && level === 1);
    this.#lookForFinerRest();
    this.#rest ??= file.levelRest(0);
    this.post({
      type: "opened", info: { ...info, levelNames }, statics, rest: this.#rest, times: file.times(), branches: file.branches(),
      vertexSource: this.#order, branchSource: file.branchSource(), clips, first: this.#first,
      chunks: file.chunks().map(({ kind, level, segment, length }) => ({ kind, level, segment, length })),
      segments: Array.from({ length: info.segmentCount + 1 }, (_, s) => file.segmentStart(s)),
    });
    this.#opened = true;
    this.#state(true);
    this.#decode();
  }

  // The clips with their numbers, and for every level the error and the one at the seam.
  #clips() {
    const file = this.#file, levels = Array.from({ length: file.info.levelCount }, (_, level) => level);
    return file.clips.map((clip, index) => ({
      ...clip, index, seams: levels.map((level) => file.seamError(index, level)),
      errors: levels.map((level) => file.levelError(level, clip.firstSegment, clip.firstSegment + clip.segmentCount - 1)),
    }));
  }

  // As soon as its bytes are here, whichever level is shown: what level 0 looks like does not depend on the order of events.
  #lookForFinerRest() {
    if (this.#finerRest && this.#file.readyLevel(0) > 0) this.#readFinerRest();
  }

  // The reference pose of the levels above 0: matrices of level 0 are at home on it, too.
  #readFinerRest() {
    if (!this.#finerRest) return;
    this.#finerRest = false;
    try {
      this.#rest = this.#file.levelRest(1);
      this.#restNormals = null;
      if (this.#opened) this.post({ type: "rest", rest: this.#rest });
    } catch {
      // damaged: levels that need it will say so
    }
  }

  #clipAt(frame) {
    return this.#file.clips.findLast(({ firstFrame }) => firstFrame <= frame);
  }

  #segmentAt(frame) {
    return this.#file.segmentOf(Math.floor(frame));
  }

  // Bytes that have come, in any order once the file is open.
  #take(bytes, offset) {
    if (this.#closed) return;
    if (offset <= this.#came) this.#came = Math.max(this.#came, offset + bytes.length);
    if (this.#file) {
      this.#file.feed(bytes, offset);
      this.#lookForFinerRest();
      this.#changed();
      return;
    }
    const skip = this.#front.length - offset;
    if (skip < 0 || skip >= bytes.length) return;
    const front = new Uint8Array(offset + bytes.length);
    front.set(this.#front);
    front.set(bytes.subarray(skip), this.#front.length);
    this.#front = front;
    if (!AthFile.front(front).ready) return;
    this.#file = AthFile.open(front, { hostMesh: this.hostMesh });
    this.#front = new Uint8Array(0);
    this.#hasFront();
  }

  // ---- fetching ----

  async #lane() {
    while (!this.#closed && !this.#stopped) {
      const range = this.#next();
      if (!range) {
        this.#tellOfEnd();
        await new Promise((wake) => { const before = this.#wake; this.#wake = () => { before?.(); wake(); }; });
        continue;
      }
      this.#underway.push(range);
      const start = performance.now();
      let came = 0;
      try {
        await this.source.read(range.offset, range.size, (bytes, offset) => {
          came += bytes.length;
          this.#take(bytes, offset);
        });
      } catch (error) {
        this.#stop(error);
        return;
      } finally {
        this.#underway.splice(this.#underway.indexOf(range), 1);
      }
      const seconds = (performance.now() - start) / 1000;
      this.#speed = this.#speed * 0.5 + (came / Math.max(seconds, 1e-3)) * 0.5;
      this.#readAttributes();
      this.#changed(true);
    }
  }

  #stop(error) {
    if (this.#closed || this.#stopped) return;
    this.#stopped = true;
    this.#wakeUp();
    this.post({ type: "stopped", ...describe(error) });
  }

  // Where the file ends before what is wanted of it.
  #tellOfEnd() {
    const { total } = this.source, { fileLength } = this.#file.info;
    if (this.#ended || total === null || total >= fileLength || this.#underway.length > 0 || this.#wanted().next().done) return;
    this.#ended = true;
    this.post({ type: "stopped", message: `MISSING: got a file of ${total} bytes, expected ${fileLength}`, codeName: "MISSING" });
  }

  /** Has all bytes fetched, behind those that the views want. */
  fetchAll() {
    this.#everything = true;
    this.#wakeUp();
  }

  /** Ends the downloads; what is here goes on playing. */
  abort() {
    const error = new DOMException("loading was aborted", "AbortError");
    this.source.abort(error);
    if (this.#opened) this.#stop(error);
  }

  // The next bytes to ask for: one range; null: none for now.
  #next() {
    if (this.source.ranged === false) return null; // everything came with the first request
    const most = Math.min(MOST_REQUEST, Math.max(LEAST_REQUEST, this.#speed * REQUEST_SECONDS));
    let found = null;
    for (const { offset, size } of this.#wanted()) {
      const from = Math.max(offset, Math.min(this.#came, offset + size)); // the beginning of a chunk may be here
      const end = Math.min(offset + size, this.source.total ?? Infinity), range = { offset: from, size: end - from };
      const cut = end < offset + size;
      if (range.size <= 0 || (cut && this.#cut.has(offset)) || this.#isUnderway(range)) {
        if (found) break;
        continue;
      }
      if (cut && !found) this.#cut.add(offset);
      if (!found) found = range;
      else if (range.offset === found.offset + found.size) found.size += range.size;
      else break;
      if (found.size >= most) break;
    }
    return found;
  }

  #isUnderway({ offset, size }) {
    return this.#underway.some((other) => offset < other.offset + other.size && other.offset < offset + size);
  }

  // Missing ranges in the order in which they are wanted.
  * #wanted() {
    const wishes = this.#wishes();
    for (const { soon, level } of wishes) yield* this.#missing(soon, 0, Math.min(1, level));
    if (this.#attributes === "missing") yield* attributeRanges(this.#file);
    for (const { soon, level } of wishes) yield* this.#missing(soon, 2, level);
    for (const { late, level } of wishes) yield* this.#missing(late, 0, level);
    if (this.#everything && !this.#whole)
      yield* this.#file.chunks().filter(({ fed }) => !fed).map(({ offset, length }) => ({ offset, size: length }));
  }

  // Of every clip that a view plays, the deepest level and the segments from the playhead on: {level, soon, late}. What
  // fades out shows what is here.
  #wishes() {
    const wishes = new Map(), views = [...this.#views.values()];
    if (views.length === 0) views.push({ level: 0, wanted: [this.#file.clips[this.#first].firstFrame] });
    for (const { level, frame } of views.flatMap(({ level, wanted }) => wanted.map((frame) => ({ level, frame })))) {
      const clip = this.#clipAt(frame), wish = wishes.get(clip);
      if (wish) wish.level = Math.max(wish.level, level);
      else wishes.set(clip, { level, ...this.#fromHere(clip, frame) });
    }
    return [...wishes.values()];
  }

  #fromHere({ firstSegment, segmentCount, duration }, frame) {
    const now = this.#segmentAt(frame) - firstSegment;
    const order = Array.from({ length: segmentCount }, (_, i) => firstSegment + (now + i) % segmentCount);
    const ahead = 1 + Math.ceil(AHEAD_SECONDS * segmentCount / Math.max(duration, 1e-9));
    return { soon: order.slice(0, ahead), late: order.slice(ahead) };
  }

  * #missing(segments, from, to) {
    for (let level = from; level <= to; level++)
      for (const segment of segments)
        if (this.#file.readyLevel(segment) < level) yield* this.#file.ranges(level, segment, segment);
  }

  // Tells the page of the named arrays once all that can be had are here.
  #readAttributes() {
    const end = this.source.total ?? Infinity;
    const left = attributeRanges(this.#file).filter(({ offset, size }) => offset + size <= end);
    if (this.#attributes !== "missing" || (left.length > 0 && this.source.ranged !== false)) return;
    try {
      const attributes = readAttributes(this.#file);
      if (attributes.face_vertex_counts && attributes.face_vertex_indices) {
        this.#faces = { counts: attributes.face_vertex_counts.array, array: attributes.face_vertex_indices.array };
        this.#restNormals = null;
        this.#told.clear(); // texels of a level
      }
      this.post({ type: "attributes", attributes });
    } catch (error) {
      this.post({ type: "damaged", level: null, ...describe(error) });
    }
    this.#attributes = "here";
  }

  // ---- what is here ----

  #changed(soon = false) {
    this.#wakeUp();
    if (this.#opened) {
      this.#decode();
      this.#state(soon);
    }
  }

  #wakeUp() {
    const wake = this.#wake;
    this.#wake = null;
    wake?.();
  }

  // Tells the page, not at every piece.
  #state(now = false) {
    const since = performance.now() - this.#stateAt;
    if (!now && since < STATE_MS) {
      if (!this.#stateTimer) this.#stateTimer = setTimeout(() => this.#state(true), STATE_MS - since);
      return;
    }
    clearTimeout(this.#stateTimer);
    this.#stateTimer = 0;
    this.#stateAt = performance.now();
    if (this.#closed) return;
    const { segmentCount, fileLength } = this.#file.info;
    this.#whole ||= this.#file.chunks().every(({ fed }) => fed);
    this.post({
      type: "state", fetched: this.source.fetched, requests: this.source.requests, ranged: this.source.ranged,
      total: fileLength, whole: this.#whole, speed: this.#speed,
      ready: Int8Array.from({ length: segmentCount }, (_, segment) => this.#readyLevel(segment)),
    });
  }

  // The deepest level up to `most` that a segment can be shown at: its bytes are here and are not damaged; -1: none.
  #readyLevel(segment, most = Infinity) {
    let level = Math.min(most, this.#file.readyLevel(segment));
    while (level >= 0 && this.#failed.has(`${segment}/${level}`)) level--;
    return level;
  }

  // ---- decoding ----

  /** A view shows `frames` at `level` from now on: one, two that fade over, or those that are blended. Bytes of the clips of
   * `wanted` are fetched; `ahead` are decoded as well. */
  view(id, level, frames, wanted = frames.slice(0, 1), ahead = []) {
    this.#views.set(id, { level, frames, wanted, ahead, fading: this.#fading(id) });
    this.#wakeUp();
    if (this.#opened) this.#decode();
  }

  drop(id) {
    this.#views.delete(id);
    this.#mixtures.delete(id);
  }

  #fading(id) {
    return this.#views.get(id)?.fading ?? new Fading();
  }

  async #decode() {
    if (this.#busy) return;
    this.#busy = true;
    try {
      for (let job = this.#job(); job && !this.#closed; job = this.#job()) await this.#prepareInSteps(...job);
    } finally {
      this.#busy = false;
    }
  }

  #job() {
    for (const [segment, level] of this.#jobs()) if (level >= 0 && !this.#prepared.has(`${segment}/${level}`)) return [segment, level];
    return null;
  }

  // Segments and levels to decode: what the views show, then what that blends into and what they show next; before there is
  // a view, what the first one begins with.
  * #jobs() {
    if (this.#views.size === 0 && this.#prepared.size === 0) {
      const { firstSegment } = this.#file.clips[this.#first];
      yield [firstSegment, this.#readyLevel(firstSegment)];
    }
    const shown = [...this.#views.values()].flatMap(({ level, frames }) => frames.map((frame) => {
      const [own, other] = this.#around(frame);
      return { clip: this.#clipAt(frame), most: level, own, other, level: this.#readyLevel(own, level) };
    }));
    for (const { own, level } of shown) yield [own, level];
    for (const { other = -1, level } of shown) if (other >= 0 && this.#readyLevel(other, level) === level) yield [other, level];
    for (const { clip: { firstSegment, segmentCount }, own, most } of shown) {
      const next = firstSegment + (own - firstSegment + 1) % segmentCount;
      yield [next, this.#readyLevel(next, most)];
    }
    for (const { level, ahead } of this.#views.values())
      for (const segment of ahead.map((frame) => this.#segmentAt(frame))) yield [segment, this.#readyLevel(segment, level)];
  }

  async #prepareInSteps(segment, level) {
    try {
      const from = this.#goingOnFrom = this.#before(segment, level);
      const preparation = this.#file.preparation(segment, level, this.#known(segment, level, from));
      let start = performance.now();
      while (!preparation.step(STEPS)) {
        if (performance.now() - start < SLICE_MS) continue;
        await turn();
        if (this.#closed) return;
        start = performance.now();
      }
      this.#keep(preparation.segment);
      this.post({ type: "decoded", segment, level });
    } catch (error) {
      this.#damaged(segment, level, error);
    }
    this.#goingOnFrom = null;
  }

  // The deepest that is decoded of a segment short of this level: decoding goes on from there, if it can.
  #before(index, level) {
    let before = null;
    while (!before && level > 0) before = this.#prepared.get(`${index}/${--level}`);
    return before;
  }

  // What a preparation begins with: what it goes on from, and the segment that it is joined to, if that is decoded.
  #known(index, level, from) {
    const following = this.#prepared.get(`${this.#file.joinedTo(index, level)}/${level}`) ?? null;
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
    if (this.#failed.size > known) this.post({ type: "damaged", segment, level: bad, ...describe(error) });
    this.#state(true);
  }

  #keep(segment) {
    if (segment.level > 0) this.#readFinerRest();
    const key = `${segment.index}/${segment.level}`;
    this.#prepared.get(key)?.free();
    this.#prepared.delete(key);
    this.#prepared.set(key, segment);
    const { frameCount, segmentCount, vertexCount } = this.#file.info;
    const shown = [...this.#views.values()].reduce((sum, { frames }) => sum + frames.length, 0);
    const most = Math.max(6, 2 * shown + 2, Math.floor(MOST_PREPARED / (16 * vertexCount * (frameCount / segmentCount))));
    const wanted = new Set(Array.from(this.#jobs(), (job) => job.join("/")));
    for (const [oldest, old] of this.#prepared) {
      if (this.#prepared.size <= most) break;
      if (old === this.#goingOnFrom || old === segment || wanted.has(oldest)) continue;
      old.free();
      this.#prepared.delete(oldest);
    }
  }

  #segment(index, level) {
    const key = `${index}/${level}`, segment = this.#prepared.get(key);
    if (!segment) return null;
    this.#prepared.delete(key);
    this.#prepared.set(key, segment);
    return segment;
  }

  // Numbers of the segments that show `frame`: its own, and that of the frame that it blends into.
  #around(frame) {
    const { firstFrame, frameCount } = this.#clipAt(frame), low = Math.floor(frame);
    const high = frame > low ? firstFrame + (low + 1 - firstFrame) % frameCount : low;
    return [...new Set([low, high].map((place) => this.#file.segmentOf(place)))];
  }

  // What shows `frame`, {frame, level, segments}: at the deepest level that is decoded or, where nothing is, at the
  // coarsest; where its own segment is not to be had, the frame that it blends into.
  #show(frame, level) {
    for (const blended of [false, true]) {
      for (let shown = level; shown >= 0; shown--) {
        const found = this.#decoded(frame, shown, blended);
        if (found) return found;
      }
      const found = blended ? null : this.#coarser(frame, 0);
      if (found) return found;
    }
    return null;
  }

  // The same but that of two levels that are decoded a coarser one waits for the one that is asked for.
  #showNext(frame, level, now) {
    return (now > level && !this.#isDecoded(frame, level) && this.#decoded(frame, now)) || this.#show(frame, level);
  }

  // At this level and no other, if that is decoded; else null. blended: the frame that it blends into will do.
  #decoded(frame, level, blended = false) {
    const segments = this.#around(frame).map((index) => this.#segment(index, level));
    return segments[0] || (blended && segments[1]) ? { frame, level, segments } : null;
  }

  // At this level and no other, decoded now. Throws where that cannot be.
  #exactly(frame, level) {
    return { frame, level, segments: this.#around(frame).map((index) => this.#now(index, level)) };
  }

  // The same where it can be; null where it cannot.
  #coarser(frame, level) {
    const [index, next] = this.#around(frame).map((segment) => (this.#readyLevel(segment) < level ? -1 : segment));
    if (index < 0) return null;
    try {
      return { frame, level, segments: [this.#now(index, level), next >= 0 ? this.#segment(next, level) : null] };
    } catch (error) {
      this.#damaged(index, level, error);
      return null;
    }
  }

  #now(index, level) {
    const there = this.#segment(index, level);
    if (there) return there;
    const segment = this.#file.prepare(index, level, this.#known(index, level, this.#before(index, level)));
    this.#keep(segment);
    return segment;
  }

  // From one clip to another: the old one until the new one is decoded as deep as it is here; then both at one level,
  // `old` in what is returned, of which `share` is shown.
  #change(frame, old, level, now) {
    if (!old.begun && !this.#isDecoded(frame, level)) return this.#showNext(old.frame, level, now) ?? this.#show(frame, level);
    const shown = this.#showNext(frame, level, now), before = old.share > 0 ? this.#show(old.frame, level) : null;
    if (!shown || !before) return shown ?? before;
    const both = Math.min(shown.level, before.level);
    const [a, b] = [shown, before].map((picture) => (picture.level === both ? picture : this.#coarser(picture.frame, both)));
    return a && b ? { ...a, old: b, share: old.share } : shown;
  }

  #isDecoded(frame, level) {
    const index = this.#segmentAt(frame);
    return this.#prepared.has(`${index}/${this.#readyLevel(index, level)}`);
  }

  // ---- pictures ----

  parts(level) {
    if (!this.#parts.has(level)) this.#parts.set(level, level === BLENDED ? this.#allExact() : this.#file.parts(level));
    return this.#parts.get(level);
  }

  #allExact() {
    const exactCount = this.#file.info.vertexCount, one = (number) => Int32Array.of(number);
    return { nodeCount: 0, exactCount, branch: one(-1), first: one(0), count: one(exactCount), index: one(0) };
  }

  /** Tells of the parts of a level, where the page does not know them. */
  tell(level) {
    if (this.#told.has(level)) return;
    this.#told.add(level);
    this.post({ type: "parts", level, parts: this.parts(level), texels: this.texels(level) });
  }

  /** The picture of a view: see ATHMotion's #ask. Whatever goes wrong, there is an answer; where a picture cannot be made as it
   * is asked for, it is made without what fades. */
  picture(message) {
    const { view, id, clip, seconds, level, exactly = false } = message, start = performance.now();
    const answer = { type: "picture", view, id, shown: -1, exactly };
    try {
      Object.assign(answer, this.#answer(message));
    } catch (error) {
      const { message: why, codeName } = describe(error);
      Object.assign(answer, { message: exactly ? why : `picture of clip ${clip} at ${seconds} s, level ${level}: ${why}`, codeName });
      if (!exactly) this.drop(view);
      try {
        if (!exactly) Object.assign(answer, this.#answer({ ...message, old: null, heat: false, buffer: null }));
      } catch {
        // it is said already
      }
    }
    if (answer.shown >= 0) this.tell(answer.cut ?? answer.shown);
    answer.ms = performance.now() - start;
    this.post(answer, [answer.data, answer.heat].filter(Boolean).map((array) => array.buffer));
  }

  #answer(message) {
    const { view, clip, seconds, wrap, level, ahead = null, old = null, exactly = false, aside = false, heat = false, positions = false,
      buffer = null, now = 0, fade = 0, coarsely = false } = message;
    const shares = this.#shares(message);
    if (shares) return this.#ofShares(message, shares);
    if (!aside) this.#mixtures.delete(view);
    const frame = this.#file.frameAt(seconds, wrap, clip), fading = aside ? new Fading() : this.#fading(view);
    const shown = exactly ? this.#exactly(frame, level) : this.#viewed({ view, frame, level, old, fading, coarsely,
      ahead: ahead === null ? [] : [this.#file.frameAt(ahead, wrap, clip)] });
    if (!shown) return { frame };
    fading.to(shown.level, now, exactly ? 0 : fade);
    return { ...this.#picture(shown, fading, positions, buffer), ...(heat ? { heat: this.#distances(shown) } : {}) };
  }

  // Frames that are blended, [{frame, weight}]: of clips for a wind, or of two places of a clip that plays without an end; null:
  // there is one alone.
  #shares({ wind, places, clip, seconds, wrap }) {
    const file = this.#file;
    if (wind)
      return file.windWeights(this.#winds, ...wind).flatMap((weight, index) =>
        (weight > 0 ? [{ weight, clip: index, frame: file.frameAt(seconds, wrap, index) }] : []));
    return places?.length > 1 ? places.map((place) => ({ weight: place.weight, frame: file.frameAt(place.seconds, wrap, clip) })) : null;
  }

  // Each at the deepest level that is decoded of it; those of which nothing is are left out.
  #ofShares(message, used) {
    const { view, clip, seconds, wrap, level, exactly = false, aside = false, positions = false, buffer = null, coarsely = false } = message;
    const file = this.#file, shares = [], frames = used.map((share) => share.frame), frame = file.frameAt(seconds, wrap, clip);
    if (!aside) this.view(view, level, frames, frames);
    for (const share of used) {
      const shown = exactly ? this.#exactly(share.frame, level) : this.#show(share.frame, coarsely ? 0 : level);
      if (shown) shares.push({ ...share, ...shown });
    }
    if (shares.length === 0) return { frame };
    const shown = Math.min(...shares.map((share) => share.level)), eases = message.wind && !exactly && !aside;
    const mixed = eases ? this.#eased(message, shares) : { shares, fading: false }, xyz = file.blended(mixed.shares);
    if (!aside) this.#fading(view).to(shown);
    return { shown, cut: BLENDED, frame, fading: mixed.fading, clip, held: file.held, whole: positions,
      data: positions ? xyz : this.#packExact(xyz, buffer) };
  }

  // Shares on their way to these, as clips and levels of them come and go; at first from the clip that was shown.
  #eased({ view, clip, seconds, wrap, now = 0, fade = 0 }, wanted) {
    const { level } = this.#fading(view), alone = level >= 0 ? { shares: [{ clip, level, weight: 1 }], at: now } : null;
    const before = this.#mixtures.get(view) ?? alone, passed = before ? (now - before.at) / 1000 : Infinity;
    const part = fade > 0 && passed < LOOKED_AWAY ? 1 - Math.exp(-3 * Math.max(0, passed) / fade) : 1;
    const same = (a) => (b) => a.clip === b.clip && a.level === b.level;
    const leaving = (before?.shares ?? []).filter((share) => part < 1 && !wanted.some(same(share)) && share.weight * (1 - part) > GONE);
    const old = leaving.flatMap((share) => {
      const there = this.#decoded(this.#file.frameAt(seconds, wrap, share.clip), share.level);
      return there ? [{ ...there, clip: share.clip, weight: share.weight * (1 - part) }] : [];
    });
    const arrived = wanted.map((share) => {
      const weight = before?.shares.find(same(share))?.weight ?? 0;
      return { ...share, weight: weight + (share.weight - weight) * part };
    });
    const shares = [...arrived, ...old].sort((a, b) => b.weight - a.weight).slice(0, MOST_BLENDED).filter(({ weight }) => weight > 0);
    this.#mixtures.set(view, { shares, at: now });
    const fading = old.length > 0 || wanted.some((share) => Math.abs(share.weight - (shares.find(same(share))?.weight ?? 0)) > GONE);
    return { shares, fading };
  }

  // What the answer says of it.
  #picture(shown, fading, positions, buffer) {
    const { terms, cut } = this.#faded(shown, fading);
    const data = this.#blended(terms, positions
      ? ({ segments, frame, fade }) => this.#file.positions(segments, frame, { fade })
      : (term, i) => this.#pack(term, cut, i === 0 ? buffer : null));
    return { shown: cut, frame: shown.frame, fading: fading.underWay, clip: this.#file.clips.indexOf(this.#clipAt(shown.frame)),
      held: this.#file.held, whole: positions, data };
  }

  // coarsely: level 0 for now, whatever is wanted.
  // ahead: frames that it goes over into.
  #viewed({ view, frame, level: wanted, old, fading, coarsely, ahead }) {
    const level = coarsely ? 0 : wanted;
    if (old) old.frame = this.#file.frameAt(old.seconds, old.wrap, old.clip);
    this.view(view, wanted, old ? [frame, old.frame] : [frame], [frame, ...ahead], ahead);
    return old ? this.#change(frame, old, level, fading.level) : this.#showNext(frame, level, fading.level);
  }

  // What a picture is the sum of, and the level whose nodes and exact vertices its numbers are of: `terms`, [{frame,
  // segments, fade, share}], of the level that is shown and of those that fade out; the same of the clip that fades out.
  #faded(shown, fading) { // `like` is looked at, so that it is not let go of
    const tracks = shown.old ? [{ ...shown, share: 1 - shown.share }, { ...shown.old, share: shown.share }] : [{ ...shown, share: 1 }];
    const { cut } = fading, like = [...this.#prepared.values()].find(({ level }) => level === cut);
    if (like && this.#segment(like.index, cut) && fading.underWay && tracks.every(({ frame }) => this.#decoded(frame, fading.level)))
      return { terms: tracks.flatMap((track, i) => this.#terms(track, fading, i, like)), cut };
    fading.to(shown.level);
    fading.tracks = tracks.map(({ frame }) => ({ frame, held: false }));
    return { terms: tracks, cut: shown.level };
  }

  // Where a level that fades out is not decoded at the frame, as where a segment begins of which less has come, the picture
  // is as far from the level that is gone to as it was at the last frame where all of them were. like: a segment at the cut.
  #terms({ frame, share }, { cut, level, levels, weights, tracks }, index, like) {
    const track = tracks[index] ??= { frame, held: false };
    const at = (place, pictures, fade, times = 1) =>
      ({ frame: place, segments: [...pictures.flatMap(({ segments }) => segments), like], fade, share: times * share });
    const alone = { levels: [cut, level], weights: [0, 1] }, all = { levels, weights };
    const here = track.held ? [null] : levels.map((each) => this.#decoded(frame, each));
    if (here.every(Boolean)) {
      track.frame = frame;
      return [at(frame, here, all)];
    }
    track.held = true;
    const now = at(frame, [this.#decoded(frame, level)], alone);
    const there = this.#follows(track.frame, frame) ? levels.map((each) => this.#coarser(track.frame, each)) : [null];
    return there.every(Boolean) ? [now, at(track.frame, there, all), at(track.frame, there, alone, -1)] : [now];
  }

  // Whether a frame is in the same segment of a clip as one before, or in the next.
  #follows(before, frame) {
    const clip = this.#clipAt(frame), by = this.#segmentAt(frame) - this.#segmentAt(before);
    return this.#clipAt(before) === clip && (by + clip.segmentCount) % clip.segmentCount <= 1;
  }

  #blended(terms, numbersOf) {
    const [first, ...others] = terms, numbers = numbersOf(first, 0);
    if (first.share !== 1) for (let i = 0; i < numbers.length; i++) numbers[i] *= first.share;
    others.forEach((term, k) => {
      const more = numbersOf(term, k + 1);
      for (let i = 0; i < numbers.length; i++) numbers[i] += term.share * more[i];
    });
    return numbers;
  }

  /** Texels of a level: three per node, then one per exact vertex, two where the mesh has faces: its position and
   * the rotation of its normal. */
  texels(level) {
    const { nodeCount, exactCount } = this.parts(level);
    return 3 * nodeCount + (this.#faces ? 2 : 1) * exactCount;
  }

  #pack(shown, level, buffer) {
    const { data } = this.#room(level, buffer);
    this.#fill(data, 0, shown, level);
    return data;
  }

  // A texture of a level, and the numbers of an exact vertex in it.
  #room(level, buffer) {
    const size = 4 * WIDTH * Math.ceil(this.texels(level) / WIDTH);
    const data = buffer?.byteLength === 4 * size ? new Float32Array(buffer) : new Float32Array(size);
    return { data, stride: this.#faces ? 8 : 4 };
  }

  // All vertices as exact ones.
  #packExact(xyz, buffer) {
    const { data, stride } = this.#room(BLENDED, buffer), source = this.#order;
    for (let i = 0, to = 0; i < source.length; i++, to += stride)
      for (let k = 0; k < 3; k++) data[to + k] = xyz[3 * source[i] + k];
    if (this.#faces) this.#fillTurns(data, 0, BLENDED, xyz);
    return data;
  }

  // The numbers of a picture at the nodes and exact vertices of a level.
  #fill(data, at, { frame, segments, fade = null }, level) {
    const { nodeCount, exactCount } = this.parts(level), exactAt = at + 12 * nodeCount;
    this.#file.matrices(segments, frame, { out: data.subarray(at, exactAt), fade });
    if (exactCount === 0) return;
    const exact = this.#file.exact(segments, frame, { fade });
    const stride = this.#faces ? 8 : 4;
    for (let i = 0, from = 0, to = exactAt; i < exactCount; i++, to += stride) {
      data[to] = exact[from++];
      data[to + 1] = exact[from++];
      data[to + 2] = exact[from++];
    }
    if (this.#faces) this.#fillTurns(data, exactAt, level, this.#file.positions(segments, frame, { fade }));
  }

  // How the normal of every exact vertex has turned since the rest pose.
  #fillTurns(data, at, level, positions) {
    this.#restNormals ??= normals(this.#rest, this.#faces);
    const { branch, first, count, index } = this.parts(level), source = this.#order;
    const now = normals(positions, this.#faces);
    for (let part = 0; part < branch.length; part++) {
      if (branch[part] >= 0) continue;
      for (let i = 0; i < count[part]; i++)
        turns(this.#restNormals, now, source[first[part] + i], data, at + 8 * (index[part] + i) + 4);
    }
  }

  // Per vertex, how far the shown position is from that of the deepest level that is here.
  #distances({ frame, level, segments }) {
    const { levelCount } = this.#file.info;
    const deepest = this.#show(frame, levelCount - 1);
    const a = this.#file.positions(segments, frame), b = this.#file.positions(deepest.segments, frame);
    return Float32Array.from({ length: a.length / 3 }, (_, i) => level === deepest.level ? 0
      : Math.hypot(a[3 * i] - b[3 * i], a[3 * i + 1] - b[3 * i + 1], a[3 * i + 2] - b[3 * i + 2]));
  }

  /** All frames of a clip at a level, every `step`-th of them, one behind the other: what a forest plays. */
  async bake({ id, clip, level, step }) {
    try {
      const { firstFrame, frameCount } = this.#file.clips[clip], texels = this.texels(level);
      const rows = Math.ceil(frameCount / step), data = new Float32Array(4 * WIDTH * Math.ceil((rows * texels) / WIDTH));
      for (let row = 0; row < rows; row++) {
        this.#fill(data, 4 * row * texels, this.#exactly(firstFrame + row * step, level), level);
        if (row % 4 === 3) await turn();
        if (this.#closed) return;
      }
      this.post({ type: "baked", id, level, step, rows, texels, data }, [data.buffer]);
    } catch (error) {
      this.post({ type: "baked", id, level, data: null, ...describe(error) });
    }
  }

  /** The GPU form of a level or, with `segment`, of a segment at it and which of its coded frames shows each of its frames. */
  gpu({ id, level, segment = null }) {
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
    this.post(answer, [answer.words, answer.coded].filter(Boolean).map((array) => array.buffer));
  }

  /** What each clip counts for a wind. */
  wind({ id, strength, heading }) {
    this.post({ type: "wind", id, weights: Array.from(this.#file.windWeights(this.#winds, strength, heading)) });
  }

  close() {
    this.#closed = true;
    clearTimeout(this.#stateTimer);
    this.source.abort();
    this.#wakeUp();
  }
}

// Numbers that are none do not name a wind.
function windOf({ strength, heading = 0 }) {
  return Number.isFinite(strength) && Number.isFinite(heading) ? { strength, heading } : null;
}

export function describe(error) {
  return { message: error.message, codeName: error.codeName ?? error.name };
}
