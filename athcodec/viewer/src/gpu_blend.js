// A plant of a forest shows at any time: frames of clips, each with a weight, which add up to 1.

import { roundOf } from "./ATHMotion.js";

const OWN = null; // in place of a clip: that which a plant itself plays
const GONE = 1e-3; // a weight below this counts for nothing once it is on its way to nothing

/** Weights of the clips that a forest shows, which change over a time. */
export class Mixture {
  #wanted = new Map([[OWN, 1]]);
  #shown = new Map([[OWN, 1]]);

  /** weights: of clips, in place of each plant's own; null: none. */
  set(weights) {
    const sum = weights ? [...weights.values()].reduce((total, weight) => total + weight, 0) : 0;
    this.#wanted = sum > 0 ? new Map([...weights].map(([clip, weight]) => [clip, weight / sum])) : new Map([[OWN, 1]]);
  }

  /** Weights that replace the plants' own. */
  get clips() {
    return [...this.#wanted.keys()].filter((clip) => clip !== OWN);
  }

  /** Takes what is shown nearer to what is wanted: `share` of the way. Clips that are not here leave their weight to others. */
  advance(share, isHere) {
    const here = [...this.#wanted].filter(([clip, weight]) => weight > 0 && (clip === OWN || isHere(clip)));
    const sum = here.reduce((total, [, weight]) => total + weight, 0), target = new Map(here.map(([clip, weight]) => [clip, weight / sum]));
    if (target.size === 0) return;
    const both = [...new Set([...this.#shown.keys(), ...target.keys()])];
    const next = both.map((clip) => [clip, (this.#shown.get(clip) ?? 0) * (1 - share) + (target.get(clip) ?? 0) * share])
      .filter(([clip, weight]) => weight > GONE || target.has(clip));
    const total = next.reduce((all, [, weight]) => all + weight, 0);
    this.#shown = new Map(next.map(([clip, weight]) => [clip, weight / total]));
  }

  /** Returns the weight of each clip for a plant that plays `clipOfPlant`. */
  of(clipOfPlant) {
    const weights = new Map();
    for (const [clip, weight] of this.#shown) weights.set(clip ?? clipOfPlant, (weights.get(clip ?? clipOfPlant) ?? 0) + weight);
    return weights;
  }
}

/** Returns the frames of a clip that goes around, `seconds` after it began: [{frame, weight}]. times: seconds of the file's frames. */
export function framesAt(times, clip, seconds) {
  const { firstFrame, frameCount, lastTime } = clip, round = roundOf(clip);
  if (frameCount === 1 || !(round > 0)) return [{ frame: firstFrame, weight: 1 }];
  const passed = ((seconds % round) + round) % round;
  if (passed < lastTime) return within(times, clip, passed);
  return mixed(firstFrame + frameCount - 1, firstFrame, Math.min((passed - lastTime) / (round - lastTime), 1));
}

// seconds: 0 to that of the clip's last frame.
function within(times, { firstFrame, frameCount }, seconds) {
  const at = times[firstFrame] + seconds;
  let low = firstFrame, high = firstFrame + frameCount - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= at) low = middle;
    else high = middle;
  }
  return high === low ? [{ frame: low, weight: 1 }]
    : mixed(low, high, Math.min(Math.max((at - times[low]) / (times[high] - times[low]), 0), 1));
}

const mixed = (a, b, weight) => [{ frame: a, weight: 1 - weight }, { frame: b, weight }];
