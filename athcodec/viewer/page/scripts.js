// Functions that scripts and tests can call: globalThis.athcodecViewer.

import { app, counters, main, state } from "./app.js";
import { frameView } from "./arrange.js";
import { playClip } from "./clips.js";
import { loadAgain, open } from "./files.js";
import { forests, updateForests } from "./floor.js";
import { forestOf, forestSwitch } from "./forests.js";
import { setLevel, setSplit } from "./look.js";
import { readback } from "./readback.js";
import { seek, setPlaying } from "./time.js";
import { moveView } from "./camera.js";
import { setWind } from "./wind.js";

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
  onGraphics(what = "positions") {
    const { ath, motion } = main(), normals = what === "normals" ? ath.geometry.getAttribute("normal").array : null;
    return [...readback(app.stage.renderer, ath, motion, normals)];
  },
  /** Milliseconds from choosing what to draw until it is drawn: the fastest of some frames. */
  timeForest(frames) {
    const { stage } = app, gl = stage.renderer.getContext(), pixel = new Uint8Array(4), times = [];
    for (let i = 0; i < frames; i++) {
      const start = performance.now();
      updateForests(state.time + i / 30);
      stage.render();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for the picture
      times.push(performance.now() - start);
    }
    const { counts, culled, vertices } = state.forest;
    return { ms: Math.min(...times), counts, unseen: culled, vertices };
  },
};
