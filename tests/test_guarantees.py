"""What docs/formats.md promises of every format: what goes out comes back, in the same order, at the same times."""

from __future__ import annotations

import dataclasses
import os
import re

import numpy as np
import pytest
from moving_meshes import mixed_clip, survives_damage
from plants import ring_quads, tube

import athcodec
from athcodec import ClipView, MotionClip
from athcodec.errors import ClipError, GuessWarning

RATE = 24000 / 1001
FORMATS = {"hdf5": "a.h5", "npz": "a.npz", "usdc": "a.usdc", "usda": "a.usda", "alembic": "a.abc", "gltf": "a.glb"}
FORMATS |= {name: f"a.{name}" for name in ("pc2", "mdd", "obj", "ply", "xdmf", "pvd")}
NUMBERED = {"obj", "ply"}  # a file per frame

NO_RATE = {"pc2", "obj", "ply", "pvd"}  # frames have numbers or times there, but no rate: who reads has to give it
WITHOUT_UNIT = {"pc2", "mdd", "obj", "ply", "pvd"}  # formats without a place for a unit or an axis
NO_STATICS = {"pc2", "mdd"}  # but for what their mesh file holds
METRES = {"gltf"}  # always metres with y up: the reader gives that
READ_IN_A_PROCESS = {"usdc", "usda", "alembic"}
EXACT = {"hdf5", "npz", "usdc", "usda", "pc2", "mdd", "obj", "ply", "pvd"}  # positions bit for bit


def tiered(names) -> list:
    """Formats as parameters; all but those that need no other library than athcodec does are in the tier `formats`."""
    needs_nothing = {"hdf5", "npz", "gltf"}
    return [pytest.param(name, marks=() if name in needs_nothing else pytest.mark.formats) for name in names]


@pytest.fixture(scope="module")
def clip() -> MotionClip:
    """A tube in centimetres with z up at 23.976 frames per second, whose first frame is number 1001."""
    made = tube(rings=8, around=6, frames=9)
    weights = np.linspace(1, 2, made.vertex_count).astype(np.float32)
    return dataclasses.replace(
        made,
        time=np.arange(9) / RATE,
        faces=ring_quads(8, 6),
        rest=made.rest.astype(np.float32),
        attributes={"uv": np.random.default_rng(0).random((made.vertex_count, 2)).astype(np.float32), "slack": weights},
        metadata={"unit": "cm", "up_axis": "z", "fps": RATE, "start_frame": 1001},
    )


def write(clip, path) -> None:
    athcodec.write(clip, path, **({"animation": "morphs"} if path.suffix == ".glb" else {}))


def there_and_back(clip, folder, name: str) -> MotionClip:
    path = folder / FORMATS[name]
    write(clip, path)
    given = {"fps": RATE} if name in NO_RATE else {}
    return athcodec.read(min(folder.glob("a_*.*")) if name in NUMBERED else path, **given)


@pytest.mark.parametrize("name", tiered(FORMATS))
def test_vertices_times_units_faces_and_static_arrays_come_back(clip, tmp_path, name):
    with there_and_back(clip, tmp_path, name) as again:
        assert (again.frame_count, again.vertex_count) == (clip.frame_count, clip.vertex_count)
        got, expected = again.block(0, again.frame_count), clip.block(0, clip.frame_count)
        if name in METRES:
            expected = np.stack([expected[..., 0], expected[..., 2], -expected[..., 1]], axis=-1) / 100
        assert np.abs(got - expected).max() <= (0 if name in EXACT else 1e-6) * np.abs(expected).max()
        assert again.metadata["fps"] == pytest.approx(RATE, rel=1e-7)
        assert again.metadata["start_frame"] == 1001
        assert again.time == pytest.approx(clip.time, abs=1e-6)
        if name not in WITHOUT_UNIT | METRES:
            assert (again.metadata["unit"], again.metadata["up_axis"]) == ("cm", "z")
        counts, indices = again.polygons
        if name == "gltf":  # which has triangles only
            assert len(counts) == 2 * len(clip.faces)
        else:
            assert np.array_equal(indices.reshape(-1, 4), clip.faces)
        if name == "obj":  # which has texture coordinates, for corners, and nothing else
            assert np.array_equal(again.attributes["uv"], clip.attributes["uv"][clip.faces.reshape(-1)])
        elif name not in NO_STATICS:
            assert np.array_equal(again.attributes["uv"], clip.attributes["uv"])
            assert np.array_equal(again.attributes["slack"].reshape(-1), clip.attributes["slack"])


@pytest.mark.parametrize("name", tiered(FORMATS))
def test_arrays_come_back_or_are_named_as_not_written(clip, tmp_path, name):
    rng, count, frames = np.random.default_rng(4), clip.vertex_count, clip.frame_count
    shapes = {"age": (count,), "pull": (count, 3), "heat": (frames, count), "gust": (frames,), "list": (7,)}
    arrays = {key: rng.random(shape).astype(np.float32) for key, shape in shapes.items()}
    odd = dataclasses.replace(clip, attributes=clip.attributes | arrays)
    lost = athcodec.write(odd, tmp_path / FORMATS[name]).facts.get("not_written", {}).get("arrays", [])
    with there_and_back(odd, tmp_path, name) as back:
        assert set(shapes) - set(lost) == set(shapes) & set(back.attributes)


@pytest.mark.parametrize("moves", [True, False])
@pytest.mark.parametrize("name", tiered(FORMATS))
def test_everything_in_a_file_that_athcodec_wrote_is_known_when_it_is_read(clip, tmp_path, name, moves):
    whole = clip if moves else clip.replace(positions=np.repeat(clip.positions[:1], 3, axis=0), time=clip.time[:3])
    with there_and_back(whole, tmp_path, name) as back:
        assert back.not_read == {}


def test_every_kind_of_glb_that_athcodec_wrote_is_known_when_it_is_read(clip, tmp_path):
    branches = {"vertex_branch": np.zeros(clip.vertex_count, int), "branch_parent": np.array([-1])}
    both = athcodec.join({"calm": clip.replace(**branches), "gale": clip.replace(**branches)})
    for kind in ("morphs", "joints"):
        athcodec.write(both, tmp_path / "b.glb", animation=kind)
        with athcodec.read(tmp_path / "b.glb", takes="all") as back:
            assert back.not_read == {}
    athcodec.encode(both, tmp_path / "b.ath", rel_error=1e-2, effort="fast", ladder="none")
    with athcodec.open(tmp_path / "b.ath") as decoder:
        athcodec.write(ClipView(decoder), tmp_path / "r.glb", rig=True)
    with athcodec.read(tmp_path / "r.glb", takes="all") as back:
        assert back.not_read == {}


# The head of a PC2 states the number of frames, and a single one is a frame like any other.
@pytest.mark.parametrize("name", tiered([name for name in FORMATS if name != "pc2"]))
def test_encoding_a_file_of_one_frame_says_what_makes_it_a_motion(clip, tmp_path, name, capsys):
    path = tmp_path / FORMATS[name]
    write(clip.replace(positions=clip.positions[:1], time=clip.time[:1]), path)
    path = path if path.exists() else next(tmp_path.glob(f"a*{path.suffix}"))
    with pytest.warns(GuessWarning, match="holds a single frame, so the plant stands still: .*--still"):
        athcodec.encode(path, effort="fast")


@pytest.mark.parametrize("name", tiered(FORMATS))
def test_a_decoded_file_is_within_its_bound_in_every_format(clip, tmp_path, name):
    summary = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-3, effort="fast")
    with athcodec.open(tmp_path / "a.ath") as decoder:
        with there_and_back(ClipView(decoder, frames=range(2, 7)), tmp_path, name) as again:
            assert again.metadata["start_frame"] + again.time[0] * RATE == pytest.approx(1003)
            expected = clip.block(2, 7).astype(np.float64)
            if name in METRES:
                expected = np.stack([expected[..., 0], expected[..., 2], -expected[..., 1]], axis=-1) / 100
            scale = 0.01 if name in METRES else 1
            apart = np.linalg.norm(again.block(0, 5) - expected, axis=2).max()
            assert apart <= summary.max_error_bound * scale * (1 + 1e-5)
            assert name in NO_STATICS | {"obj"} or np.array_equal(again.attributes["uv"], clip.attributes["uv"])


@pytest.mark.parametrize("name", tiered(FORMATS))
@pytest.mark.parametrize("older", [False, True])
def test_a_failed_write_leaves_what_was_there(clip, tmp_path, name, older):
    if older:
        write(clip, tmp_path / FORMATS[name])
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    positions = clip.block(0, 9).copy()
    positions[5, 0, 0] = np.nan
    broken = clip.replace(positions=positions)
    broken.block_length = lambda most: 3  # so that some frames have been written before
    with pytest.raises(ClipError, match="frame 5"):
        write(broken, tmp_path / FORMATS[name])
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("name", tiered(FORMATS))
def test_a_changed_file_and_a_closed_clip_are_noticed(clip, tmp_path, name):
    with there_and_back(clip, tmp_path, name) as again:
        assert again.unchanged()
        for path in tmp_path.iterdir():
            os.utime(path, (1, 1))
        assert not again.unchanged()
        with pytest.raises(ClipError, match="changed while it was read"), again.watched():
            pass
    if name in READ_IN_A_PROCESS:
        with pytest.raises(ClipError, match="closed"):
            again.block(0, 1)


def test_every_format_of_the_table_is_tried_here():
    from athcodec import exporters

    written = {re.sub(r".*\.", "", name) for name in FORMATS.values()}
    for kind in exporters.FORMATS:
        if kind.name not in ("vat", "openvat"):  # which nobody reads back: see test_vat.py
            assert written & {suffix[1:] for suffix in kind.suffixes}, kind.name


@pytest.mark.formats
@pytest.mark.parametrize("cache", ["a.pc2", "a.mdd"])
@pytest.mark.parametrize("mesh", ["mesh.glb", "mesh.usda", "mesh.obj", "mesh.ply", "mesh.h5"])
def test_a_point_cache_takes_its_mesh_from_a_file_of_any_format(clip, tmp_path, cache, mesh):
    athcodec.write(clip, tmp_path / cache)
    for beside in tmp_path.glob("a*.obj"):
        beside.unlink()
    still = dataclasses.replace(clip, positions=clip.block(0, 1), time=clip.time[:1], rest=clip.rest.astype(np.float32))
    athcodec.write(still, tmp_path / mesh)
    with athcodec.read(tmp_path / cache, mesh=tmp_path / mesh) as again:
        assert np.array_equal(again.block(0, 9), clip.block(0, 9))
        counts, indices = again.polygons
        assert counts.sum() >= clip.faces.size and indices.max() < clip.vertex_count
        assert mesh == "mesh.glb" or np.array_equal(indices.reshape(-1, 4), clip.faces)
    with athcodec.read(tmp_path / cache) as alone:
        assert alone.polygons is None


# A file that is damaged, what is read, and how it was written.
DAMAGED = [("a.npz", "a.npz", {}), ("a.npz", "a.npz", {"gzip": True})]
DAMAGED += [(name, name, {}) for name in ("a.abc", "a.usda", "a.usdc", "a.usdz")]
DAMAGED += [(f"a_000{i}.{kind}", f"a_0002.{kind}", {}) for kind in ("obj", "ply") for i in (1, 3)]
DAMAGED += [(f"a.{kind}", f"a.{kind}", {}) for kind in ("pc2", "mdd")]
for packing in ({}, {"gzip": True}):
    DAMAGED += [(name, "a.xdmf", packing) for name in ("a.xdmf", "a.xdmf.h5")]
    DAMAGED += [(name, "a.pvd", packing) for name in ("a.pvd", "a_0001.vtu", "a_0002.vtu")]


@pytest.mark.formats
@pytest.mark.filterwarnings("ignore:.*file that is not there")  # A damaged index may name another file.
@pytest.mark.parametrize("name, opened, how", DAMAGED)
def test_damaged_files_are_refused_with_a_clip_error(tmp_path, name, opened, how, capfd):
    written = re.sub(r"_\d+", "", opened)
    athcodec.write(mixed_clip(frames=4), tmp_path / written, **how)
    slow = name.endswith(("abc", "usda", "usdc", "usdz"))  # for which every reading starts a process
    cuts, changes = (6, 10) if slow else (20, 40)
    refused = survives_damage(tmp_path / name, lambda: athcodec.read(tmp_path / opened), cuts=cuts, changes=changes)
    assert refused > (9 if slow else 12)
    assert "Traceback" not in capfd.readouterr().err


OTHERS = {"a.usdc": b"x" * 99, "b.usda": b"#usda 1.0\n", "c.usdz": b"PK\3\4" + bytes(40)}
OTHERS |= {"a.abc": b"x" * 99, "b.abc": b"Ogawa" + bytes(60)}


@pytest.mark.formats
@pytest.mark.parametrize("name", OTHERS)
def test_other_files_are_refused_in_one_line(tmp_path, name):
    kind = "alembic" if name.endswith("abc") else "usd"
    (tmp_path / name).write_bytes(OTHERS[name])
    with pytest.raises(ClipError, match=name) as caught:
        athcodec.read(tmp_path / name, kind)
    assert "\n" not in str(caught.value)
    with pytest.raises(FileNotFoundError):
        athcodec.read(tmp_path / f"none{name}", kind)
