// Where the bytes of a file come from: a server, in ranges or, where it has none, in one growing download; or
// memory. What they mean is not known here.

const TRIES = 4, FIRST_PAUSE = 150; // milliseconds; four times as long each further time

export class LoadError extends Error {
  constructor(message, codeName = "NETWORK") {
    super(message);
    this.name = "LoadError";
    this.codeName = codeName;
  }
}

/** Bytes that are all here. */
export class MemorySource {
  ranged = true;
  requests = 0;
  fetched = 0;

  constructor(bytes) {
    this.bytes = bytes;
    this.total = bytes.length;
  }

  async read(offset, size, take) {
    const piece = this.bytes.subarray(offset, offset + size);
    this.fetched += piece.length;
    take(piece, offset);
  }

  abort() {}
}

const PACKET = 1460, NAP_MS = 8; // sleeps shorter than this are put together

/** Another source over a slower line: all its bytes pass one after another at `rate` bytes a second. */
export class PacedSource {
  fetched = 0;
  #free = 0; // when the line is, by the clock
  #readers = 0;

  constructor(source, rate) {
    this.source = source;
    this.rate = rate;
    this.aborted = new Promise((_, reject) => { this.reject = reject; });
    this.aborted.catch(() => {});
  }

  get ranged() {
    return this.source.ranged;
  }

  get requests() {
    return this.source.requests;
  }

  get total() {
    return this.source.total;
  }

  async read(offset, size, take) {
    const pieces = [];
    await this.source.read(offset, size, (bytes, from) => { pieces.push([bytes, from]); });
    if (this.#readers++ === 0) this.#free = Math.max(this.#free, performance.now()); // else what a late timer lost is made up for
    try {
      for (const [bytes, from] of pieces)
        for (let at = 0; at < bytes.length; at += PACKET) await this.#pass(bytes.subarray(at, at + PACKET), from + at, take);
    } finally {
      this.#readers--;
    }
  }

  async #pass(packet, offset, take) {
    this.#free += (1000 * packet.length) / this.rate;
    const wait = this.#free - performance.now();
    await Promise.race([this.aborted, wait < NAP_MS ? null : new Promise((done) => { setTimeout(done, wait); })]);
    this.fetched += packet.length;
    take(packet, offset);
  }

  abort(reason) {
    this.source.abort(reason);
    this.reject(reason ?? new DOMException("loading was aborted", "AbortError"));
  }
}

// The body of an answer that a page has begun to read, the pieces of which come by a port.
function bodyOf(port, signal) {
  return new ReadableStream({
    start(controller) {
      port.onmessage = ({ data }) => {
        if (data) controller.enqueue(data);
        else if (data === null) controller.close();
        else controller.error(new TypeError("connection cut off"));
      };
      signal.addEventListener("abort", () => {
        port.onmessage = null; // Pieces may be on their way.
        port.postMessage("stop");
        controller.error(signal.reason);
      });
    },
  });
}

/** A file behind http or https. `ranged` is null until the first answer. */
export class HttpSource {
  ranged = null;
  requests = 0;
  fetched = 0;   // bytes of answers
  total = null;  // bytes of the file, where the server says it
  #tag = null;
  #abort = new AbortController();
  #front; // the answer to the first request, where a page has sent that already

  /** front: {status, headers, bytes} of an answer that begins at the first byte, bytes being a buffer or a port by which the
   * pieces come; null: there is none. */
  constructor(url, { headers = {}, credentials = "same-origin", front = null } = {}) {
    this.url = url;
    this.options = { headers, credentials };
    this.#front = front;
  }

  /** Hands `take(bytes, offset)` the pieces of a range as they come. A server without ranges sends the whole
   * file, and so does this. */
  async read(offset, size, take) {
    let at = offset;
    const end = offset + size, forward = (bytes, from) => {
      this.fetched += bytes.length;
      at = from + bytes.length;
      take(bytes, from);
    };
    for (let attempt = 0; ; attempt++) {
      try {
        const answered = await this.#request(at, end - at, forward);
        if (answered && this.ranged && at < Math.min(end, this.total ?? end)) throw new TypeError("connection cut off");
        return;
      } catch (error) {
        if (!(error instanceof TypeError)) throw error; // fetch: the network; all others know better
        if (attempt === TRIES - 1) throw new LoadError(`${this.url}: got no answer (${error.message})`);
        if (this.ranged === false) at = 0;
        await new Promise((done) => setTimeout(done, FIRST_PAUSE * 4 ** attempt));
      }
    }
  }

  async #request(offset, size, forward) {
    const { headers, credentials } = this.options;
    this.requests++;
    const front = offset === 0 ? this.#front : null;
    this.#front = null;
    const answer = front ? new Response(bodyOf(front.port, this.#abort.signal), front) : await fetch(this.url, {
      headers: { ...headers, Range: `bytes=${offset}-${offset + size - 1}` }, credentials, signal: this.#abort.signal,
      cache: "no-store", // browsers' caches let ranges of one file wait for each other, and ask for some twice
    });
    if (answer.status === 416) return this.#beyond(answer, offset);
    if (answer.status >= 500 || answer.status === 429) throw new TypeError(`status ${answer.status}`);
    if (!answer.ok) throw new LoadError(`${this.url}: got status ${answer.status} ${answer.statusText}`, "HTTP");
    const from = this.#place(answer, offset);
    this.#sameFile(answer);
    await this.#pieces(answer, from, forward);
    return true;
  }

  #beyond(answer, offset) {
    const total = /\/(\d+)$/.exec(answer.headers.get("Content-Range") ?? "");
    this.ranged = true;
    this.total = total ? Number(total[1]) : offset;
    return false;
  }

  // Where the answer begins in the file.
  #place(answer, offset) {
    if (answer.status !== 206) {
      this.ranged = false;
      const length = answer.headers.get("Content-Length");
      this.total = length && !answer.headers.get("Content-Encoding") ? Number(length) : null;
      return 0;
    }
    this.ranged = true;
    const match = /bytes (\d+)-\d+\/(\d+|\*)/.exec(answer.headers.get("Content-Range") ?? "");
    if (!match) return offset; // another site that keeps the header to itself
    if (match[2] !== "*") this.total = Number(match[2]);
    return Number(match[1]);
  }

  #sameFile(answer) {
    const tag = answer.headers.get("ETag") ?? answer.headers.get("Last-Modified");
    if (tag && this.#tag && tag !== this.#tag)
      throw new LoadError(`${this.url}: got another file than the one that was opened; load it again`, "CHANGED");
    this.#tag ??= tag;
  }

  async #pieces(answer, offset, forward) {
    const reader = answer.body.getReader();
    for (;;) {
      const { done, value } = await reader.read();
      if (done) {
        if (!this.ranged) this.total = offset;
        return;
      }
      forward(value, offset);
      offset += value.length;
    }
  }

  abort(reason) {
    this.#abort.abort(reason);
  }
}
