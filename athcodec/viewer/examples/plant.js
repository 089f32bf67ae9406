// An .ath file for any engine: openPlant(url) gives its mesh, and update() its positions and normals for every drawn frame.
// In place of a URL, it takes the bytes of a file.
import { AthFile, ready } from "athcodec-three/decoder";

export async function openPlant(url) {
  const plant = { failure: null }; // what ended the download or the decoding; what is decoded plays on
  let file = null, isFetching = false;

  async function bytesOf(offset, size) {
    if (url instanceof Uint8Array) return [url, 0];
    const answer = await fetch(url, { headers: { Range: `bytes=${offset}-${offset + size - 1}` } });
    if (!answer.ok) throw new Error(`${url}: got status ${answer.status}, expected 200 or 206`);
    return [new Uint8Array(await answer.arrayBuffer()), answer.status === 206 ? offset : 0]; // 200: the whole file
  }

  async function feed(ranges) {
    for (const { offset, size } of ranges) {
      const [bytes, from] = await bytesOf(offset, size);
      if (from + bytes.length < offset + size) throw new Error(`${url}: got ${from + bytes.length} bytes, expected ${offset + size}`);
      file.feed(bytes, from);
    }
  }

  await ready;
  for (let needed = 1 << 14; !file;) { // The front of the file says how long it is.
    const [front] = await bytesOf(0, needed), state = AthFile.front(front);
    if (state.ready || front.length < needed) file = AthFile.open(front); // This throws if the file is cut off.
    needed = state.needed;
  }
  await feed(file.attributeRanges());

  const [clip] = file.clips, last = clip.firstSegment + clip.segmentCount - 1, xyz = new Float32Array(3 * file.info.vertexCount);
  const mesh = file.mesh(), normals = new Float32Array(xyz.length); // A plant without faces is points: it has no triangles.
  const damaged = new Set(), costs = []; // costs: milliseconds that a segment takes at each level
  let works = [], before = { seconds: 0, frame: 0 }; // works: preparations of the segment that is shown and of the next
  const find = (index, level) => works.find((each) => each.index === index && each.level === level);
  const sizes = Array.from({ length: file.info.levelCount }, (_, level) => // bytes of motion at each level
    file.ranges(level, clip.firstSegment, last, true).reduce((sum, { size }) => sum + size, 0));
  const segmentsAt = (level) => works.flatMap((each) => (each.level === level && each.segment ? [each.segment] : []));

  // Fetches what a level of a segment needs. Returns whether it is there.
  function isFetched(index, level) {
    const ranges = find(index, level) ? [] : file.ranges(level, index, index);
    if (ranges.length > 0 && !isFetching) {
      isFetching = true; // until all is here
      feed(ranges).then(() => { isFetching = false; }, (error) => { plant.failure ??= error; });
    }
    return ranges.length === 0;
  }

  // Decodes a level of a segment until `end`. Returns whether that is done.
  function isDecoded(index, level, end) {
    let work = find(index, level);
    if (work?.segment || damaged.has(`${index} ${level}`)) return true;
    try {
      if (!work) works.push(work = file.preparation(index, level, { following: segmentsAt(level)[0] }));
      const start = performance.now(), { progress } = work;
      while (!work.step() && performance.now() < end);
      costs[level] = (performance.now() - start) / (work.progress - progress);
    } catch (error) {
      plant.failure ??= error; // A part of the file is damaged: what is decoded plays on.
      damaged.add(`${index} ${level}`);
      works = works.filter((each) => each !== work);
    }
    return Boolean(work?.segment);
  }

  // Returns the mesh's positions, relative to `origin`, its normals and its box, at the level that `distance` asks for or the best that
  // is decoded; null: nothing is. Decoding takes `budget` milliseconds or, where the next segment would come too late, up to half of
  // the time between two frames. fov: the vertical field of view in radians; height: in pixels.
  function update(seconds, { distance, fov, height, budget = 2 }) {
    const level = file.levelFor(distance, fov, height, 1, clip.firstSegment, last, "p99"), frame = file.frameAt(seconds, "loop");
    const now = file.segmentOf(Math.floor(frame)), next = now < last ? now + 1 : clip.firstSegment;
    const left = [now, next].reduce((sum, index) => sum + (costs[level] ?? 0) * (1 - (find(index, level)?.progress ?? 0)), 0);
    const updates = (file.segmentStart(now + 1) - frame) / (frame - before.frame); // until the next segment is shown
    const passed = seconds - before.seconds, due = updates > 0 ? Math.min(1.5 * left / updates, 500 * Math.min(passed, 0.1)) : 0;
    const end = performance.now() + Math.max(budget, due);
    const middle = Math.max(0, sizes.findLastIndex((size) => size <= sizes[level] / 8));
    const has = (index, least) => works.some((each) => each.index === index && each.segment && each.level >= least);
    before = { seconds, frame };

    works = works.filter((each) => {
      const stays = [now, next].includes(each.index) && (each.segment || [0, middle, level].includes(each.level));
      if (!stays) each.segment ? each.segment.free() : each.cancel();
      return stays;
    });
    const coarse = [now, next].flatMap((index) => [0, middle].filter((each) => !has(index, each)).map((each) => [index, each]));
    const wishes = [...coarse, [now, level], [next, level]]; // A middle level, of an eighth of the bytes, comes soon.
    wishes.filter((wish) => isFetched(...wish)).every((wish) => isDecoded(...wish, end));

    const decoded = works.filter(({ index, segment }) => index === now && segment).sort((a, b) => a.level - b.level);
    const shown = decoded.find((each) => each.level >= level) ?? decoded.at(-1);
    if (!shown) return null;
    for (const each of decoded) if (each !== shown) each.segment.free();
    works = works.filter(({ segment }) => !segment?.freed);
    file.positions(segmentsAt(shown.level), frame, { out: xyz, relative: true });
    file.normals(xyz, { out: normals });
    const bounds = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]; // least x, y, z, then largest x, y, z
    for (let k = 0; k < 3; k++)
      for (let i = k; i < xyz.length; i += 3) {
        bounds[k] = Math.min(bounds[k], xyz[i]);
        bounds[3 + k] = Math.max(bounds[3 + k], xyz[i]);
      }
    return { level: shown.level, bounds, positions: mesh.gather(xyz, plant.positions), normals: mesh.gather(normals, plant.normals) };
  }

  const floats = () => new Float32Array(3 * mesh.source.length);
  return Object.assign(plant, { file, mesh, origin: file.info.origin, positions: floats(), normals: floats(), update });
}
