// Functions that scripts and tests can call: globalThis.athcodecViewer.

import { app, counters, main, state } from "./app.js";

export default function begin() {
  const { open, loadAgain, seek, setPlaying, setLevel, setSplit, setWind, moveView, playClip, forestSwitch, forestOf, forests, frameView } = app;
  globalThis.athcodecViewer = {
    counters, state, open, loadAgain, seek, setPlaying, setLevel, setSplit, setWind, moveView, playClip, forestSwitch, forestOf, forests, frameView,
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
    /** Milliseconds from choosing what to draw until it is drawn: the fastest of some frames. */
    timeForest(frames) {
      const { stage } = app, gl = stage.renderer.getContext(), pixel = new Uint8Array(4), times = [];
      for (let i = 0; i < frames; i++) {
        const start = performance.now();
        app.updateForests(state.time + i / 30);
        stage.render();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for the picture
        times.push(performance.now() - start);
      }
      const { counts, culled, vertices } = state.forest;
      return { ms: Math.min(...times), counts, unseen: culled, vertices };
    },
  };
}
