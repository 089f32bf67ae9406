"""What goes into a file comes out: motion within the bound whatever the plant, static data unchanged."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from files import opened, still_file
from hypothesis import example, given, settings
from hypothesis import strategies as st
from plants import (
    MOTIONS,
    SHAPES,
    STEADY,
    awkward,
    awkward_plants,
    bound_for,
    bush,
    chain_plant,
    clip_of,
    distance,
    plant,
    tube,
)

import athcodec
from athcodec import MotionClip, Thresholds
from athcodec.decoding import container as ct
from athcodec.encoding.assembly.assembly import time_chunk
from athcodec.encoding.streams import streams, writing
from athcodec.motion.clip import NOT_KEPT
from athcodec.motion.hierarchy import derived_edges, hierarchy_of


def assert_comes_back(clip: MotionClip, folder, fraction: float = 1e-3, **options) -> None:
    """Encodes and decodes; the bound, the announced errors and the hierarchy must hold."""
    bound = bound_for(clip, fraction)
    summary = athcodec.encode(clip, folder / "trip.ath", max_error=bound, **{"effort": "fast"} | options)
    with athcodec.open(summary.path, strict=True) as decoder:
        decoder.file.check()
        decoded = decoder.positions()
        assert decoded.dtype == clip.dtype and decoded.shape == clip.positions.shape
        assert distance(decoded, clip.positions) <= bound == decoder.file.max_error_bound
        assert np.array_equal(decoder.file.vertex_branch, clip.vertex_branch)
        assert np.array_equal(decoder.file.branch_parent, clip.branch_parent)
        assert np.array_equal(decoder.time, clip.time)
        if clip.stem_index is None:
            assert decoder.file.stem_index is None
        else:
            assert np.array_equal(decoder.file.stem_index, clip.stem_index)


def reopened(clip: MotionClip, folder, **options) -> athcodec.Decoder:
    """The clip through a file, as an open decoder that the test need not close: its bytes are in memory."""
    path = athcodec.encode(clip, folder / "again.ath", **{"rel_error": 1e-3, "effort": "fast"} | options).path
    return athcodec.open(BytesIO(path.read_bytes()), strict=True)


# ---- motion ----


@pytest.mark.parametrize("relative", [1e-3, 1e-4, 1e-5])
def test_the_sample_stays_within_its_bound_in_every_frame(relative, sample_clip, sample_positions, tmp_path):
    summary = athcodec.encode(sample_clip, tmp_path / "sample.ath", rel_error=relative, effort="fast")
    with athcodec.open(summary.path, strict=True) as decoder:
        decoded = decoder.positions()
    distance = np.linalg.norm(decoded.astype(np.float64) - sample_positions, axis=2)
    box = np.ptp(sample_positions.reshape(-1, 3).astype(np.float64), axis=0)
    assert decoded.dtype == np.float32 and distance.shape == (120, sample_clip.vertex_count)
    assert summary.max_error_bound == pytest.approx(relative * np.linalg.norm(box), rel=1e-9)
    assert distance.max() <= summary.max_error_bound
    assert distance.max() > 0.9 * summary.max_error_bound, "the bound is there to be used"


@settings(STEADY, max_examples=60)
@given(awkward_plants(), st.sampled_from([1e-2, 1e-3, 1e-4]), st.integers(16, 40))
def test_degenerate_plants_stay_within_the_bound(scratch, clip, fraction, segment_frames):
    assert_comes_back(clip, scratch, fraction, segment_frames=segment_frames)


@pytest.mark.slow
@settings(STEADY, max_examples=3000)
@given(
    awkward_plants(),
    st.sampled_from([1e-1, 1e-2, 1e-3, 1e-4, 1e-5]),
    st.integers(16, 256),
    st.sampled_from(["fast", "default", "best"]),
    st.booleans(),
)
def test_many_degenerate_plants_stay_within_the_bound(scratch, clip, fraction, segment_frames, effort, exact_rest):
    assert_comes_back(clip, scratch, fraction, segment_frames=segment_frames, effort=effort, exact_rest=exact_rest)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("motion", MOTIONS)
def test_every_stem_shape_survives_every_motion(shape, motion, scratch):
    assert_comes_back(awkward(seed=1, branches=8, roots=2, shape=shape, motion=motion), scratch, 1e-4)


@pytest.mark.parametrize(
    "clip",
    [
        pytest.param(lambda: chain_plant(9, 4), id="orders up to 8"),
        pytest.param(lambda: chain_plant(45, 2), id="orders up to 44"),
        pytest.param(lambda: chain_plant(500, 1), id="500 single vertices in a chain"),
        pytest.param(lambda: plant(branches=1400, longest=4, frames=8), id="1400 branches"),
        pytest.param(lambda: bush(1001), id="1000 branches on one stem"),
        pytest.param(lambda: plant(branches=30, roots=30, frames=20), id="30 roots and nothing else"),
        pytest.param(lambda: awkward(2, branches=20, roots=5, motion="drift"), id="moving roots"),
        pytest.param(lambda: tube(200, 15, 20), id="a bark tube of 3000 vertices"),
        pytest.param(lambda: clip_of(np.zeros((1, 1, 3)), np.zeros((1, 3)), [0], [-1]), id="one vertex in one frame"),
        pytest.param(
            lambda: clip_of(np.full((9, 4, 3), 7e5), np.full((4, 3), 7e5), [0, 0, 1, 1], [-1, 0]),
            id="all vertices in one far place",
        ),
        pytest.param(lambda: plant(frames=257, branches=3), id="257 frames"),
        pytest.param(lambda: awkward(8, motion="sway", offset=1e4), id="far from the origin in float32"),
        pytest.param(
            lambda: awkward(8, motion="sway", offset=1e9, dtype=np.float64), id="far from the origin in float64"
        ),
        pytest.param(lambda: plant(3, scale=1e-6), id="micrometres"),
        pytest.param(lambda: plant(3, scale=1e6), id="a million units"),
    ],
)
def test_extreme_plants_stay_within_the_bound(clip, scratch):
    assert_comes_back(clip(), scratch)


def test_a_plant_far_away_from_its_rest_pose_stays_within_the_bound(scratch):
    clip = plant(seed=2, branches=6, frames=20)
    far = clip.positions.astype(np.float64) + 1e5
    assert_comes_back(clip_of(far, clip.rest, clip.vertex_branch, clip.branch_parent, np.float64), scratch, 1e-4)


@pytest.mark.parametrize("segment_frames", [16, 17, 100, 255, 256])
def test_frame_counts_that_are_no_multiple_of_the_segment_length_work(segment_frames, scratch):
    clip = plant(seed=9, branches=3, longest=3, frames=259)
    assert_comes_back(clip, scratch, segment_frames=segment_frames)
    with athcodec.open(scratch / "trip.ath") as decoder:
        lengths = [stop - start for start, stop in decoder.segments]
        assert max(lengths) <= segment_frames and max(lengths) - min(lengths) <= 1 and sum(lengths) == 259


@pytest.mark.parametrize("tam", [Thresholds(1e9, 0, 1e9, 0), Thresholds(0, 0, 0, 0), Thresholds(0.1, 5, 0.2, 3)])
def test_the_bound_does_not_depend_on_what_tam_accepts(tam, scratch):
    assert_comes_back(plant(seed=4, branches=15, frames=20), scratch, 1e-4, tam=tam)


def test_one_accepted_plant_is_one_node_and_two_levels(scratch):
    decoder = reopened(plant(seed=4, branches=15, frames=20), scratch, tam=Thresholds(1e9, 0, 1e9, 0), ladder="none")
    assert decoder.file.table1()["nodes"] == 1 and decoder.file.level_count == 2


def test_chains_fold_the_depths_beyond_29_into_one_level(scratch):
    decoder = reopened(chain_plant(45, 2), scratch, tam=Thresholds(0, 0, 0, 0), ladder="none")
    assert decoder.file.table1()["depth"] == 30 and decoder.file.tables.header.stages[-1] == 30


def test_float64_output_of_a_float32_file_is_within_the_bound_too(bushy_ath, bushy_clip):
    with athcodec.open(bushy_ath) as decoder:
        wide = decoder.positions(dtype=np.float64)
        assert wide.dtype == np.float64 and distance(wide, bushy_clip.positions) <= decoder.file.max_error_bound


def test_a_float64_source_gives_float64_and_errors_below_what_float32_could_tell(scratch):
    clip = plant(seed=6, branches=4, frames=16, dtype=np.float64, offset=1e4)
    bound = float(np.spacing(np.float32(1e4))) / 1000
    decoder = reopened(clip, scratch, rel_error=None, max_error=bound)
    assert decoder.file.dtype == np.float64 and distance(decoder.positions(), clip.positions) <= bound


def test_a_static_clip_costs_no_more_than_its_rest_pose(scratch):
    clip = awkward(3, branches=10, frames=64, motion="static")
    moving = awkward(3, branches=10, frames=64, motion="sway")
    still, swaying = (athcodec.encode(c, scratch / "size.ath", rel_error=1e-3).bytes for c in (clip, moving))
    assert still < 0.6 * swaying


# ---- order, time and rest pose ----


def test_vertices_and_branches_numbered_at_random_come_back_in_their_order(scratch):
    clip = awkward(seed=21, branches=30, longest=5, frames=20, shape="stem", motion="sway", shuffled=True)
    source = hierarchy_of(clip).vertex_source
    assert not np.array_equal(source, np.arange(len(source))) and clip.stem_index is not None
    assert_comes_back(clip, scratch, 1e-5)


@settings(STEADY, max_examples=200)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=12, unique=True))
@example([0.0, 5e-324]).via("a step whose inverse overflows")
@example([-1.7e308, 0.0, 1.7e308]).via("a range that overflows")
@example([i / 30 for i in range(12)]).via("frame number over rate")
@example([i * 0.04 for i in range(12)]).via("frame number times step")
def test_times_come_back_exactly(times):
    time = np.unique(times)
    assert np.array_equal(opened(still_file(len(time), time=time_chunk(time))).time, time)
    number_by_number = writing.pack_time(streams.encode_times(time))
    assert opened(still_file(len(time), time=number_by_number)).time.tobytes() == time.tobytes()


@pytest.mark.parametrize("origin", [0.0, 3.5])
@pytest.mark.parametrize("rate", [24, 25, 30, 60, 23.976, 29.97])
def test_steady_times_cost_a_rule_or_two_bits_each(rate, origin):
    whole = rate == round(rate) and origin == 0
    assert len(time_chunk(origin + np.arange(500) / rate)) <= (3 if whole else 500 // 4 + 16)
    assert len(time_chunk(origin + np.arange(500) * (1 / rate))) <= 17


@pytest.mark.parametrize("rest_pose", ["first", "mean"])
def test_a_clip_without_a_rest_pose_gets_one_from_its_frames(rest_pose, scratch):
    source = plant(seed=7, branches=6, frames=20)
    clip = MotionClip(source.positions, source.time, source.vertex_branch, source.branch_parent, rest_pose=rest_pose)
    expected = source.positions[0] if rest_pose == "first" else source.positions.mean(axis=0, dtype=np.float64)
    decoder = reopened(clip, scratch)
    assert np.linalg.norm(decoder.file.rest - expected, axis=1).max() <= decoder.file.max_error_bound
    assert distance(decoder.positions(), clip.positions) <= decoder.file.max_error_bound


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_an_exact_rest_pose_comes_back_bit_for_bit(dtype, scratch):
    source = awkward(seed=8, branches=12, frames=20, motion="sway", shuffled=True, offset=3.0)
    rest = source.rest.astype(dtype)
    rest[0, 0] = -0.0
    clip = source.replace(rest=rest)
    decoder = reopened(clip, scratch, exact_rest=True)
    assert decoder.file.rest.dtype == dtype and decoder.file.rest.tobytes() == rest.tobytes()
    assert distance(decoder.positions(), clip.positions) <= decoder.file.max_error_bound


# ---- static data ----

ATTRIBUTES = {
    "radius": np.linspace(0.1, 2, 40, dtype=np.float32),
    "half": np.array([[1.5, -0.0], [np.nan, np.inf]], np.float16),
    "flags": np.array([True, False, True]),
    "names": np.array([b"oak", b"", b"\xff\x00\x01"], "S4"),
    "one number": np.array(2.5),
    "nothing": np.zeros((0, 3), np.uint8),
    "cube": np.arange(24, dtype=np.int16).reshape(2, 3, 4)[:, ::-1],
    "columns first": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "Blätter/größe 🌳": np.arange(3),
}


def test_arrays_of_types_that_no_file_holds_are_named_and_big_endian_ones_are_turned():
    arrays = {"z": np.array([1 + 2j]), "blob": np.frombuffer(b"ab", "V2"), "swapped": np.arange(7, dtype=">i8")}
    clip = plant().replace(attributes=arrays)
    assert clip.not_read == {NOT_KEPT["c"]: ["z"], NOT_KEPT["V"]: ["blob"]}
    assert same_array(clip.attributes.pop("swapped"), np.arange(7)) and not clip.attributes


def same_array(got: np.ndarray, expected: np.ndarray) -> bool:
    return got.dtype == expected.dtype and got.shape == expected.shape and got.tobytes() == expected.tobytes()


@pytest.fixture(scope="module")
def attributes_back(scratch):
    return reopened(plant(frames=3).replace(attributes=ATTRIBUTES), scratch).file.attributes


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_a_named_array_comes_back_unchanged(name, attributes_back):
    assert list(attributes_back) == list(ATTRIBUTES)
    assert same_array(attributes_back[name], ATTRIBUTES[name])


def test_records_come_back_as_an_array_for_each_field(scratch):
    leaf = np.dtype([("uv", [("u", "<f4"), ("v", "<f4")]), ("normal", ">f4", (3,)), ("tag", "S2")], align=True)
    values = np.array([((1, 2), (0, 0, 1), b"a"), ((3, 4), (0, 1, 0), b"bc")], leaf)
    back = reopened(plant(frames=3).replace(attributes={"leaf": values}), scratch).file.attributes
    assert list(back) == ["leaf.uv.u", "leaf.uv.v", "leaf.normal", "leaf.tag"]
    for name, got in back.items():
        expected = values
        for field in name.split(".")[1:]:
            expected = expected[field]
        assert same_array(got, np.ascontiguousarray(expected, expected.dtype.newbyteorder("<")))


@pytest.mark.parametrize("dtype", ["i1", "u1", "<u2", ">i2", "<i4", ">u4", "<i8", ">u8"])
def test_edges_keep_their_type_whether_they_follow_from_the_hierarchy_or_not(dtype, scratch):
    source = plant(seed=5, branches=6, longest=4, frames=3)
    derived = derived_edges(hierarchy_of(source)).astype(dtype)
    sizes = []
    for edges in (derived, derived[::-1].copy()):
        decoder = reopened(source.replace(edges=edges), scratch)
        assert same_array(decoder.file.edges, edges.astype(edges.dtype.newbyteorder("<")))
        sizes.append(decoder.file.chunks.find(ct.EDGES).length)
    assert sizes[0] == 1 < sizes[1], "edges that follow from the hierarchy cost next to nothing"


@pytest.mark.parametrize(
    "faces", [np.array([[0, 1, 2], [2, 1, 3]], np.uint16), np.array([[3, 2, 1, 0]], ">i8"), np.zeros((0, 3), np.int32)]
)
def test_faces_come_back_unchanged(faces, scratch):
    expected = faces.astype(faces.dtype.newbyteorder("<"))
    assert same_array(reopened(plant(frames=3).replace(faces=faces), scratch).file.faces, expected)


@pytest.mark.parametrize(
    "metadata",
    [
        {},
        {"unit": "cm", "up_axis": "z"},
        {"größe": "über 🌳", "count": 2**60, "ratio": 0.1, "yes": True, "list": [1, "two", [3.5, False]], "empty": ""},
        {"long": "wind " * 5000},
    ],
)
def test_metadata_come_back_unchanged(metadata, scratch):
    assert reopened(plant(frames=3).replace(metadata=metadata), scratch).metadata == metadata


def test_attributes_none_keeps_the_motion_and_the_units_alone(full_clip, scratch):
    bare, full = (reopened(full_clip, scratch, attributes=which) for which in ("none", "all"))
    assert bare.file.faces is None and bare.file.edges is None and bare.file.attributes == {}
    assert bare.metadata == {"unit": "m", "up_axis": "y"} and full.metadata == full_clip.metadata
    apart = np.linalg.norm(bare.positions().astype(float) - full.positions(), axis=2).max()
    assert apart <= 2 * bare.file.max_error_bound and bare.file.file_length < full.file.file_length


TOO_MUCH = {
    "257 attributes": {"attributes": {f"a{i}": np.zeros(1) for i in range(257)}},
    "a name of 5000 bytes": {"attributes": {"n" * 5000: np.zeros(1)}},
    "items of 2 MB": {"attributes": {"wide": np.zeros(1, "S2000000")}},
    "1 MiB of metadata": {"metadata": {"text": "x" * (1 << 20)}},
    "metadata that is no JSON": {"metadata": {"object": {1, 2}}},
    "metadata that is no UTF-8": {"metadata": {"text": "\ud800"}},
}


@pytest.mark.parametrize("more", TOO_MUCH.values(), ids=TOO_MUCH)
def test_static_data_beyond_what_a_decoder_accepts_are_refused_when_encoding(more, tmp_path):
    with pytest.raises(athcodec.errors.ClipError):
        athcodec.encode(plant(frames=3).replace(**more), tmp_path / "refused.ath", effort="fast")
    assert not list(tmp_path.iterdir())
