// The page's controller, and the state that its views share: what is open, what is on the stage, and how it plays.

import { ATHLoader } from "athcodec-three";

export const loader = new ATHLoader();
if (globalThis.athcodecBegun) loader.takeOver(globalThis.athcodecBegun); // by start.js

/** The controller: each view adds its commands to it, and calls those of others by it. `coming`: settles once the first file can be shown, `staged` once there is a stage; `plants`: on it, the one that is asked about
 * last; `opened`: the files, each with its `fileName` and `source`; `floor`: what grows on a forest's floor, {source, each}: a URL
 * or bytes, and how many to a tree. */
export const app = { stage: null, staged: null, coming: null, plants: [], opened: [], floor: [] };

/** `time` is that of the clip, `turns` that of the rounds before; `loop`: null, as is usual for the file, or what was chosen;
 * `intro`: whether the
 * story of how the file comes is told under the split; `wind`: the strength where clips are blended for it. */
export const state = { playing: true, speed: 1, loop: null, time: 0, turns: 0, wind: null, forest: null, intro: false, dirty: true };

export const counters = { frames: 0, fps: 0, frameMs: 0, since: performance.now(), pictures: 0, started: 0, firstPicture: null, firstMotion: null,
  arrived: {} };

export const main = () => app.plants.at(-1);
