// Functions that scripts and tests can call: globalThis.athcodecViewer. later.js adds `modules` to it, behind the first picture.

import { app, counters, main, state } from "./app.js";

const CALLS = ["open", "loadAgain", "seek", "setPlaying", "setLevel", "setLeft", "setSplit", "setWind", "moveView", "playClip", "forestSwitch", "forestOf", "forests", "frameView"];

export default function begin() {
  globalThis.athcodecViewer = {
    counters, state, ...Object.fromEntries(CALLS.map((name) => [name, (...values) => (app[name] ? app[name](...values) : app.later().then(() => app[name](...values)))])),
    get stage() { return app.stage; },
    get plants() { return app.plants; },
    get motion() { return main()?.motion; },
    async shown(seconds, level) {
      app.setPlaying(false);
      const { motion } = main();
      await motion.show(motion.start + seconds, level);
      return { level: motion.level, frame: motion.frame };
    },
    decoded: async (seconds, level) => {
      const { motion } = main();
      return [...await motion.positions(motion.start + seconds, level)];
    },
    uploaded: () => [...main().motion.uploaded()],
  };
}
