"""Vertices that coincide are coded once, at their place, and come back for each vertex."""

from __future__ import annotations

import io

import numpy as np
import pytest
from moving_meshes import leafed_tree
from plants import bound_for, diagonal, plant, ring_quads, tube

import athcodec
from athcodec.encoding.clip.places import PlacedClip, find_places
from athcodec.encoding.options.features import Feature
from athcodec.motion.clip import MotionClip
from athcodec.motion.places import Places

pytestmark = pytest.mark.sizes

ALONE = {"attributes": "none", "ladder": "none", "rest_error": "bound"}


def split_of(clip: MotionClip, order: np.ndarray, faces: np.ndarray | None = None, **more) -> MotionClip:
    """The clip with vertices `order` of it, of which some may come several times."""
    branches = {} if clip.vertex_branch is None else {"vertex_branch": clip.vertex_branch[order]}
    branches |= {"branch_parent": clip.branch_parent, "rest": clip.source_rest[order]}
    positions = clip.block(0, clip.frame_count)[:, order]
    return MotionClip(positions, clip.time, faces=faces, **branches | more)


def tube_mesh(rings: int, around: int, frames: int) -> MotionClip:
    """A tube of quadrangles that names no branches."""
    moved = tube(rings, around, frames)
    return MotionClip(moved.block(0, frames), moved.time, rest=moved.source_rest, faces=ring_quads(rings, around))


def by_faces(clip: MotionClip) -> MotionClip:
    """The clip with vertices of its own for each face, as flat shading has them."""
    return split_of(clip, clip.faces.reshape(-1), np.arange(clip.faces.size).reshape(clip.faces.shape))


def size(clip: MotionClip, **options) -> int:
    out = io.BytesIO()
    athcodec.encode(clip, out, **{"rel_error": 1e-4} | ALONE | options)
    return len(out.getvalue())


def decoded(clip: MotionClip, **options) -> athcodec.Decoder:
    out, bound = io.BytesIO(), {} if "max_error" in options else {"rel_error": 1e-4}
    athcodec.encode(clip, out, **bound | options)
    return athcodec.open(out.getvalue())


def shuffled(count: int, more: int, seed: int = 1) -> np.ndarray:
    """All of so many vertices, and more of them again, in any order."""
    rng = np.random.default_rng(seed)
    return rng.permutation(np.append(np.arange(count), rng.integers(0, count, more)))


# ---- finding them ----


def test_places_are_numbered_by_their_first_vertices():
    clip = plant(1, branches=4)
    order = np.array([5, 2, 5, 7, 2, 2])
    places = find_places(split_of(clip, order, vertex_branch=np.zeros(6, int), branch_parent=[-1]))
    assert places.of_vertex.tolist() == [0, 1, 0, 2, 1, 1]
    assert places.first.tolist() == [0, 1, 3]
    assert places.sizes.tolist() == [2, 3, 1]


@pytest.mark.parametrize("frame", [0, 7, 29])
def test_vertices_that_part_in_one_frame_are_at_different_places(frame):
    positions = np.repeat(plant(2, branches=1, longest=4).block(0, 30), 2, axis=1)
    positions[frame, 3, 1] = np.nextafter(positions[frame, 3, 1], np.float32(9))
    clip = MotionClip(positions, np.arange(30) / 30, rest=np.repeat(np.eye(3, 3)[:1], positions.shape[1], axis=0))
    expected = [v // 2 for v in range(positions.shape[1])]
    expected = [place + (v > 2) for v, place in enumerate(expected)]
    assert find_places(clip).of_vertex.tolist() == expected


def test_vertices_that_lie_together_and_then_part_in_groups_are_at_a_place_for_each_group():
    rng = np.random.default_rng(3)
    groups, positions = np.repeat(np.arange(20), 5), np.zeros((40, 100, 3), np.float32)
    for frame in range(20):
        positions[frame + 20 :, groups == frame] += rng.random(3).astype(np.float32)
    clip = MotionClip(positions, np.arange(40) / 30)
    assert find_places(clip).of_vertex.tolist() == groups.tolist()


def test_zeros_of_different_signs_are_one_number_unless_the_file_is_lossless(tmp_path):
    positions = np.zeros((3, 2, 3), np.float32)
    positions[:, 1, 0] = -0.0
    clip = MotionClip(positions, np.arange(3) / 30)
    assert find_places(clip).count == 1
    assert find_places(clip, zeros_differ=True).count == 2
    athcodec.encode(clip, tmp_path / "zeros.ath", lossless=True)
    with athcodec.open(tmp_path / "zeros.ath") as decoder:
        assert np.array_equal(np.signbit(np.asarray(decoder)), np.signbit(positions))


def test_vertices_of_different_branches_weights_objects_or_rest_poses_are_at_different_places():
    positions = np.zeros((4, 4, 3), np.float32) + np.arange(4, dtype=np.float32)[:, None, None]
    time = np.arange(4) / 30
    named = MotionClip(positions, time, vertex_branch=[0, 0, 1, 1], branch_parent=[-1, 0])
    assert find_places(named).of_vertex.tolist() == [0, 0, 1, 1]
    labelled = MotionClip(positions, time, attributes={"branch_id": np.array([4, 9, 9, 4])})
    assert find_places(labelled).of_vertex.tolist() == [0, 1, 1, 0]
    objects = MotionClip(positions, time, attributes={"part_vertex_counts": np.array([1, 3])})
    assert find_places(objects).of_vertex.tolist() == [0, 1, 1, 1]
    posed = MotionClip(positions, time, rest=np.array([[0, 0, 0], [0, 0, 1], [0, 0, 0], [0, 0, 1.0]]))
    assert find_places(posed).of_vertex.tolist() == [0, 1, 0, 1]
    assert find_places(MotionClip(positions, time), [np.array([1.0, 2.0, 1.0, 1.0])]).of_vertex.tolist() == [0, 1, 0, 0]


def test_copies_of_a_shape_keep_as_many_vertices_as_each_other():
    shape = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    positions = np.stack([np.concatenate([shape, shape + 2, shape + 4]) + t for t in range(3)]).astype(np.float32)
    positions[:, 6, 2] += 1e-3  # In the second copy the two vertices differ.
    copies = {"part_vertex_counts": np.array([12]), "part_copies": np.array([3])}
    clip = MotionClip(positions, np.arange(3) / 30, attributes=copies)
    assert find_places(clip).count == 12
    positions[:, 6, 2] -= 1e-3
    positions[:, 6] = positions[:, 5]
    coded = PlacedClip.of(clip, find_places(MotionClip(positions, clip.time, attributes=copies))).clip
    assert coded.vertex_count == 9
    assert coded.attributes["part_vertex_counts"].tolist() == [9]


def test_frames_are_read_no_further_than_vertices_are_equal():
    class Counting:
        shape, dtype, read = (50, 30, 3), np.dtype(np.float32), 0

        def __getitem__(self, frames):
            start, stop, _ = frames.indices(50)
            self.read = max(self.read, stop)
            return np.random.default_rng(1).random((50, 30, 3))[start:stop].astype(np.float32)

    positions = Counting()
    clip = MotionClip(positions, np.arange(50) / 30)
    positions.read = 0
    assert find_places(clip).count == 30
    assert positions.read == 1


def test_vertices_of_other_faces_that_stay_near_share_a_place_and_the_bound_holds_for_them():
    mesh = by_faces(tube_mesh(40, 8, 20))
    rng = np.random.default_rng(5)
    positions = mesh.block(0, 20) + rng.normal(scale=1e-6 * diagonal(mesh), size=(1, mesh.vertex_count, 3))
    clip = MotionClip(positions.astype(np.float32), mesh.time, faces=mesh.faces)
    bound = 1e-4 * diagonal(clip)
    assert find_places(clip).count == clip.vertex_count
    places = find_places(clip, most_error=bound / 16)
    assert places.count == 320
    assert 0 < places.error <= bound / 16
    with decoded(clip, max_error=bound, ladder="none", effort="fast") as decoder:
        assert decoder.file.core.info.place_count == 320
        assert np.linalg.norm(np.asarray(decoder) - clip.block(0, 20), axis=2).max() <= bound


def test_near_vertices_of_one_face_stay_apart():
    mesh = by_faces(tube_mesh(40, 8, 20))
    positions = mesh.block(0, 20).copy()
    positions[:, 1] = positions[:, 0] + np.float32(1e-6 * diagonal(mesh))  # The first face has hardly any width.
    clip = MotionClip(positions, mesh.time, faces=mesh.faces)
    places = find_places(clip, most_error=1e-5 * diagonal(mesh))
    assert places.of_vertex[0] != places.of_vertex[1]


# ---- what comes out ----


@pytest.mark.parametrize(
    "options",
    [{}, {"ladder": "none"}, {"lossless": True}, {"exact_rest": True}, {"segment_frames": 16}, {"attributes": "none"}],
    ids=str,
)
def test_a_split_clip_decodes_to_the_very_bits_of_the_welded_one(options):
    clip = plant(4, branches=9, longest=7, roots=2)
    order = np.concatenate([np.arange(clip.vertex_count), np.arange(0, clip.vertex_count, 3)])
    options = {"effort": "fast"} | options
    with decoded(clip, **options) as whole, decoded(split_of(clip, order), **options) as split:
        assert split.file.core.info.place_count == clip.vertex_count
        assert np.array_equal(np.asarray(split), np.asarray(whole)[:, order])
        assert np.array_equal(split.file.rest, whole.file.rest[order])


def test_each_vertex_has_the_branch_and_the_attributes_of_the_source():
    clip = plant(5, branches=9, longest=7)
    order = shuffled(clip.vertex_count, 40)
    radius = np.random.default_rng(2).random(len(order))
    source = split_of(clip, order, attributes={"radius": radius}, edges=np.array([[0, 1], [2, len(order) - 1]]))
    with decoded(source) as decoder:
        file = decoder.file
        assert file.vertex_count == len(order)
        assert np.array_equal(file.vertex_branch, source.vertex_branch)
        assert np.array_equal(file.branch_parent, source.branch_parent)
        assert np.array_equal(file.attributes["radius"], radius)
        assert np.array_equal(file.edges, source.edges)
        assert np.linalg.norm(file.rest - source.rest, axis=1).max() <= bound_for(source, 1e-2)
        # Branches come back as stems of all vertices, so a copy of the file can be encoded again.
        again = MotionClip(
            np.asarray(decoder), decoder.time, file.vertex_branch, file.branch_parent, stem_index=file.stem_index
        )
        assert again.vertex_count == len(order)


def test_matrices_and_residuals_are_those_of_all_vertices():
    clip = plant(6, branches=9, longest=7)
    order = shuffled(clip.vertex_count, 40)
    with decoded(split_of(clip, order), rel_error=1e-3, ladder="none", effort="fast") as decoder:
        parts, hierarchy = decoder.affines(3, 0), decoder.file.hierarchy
        assert int(parts.vertex_count.sum()) == len(order)
        rest, shown = decoder.level_rest(0)[hierarchy.vertex_source], decoder.positions(3, 0)[hierarchy.vertex_source]
        for first, count, matrix, is_stem in zip(parts.first_vertex, parts.vertex_count, parts.matrices, parts.is_stem):
            rows = slice(first, first + count)
            if not is_stem:
                assert np.abs(rest[rows] @ matrix[:, :3].T + matrix[:, 3] - shown[rows]).max() < 1e-4 * diagonal(clip)
        residual = decoder.residual(3, 0)
        assert residual.shape == (len(order), 3)
        assert np.isfinite(residual).all()


def test_errors_of_levels_count_vertices_and_not_places():
    clip = plant(7, branches=6, longest=9, rough=0.05)
    order = np.append(np.arange(clip.vertex_count), np.full(500, clip.vertex_count - 1))
    source = split_of(clip, order)
    with decoded(source, rel_error=1e-2, ladder="none") as decoder:
        for level in decoder.levels:
            off = np.linalg.norm(decoder.positions(level=level.level) - source.block(0, 30).astype(float), axis=2)
            assert off.max() <= level.max_error
            assert np.sqrt((off**2).mean()) <= level.rms_error * 1.0001
            assert np.quantile(off, 0.99, method="higher") <= level.p99_error * 1.0001


def test_faces_come_back_as_they_are_whatever_vertices_share_places():
    rng = np.random.default_rng(8)
    clip, order = plant(8, branches=5), shuffled(plant(8, branches=5).vertex_count, 90)
    for faces in (rng.integers(0, len(order), (200, 3)), np.arange(len(order) // 4 * 4).reshape(-1, 4)[::-1]):
        with decoded(split_of(clip, order, faces)) as decoder:
            assert np.array_equal(decoder.file.faces, faces)


def test_a_loop_of_several_clips_keeps_its_seams():
    still = plant(9, branches=5, frames=20)
    order = shuffled(still.vertex_count, 30)
    looped = athcodec.looped(split_of(still, order))
    with decoded(looped) as decoder:
        assert decoder.clip.loop
        assert len(decoder.clip.seam_errors) == decoder.file.level_count


def test_weights_hold_for_each_vertex():
    clip = plant(10, branches=5)
    order = np.append(np.arange(clip.vertex_count), np.arange(clip.vertex_count))
    weights = np.where(np.arange(len(order)) < clip.vertex_count, 1.0, 0.1)
    source, bound = split_of(clip, order), 1e-2 * diagonal(clip)
    with decoded(source, max_error=bound, weights=weights, ladder="none") as decoder:
        off = np.linalg.norm(np.asarray(decoder) - source.block(0, 30).astype(float), axis=2).max(axis=0)
        assert (off <= bound * weights).all()
        assert np.allclose(decoder.file.error_weights, weights)


def test_a_host_gives_its_mesh_with_all_vertices():
    clip = plant(11, branches=5)
    order = shuffled(clip.vertex_count, 30)
    source = split_of(clip, order)
    out = io.BytesIO()
    athcodec.encode(source, out, rel_error=1e-3, host_rest=True)
    mesh = source.source_rest.astype(np.float32)
    with athcodec.open(out.getvalue(), host_mesh=mesh) as decoder:
        assert np.array_equal(decoder.file.rest, mesh)
        assert decoder.file.core.info.place_count == clip.vertex_count


def test_a_file_without_shared_places_has_no_table():
    with decoded(plant(12)) as decoder:
        info = decoder.file.core.info
        assert info.place_count == info.vertex_count
        assert "PLACES" not in {str(chunk).split()[1] for chunk in decoder.file.chunks}


def test_a_draft_keeps_the_places_that_were_found(tmp_path):
    clip = plant(13, branches=5)
    source = split_of(clip, shuffled(clip.vertex_count, 30))
    draft = athcodec.encoding.draft(source, rel_error=1e-3)
    coded = athcodec.encoding.code_segments(source, draft, range(draft.segment_count))
    athcodec.encoding.write(source, draft, coded, tmp_path / "steps.ath")
    athcodec.encode(source, tmp_path / "once.ath", rel_error=1e-3)
    assert (tmp_path / "steps.ath").read_bytes() == (tmp_path / "once.ath").read_bytes()


# ---- what it saves ----


@pytest.mark.parametrize("faces", [False, True])
def test_a_mesh_split_by_its_faces_takes_as_much_as_the_welded_one_and_two_bits_a_vertex(faces):
    welded = tube_mesh(30, 8, 40)
    options = {"attributes": "all"} if faces else {}
    split, whole = by_faces(welded), welded
    if not faces:
        split, whole = (clip.replace(faces=None) for clip in (split, whole))
        whole = whole.replace(vertex_branch=np.zeros(whole.vertex_count, int), branch_parent=np.array([-1]))
        split = split.replace(vertex_branch=np.zeros(split.vertex_count, int), branch_parent=np.array([-1]))
    assert size(split, **options) <= 1.05 * size(whole, **options) + 0.25 * split.vertex_count


def test_a_table_in_any_order_takes_little_more_than_its_entropy():
    clip = plant(14, branches=20, longest=9)
    order = shuffled(clip.vertex_count, 3 * clip.vertex_count)
    places = find_places(split_of(clip, order))
    entropy = -sum(n * np.log2(n / len(order)) for n in places.sizes) / 8
    first = split_of(clip, order[places.first])
    assert size(split_of(clip, order), effort="fast") <= 1.05 * size(first, effort="fast") + 1.2 * entropy


def test_leaves_that_touch_a_twig_at_a_point_stay_leaves():
    tree = leafed_tree(cards=40)
    places = find_places(tree)
    if places.are_shared:
        apart = PlacedClip.of(tree, places).apart()
        assert apart is not None
    with decoded(tree, rel_error=1e-3) as decoder:
        assert decoder.file.branch_count >= 40


def test_faces_cost_no_more_than_their_own_stream():
    mesh = by_faces(tube_mesh(50, 7, 30))
    with decoded(mesh, ladder="none", effort="fast") as decoder:
        chunks = {str(chunk).split()[1]: chunk.length for chunk in decoder.file.chunks}
    without = size(mesh, rest_error=None, effort="fast")
    assert decoder.file.file_length <= 1.01 * without + chunks["FACES"] + 200


def test_places_can_be_left_apart():
    assert Places.apart(5).of_vertex.tolist() == [0, 1, 2, 3, 4]
    assert not Places.apart(5).are_shared
    assert Feature.ATTRIBUTES  # Of the encoder's switches none turns places off: what is equal is coded once.
