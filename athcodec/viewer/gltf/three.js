// ATH_motion for GLTFLoader of three.js: loader.register(athMotion(new ATHLoader())). What is loaded plays by an
// AnimationMixer as any animation does, or by gltf.userData.ATH_motion[0].motion.setTime(seconds).

import { AnimationClip, BufferAttribute, NumberKeyframeTrack, Object3D, Vector2 } from "three";

import { EXTENSION, VERTEX, keysOf, motionsOf, primitivesOf, restOf, referenceOf, startOf, verticesOf, withoutFallback } from "./parts.js";

const size = new Vector2();

/** For GLTFLoader.register(); loader: an ATHLoader, whose settings but hostMesh hold. */
export function athMotion(loader) {
  return (parser) => new ATHMotionPlugin(parser, loader);
}

// Actions of a mixer write to `seconds<i>` and `weight<i>` of clip i, both times the action's weight.
class Clock extends Object3D {
  fade = 0.2; // seconds from clip to clip
  #motion;
  #seconds;
  #weights;

  constructor(motion) {
    super();
    this.#motion = motion;
    this.#seconds = motion.clips.map(() => 0);
    this.#weights = motion.clips.map(() => 0);
    for (const { index } of motion.clips)
      for (const [name, values] of [["seconds", this.#seconds], ["weight", this.#weights]])
        Object.defineProperty(this, `${name}${index}`, { get: () => 0, set: (value) => { values[index] = value; } });
  }

  /** Shows the clip of the strongest action; nothing changes where there is none. */
  apply() {
    const weight = Math.max(...this.#weights), index = this.#weights.indexOf(weight), motion = this.#motion;
    if (!(weight > 0)) return;
    const seconds = this.#seconds[index] / weight;
    if (motion.clip.index !== index) motion.play(index, { at: seconds, fade: this.fade });
    motion.setTime(motion.start + seconds);
  }

  tracks({ index }, keys) {
    return [
      new NumberKeyframeTrack(`${this.uuid}.seconds${index}`, keys.map(([at]) => at), keys.map(([, seconds]) => seconds)),
      new NumberKeyframeTrack(`${this.uuid}.weight${index}`, [keys[0][0]], [1]),
    ];
  }
}

class ATHMotionPlugin {
  name = EXTENSION;
  #plants = [];            // For each motion {ath, clock, vertices: Map}, null where it does not play.
  #geometries = new Map();
  #materials = new Map();

  constructor(parser, loader) {
    this.parser = parser;
    this.loader = loader;
  }

  // Motions are opened first: one that cannot be leaves its meshes as they are without the extension.
  async beforeRoot() {
    const { json } = this.parser;
    this.#plants = await Promise.all(motionsOf(json).map((motion, number) => this.#open(motion, number).catch((error) => {
      console.warn(`${EXTENSION}: motion ${number} does not play: ${error.message}`);
      return null;
    })));
    const played = new Set(this.#plants.flatMap((plant, number) => (plant ? [number] : [])));
    for (const node of withoutFallback(json, played)) delete json.meshes[json.nodes[node].mesh].isSkinnedMesh;
  }

  async #open(motion, number) {
    const parts = await Promise.all(primitivesOf(this.parser.json, number).map((each) => this.#part(each)));
    const rest = restOf(parts), bytes = await this.parser.getDependency("bufferView", motion.bufferView);
    const before = this.loader.hostMesh, opening = this.loader.setHostMesh(rest).parseAsync(bytes);
    this.loader.setHostMesh(before);
    const ath = await opening;
    if (ath.motion.info.vertexCount !== rest.length / 3) {
      ath.dispose();
      throw new RangeError(`vertices: got ${rest.length / 3} in primitives, expected ${ath.motion.info.vertexCount}`);
    }
    ath.motion.wrap = "marked";
    const clock = Object.assign(new Clock(ath.motion), { name: `${EXTENSION} ${number}` });
    return { ath, clock, vertices: new Map(parts.map(({ key, vertices }) => [key, vertices])) };
  }

  async #part({ mesh, primitive, attributes, reference }) {
    const [position, numbers] = await Promise.all([attributes.POSITION, attributes[VERTEX]]
      .map((accessor) => (accessor === undefined ? null : this.parser.getDependency("accessor", accessor))));
    return { key: `${mesh} ${primitive}`, vertices: verticesOf(position.count, reference, numbers && ((i) => numbers.getX(i))),
      positions: plain(position).array };
  }

  // Says of each mesh, and of what is cloned of it, which primitive it is.
  loadMesh(index) {
    const { primitives } = this.parser.json.meshes[index];
    if (!primitives.some((primitive) => this.#plants[referenceOf(primitive)?.motion])) return null;
    return this.parser.loadMesh(index).then((loaded) => {
      const meshes = loaded.isGroup ? loaded.children : [loaded];
      meshes.forEach((mesh, i) => {
        const reference = referenceOf(primitives[i]);
        if (this.#plants[reference?.motion]) mesh.userData[EXTENSION] = { ...reference, key: `${index} ${i}` };
      });
      return loaded;
    });
  }

  afterRoot(gltf) {
    for (const scene of gltf.scenes) scene.traverse((object) => { if (object.userData[EXTENSION]) this.#drive(object); });
    this.#plants.forEach((plant, number) => {
      if (!plant) return;
      gltf.scene.add(plant.clock);
      for (const clip of plant.ath.motion.clips) this.#animate(gltf.animations, plant, clip, motionsOf(this.parser.json)[number]);
    });
    gltf.userData[EXTENSION] = this.#plants.map((plant) => plant?.ath ?? null);
  }

  #animate(animations, { clock }, clip, motion) {
    const tracks = clock.tracks(clip, keysOf(startOf(motion, clip.name), clip));
    const there = animations.find(({ name }) => name === clip.name);
    if (there) {
      there.tracks.push(...tracks);
      there.resetDuration();
    } else animations.push(new AnimationClip(clip.name, -1, tracks));
  }

  #drive(object) {
    const { motion: number, key } = object.userData[EXTENSION], { ath, clock, vertices } = this.#plants[number];
    object.geometry = found(this.#geometries, key, () => ath.motion.attach(geometryOf(object.geometry, vertices.get(key))));
    object.material = found(this.#materials, `${number} ${object.material.uuid}`, () => this.#bound(object.material, ath));
    ath.motion.bindShadows(object);
    object.onBeforeRender = (renderer, scene, camera) => {
      ath.motion.update(camera, renderer.getDrawingBufferSize(size).y, object);
      clock.apply();
    };
  }

  // A copy: others may have the same material and stand still.
  #bound(material, { motion }) {
    const copy = material.clone();
    if (this.parser.associations.has(material)) this.parser.associations.set(copy, this.parser.associations.get(material));
    return motion.bind(copy);
  }
}

function found(map, key, make) {
  if (!map.has(key)) map.set(key, make());
  return map.get(key);
}

// Numbers that lie one after the other.
function plain(attribute) {
  if (!attribute.isInterleavedBufferAttribute && attribute.array instanceof Float32Array) return attribute;
  const array = Float32Array.from({ length: 3 * attribute.count }, (_, i) => attribute.getComponent(Math.floor(i / 3), i % 3));
  return new BufferAttribute(array, 3);
}

// Without what moved it otherwise.
function geometryOf(source, vertices) {
  const geometry = source.clone();
  for (const name of ["skinIndex", "skinWeight", VERTEX.toLowerCase()]) geometry.deleteAttribute(name);
  geometry.setAttribute("position", plain(geometry.getAttribute("position")));
  geometry.userData.source = vertices;
  return geometry;
}
