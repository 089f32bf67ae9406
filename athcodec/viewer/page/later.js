// What the first picture does not need: main.js fetches it behind that picture, or at once where there is none to wait for.

import * as three from "three";
import * as loading from "athcodec-three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import "./main.js";
import { app } from "./app.js";
import camera from "./camera.js";
import forests from "./forests.js";
import keys from "./keys.js";
import sharing from "./sharing.js";
import start from "./samples.js";

/** Begins these views, and lets their controls be used. */
export function begin() {
  for (const each of [camera, forests, sharing, start, keys]) each();
  for (const control of document.querySelectorAll("[data-later]")) control.inert = false;
  app.staged.then(() => {
    app.stage?.steer(OrbitControls);
    globalThis.athcodecViewer.modules = { three, loading };
  });
}
