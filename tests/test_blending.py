"""Clips of one file at once, by weights: branches stay attached, edges keep their lengths, nothing jumps; and clips
that are chosen by their wind."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plants import clip_of
from test_wasm import digest, run_node

import athcodec
from athcodec.cli import main
from athcodec.decoding import core_file
from athcodec.errors import ClipError, ClipUnavailable
from athcodec.motion.joining import in_wind
from bench.trees import wind as winds
from bench.trees.beams import bend
from bench.trees.mesh import dress
from bench.trees.plant import grow
from bench.trees.wind import Wind

FRAMES = 24
SECONDS = (0.0, 0.21, 0.55)
WINDS = {"calm": (2.0, 0.0), "storm": (8.0, 0.0), "across": (8.0, 90.0)}
DIRECTIONS = {0.0: winds.DIRECTION, 90.0: np.array([1.0, 0.0, 1.0]) / math.sqrt(2)}


def beams(plant, wind: Wind, frames: int) -> athcodec.MotionClip:
    positions, more = bend(plant, wind, frames, 30.0), {"attributes": {"radius": plant.radius.astype(np.float32)}}
    return clip_of(positions, plant.position, plant.branch, plant.branch_parent, edges=plant.edges, **more)


def simulated(leaves: int = 0) -> athcodec.MotionClip:
    """A small tree of beams in three winds."""
    plant, clips = grow(300, 2, 8.0, seed=3), {}
    with pytest.MonkeyPatch.context() as patched:
        for name, (speed, heading) in WINDS.items():
            patched.setattr(winds, "DIRECTION", DIRECTIONS[heading])
            wind = Wind(speed, 8.0, seed=3)
            clip = beams(plant, wind, FRAMES)
            clip = dress(clip, wind, FRAMES, leaves, 3) if leaves else clip
            clips[name] = in_wind(clip, speed, heading)
    return athcodec.join(clips)


def _encoded(clip, path):
    athcodec.encode(clip, path, rel_error=1e-4, ladder="none", effort="fast")
    return path


@pytest.fixture(scope="module")
def tree_ath(tmp_path_factory):
    return _encoded(simulated(), tmp_path_factory.mktemp("blending") / "tree.ath")


@pytest.fixture(scope="module")
def leafed_ath(tmp_path_factory):
    return _encoded(simulated(leaves=40), tmp_path_factory.mktemp("blending") / "leafed.ath")


def _shown(decoder, name, seconds, level=None):
    return decoder.blended({name: 1.0}, seconds, level)


def _edges(decoder) -> np.ndarray:
    """(E, 2): along the stems, and from each branch to the vertex that it hangs on."""
    return np.asarray(decoder.file.edges).reshape(-1, 2)


def _lengths(positions, edges):
    return np.linalg.norm(np.float64(positions)[edges[:, 1]] - positions[edges[:, 0]], axis=1)


def _kept(decoder, weights, edges, rounding):
    """Which edges of a blend are as long as in one of its clips or between them, at all times."""
    for seconds in SECONDS:
        blended = _lengths(decoder.blended(weights, seconds), edges)
        own = np.array([_lengths(_shown(decoder, name, seconds), edges) for name in weights])
        yield np.maximum(blended - own.max(axis=0) * 1.01, own.min(axis=0) * 0.99 - blended) <= rounding


MIXTURES = [{"calm": 0.5, "storm": 0.5}, {"storm": 0.5, "across": 0.5}, {"calm": 0.2, "storm": 0.5, "across": 0.3}]


@pytest.mark.parametrize("weights", MIXTURES)
def test_edges_of_stems_keep_the_lengths_that_they_have_in_the_clips(tree_ath, weights):
    with athcodec.open(tree_ath) as decoder:
        edges = _edges(decoder)
        for kept in _kept(decoder, weights, edges, 1e-5 * np.ptp(decoder.file.rest, axis=0).max()):
            assert kept.all()


def test_clips_that_are_far_apart_are_blended_and_not_merely_averaged(tree_ath):
    """A mean of positions shortens what points different ways: what this is for."""
    with athcodec.open(tree_ath) as decoder:
        edges, names = _edges(decoder), ("storm", "across")
        both = [_shown(decoder, name, 0.55) for name in names]
        mean, least = _lengths(np.mean(both, axis=0), edges), np.min([_lengths(x, edges) for x in both], axis=0)
        blended = _lengths(decoder.blended(dict.fromkeys(names, 0.5), 0.55), edges)
        assert (mean / least).min() < 0.995 < (blended / least).min()


@pytest.mark.parametrize("weights", MIXTURES)
def test_nearly_all_edges_of_a_mesh_keep_their_lengths(leafed_ath, weights):
    with athcodec.open(leafed_ath) as decoder:
        edges = _face_edges(decoder)
        for kept in _kept(decoder, weights, edges, 2 * decoder.file.max_error_bound):
            assert kept.mean() > 0.999


def _face_edges(decoder):
    faces = decoder.file.faces
    return np.unique(np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)), axis=0)


@pytest.mark.parametrize("level", [0, 1, None])
def test_one_clip_alone_is_that_clip_to_the_bit(tree_ath, level):
    with athcodec.open(tree_ath) as decoder:
        for name in WINDS:
            frame = decoder.play(name).positions(7, level)
            weights = dict.fromkeys(WINDS, 0.0) | {name: 3.5}
            assert np.array_equal(decoder.blended(weights, 7 / 30 + 1e-12, level).round(4), frame.round(4))
            assert np.array_equal(decoder.blended(weights, 0.0, level), decoder.play(name).positions(0, level))


def test_weights_change_it_without_a_jump(tree_ath):
    with athcodec.open(tree_ath) as decoder:
        size = np.linalg.norm(np.ptp(decoder.file.rest, axis=0))
        for level in (0, 1, None):
            steps = [
                decoder.blended({"storm": 1 - part, "across": part}, 0.55, level) for part in np.linspace(0, 1, 41)
            ]
            moves = np.array([np.linalg.norm(b - a, axis=1).max() for a, b in zip(steps, steps[1:])])
            apart = np.linalg.norm(np.float64(steps[-1]) - steps[0], axis=1).max()
            assert moves.max() < 3 * apart / 40
            near = decoder.blended({"storm": 1, "across": 1e-9}, 0.55, level)
            assert np.linalg.norm(near - steps[0], axis=1).max() < 1e-5 * size


def test_weights_count_by_their_shares(tree_ath):
    with athcodec.open(tree_ath) as decoder:
        one, other = (decoder.blended({"calm": w, "storm": 3 * w}, 0.3) for w in (0.25, 1e200))
        assert np.allclose(one, other, atol=1e-5)


def test_each_clip_has_a_time_and_a_level_of_its_own(tree_ath):
    with athcodec.open(tree_ath) as decoder:
        seconds, levels = {"calm": 0.1, "storm": 0.5}, {"calm": 0, "storm": decoder.file.deepest}
        shown = decoder.blended({"calm": 1e-9, "storm": 1}, seconds, levels)
        assert np.allclose(shown, _shown(decoder, "storm", 0.5), atol=1e-4)


def test_transitions_in_the_metadata_are_read_and_a_host_blends_over_them(tmp_path):
    """From frame L on, a clip may blend over N frames into what begins at frame E."""
    clips, transitions = athcodec.split(simulated()), [[18, 3, 4], [15, 1, 3]]
    clips["storm"] = clips["storm"].replace(metadata=clips["storm"].metadata | {"transitions": transitions})
    with athcodec.open(_encoded(athcodec.join(clips), tmp_path / "tree.ath")) as decoder:
        assert "transitions" not in decoder.play("calm").metadata
        storm, edges = decoder.play("storm"), _edges(decoder)
        assert storm.metadata["transitions"] == transitions and storm.file.info()["clips"][1]["wind"]
        leave, enter, frames = transitions[0]
        rounding = 1e-5 * np.ptp(decoder.file.rest, axis=0).max()
        for passed, share in ((0.0, 1e-9), (frames / 2, 0.5), (frames, 1 - 1e-9)):
            places = [((leave + passed) / 30, 1 - share), ((enter + passed) / 30, share)]
            ends = [storm.blended_places([(seconds, 1.0)]) for seconds, _ in places]
            lengths = np.array([_lengths(end, edges) for end in ends])
            shown = storm.blended_places(places)
            assert np.allclose(shown, ends[round(share)], atol=1e-4) or share == 0.5
            blended = _lengths(shown, edges)
            assert (blended <= lengths.max(axis=0) * 1.01 + rounding).all()
            assert (blended >= lengths.min(axis=0) * 0.99 - rounding).all()
        with pytest.raises(ValueError, match="places"):
            storm.blended_places([])


def test_weights_that_say_nothing_are_refused(tree_ath):
    with athcodec.open(tree_ath) as decoder:
        for weights in ({}, {"calm": 0.0}, {"calm": math.nan}, {"calm": math.inf}, {"calm": -1.0}):
            with pytest.raises(ValueError, match="weights"):
                decoder.blended(weights, 0.0)
        with pytest.raises(ClipUnavailable):
            decoder.blended({"hurricane": 1.0}, 0.0)


# ---- wind ----


def test_the_wind_of_each_clip_chooses_the_clips(tree_ath):
    with athcodec.open(tree_ath) as decoder:
        assert decoder.wind_weights(2, 40) == {"calm": 1}
        assert decoder.wind_weights(0, 0) == {"calm": 1} and decoder.wind_weights(99, 0) == {"storm": 1}
        assert decoder.wind_weights(8, 45) == pytest.approx({"storm": 0.5, "across": 0.5})
        assert decoder.wind_weights(5, 0) == pytest.approx({"calm": 0.5, "storm": 0.5})
        assert decoder.wind_weights(8, 225) == pytest.approx({"storm": 0.5, "across": 0.5})  # the long way round
        assert decoder.wind_weights(8, -360 * 5) == {"storm": 1}
        assert decoder.blended(decoder.wind_weights(5, 45), 0.2).shape == (decoder.file.vertex_count, 3)


def test_at_most_four_clips_are_blended_and_weights_have_no_jumps():
    rng = np.random.default_rng(1)
    given = np.stack([rng.integers(0, 4, 24) * 3.0, rng.integers(0, 12, 24) * 30.0], axis=1)
    turns, strengths = np.linspace(-400, 800, 4001), np.linspace(-1, 12, 4001)
    for path in (
        [core_file.wind_weights(given, 5.0, heading) for heading in turns],
        [core_file.wind_weights(given, strength, 77.0) for strength in strengths],
    ):
        weights = np.array(path)
        assert np.allclose(weights.sum(axis=1), 1) and (weights >= 0).all() and ((weights > 0).sum(axis=1) <= 4).all()
        assert np.abs(np.diff(weights, axis=0)).max() < 0.02


def test_clips_without_a_wind_show_the_first():
    assert core_file.wind_weights(np.full((3, 2), np.nan), 4, 90).tolist() == [1, 0, 0]
    assert core_file.wind_weights(np.array([[np.nan, 0], [5, 0]]), 1, 0).tolist() == [0, 1]
    assert np.isfinite(core_file.wind_weights(np.array([[1.0, 1e300], [1.0, 5.0]]), math.nan, math.inf)).all()


def test_a_wind_is_stored_with_its_clip_and_kept_by_truncation(tree_ath, tmp_path):
    cut = tmp_path / "cut.ath"
    athcodec.truncate(tree_ath, cut, level=1)
    for path in (tree_ath, cut):
        with athcodec.open(path) as decoder:
            for name, (strength, heading) in WINDS.items():
                metadata = decoder.play(name).metadata
                assert (metadata["strength"], metadata["heading"]) == (strength, heading)


def test_a_wind_that_is_none_is_refused():
    clip = athcodec.MotionClip(np.zeros((1, 2, 3), np.float32), [0.0], [0, 0], [-1])
    for strength, heading in ((-1.0, 0.0), (math.nan, 0.0), (1.0, math.inf)):
        with pytest.raises(ClipError, match="wind"):
            in_wind(clip, strength, heading)


def test_the_command_line_takes_the_winds_of_clips(tmp_path, capsys):
    source, out = str(athcodec.sample_path()), str(tmp_path / "out.ath")
    command = ["encode", source, source, "-o", out, "--names", "calm,storm", "--rel-error", "1e-2"]
    assert main([*command, "--strength", "2"]) != 0 and "--strength" in capsys.readouterr().err
    assert main([*command, "--heading", "2,3"]) != 0 and "--heading" in capsys.readouterr().err
    assert main([*command, "--strength", "2,12", "--heading", "0,-90"]) == 0
    capsys.readouterr()
    assert main(["info", out]) == 0
    shown = capsys.readouterr().out
    assert "wind" in shown and "12 to 270" in shown


BLEND_IN_NODE = """
const file = AthFile.open(read(path)), level = file.info.levelCount - 1, segments = prepareAll(file, level);
const winds = [{ strength: 2, heading: 0 }, { strength: 8, heading: 0 }, { strength: 8, heading: 90 }, null];
const weights = file.windWeights(winds, 5, 45).slice(0, 3);
const shares = weights.map((weight, i) => ({ segments, frame: file.frameAt(0.55, "marked", i), weight }));
const alone = shares.map((share, i) => ({ ...share, weight: i === 1 ? 2 : 0 }));
answer({
  weights,
  blended: digest(file.blended(shares)),
  alone: same(file.blended(alone), file.positions(segments, shares[1].frame)),
  missing: thrown(() => file.blended([shares[0], { segments: [], frame: file.clips[1].firstFrame, weight: 1 }])),
  refused: [() => file.blended([]), () => file.blended([{ ...shares[0], weight: -1 }]),
            () => file.blended([...shares, ...shares])].map((call) => thrown(call) !== null),
});
"""


@pytest.mark.web
def test_webassembly_blends_to_the_same_bits(tree_ath, tmp_path):
    shown = run_node(tmp_path, BLEND_IN_NODE, tree_ath)
    with athcodec.open(tree_ath) as decoder:
        weights = decoder.wind_weights(5, 45)
        assert shown["weights"] == list(weights.values())
        assert shown["blended"] == digest(decoder.blended(weights, 0.55))
    assert shown["alone"] and shown["refused"] == [True, True, True]
    assert shown["missing"]["codeName"] == "NOT_PREPARED" and "got no segment, expected" in shown["missing"]["message"]
