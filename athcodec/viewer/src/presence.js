// Objects and copies that a clip does not show in all frames: metadata `presence`, {name or "name:copy": [[first, stop]]}.

// The vertices of each object or copy that some frame hides: [{first, stop, runs}]; none where the arrays are not here.
function hiddenParts({ presence, part_names: names }, { part_vertex_counts: counts, part_copies: copies }) {
  if (!presence || !Array.isArray(names) || counts?.array.length !== names.length) return [];
  const parts = [];
  for (let part = 0, first = 0; part < names.length; first += Number(counts.array[part++])) {
    const count = Number(counts.array[part]), many = Number(copies?.array[part] ?? 1), shown = presence[names[part]];
    if (shown) parts.push({ first, stop: first + count, runs: shown });
    for (let copy = 0, size = count / many; !shown && copy < many; copy++) {
      const runs = presence[`${names[part]}:${copy}`];
      if (runs) parts.push({ first: first + copy * size, stop: first + (copy + 1) * size, runs });
    }
  }
  return parts;
}

/** Leaves out of a geometry what is hidden in each frame. */
export class Presence {
  #parts = new Map(); // by clip
  #wholes = new WeakMap(); // all corners of each geometry
  #shown = "";

  /** To the frame of the file that `motion` shows; `fresh`: geometries or arrays are others than before. */
  show({ motion, metadata, attributes }, geometries, fresh) {
    const clip = motion.clips.findLast(({ firstFrame }) => firstFrame <= motion.frame) ?? motion.clip;
    if (fresh) this.#parts.clear();
    if (!this.#parts.has(clip)) this.#parts.set(clip, hiddenParts({ ...metadata, ...metadata.clips?.[clip.name] }, attributes));
    const frame = Math.floor(motion.frame - clip.firstFrame);
    const hidden = this.#parts.get(clip).filter(({ runs }) => !runs.some(([first, stop]) => first <= frame && frame < stop));
    const key = hidden.map(({ first }) => first).join();
    if (key === this.#shown && !(fresh && hidden.length)) return;
    this.#shown = key;
    for (const geometry of geometries) this.#cut(geometry, hidden);
  }

  #cut(geometry, hidden) {
    const { index, userData: { source } } = geometry, step = geometry.hasAttribute("normal") ? 3 : 2;
    if (!this.#wholes.has(geometry)) this.#wholes.set(geometry, index.array.slice());
    const whole = this.#wholes.get(geometry), isHidden = new Uint8Array(Math.max(0, ...hidden.map(({ stop }) => stop)));
    for (const { first, stop } of hidden) isHidden.fill(1, first, stop);
    for (let i = 0; i < whole.length; i++) { // Hidden parts become a point.
      const first = whole[i - i % step];
      index.array[i] = isHidden[source[first]] ? first : whole[i];
    }
    index.needsUpdate = true;
  }
}
