// One plant on the stage: what of it is drawn, and in which colours, for one motion of a loaded file.

import { BufferAttribute, BufferGeometry, Color, DoubleSide, Group, InstancedBufferAttribute, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial } from "three";
import { limbDepth, limbGeometry, limbMaterial, radii, setRadii, upright } from "athcodec-three";

import { flare, footOf } from "./root.js";
import { barkColour, heat, nodeColour, orderColour } from "./colours.js";
import { outlined, surfaceDepth, surfaceMaterial, surfacesOf } from "./surfaces.js";

const LEAF = [0.16, 0.29, 0.07], OVER = [0.30, 0.05, 0.01], PALE = [0.66, 0.68, 0.6]; // Of lines over a plant, and of the plant under them.
const SLIMMEST = 4; // order from which on bark is as pale as it gets

// Colours that tell something are those of their legend inside a crown as well: light comes from the eye, on both sides.
const EVEN = /* glsl */`
#ifdef ATH_EVEN
outgoingLight = diffuseColor.rgb * (0.72 + 0.28 * abs(dot(normal, normalize(vViewPosition))));
#endif
#include <opaque_fragment>`;

function evenly(shader) {
  shader.fragmentShader = shader.fragmentShader.replace("#include <opaque_fragment>", EVEN);
}

// isEven: whether it is lit so, or as the scene is.
function light(material, isEven) {
  if (material.toneMapped !== isEven) return;
  Object.assign(material, { defines: isEven ? { ATH_EVEN: "" } : {}, toneMapped: !isEven, needsUpdate: true });
}

export const meshMaterial = () => Object.assign(new MeshLambertMaterial({ vertexColors: true, side: DoubleSide }), { onBeforeCompile: evenly });
export const lineMaterial = () => new LineBasicMaterial({ vertexColors: true });

// A geometry of its own for another motion: all but athPart is shared, and the colours if `withColour`.
function sharing(geometry, withColour = false) {
  const copy = new BufferGeometry();
  copy.setIndex(geometry.index);
  for (const [name, attribute] of Object.entries(geometry.attributes))
    if (!name.startsWith("athPart") && (withColour || name !== "color")) copy.setAttribute(name, attribute);
  copy.userData = geometry.userData;
  return copy;
}

// Attributes for colours, and the vertices that they are of.
const coloured = ({ userData: { source, other } }) => [["color", source], ...(other ? [["colorOther", other]] : [])];

export class Plant {
  root = new Group();
  space = this.root; // what the motion's own axes are those of
  colour = "plant";
  show = "plant";
  heatMost = 0;
  beside = [this]; // plants on one scale of colours
  #orders;
  #node = null;
  #radii;
  #drawn = [];
  #surface = null;
  #model = null; // what a GLB shows
  #stale = true;
  #flared = null; // the root under a trunk

  constructor(ath, motion = ath.motion) {
    this.ath = ath;
    this.motion = motion;
    upright(this.root, ath.metadata);
    this.root.updateMatrixWorld(true);
    const { depth } = ath.branches, branch = ath.vertexBranch;
    this.isTuft = depth.length > 1 && depth.every((order) => order === 0);
    this.#orders = branch.map((b) => depth[b]);
    this.onArrays = () => this.#arrays();
    ath.addEventListener("arrays", this.onArrays);
    this.onLevel = () => { if (this.colour === "part") this.#numberNodes(); };
    this.onFrame = () => { if (this.colour === "error") this.paint(); };
    motion.addEventListener("level", this.onLevel);
    motion.addEventListener("frame", this.onFrame);
    this.#build();
  }

  #build() {
    this.#clear();
    this.#radii = radii(this.ath);
    this.#addRoot();
    this.setShow(this.show);
    this.setColour(this.colour);
  }

  #clear() {
    for (const { object, geometry, other, plain, tinted } of this.#drawn) {
      object.removeFromParent();
      if (plain) this.motion.detach(plain.geometry);
      this.motion.detach(geometry);
      for (const part of [geometry, object.material, other, ...Object.values({ ...plain }), tinted?.material]) part?.dispose();
    }
    this.#model?.removeFromParent();
    for (const part of [this.#flared?.geometry, this.#flared?.material]) part?.dispose();
    this.#flared?.removeFromParent();
    this.#flared = null;
    this.#surface?.dispose();
    this.#surface = null;
    this.#drawn = [];
  }

  // Adds what came behind the motion: faces, or how thick the limbs are.
  #arrays() {
    if (this.ath.hasFaces) {
      this.#build();
      return;
    }
    this.#radii = radii(this.ath);
    for (const { kind, geometry } of this.#drawn) if (kind === "plant" && geometry.userData.other) setRadii(geometry, this.#radii);
    this.paint();
  }

  /** The box of the rest pose in the world. */
  get box() {
    this.root.updateMatrixWorld(true);
    return this.ath.box.clone().applyMatrix4(this.space.matrixWorld);
  }

  /** Where it stands in the world, at rest. */
  get foot() {
    this.root.updateMatrixWorld(true);
    return footOf(this.ath).foot.applyMatrix4(this.space.matrixWorld);
  }

  #addRoot() {
    const { trunk } = this.ath.model ? {} : footOf(this.ath);
    if (!trunk) return;
    const material = this.surfaces ? surfaceMaterial(this.surfaces) : new MeshLambertMaterial({ color: new Color().setRGB(...barkColour(0)) });
    const mesh = this.#flared = new Mesh(flare(trunk), material);
    mesh.castShadow = mesh.receiveShadow = true;
    this.root.add(mesh);
  }

  /** Surfaces that the file's texture coordinates tell apart, see surfacesOf; null: none. */
  get surfaces() {
    return this.ath.geometry?.hasAttribute("uv") ? surfacesOf(this.ath.metadata) : null;
  }

  /** Material with which a forest of it casts shadows; null: none of its own. */
  get depthMaterial() {
    const { surfaces } = this;
    return surfaces && (() => surfaceDepth(surfaces));
  }

  // Bark and leaves as they look near by, or colours that tell something.
  #dress() {
    for (const { object, plain, tinted } of this.#drawn) if (plain) Object.assign(object, this.colour === "plant" ? plain : tinted);
    for (const { object, other } of this.#drawn) {
      const material = other ?? object.material; // which takes turns with bark and leaves
      if (material.isMeshLambertMaterial) light(material, this.colour !== "plant");
    }
    const drawn = this.#drawn.find(({ kind }) => kind === "plant"), wanted = Boolean(this.colour === "plant" && this.show !== "both" && this.ath.hasFaces && this.surfaces);
    if (!drawn || drawn.plain || wanted === Boolean(drawn.other)) return;
    if (wanted) this.#surface ??= this.motion.bind(surfaceMaterial(this.surfaces));
    [drawn.object.material, drawn.other] = wanted ? [this.#surface, drawn.object.material] : [drawn.other, null];
  }

  // Made when it is first shown.
  #need(kind) {
    if (this.#drawn.some((drawn) => drawn.kind === kind)) return;
    const { ath, motion } = this;
    let object;
    if (kind === "plant" && ath.model) {
      this.#addModel();
      return;
    }
    if (kind === "lines") {
      object = new LineSegments(motion.attach(this.#lines()), motion.bind(lineMaterial()));
      object.renderOrder = 1;
    } else if (ath.hasFaces) {
      const material = this.surfaces ? outlined(meshMaterial(), this.surfaces) : meshMaterial();
      object = motion.bindShadows(new Mesh(motion.attach(sharing(ath.geometry)), motion.bind(material)));
      if (this.surfaces) Object.assign(object, { customDepthMaterial: motion.bind(surfaceDepth(this.surfaces)) });
    } else {
      const geometry = limbGeometry(ath, this.#radii);
      object = new Mesh(motion.attach(geometry), limbMaterial(motion.uniforms));
      object.customDepthMaterial = limbDepth(motion.uniforms);
    }
    object.castShadow = object.receiveShadow = kind === "plant";
    const { geometry } = object;
    const Colours = geometry.isInstancedBufferGeometry ? InstancedBufferAttribute : BufferAttribute;
    for (const [name, list] of coloured(geometry)) geometry.setAttribute(name, new Colours(new Float32Array(3 * list.length), 3));
    object.frustumCulled = false;
    if (this.space !== this.root) object.applyMatrix4(this.root.matrixWorld.clone().invert().multiply(this.space.matrixWorld));
    this.#drawn.push({ kind, geometry, object });
    this.root.add(object);
    this.#dress();
  }

  // All that a GLB shows: its meshes in their own materials or, with another geometry, in colours that tell something.
  #addModel() {
    const { ath, motion } = this, model = this.#model = ath.model.clone();
    model.traverse((object) => {
      object.castShadow = object.receiveShadow = true;
      if (object.userData.ATH_motion?.motion !== ath.number) return;
      const plain = { geometry: motion.attach(sharing(object.geometry, true)), material: motion.bind(object.material.clone()) };
      const geometry = motion.attach(sharing(object.geometry)), tinted = { geometry, material: motion.bind(meshMaterial()) };
      const { source } = geometry.userData;
      geometry.setAttribute("color", new BufferAttribute(new Float32Array(3 * source.length), 3));
      motion.bindShadows(object);
      this.#drawn.push({ kind: "plant", geometry, object, plain, tinted });
      this.space = object;
    });
    this.root.add(model);
    this.root.updateMatrixWorld(true);
    this.#dress();
  }

  /** Returns what a forest draws of a plant without faces: lines in the colours of bark. */
  forestGeometry() {
    if (this.ath.hasFaces) return this.ath.geometry;
    const geometry = this.#lines(), out = new Float32Array(this.ath.rest.length), colourOf = this.#barks();
    for (let i = 0; i < out.length / 3; i++) out.set(colourOf(i), 3 * i);
    geometry.setAttribute("color", new BufferAttribute(out, 3));
    return geometry;
  }

  #barks() {
    if (this.isTuft) return () => LEAF; // blades
    const most = this.#orders.reduce((a, b) => Math.max(a, b), 1);
    const barks = Array.from({ length: most + 1 }, (_, order) => barkColour(order / most));
    return (vertex) => barks[this.#orders[vertex]];
  }

  #lines() {
    const { rest } = this.ath, geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(this.#alongBranches(), 1));
    geometry.setAttribute("position", new BufferAttribute(rest, 3));
    geometry.userData.source = Uint32Array.from({ length: rest.length / 3 }, (_, i) => i);
    return geometry;
  }

  // One line along each branch that is a tube, from ring to ring, or that others grow on; where there are no tubes, all edges.
  #alongBranches() {
    const { skeleton, branches: { first, count, attach, parent, ring }, channel: { vertexPlaces } } = this.ath;
    if (!ring.some((size) => size > 1)) return skeleton;
    const vertex = new Uint32Array(this.ath.channel.info.placeCount), edges = [], bearing = new Set(parent);
    vertexPlaces.forEach((place, i) => { vertex[place] = i; });
    for (let b = 0; b < first.length; b++) {
      if (!(ring[b] > 1) && !bearing.has(b)) continue;
      for (let place = first[b], before = attach[b]; place < first[b] + count[b]; before = place, place += Math.max(ring[b], 1))
        if (before >= 0) edges.push(vertex[before], vertex[place]);
    }
    return Uint32Array.from(edges);
  }

  get vertices() {
    return this.#drawn.reduce((sum, { object, geometry }) => sum + (object.visible
      ? geometry.userData.source.length * (geometry.isInstancedBufferGeometry ? 4 : 1) : 0), 0);
  }

  setShow(show) {
    this.show = show;
    for (const kind of ["plant", "lines"]) if (show === kind || show === "both") this.#need(kind);
    this.#showRoot();
    for (const { kind, object } of this.#drawn) {
      object.visible = show === "both" || show === kind;
      if (kind === "lines") object.material.depthTest = show !== "both";
    }
    this.#dress();
    this.paint();
  }

  #showRoot() {
    if (this.#flared) this.#flared.visible = this.show === "plant" && this.colour === "plant";
  }

  setColour(colour) {
    this.colour = colour;
    this.#showRoot();
    this.#dress();
    this.motion.heat = colour === "error";
    if (colour === "part") this.#numberNodes();
    this.motion.refresh();
    this.paint();
  }

  async #numberNodes() {
    if (this.motion.level < 0) return;
    this.#node = await this.motion.nodeNumbers();
    this.paint();
  }

  /** Colour of a vertex (source order) as linear r, g, b. */
  #colours() {
    const { colour, motion } = this;
    if (colour === "part" && this.#node) {
      const parts = Array.from({ length: 1 + this.#node.reduce((a, b) => Math.max(a, b), 0) }, (_, part) => nodeColour(part));
      return (vertex) => parts[this.#node[vertex]];
    }
    if (colour === "order") {
      const orders = Array.from({ length: 1 + this.#orders.reduce((a, b) => Math.max(a, b), 0) }, (_, order) => orderColour(order));
      return (vertex) => orders[this.#orders[vertex]];
    }
    if (colour === "error") {
      const { distances } = motion;
      this.heatMost = Math.max(...this.beside.map(({ motion: { level }, motion }) => (level < 0 ? 0 : motion.error(level).p99 || motion.error(level).max)));
      return (vertex) => heat(distances && this.heatMost ? Math.sqrt(distances[vertex] / this.heatMost) : 0);
    }
    return this.#barks();
  }

  /** Asks for new colours, before the next picture is drawn. */
  paint() {
    this.#stale = true;
    this.onPaint?.();
  }

  /** Once per drawn picture. */
  prepare(width, height) {
    for (const { object } of this.#drawn) object.material.uniforms?.screen?.value.set(width, height);
    if (!this.#stale) return;
    this.#stale = false;
    const colourOf = this.#colours(), leafy = this.colour === "plant" && this.ath.hasFaces;
    const stored = leafy ? this.ath.geometry.getAttribute("color") : null;
    const [line, under] = this.show === "both" && this.colour === "plant" ? [OVER, PALE] : [null, null];
    for (const { kind, geometry, object } of this.#drawn) {
      if (!object.visible || object.geometry !== geometry) continue; // a GLB in its own materials
      const fixed = kind === "lines" ? line : under, isStored = stored && kind === "plant";
      const vertexColour = leafy && kind !== "lines" ? this.#leafColours() : colourOf;
      for (const [name, source] of coloured(geometry)) {
        const colour = geometry.getAttribute(name), out = colour.array;
        for (let i = 0, at = 0; i < source.length; i++, at += 3) {
          const value = fixed ?? (isStored ? stored.array.subarray(i * stored.itemSize) : vertexColour(source[i]));
          out[at] = value[0];
          out[at + 1] = value[1];
          out[at + 2] = value[2];
        }
        colour.needsUpdate = true;
      }
    }
  }

  /** Colours meshes that have none of their own: tubes are bark, and what has no rings is a leaf, none quite like the next. */
  #leafColours() {
    const { ring, depth } = this.ath.branches, branch = this.ath.vertexBranch;
    return (vertex) => {
      const number = branch[vertex], shade = 0.75 + 0.6 * ((number * 0.61803398875) % 1);
      return ring[number] ? barkColour(Math.min(1, depth[number] / SLIMMEST)) : LEAF.map((value) => value * shade);
    };
  }

  dispose() {
    this.ath.removeEventListener("arrays", this.onArrays);
    this.motion.removeEventListener("level", this.onLevel);
    this.motion.removeEventListener("frame", this.onFrame);
    this.#clear();
  }
}
