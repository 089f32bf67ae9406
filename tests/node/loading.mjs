// The loader for three.js and its worker, as they ship, in one thread of Node: what a file's bytes are, when they come, and
// how fast the clock goes is up to the program that imports this.

import { readFileSync } from "node:fs";
import { register } from "node:module";

const WEB = new URL("../../athcodec/viewer/web/", import.meta.url), HASTE = 20;
register(new URL("page_modules.mjs", import.meta.url), { data: { three: "three.webgpu.js" } });

const clock = performance.now.bind(performance), later = globalThis.setTimeout;
performance.now = () => HASTE * clock();
globalThis.setTimeout = (call, ms = 0, ...words) => later(call, ms / HASTE, ...words);

/** How many workers there are, and what they threw that nobody caught. */
export const workers = new Set(), thrown = [];
process.on("unhandledRejection", (error) => thrown.push(error));

const program = new Function("self", readFileSync(new URL("ath_worker.js", WEB), "utf8"));

globalThis.Worker = class {
  #scope = { postMessage: (message, transfer = []) => this.#hand(message, transfer, (event) => this.onmessage?.(event)) };

  constructor() {
    workers.add(this);
    program(this.#scope);
  }

  // In order, and not before what is under way has ended.
  #hand(message, transfer, to) {
    const data = structuredClone(message, { transfer });
    setImmediate(() => {
      if (!workers.has(this)) return;
      try {
        to({ data });
      } catch (error) {
        thrown.push(error);
      }
    });
  }

  postMessage(message, transfer = []) {
    this.#hand(message, transfer, (event) => this.#scope.onmessage(event));
  }

  terminate() {
    workers.delete(this);
  }
};

/** A line to a file of these bytes, of which `allow(count)` lets so many more come; `url` leads to it. */
export class Line {
  static #lines = new Map();
  #left = 0;
  #waiting = [];

  static at(url) {
    return Line.#lines.get(url);
  }

  constructor(data, { ranges = true, name = `file${Line.#lines.size}` } = {}) {
    Object.assign(this, { data, ranges, url: `http://line/${name}` });
    Line.#lines.set(this.url, this);
  }

  allow(count) {
    this.#left += count;
    for (const wake of this.#waiting.splice(0)) wake();
  }

  close() {
    Line.#lines.delete(this.url);
  }

  async * pieces(first, end, signal) {
    for (let at = first; at < end;) {
      const size = Math.min(end - at, this.#left);
      if (size > 0) {
        this.#left -= size;
        yield this.data.slice(at, at + size);
        at += size;
      } else {
        await new Promise((wake, fail) => {
          this.#waiting.push(wake);
          signal?.addEventListener("abort", () => fail(signal.reason));
        });
      }
      signal?.throwIfAborted();
    }
  }
}

globalThis.fetch = async (url, { headers = {}, signal } = {}) => {
  const line = Line.at(url);
  signal?.throwIfAborted();
  if (!line) throw new TypeError("no such line");
  const asked = line.ranges ? /bytes=(\d+)-(\d+)/.exec(headers.Range ?? "") : null, { length } = line.data;
  const first = asked ? Number(asked[1]) : 0, end = asked ? Math.min(length, Number(asked[2]) + 1) : length;
  const told = { ...(asked ? { "Content-Range": `bytes ${first}-${end - 1}/${length}` } : { "Content-Length": `${length}` }) };
  if (first >= length) return { status: 416, ok: false, headers: new Headers({ "Content-Range": `bytes */${length}` }) };
  const pieces = line.pieces(first, end, signal);
  return { status: asked ? 206 : 200, ok: true, headers: new Headers(told), body: { getReader: () => ({ read: () => pieces.next() }) } };
};

export const three = await import("three");
export const { ATHForest, ATHLoader, ATHMotion } = await import(new URL("ATHLoader.js", WEB).href);
export const { AthFile, ready } = await import(new URL("../ath_decoder.mjs", WEB).href);
await ready;

/** Waits until `met()`, for `most` milliseconds of the clock at most; whether it is. */
export async function until(met, most = 200_000) {
  for (const start = performance.now(); !met();) {
    if (performance.now() - start > most) return false;
    await new Promise((done) => { setImmediate(done); });
  }
  return true;
}

export const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });
export const read = (path) => new Uint8Array(readFileSync(path));
