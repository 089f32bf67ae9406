"""Files with layers of precision: every level within what its table says, prefixes that cost little, the bound kept."""

from __future__ import annotations

from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from plants import chain_plant, plant

import athcodec
from athcodec import MotionClip, Thresholds, encoding
from athcodec.decoding import container as ct
from athcodec.encoding import decisions
from athcodec.encoding.assembly.assembly import FileAssembly
from athcodec.encoding.assembly.segment_coding import SegmentCoder
from athcodec.encoding.model.quantise import SOURCE_REST_TOLERANCE
from athcodec.encoding.segments.layers import layer_ratios
from athcodec.encoding.segments.levels import MOST_JERK, SourceFrames
from athcodec.encoding.streams import writing
from athcodec.errors import BadChecksum, LevelUnavailable, LimitExceeded

LADDER = (1e-1, 1e-2, 1e-3)
ROUNDING = 1e-6  # the error table holds float32


@pytest.fixture(scope="module")
def sample_files(tmp_path_factory):
    """(summary without, with layers) of the sample at the default bound."""
    folder = tmp_path_factory.mktemp("layers")
    clip = athcodec.read_hdf5(athcodec.sample_path())
    return [
        athcodec.encode(clip, folder / f"{ladder}.ath", ladder=ladder, attributes="none", effort="fast")
        for ladder in ("none", "decades")
    ]


@pytest.fixture(scope="module")
def layered(bushy_clip, tmp_path_factory):
    """The bushy clip in four segments and layers."""
    path = tmp_path_factory.mktemp("layered") / "bushy.ath"
    return athcodec.encode(bushy_clip, path, rel_error=1e-5, segment_frames=16, ladder=LADDER).path


def check_levels(clip, path, name: str | None = None) -> None:
    """Every level has the errors of the table, the last one those of the bound."""
    source = clip.block(0, clip.frame_count).astype(np.float64)
    rounding = 4 * np.spacing(np.abs(source).max())
    with athcodec.open(path, strict=True) as decoder:
        played = decoder.play(name) if name else decoder
        for level in played.levels:
            errors = np.linalg.norm(played.positions(level=level.level).astype(np.float64) - source, axis=2)
            assert errors.max() <= level.max_error * (1 + ROUNDING) + rounding
            assert np.sqrt(np.mean(errors**2)) <= level.rms_error * (1 + ROUNDING) + rounding
        assert errors.max() <= decoder.file.max_error_bound


# ---- what a ladder is ----


def test_a_ladder_has_a_layer_for_each_error_that_is_well_above_the_bound():
    assert layer_ratios((1e-2, 1e-3, 1e-4), 1e-4, 1.0) == [170, 12, 1]
    assert layer_ratios((1e-2, 1e-3, 1e-4), 5e-4, 1.0) == [34, 1]
    assert layer_ratios((1e-2, 9e-3), 1e-4, 1.0) == [170, 1]
    assert layer_ratios((), 1e-4, 1.0) == layer_ratios((1e-4, 1e-5), 1e-4, 1.0) == [1]


@pytest.mark.parametrize("first", [0.0, 0.01, 0.07, 0.3, 0.8, 1.7])
def test_each_layer_has_a_finer_step_than_the_one_before(first):
    ratios = layer_ratios((1e-1, 1e-2, 1e-3), 1e-4, 1.0, (first, 1.25))
    assert ratios[-1] == 1 and all(coarse > fine for coarse, fine in pairwise(ratios))


@pytest.mark.parametrize("way", [0.0, 3e-4, 6e-4, 1e-3, 2e-3])
@pytest.mark.parametrize("has_own_rest", [False, True])
def test_stalks_side_by_side_that_hardly_move_are_decoded(way, has_own_rest, tmp_path):
    """Their first layer may be finer than the ladder asks of the second."""
    rng = np.random.default_rng(5)
    foot, phase = rng.uniform(-1, 1, (30, 1, 3)) * [1, 1, 0], rng.uniform(0, 6, (30, 1))
    height = np.linspace(0, 0.4, 6)
    stalks = foot + height[:, None] * [0, 0, 1]
    time = np.arange(12) / 30
    positions = np.repeat(stalks[None], len(time), axis=0)
    positions[..., 0] += way * (height / 0.4) ** 2 * np.sin(8 * time[:, None, None] + phase)
    clip = MotionClip(
        positions=positions.reshape(len(time), -1, 3).astype(np.float32),
        rest=(stalks + 0.01 * has_own_rest).reshape(-1, 3).astype(np.float32),
        time=time,
        vertex_branch=np.repeat(np.arange(30), 6),
        branch_parent=np.full(30, -1),
    )
    check_levels(clip, athcodec.encode(clip, tmp_path / "a.ath", effort="fast").path)


def test_a_file_that_cannot_be_decoded_is_not_kept(bushy_clip, tmp_path, monkeypatch):
    pack = writing.pack_refined_stems
    monkeypatch.setattr(writing, "pack_refined_stems", lambda ratio, *words: pack(0, *words))
    with pytest.raises(AssertionError, match="cannot be decoded, and did not keep it: chunk STEMS of level"):
        athcodec.encode(bushy_clip, tmp_path / "a.ath", effort="fast", ladder=LADDER)
    assert list(tmp_path.iterdir()) == []


def test_errors_far_above_the_bound_get_layers_in_between(bushy_clip, tmp_path):
    assert layer_ratios((1e-1, 1e-2), 1e-7, 1.0) == [1_700_000, 125_000, 353, 1]
    for ladder in ((1e-1,), (1e-2, 1e-3)):
        made = athcodec.encode(bushy_clip, tmp_path / "a.ath", ladder=ladder, effort="fast", lossless=True)
        with athcodec.open(made.path) as played:
            assert np.array_equal(played.positions(), bushy_clip.positions)
            diagonal = np.linalg.norm(np.ptp(bushy_clip.positions.reshape(-1, 3), axis=0))
            found = [level.max_error / diagonal for level in played.levels]
            assert all(any(wanted / 3 < error < 3 * wanted for error in found) for wanted in ladder)


@pytest.mark.parametrize("ladder", ["", "some", "1e-2,", (0.0,), (1e-2, 1.0), ("nan",), (None,), 1e-2])
def test_what_is_no_ladder_is_refused(ladder, bushy_clip, tmp_path):
    with pytest.raises(ValueError, match=r"ladder: got .*; expected none, decades or errors between 0 and 1"):
        athcodec.encode(bushy_clip, tmp_path / "a.ath", ladder=ladder)


def test_errors_may_be_given_in_any_order_and_as_text(bushy_clip):
    one, other = (athcodec.encode(bushy_clip, ladder=each, effort="fast") for each in ((1e-3, 1e-2), "1e-2,0.001"))
    assert one == other


# ---- what it gives ----


def test_prefixes_of_a_file_with_layers_are_a_fraction_and_the_whole_little_more(sample_files):
    alone, layers = sample_files
    assert layers.bytes < 1.06 * alone.bytes
    with athcodec.open(alone.path) as one, athcodec.open(layers.path) as several:
        assert several.file.tables.header.stages[-1] == one.file.tables.header.stages[-1] + 2
        least, first = several.levels[0], several.levels[-3]
        assert least.bytes < 0.6 * one.levels[0].bytes
        assert first.bytes < 0.2 * one.levels[-1].bytes
        assert first.max_error < 2e-2 * alone.max_error_bound / alone.relative_bound


def test_levels_have_the_errors_of_the_table(bushy_clip, layered):
    check_levels(bushy_clip, layered)


def test_layers_play_alike_whatever_was_played_before(layered):
    with athcodec.open(layered) as decoder:
        last = decoder.file.level_count - 1
        down = {level: decoder.positions(20, level) for level in range(last, -1, -1)}
        up = {level: decoder.positions(20, level) for level in range(last + 1)}
        assert all((down[level] == up[level]).all() for level in up)
    for level in (last, last - 1):
        with athcodec.open(layered) as decoder:
            assert (decoder.positions(20, level) == up[level]).all()


# ---- rest poses ----


def cut_rest(path, level):
    """The rest pose as the reference pose of a level gives it."""
    with athcodec.open(path) as decoder:
        return decoder.file.rest_at(level)


def test_poses_are_as_precise_as_the_deepest_level_that_is_there(layered_ath, bushy_clip, tmp_path):
    with athcodec.open(layered_ath) as whole:
        poses = [whole.level_rest(level.level) for level in whole.levels]
        refined = [chunk.level for chunk in whole.file.chunks if chunk.kind == ct.REFINED_REST]
        deepest, diagonal = whole.file.rest, np.linalg.norm(np.ptp(bushy_clip.positions.reshape(-1, 3), axis=0))
        assert np.linalg.norm(deepest - bushy_clip.rest, axis=1).max() <= SOURCE_REST_TOLERANCE * diagonal
    errors = [np.abs(pose - poses[-1]).max() for pose in poses]
    *of_first_layer, coarse, fine = refined
    assert of_first_layer in ([], [1]) and (coarse, fine) == (len(poses) - 2, len(poses) - 1)
    assert errors[1] == errors[coarse - 1] > 3 * errors[coarse] > errors[fine] == 0
    for level, pose in enumerate(poses):
        athcodec.truncate(layered_ath, tmp_path / "cut.ath", level)
        with athcodec.open(tmp_path / "cut.ath", strict=True) as cut:
            assert np.array_equal(cut.level_rest(), pose)
            assert np.array_equal(cut.file.rest, cut_rest(layered_ath, level))
    assert np.array_equal(cut.file.rest, deepest)


@pytest.fixture(scope="module")
def in_steps(tmp_path_factory):
    """The sample, whose level 1 refines the rest pose, and its clip."""
    path, clip = tmp_path_factory.mktemp("steps") / "sample.ath", athcodec.read_hdf5(athcodec.sample_path())
    athcodec.encode(clip, path, rel_error=1e-4, attributes="none", effort="fast")
    return path, clip


def test_level_0_has_a_rest_pose_of_its_own_where_that_costs_little(in_steps):
    """Half the bytes before anything moves."""
    path, clip = in_steps
    check_levels(clip, path)
    with athcodec.open(path) as decoder:
        least, of_layer = (np.abs(decoder.level_rest(level) - decoder.level_rest()).max() for level in (0, 1))
        rests = [decoder.level_rest(level) for level in range(1, decoder.file.core.info.depth_levels - 1)]
        lengths = [chunk.length for chunk in decoder.file.chunks if chunk.kind in (ct.REST, ct.REFINED_REST)]
    assert decoder.levels[0].bytes < 700 and 2 * lengths[0] < 1.4 * sum(lengths[:2])
    assert least > 2 * of_layer and all(np.array_equal(rest, rests[0]) for rest in rests)


def test_a_rest_pose_that_is_cut_off_leaves_level_0(in_steps, tmp_path):
    path, _ = in_steps
    with athcodec.open(path) as whole:
        chunk = next(chunk for chunk in whole.file.chunks if chunk.kind == ct.REFINED_REST)
        for level in (0, 1, whole.file.level_count - 1):
            athcodec.truncate(path, tmp_path / "cut.ath", level)
            with athcodec.open(tmp_path / "cut.ath", strict=True) as cut:
                assert (chunk.level in [own.level for own in cut.file.chunks if own.kind == chunk.kind]) == (level > 0)
                assert np.array_equal(cut.positions(7), whole.positions(7, level))
                assert np.array_equal(cut.level_rest(level), whole.level_rest(level))
        with athcodec.open(BytesIO(path.read_bytes()[: chunk.offset + 1])) as part:
            assert part.file.deepest == 0 and np.array_equal(part.positions(7), whole.positions(7, 0))
            assert np.array_equal(part.affines(7).matrices, whole.affines(7, 0).matrices)


@pytest.mark.parametrize(
    ("roots", "options"), [(1, {"exact_rest": True}), (1, {"ladder": "none"}), (8, {})], ids=["exact", "one", "stems"]
)
def test_level_1_refines_no_rest_pose_where_it_may_not(roots, options, tmp_path):
    clip = plant(seed=5, branches=12, frames=20, roots=roots)
    path = athcodec.encode(clip, tmp_path / "a.ath", **{"ladder": LADDER, "effort": "fast"} | options).path
    with athcodec.open(path, strict=True) as decoder:
        assert 1 not in [chunk.level for chunk in decoder.file.chunks if chunk.kind == ct.REFINED_REST]


def test_asking_for_the_rest_pose_reads_the_rest_poses_alone_and_once(layered_ath):
    with athcodec.open(layered_ath) as decoder:
        before = decoder.file.bytes_read
        assert np.array_equal(decoder.file.rest, decoder.file.rest) and np.array_equal(
            decoder.level_rest(1), decoder.level_rest(2)
        )
        sizes = [chunk.length for chunk in decoder.file.chunks if chunk.kind in (ct.REFINED_REST, ct.SOURCE_REST)]
        assert decoder.file.bytes_read - before == sum(sizes) > 0


def test_maps_are_from_the_rest_pose_of_their_level(layered_ath):
    """Least-squares fits from the rest pose of another layer fit less well."""
    with athcodec.open(layered_ath) as decoder:
        order, deepest = decoder.file.hierarchy.vertex_source, decoder.file.level_count - 1
        parts = decoder.affines(20, deepest)
        shown = decoder.positions(20, deepest, np.float64)[order]
        matrices = np.repeat(parts.matrices, parts.vertex_count, axis=0)

        def error(level: int) -> float:
            pose = decoder.level_rest(level)[order]
            moved = np.einsum("nij,nj->ni", matrices[..., :3], pose) + matrices[..., 3]
            return float(np.square(moved - shown).sum())

        assert parts.is_stem.all() and error(deepest) < error(0)


def test_a_damaged_rest_pose_hides_the_levels_of_its_layer(layered_ath):
    data = bytearray(layered_ath.read_bytes())
    with athcodec.open(layered_ath) as whole:
        chunk = next(chunk for chunk in whole.file.chunks if chunk.kind == ct.REFINED_REST)
        coarse, rest = whole.positions(20, chunk.level - 1), cut_rest(layered_ath, chunk.level - 1)
    data[chunk.offset] ^= 1
    with athcodec.open(BytesIO(data), allow_partial=True) as part:
        assert part.file.deepest == chunk.level - 1
        assert np.array_equal(part.positions(20), coarse) and np.array_equal(part.file.rest, rest)
    with athcodec.open(BytesIO(data)) as strict, pytest.raises(BadChecksum, match=str(chunk)):
        strict.positions(20)


@pytest.mark.parametrize("options", [{"lossless": True}, {"exact_rest": True}, {"effort": "best"}, {"weights": "all"}])
def test_layers_go_with_every_option(options, tmp_path):
    clip = plant(seed=3, branches=6, longest=6, frames=40)
    if "weights" in options:
        options = {"weights": np.linspace(1, 3, clip.vertex_count)}
    path = athcodec.encode(clip, tmp_path / "a.ath", **{"effort": "fast", "ladder": LADDER} | options).path
    check_levels(clip, path)
    if "lossless" in options:
        with athcodec.open(path) as decoder:
            assert decoder.positions().tobytes() == clip.block(0, clip.frame_count).tobytes()


def test_several_clips_share_the_layers_of_their_rest_pose(medley_clips, tmp_path):
    path = tmp_path / "medley.ath"
    athcodec.encode(
        athcodec.join(medley_clips), path, rel_error=1e-4, segment_frames=16, ladder="decades", effort="fast"
    )
    for name, clip in medley_clips.items():
        check_levels(clip, path, name)


def test_layers_take_no_more_memory_than_the_limit(tmp_path):
    clip = plant(seed=1, branches=100, longest=64, frames=1)
    athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-5, effort="fast", ladder=LADDER)
    limits = ct.Limits(memory_bytes=572 * clip.vertex_count)
    with athcodec.open(tmp_path / "a.ath", limits=limits) as decoder:
        last = decoder.file.level_count - 1
        assert np.isfinite(decoder.positions(level=last - 3)).all()
        with pytest.raises(LimitExceeded, match=rf"level {last}: got layers of \d+ bytes; the limit is"):
            decoder.positions(level=last)


def test_each_layer_shows_the_plant_much_better_than_the_one_before(layered):
    with athcodec.open(layered) as decoder:
        errors = [level.rms_error for level in decoder.levels if level.name.startswith("layer")]
    assert len(errors) >= 3 and all(fine < coarse / 3 for coarse, fine in zip(errors, errors[1:]))


@pytest.mark.parametrize("lossless", [False, True])
def test_deep_hierarchies_and_long_ladders_have_as_many_layers_as_a_file_may(lossless, tmp_path):
    deep, ladder = chain_plant(45, 2), [0.5 / 10**i for i in range(9)]
    athcodec.encode(
        deep, tmp_path / "a.ath", rel_error=1e-4, tam=Thresholds(0, 0, 0, 0), lossless=lossless, effort="fast"
    )
    wide = plant(seed=4, branches=9, frames=20, dtype=np.float64)
    athcodec.encode(wide, tmp_path / "b.ath", rel_error=1e-8, ladder=ladder, lossless=lossless, effort="fast")
    for name, clip, layers in (("a", deep, 2 - lossless), ("b", wide, 8)):
        check_levels(clip, tmp_path / f"{name}.ath")
        with athcodec.open(tmp_path / f"{name}.ath") as decoder:
            assert decoder.file.level_count <= 32
            assert sum(level.name.startswith("layer") for level in decoder.levels) == (layers if layers > 1 else 0)


# ---- what levels are called ----


def names_of(path) -> list[str]:
    with athcodec.open(path) as decoder:
        return [level.name for level in decoder.levels]


def test_levels_are_called_by_depth_then_by_layer_in_prefixes_too(layered, bushy_clip, tmp_path):
    def all_names(path, *others: str) -> list[str]:
        """Names of all that may be shown, and of what is."""
        names = [*(f"depth {level}" for level in range(32)), *others]
        with athcodec.open(path) as decoder:
            last = decoder.file.tables.header.stages[-1]
            return [[*names[: last + 1 - len(others)], *others][stage] for stage in decoder.file.tables.header.stages]

    names = names_of(layered)
    assert names == all_names(layered, *(f"layer {layer} of 4" for layer in range(1, 5)))
    for last in (1, len(names) - 4, len(names) - 2):
        athcodec.truncate(layered, tmp_path / "cut.ath", last)
        assert names_of(tmp_path / "cut.ath") == names[: last + 1]
    athcodec.encode(bushy_clip, tmp_path / "single.ath", rel_error=1e-3, lossless=True, ladder="none")
    assert names_of(tmp_path / "single.ath") == all_names(tmp_path / "single.ath", "all branches", "lossless")


# ---- which level to keep ----


def test_the_coarsest_level_within_a_length_is_found(layered):
    with athcodec.open(layered) as decoder:
        for level in decoder.levels:
            found = decoder.level_within(level.max_error)
            assert decoder.levels[found].max_error <= level.max_error
            assert all(before.max_error > level.max_error for before in decoder.levels[:found])
        with pytest.raises(LevelUnavailable, match="expected at least"):
            decoder.level_within(1e-9)


def test_truncate_keeps_the_first_level_within_an_error(layered, tmp_path):
    with athcodec.open(layered) as decoder:
        levels = decoder.levels
    for level in levels:
        athcodec.truncate(layered, tmp_path / "cut.ath", max_error=level.max_error)
        with athcodec.open(tmp_path / "cut.ath") as cut:
            kept = cut.file.level_count - 1
        assert levels[kept].max_error <= level.max_error
        assert all(before.max_error > level.max_error for before in levels[:kept])


def test_truncate_keeps_as_many_levels_as_fit(layered, tmp_path):
    sizes = [athcodec.truncate(layered, tmp_path / "cut.ath", level) for level in range(6)]
    for size in sizes:
        assert athcodec.truncate(layered, tmp_path / "cut.ath", target_size=size) == size
    assert athcodec.truncate(layered, tmp_path / "cut.ath", target_size=sizes[3] - 1) == sizes[2]


@pytest.mark.parametrize("option", [{"max_error": 1e-9}, {"target_size": 10}])
def test_what_no_level_has_is_refused(option, layered, tmp_path):
    with pytest.raises(LevelUnavailable, match="expected at least"):
        athcodec.truncate(layered, tmp_path / "cut.ath", **option)
    assert not (tmp_path / "cut.ath").exists()


@pytest.mark.parametrize("options", [{}, {"level": 1, "max_error": 1.0}])
def test_truncate_takes_one_of_its_options(options, layered, tmp_path):
    with pytest.raises(TypeError, match="expected one of level, max_error and target_size"):
        athcodec.truncate(layered, tmp_path / "cut.ath", **options)


# ---- corrections that would be seen ----


def drifting() -> athcodec.MotionClip:
    """Forty blades that drift slowly and far: a correction of a coarse layer is much faster than they are."""
    rng, share = np.random.default_rng(1), np.linspace(0, 1, 8)[:, None]
    foot, height = rng.uniform(-1, 1, (40, 1, 3)) * [1, 0, 1], rng.uniform(0.6, 1.2, (40, 1, 1))
    rest, turn = foot + share * height * [0, 1, 0], 2 * np.pi * np.arange(120)[:, None, None, None] / 120
    positions = np.broadcast_to(rest, (120, *rest.shape)).copy()
    for cycles, size in enumerate((0.15, 0.05, 0.02), 1):
        way = size * rng.normal(size=(40, 1, 3)) * [1, 0.2, 1]
        positions += way * share**2 * np.sin(cycles * turn + rng.uniform(0, 2 * np.pi, (40, 1, 1)))
    return athcodec.MotionClip(
        positions.reshape(120, -1, 3),
        np.arange(120) / 30,
        rest=rest.reshape(-1, 3),
        vertex_branch=np.repeat(np.arange(40), 8),
        branch_parent=np.full(40, -1),
    )


def test_no_part_of_a_slow_plant_twitches_at_a_level_of_the_default_ladder():
    """A level that is named holds its error instead."""
    clip = drifting()

    def bends(positions: np.ndarray) -> float:
        return float(np.linalg.norm(np.diff(positions.astype(np.float64), 2, axis=0), axis=2).max())

    most, diagonal = bends(clip.block(0, 120)), np.linalg.norm(np.ptp(clip.block(0, 120), axis=(0, 1)))
    with athcodec.open(BytesIO(athcodec.encode(clip, rel_error=1e-4, effort="fast"))) as decoder:
        assert len(decoder.levels) == 4
        assert all(bends(decoder.positions(level=level.level)) <= 2 * most for level in decoder.levels)
    named = athcodec.encode(clip, rel_error=1e-4, effort="fast", ladder=(1e-2, 1e-3))
    with athcodec.open(BytesIO(named)) as decoder:
        assert decoder.levels[1].max_error <= 1e-2 * diagonal


def test_layers_are_finer_where_too_few_coarse_ones_move_as_smoothly_as_the_source(monkeypatch, tmp_path):
    """Such as in a calm between gusts. What jerks here is any stage that strays by more than 8e-4 of the diagonal."""
    clip, flaws = plant(seed=4, branches=12, longest=9, frames=40), SourceFrames.flaws
    rough = 8e-4 * float(np.linalg.norm(np.ptp(clip.rest, axis=0)))

    def rougher(source, decoded, before, away=np.inf):
        outside, jerk = flaws(source, decoded, before, away)
        return outside, 2 * MOST_JERK if away > rough else jerk

    monkeypatch.setattr(SourceFrames, "flaws", rougher)
    usual = athcodec.encode(clip, rel_error=1e-4)
    monkeypatch.setattr(decisions, "LEVELS_BYTES", 0)
    finer, made = athcodec.encode(clip, rel_error=1e-4), encoding.draft(clip, rel_error=1e-4)
    with athcodec.open(usual) as before, athcodec.open(finer) as after:
        assert len(before.levels) < len(after.levels)
    coded = encoding.code_segments(clip, made, range(made.segment_count))
    assert encoding.write(clip, made, coded, tmp_path / "parts.ath").path.read_bytes() == finer


def test_segments_that_were_coded_to_count_levels_are_coded_once_if_they_are_joined_to_no_other(monkeypatch):
    plants = {
        name: plant(seed=4, branches=5, longest=5, frames=frames) for name, frames in (("calm", 16), ("gale", 20))
    }
    clip, coded, motion = athcodec.join(plants), [], SegmentCoder._motion

    def counted(coder, index, *rest):
        coded.append(index)
        return motion(coder, index, *rest)

    monkeypatch.setattr(SegmentCoder, "_motion", counted)
    monkeypatch.setattr(decisions, "LEVELS_BYTES", 1 << 20)
    athcodec.encode(clip, rel_error=1e-4, effort="fast")
    assert sorted(coded) == [0, 1]


def test_levels_are_counted_by_the_errors_that_a_file_states(monkeypatch):
    """Those of frames that another pose stands for included."""
    clip, tables, chosen = plant(seed=4, branches=5, longest=5, frames=16), [], FileAssembly._chosen_levels
    positions = np.repeat(clip.positions, 2, axis=0)
    positions[1::2] += 1e-6 * np.linalg.norm(np.ptp(clip.rest, axis=0))
    held = clip.replace(positions=positions, time=np.arange(32) / 30)

    def kept(assembly, errors, *rest):
        tables.append(errors)
        return chosen(assembly, errors, *rest)

    monkeypatch.setattr(FileAssembly, "_chosen_levels", kept)
    monkeypatch.setattr(decisions, "LEVELS_BYTES", 0)
    athcodec.encode(held, rel_error=1e-3, ladder="decades", effort="fast")
    counted, *_, stated = tables
    assert len(tables) > 1 and np.array_equal(counted, stated)


def test_coding_segments_to_count_levels_counts_as_work(monkeypatch):
    clip = plant(seed=4, branches=5, longest=5, frames=32)
    monkeypatch.setattr(decisions, "LEVELS_BYTES", 0)
    monkeypatch.setattr(decisions.FileDecisions, "_typical_work", lambda *_: 1e30)
    draft = encoding.draft(clip, rel_error=1e-4, segment_frames=16)
    assert "levels" in draft.choice.untried
