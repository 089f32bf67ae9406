"""Levels only get better: errors, the plant's box, smoothness; which levels a file shows."""

import io
from dataclasses import replace

import numpy as np
import pytest
from files import Parts, opened
from hypothesis import given, settings
from hypothesis import strategies as st
from plants import awkward_plants, blown_tree, bound_for, diagonal, distance
from test_document import assert_same_bits

import athcodec
from athcodec.decoding import container as ct
from athcodec.errors import BadChunkTable, BadHeader, LevelUnavailable
from athcodec.metrics import SmoothnessMeter

LADDER = (1e-1, 1e-2, 1e-3)


def assert_levels_get_better(clip: athcodec.MotionClip, data: bytes) -> None:
    """No error exceeds that of the level before, no level leaves the box, and none jerks. The last lossy one is free:
    it is within the bound that was given, and always shown."""
    with opened(data, strict=True) as decoder:
        file = decoder.file
        for before, after in zip(file.levels, file.levels[1:]):
            assert after.max_error <= before.max_error and after.rms_error <= before.rms_error
        source = clip.block(0, clip.frame_count).astype(np.float64)
        low, high = source.min(axis=(0, 1)), source.max(axis=(0, 1))
        for level in range(file.level_count - 1 - (file.max_error_bound == 0.0)):
            for part in map(decoder.play, (one.name for one in file.clips)):
                stop = part.clip.first_frame + part.clip.frame_count
                shown, wanted = part.positions(level=level), source[part.clip.first_frame : stop]
                away = max((low - shown).max(), (shown - high).max())
                assert away <= 0.1 * diagonal(clip) + file.max_error_bound
                starts = [start for start, _ in part.segments]
                meter = SmoothnessMeter(len(shown), file.max_error_bound, starts, part.clip.loop)
                meter.add(wanted, shown)
                assert file.header.is_predicted or meter.jerks(file.max_error_bound).max(initial=0.0) <= 2


def coded(clip: athcodec.MotionClip, **options) -> bytes:
    return athcodec.encode(clip, **{"effort": "fast"} | options)


@settings(max_examples=25)
@given(
    plant=awkward_plants(),
    ladder=st.sampled_from(["none", "decades", LADDER]),
    others=st.sampled_from([{}, {"segment_frames": 16}, {"lossless": True}, {"tam": athcodec.Thresholds(0, 0, 0, 0)}]),
)
def test_levels_of_any_plant_get_better(plant, ladder, others):
    assert_levels_get_better(plant, coded(plant, max_error=bound_for(plant, 1e-3), ladder=ladder, **others))


@settings(max_examples=40)
@given(
    plant=awkward_plants(),
    bound=st.floats(-5, -2).map(lambda decades: 10**decades),
    ladder=st.sampled_from([(1e-1, 1e-2, 1e-3), (3e-2, 4e-3), (5e-3,), (2e-2, 6e-3, 2e-3, 6e-4)]),
    others=st.sampled_from([{}, {"segment_frames": 16}, {"exact_rest": True}, {"effort": "default"}]),
    nearly_repeats=st.booleans(),
    is_weighted=st.booleans(),
)
def test_each_level_that_a_ladder_names_holds_the_error(plant, bound, ladder, others, nearly_repeats, is_weighted):
    bound = bound_for(plant, bound)
    if nearly_repeats:
        twice = np.repeat(plant.positions, 2, axis=0)
        twice[1::2, :, 0] += plant.positions.dtype.type(bound / 100)
        plant = plant.replace(positions=twice, time=np.arange(len(twice)) / 30)
    weights = {"weights": np.linspace(0.5, 3, plant.vertex_count)} if is_weighted else {}
    data = coded(plant, max_error=bound, ladder=ladder, attributes="none", **others | weights)
    lengths = [error * diagonal(plant) for error in ladder if error * diagonal(plant) >= 4.001 * bound]
    with opened(data, strict=True) as decoder:
        header = decoder.file.header
        first = header.stages[-1] - header.layer_count + 1
        for stage, length in enumerate(lengths[: header.layer_count - 1], first):
            if stage in header.stages:
                level = decoder.levels[header.stages.index(stage)]
                assert distance(decoder.positions(level=level.level), plant.positions) <= length
                assert level.max_error <= length


@pytest.mark.parametrize(
    "options", [{}, {"segment_frames": 16, "ladder": LADDER}, {"tam": athcodec.Thresholds(0, 0, 0, 0)}]
)
def test_levels_of_clips_loops_growth_and_storms_get_better(options, medley_clips):
    growth = athcodec.read(athcodec.sample_path("growth"))
    tree = athcodec.read(athcodec.sample_path("tree"))
    for clip in (athcodec.join(medley_clips), growth, tree, blown_tree(0, branches=60, frames=40)):
        assert_levels_get_better(clip, coded(clip, rel_error=1e-3, **options))


# ---- which levels are shown ----


@pytest.fixture(scope="module")
def parts(bushy_clip):
    """A lossless file in layers that shows not all of its levels."""
    return Parts.of(athcodec.encode(bushy_clip, rel_error=1e-4, segment_frames=16, ladder=LADDER, lossless=True))


def test_levels_that_are_not_shown_have_no_maps_and_no_number(parts):
    stages = parts.header.stages
    assert len(stages) == parts.header.full_level_count < stages[-1] + 1
    assert {c.stage for c, _ in parts.chunks if c.kind in (ct.AFFINES, ct.CORRECTIONS)} <= set(stages)
    assert {c.stage for c, _ in parts.chunks if c.kind in (ct.STEMS, ct.EXACT)} >= set(range(1, stages[-1]))
    assert_same_bits(parts.file())
    with opened(parts.file()) as decoder:
        with pytest.raises(LevelUnavailable):
            decoder.positions(level=len(stages))


def test_prefixes_and_truncated_files_have_the_levels_of_the_whole(parts, tmp_path):
    path, data = tmp_path / "a.ath", parts.file()
    path.write_bytes(data)
    with athcodec.open(path) as whole:
        for level in whole.levels:
            athcodec.truncate(path, tmp_path / "b.ath", level.level)
            with athcodec.open(tmp_path / "b.ath", strict=True) as cut, opened(data[: level.bytes]) as prefix:
                assert cut.file.header.stages == parts.header.stages and cut.file.level_count == level.level + 1
                assert prefix.file.deepest == level.level
                for shown in range(level.level + 1):
                    positions = whole.positions(level=shown)
                    assert np.array_equal(cut.positions(level=shown), positions)
                    assert np.array_equal(prefix.positions(level=shown), positions)
            assert_same_bits((tmp_path / "b.ath").read_bytes())


def test_what_says_that_levels_are_shown_must_fit_the_chunks(parts):
    stages, chunks = parts.header.stages, [chunk for chunk, _ in parts.chunks]
    left_out = min(set(range(stages[-1])) - set(stages))

    def refusal(error, stages, chunks=parts.chunks):
        header = replace(parts.header, stages=tuple(stages))
        with pytest.raises(error):
            athcodec.open(io.BytesIO(Parts(header, parts.errors, chunks).file()))

    refusal(BadHeader, sorted([left_out, *stages[:-2], stages[-1]]))  # EXACT goes on from a level that is not shown.
    refusal(BadHeader, [*stages[:-1], stages[-1] + 1])
    refusal(BadHeader, [*stages[:-1], 32])
    refusal(BadChunkTable, sorted([left_out, *stages[:-3], *stages[-2:]]))
    maps = next(i for i, chunk in enumerate(chunks) if chunk.kind == ct.AFFINES)
    more = [*parts.chunks[: maps + 1], *[(replace(chunks[maps], stage=left_out), b"")], *parts.chunks[maps + 1 :]]
    more.sort(key=lambda entry: (entry[0].kind >= 32, entry[0].is_motion, entry[0].stage if entry[0].is_motion else 0))
    refusal(BadChunkTable, stages, more)
