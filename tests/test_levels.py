"""Levels only get better: errors, the plant's box, smoothness; which levels a file shows."""

import io
from dataclasses import replace

import numpy as np
import pytest
from files import Parts, opened
from hypothesis import given, settings
from hypothesis import strategies as st
from plants import awkward_plants, blown_tree, bound_for, diagonal, distance, flowing_growth, meadow, opening_flower
from test_document import assert_same_bits

import athcodec
from athcodec.decoding import container as ct
from athcodec.encoding.segments.levels import chosen_levels
from athcodec.errors import BadChunkTable, BadHeader, LevelUnavailable
from athcodec.metrics import SmoothnessMeter
from spec.document import File

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
                assert file.tables.header.is_predicted or meter.jerks(file.max_error_bound).max(initial=0.0) <= 2


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
        header = decoder.file.tables.header
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
    tree = athcodec.read(athcodec.sample_path("tree"))
    tree = tree.replace(positions=tree.block(0, 48), time=tree.time[:48])
    for clip in (athcodec.join(medley_clips), flowing_growth(60), tree, blown_tree(0, branches=60, frames=40)):
        assert_levels_get_better(clip, coded(clip, rel_error=1e-3, **options))


# ---- fields and single plants ----


def foot_drift(clip: athcodec.MotionClip, data: bytes) -> list[float]:
    """The largest distance of the first vertex of any root from where it is in the source, over the extent of a plant,
    at each level."""
    source, roots = clip.block(0, clip.frame_count), np.flatnonzero(clip.branch_parent < 0)
    feet = np.array([np.flatnonzero(clip.vertex_branch == root)[0] for root in roots])
    of_first = clip.vertex_branch == roots[0] if len(roots) > 1 else slice(None)
    extent = np.linalg.norm(np.ptp(clip.rest[of_first], axis=0))
    with opened(data) as decoder:
        shown = (decoder.positions(level=level)[:, feet] for level in range(decoder.file.level_count))
        return [float(np.linalg.norm(one - source[:, feet], axis=2).max() / extent) for one in shown]


@pytest.mark.parametrize(
    "plants",
    [
        lambda: meadow(100, rows=10, frames=40),  # Some blades move as rigid parts at the first levels.
        lambda: meadow(40, faces=False, rows=40),  # Of two pieces each, whose maps are their own.
        lambda: opening_flower(12),
        lambda: blown_tree(0, branches=60, frames=40),
        lambda: flowing_growth(60),
    ],
)
def test_what_is_rooted_stays_rooted_at_each_level(plants):
    clip = plants()
    assert max(foot_drift(clip, coded(clip, rel_error=1e-4))) < 0.02


@pytest.mark.parametrize("plants", [lambda: meadow(150), lambda: meadow(150, faces=False), lambda: opening_flower(20)])
def test_a_file_of_many_plants_or_parts_has_three_levels_that_get_better(plants):
    clip = plants()
    data = coded(clip, rel_error=1e-4)
    with opened(data) as decoder:
        assert decoder.file.level_count >= 3
    assert_levels_get_better(clip, data)


def test_level_0_moves_each_plant_of_a_field():
    clip = meadow(60)
    with opened(coded(clip, rel_error=1e-4)) as decoder:
        source, coarse = clip.block(0, clip.frame_count), decoder.positions(level=0)
    tips = np.arange(15, clip.vertex_count, 16)
    moved, error = (
        np.linalg.norm(some - mean, axis=2) for some, mean in ((source, source.mean(axis=0)), (coarse, source))
    )
    assert (error[:, tips].mean(axis=0) < 0.6 * moved[:, tips].mean(axis=0)).mean() > 0.9


def test_no_level_of_a_clip_is_worse_than_the_one_before_in_that_clip():
    errors = np.array([[0.273, 1.0], [0.305, 0.5], [0.2, 0.4], [0.01, 0.01]])  # Of a calm clip and of one in a gale.
    table, flaws = np.repeat(errors[:, :, None], 3, axis=2), np.zeros((4, 2, 2))
    assert chosen_levels(table, [[100], [100]], flaws, 10.0, exact=False, first_held=3) == [0, 2, 3]
    assert chosen_levels(table, [[100, 100]], flaws, 10.0, exact=False, first_held=3) == [0, 1, 2, 3]


@pytest.mark.parametrize("name", ["leafed", "fern", "grass"])
def test_no_level_of_a_clip_of_the_samples_is_worse_than_the_one_before(name):
    with athcodec.open(athcodec.sample_path(name)) as decoder:
        for wind in (clip.name for clip in decoder.file.clips):
            for before, after in zip(decoder.play(wind).levels, decoder.play(wind).levels[1:]):
                assert after.max_error <= before.max_error and after.rms_error <= before.rms_error


# ---- which levels are shown ----


@pytest.fixture(scope="module")
def parts(bushy_clip):
    """A lossless file in layers that shows not all of its levels."""
    clip = bushy_clip.replace(positions=bushy_clip.block(0, 20), time=bushy_clip.time[:20])
    return Parts.of(athcodec.encode(clip, rel_error=1e-4, segment_frames=16, ladder=LADDER, lossless=True))


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
                assert cut.file.tables.header.stages == parts.header.stages and cut.file.level_count == level.level + 1
                assert prefix.file.deepest == level.level
                for shown in range(level.level + 1):
                    positions = whole.positions(level=shown)
                    assert np.array_equal(cut.positions(level=shown), positions)
                    assert np.array_equal(prefix.positions(level=shown), positions)
            assert np.array_equal(File((tmp_path / "b.ath").read_bytes()).positions(), positions)


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
