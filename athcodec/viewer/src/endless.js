// Play without an end: which places of a clip are shown when, by the transitions between like frames that the encoder has found.
// The same seed gives the same play as in athcodec/motion/transitions.py, which is where they come from.

const TAKEN = 0.5; // Probability that a transition is taken.
const LONGEST = 1e7; // seconds of a play

/** The transitions of a clip's metadata, by the frame that they leave at: [[leave, enter, frames]]; none where these are not such
 * that one is come to from everywhere that they lead to. */
export function transitionsOf({ transitions }, frameCount) {
  const right = (entry) => Array.isArray(entry) && entry.length === 3 && entry.every(Number.isInteger) && Math.min(...entry) >= 0
    && entry[2] >= 1 && Math.max(entry[0], entry[1]) + entry[2] < frameCount;
  if (!Array.isArray(transitions) || !transitions.length || !transitions.every(right)) return [];
  const found = [...transitions].sort((a, b) => a[0] - b[0] || a[1] - b[1] || a[2] - b[2]), last = found.at(-1)[0];
  return found.every(([, enter, frames]) => enter + frames <= last) ? found : [];
}

export class EndlessPlay {
  #ways;
  #state;
  #runs = [{ begins: 0, leave: 0, enter: 0, lasts: 0, over: 0 }]; // Runs of the clip, each with the transition that led to it.
  #next;

  /** transitions: of transitionsOf(); times: seconds of the clip's frames; seed: an integer. */
  constructor(transitions, times, seed) {
    const at = (frame) => times[frame] - times[0];
    this.#ways = transitions.map(([leave, enter, frames]) => ({ leave: at(leave), enter: at(enter), over: at(enter + frames),
      lasts: Math.min(at(leave + frames) - at(leave), at(enter + frames) - at(enter)) }));
    this.#state = (Math.imul(seed, 2654435761) + 1) >>> 0 || 1;
    this.#next = this.#drawn(0);
  }

  /** Returns what is shown `seconds` after the play began: [{seconds, weight}] of one place of the clip or, within a transition, of two;
   * and `ahead`, where the next transition leads to. */
  at(seconds) {
    const time = Math.min(Math.max(seconds, 0), LONGEST);
    for (let begins; (begins = this.#runs.at(-1).begins + this.#next.leave - this.#runs.at(-1).enter) <= time;) {
      this.#runs.push({ ...this.#next, begins });
      this.#next = this.#drawn(this.#next.over);
    }
    const index = this.#runs.findLastIndex(({ begins }) => begins <= time), way = this.#runs[index], passed = time - way.begins;
    const ahead = (this.#runs[index + 1] ?? this.#next).enter, share = passed / way.lasts, weight = share * share * (3 - 2 * share);
    if (passed >= way.lasts) return { places: [{ seconds: way.enter + passed, weight: 1 }], ahead };
    const both = [{ seconds: way.leave + passed, weight: 1 - weight }, { seconds: way.enter + passed, weight }];
    return { places: both.filter((place) => place.weight > 0), ahead };
  }

  // The way that is taken after this place in the clip. All ways are over before the last of them leaves.
  #drawn(seconds) {
    const last = this.#ways.at(-1).leave, leaves = new Set(this.#ways.map(({ leave }) => leave));
    const ahead = [...leaves].filter((leave) => seconds <= leave && leave < last);
    const leave = ahead.find(() => this.#random() < TAKEN) ?? last, same = this.#ways.filter((way) => way.leave === leave);
    return same[Math.floor(this.#random() * same.length)];
  }

  // 0 to 1, of a 32-bit xorshift (Marsaglia 2003).
  #random() {
    for (const shift of [13, -17, 5]) this.#state = (this.#state ^ (shift > 0 ? this.#state << shift : this.#state >>> -shift)) >>> 0;
    return this.#state / 2 ** 32;
  }
}
