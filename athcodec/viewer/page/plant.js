// One plant on the stage: what of it is drawn, and in which colours, for one motion of a loaded file.

import { BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial } from "three";

import { barkColour, heat, nodeColour, orderColour } from "./colours.js";
import { limbGeometry, limbMaterial, radii, setRadii } from "./limbs.js";

const LEAF = [0.19, 0.33, 0.09];

// A geometry of its own for another motion: all but athPart is shared.
function sharing(geometry) {
  const copy = new BufferGeometry();
  copy.setIndex(geometry.index);
  for (const [name, attribute] of Object.entries(geometry.attributes))
    if (!name.startsWith("athPart") && name !== "color") copy.setAttribute(name, attribute);
  copy.userData = geometry.userData;
  return copy;
}

export class Plant {
  root = new Group();
  colour = "plain";
  show = "mesh";
  heatMost = 0;
  #orders;
  #node = null;
  #radii;
  #drawn = [];

  constructor(ath, motion = ath.motion) {
    this.ath = ath;
    this.motion = motion;
    const up = ath.metadata.up_axis;
    if (up === "z") this.root.rotation.x = -Math.PI / 2;
    if (up === "x") this.root.rotation.z = Math.PI / 2;
    this.root.updateMatrixWorld(true);
    const { depth } = ath.branches, branch = ath.vertexBranch;
    this.#orders = branch.map((b) => depth[b]);
    this.onArrays = () => this.#build();
    ath.addEventListener("arrays", this.onArrays);
    this.onDepth = () => { if (this.colour === "node") this.#numberNodes(); };
    this.onFrame = () => { if (this.colour === "distance") this.#paint(); };
    motion.addEventListener("depth", this.onDepth);
    motion.addEventListener("frame", this.onFrame);
    this.#build();
  }

  #build() {
    for (const { object, geometry } of this.#drawn) {
      this.root.remove(object);
      this.motion.detach(geometry);
      object.material.dispose();
    }
    this.#drawn = [];
    this.#radii = radii(this.ath);
    const { ath, motion } = this;
    if (ath.geometry) {
      const geometry = motion.attach(sharing(ath.geometry));
      this.#add("mesh", geometry, new Mesh(geometry, motion.bind(new MeshLambertMaterial({ vertexColors: true, side: DoubleSide }))));
    } else {
      const geometry = limbGeometry(ath);
      setRadii(geometry, this.#radii);
      motion.attach(geometry);
      this.#add("mesh", geometry, new Mesh(geometry, limbMaterial(motion)));
    }
    const lines = motion.attach(this.#lines());
    this.#add("skeleton", lines, new LineSegments(lines, motion.bind(new LineBasicMaterial({ vertexColors: true }))));
    this.#drawn.at(-1).object.renderOrder = 1;
    this.setShow(this.show);
    this.setColour(this.colour);
  }

  #lines() {
    const { rest, skeleton } = this.ath, geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(skeleton, 1));
    geometry.setAttribute("position", new BufferAttribute(rest.slice(), 3));
    geometry.userData.source = Uint32Array.from({ length: rest.length / 3 }, (_, i) => i);
    return geometry;
  }

  #add(kind, geometry, object) {
    const { source } = geometry.userData;
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(3 * source.length), 3));
    object.frustumCulled = false;
    this.#drawn.push({ kind, geometry, object });
    this.root.add(object);
  }

  get vertices() {
    return this.#drawn.reduce((sum, { object, geometry }) => sum + (object.visible ? geometry.userData.source.length : 0), 0);
  }

  setShow(show) {
    this.show = show;
    for (const { kind, object } of this.#drawn) {
      object.visible = show === "both" || show === kind;
      if (kind === "skeleton") object.material.depthTest = show !== "both";
    }
    this.#paint();
  }

  setColour(colour) {
    this.colour = colour;
    this.motion.heat = colour === "distance";
    if (colour === "node") this.#numberNodes();
    this.motion.refresh();
    this.#paint();
  }

  setScreen(width, height) {
    for (const { object } of this.#drawn) object.material.uniforms?.screen?.value.set(width, height);
  }

  async #numberNodes() {
    if (this.motion.depth < 0) return;
    this.#node = await this.motion.partNumbers();
    this.#paint();
  }

  /** Colour of a vertex (source order) as linear r, g, b. */
  #colours() {
    const { colour, motion } = this;
    if (colour === "node" && this.#node) return (vertex) => nodeColour(this.#node[vertex]);
    if (colour === "order") return (vertex) => orderColour(this.#orders[vertex]);
    if (colour === "distance") {
      const { distances } = motion;
      this.heatMost = motion.depth < 0 ? 0 : motion.error(motion.depth).max;
      return (vertex) => heat(distances && this.heatMost ? Math.sqrt(distances[vertex] / this.heatMost) : 0);
    }
    const most = this.#orders.reduce((a, b) => Math.max(a, b), 1);
    return (vertex) => barkColour(this.#orders[vertex] / most);
  }

  #paint() {
    const colourOf = this.#colours(), leafy = this.colour === "plain" && Boolean(this.ath.geometry);
    const stored = this.ath.geometry?.getAttribute("color");
    for (const { kind, geometry, object } of this.#drawn) {
      if (!object.visible) continue;
      const { source } = geometry.userData, colour = geometry.getAttribute("color"), bare = kind === "skeleton" && this.show === "both";
      for (let i = 0; i < source.length; i++) {
        const value = leafy && kind === "mesh" ? (stored ? [stored.getX(i), stored.getY(i), stored.getZ(i)] : LEAF)
          : bare && this.colour === "plain" ? [0.55, 0.2, 0.06] : colourOf(source[i]);
        colour.array.set(value, 3 * i);
      }
      colour.needsUpdate = true;
    }
    this.onPaint?.();
  }

  dispose() {
    this.ath.removeEventListener("arrays", this.onArrays);
    this.motion.removeEventListener("depth", this.onDepth);
    this.motion.removeEventListener("frame", this.onFrame);
    for (const { geometry, object } of this.#drawn) {
      this.motion.detach(geometry);
      geometry.dispose();
      object.material.dispose();
    }
  }
}
