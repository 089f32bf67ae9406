"""The GPU form (ath_gpu.h, docs/gpu.md): positions computed from its blocks alone are those of the decoder, in
NumPy and, with the marker `browser`, by the shaders in Chromium (Debian's, without a graphics card)."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from conftest import WEBGPU_FLAGS
from moving_meshes import leafed_tree
from plants import blown_tree, bush, chain_plant, distance, flowing_growth
from test_blending import simulated
from test_tubes import twigs

import athcodec
from athcodec.decoding.core_file import FILE_ORDER, CoreError
from athcodec.gpu import SHADERS, GpuFile, Room, corners_of
from athcodec.gpu.evaluate import BODY, LEVEL, SEGMENT, Passes, Source, head, section
from athcodec.sources import sample_path
from athcodec.viewer.picture import chromium
from spec.robust.hostile import repaired

pytestmark = pytest.mark.web

ADDRESS = "http://localhost/"
VECTORS = Path(__file__).parents[1] / "spec" / "vectors" / "valid"
SHARE_OF_BOUND, SHARE_OF_DIAGONAL, SHARE_OF_AWKWARD = 0.05, 1e-6, 1e-4
# so far from the origin that decoded floats are coarse; sheets whose rotation is chance; a stem shorter than any float
BEYOND_FLOATS = {"origin-far", "source-rest-wide", "layers-ratio-1", "tubes", "tangent-short-above"}


class Checked:
    """A file, its blocks, and what the decoder shows of it, relative to the origin and in file order."""

    def __init__(self, path: Path, host_mesh: np.ndarray | None = None):
        self.gpu = GpuFile(path.read_bytes(), host_mesh)
        self.info = self.gpu.core.info
        self.starts = self.gpu.core.segment_starts(range(self.info.segment_count + 1))
        self._prepared: dict[tuple[int, int], object] = {}

    def segment_of(self, frame: int) -> int:
        return int(np.searchsorted(self.starts, frame, side="right")) - 1

    def prepared(self, segment: int, level: int):
        if (segment, level) not in self._prepared:
            self._prepared[segment, level] = self.gpu.prepared(segment, level)
        return self._prepared[segment, level]

    def decoded(self, frame: int, level: int) -> np.ndarray:
        """(P, 3) float64, of places."""
        out = np.empty((self.info.place_count, 3))
        self.gpu.core.positions(self.prepared(self.segment_of(frame), level), float(frame), out, FILE_ORDER)
        return out - np.array(self.info.origin)

    def tolerance(self) -> float:
        every = [self.decoded(frame, self.info.level_count - 1) for frame in range(0, self.info.frame_count, 7)]
        corners = np.array([np.min(every, axis=(0, 1)), np.max(every, axis=(0, 1))])
        diagonal = float(np.linalg.norm(corners[1] - corners[0]))
        return max(SHARE_OF_BOUND * self.info.max_error, SHARE_OF_DIAGONAL * diagonal)


def loaded(path_or_clip, path: Path, **options) -> Checked:
    athcodec.encode(path_or_clip, path, **{"attributes": "none", "effort": "fast"} | options)
    return Checked(path)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A function that gives a file by the name of what it is."""
    folder, known = tmp_path_factory.mktemp("gpu"), {}

    def file(name: str) -> Checked:
        if name not in known:
            known[name] = MAKERS[name](folder / f"{name}.ath")
        return known[name]

    return file


def sample(path: Path, **options) -> Checked:
    with athcodec.read(sample_path("tree")) as clip:
        return loaded(clip, path, **options)


def several(path: Path) -> Checked:
    """A gale of two segments, and a calm that is a loop."""
    gale, calm = blown_tree(3, 60, 70), blown_tree(3, 60, 30, sway=0.02)
    return loaded(athcodec.join({"gale": gale, "calm": athcodec.looped(calm)}), path, segment_frames=40)


MAKERS = {
    "sample": lambda path: sample(path, ladder="none", segment_frames=40),
    "layers": lambda path: sample(path, rel_error=1e-4, segment_frames=60),
    "coarse": lambda path: sample(path, rel_error=1e-3, segment_frames=30),
    "leaves": lambda path: loaded(leafed_tree(frames=32), path, segment_frames=16),
    "tubes": lambda path: loaded(twigs(32), path, rel_error=1e-3, segment_frames=16),
    "several clips": several,
    "chain": lambda path: loaded(chain_plant(12, 150), path, rel_error=1e-4),
    "doubles": lambda path: loaded(bush(40, 5), path, rel_error=1e-5),
    "growth": lambda path: loaded(flowing_growth(), path),
    "lossless": lambda path: sample(path, lossless=True, segment_frames=60),
}


def blocks_of(file: Checked, level: int, segment: int) -> tuple[np.ndarray, np.ndarray]:
    return file.gpu.level(level), file.gpu.segment(segment, level)


# ---- in NumPy ----


@pytest.mark.parametrize("name", MAKERS)
def test_blocks_hold_all_that_positions_follow_from(files, name):
    file = files(name)
    tolerance = file.tolerance()
    for got, wanted in shown_by_both(file):
        assert distance(got, wanted) <= tolerance


def shown_by_both(file: Checked) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """What the blocks and the decoder show of each level and segment, all frames."""
    for level in range(file.info.level_count):
        block = file.gpu.level(level)
        for segment in range(file.info.segment_count):
            frames = range(file.starts[segment], file.starts[segment + 1])
            coded = np.array([file.gpu.coded_frame(frame) for frame in frames])
            got = Passes(block, Source(file.gpu.segment(segment, level), coded)).vertices()
            yield got, np.array([file.decoded(frame, level) for frame in frames])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_the_vectors_of_the_format_are_shown_as_decoded():
    """Small plants that are as awkward as can be, of every feature; their sheets may have turned inside out."""
    shown = 0
    for path in sorted(VECTORS.glob("*.ath")):
        mesh = path.with_suffix(".mesh")
        if path.stem in BEYOND_FLOATS:
            continue
        file = Checked(path, np.fromfile(mesh, "<f4").reshape(-1, 3) if mesh.exists() else None)
        for got, wanted in shown_by_both(file):
            rest = file.gpu.core.level_rest(0, FILE_ORDER)
            sizes = [distance(x.min((0, 1)), x.max((0, 1))) for x in (wanted, rest[None])]
            if 1e-6 < min(sizes) <= max(sizes) < 1e9:  # not too small or large for squares of floats
                shown += 1
                allowed = max(SHARE_OF_BOUND * file.info.max_error, SHARE_OF_AWKWARD * sizes[0])
                assert distance(got, wanted) <= allowed, path.stem
    assert shown > 500


def test_damaged_files_are_refused_or_recorded():
    """Whatever an .ath holds, recording it takes no more memory than it said, and ends."""
    rng, recorded = np.random.default_rng(5), 0
    for name in ("joins-layers", "layers-ratio-1", "corrections-wide", "everything"):
        data = np.frombuffer((VECTORS / f"{name}.ath").read_bytes(), np.uint8)
        for _ in range(60):
            damaged = data.copy()
            at = rng.integers(len(data) // 3, len(data), 2)
            damaged[at] ^= rng.integers(1, 256, 2).astype(np.uint8)
            try:
                file = GpuFile(repaired(damaged.tobytes()))
                for level in range(file.core.info.level_count):
                    block, words = file.level(level), file.segment(0, level)
                    recorded += len(block) == block[0] and len(words) == words[0]
            except CoreError:
                continue
    assert recorded > 50


def test_the_files_have_all_that_is_tested(files):
    """Joins, corrections, nodes, and motion that is baked; vectors have learned bases and shapes."""
    seen = {"join_frames": 0, "corrected_count": 0, "baked": 0, "matrix_count": 0}
    for name in MAKERS:
        file = files(name)
        for level in range(file.info.level_count):
            of_level, of = (
                head(*pair) for pair in zip(blocks_of(file, level, file.info.segment_count - 1), (LEVEL, SEGMENT))
            )
            for key in ("join_frames", "corrected_count", "baked"):
                seen[key] += int(of[key])
            seen["matrix_count"] += int(of_level["matrix_count"])
    assert {key for key, count in seen.items() if not count} == set()


def test_bounds_hold_all_frames(files):
    for name in ("layers", "growth"):
        file = files(name)
        for level in range(file.info.level_count):
            low, high = file.gpu.bounds(file.prepared(0, level))
            shown = np.array([file.decoded(frame, level) for frame in range(file.starts[1])])
            assert (shown >= low).all() and (shown <= high).all()
            assert distance(low, shown.min((0, 1))) <= 1e-4 * distance(low, high)


def test_parents_are_placed_before_their_children(files):
    block = files("chain").gpu.level(files("chain").info.level_count - 1)
    of = head(block, LEVEL)
    bodies = section(block, of["bodies"], BODY, of["body_count"])
    order = section(block, of["order"], "<u4", of["body_count"])
    depths = section(block, of["depths"], "<u4", of["depth_count"] + 1)
    depth = np.empty(len(bodies), int)
    for d, (first, end) in enumerate(zip(depths[:-1], depths[1:], strict=True)):
        depth[order[first:end]] = d
    children = bodies["parent"] >= 0
    assert len(depths) > 12 and (depth[bodies["parent"][children]] < depth[children]).all()


def test_too_little_room_is_said_and_needs_no_more_memory(files):
    """A preparation with any room is safe, and says how much there has to be."""
    file = files("layers")
    level = file.info.level_count - 1
    needed = Room()
    assert file.gpu.recorded(0, level, needed) is None
    whole = file.gpu.recorded(0, level, Room.from_buffer_copy(needed))
    for name, _ in Room._fields_:
        less = Room.from_buffer_copy(needed)
        if getattr(less, name) == 0:
            continue
        setattr(less, name, getattr(less, name) - 1)
        assert file.gpu.recorded(0, level, less) is None
        assert bytes(less) == bytes(needed)
    assert (file.gpu.recorded(0, level, needed) == whole).all()


# ---- blending ----


@pytest.fixture(scope="module")
def winds(tmp_path_factory):
    """A leafed tree in three winds, with the edges of its faces and what the decoder blends."""
    path = tmp_path_factory.mktemp("winds") / "winds.ath"
    athcodec.encode(simulated(leaves=40), path, rel_error=1e-4, segment_frames=16)
    file = Checked(path)
    with athcodec.open(path) as decoder:
        place = file.gpu.core.vertex_places()
        order, faces = np.unique(place, return_index=True)[1], place[decoder.file.faces]
        file.edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        names = [clip.name for clip in decoder.file.clips]
        blends = lambda weights, second: decoder.blended(dict(zip(names, weights)), second)  # noqa: E731
        file.decoder_blends = lambda *asked: blends(*asked)[order] - np.array(file.info.origin)
        yield file


def sources_of(file: Checked, weights: list[float], second: float) -> list[tuple[int, int, float]]:
    """Segments, their frames and weights: clips of like lengths, at a time in each."""
    frame = 30 * second
    pairs = []
    for clip, weight in zip(file.gpu.core.clips(), weights, strict=True):
        first, part = clip.first_frame + int(frame), frame - int(frame)
        for at, share in ((first, 1 - part), (first + 1, part)):
            pairs.append((file.segment_of(at), file.gpu.coded_frame(at), weight * share))
    return [pair for pair in pairs if pair[2] > 0]


def blended_clips(file: Checked, level: int, weights: list[float], second: float) -> np.ndarray:
    """What the blocks show, (N, 3)."""
    found = sources_of(file, weights, second)
    sources = [Source(file.gpu.segment(s, level), np.array([frame]), np.array([w])) for s, frame, w in found]
    return Passes(file.gpu.level(level), *sources).vertices()[0]


@pytest.mark.parametrize("weights", [(0.5, 0.5, 0), (0, 0.5, 0.5), (0.2, 0.5, 0.3)])
def test_blended_clips_keep_edges_as_long_as_they_are_in_the_clips(winds, weights):
    """Within 1 %, leaves and bark. They are what the decoder blends: 99 % of the vertices within a thirtieth of how far
    the clips are apart, and all within a quarter, as a leaf that the clips turn far apart may go the other way."""
    level, edges = winds.info.level_count - 1, winds.edges
    length = lambda x: np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)  # noqa: E731
    alone = [blended_clips(winds, level, own, 0.55) for own in np.eye(3).tolist()]
    lengths = np.array([length(x) for x, weight in zip(alone, weights) if weight])
    blended = blended_clips(winds, level, weights, 0.55)
    rounding = 2 * winds.info.max_error
    assert (length(blended) <= 1.01 * lengths.max(0) + rounding).all()
    assert (length(blended) >= 0.99 * lengths.min(0) - rounding).all()
    apart = max(distance(a, b) for a in alone for b in alone)
    off = np.linalg.norm(blended - winds.decoder_blends(weights, 0.55), axis=1) / apart
    print(f"{weights}: {off.max():.3f} of the distance of the clips from what the decoder blends")
    assert off.max() <= 0.25 and np.quantile(off, 0.99) <= 1 / 30


# ---- in a browser ----


@pytest.fixture(scope="module")
def browser():
    with chromium(WEBGPU_FLAGS) as found:
        yield found


@pytest.fixture
def shaders(browser):
    """A function that runs the shaders on blocks: see gpu_check.html."""
    page, served = browser.new_page(), {}

    def serve(route):
        name = route.request.url.removeprefix(ADDRESS)
        here = Path(__file__).with_name(name) if name == "gpu_check.html" else SHADERS / name
        body = served[name] if name in served else here.read_bytes()
        kinds = {".mjs": "text/javascript", ".html": "text/html"}
        route.fulfill(body=body, content_type=kinds.get(Path(name).suffix, "application/octet-stream"))

    def run(level: np.ndarray, segments: list[np.ndarray], shows: list, corners: np.ndarray | None = None, **options):
        blocks = {f"block{i}": words.tobytes() for i, words in enumerate([level, *segments])}
        served.update(blocks | ({} if corners is None else {"corners": corners.tobytes()}))
        arguments = ["block0", list(blocks)[1:], shows, None if corners is None else "corners", options]
        results = page.evaluate("(arguments) => check(...arguments)", arguments)
        return [np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 3, 3) for text in results]

    page.route("**/*", serve)
    page.goto(ADDRESS + "gpu_check.html")
    page.wait_for_function("() => window.ready")
    yield run
    page.close()


def shows_of(file: Checked, count: int = 4) -> list[tuple[tuple[int, int], float]]:
    """Pairs of frames of a clip and the weight of the second: at frames and between, also where segments meet."""
    rng, frames = np.random.default_rng(1), file.info.frame_count
    firsts = [*(start - 1 for start in file.starts[1:-1]), *rng.integers(0, frames - 1, count).tolist()]
    clips = file.gpu.core.clips()
    last = {clip.first_frame + clip.frame_count - 1 for clip in clips}
    return [
        ((first, first + 1), 0.0 if i == 0 else float(rng.random()))
        for i, first in enumerate(firsts)
        if first not in last
    ]


def blended(file: Checked, level: int, show) -> np.ndarray:
    (first, second), weight = show
    a, b = file.decoded(first, level), file.decoded(second, level)
    return a + (b - a) * weight


@pytest.mark.browser
@pytest.mark.parametrize("name", MAKERS)
def test_the_shaders_show_what_the_decoder_does(files, shaders, name):
    file = files(name)
    tolerance, shows = file.tolerance(), shows_of(file)
    for level in range(file.info.level_count):
        segments = [file.gpu.segment(segment, level) for segment in range(file.info.segment_count)]
        place = lambda frame: [[file.segment_of(frame), file.gpu.coded_frame(frame), 1.0]]  # noqa: E731
        asked = []
        for show, before in zip(shows, [*shows[1:], shows[0]], strict=True):
            asked.append([[place(frame) for frame in show[0] + before[0]], [show[1], before[1]]])
        got = shaders(file.gpu.level(level), segments, asked)
        wanted = np.array([blended(file, level, show) for show in shows])
        off = max(distance(own[:, 0], x) for own, x in zip(got, wanted, strict=True))
        off_before = max(distance(own[:, 2], x) for own, x in zip(got, np.roll(wanted, -1, axis=0), strict=True))
        print(f"{name}, level {level}: {off / tolerance:.3f} of what is allowed, {tolerance:.2e}")
        assert max(off, off_before) <= tolerance


@pytest.mark.browser
def test_the_shaders_blend_clips_as_the_blocks_say(winds, shaders):
    for level in range(winds.info.level_count):
        segments = [winds.gpu.segment(segment, level) for segment in range(winds.info.segment_count)]
        times = [((0.2, 0.5, 0.3), 0.55), ((0, 0, 1), 0.55), ((0.5, 0.5, 0), 0.1), ((0, 0.7, 0.3), 0.7)]
        asked = [sources_of(winds, *time) for time in times]
        got = shaders(winds.gpu.level(level), segments, [[asked, [0.0, 0.0]]])[0]
        for column, time in ((0, times[0]), (2, times[2])):
            assert distance(got[:, column], blended_clips(winds, level, *time)) <= winds.tolerance()


@pytest.mark.browser
def test_more_workgroups_than_go_side_by_side_do_all_the_work(files, shaders):
    file = files("layers")
    level = file.info.level_count - 1
    place = [[0, file.gpu.coded_frame(2), 1.0]]
    asked = file.gpu.level(level), [file.gpu.segment(0, level)], [[[place] * 4, [0.0, 0.0]]]
    assert head(asked[0], LEVEL)["body_count"] > 21
    (rows,), (row,) = (shaders(*asked, **options) for options in ({"across": 7}, {}))
    assert np.array_equal(rows, row) and distance(rows[:, 0], file.decoded(2, level)) <= file.tolerance()


@pytest.mark.browser
def test_normals_are_those_of_the_moved_triangles(files, shaders):
    file = files("leaves")
    level, frame, vertices = file.info.level_count - 1, 5, file.info.vertex_count
    triangles = np.arange(vertices - 12)[:, None] + [0, 1, 2]
    corners = corners_of(triangles, vertices)
    segment, shown = file.segment_of(frame), [[[[[0, frame, 1.0]]] * 4, [0.0, 0.0]]]
    got = shaders(file.gpu.level(level), [file.gpu.segment(segment, level)], shown, corners)[0][:, 1]
    x = file.decoded(frame, level)
    a, b, c = (x[triangles[:, k]] for k in range(3))
    cross, sides = np.cross(b - a, c - a), np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    sums, sizes = np.zeros_like(x), np.zeros(vertices)
    for k in range(3):
        np.add.at(sums, triangles[:, k], cross)
        np.add.at(sizes, triangles[:, k], sides)
    length = np.linalg.norm(sums, axis=1)
    known = length > 0.1 * sizes  # no slivers
    assert known.sum() > vertices / 4
    assert np.abs(got[known] - sums[known] / length[known, None]).max() < 1e-3
    assert not got[-10:].any()  # of no triangle
