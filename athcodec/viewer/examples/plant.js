// An .ath file for any engine: openPlant(url) gives its mesh, and update() its positions and normals for every drawn frame.
import { AthFile, ready } from "athcodec-three/decoder";

export async function openPlant(url) {
  const plant = { failure: null }; // what ended the download or the decoding; what is decoded plays on
  let file = null, isFetching = false, work = null, prepared = [];

  async function bytesOf(offset, size) {
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

  // Fetches what a level of a segment needs, and decodes it until `end`. Returns whether it is there.
  function isPrepared(index, level, end) {
    if (prepared.some((each) => each.index === index && each.level === level)) return true;
    const ranges = file.ranges(level, index, index);
    if (ranges.length > 0 && !isFetching) {
      isFetching = true; // until all is here
      feed(ranges).then(() => { isFetching = false; }, (error) => { plant.failure ??= error; });
    }
    if (ranges.length > 0) return false;
    if (work?.index !== index || work.level !== level) {
      work?.cancel();
      work = file.preparation(index, level);
    }
    while (!work.step() && performance.now() < end);
    const { segment } = work;
    if (segment) [work] = [null, prepared.push(segment)];
    return segment !== null;
  }

  const [clip] = file.clips, last = clip.firstSegment + clip.segmentCount - 1, xyz = new Float32Array(3 * file.info.vertexCount);
  const mesh = file.mesh(), normals = new Float32Array(xyz.length); // null: the plant has lines, file.polygons("edges"), and no faces

  // Returns the mesh's positions, relative to `origin`, and its normals, at the level that `distance` asks for or the best that is
  // decoded; null: nothing is. Decoding takes `budget` milliseconds. fov: the vertical field of view in radians; height: in pixels.
  function update(seconds, { distance, fov, height, budget = 2 }) {
    const level = file.levelFor(distance, fov, height, 1, clip.firstSegment, last, "p99"), end = performance.now() + budget;
    const frame = file.frameAt(seconds, "loop"), ahead = file.frameAt(seconds + 0.5, "loop");
    const [now, next] = [frame, ahead].map((at) => file.segmentOf(Math.floor(at))), isHere = prepared.some(({ index }) => index === now);
    try {
      if (isHere || isPrepared(now, 0, end)) isPrepared(now, level, end) && isPrepared(next, level, end);
    } catch (error) {
      plant.failure ??= error; // A part of the file is damaged.
    }
    const shown = prepared.filter(({ index }) => index === now).sort((a, b) => Math.abs(a.level - level) - Math.abs(b.level - level))[0];
    if (!shown) return null;
    for (const each of prepared) if (![now, next].includes(each.index) || (each.index === now && each.level !== shown.level)) each.free();
    prepared = prepared.filter(({ freed }) => !freed);
    file.positions(prepared.filter((each) => each.level === shown.level), frame, { out: xyz, relative: true });
    file.normals(xyz, { out: normals });
    return { level: shown.level, positions: mesh.gather(xyz, plant.positions), normals: mesh.gather(normals, plant.normals) };
  }

  const floats = () => new Float32Array(3 * mesh.source.length);
  return Object.assign(plant, { file, mesh, origin: file.info.origin, positions: floats(), normals: floats(), update });
}
