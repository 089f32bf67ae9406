// Download fetches a file: the front, then what the views want of the clips that they play, first what comes next.

import { AthFile } from "../ath_decoder.mjs";
import { clipAt, segmentAt } from "./frames.js";
import { LoadError } from "./source.js";
import { ATTRIBUTE, missingChunks } from "./statics.js";

const FIRST_BYTES = 12 << 10; // Size of the first request: prelude and coarse levels of a plant of 8,000 vertices.
const LEAST_REQUEST = 16 << 10, MOST_REQUEST = 2 << 20; // bytes
const REQUEST_SECONDS = 0.15; // A request is as large as the requests before it would have read in this time.
const LANES = 2; // requests at once
const AHEAD_SECONDS = 8; // Time from the playhead on that is fetched in full before what comes later.

export class Download {
  #source; #hostMesh; #views; #tell;
  #file = null;
  #front = new Uint8Array(0);
  #hasFront; #reading;    // Reading ends with the front or, without ranges, with the file.
  #firstFrame;            // Before there is a view, the clip of this frame is fetched.
  #came = 0;              // bytes that are here from the beginning of the file on, without a gap
  #underway = new Set();  // Ranges that are being fetched.
  #speed = 0;             // bytes a second
  #hasAttributes = false; // All named arrays that can be had are here.
  #everything = false;    // All bytes are wanted, whatever the views show.
  #whole = false;         // All bytes are here.
  #stopped = false;       // No more bytes come.
  #cut = new Set();       // The end of the file cuts the ranges at these offsets, which have been asked for.
  #ended = false;         // The session knows that the file is too short.
  #wakes = [];            // Lanes that wait.

  /** tell: functions to call when bytes `came` (true: a request's last), `attributes` can be read, the download has `stopped`. */
  constructor(source, hostMesh, views, tell) {
    this.#source = source;
    this.#hostMesh = hostMesh;
    this.#views = views;
    this.#tell = tell;
  }

  /** Returns the file as soon as its front is here. */
  open() {
    const opened = new Promise((done) => { this.#hasFront = done; });
    this.#reading = this.#readFront();
    return Promise.race([opened, this.#reading]);
  }

  /** Fetches what is wanted, until all is here or nothing comes any more. */
  async run(firstFrame) {
    this.#firstFrame = firstFrame;
    try {
      await this.#reading;
      this.#lookForAttributes();
    } catch (error) {
      this.#stop(error);
    }
    for (let lane = 0; lane < LANES; lane++) this.#lane();
  }

  /** Looks again at what is wanted, as views have changed or, behind what they want, everything is from now on. */
  look(everything = false) {
    this.#everything ||= everything;
    for (const wake of this.#wakes.splice(0)) wake();
  }

  /** Ends the requests; what is here goes on playing. */
  abort() {
    const error = new DOMException("loading was aborted", "AbortError");
    this.#source.abort(error);
    if (this.#file) this.#stop(error);
  }

  progress() {
    const { fetched, requests, ranged } = this.#source, file = this.#file;
    this.#whole ||= file.chunks().every(({ fed }) => fed);
    return { fetched, requests, ranged, total: file.info.fileLength, whole: this.#whole, speed: this.#speed };
  }

  async #readFront() {
    for (let needed = FIRST_BYTES; !this.#file;) {
      const have = this.#front.length;
      await this.#source.read(have, needed - have, (bytes, offset) => this.#take(bytes, offset));
      if (this.#file) return;
      if (this.#front.length === 0) throw new LoadError("NOT_AN_ATH_FILE: got no bytes", "NOT_AN_ATH_FILE");
      if (this.#front.length < needed) AthFile.open(this.#front); // This throws what is missing.
      needed = Math.max(AthFile.front(this.#front).needed, this.#front.length + 1);
    }
  }

  // Bytes come in any order once the file is open.
  #take(bytes, offset) {
    if (offset <= this.#came) this.#came = Math.max(this.#came, offset + bytes.length);
    if (this.#file) {
      this.#file.feed(bytes, offset);
      this.look();
      this.#tell.came();
      return;
    }
    if (offset > this.#front.length || offset + bytes.length <= this.#front.length) return;
    const front = new Uint8Array(offset + bytes.length);
    front.set(this.#front);
    front.set(bytes, offset);
    this.#front = front;
    if (!AthFile.front(front).ready) return;
    this.#file = AthFile.open(front, { hostMesh: this.#hostMesh });
    this.#front = null;
    this.#hasFront(this.#file);
  }

  async #lane() {
    while (!this.#stopped) {
      const range = this.#next();
      if (!range) {
        this.#tellOfEnd();
        await new Promise((wake) => { this.#wakes.push(wake); });
        continue;
      }
      this.#underway.add(range);
      const start = performance.now();
      let came = 0;
      try {
        await this.#source.read(range.offset, range.size, (bytes, offset) => {
          came += bytes.length;
          this.#take(bytes, offset);
        });
      } catch (error) {
        this.#stop(error);
        return;
      } finally {
        this.#underway.delete(range);
      }
      this.#speed = this.#speed * 0.5 + (came / Math.max((performance.now() - start) / 1000, 1e-3)) * 0.5;
      this.#lookForAttributes();
      this.look();
      this.#tell.came(true);
    }
  }

  #stop(error) {
    if (this.#stopped) return;
    this.#stopped = true;
    this.look();
    this.#tell.stopped(error);
  }

  // The file may end before what is wanted of it.
  #tellOfEnd() {
    const { total } = this.#source, { fileLength } = this.#file.info;
    if (this.#ended || total === null || total >= fileLength || this.#underway.size > 0 || this.#wanted().next().done) return;
    this.#ended = true;
    this.#tell.stopped(new LoadError(`MISSING: got a file of ${total} bytes, expected ${fileLength}`, "MISSING"));
  }

  #lookForAttributes() {
    const end = this.#source.total ?? Infinity, left = missingChunks(this.#file, ATTRIBUTE).filter(({ offset, size }) => offset + size <= end);
    if (this.#hasAttributes || (left.length > 0 && this.#source.ranged !== false)) return;
    this.#hasAttributes = true;
    this.#tell.attributes();
  }

  // Returns the next range to ask for; null: none for now.
  #next() {
    if (this.#source.ranged === false) return null; // Everything came with the first request.
    const most = Math.min(MOST_REQUEST, Math.max(LEAST_REQUEST, this.#speed * REQUEST_SECONDS));
    let request = null;
    for (const { offset, size } of this.#wanted()) {
      const from = Math.max(offset, Math.min(this.#came, offset + size)); // The beginning of a chunk may be here.
      const end = Math.min(offset + size, this.#source.total ?? Infinity), cut = end < offset + size;
      const isUnderway = [...this.#underway].some((other) => from < other.offset + other.size && other.offset < end);
      const left = from < end && !(cut && this.#cut.has(offset)) && !isUnderway;
      if (request && (!left || from !== request.offset + request.size)) break;
      if (!left) continue;
      if (cut && !request) this.#cut.add(offset);
      (request ??= { offset: from }).size = end - request.offset;
      if (request.size >= most) break;
    }
    return request;
  }

  // Yields missing ranges in the order in which they are wanted.
  * #wanted() {
    const wishes = this.#wishes();
    for (const { soon, level } of wishes) yield* this.#missing(soon, 0, Math.min(1, level));
    if (!this.#hasAttributes) yield* missingChunks(this.#file, ATTRIBUTE);
    for (const { soon, level } of wishes) yield* this.#missing(soon, 2, level);
    for (const { late, level } of wishes) yield* this.#missing(late, 0, level);
    if (this.#everything && !this.#whole) yield* missingChunks(this.#file);
  }

  // Returns {level, soon, late} for every clip that a view plays: the deepest level and the segments from the playhead on.
  #wishes() {
    const wishes = new Map(), views = [...this.#views.values()];
    if (views.length === 0) views.push({ level: 0, wanted: [this.#firstFrame] });
    for (const { level, wanted } of views) for (const frame of wanted) {
      const clip = clipAt(this.#file, frame), wish = wishes.get(clip);
      if (wish) wish.level = Math.max(wish.level, level);
      else wishes.set(clip, { level, ...this.#fromHere(clip, frame) });
    }
    return [...wishes.values()];
  }

  #fromHere({ firstSegment, segmentCount, duration }, frame) {
    const now = segmentAt(this.#file, frame) - firstSegment;
    const order = Array.from({ length: segmentCount }, (_, i) => firstSegment + (now + i) % segmentCount);
    const ahead = 1 + Math.ceil(AHEAD_SECONDS * segmentCount / Math.max(duration, 1e-9));
    return { soon: order.slice(0, ahead), late: order.slice(ahead) };
  }

  * #missing(segments, from, to) {
    for (let level = from; level <= to; level++)
      for (const segment of segments)
        if (this.#file.readyLevel(segment) < level) yield* this.#file.ranges(level, segment, segment);
  }
}
