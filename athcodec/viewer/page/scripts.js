// Functions that scripts and tests can call: globalThis.athcodecViewer.

import * as three from "three";
import * as loading from "athcodec-three";

import { app, counters, main, state } from "./app.js";

export default function begin() {
  const { open, loadAgain, seek, setPlaying, setLevel, setSplit, setWind, moveView, playClip, forestSwitch, forestOf, forests, frameView } = app;
  globalThis.athcodecViewer = {
    counters, state, open, loadAgain, seek, setPlaying, setLevel, setSplit, setWind, moveView, playClip, forestSwitch, forestOf, forests, frameView,
    modules: { three, loading },
    get stage() { return app.stage; },
    get plants() { return app.plants; },
    get motion() { return main()?.motion; },
    async shown(seconds, level) {
      setPlaying(false);
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
