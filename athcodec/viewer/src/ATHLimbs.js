// Branches of files without faces as round limbs: see index.d.ts.

import { Color, Mesh, Vector4 } from "three";

import { atOrigin, setValues } from "./geometry.js";
import { limbGeometry, limbMaterial, setRadii } from "./limbs.js";
import { radii } from "./radii.js";

const BARK = 0x7a6248;
const viewport = new Vector4();

export class ATHLimbs extends Mesh {
  #ath;
  #motion;
  #onArrays;

  constructor(ath, { motion = ath.motion, color = BARK } = {}) {
    const geometry = limbGeometry(ath, radii(ath));
    super(motion.attach(geometry), limbMaterial(motion.uniforms));
    this.#ath = ath;
    this.#motion = motion;
    this.#onArrays = () => setRadii(geometry, radii(ath));
    ath.addEventListener("arrays", this.#onArrays);
    atOrigin(this, ath);
    this.frustumCulled = false; // an instance's own box is no edge's
    this.setColor(color);
  }

  /** A colour, or a function that gives linear red, green and blue of a vertex. */
  setColor(color) {
    const flat = typeof color === "function" ? null : new Color(color).toArray(), { source, other } = this.geometry.userData;
    for (const [name, vertices] of [["color", source], ["colorOther", other]]) {
      const values = Float32Array.from({ length: 3 * vertices.length });
      vertices.forEach((vertex, i) => values.set(flat ?? color(vertex), 3 * i));
      setValues(this.geometry, name, values, 3);
    }
    return this;
  }

  // No limb gets thinner than a pixel.
  onBeforeRender = (renderer) => {
    const { z: width, w: height } = renderer.getCurrentViewport(viewport);
    this.material.uniforms.screen.value.set(width, height);
    this.material.uniformsNeedUpdate = true;
  };

  dispose() {
    this.#ath.removeEventListener("arrays", this.#onArrays);
    this.#motion.detach(this.geometry);
    this.geometry.dispose();
    this.material.dispose();
    this.removeFromParent();
  }
}
