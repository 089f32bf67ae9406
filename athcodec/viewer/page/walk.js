// Going through the forest on foot: W A S D or the arrow keys go, shift runs, dragging looks around; a stick under the thumb where
// there is no keyboard.

import { Euler, Vector3 } from "three/webgpu";

const KEYS = { KeyW: [0, 1], ArrowUp: [0, 1], KeyS: [0, -1], ArrowDown: [0, -1], KeyA: [-1, 0], ArrowLeft: [-1, 0], KeyD: [1, 0], ArrowRight: [1, 0] };
const RUN = 2.6, LOOK = 0.0035, STEEPEST = 1.3, SMOOTH = 0.12; // times as fast; radians a pixel; radians; seconds

export class Walk {
  on = false;
  #held = new Set();
  #stick = [0, 0];
  #speed = new Vector3();
  #look = new Euler(0, 0, 0, "YXZ");

  /** height: of the eyes; speed: units a second; changed: called where walking begins or ends. */
  constructor(camera, canvas, stick, { height, speed, changed }) {
    Object.assign(this, { camera, canvas, height, speed, changed });
    addEventListener("keydown", (event) => this.#key(event));
    addEventListener("keyup", ({ code }) => this.#held.delete(code));
    addEventListener("blur", () => this.#held.clear());
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    this.#thumb(stick);
  }

  begin() {
    if (this.on) return;
    const { camera } = this, way = camera.getWorldDirection(new Vector3());
    this.on = true;
    this.#look.set(Math.max(-0.3, Math.min(Math.asin(way.y), 0.1)), Math.atan2(-way.x, -way.z), 0);
    this.changed(true);
  }

  end() {
    if (!this.on) return;
    this.on = false;
    this.#held.clear();
    this.changed(false);
  }

  #key(event) {
    const { code, target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || target.closest?.("input, button")) return;
    if (code === "Escape") this.end();
    if (!(code in KEYS) && !code.startsWith("Shift")) return;
    this.#held.add(code);
    if (!(code in KEYS)) return;
    event.preventDefault();
    this.begin();
  }

  #drag({ buttons, movementX, movementY }) {
    if (!this.on || !(buttons & 1)) return;
    this.#look.y += LOOK * movementX;
    this.#look.x = Math.max(-STEEPEST, Math.min(this.#look.x + LOOK * movementY, STEEPEST));
  }

  #thumb(stick) {
    const move = (event) => {
      const { left, top, width, height } = stick.getBoundingClientRect();
      const x = (event.clientX - left) / width * 2 - 1, y = 1 - (event.clientY - top) / height * 2, far = Math.max(1, Math.hypot(x, y));
      this.#stick = [x / far, y / far];
      stick.style.setProperty("--x", x / far);
      stick.style.setProperty("--y", -y / far);
    };
    const letGo = () => {
      this.#stick = [0, 0];
      stick.style.setProperty("--x", 0);
      stick.style.setProperty("--y", 0);
    };
    stick.addEventListener("pointerdown", (event) => {
      stick.setPointerCapture(event.pointerId);
      this.begin();
      move(event);
    });
    stick.addEventListener("pointermove", (event) => { if (stick.hasPointerCapture(event.pointerId)) move(event); });
    for (const type of ["pointerup", "pointercancel"]) stick.addEventListener(type, letGo);
  }

  /** seconds: since the picture before. */
  update(seconds) {
    if (!this.on) return;
    const way = [...this.#held].reduce(([x, y], code) => [x + (KEYS[code]?.[0] ?? 0), y + (KEYS[code]?.[1] ?? 0)], this.#stick);
    const far = Math.max(1, Math.hypot(...way)), fast = this.speed * ([...this.#held].some((code) => code.startsWith("Shift")) ? RUN : 1);
    const wanted = new Vector3(way[0] / far, 0, -way[1] / far).multiplyScalar(fast).applyEuler(new Euler(0, this.#look.y, 0));
    const share = 1 - Math.exp(-seconds / SMOOTH), { position } = this.camera;
    this.#speed.lerp(wanted, share);
    position.addScaledVector(this.#speed, seconds);
    position.y += (this.height - position.y) * (1 - Math.exp(-3 * seconds));
    this.camera.quaternion.setFromEuler(this.#look);
  }
}
