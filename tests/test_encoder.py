"""How encoding behaves: sizes that were asked for, refusals, files that appear whole or not at all, and memory."""

from __future__ import annotations

import dataclasses
import gc
import sys
import tracemalloc

import h5py
import numpy as np
import pytest
from files import coded
from plants import chain_plant, clip_of, plant
from programs import peak_of

import athcodec
from athcodec import MotionClip, encoding
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.container import MAGIC, Limits
from athcodec.encoding.clip.coded_clip import CodedClip
from athcodec.encoding.clip.places import PlacedClip
from athcodec.encoding.model.motion import Plan, SegmentMotion
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.preparation import surveyed
from athcodec.encoding.search.progress import silent
from athcodec.encoding.search.search import Search
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.segment import Source
from athcodec.encoding.segments.segmentation import decoding_bytes, split_segments
from athcodec.errors import BoundError, ClipError
from athcodec.motion import clip as clip_module
from bench.scenes import fields

OLDER = MAGIC + b"older"


@pytest.fixture
def small():
    return plant(seed=1, branches=5, longest=4, frames=40)


# ---- bounds and sizes ----


@pytest.mark.parametrize("target", [5_000, 10_000, 20_000])
def test_a_target_size_is_met_from_below_and_used(target, sample_clip, tmp_path):
    clip = sample_clip.replace(positions=sample_clip.block(0, 40), time=sample_clip.time[:40])
    summary = athcodec.encode(clip, tmp_path / "s.ath", target_size=target, effort="fast")
    assert 0.85 * target <= summary.bytes <= target
    assert summary.bytes == summary.path.stat().st_size
    with athcodec.open(summary.path, strict=True) as decoder:
        error = np.linalg.norm(decoder.positions() - clip.positions.astype(np.float64), axis=2).max()
    assert error <= summary.max_error_bound


def test_a_target_size_that_no_bound_reaches_is_refused_with_the_least_size(small, tmp_path):
    with pytest.raises(BoundError, match=r"got 100 bytes; expected at least (\d+)") as caught:
        athcodec.encode(small, tmp_path / "s.ath", target_size=100, effort="fast")
    least = int(str(caught.value).split("at least ")[1].split()[0])
    assert 100 < least < 5000
    assert athcodec.encode(small, tmp_path / "s.ath", target_size=least, effort="fast").bytes <= least


@pytest.mark.parametrize("too_large", [1.002, 1e9])
@pytest.mark.parametrize("fits_from", [2e-7, 1e-3, 0.09])
def test_a_target_size_is_looked_for_with_a_counted_number_of_files(too_large, fits_from, small):
    """Where files shrink to just above the target and then jump below it, the next bound was a few per cent away."""
    source, tried = surveyed(PlacedClip.of(small), None, EncodingOptions(), silent), []

    def file_size(bound):
        tried.append(bound)
        return 1000 * too_large if bound < fits_from * source.seen.diagonal else 500

    found = BoundOption(target_size=1000).in_scene_units(source, file_size)
    assert len(tried) <= 30 and fits_from <= found / source.seen.diagonal <= 1.02 * fits_from


def test_a_generous_target_size_gives_a_fine_file(small, tmp_path):
    summary = athcodec.encode(small, tmp_path / "s.ath", target_size=10**7, effort="fast")
    assert summary.bytes < 10**5 and summary.relative_bound < 1e-5


@pytest.mark.parametrize("place", [0.0, 1e6])
def test_a_target_size_works_where_nothing_has_any_extent(place, tmp_path):
    clip = clip_of(np.full((5, 3, 3), place), np.full((3, 3), place), [0, 0, 0], [-1])
    assert athcodec.encode(clip, tmp_path / "s.ath", target_size=5000, effort="fast").bytes <= 5000


def test_the_default_bound_is_a_ten_thousandth_of_the_diagonal(small, tmp_path):
    summary = athcodec.encode(small, tmp_path / "s.ath", effort="fast")
    box = np.ptp(small.positions.reshape(-1, 3).astype(float), axis=0)
    assert summary.relative_bound == pytest.approx(1e-4)
    assert summary.max_error_bound == pytest.approx(1e-4 * np.linalg.norm(box))


def test_a_bound_in_scene_units_is_taken_as_it_is(small, tmp_path):
    assert athcodec.encode(small, tmp_path / "s.ath", max_error=0.0123, effort="fast").max_error_bound == 0.0123


def test_a_looser_bound_gives_a_smaller_file(sample_clip):
    clip = sample_clip.replace(positions=sample_clip.block(0, 40), time=sample_clip.time[:40])
    sizes = [len(athcodec.encode(clip, effort="fast", rel_error=r)) for r in (1e-5, 1e-4, 1e-3, 1e-2)]
    assert sizes == sorted(sizes, reverse=True) and sizes[0] > 4 * sizes[-1]


def test_the_sample_is_coded_in_a_fiftieth_of_its_size(sample_clip, tmp_path):
    assert athcodec.encode(sample_clip, tmp_path / "s.ath", effort="fast").ratio > 50


@pytest.mark.parametrize("ladder, most", [("none", 140), ("decades", 190)])
def test_what_stands_in_front_of_the_chunks_of_a_small_file_is_small(ladder, most, sample_clip, tmp_path):
    with coded(sample_clip, tmp_path / "out.ath", ladder=ladder, effort="fast") as decoder:
        chunks = decoder.file.chunks
    assert chunks[0].offset < most
    assert chunks[0].offset < 60 + 9 * len(chunks), "of each chunk and its share of the errors"


@pytest.mark.parametrize(
    "dtype, offset, bound", [(np.float32, 1e6, 1e-3), (np.float64, 1e6, 1e-12), (np.float32, 0.0, 1e-9)]
)
def test_a_bound_finer_than_the_sources_numbers_is_refused_with_the_least_possible(dtype, offset, bound, tmp_path):
    clip = plant(seed=1, branches=3, frames=16, dtype=dtype, offset=offset)
    with pytest.raises(BoundError, match=rf"expected at least .* spacing of the source's {np.dtype(dtype).name}"):
        athcodec.encode(clip, tmp_path / "s.ath", max_error=bound, effort="fast")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "options, error, message",
    [
        ({"max_error": 1.0, "rel_error": 1e-3}, ValueError, "max_error and rel_error; expected one"),
        ({"rel_error": 1e-3, "target_size": 10}, ValueError, "rel_error and target_size; expected one"),
        ({"max_error": 0.0}, BoundError, "max_error: got 0.0"),
        ({"max_error": -1.0}, BoundError, "max_error: got -1.0"),
        ({"max_error": float("nan")}, BoundError, "max_error: got nan"),
        ({"rel_error": float("inf")}, BoundError, "rel_error: got inf"),
        ({"rel_error": 0}, BoundError, "rel_error: got 0"),
        ({"target_size": 0}, BoundError, "target_size: got 0"),
        ({"segment_frames": 15}, ValueError, "segment_frames: got 15; expected 16 to 256"),
        ({"segment_frames": 257}, ValueError, "segment_frames: got 257; expected 16 to 256"),
        ({"attributes": "some"}, ValueError, "attributes: got 'some'"),
        ({"effort": "heroic"}, ValueError, "effort: got 'heroic'; expected one of fast, default, best"),
    ],
)
def test_options_out_of_range_are_refused_by_name(options, error, message, small, tmp_path):
    with pytest.raises(error, match=message):
        athcodec.encode(small, tmp_path / "s.ath", **options)
    assert not list(tmp_path.iterdir())


def test_coordinates_beyond_what_a_file_can_hold_are_refused_and_leave_nothing(tmp_path):
    clip = plant(seed=1, branches=3, frames=16, dtype=np.float64, scale=1e100)
    with pytest.raises((ClipError, BoundError)):
        athcodec.encode(clip, tmp_path / "s.ath", effort="fast")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "clip, message",
    [
        (lambda: chain_plant(4097, 1, frames=2), "4097 branches on branches"),
        (lambda: clip_of(np.zeros(((1 << 20) + 1, 1, 3)), np.zeros((1, 3)), [0], [-1]), "1048577 frames"),
    ],
    ids=["depth", "frames"],
)
def test_counts_that_decoders_refuse_are_refused_when_encoding(clip, message, tmp_path):
    with pytest.raises(ClipError, match=message):
        athcodec.encode(clip(), tmp_path / "s.ath", effort="fast")
    assert not list(tmp_path.iterdir())


def test_the_deepest_chain_that_is_encoded_can_be_decoded(tmp_path):
    clip = chain_plant(4096, 1, frames=2)
    summary = athcodec.encode(clip, tmp_path / "s.ath", rel_error=1e-3, effort="fast")
    with athcodec.open(summary.path, strict=True) as decoder:
        error = np.linalg.norm(decoder.positions().astype(np.float64) - clip.positions, axis=2).max()
    assert error <= summary.max_error_bound


# ---- files ----


def poisoned_file(path, frame: int) -> None:
    """A clip as HDF5, which is read in blocks, with one NaN in its motion."""
    source = plant(seed=1, branches=5, longest=4, frames=60)
    athcodec.write_hdf5(source, path)
    with h5py.File(path, "r+") as file:
        file["positions"][frame, 2, 1] = np.nan


def test_nan_late_in_a_lazily_read_clip_is_named_and_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr(clip_module, "BLOCK_BYTES", 2000)
    poisoned_file(tmp_path / "poisoned.h5", 55)
    out = tmp_path / "out"
    out.mkdir()
    with athcodec.read_hdf5(tmp_path / "poisoned.h5") as clip, pytest.raises(ClipError, match="frame 55, vertex 2"):
        athcodec.encode(clip, out / "s.ath", effort="fast")
    assert not list(out.iterdir())


class Fading:
    """Positions that turn bad between the first reading and the second."""

    def __init__(self, array: np.ndarray, good_reads: int, error: type[Exception] | None = None):
        self.array, self.shape, self.dtype = array, array.shape, array.dtype
        self.good_reads, self.error = good_reads, error

    def __getitem__(self, frames):
        self.good_reads -= frames.stop == len(self.array)
        if self.good_reads >= 0:
            return self.array[frames]
        if self.error:
            raise self.error("the disk is gone")
        return np.full_like(self.array[frames], np.nan)


@pytest.mark.parametrize("error", [None, OSError])
@pytest.mark.parametrize("good_reads", [0, 1])
def test_a_source_that_fails_while_it_is_coded_leaves_no_file(error, good_reads, small, tmp_path):
    fading = small.replace(positions=Fading(small.positions, good_reads, error))
    with pytest.raises(ClipError, match="positions: frame|positions: frames"):
        athcodec.encode(fading, tmp_path / "s.ath", segment_frames=16, effort="fast")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("stage", ["survey", "search", "motion"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interruption_leaves_the_old_file_and_no_other(stage, error, small, tmp_path):
    def interrupt(now: str, fraction: float) -> None:
        if now == stage and fraction >= (0.3 if stage == "motion" else 0):
            raise error("enough")

    target = tmp_path / "s.ath"
    target.write_bytes(OLDER)
    with pytest.raises(error):
        athcodec.encode(small, target, segment_frames=16, effort="fast", progress=interrupt)
    assert target.read_bytes() == OLDER and list(tmp_path.iterdir()) == [target]


def test_an_existing_file_is_there_until_the_new_one_is_whole(small, tmp_path):
    target = tmp_path / "s.ath"
    target.write_bytes(OLDER)
    seen = set()

    def look(stage: str, fraction: float) -> None:
        if stage != "done":
            seen.add(target.read_bytes())

    summary = athcodec.encode(small, target, effort="fast", progress=look)
    assert seen == {OLDER} and list(tmp_path.iterdir()) == [target]
    with athcodec.open(target, strict=True) as decoder:
        decoder.file.check()
        assert decoder.file.file_length == summary.bytes


# ---- progress and determinism ----


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_progress_rises_from_nothing_to_one_through_the_stages(effort, small, tmp_path):
    calls: list[tuple[str, float]] = []
    how = {"segment_frames": 16, "effort": effort, "progress": lambda *call: calls.append(call)}
    athcodec.encode(small, tmp_path / "s.ath", **how)
    stages = list(dict.fromkeys(stage.partition(":")[0] for stage, _ in calls))
    assert stages == ["usual effort"] * (effort == "best") + ["survey", "search", "motion", "done"]
    assert "search: rotations" in dict(calls)
    fractions = [fraction for _, fraction in calls]
    assert fractions == sorted(fractions) and 0 < fractions[0] < 0.3 and fractions[-1] == 1.0
    of_motion = {fraction for stage, fraction in calls if stage == "motion"}
    assert len(of_motion) >= 3, "one for each segment, and two where it is joined"


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
@pytest.mark.parametrize("frames", [64, 320])
def test_half_of_the_progress_is_about_half_of_the_work(frames, effort, tmp_path, monkeypatch):
    """Work: positions that are analysed, which is most of what a search and coding do."""
    done, reported = [0], []
    analyse = SegmentMotion.analyse

    def counted(self, source, *more, **options):
        done[0] += source.size
        return analyse(self, source, *more, **options)

    monkeypatch.setattr(SegmentMotion, "analyse", counted)
    how = {"progress": lambda stage, fraction: reported.append((fraction, done[0])), "effort": effort, "jobs": 1}
    athcodec.encode(endless_clip(frames, at_once=frames), tmp_path / "e.ath", segment_frames=32, **how)
    for part in (0.25, 0.5, 0.75):
        work = max([0, *(work for fraction, work in reported if fraction <= part)]) / done[0]
        assert work == pytest.approx(part, abs=0.25)


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_the_same_clip_gives_the_same_bytes(effort, bushy_clip):
    clip = bushy_clip.replace(positions=bushy_clip.block(0, 17), time=bushy_clip.time[:17])  # two segments
    first, second = (athcodec.encode(clip, effort=effort, segment_frames=16) for _ in range(2))
    assert first == second


def test_encoding_leaves_the_clip_as_it_was(bushy_clip):
    before = {
        name: getattr(bushy_clip, name).tobytes()
        for name in ("positions", "rest", "time", "vertex_branch", "branch_parent", "stem_index")
    }
    athcodec.encode(bushy_clip, effort="fast")
    assert all(getattr(bushy_clip, name).tobytes() == data for name, data in before.items())


# ---- memory ----


class Endless:
    """Positions made when they are read, so many frames at a time at most."""

    def __init__(self, rest: np.ndarray, frames: int, at_once: int):
        self.rest, self.shape, self.dtype, self.at_once = rest, (frames, *rest.shape), np.dtype(np.float32), at_once
        self.read = np.zeros(frames, int)

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, *_, **__):
        raise AssertionError("the motion was read whole")

    def __getitem__(self, frames: slice) -> np.ndarray:
        assert isinstance(frames, slice) and frames.step is None
        assert frames.stop - frames.start <= self.at_once, "more frames were read at once than a segment or block has"
        self.read[frames] += 1
        angle = np.arange(frames.start, frames.stop)[:, None, None] * 0.05
        return np.float32(self.rest + 0.1 * np.sin(angle + self.rest[:, :1]) * self.rest[:, 2:] ** 2)


def endless_clip(frames: int, vertices: int = 200, at_once: int = 32) -> MotionClip:
    rest = np.stack([np.zeros(vertices), np.zeros(vertices), np.linspace(0, 3, vertices)], 1)
    return MotionClip(
        positions=Endless(rest, frames, at_once),
        rest=rest,
        time=np.arange(frames) / 30,
        vertex_branch=np.zeros(vertices, int),
        branch_parent=[-1],
    )


def test_a_clip_is_read_in_blocks_and_segments_only(tmp_path, monkeypatch):
    monkeypatch.setattr(clip_module, "BLOCK_BYTES", 32 * 200 * 12)
    clip = endless_clip(600)
    summary = athcodec.encode(clip, tmp_path / "s.ath", segment_frames=32, effort="fast")
    assert clip.positions.read.min() >= 2 and np.median(clip.positions.read) <= 3
    assert clip.positions.read.max() <= 11  # Some frames show what is no plant, and in which pose the plant is grown.
    with athcodec.open(summary.path, strict=True) as decoder:
        for start, block in decoder.blocks():
            source = clip.block(start, start + len(block))
            assert np.linalg.norm(block.astype(np.float64) - source, axis=2).max() <= summary.max_error_bound


def peak_memory(clip: MotionClip, folder) -> int:
    tracemalloc.start()
    try:
        # There is one job, because how far threads run ahead differs from run to run.
        athcodec.encode(clip, folder / "s.ath", segment_frames=32, effort="fast", jobs=1)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_frames(tmp_path, monkeypatch):
    monkeypatch.setattr(clip_module, "BLOCK_BYTES", 32 * 200 * 12)
    monkeypatch.setattr("athcodec.encoding.encoder.SPOOL_BYTES", 1 << 16)
    peak_memory(endless_clip(64), tmp_path)  # What is made once, such as imports, is not counted.
    short, long = (peak_memory(endless_clip(frames), tmp_path) for frames in (320, 1600))
    raw = 1600 * 200 * 12
    assert long < 1.2 * short + 200_000, "but for a few numbers per frame and segment"
    assert long - short < raw / 4


def test_the_layers_of_a_segment_are_in_memory_one_at_a_time(tmp_path):
    peak_memory(endless_clip(64, at_once=64), tmp_path)  # What is made once, such as imports, is not counted.
    segment = 32 * 2000 * 12
    assert peak_memory(endless_clip(128, 2000, at_once=128), tmp_path) < 22 * segment


ENCODE_ARRAY = """
import sys
import athcodec
import numpy as np

athcodec.encode(np.load(sys.argv[1], mmap_mode="r"), sys.argv[2], rel_error=1e-4, unit="m", fps=30)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no resource module")
def test_the_memory_of_default_options_grows_by_a_few_times_the_source(tmp_path):
    peaks, sizes, source = [], [], tmp_path / "stalks.npy"
    for plants in (500, 2000):
        np.save(source, fields.stalks(37, plants).clip.positions)
        peaks.append(peak_of(ENCODE_ARRAY, source, tmp_path / "stalks.ath"))
        sizes.append(source.stat().st_size)
    assert peaks[1] - peaks[0] < 6.5 * (sizes[1] - sizes[0])


@pytest.mark.parametrize("by_steps", [False, True])
def test_the_file_is_checked_when_nothing_that_encoding_made_is_in_memory(by_steps, bushy_clip, tmp_path, monkeypatch):
    """Positions, plans and trials take several times as much memory as the decoder that checks the file."""
    alive, check = [], AthFile.check
    before = _records()

    def noting(file, *words):
        alive.append([type(one).__name__ for one in _records() if not any(one is other for other in before)])
        check(file, *words)

    monkeypatch.setattr(AthFile, "check", noting)
    gc.disable()
    try:
        if by_steps:
            made = encoding.draft(bushy_clip, effort="fast")
            coded = encoding.code_segments(bushy_clip, made, range(made.segment_count))
            encoding.write(bushy_clip, made, list(coded), tmp_path / "a.ath")
        else:
            athcodec.encode(bushy_clip, tmp_path / "a.ath", effort="fast")
    finally:
        gc.enable()
    assert alive == [[]]


def _records() -> list[object]:
    """Return what of an encoder's records is in memory."""
    return [one for one in gc.get_objects() if isinstance(one, (Source, Plan, SegmentMotion, Trials, Search))]


@pytest.mark.parametrize("jobs", [0, -1])
def test_no_threads_at_all_are_refused(tmp_path, jobs):
    with pytest.raises(ValueError, match="jobs: got"):
        athcodec.encode(endless_clip(2), tmp_path / "s.ath", jobs=jobs)


def test_the_work_of_decoding_is_proportional_to_the_length_of_a_clip(tmp_path, work_of):
    """Looking chunks up must not cost more the more there are."""

    def work(frames: int) -> int:
        wave = np.zeros((frames, 1, 3)) + np.sin(np.arange(frames) / 9)[:, None, None]
        clip = clip_of(wave, np.zeros((1, 3)), [0], [-1])
        with coded(clip, tmp_path / "s.ath", rel_error=1e-2, segment_frames=16, effort="fast") as decoder:
            return work_of(decoder.positions)

    assert work(4_000) < 1.2 * 8 * work(500)


def test_segments_are_short_enough_for_a_decoder_within_its_default_memory():
    for vertices in (1_000, 100_000, 1_000_000, 2_000_000, 3_000_000):
        segments = split_segments(1_000, vertices, memory=Limits.memory_bytes)
        assert [start for start, _ in segments[1:]] == [stop for _, stop in segments[:-1]]
        assert max(decoding_bytes(vertices, stop - start) for start, stop in segments) <= Limits.memory_bytes


@pytest.mark.parametrize(("ladder", "effort"), [("none", "default"), ("decades", "fast")])
def test_parts_that_jump_take_no_more_than_in_short_segments(tmp_path, ladder, effort):
    rng = np.random.default_rng(5)
    frames, leaves = np.arange(160), 12
    places = np.stack([rng.normal(size=(leaves, 3)), rng.normal(size=(leaves, 3)) * [3, 0.01, 3]])
    fallen = (frames[:, None] >= rng.integers(1, 159, leaves)).astype(int)
    turned = rng.normal(size=(2, leaves, 5, 3)) * 0.1
    phase = rng.uniform(0.3, 0.9, leaves) * frames[:, None] + rng.uniform(0, 6.28, leaves)
    sway = 0.1 * np.sin(phase) * (fallen == 0)
    at = np.arange(leaves)
    positions = places[fallen, at][:, :, None] + turned[fallen, at] + sway[:, :, None, None]
    moved = positions.reshape(len(frames), -1, 3)
    clip = clip_of(moved, moved[0], np.repeat(at, 5), np.full(leaves, -1))
    given = {"rel_error": 1e-4, "ladder": ladder, "effort": effort}
    whole = athcodec.encode(clip, tmp_path / "a.ath", **given).bytes
    assert whole <= 1.02 * athcodec.encode(clip, tmp_path / "b.ath", segment_frames=32, **given).bytes


def test_a_branch_may_have_more_vertices_than_the_largest_lag(tmp_path):
    moved = np.random.default_rng(0).normal(size=(2, 65_600, 3)).astype(np.float32)
    clip = clip_of(moved, moved[0], np.zeros(65_600, np.int32), np.array([-1]))
    summary = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-2, effort="fast")
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert np.linalg.norm(decoder.positions() - moved, axis=2).max() <= summary.max_error_bound


def test_a_clip_becomes_one_record_on_its_way_into_a_file_and_is_never_replaced(monkeypatch, tmp_path):
    """A rest pose that shows little of the plant, weights, and a host's rest pose each once made another clip."""
    made, of = [], CodedClip.of

    def noted(*words) -> CodedClip:
        made.append(of(*words))
        return made[-1]

    def replaced(clip: MotionClip, **changes) -> MotionClip:
        raise AssertionError(f"the clip was replaced: {', '.join(changes)}")

    clip, growth = plant(3, branches=5, frames=20), np.linspace(0.01, 1, 20)[:, None, None]
    clip = MotionClip(clip.rest * growth + clip.positions * 0.1, clip.time, clip.vertex_branch, clip.branch_parent)
    monkeypatch.setattr(CodedClip, "of", noted)
    monkeypatch.setattr(MotionClip, "replace", replaced)
    for count, options in enumerate(({"weights": np.linspace(1, 2, clip.vertex_count)}, {"host_rest": True}), start=1):
        athcodec.encode(clip, tmp_path / "a.ath", effort="fast", **options)
        assert len(made) == count
        for name in ("rest", "hierarchy", "motion", "reference", "weights"):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(made[-1], name, None)
