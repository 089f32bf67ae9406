"""What a decoder gives: levels with the errors it announces, maps that hang together, no needless reading."""

from __future__ import annotations

import json
import struct
import time
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from itertools import groupby

import numpy as np
import pytest
from files import Parts, coded, opened, roots, still_file
from hypothesis import given, settings
from plants import STEADY, awkward_plants, chain_plant, plant, tube

import athcodec
from athcodec import Thresholds
from athcodec._native import LOOSE
from athcodec.decoding import container as ct
from athcodec.decoding import core_file
from athcodec.encoding.model.motion import Plan
from athcodec.encoding.streams import streams, writing
from athcodec.errors import BadChunk, FormatError, LevelUnavailable
from athcodec.motion.hierarchy import branches_from_edges


@pytest.fixture(scope="module")
def plants(sample_ath, sample_positions, bushy_ath, bushy_clip, layered_ath, tmp_path_factory):
    """{name: (file, source positions)} of several segments and levels."""
    folder = tmp_path_factory.mktemp("plants")
    made = {"sample": (sample_ath, sample_positions), "bushy": (bushy_ath, bushy_clip.positions)}
    made["layers"] = layered_ath, bushy_clip.positions
    for name, clip, more in (
        ("chain", chain_plant(12, 5, frames=40), {"tam": Thresholds(0, 0, 0, 0)}),
        ("tube", tube(60, 12, 40), {}),
        ("half accepted", plant(seed=12, branches=40, frames=40, rough=0.0), {"tam": Thresholds(0.25, 0, 0.8, 0)}),
    ):
        path = folder / f"{name}.ath"
        athcodec.encode(clip, path, rel_error=1e-4, segment_frames=16, effort="fast", ladder="none", **more)
        made[name] = path, clip.positions
    return made


SHARED = ct.SHAPES, ct.REFINED_REST
"""Kinds of chunks of segment 0 that serve all segments."""
NAMES = ["sample", "bushy", "layers", "chain", "tube", "half accepted"]


@pytest.fixture(params=NAMES)
def played(request, plants):
    """(decoder, source positions)"""
    path, source = plants[request.param]
    with athcodec.open(path, strict=True) as decoder:
        yield decoder, source.astype(np.float64)


def size_of(source: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(source.reshape(-1, 3), axis=0)))


def base_pose(decoder, level: int = 0) -> np.ndarray:
    """(N, 3) the rest pose of a level in file order, before it is rounded to the source's type."""
    return decoder.level_rest(level)[decoder.file.hierarchy.vertex_source]


def applied(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ np.swapaxes(matrices[..., :3], -1, -2) + matrices[..., None, :, 3]


def shown_frames(decoder) -> list[int]:
    """A frame or two of each segment."""
    return sorted({frame for start, stop in decoder.segments for frame in (start, stop - 1)})[:5]


# ---- levels ----


def test_the_errors_in_the_table_are_those_of_stopping_there(played):
    decoder, source = played
    assert len(decoder.segments) > 1 and len(decoder.levels) == decoder.file.level_count
    rounding = 1e-6 * size_of(source)
    for level in decoder.levels:
        distance = np.linalg.norm(decoder.positions(level=level.level) - source, axis=2)
        found = distance.max(), np.sqrt((distance**2).mean())
        for error, announced in zip(found, (level.max_error, level.rms_error)):
            assert error <= announced * (1 + 1e-6), "an announced error is never too small"
            assert error >= announced * (1 - 1 / 32) - rounding
        assert (distance > level.p99_error + rounding).mean() <= 0.01


def test_the_table_holds_the_errors_of_each_segment(played):
    decoder, source = played
    for segment, (start, stop) in enumerate(decoder.segments):
        for level in range(decoder.file.level_count):
            distance = np.linalg.norm(decoder.positions(slice(start, stop), level) - source[start:stop], axis=2)
            largest, p99, rms = decoder.file.errors[level, segment]
            assert distance.max() <= largest and np.sqrt((distance**2).mean()) == pytest.approx(rms, rel=0.04, abs=1e-6)
            at_most = np.sort(distance, axis=None)[-1 - distance.size // 100]
            assert at_most <= p99 * (1 + 1e-6) and at_most == pytest.approx(p99, rel=0.04, abs=1e-6), (
                "the smallest distance that at most 1 % of them exceed"
            )


def test_a_distance_asks_for_a_level_by_the_measure_that_is_named(plants):
    with athcodec.open(plants["sample"][0]) as decoder:
        for measure in ("max", "p99", "rms"):
            errors = [getattr(level, f"{measure}_error") for level in decoder.levels]
            far = errors[1] * 1080 / (2 * np.tan(0.5)) * (1 + 1e-9)
            assert decoder.level_for(far, 1.0, 1080.0, measure=measure) == 1 or errors[1] == errors[0]
        assert decoder.level_for(far, 1.0, 1080.0) == decoder.level_for(far, 1.0, 1080.0, measure="max") > 1
        with pytest.raises(ValueError, match="got 'mean'; expected one of max, p99, rms"):
            decoder.level_for(1.0, 1.0, 1080.0, measure="mean")


@pytest.mark.parametrize("name", ["sample", "bushy", "half accepted"])
def test_deeper_levels_cost_more_bytes_and_show_more_parts_with_less_error(name, plants):
    with athcodec.open(plants[name][0]) as decoder:
        levels = decoder.levels
    assert len(levels) >= 3
    for coarse, fine in zip(levels, levels[1:]):
        assert fine.bytes > coarse.bytes and fine.nodes >= coarse.nodes
        assert fine.rms_error <= coarse.rms_error
    assert levels[0].rms_error > 10 * levels[-1].rms_error


@pytest.mark.parametrize("name", ["sample", "half accepted"])
def test_level_0_of_a_plant_on_one_root_is_one_affine_map_per_frame(name, plants):
    path, source = plants[name]
    with athcodec.open(path) as decoder:
        pose = base_pose(decoder)[np.argsort(decoder.file.hierarchy.vertex_source)]
        assert decoder.levels[0].nodes == 1
        for frame in shown_frames(decoder):
            shown = decoder.positions(frame, 0).astype(np.float64)
            homogeneous = np.column_stack([pose - pose.mean(axis=0), np.ones(len(pose))])
            fit, *_ = np.linalg.lstsq(homogeneous, shown)
            assert np.abs(homogeneous @ fit - shown).max() < 1e-6 * size_of(source)


@pytest.mark.parametrize("name", NAMES)
def test_stems_above_a_level_have_their_final_shape_but_for_corrections_and_joins(name, plants):
    parts = Parts.of(plants[name][0].read_bytes())
    parts.header.joins = None
    bare = opened(parts.without(ct.CORRECTIONS), strict=True)
    with opened(parts.file(), strict=True) as decoder:
        last, order = decoder.file.core.info.depth_levels - 1, decoder.file.hierarchy.vertex_source
        assert any(chunk.kind == ct.CORRECTIONS for chunk, _ in parts.chunks)
        assert not np.array_equal(bare.positions(), decoder.positions())
        branch = decoder.file.hierarchy.vertex_branch()
        pieces, stages = (
            Plan(decoder.file.tables.branches, decoder.file.vertex_count).pieces,
            decoder.file.tables.header.stages,
        )
        last -= stages[last] > pieces["stage"].max()  # A refinement shows other stems.
        final = bare.positions(level=last)[:, order]
        for level in range(1, last):
            exact = np.isin(branch, pieces["branch"][pieces["stage"] <= stages[level]])
            shown = decoder.affines(0, level)
            assert np.array_equal(exact, np.repeat(shown.is_stem, shown.vertex_count))
            positions = decoder.positions(level=level)[:, order]
            assert exact.any() and np.array_equal(positions[:, exact], final[:, exact])


# ---- maps ----


def test_the_parts_of_a_level_share_out_the_vertices(played):
    decoder, _ = played
    for level in decoder.levels:
        parts = decoder.affines(0, level.level)
        assert len(parts.matrices) == len(parts.branch) == level.nodes
        stops = parts.first_vertex + parts.vertex_count
        assert parts.first_vertex[0] == 0 and stops[-1] == decoder.file.vertex_count
        assert np.array_equal(parts.first_vertex[1:], stops[:-1]) and (parts.vertex_count > 0).all()
        first_of_part = decoder.file.hierarchy.vertex_source[parts.first_vertex]
        assert np.array_equal(decoder.file.vertex_branch[first_of_part], parts.branch)
    assert parts.is_stem.all() and len(parts.branch) == decoder.file.branch_count


def assert_maps_hang_together(decoder, frame: int, level: int, most: float) -> tuple[int, int]:
    """Maps give the positions of parts that move as one, hold these to their parents' stems, and with residuals give
    the full positions. Return the numbers of such vertices and of such parts."""
    hierarchy, pose, parts = decoder.file.hierarchy, base_pose(decoder, level), decoder.affines(frame, level)
    order = hierarchy.vertex_source
    shown, full = (decoder.positions(frame, at, np.float64)[order] for at in (level, None))
    matrices, as_one = (np.repeat(values, parts.vertex_count, axis=0) for values in (parts.matrices, ~parts.is_stem))
    assert np.abs(applied(matrices, pose[:, None])[:, 0] - shown)[as_one].max(initial=0) < most
    residual = decoder.residual(frame, level)[order]
    assert np.abs(applied(matrices, residual[:, None])[:, 0] - full).max() < most
    branch = hierarchy.vertex_branch()[parts.first_vertex]
    loose = decoder.file.tables.branches["flags"][branch] & LOOSE > 0
    hung = ~parts.is_stem & (hierarchy.attach[branch] >= 0) & ~loose
    attach = hierarchy.attach[branch][hung]
    placed = applied(parts.matrices[hung], pose[attach, None])[:, 0]
    assert np.abs(placed - shown[attach]).max(initial=0) < most
    return int(as_one.sum()), int(hung.sum())


def test_maps_hang_together(played):
    decoder, source = played
    assert not (decoder.file.tables.branches["flags"] & LOOSE).any()
    attached = 0
    for level in range(decoder.file.level_count):
        for frame in shown_frames(decoder):
            as_one, hung = assert_maps_hang_together(decoder, frame, level, 1e-6 * size_of(source))
            assert as_one or level >= decoder.file.core.info.depth_levels - 1
            attached += hung
    assert attached > 0 or decoder.file.branch_count == 1


# ---- frames ----


def test_any_frames_alone_equal_those_of_the_whole(played):
    decoder, _ = played
    count = decoder.frame_count
    for level in (0, decoder.file.level_count - 1):
        whole = decoder.positions(level=level)
        boundary = decoder.segments[1][0]
        for chosen in (slice(boundary - 2, boundary + 3), slice(boundary, None), slice(-3, None), slice(5, 5)):
            assert np.array_equal(decoder.positions(chosen, level), whole[chosen])
        for frame in (0, boundary - 1, boundary, count - 1, -1, -count, np.int64(3)):
            assert np.array_equal(decoder.positions(frame, level), whole[frame])


@pytest.mark.parametrize("number", [1.5, 1.0, np.float64(1.0)])
def test_a_number_that_is_not_whole_names_no_frame_level_or_vertex(number, bushy_ath, bushy_clip, tmp_path):
    with athcodec.open(bushy_ath) as decoder:
        view = athcodec.ClipView(decoder)
        for call in (
            lambda: decoder.positions(number),
            lambda: decoder.positions(0, number),
            lambda: decoder.positions(slice(0, number)),
            lambda: list(decoder.blocks(frames=number)),
            lambda: decoder.affines(number),
            lambda: decoder.blended({"": 1.0}, 0.0, number),
            lambda: decoder.file.available(number),
            lambda: athcodec.ClipView(decoder, number),
            lambda: view.block(0, number),
            lambda: view.affines(number),
            lambda: bushy_clip.block(0, number),
            lambda: athcodec.truncate(bushy_ath, tmp_path / "a.ath", number),
            lambda: athcodec.looped(bushy_clip, number),
            lambda: athcodec.find_branches(bushy_clip, root=number),
            lambda: branches_from_edges(np.array([[0, 1], [1, 2]]), 3, np.eye(3), [number]),
            lambda: athcodec.encode(bushy_clip, tmp_path / "a.ath", segment_frames=number + 30),
            lambda: athcodec.write(view, tmp_path / "a.glb", rig=number),
            lambda: Thresholds(1.0, number, 1.0, 1),
        ):
            with pytest.raises(TypeError):
                call()
        assert list(tmp_path.iterdir()) == []
        with pytest.raises(TypeError, match=r"frame: got 3\.5, expected a whole number"):
            decoder.positions(3.5)
        expected = decoder.positions(3, 1)
        for kind in (np.int64, np.uint8, np.int32):
            assert np.array_equal(decoder.positions(kind(3), kind(1)), expected)


@pytest.mark.parametrize("segment_frames", [40, 120])
def test_all_frames_at_once_are_those_of_frame_after_frame_and_the_callers_own(segment_frames, tmp_path):
    """They need no memory but their own where the order of the file is the source's, as the sample's is."""
    with athcodec.read_hdf5(athcodec.sample_path()) as clip:
        athcodec.encode(clip, tmp_path / "sample.ath", rel_error=1e-3, segment_frames=segment_frames, effort="fast")
    with athcodec.open(tmp_path / "sample.ath") as once, athcodec.open(tmp_path / "sample.ath") as in_turn:
        frames = np.stack([in_turn.positions(t) for t in range(in_turn.frame_count)])
        for _ in range(2):
            whole = once.positions()
            assert np.array_equal(whole, frames)
            whole[:] = np.nan
            assert np.array_equal(once.positions(50), frames[50])
        blocks = [block for _, block in once.blocks()]
        blocks_then = np.concatenate(blocks)
        for block in blocks:
            block[:] = np.nan
        assert np.array_equal(blocks_then, frames) and np.array_equal(once.positions(119), frames[119])
        assert np.array_equal(once.positions(level=0), in_turn.positions(level=0))


def test_blocks_are_the_motion_in_order(bushy_ath):
    with athcodec.open(bushy_ath) as decoder:
        blocks = list(decoder.blocks(level=2))
        assert [start for start, _ in blocks] == [start for start, _ in decoder.segments]
        assert np.array_equal(np.concatenate([block for _, block in blocks]), decoder.positions(level=2))
        start, block = next(decoder.blocks(frames=slice(14, 20)))
        assert start == 14 and np.array_equal(block, decoder.positions(slice(14, 20)))


class Recorder(BytesIO):
    """A file that remembers which byte ranges were read."""

    def __init__(self, data: bytes):
        super().__init__(data)
        self.ranges: list[tuple[int, int]] = []

    def read(self, size=-1):
        start = self.tell()
        data = super().read(size)
        self.ranges.append((start, start + len(data)))
        return data


@pytest.mark.parametrize("level", [0, 1, 2, 6])
def test_a_frame_at_a_level_reads_only_that_segment_and_the_levels_up_to_it(level, plants):
    for name in NAMES:
        file = Recorder(plants[name][0].read_bytes())
        decoder = athcodec.open(file)
        if level >= decoder.file.level_count:
            continue
        prelude = decoder.file.prelude_length
        assert all(stop <= prelude for _, stop in file.ranges), "opening reads the prelude alone"
        file.ranges.clear()
        before = decoder.file.bytes_read
        start, _ = decoder.segments[1]
        decoder.positions(start, level)
        motion = [c for c in decoder.file.chunks if c.is_motion and c.level <= level]
        allowed = {c for c in motion if c.segment == 1 or c.kind in SHARED}
        needed = {c for c in allowed if c.length and (c.kind == ct.STEMS or c.level == level)}
        if decoder.file.joins[level, 1]:
            allowed |= {c for c in motion if c.segment == 0 and c.kind in (ct.STEMS, ct.AFFINES)}
        read = chunks_read(file, decoder)
        assert needed and needed <= read <= allowed
        assert decoder.file.bytes_read - before == sum(chunk.length for chunk in read)


def chunks_read(file: Recorder, decoder) -> set:
    """Those whose bytes were all read, each once, where nothing else was read."""
    times = np.zeros(decoder.file.file_length, int)
    for start, stop in file.ranges:
        times[start:stop] += 1
    read = {c for c in decoder.file.chunks if c.length and times[c.offset : c.offset + c.length].any()}
    expected = np.zeros(decoder.file.file_length, int)
    for chunk in read:
        expected[chunk.offset : chunk.offset + chunk.length] = 1
    assert np.array_equal(times, expected)
    return read


def test_the_frames_of_a_segment_in_turn_read_and_decode_it_once(played, monkeypatch):
    """Forwards, backwards, as maps, in any type of numbers; another segment, or level, is prepared anew."""
    decoder, _ = played
    prepared = []
    prepare = core_file.File.prepare

    def counted(file, work, segment, level, *memory, **options):
        prepared.append((segment, level))
        prepare(file, work, segment, level, *memory, **options)

    monkeypatch.setattr(core_file.File, "prepare", counted)
    (first, stop), last = decoder.segments[1], decoder.file.level_count - 1
    decoder.positions(first, last)
    before = decoder.file.bytes_read
    for frame in (*range(first, stop), *reversed(range(first, stop))):
        decoder.positions(frame, last)
        decoder.positions(frame, last, np.float64)
    decoder.positions(slice(first, stop), last)
    decoder.affines(first, last)
    list(decoder.blocks(last, frames=slice(first, stop)))
    assert prepared == [(1, last)] and decoder.file.bytes_read == before
    decoder.positions(0, last)
    decoder.positions(first, 0)
    decoder.positions(stop - 1, last)
    asked = [(1, last), (0, last), (1, 0), (1, last)]
    assert prepared == [part for part, _ in groupby(asked)] and decoder.file.bytes_read > before


def test_several_threads_at_once_see_what_one_alone_does(played):
    decoder, _ = played
    alone = [decoder.positions(level=level) for level in range(decoder.file.level_count)]
    maps = [decoder.affines(5, level).matrices for level in range(decoder.file.level_count)]

    def watch(seed: int) -> int:
        """Frames, runs of frames and maps of any level, at random; how many were looked at."""
        rng = np.random.default_rng(seed)
        for _ in range(40):
            level, frame = int(rng.integers(decoder.file.level_count)), int(rng.integers(decoder.frame_count))
            run = slice(frame, frame + int(rng.integers(1, 20)))
            assert np.array_equal(decoder.positions(frame, level), alone[level][frame])
            assert np.array_equal(decoder.positions(run, level), alone[level][run])
            assert np.array_equal(decoder.affines(5, level).matrices, maps[level])
        return 40

    with ThreadPoolExecutor(6) as threads:
        assert list(threads.map(watch, range(6))) == [40] * 6


class Sluggish(BytesIO):
    """A file that lets other threads in between a seek and the read that it is for."""

    def seek(self, *place):
        result = super().seek(*place)
        time.sleep(1e-5)
        return result


def test_static_data_can_be_read_and_checked_while_other_threads_watch(full_clip, full_ath):
    decoder = athcodec.open(Sluggish(full_ath.read_bytes()))
    frames = decoder.positions()

    def watch(seed: int) -> None:
        for frame in np.random.default_rng(seed).integers(decoder.frame_count, size=100):
            assert np.array_equal(decoder.positions(frame), frames[frame])

    def read(_) -> None:
        for _ in range(10):
            decoder.file.check()
            for name in ("attributes", "metadata", "faces", "edges"):
                vars(decoder.file.static).pop(name)  # remembered otherwise
            assert np.array_equal(decoder.file.attributes["radius"], full_clip.attributes["radius"])
            assert decoder.metadata.items() >= full_clip.metadata.items()

    with ThreadPoolExecutor(3) as threads:
        for done in [threads.submit(do, seed) for seed, do in enumerate((watch, read, watch))]:
            done.result()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_positions_of_another_type_are_the_files_own_in_that_type(dtype, tmp_path):
    with coded(plant(seed=3, branches=8, frames=12, dtype=dtype), tmp_path / "p.ath", effort="fast") as decoder:
        for level in range(decoder.file.level_count):
            own = decoder.positions(level=level)
            assert own.dtype == decoder.file.dtype == dtype
            for other in (np.float16, np.float32, np.float64, ">f4", ">f8"):
                shown = decoder.positions(level=level, dtype=other)
                assert shown.dtype == np.dtype(other) and np.array_equal(shown, own.astype(other))


def test_attributes_are_read_when_asked_for(full_ath):
    with athcodec.open(full_ath) as decoder:
        decoder.positions()
        before = decoder.file.bytes_read
        assert set(decoder.file.attributes) == {"radius", "species"}
        assert decoder.file.bytes_read > before


NOT_THERE = {
    "frame beyond": lambda d: d.positions(50),
    "frame before": lambda d: d.positions(-51),
    "blocks of every other frame": lambda d: list(d.blocks(frames=slice(0, 9, 2))),
    "level beyond": lambda d: d.positions(0, 6),
    "level before": lambda d: d.positions(0, -1),
    "maps of a frame beyond": lambda d: d.affines(50),
    "maps of a level beyond": lambda d: d.affines(0, 6),
}


@pytest.mark.parametrize("ask", NOT_THERE.values(), ids=NOT_THERE)
def test_what_is_not_in_the_file_is_refused_with_the_range(ask, bushy_ath):
    with athcodec.open(bushy_ath) as decoder:
        with pytest.raises(LevelUnavailable, match="expected") as caught:
            ask(decoder)
        assert "\n" not in str(caught.value)


# ---- the object ----


def test_a_path_is_closed_again_and_a_file_object_is_left_open(bushy_ath):
    with athcodec.open(bushy_ath) as decoder:
        own = decoder.file.source
    with open(bushy_ath, "rb") as file:
        with athcodec.open(file) as decoder:
            decoder.positions(0)
        assert own.closed and not file.closed


def test_a_file_that_cannot_be_opened_as_ath_is_closed(tmp_path):
    (tmp_path / "no.ath").write_bytes(b"nothing of the sort")
    with pytest.raises(FormatError):
        athcodec.open(tmp_path / "no.ath")  # an open file would warn, and warnings are errors here


def test_info_is_json_and_agrees_with_the_summary(bushy_clip, tmp_path):
    summary = athcodec.encode(bushy_clip, tmp_path / "b.ath", rel_error=1e-3, segment_frames=16, effort="fast")
    with athcodec.open(summary.path) as decoder:
        info = json.loads(json.dumps(decoder.file.info(), allow_nan=False))
        assert decoder.file.table1() == summary.table1
    assert info["vertices"] == bushy_clip.vertex_count and info["frames"] == 50 and info["segments"] == 4
    assert info["bytes"] == info["available_bytes"] == summary.bytes == summary.path.stat().st_size
    assert info["complete"] and info["max_error_bound"] == summary.max_error_bound
    assert [d["bytes"] for d in info["levels"]] == [d.bytes for d in summary.levels]
    assert sum(summary.chunk_bytes.values()) == summary.bytes


def test_the_table_of_the_ath_is_that_of_the_analysis(bushy_clip, bushy_ath):
    with athcodec.open(bushy_ath) as decoder:
        bound = decoder.file.max_error_bound
        expected = athcodec.build_ath(bushy_clip, bound, 0, bound, 0).table1()
        assert decoder.file.table1().items() <= expected.items()


def test_one_frame_has_no_frame_rate(tmp_path):
    with coded(plant(frames=1), tmp_path / "one.ath", effort="fast") as decoder:
        assert decoder.fps == 0.0 and decoder.positions().shape[0] == 1


def test_allow_partial_changes_nothing_about_an_intact_file(bushy_ath):
    with athcodec.open(bushy_ath) as plain, athcodec.open(bushy_ath, allow_partial=True) as partial:
        assert partial.file.complete and partial.file.missing == "" and partial.file.deepest == plain.file.deepest
        assert np.array_equal(partial.positions(), plain.positions())
        plain.file.check()
        partial.file.check()


@settings(STEADY, max_examples=30)
@given(awkward_plants(dtype=np.float64, frames=18, offset=0.0))
def test_maps_hang_together_on_degenerate_plants(scratch, clip):
    size = size_of(clip.positions) or 1.0
    with coded(clip, scratch / "maps.ath", max_error=1e-3 * size, segment_frames=16, effort="fast") as decoder:
        for level in range(decoder.file.level_count):
            assert len(decoder.affines(17, level).branch) == decoder.levels[level].nodes
            assert_maps_hang_together(decoder, 17, level, 1e-9 * size)


@pytest.mark.parametrize("clip", [tube(8, 6, 3), plant(3, branches=6, frames=3)], ids=["one solid stem", "thin stems"])
def test_infinite_positions_have_no_matrices_whatever_the_shape_of_the_plant(clip, tmp_path):
    athcodec.encode(clip, tmp_path / "a.ath", effort="fast", tam=Thresholds(0, 0, 0, 0), ladder="none")
    parts = Parts.of((tmp_path / "a.ath").read_bytes())
    level = max(chunk.level for chunk, _ in parts.chunks if chunk.kind == ct.STEMS)
    largest = struct.pack("<f", 1e38) + parts.payload(ct.STEMS, level)[4:]
    decoder = opened(parts.with_payload(ct.STEMS, largest, level))
    assert np.isinf(decoder.positions(0)).any()
    for ask in (decoder.affines, decoder.residual):
        with pytest.raises(BadChunk, match="frame 0: got positions"):
            ask(0)


def test_a_rest_pose_beyond_float32_is_infinite_without_a_warning():
    most = float(np.finfo(np.float32).max)
    head = writing.Rest(np.array([most, -most, 0.0]), most, np.dtype(np.float32))
    head.stream = streams.encode_rest(roots(1), 1.0, np.array([[2.5, -2.5, 0.0]])).stream
    with opened(still_file(rest=writing.pack_rest(head))) as decoder:
        assert decoder.file.rest.tolist() == [[np.inf, -np.inf, 0.0]]
