"""Plants that grow beside plants that sway: prediction codes the former, modes the latter, in one file."""

from __future__ import annotations

import numpy as np
import pytest
from files import opened

import athcodec
from athcodec import MotionClip, encoding
from athcodec._native import LOOSE
from bench.odd.growing import growth

pytestmark = pytest.mark.sizes

FRAMES = 60  # Frames of a scene, 2 s, in which growth comes to its end.
STEMS = 40  # Stems that sway: about as many vertices as the plant that grows has, or twice that.
POINTS = 24  # Vertices of each stem, a single piece.


def grown(seed: int, frames: int = FRAMES) -> MotionClip:
    return growth(seed, frames, 400).replace(edges=None)


def swaying(seed: int, size: float, frames: int = FRAMES) -> MotionClip:
    """Upright stems, each of which sways in its own time."""
    random, along = np.random.default_rng(seed), np.linspace(0, 1, POINTS)
    place, heading = random.uniform(-1, 1, (2, STEMS)), random.uniform(0, 6, STEMS)
    times = np.multiply.outer(np.arange(frames) / 30, random.uniform(3, 6, STEMS)) + random.uniform(0, 6, STEMS)
    bend = (random.uniform(0.05, 0.15, STEMS) * np.sin(times))[:, :, None] * along**2
    positions = np.empty((frames, STEMS, POINTS, 3))
    positions[..., 0] = place[0][:, None] + bend * np.cos(heading)[:, None]
    positions[..., 1] = random.uniform(0.6, 1.0, STEMS)[:, None] * along
    positions[..., 2] = place[1][:, None] + bend * np.sin(heading)[:, None]
    return MotionClip(
        (size * positions.reshape(frames, -1, 3)).astype(np.float32),
        np.arange(frames) / 30,
        vertex_branch=np.repeat(np.arange(STEMS), POINTS),
        branch_parent=np.full(STEMS, -1),
    )


def side_by_side(one: MotionClip, other: MotionClip, apart: float) -> MotionClip:
    """Both plants in one scene, the other one first, its root not the first of the file."""
    frames = min(one.frame_count, other.frame_count)
    moved = other.block(0, frames) + np.float32([apart, 0, 0])
    return MotionClip(
        np.concatenate([moved, one.block(0, frames)], axis=1),
        np.arange(frames) / 30,
        vertex_branch=np.concatenate([other.vertex_branch, one.vertex_branch + other.branch_count]),
        branch_parent=np.concatenate(
            [other.branch_parent, np.where(one.branch_parent < 0, -1, one.branch_parent + other.branch_count)]
        ),
    )


def diagonal(clip: MotionClip) -> float:
    return float(np.linalg.norm(np.ptp(clip.block(0, clip.frame_count).reshape(-1, 3), axis=0)))


def scene(seed: int, frames: int = FRAMES) -> tuple[MotionClip, MotionClip, MotionClip, float]:
    """A plant that grows, plants that sway, both in one scene, and the bound."""
    one = grown(seed, frames)
    size = diagonal(one)
    other = swaying(seed, size / 2, frames)
    return one, other, side_by_side(one, other, 2 * size), 1e-4 * size


def encoded(clip: MotionClip, bound: float, **options) -> bytes:
    return athcodec.encode(clip, max_error=bound, attributes="none", **options)


def distances(data: bytes, clip: MotionClip, level: int | None = None) -> np.ndarray:
    with opened(data) as decoder:
        shown = decoder.positions(level=level) if level is not None else decoder.positions()
        return np.linalg.norm(np.asarray(shown).astype(float) - clip.block(0, clip.frame_count), axis=2)


@pytest.mark.parametrize("options", [{"ladder": "none"}, {}], ids=["one layer", "layers"])
def test_growth_beside_sway_costs_about_what_both_cost_apart(options):
    one, other, both, bound = scene(seed=4)
    parts = sum(len(encoded(clip, bound, **options)) for clip in (one, other))
    data = encoded(both, bound, **options)
    assert len(data) <= 1.1 * parts
    with opened(data) as decoder:
        flags, parent = decoder.file.tables.branches["flags"], decoder.file.tables.branches["parent"]
        assert ((flags & LOOSE > 0) & (parent < 0)).sum() == (one.branch_parent < 0).sum()
    assert distances(data, both).max() <= bound


def test_each_level_is_off_by_what_the_file_says_and_none_is_worse_than_the_one_before():
    *_, both, bound = scene(seed=5)
    data = encoded(both, bound)
    with opened(data) as decoder:
        levels = decoder.levels
    assert len(levels) > 2
    errors = [distances(data, both, level) for level in range(len(levels))]
    for level, found in zip(levels, errors):
        assert found.max() <= 1.001 * level.max_error
        assert np.sqrt(np.square(found).mean()) == pytest.approx(level.rms_error, rel=0.1)
    largest = [error.max() for error in errors]
    assert largest == sorted(largest, reverse=True)


def test_segments_are_predicted_each_by_itself_and_shortened_files_show_the_same(tmp_path):
    *_, both, bound = scene(seed=6, frames=90)
    data = encoded(both, bound, segment_frames=30)
    assert distances(data, both).max() <= bound
    with opened(data) as decoder:
        assert decoder.file.info()["segments"] == 3
        count = len(decoder.levels)
    (tmp_path / "whole.ath").write_bytes(data)
    assert athcodec.truncate(tmp_path / "whole.ath", tmp_path / "short.ath", level=count - 2) < len(data)
    shown = [distances(some, both, count - 2) for some in ((tmp_path / "short.ath").read_bytes(), data)]
    assert np.array_equal(*shown)


def test_what_stands_still_beside_both_costs_little():
    one, other, both, bound = scene(seed=7)
    ground = np.random.default_rng(1).uniform(-1, 1, (400, 3)).astype(np.float32) * [1, 0, 1]
    still = MotionClip(
        np.repeat(ground[None].astype(np.float32), FRAMES, axis=0),
        np.arange(FRAMES) / 30,
        vertex_branch=np.zeros(400, int),
        branch_parent=[-1],
    )
    all_three = side_by_side(both, still, -3 * diagonal(one))
    data = encoded(all_three, bound, ladder="none")
    assert len(data) <= 1.1 * (len(encoded(both, bound, ladder="none")) + len(encoded(still, bound, ladder="none")))
    assert distances(data, all_three).max() <= bound


def test_a_draft_is_coded_elsewhere_as_here(tmp_path):
    *_, both, bound = scene(seed=8)
    draft = encoding.draft(both, max_error=bound, attributes="none")
    assert draft.choice.settings.predicted_trees is not None
    coded = encoding.code_segments(both, draft, range(draft.segment_count))
    encoding.write(both, draft, list(coded), tmp_path / "whole.ath")
    assert (tmp_path / "whole.ath").read_bytes() == encoded(both, bound)


def test_lossless_files_have_no_predicted_trees_beside_others():
    one, other, both, bound = scene(seed=9)
    data = encoded(both, bound, lossless=True)
    assert distances(data, both).max() == 0
