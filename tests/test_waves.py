"""Waves over time: the same bits as the document's; what they are good for."""

from __future__ import annotations

import numpy as np
import pytest
from plants import blown_tree

import athcodec
from athcodec.encoding.model.motion import Waves, waves_over_time
from spec.document import File, rules

pytestmark = pytest.mark.sizes

FRAMES = (1, 2, 3, 4, 5, 8, 31, 64, 121, 200, 255, 256, 270)


@pytest.mark.parametrize("frames", FRAMES)
def test_waves_are_those_of_the_document_bit_for_bit(frames):
    for periodic, of_stems, of_nodes in ((False, Waves.SMOOTH, Waves.BEAM), (True, Waves.PERIODIC, Waves.PERIODIC)):
        assert waves_over_time(frames, of_stems).tolist() == rules.waves_over_time(frames, periodic)
        assert waves_over_time(frames, of_nodes).tolist() == rules.node_waves_over_time(frames, periodic)


def encoded_loop(clip, path, blend: int):
    return athcodec.encode(athcodec.looped(clip, blend), path, rel_error=1e-3, attributes="none", ladder="none")


def jerk_at_seam(path) -> float:
    """Second differences (RMS) across the seam of a loop, over those of the median frame."""
    with athcodec.open(path) as decoder:
        shown = decoder.positions(dtype=np.float64)
    bent = np.roll(shown, 1, axis=0) - 2 * shown + np.roll(shown, -1, axis=0)
    each = np.sqrt((bent**2).sum(axis=2).mean(axis=1))
    return float(max(each[0], each[-1]) / np.median(each))


def test_a_smooth_loop_is_coded_by_periodic_waves_and_smooth_at_its_seam(sample_clip, tmp_path):
    summary = encoded_loop(sample_clip, tmp_path / "loop.ath", 40)
    assert summary.choices["periodic"]
    assert jerk_at_seam(tmp_path / "loop.ath") < 2
    assert summary.seams[0].error <= 2 * summary.max_error_bound


def test_a_loop_that_jumps_is_not(sample_clip, tmp_path):
    summary = encoded_loop(sample_clip, tmp_path / "loop.ath", 0)
    assert not summary.choices["periodic"]
    assert summary.bytes < 3400


@pytest.mark.parametrize("ladder", ["none", "decades"])
def test_clips_of_a_file_are_periodic_each_for_itself(tmp_path, ladder):
    tree = blown_tree(seed=3, branches=24)
    clips = {"loop": athcodec.looped(tree, 40), "once": tree}
    path = tmp_path / "clips.ath"
    summary = athcodec.encode(athcodec.join(clips), path, rel_error=1e-3, ladder=ladder, effort="fast")
    document = File(path.read_bytes())
    assert [clip.periodic for clip in document.file.clips] == [True, False]
    with athcodec.open(path, strict=True) as decoder:
        played = [decoder.play(name).positions() for name in clips]
        assert np.concatenate(played).tobytes() == document.positions().tobytes()
        for shown, clip in zip(played, clips.values()):
            off = shown - np.float64(clip.block(0, clip.frame_count))
            assert np.linalg.norm(off, axis=2).max() <= summary.max_error_bound
