// A picture is a sum: of levels and clips that fade over, or of shares of clips for a wind, which ease in and out.

import { Fading } from "./fading.js";
import { clipAt, segmentAt } from "./frames.js";

const MOST_BLENDED = 4; // Largest number of shares of a picture.
const GONE = 1e-3; // Weight below which a share is seen no more.
const LOOKED_AWAY = 1; // Seconds without a picture, after which weights are at once what they are wanted to be.

/** Returns the frames to blend for a wind, [{weight, clip, frame}]. */
export function sharesOf(file, winds, { wind, seconds, wrap }) {
  return file.windWeights(winds, ...wind).flatMap((weight, index) =>
    (weight > 0 ? { weight, clip: index, frame: file.frameAt(seconds, wrap, index) } : []));
}

/** Returns the numbers of a picture that is a sum. terms: see Mixing's faded(); numbersOf: the numbers of a term. */
export function sumOf([first, ...others], numbersOf) {
  const numbers = numbersOf(first, 0);
  if (first.share !== 1) for (let i = 0; i < numbers.length; i++) numbers[i] *= first.share;
  others.forEach((term, k) => {
    const more = numbersOf(term, k + 1);
    for (let i = 0; i < numbers.length; i++) numbers[i] += term.share * more[i];
  });
  return numbers;
}

/** One view's last picture, and how it goes on from there. */
export class Mixing {
  #file; #jobs;
  fading = new Fading();
  last = null; // {shares, at}: the shares that were shown last and when, in milliseconds; null: one clip was shown alone.

  constructor(file, jobs) {
    this.#file = file;
    this.#jobs = jobs;
  }

  /** Returns shares on their way to those that are wanted, from what was shown last, as clips and levels of them come and go. */
  eased({ clip, seconds, wrap, now = 0, fade = 0 }, wanted) {
    const { level } = this.fading, alone = level >= 0 ? { shares: [{ clip, level, weight: 1 }], at: now } : null;
    const before = this.last ?? alone, passed = before ? (now - before.at) / 1000 : Infinity;
    const part = fade > 0 && passed < LOOKED_AWAY ? 1 - Math.exp(-3 * Math.max(0, passed) / fade) : 1;
    const same = (a) => (b) => a.clip === b.clip && a.level === b.level;
    const leaving = (before?.shares ?? []).filter((share) => part < 1 && !wanted.some(same(share)) && share.weight * (1 - part) > GONE);
    const old = leaving.flatMap((share) => {
      const there = this.#jobs.decoded(this.#file.frameAt(seconds, wrap, share.clip), share.level);
      return there ? { ...there, clip: share.clip, weight: share.weight * (1 - part) } : [];
    });
    const arrived = wanted.map((share) => {
      const weight = before?.shares.find(same(share))?.weight ?? 0;
      return { ...share, weight: weight + (share.weight - weight) * part };
    });
    const shares = [...arrived, ...old].sort((a, b) => b.weight - a.weight).slice(0, MOST_BLENDED).filter(({ weight }) => weight > 0);
    this.last = { shares, at: now };
    const fading = old.length > 0 || wanted.some((share) => Math.abs(share.weight - (shares.find(same(share))?.weight ?? 0)) > GONE);
    return { shares, fading };
  }

  /** Returns what shows `frame` at a level. old: the clip that fades out, {frame, begun, share}. It is shown until the new one is
   * decoded as deep as it is here; then both are shown at one level, `old` in what is returned, by its `share`. */
  change(frame, level, old) {
    const jobs = this.#jobs, now = this.fading.level;
    if (!old) return jobs.showNext(frame, level, now);
    if (!old.begun && !jobs.isDecoded(frame, level)) return jobs.showNext(old.frame, level, now) ?? jobs.show(frame, level);
    const shown = jobs.showNext(frame, level, now), before = old.share > 0 ? jobs.show(old.frame, level) : null;
    if (!shown || !before) return shown ?? before;
    const both = Math.min(shown.level, before.level);
    const [a, b] = [shown, before].map((picture) => (picture.level === both ? picture : jobs.coarser(picture.frame, both)));
    return a && b ? { ...a, old: b, share: old.share } : shown;
  }

  /** Returns what a picture is the sum of, and the level whose nodes and exact vertices its numbers are of: `terms`, [{frame,
   * segments, fade, share}], of the level that is shown and of those that fade out, and as many of the clip that fades out. */
  faded(shown) {
    const tracks = shown.old ? [{ ...shown, share: 1 - shown.share }, { ...shown.old, share: shown.share }] : [{ ...shown, share: 1 }];
    const { fading } = this, { cut } = fading, like = this.#jobs.anyAt(cut);
    if (like && fading.underWay && tracks.every(({ frame }) => this.#jobs.decoded(frame, fading.level)))
      return { terms: tracks.flatMap((track, i) => this.#terms(track, i, like)), cut };
    fading.goTo(shown.level);
    fading.tracks = tracks.map(({ frame }) => ({ frame, held: false }));
    return { terms: tracks, cut: shown.level };
  }

  // Where a level that fades out is not decoded at the frame, as where a segment begins of which less has come, the picture
  // is as far from the level that is gone to as it was at the last frame where all of them were. like: a segment at the cut.
  #terms({ frame, share }, index, like) {
    const { cut, level, levels, weights, tracks } = this.fading, track = tracks[index] ??= { frame, held: false };
    const at = (place, pictures, fade, times = 1) =>
      ({ frame: place, segments: [...pictures.flatMap(({ segments }) => segments), like], fade, share: times * share });
    const alone = { levels: [cut, level], weights: [0, 1] }, all = { levels, weights };
    const here = track.held ? [null] : levels.map((each) => this.#jobs.decoded(frame, each));
    if (here.every(Boolean)) {
      track.frame = frame;
      return [at(frame, here, all)];
    }
    track.held = true;
    const now = at(frame, [this.#jobs.decoded(frame, level)], alone);
    const there = this.#follows(track.frame, frame) ? levels.map((each) => this.#jobs.coarser(track.frame, each)) : [null];
    return there.every(Boolean) ? [now, at(track.frame, there, all), at(track.frame, there, alone, -1)] : [now];
  }

  // Returns whether a frame is in the same segment of a clip as one before, or in the next.
  #follows(before, frame) {
    const file = this.#file, clip = clipAt(file, frame), by = segmentAt(file, frame) - segmentAt(file, before);
    return clipAt(file, before) === clip && (by + clip.segmentCount) % clip.segmentCount <= 1;
  }
}
