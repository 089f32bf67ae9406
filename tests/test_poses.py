"""Motion may be coded about another pose than the source's rest pose, which comes back all the same."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from files import coded
from plants import diagonal, distance

import athcodec
from athcodec.decoding import container as ct
from athcodec.encoding.model.quantise import SOURCE_REST_TOLERANCE
from athcodec.encoding.search.choices import learned_pieces
from athcodec.encoding.search.search import Search
from athcodec.errors import BadChecksum, Truncated
from bench.odd.bending import scanned_tree
from bench.scenes import fields
from bench.scenes.assembly import bare

pytestmark = pytest.mark.sizes

OPTIONS = {"rel_error": 1e-4, "segment_frames": 16, "tam": athcodec.Thresholds(0, 0, 0, 0)}  # not predicted


@pytest.fixture(autouse=True)
def about_mean(monkeypatch):
    """Files are made about the mean pose, whether it pays or not."""
    monkeypatch.setattr(Search, "about_best_reference", Search.about_mean_pose)


@pytest.mark.parametrize("ladder", ["none", "decades"])
def test_a_rest_pose_that_was_given_comes_back_within_its_tolerance(bushy_clip, tmp_path, ladder):
    athcodec.encode(bushy_clip, tmp_path / "a.ath", ladder=ladder, **OPTIONS)
    size = diagonal(bushy_clip)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert decoder.file.chunks.find(ct.SOURCE_REST)
        assert distance(decoder.level_rest(), bushy_clip.rest) > 10 * 1e-4 * size  # the bound
        assert distance(decoder.file.rest, bushy_clip.rest) <= SOURCE_REST_TOLERANCE * size
        assert distance(decoder.positions(), bushy_clip.block(0, bushy_clip.frame_count)) <= 1e-4 * size
        for level in range(decoder.file.level_count):
            maps = decoder.affines(3, level)
            node = int(np.argmin(maps.is_stem))
            if maps.is_stem[node]:
                continue
            some = slice(maps.first_vertex[node], maps.first_vertex[node] + maps.vertex_count[node])
            vertices = decoder.file.hierarchy.vertex_source[some]
            moved = decoder.level_rest(level)[vertices] @ maps.matrices[node, :, :3].T + maps.matrices[node, :, 3]
            assert distance(moved, decoder.positions(3, level)[vertices]) <= 1e-5 * size


@pytest.mark.slow
@pytest.mark.parametrize(("fraction", "most"), [(1e-3, 1.0), (1e-5, 0.95)])
def test_the_pose_that_is_chosen_makes_the_smaller_file(fraction, most, tmp_path, monkeypatch):
    def size() -> int:
        path = tmp_path / "a.ath"
        return athcodec.encode(clip, path, rel_error=fraction, ladder="none", attributes="none").bytes

    clip = scanned_tree(seed=3, frames=120, stems=120, longest=5, lean=0.6)  # far from its rest pose
    monkeypatch.undo()
    chosen = size()
    monkeypatch.setattr(Search, "about_best_reference", lambda search: search)
    assert chosen <= most * size()


def test_modes_of_short_stems_take_the_rounding_of_the_rest_pose_back(tmp_path, monkeypatch):
    def size() -> int:
        options = {"rel_error": 1e-4, "ladder": "none", "attributes": "none"}
        return sum(athcodec.encode(clip, tmp_path / "a.ath", **options).bytes for clip in clips)

    monkeypatch.undo()  # The pose is chosen.
    scenes = fields.kelp(seed=101, plants=4), fields.tubes(seed=101, plants=10, rings=16, sides=5)
    clips = [bare(scene.clip) for scene in scenes]
    learned_either_way = size()
    monkeypatch.setattr(learned_pieces, "learned_anew", lambda settings, trials, *_: settings)
    assert learned_either_way < 0.98 * size()


@pytest.mark.parametrize("options", [{"exact_rest": True}, {"lossless": True}])
def test_exact_rest_poses_come_back_bit_for_bit(bushy_clip, tmp_path, options):
    with coded(bushy_clip, tmp_path / "a.ath", **OPTIONS, **options, effort="fast") as decoder:
        assert decoder.file.rest.tobytes() == bushy_clip.source_rest.tobytes()
        assert not np.array_equal(decoder.level_rest(), bushy_clip.rest)


def test_a_rest_pose_that_was_made_is_not_stored(bushy_clip, tmp_path):
    clip = athcodec.MotionClip(
        bushy_clip.block(0, bushy_clip.frame_count), bushy_clip.time, bushy_clip.vertex_branch, bushy_clip.branch_parent
    )
    assert not clip.rest_given and not clip.replace(metadata={}).rest_given and bushy_clip.rest_given
    with coded(clip, tmp_path / "a.ath", **OPTIONS) as decoder:
        assert decoder.file.chunks.find(ct.SOURCE_REST) is None
        assert np.array_equal(decoder.file.rest, np.float32(decoder.level_rest()))


def test_shortened_files_keep_the_rest_pose(bushy_clip, tmp_path):
    athcodec.encode(bushy_clip, tmp_path / "a.ath", **OPTIONS)
    for level in (0, 3):
        athcodec.truncate(tmp_path / "a.ath", tmp_path / "cut.ath", level)
        with athcodec.open(tmp_path / "cut.ath", strict=True) as cut, athcodec.open(tmp_path / "a.ath") as whole:
            assert cut.file.chunks.payload(cut.file.chunks.find(ct.SOURCE_REST)) == whole.file.chunks.payload(
                whole.file.chunks.find(ct.SOURCE_REST)
            )
            closest = distance(cut.level_rest(), whole.level_rest())
            assert distance(cut.file.rest, whole.file.rest) <= 4 * closest + 1e-6


def test_a_damaged_rest_pose_is_refused_by_those_who_ask_for_it(bushy_clip, tmp_path):
    with coded(bushy_clip, tmp_path / "a.ath", **OPTIONS) as decoder:
        chunk = decoder.file.chunks.find(ct.SOURCE_REST)
    data = bytearray((tmp_path / "a.ath").read_bytes())
    data[chunk.offset + chunk.length - 1] ^= 1
    with athcodec.open(BytesIO(data)) as decoder:
        assert decoder.positions(3).shape == decoder.level_rest().shape
        with pytest.raises(BadChecksum, match="SOURCE_REST"):
            decoder.file.rest  # noqa: B018
        with pytest.raises(BadChecksum, match="SOURCE_REST"):
            decoder.file.check()


def test_a_file_cut_off_behind_its_motion_says_that_the_rest_pose_is_missing(bushy_clip):
    data = athcodec.encode(bushy_clip, **OPTIONS)
    with athcodec.open(data) as whole:
        assert not whole.file.tables.rest_is_missing and not whole.file.missing
        end, motion = whole.file.levels[-1].bytes, whole.positions()
        assert end <= whole.file.chunks.find(ct.SOURCE_REST).offset
    with athcodec.open(BytesIO(data[:end])) as cut:
        assert cut.file.tables.rest_is_missing and cut.file.missing == "rest pose of the source"
        assert np.array_equal(cut.positions(), motion)
        assert np.array_equal(cut.file.rest, cut.level_rest().astype(cut.file.rest.dtype))
        with pytest.raises(Truncated, match="SOURCE_REST"):
            cut.file.rest_at(0)


def test_joined_clips_share_both_poses(medley_clips, tmp_path):
    joined = athcodec.join(medley_clips)
    with coded(joined, tmp_path / "a.ath", **OPTIONS, effort="fast") as decoder:
        assert joined.rest_given == (decoder.file.chunks.find(ct.SOURCE_REST) is not None)
        assert distance(decoder.file.rest, joined.rest) <= SOURCE_REST_TOLERANCE * diagonal(joined)
        for clip in decoder.file.clips:
            assert np.array_equal(decoder.play(clip.name).level_rest(), decoder.level_rest())
