// How a view goes from level to level: over a moment, as the plant would jump by the distance of the two.

import { AthFade } from "../ath_decoder.mjs";

export class Fading extends AthFade {
  #at = 0;      // milliseconds: when a level was asked for last
  tracks = [];  // For each frame that is shown {frame, held}, see Mixing's #terms.

  /** The level that is gone to, -1 before there is one. */
  get level() {
    return this.levels.at(-1) ?? -1;
  }

  get underWay() {
    return this.levels.length > 1;
  }

  /** Goes to a level by the time `now` in milliseconds; at once where a fade takes no seconds. Time without a fade does not
   * count: nobody may have looked. */
  goTo(level, now = 0, seconds = 0) {
    const passed = this.underWay ? (now - this.#at) / 1000 : 0;
    this.to(level, seconds > 0 ? Math.max(0, passed) / seconds : Infinity);
    this.#at = now;
  }
}
