// The view by keys and by a double tap; dragging, wheel and pinch are OrbitControls'.

import { Spherical, Vector3 } from "three";

import { app, state } from "./app.js";
import { $ } from "./ui.js";

const TURN = Math.PI / 36, NEARER = 0.85, TAP_MS = 320, TAP_PIXELS = 24;
const around = new Spherical(), offset = new Vector3();

/** Turns the view about what it looks at, and goes nearer by a factor. */
function moveView(sideways, up, factor = 1) {
  const { camera, controls } = app.stage;
  around.setFromVector3(offset.subVectors(camera.position, controls.target));
  around.theta += sideways;
  around.phi = Math.max(controls.minPolarAngle + 0.01, Math.min(around.phi - up, controls.maxPolarAngle - 0.01));
  around.radius = Math.max(controls.minDistance, Math.min(around.radius * factor, controls.maxDistance));
  camera.position.copy(controls.target).add(offset.setFromSpherical(around));
  app.stage.moved = true;
  controls.update();
  state.dirty = true;
}

const zoom = (nearer) => moveView(0, 0, nearer ? NEARER : 1 / NEARER);

const KEYS = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN] };

export default function begin() {
  Object.assign(app, { moveView, zoom });
  $("canvas").addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || app.plants.length === 0) return;
    if (!(event.key in KEYS)) return;
    event.preventDefault();
    event.stopPropagation(); // elsewhere they go from frame to frame
    moveView(...KEYS[event.key]);
  });
  let tap = null; // the last one
  $("canvas").addEventListener("pointerup", (event) => {
    const near = (other) => Math.hypot(event.clientX - other.x, event.clientY - other.y) < TAP_PIXELS;
    const now = { x: event.clientX, y: event.clientY, at: event.timeStamp };
    const twice = tap && now.at - tap.at < TAP_MS && near(tap) && pressed && near(pressed);
    tap = pressed && near(pressed) && !twice ? now : null;
    if (twice && app.plants.length > 0) app.resetView();
  });
  let pressed = null;
  $("canvas").addEventListener("pointerdown", (event) => { pressed = { x: event.clientX, y: event.clientY }; }, { capture: true });
}
