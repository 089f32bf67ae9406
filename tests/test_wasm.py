"""The decoder in WebAssembly: it shows the same bits as the C library, plays files
that arrive in pieces, names what is wrong with a damaged one, and is what the sources make."""

from __future__ import annotations

import ctypes
import hashlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from files import Parts
from header import core
from plants import awkward, clip_of, grow, plant, random_hierarchy
from programs import printed
from test_core import FILE_ORDER, OK, SOURCE_ORDER, Player, cut

import athcodec
from athcodec._native import MEASURES
from athcodec.decoding import container as ct
from athcodec.decoding.container import MAJOR, MINOR

pytestmark = pytest.mark.web

VIEWER = Path(__file__).resolve().parent.parent / "athcodec" / "viewer"
MODULE = VIEWER / "ath_decoder.mjs"
MOST_BYTES = 196_000


# ---- Node ----

# Names that every script below can use.
SCRIPT = """
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
const { AthError, AthFade, AthFile, ready, supported } = await import(%s);
await ready;
const read = (path) => new Uint8Array(readFileSync(path));
const digest = (...arrays) => {
  const hash = createHash("sha256");
  for (const array of arrays) hash.update(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
  return hash.digest("hex");
};
const each = (count, call) => Array.from({ length: count }, (_, i) => call(i));
const prepareAll = (file, level) => each(file.info.segmentCount, (i) => file.prepare(i, level));
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const frames = (file, segments, out = new Float32Array(3 * file.info.vertexCount)) => digest(
  ...each(file.info.frameCount, (t) => file.positions(segments, t, { out }).slice()));
const thrown = (call) => {
  try { call(); } catch (error) { return { ...error, type: error.constructor.name, message: error.message }; }
  return null;
};
const answer = (value) => console.log(JSON.stringify(value));
const [path, option] = process.argv.slice(2);
%s
"""


def run_node(tmp_path, script: str, *words):
    """What a script answers, run with `words` as its arguments."""
    node = shutil.which("node")
    if node is None:
        pytest.fail("node: got none on PATH, expected Node.js 18 or newer to test the WebAssembly decoder in")
    file = tmp_path / "script.mjs"
    file.write_text(SCRIPT % (json.dumps(MODULE.as_uri()), script), "utf-8")
    return json.loads(printed(node, file, *words))


def digest(*arrays) -> str:
    whole = hashlib.sha256()
    for array in arrays:
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.hexdigest()


def times_between(frame_count: int) -> list[float]:
    """Places on the frames, most of them between two."""
    return [0.0, 0.3, (frame_count - 1) / 2 + 0.25, frame_count - 1.125, frame_count - 0.375]


# ---- files ----


def key_framed(seed: int = 3):
    """A plant whose every vertex follows three rough signals, so that a learned time basis pays."""
    rng = np.random.default_rng(seed)
    labels, parents = random_hierarchy(rng, branches=20, longest=9)
    rest = grow(rng, labels, parents)
    signals, reach = rng.normal(size=(48, 3)), 0.3 * rng.normal(size=(3, len(rest), 3))
    return clip_of(rest + np.einsum("tk,knc->tnc", signals, reach), rest, labels, parents)


def first_chunk(data: bytes) -> int:
    """Where the first chunk begins (FORMAT.md, "Header")."""
    return int.from_bytes(data[16:20], "little")


def learned_chunks(path: Path) -> int:
    """How many STEMS chunks bring a time basis of their own (FORMAT.md, "STEMS")."""
    with athcodec.open(path) as decoder:
        return sum(chunk.kind == 16 and decoder.file.chunks.payload(chunk)[5] > 0 for chunk in decoder.file.chunks)


@pytest.fixture(
    scope="module", params=["sample", "bushy", "uneven", "clips", "layers", "wide", "exact rest", "key-framed"]
)
def any_ath(request, tmp_path_factory, sample_ath, bushy_ath, full_ath, medley_ath, layered_ath):
    """Files that use different parts of the decoder, all but one in several segments."""
    kept = {"sample": sample_ath, "bushy": bushy_ath, "uneven": full_ath, "clips": medley_ath, "layers": layered_ath}
    if request.param in kept:
        return kept[request.param]
    path = tmp_path_factory.mktemp("wasm") / "plant.ath"
    if request.param == "wide":
        clip = awkward(seed=8, branches=9, frames=40, dtype=np.float64, offset=1e3, motion="sway")
        athcodec.encode(clip, path, rel_error=1e-5, segment_frames=16, effort="fast")
        assert Player(path.read_bytes()).info.is_float64 == 1
    elif request.param == "exact rest":
        athcodec.encode(plant(seed=2, roots=2, offset=50.0), path, exact_rest=True, effort="fast")
    else:
        athcodec.encode(key_framed(), path, rel_error=1e-4, segment_frames=24)
        assert learned_chunks(path) > 0
    return path


def damaged(path: Path, tmp_path: Path, at: int) -> Path:
    data = bytearray(path.read_bytes())
    data[at] ^= 0x10
    copy = tmp_path / "damaged.ath"
    copy.write_bytes(data)
    return copy


# ---- the same bits ----

SHOW = """
const file = AthFile.open(read(path));
const levels = [];
for (let level = 0; level < file.info.levelCount; level++) {
  const segments = prepareAll(file, level);
  levels.push({
    frames: frames(file, segments),
    wide: frames(file, segments, new Float64Array(3 * file.info.vertexCount)),
    between: JSON.parse(option).map((t) => digest(
      file.positions(segments, t, { order: "file" }), file.matrices(segments, t), file.exact(segments, t),
      file.matrices(segments, t, { out: new Float64Array(12 * file.parts(level).nodeCount) }))),
  });
  for (const segment of segments) segment.free();
}
answer(levels);
"""


def test_every_level_shows_the_bits_of_the_c_library_at_and_between_frames(any_ath, tmp_path):
    player, wanted = Player(any_ath.read_bytes()), []
    vertices, every = player.info.vertex_count, range(player.info.frame_count)
    times = times_between(player.info.frame_count)
    for level in player.levels:
        prepared, (_, nodes, exact) = player.prepare_all(level), cut(player, level)

        def shown(name: str, rows: int, width: int, frame: float, *order: int, dtype=np.float32, prepared=prepared):
            out = np.zeros((rows, width), dtype)
            show = *player.at(prepared, frame), *order, out.ctypes.data, width * out.itemsize
            assert getattr(core, f"ath_{name}")(*show) == OK
            return out

        wide = (shown("positions_float64", vertices, 3, t, SOURCE_ORDER, dtype=np.float64) for t in every)
        between = [
            digest(
                shown("positions", vertices, 3, t, FILE_ORDER),
                shown("matrices", nodes, 12, t),
                shown("exact", exact, 3, t),
                shown("matrices_float64", nodes, 12, t, dtype=np.float64),
            )
            for t in times
        ]
        frames = digest(*(player.frame(prepared, t) for t in every))
        wanted.append({"frames": frames, "wide": digest(*wide), "between": between})
    assert run_node(tmp_path, SHOW, any_ath, json.dumps(times)) == wanted


DESCRIBE = """
const file = AthFile.open(read(path)), { info } = file, levels = [...Array(info.levelCount).keys()];
const b = file.branches();
const seconds = [-1, 0, 0.05, 0.4, 1, 7.77, 1e9, NaN];
answer({
  info: [info.fileLength, info.preludeLength, info.maxError, info.origin, info.vertexCount,
         info.branchCount, info.frameCount, info.segmentCount, info.clipCount, info.levelCount, info.fullLevelCount,
         info.nodeCount, info.chunkCount, info.isFloat64],
  branches: digest(...each(info.branchCount, (i) => Int32Array.of(
    b.parent[i], b.count[i], b.attach[i], b.flags[i], b.lag[i], b.first[i], b.subtree[i], b.depth[i],
    b.rigid[i], b.detail[i], b.ring[i]))),
  times: [...file.times()],
  rest: [digest(file.rest()), digest(file.rest("file", { out: new Float64Array(3 * info.vertexCount) }))],
  errors: levels.map((level) => [0, info.segmentCount - 1].map((first) => file.levelError(level, first))),
  frameAt: ["clamp", "loop", "pingpong", "marked"].map((wrap) => file.clips.map(
    (_, clip) => seconds.map((s) => file.frameAt(s, wrap, clip)))),
  clips: file.clips.map((clip, i) => [clip.name, clip.lastTime, clip.firstFrame, clip.frameCount, clip.firstSegment,
                                      clip.segmentCount, clip.loop, levels.map((level) => file.seamError(i, level))]),
  names: levels.map((level) => file.levelName(level)),
  levelFor: [0, 0.1, 1, 10, 100, 1e4, 1e6].map((d) => file.levelFor(d, 0.8, 1080, 1)),
  levelForMost: [0.1, 1, 10, 100, 1e4].map((d) => file.levelFor(d, 0.8, 1080, 1, 0, info.segmentCount - 1, "p99")),
});
"""


def test_the_module_describes_a_file_as_the_c_library_does(any_ath, tmp_path):
    player = Player(any_ath.read_bytes())
    file, info, last = player.address, player.info, player.info.segment_count - 1
    rest, wide = np.zeros((info.vertex_count, 3), np.float32), np.zeros((info.vertex_count, 3))
    assert core.ath_read_rest(file, None) == OK
    core.ath_rest(file, SOURCE_ORDER, rest.ctypes.data, 12)
    core.ath_rest_float64(file, FILE_ORDER, wide.ctypes.data, 24)
    seconds = [-1, 0, 0.05, 0.4, 1, 7.77, 1e9, float("nan")]

    def error(level: int, first: int) -> dict[str, float]:
        return {name: core.ath_level_error(file, level, first, last, i) for i, name in enumerate(MEASURES)}

    def level_for(measure: int, distance: float) -> int:
        return core.ath_level_for(file, 0, last, measure, distance, 0.8, 1080, 1)

    def level_name(level: int) -> str:
        text = ctypes.create_string_buffer(32)
        core.ath_level_name(file, level, text, len(text))
        return text.value.decode()

    counts = "vertex branch frame segment clip level full_level node chunk".split()
    wanted = {
        "info": [
            *(info.file_length, info.prelude_length, info.max_error, list(info.origin)),
            *(getattr(info, f"{name}_count") for name in counts),
            bool(info.is_float64),
        ],
        "branches": digest(np.ctypeslib.as_array(core.ath_branches(file), (info.branch_count,))),
        "times": core.ath_times(file)[: info.frame_count],
        "rest": [digest(rest), digest(wide)],
        "errors": [[error(level, segment) for segment in (0, last)] for level in player.levels],
        "frameAt": [
            [[core.ath_frame_at(file, clip, s, wrap) for s in seconds] for clip in range(info.clip_count)]
            for wrap in range(4)
        ],
        "clips": [
            [
                *(clip.name.decode(), clip.duration, clip.first_frame, clip.frame_count, clip.first_segment),
                *(clip.segment_count, bool(clip.loop)),
                [core.ath_seam_error(file, i, level) for level in player.levels],
            ]
            for i, clip in enumerate(player.clips)
        ],
        "names": [level_name(level) for level in player.levels],
        "levelFor": [level_for(0, distance) for distance in (0, 0.1, 1, 10, 100, 1e4, 1e6)],
        "levelForMost": [level_for(1, distance) for distance in (0.1, 1, 10, 100, 1e4)],
    }
    assert run_node(tmp_path, DESCRIBE, any_ath) == wanted


STEPS = """
const file = AthFile.open(read(path)), deepest = file.info.levelCount - 1;
const whole = frames(file, prepareAll(file, deepest));
const waiting = Array.from({ length: file.info.segmentCount }, (_, i) => file.preparation(i, deepest));
waiting.push(file.preparation(0, 0));
waiting.pop().cancel();
let rounds = 0;
while (waiting.map((preparation) => preparation.step(3)).includes(false)) rounds++;
const progress = each(file.info.segmentCount, (index) => {
  const preparation = file.preparation(index, deepest, { following: waiting[index - 1]?.segment }), shares = [];
  do shares.push(preparation.progress); while (!preparation.step(1));
  return [shares, preparation.progress];
});
answer({ whole, steps: frames(file, waiting.map(({ segment }) => segment)), rounds, progress });
"""


def test_segments_prepared_side_by_side_in_steps_show_the_same_bits(sample_ath, tmp_path):
    result = run_node(tmp_path, STEPS, sample_ath)
    assert result["steps"] == result["whole"] and result["rounds"] > 10
    for shares, end in result["progress"]:  # also of a segment that is joined to the one before
        assert end == 1 and shares[0] == 0 and shares == sorted(shares) and 0.9 < shares[-1] < 1


# ---- bytes that arrive ----

STREAM = """
const bytes = read(path), whole = AthFile.open(bytes);
const wanted = each(whole.info.levelCount, (level) => frames(whole, prepareAll(whole, level)));
let file = null, fed = 0, asked = 0, played = 0;
const wrong = [];
for (let end = 10; fed < bytes.length; end = Math.min(end + 701, bytes.length)) {
  if (file) {
    file.feed(bytes.subarray(fed, end), fed);
  } else {
    const front = AthFile.front(bytes.subarray(0, end));
    const error = thrown(() => { file = AthFile.open(bytes.subarray(0, end)); });
    if (front.ready !== (error === null)) wrong.push(["ready", end]);
    const helpful = error?.codeName === "MISSING" && error.needed > end && error.needed === front.needed;
    if (error && !helpful) wrong.push(error);
    if (error) asked = Math.max(asked, error.needed);
  }
  fed = end;
  const ready = file ? Math.min(...each(file.info.segmentCount, (segment) => file.readyLevel(segment))) : -1;
  if (ready < played) continue;
  if (frames(file, prepareAll(file, ready)) !== wanted[ready]) wrong.push(["frames", end, ready]);
  played = ready + 1;
}
answer({ wrong, played, levels: wanted.length, asked, prelude: file.info.preludeLength });
"""


def test_a_file_that_arrives_in_pieces_plays_each_level_as_soon_as_it_is_there(sample_ath, tmp_path):
    result = run_node(tmp_path, STREAM, sample_ath)
    assert result["wrong"] == []
    assert result["played"] == result["levels"] > 2
    assert result["asked"] == result["prelude"]


PIECES = """
const bytes = read(path), whole = AthFile.open(bytes);
const last = whole.info.segmentCount - 1, deepest = whole.info.levelCount - 1;
const middle = whole.segmentStart(last) + 1;
const file = AthFile.open(bytes.subarray(0, whole.info.preludeLength));
const feed = (ranges) => {
  for (const { offset, size } of ranges) file.feed(bytes.subarray(offset, offset + size), offset);
};
const shown = (of, level) => digest(of.positions([of.prepare(last, level)], middle));
const result = { before: thrown(() => file.prepare(last, 1)), none: file.readyLevel(last) };
const wanted = file.ranges(1, last, last), least = file.ranges(0, last, last);
feed([...wanted].reverse());
Object.assign(result, {
  left: file.ranges(1, last, last), all: same(file.ranges(1, last, last, true), wanted),
  ready: file.readyLevel(last), others: file.readyLevel(0), same: shown(file, 1) === shown(whole, 1),
  deeper: thrown(() => file.prepare(last, deepest)),
  elsewhere: thrown(() => file.positions([file.prepare(last, 1)], 0)),
});
feed(file.ranges(deepest).reverse());
result.deepest = shown(file, deepest) === shown(whole, deepest);
const preparation = file.preparation(0, deepest);
result.busy = thrown(() => file.drop(0, bytes.length));
preparation.cancel();
file.drop(0, bytes.length);
result.dropped = [file.readyLevel(last), same(file.ranges(0, last, last), least)];
answer(result);
"""


def test_ranges_fed_in_any_order_are_enough_and_dropped_ones_are_missing(sample_ath, tmp_path):
    result = run_node(tmp_path, PIECES, sample_ath)
    assert result["before"]["codeName"] == result["deeper"]["codeName"] == "MISSING"
    assert (result["none"], result["ready"], result["others"]) == (-1, 1, -1)
    assert result["left"] == [] and result["all"] and result["same"] and result["deepest"]
    assert result["elsewhere"]["codeName"] == "NOT_PREPARED"
    assert "segment 0" in result["busy"]["message"]
    assert result["dropped"] == [-1, True]


MEMORY = """
let pages = 0;
const grow = WebAssembly.Memory.prototype.grow;
WebAssembly.Memory.prototype.grow = function (more) { pages += more; return grow.call(this, more); };
const bytes = read(path), file = AthFile.open(bytes), deepest = file.info.levelCount - 1, after = [];
for (let round = 0; round < 12; round++) {
  for (const segment of prepareAll(file, round % 2 ? deepest : 1)) segment.free();
  file.preparation(0, deepest).cancel();
  file.drop(0, bytes.length);
  file.feed(bytes, 0);
  after.push(pages);
}
answer(after);
"""


def test_freed_segments_and_dropped_bytes_leave_room_for_the_next(sample_ath, tmp_path):
    after = run_node(tmp_path, MEMORY, sample_ath)
    assert after[0] > 0 and set(after[2:]) == {after[-1]}


# ---- what is wrong ----

DAMAGE = """
const bytes = read(path), good = read(option), file = AthFile.open(bytes), deepest = file.info.levelCount - 1;
const error = thrown(() => prepareAll(file, deepest));
const { offset, length } = file.chunks()[error.chunk];
const read_back = thrown(() => file.chunkBytes(error.chunk));
file.drop(offset, length);
file.feed(good, 0);
const undamaged = AthFile.open(good);
answer({ error, read_back, offset, length, chunk: digest(file.chunkBytes(error.chunk)),
         repaired: frames(file, prepareAll(file, deepest)),
         undamaged: frames(undamaged, prepareAll(undamaged, deepest)) });
"""


def test_a_damaged_chunk_is_named_and_can_be_fed_anew(sample_ath, tmp_path):
    data = sample_ath.read_bytes()
    at = len(data) * 2 // 3
    result = run_node(tmp_path, DAMAGE, damaged(sample_ath, tmp_path, at), sample_ath)
    first, length = result["offset"], result["length"]
    assert first <= at < first + length
    for error in (result["error"], result["read_back"]):
        assert (error["type"], error["codeName"], error["code"]) == ("AthError", "BAD_CHECKSUM", 5)
    assert result["chunk"] == hashlib.sha256(data[first : first + length]).hexdigest()
    assert result["repaired"] == result["undamaged"]


OPEN = "answer(thrown(() => AthFile.open(read(path))));"


@pytest.mark.parametrize(
    "at, name, in_chunk, sentence",
    [
        (0, "NOT_AN_ATH_FILE", False, "file: got first bytes 0x99415448; expected 0x89415448"),
        (8, "UNSUPPORTED_VERSION", False, f"file: got format version {MAJOR ^ 16}.{MINOR}; expected {MAJOR}.{MINOR}"),
        (70, "BAD_CHECKSUM", False, "front: got checksum 0x[0-9a-f]{8}; expected 0x[0-9a-f]{8}"),
        (-1, "BAD_CHECKSUM", True, r"chunk HIERARCHY at byte \d+: got checksum 0x[0-9a-f]{8}; expected 0x[0-9a-f]{8}"),
    ],
)
def test_a_file_that_cannot_be_opened_is_an_error_with_a_code(sample_ath, tmp_path, at, name, in_chunk, sentence):
    """at: the byte that is damaged; -1: one of the hierarchy. The sentence is that of C and of Python."""
    at = first_chunk(sample_ath.read_bytes()) + 20 if at < 0 else at
    error = run_node(tmp_path, OPEN, damaged(sample_ath, tmp_path, at))
    assert error["type"] == "AthError" and error["codeName"] == name and (error["chunk"] >= 0) == in_chunk
    assert re.fullmatch(f"{name}: {sentence}", error["message"])


GOING_ON = """
const first = file.info.depthLevels - 1, last = file.info.levelCount - 1, keep = true;
let kept = file.prepare(0, first, { keep });
const result = { same: [], anew: [], ranges: [], freed: [] };
for (let level = first + 1; level <= last; level++) {
  const alone = digest(file.positions([file.prepare(0, level)], 1.5));
  const ranges = file.ranges(level, 0, 0, true, level - 1), whole = file.ranges(level, 0, 0, true);
  result.ranges.push(ranges.reduce((sum, { size }) => sum + size, 0) < whole.reduce((sum, { size }) => sum + size, 0));
  for (const { offset, size } of file.ranges(level - 1, 0, 0, true)) file.drop(offset, size);
  result.anew.push(thrown(() => file.prepare(0, level, { from: file.prepare(0, level - 1) }))?.codeName);
  const before = digest(file.positions([kept], 1.5)), deeper = file.prepare(0, level, { from: kept, keep });
  result.same.push(digest(file.positions([deeper], 1.5)) === alone && digest(file.positions([kept], 1.5)) === before);
  file.feed(bytes, 0);
  for (const from of [null, file.prepare(1, level - 1, { keep }), file.prepare(0, level - 1)])
    result.anew.push(digest(file.positions([file.prepare(0, level, { from })], 1.5)) === alone);
  const preparation = file.preparation(0, level, { from: kept });
  preparation.step(1);
  kept.free();
  result.freed.push(thrown(() => preparation.step(1))?.message, thrown(() => preparation.step(1))?.message);
  kept = deeper;
}
answer(result);
"""


def test_a_deeper_level_goes_on_from_the_one_before_without_its_bytes(layered_ath, tmp_path):
    """From what was kept where there is any, else from the first layer; the segment before can be shown on."""
    prelude = "const bytes = read(path), file = AthFile.open(bytes);"
    result = run_node(tmp_path, prelude + GOING_ON, layered_ath)
    assert result["same"] == result["ranges"] == [True] * 2
    assert result["anew"] == ["MISSING", True, True, True] * 2
    assert [message.split(",")[0] for message in result["freed"]] == [
        "step: got a freed segment",
        "step: got a preparation that has ended",
    ] * 2


FADES = """
const file = AthFile.open(read(path)), deepest = file.info.levelCount - 1, fade = new AthFade();
const levels = [1, deepest, 0];
const prepared = levels.map((level) => prepareAll(file, level)), all = prepared.flat(), place = 1.5;
const shown = prepared.map((segments) => file.positions(segments, place, { order: "file" }));
const before = { levels: [...fade.levels], cut: fade.cut };
for (const level of levels) fade.to(level, 0.3);
const { weights, cut } = fade, faded = file.positions(all, place, { order: "file", fade });
const off = faded.map((value, i) => Math.abs(value - shown.reduce((sum, xyz, k) => sum + weights[k] * xyz[i], 0)));
const { nodeCount, exactCount } = file.parts(cut), exact = file.exact(all, place, { fade });
const result = { before, levels: fade.levels, weights, cut, off: Math.max(...off),
  exact: same([...exact], [...faded].slice(0, exact.length)), // all vertices are
  sizes: [file.matrices(all, place, { fade }).length === 12 * nodeCount, exact.length === 3 * exactCount],
  lacking: thrown(() => file.positions(prepared[0], place, { fade })),
  alone: same(file.positions(all, place, { fade: new AthFade().to(1, 0) }), file.positions(prepared[0], place)),
  errors: [() => file.positions(all, 0, { fade: { levels: [], weights: [] } }),
    () => file.positions(all, 0, { fade: { levels: [0, 0, 0, 0, 0], weights: [1, 0, 0, 0, 0] } }),
    () => file.matrices(all, 0, { fade: { levels: [deepest + 1], weights: [1] } }),
    () => file.positions(all, 0, { fade, out: new Float64Array(3 * file.info.vertexCount) }),
    () => fade.to(-1, 0), () => fade.to(0)].map((call) => thrown(call)?.type) };
fade.to(0, 1);
answer({ ...result, end: [fade.levels, fade.weights] });
"""


def test_levels_fade_into_each_other(sample_ath, tmp_path):
    result = run_node(tmp_path, FADES, sample_ath)
    with athcodec.open(sample_ath) as decoder:
        deepest, size = decoder.file.level_count - 1, np.abs(decoder.positions(1)).max()
    assert result["before"] == {"levels": [], "cut": -1}
    assert result["levels"] == [1, deepest, 0] and result["cut"] == deepest
    assert sum(result["weights"]) == pytest.approx(1) and result["weights"][2] == 0 < result["weights"][1]
    assert result["off"] < 2e-6 * size and result["exact"] and result["sizes"] == [True, True]
    assert result["alone"] and result["lacking"]["codeName"] == "NOT_PREPARED"
    assert f"pass what prepare(0, 1) and prepare(0, {deepest}) returns" in result["lacking"]["message"]
    assert result["errors"] == ["RangeError"] * 3 + ["TypeError"] + ["RangeError", "TypeError"]
    assert result["end"] == [[0], [1]]


MISUSE = """
const file = AthFile.open(read(path)), { levelCount, segmentCount } = file.info;
const foreign = AthFile.open(read(path)).prepare(0, 0);
const segment = file.prepare(0, 0), freed = file.prepare(0, 1);
freed.free();
freed.free();
const calls = [
  () => file.prepare(0, levelCount), () => file.prepare(segmentCount, 0), () => file.prepare(0.5, 0),
  () => file.levelError(-1), () => file.ranges(0, 0, segmentCount), () => file.positions([foreign], 0),
  () => file.positions([segment], 0, { out: new Float32Array(3) }),
  () => file.matrices([segment], 0, { out: new Float32Array(11) }),
  () => file.exact([segment], 0, { out: new Int8Array(99999) }),
  () => file.positions([segment], 0, { order: "random" }), () => file.frameAt(0, "twice"),
  () => file.feed([1, 2, 3], 0), () => file.chunkBytes(-1), () => file.segmentOf(file.info.frameCount),
];
const result = {
  errors: calls.map((call) => thrown(call)?.type ?? String(call)),
  freed: thrown(() => file.positions([freed, null], 0)),
  held: [0.25, file.segmentStart(1) - 0.25].map((t) => [file.positions([segment], t) !== null, file.held]),
};
file.dispose();
result.disposed = thrown(() => file.times()).message;
segment.free();
answer(result);
"""


def test_arguments_out_of_range_are_refused_before_they_reach_the_memory(sample_ath, tmp_path):
    result = run_node(tmp_path, MISUSE, sample_ath)
    assert set(result["errors"]) == {"RangeError", "TypeError"}
    assert "NOT_PREPARED: frame 0: got no segment, expected segment 0" in result["freed"]["message"]
    assert result["held"] == [[True, False], [True, True]]
    assert "dispose" in result["disposed"]


SEVERAL = """
const file = AthFile.open(read(path)), level = file.info.levelCount - 1, frame = file.segmentStart(1) + 2.5;
const first = file.prepare(0, level), segments = [first], out = new Float32Array(3 * file.info.vertexCount).fill(7);
const calls = {
  positions: () => file.positions(segments, frame, { out }), none: () => file.positions([null], frame),
  matrices: () => file.matrices(segments, frame), exact: () => file.exact(segments, frame),
  blended: () => file.blended([{ segments, frame: 0, weight: 1 }, { segments, frame, weight: 1 }]),
};
const errors = Object.fromEntries(Object.entries(calls).map(([name, call]) => [name, thrown(call)]));
const advice = errors.positions.message.match(/prepare\\((\\d+), (\\d+)\\)/).slice(1).map(Number);
const untouched = out.every((number) => number === 7);
const shown = digest(file.positions([first, file.prepare(...advice)], frame));
answer({ errors, untouched, shown, level: thrown(() => file.prepare(0)), of: file.segmentOf(Math.floor(frame)) });
"""


def test_a_frame_of_a_segment_that_is_not_prepared_is_an_error_that_says_which_to_prepare(sample_ath, tmp_path):
    result = run_node(tmp_path, SEVERAL, sample_ath)
    with athcodec.open(sample_ath) as decoder:
        deepest, (start, _) = decoder.file.level_count - 1, decoder.segments[1]
        between = decoder.blended({"": 1.0}, float(decoder.time[start + 2] + decoder.time[start + 3]) / 2)
        assert digest(between) == result["shown"]
    message = (
        f"NOT_PREPARED: frame {start + 2.5}: got segment 0 at level {deepest}, expected segment 1, the one of 3 that "
        f"has this frame: pass what prepare(1, {deepest}) returns; segmentOf(Math.floor(frame)) is its number"
    )
    errors = result["errors"]
    for name in ("positions", "matrices", "exact", "blended"):
        assert (errors[name]["type"], errors[name]["codeName"]) == ("AthError", "NOT_PREPARED")
        assert errors[name]["message"] == message
    assert f"frame {start + 2.5}: got no segment, expected segment 1" in errors["none"]["message"]
    assert result["untouched"] and result["of"] == 1
    assert (
        result["level"]["type"] == "RangeError"
        and "levelFor() and readyLevel() return one" in result["level"]["message"]
    )


# ---- static data and surfaces ----

CORNERS = [0, 1, 2, 3, 2, 1, 4, 3, 4, 5]  # Of a triangle, a quad and a triangle.
SIZES = [3, 4, 3]
REST = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0.5], [2, 1, 0]], np.float32)


def static_arrays() -> dict[str, np.ndarray]:
    """One of each kind; u and v are stored per corner."""
    uv = REST[CORNERS, :2].copy()
    uv[3] += 0.5  # The second face has another u and v at vertex 3 than the third.
    return {
        "uv": uv,
        "radius": np.random.default_rng(2).random(6),
        "halves": np.float16([0, -2.5, 6e-8, np.inf, 0.1, 65504]),
        "wide": np.int64([-(2**40), 2**60]),
        "hidden": np.array([True, False, True]),
        "colors": np.uint8([[255, 0, 51]] * 6),
        "labels": np.char.encode(np.array(["oak", "föhre"]), "utf-8"),
        "none": np.zeros((0, 3), np.float32),
    }


def surfaces(folder: Path) -> Path:
    """Six vertices under faces of two sizes, in a loop, with static arrays."""
    positions = REST + 0.1 * np.sin(np.arange(7))[:, None, None] * REST[None, :, ::-1]
    clip = athcodec.MotionClip(
        positions.astype(np.float32),
        np.arange(7) / 24,
        rest=REST,
        attributes=static_arrays() | {"face_vertex_counts": np.int32(SIZES), "face_vertex_indices": np.int32(CORNERS)},
        metadata={"unit": "cm", "domains": {"uv": "corner"}, "note": "é" * 3000},
    )
    athcodec.encode(athcodec.looped(clip), folder / "surfaces.ath", rel_error=1e-4, effort="fast")
    return folder / "surfaces.ath"


STATICS = """
const file = AthFile.open(read(path)), names = file.attributeNames();
const written = (value) => (Number.isFinite(value) ? value : String(value));
const plain = ({ array, shape }) => ({ type: array.constructor.name, shape, values: Array.from(array, written) });
answer({ metadata: file.metadata(), names, none: file.attribute("nothing"), ranges: file.attributeRanges(),
         arrays: Object.fromEntries(names.map((name) => [name, plain(file.attribute(name))])) });
"""


def test_static_arrays_and_metadata_are_those_that_were_encoded(tmp_path):
    result, wanted = run_node(tmp_path, STATICS, surfaces(tmp_path)), static_arrays()
    assert result["metadata"]["note"] == "é" * 3000 and result["metadata"]["domains"]["uv"] == "corner"
    assert sorted(result["names"]) == sorted(wanted)
    types = {"halves": "Float32Array", "hidden": "Uint8Array", "labels": "Array", "wide": "BigInt64Array"}
    types |= {"uv": "Float32Array", "radius": "Float64Array", "colors": "Uint8Array", "none": "Float32Array"}
    for name, values in wanted.items():
        shown = result["arrays"][name]
        assert (shown["type"], shown["shape"]) == (types[name], list(values.shape))
        if values.dtype.kind == "S":
            assert shown["values"] == ["oak", "föhre"]
        else:
            numbers = [float(value) if value != "Infinity" else np.inf for value in shown["values"]]
            assert np.array_equal(np.array(numbers).astype(values.dtype), values.reshape(-1))
    assert result["none"] is None and result["ranges"] == []


SURFACE = """
const file = AthFile.open(read(path)), mesh = file.mesh(), positions = file.rest(), plain = AthFile.open(read(option));
const out = new Float32Array(positions.length), normals = file.normals(positions, { out });
answer({ triangles: [...file.triangles()], normals: [...normals], same: normals === out, rest: [...positions],
         source: [...mesh.source], mesh: [...mesh.triangles], uv: [...mesh.uv], colors: [...mesh.colors],
         gathered: [...mesh.gather(positions)], few: thrown(() => file.normals(positions.subarray(3))),
         clips: file.clips, plain: [plain.triangles(), [...plain.mesh().triangles], plain.mesh().source.length] });
"""


def test_triangles_normals_and_a_mesh_come_without_the_loader(sample_ath, tmp_path):
    result = run_node(tmp_path, SURFACE, surfaces(tmp_path), sample_ath)
    rest = np.array(result["rest"]).reshape(-1, 3)
    assert result["triangles"] == [0, 1, 2, 3, 2, 1, 3, 1, 4, 3, 4, 5]
    normals = np.zeros((6, 3))
    for triangle in np.reshape(result["triangles"], (-1, 3)):
        a, b, c = rest[triangle]
        normals[triangle] += np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.allclose(np.reshape(result["normals"], (-1, 3)), normals, atol=1e-6) and result["same"]
    # Vertex 3 is there twice, as its u and v differ; of each corner the mesh has the vertex, u and v of the source.
    assert sorted(result["source"]) == [0, 1, 2, 3, 3, 4, 5]
    source, uv = np.array(result["source"]), np.reshape(result["uv"], (-1, 2))
    corners = [0, 1, 2, 3, 4, 5, 3, 5, 6, 7, 8, 9]
    assert source[result["mesh"]].tolist() == result["triangles"]
    assert np.array_equal(uv[result["mesh"]], static_arrays()["uv"][corners])
    assert np.allclose(np.reshape(result["colors"], (-1, 4)), [1, 0, 0.2, 1])
    assert np.array_equal(np.reshape(result["gathered"], (-1, 3)), rest[source])
    assert result["few"]["type"] == "RangeError" and result["plain"] == [None, [], len(athcodec.open(sample_ath)[0])]


def test_the_duration_of_a_loop_is_its_round_and_that_of_others_the_time_of_their_last_frame(sample_ath, tmp_path):
    (loop,) = run_node(tmp_path, SURFACE, surfaces(tmp_path), sample_ath)["clips"]
    assert loop["loop"] and loop["duration"] == pytest.approx(7 / 24) and loop["lastTime"] == pytest.approx(6 / 24)
    script = """
    const file = AthFile.open(read(path)), [clip] = file.clips;
    const at = (rounds) => file.frameAt(rounds * clip.duration, "marked");
    answer({ ...clip, end: at(1), beyond: at(8) });
    """
    still = run_node(tmp_path, script, sample_ath)
    assert not still["loop"] and still["duration"] == still["lastTime"] > 0
    assert still["end"] == still["beyond"] == still["frameCount"] - 1
    turned = run_node(tmp_path, script, surfaces(tmp_path))
    assert turned["end"] == turned["beyond"] == 0


ABSENT = """
const bytes = read(path), whole = AthFile.open(bytes), file = AthFile.open(bytes.subarray(0, whole.info.preludeLength));
const first = thrown(() => file.attribute("uv")), mesh = thrown(() => file.mesh()), ranges = file.attributeRanges();
for (const { offset, size } of ranges) file.feed(bytes.subarray(offset, offset + size), offset);
answer({ first, mesh, count: ranges.length, fed: file.attributeNames(), uv: [...file.attribute("uv").array] });
"""


def test_arrays_that_are_still_to_come_are_missing_and_not_absent(tmp_path):
    result = run_node(tmp_path, ABSENT, surfaces(tmp_path))
    assert result["first"]["codeName"] == result["mesh"]["codeName"] == "MISSING"
    assert "attributeRanges()" in result["first"]["message"] and result["count"] == 1
    assert len(result["fed"]) == 8 and len(result["uv"]) == 20


FAR = """
const file = AthFile.open(read(path)), { origin, levelCount } = file.info, frame = 2.25;
const largest = (numbers) => Math.max(...numbers.map(Math.abs));
const wide = () => new Float64Array(3 * file.info.vertexCount);
const off = (shown, wanted) => largest(Array.from(shown, (value, i) => value - wanted[i]));
const segments = each(levelCount, (level) => prepareAll(file, level));
const absolute = segments.map((some) => file.positions(some, frame, { out: wide() }));
const less = (numbers) => numbers.map((value, i) => value - origin[i % 3]);
const moved = (level) => {
  const rest = file.levelRest(level, "file", { relative: true }), parts = file.parts(level);
  const m = file.matrices(segments[level], frame, { relative: true });
  const xyz = file.positions(segments[level], frame, { relative: true, order: "file" });
  const offIn = (part) => largest(each(3 * parts.count[part], (i) => {
    const v = 3 * (parts.first[part] + Math.floor(i / 3)), row = 12 * parts.index[part] + 4 * (i % 3);
    return m[row] * rest[v] + m[row + 1] * rest[v + 1] + m[row + 2] * rest[v + 2] + m[row + 3] - xyz[v + i % 3];
  }));
  return Math.max(0, ...each(parts.partCount, (part) => (parts.branch[part] < 0 ? 0 : offIn(part))));
};
const fade = { levels: [0, levelCount - 1], weights: [0.25, 0.75] }, both = [...segments[0], ...segments.at(-1)];
const mean = absolute[0].map((value, i) => 0.25 * value + 0.75 * absolute.at(-1)[i]);
const alone = (level) => off(file.positions(segments[level], frame, { relative: true }), less(absolute[level]));
answer({ origin, alone: each(levelCount, alone), moved: each(levelCount, moved),
         faded: off(file.positions(both, frame, { fade, relative: true }), less(mean)),
         rest: off(file.rest("source", { relative: true }), less(file.rest("source", { out: wide() }))),
         lacking: thrown(() => file.positions(segments[0], frame, { fade, relative: true })),
         both: thrown(() => file.matrices(both, frame, { fade, relative: true })) });
"""


def test_relative_positions_are_fine_far_from_the_origin(tmp_path):
    """As floats the coordinates themselves are a quarter of a metre apart."""
    clip = plant(seed=4, branches=12, frames=9, dtype=np.float64, offset=4e6)
    athcodec.encode(clip, tmp_path / "far.ath", max_error=1e-3, effort="fast")
    result = run_node(tmp_path, FAR, tmp_path / "far.ath")
    assert max(result["origin"]) > 1e6
    assert max(*result["alone"], *result["moved"], result["faded"], result["rest"]) < 2e-5
    assert result["lacking"]["codeName"] == "NOT_PREPARED" and result["both"]["type"] == "TypeError"


REFUSED = """
const refusal = (name) => thrown(() => AthFile.open(read(`${path}/${name}`)).attribute("a"));
answer(JSON.parse(option).map((name) => refusal(name)?.codeName ?? null));
"""


def test_static_arrays_that_are_damaged_are_refused(tmp_path):
    """With the codes of FORMAT.md; the checksums of these chunks fit."""
    from test_damage import attribute, zstd

    values = np.float32([1, 2, 3, 4])
    body, twice = zstd(values.view(np.uint8).reshape(-1, 4).T.tobytes()), zstd(bytes(32))
    bad, most = "BAD_CHUNK", "LIMIT_EXCEEDED"
    cases = [
        (attribute(body), None),
        (attribute(body[:-1]), bad),
        (attribute(twice), bad),
        (attribute(body + body), bad),
        (attribute(b"1234" + body), bad),
        (attribute(body, kind=5), bad),
        (attribute(body, size=3), bad),
        (attribute(body, name=b""), bad),
        (attribute(body, name=b"\xff"), bad),
        (attribute(body, name=b"a" * 5000), most),
        (attribute(body, shape=[2**31, 0, 4]), most),
        (attribute(body, shape=[0]), bad),
        (attribute(b"", shape=[4]), bad),
        (attribute(body)[:7], bad),
        (attribute(body)[:11], bad),
    ]
    names = []
    for i, (payload, _) in enumerate(cases):
        names.append(f"{i}.ath")
        (tmp_path / names[-1]).write_bytes(with_array(tmp_path, payload))
    assert run_node(tmp_path, REFUSED, tmp_path, json.dumps(names)) == [code for _, code in cases]


def with_array(folder: Path, payload: bytes) -> bytes:
    """A small file whose only static array is this chunk."""
    path = folder / "one.ath"
    if not path.exists():
        clip = key_framed()
        clip.attributes["a"] = np.zeros(4, np.float32)
        athcodec.encode(clip, path, effort="fast")
    return Parts.of(path.read_bytes()).with_payload(ct.ATTRIBUTE, payload)


# ---- the module ----


def test_the_module_is_small_imports_nothing_and_fetches_nothing():
    text = MODULE.read_text("utf-8")
    assert len(text.encode()) <= MOST_BYTES
    assert not re.search(r"\bimport\b|\bfetch\b|\brequire\b", re.sub(r'const WASM = "[^"]*"|//.*', "", text))


MEMBERS = """
const leafy = AthFile.open(read(option));
const file = AthFile.open(read(path)), segment = file.prepare(0, 0), preparation = file.preparation(0, 0);
const of = (value) => [value, Object.getPrototypeOf(value)].flatMap((one) => Object.getOwnPropertyNames(one))
  .filter((name) => name !== "constructor").sort();
answer({ AthFile: [...of(file), "front", "open"].sort(), AthFade: of(new AthFade()),
         Fading: ["levels", "weights"], Segment: of(segment), Preparation: of(preparation),
         AthInfo: Object.keys(file.info).sort(), Branches: Object.keys(file.branches()).sort(),
         Parts: Object.keys(file.parts(0)).sort(), Chunk: Object.keys(file.chunks()[0]).sort(),
         Polygons: Object.keys(file.polygons("edges")).sort(),
         Attribute: Object.keys(leafy.attribute("uv")).sort(), Mesh: of(leafy.mesh()),
         Clip: Object.keys(file.clips[0]).sort(), ByteRange: Object.keys(file.ranges(0, 0, 0, true)[0]).sort() });
"""


def test_every_member_is_declared_for_typescript_and_no_others(sample_ath, tmp_path):
    text = (VIEWER / "ath_decoder.d.ts").read_text("utf-8")
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    declared = {}
    for name, body in re.findall(r"(?:class|interface) (\w+)[^{]*\{\n(.*?)\n\}", code, flags=re.S):
        members = re.findall(r"^  (?:(?:readonly|static) )*(\w+)(?:<[^(]*>)?[(:?]", body, flags=re.M)
        declared[name] = sorted(set(members) - {"private", "constructor"})
    del declared["AthError"]
    assert run_node(tmp_path, MEMBERS, sample_ath, surfaces(tmp_path)) == declared


def check_build(viewer: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, str(viewer / "build_decoder.py"), "--check"]
    return subprocess.run(command, capture_output=True, text=True)


def test_the_module_is_what_the_sources_make():
    done = check_build(VIEWER)
    assert done.returncode == 0, done.stderr


def test_a_module_that_the_sources_do_not_make_is_noticed(tmp_path):
    copy = tmp_path / "athcodec"
    for name in ("core", "viewer"):
        shutil.copytree(VIEWER.parent / name, copy / name)
    source = copy / "core" / "file" / "fault_text.c"
    source.write_text(source.read_text("utf-8").replace('"INVALID"', '"DAMAGED"'), "utf-8")
    done = check_build(copy / "viewer")
    assert done.returncode == 1 and "WebAssembly" in done.stderr and "build_decoder.py" in done.stderr
