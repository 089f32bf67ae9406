"""Files whose rest pose is a mesh of the host's: they say what they hold without it, play with it and with no other,
and are smaller by the rest pose."""

from __future__ import annotations

import ctypes
import hashlib
import io
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from files import Parts
from plants import plant, tube
from test_core import FILE_ORDER, OK, Fault, Memory, Player, core, text_of
from test_wasm import run_node

import athcodec
from athcodec import batch, cli
from athcodec.decoding import container as ct
from athcodec.errors import BadChunk, ClipError, NeedsHostMesh, WrongHostMesh
from athcodec.motion.clip import MotionClip
from athcodec.viewer import view

SAMPLE = str(athcodec.sample_path())
NEEDS_HOST_MESH, WRONG_HOST_MESH = 12, 13
FAST = {"effort": "fast", "attributes": "none", "host_rest": True}


def encode(clip: MotionClip, **options) -> bytes:
    return athcodec.encode(clip, **FAST | options)


@pytest.fixture(scope="module")
def source() -> MotionClip:
    return plant(seed=5, branches=9, frames=40, offset=3.0)


@pytest.fixture(scope="module")
def mesh(source) -> np.ndarray:
    return source.rest.astype(np.float32)


@pytest.fixture(scope="module")
def hosted(source) -> bytes:
    """The clip in three segments and three layers."""
    return encode(source, rel_error=1e-4, segment_frames=16)


@pytest.fixture(scope="module")
def hosted_sample(tmp_path_factory):
    path = tmp_path_factory.mktemp("host") / "sample.ath"
    assert cli.main(["encode", SAMPLE, str(path), "--rest", "host", "--rel-error", "1e-3", "--effort", "fast"]) == 0
    return path


def opened(data: bytes, **options) -> athcodec.Decoder:
    return athcodec.open(io.BytesIO(data), strict=True, **options)


def assert_kept(decoder: athcodec.Decoder, clip: MotionClip) -> None:
    """Every vertex of every frame is within the bound of the file."""
    positions = decoder.positions(dtype=np.float64)
    largest = np.linalg.norm(positions - clip.block(0, clip.frame_count), axis=2).max()
    assert largest <= decoder.file.max_error_bound


# ---- with the mesh ----


WAYS = [{}, {"ladder": "none"}, {"rel_error": 1e-2}, {"target_size": 3000}, {"effort": "default"}, {"weights": "w"}]


@pytest.mark.parametrize("options", [*WAYS, {"segment_frames": 16}], ids=str)
def test_the_bound_is_kept_with_the_hosts_mesh(source, options):
    weights = np.linspace(1, 4, source.vertex_count)
    clip = source.replace(attributes={"w": weights})
    data = encode(clip, **options)
    with opened(data, host_mesh=source) as decoder:
        assert_kept(decoder, clip)
        assert np.array_equal(decoder.file.rest, source.rest.astype(np.float32))
        assert decoder.file.rest.dtype == np.float32
        assert not any(chunk.kind == ct.REFINED_REST for chunk in decoder.file.chunks)
        decoder.file.check()


def test_the_rest_pose_takes_25_bytes_whatever_the_bound(source, tmp_path):
    for bound in (1e-2, 1e-5):
        data = encode(source, rel_error=bound)
        with opened(data) as decoder:
            assert decoder.file.info()["rest_bytes"] == 25
        stored = athcodec.encode(source, tmp_path / "b.ath", **FAST | {"host_rest": False}, rel_error=bound)
        assert len(data) < stored.bytes - stored.chunk_bytes["REST"] / 2


def test_a_lossless_file_gives_the_motions_bits_back(source, mesh):
    with opened(encode(source, lossless=True), host_mesh=mesh) as decoder:
        assert decoder.positions().tobytes() == source.positions.tobytes()


def test_a_binary64_clip_plays_about_the_mesh_as_float32():
    clip = plant(seed=6, branches=5, frames=20, dtype=np.float64, offset=1e3)
    data = encode(clip, rel_error=1e-8)
    for mesh in (clip, clip.rest, clip.rest.astype(np.float32)):
        with opened(data, host_mesh=mesh) as decoder:
            assert decoder.file.dtype == np.float64 and decoder.file.rest.dtype == np.float32
            assert_kept(decoder, clip)


def test_a_clip_without_a_rest_pose_has_its_first_frame_as_the_mesh(source):
    clip = MotionClip(source.positions, source.time, source.vertex_branch, source.branch_parent)
    with opened(encode(clip), host_mesh=source.positions[0]) as decoder:
        assert_kept(decoder, clip)


def test_branches_are_found_for_a_mesh_that_the_host_has():
    clip = tube(12, 8, 20)
    clip = MotionClip(clip.positions, clip.time, rest=clip.rest)
    with opened(encode(clip, rel_error=1e-3), host_mesh=clip) as decoder:
        assert_kept(decoder, clip)


def test_several_clips_and_loops_share_the_mesh(source, mesh):
    clips = {"calm": athcodec.looped(source, 4), "gale": source}
    with opened(encode(athcodec.join(clips)), host_mesh=mesh) as decoder:
        for name, clip in clips.items():
            assert_kept(decoder.play(name), clip)
        assert decoder.clip.seam_errors[-1] <= 2 * decoder.file.max_error_bound


def test_minus_zero_is_zero(source):
    """Turning a mesh and turning it back leaves some."""
    rest = source.rest.astype(np.float32)
    rest[::3, 0] = -0.0
    data = encode(source.replace(rest=rest))
    positions = []
    for mesh in (rest, rest + np.float32(0)):
        with opened(data, host_mesh=mesh) as decoder:
            positions.append(decoder.positions().tobytes())
    assert positions[0] == positions[1]


def test_a_rest_pose_is_exact_or_the_hosts(source):
    with pytest.raises(ValueError, match="host_rest"):
        encode(source, exact_rest=True)


# ---- without it, and with another ----


def test_a_file_says_what_it_holds_without_the_mesh(hosted, mesh, source):
    with opened(hosted) as decoder:
        file, info = decoder.file, decoder.file.info()
        data = mesh.tobytes()
        assert (
            file.host_checksum == f"{ct.crc32c(data):08x}{ct.crc32c(data[::-1]):08x}" == info["host_mesh"]["checksum"]
        )
        assert file.needs_host_mesh and info["vertices"] == len(mesh) and len(decoder.levels) == file.level_count
        assert np.array_equal(decoder.time, source.time) and np.array_equal(file.vertex_branch, source.vertex_branch)
        assert file.deepest == file.level_count - 1 and decoder.level_for(1e5, 1.0, 1e3) == 0
        file.check(decode=False)
        file.set_host_mesh(mesh)
        assert not file.needs_host_mesh
        assert_kept(decoder, source)


def test_whatever_takes_the_rest_pose_needs_the_mesh(hosted):
    with opened(hosted) as decoder:
        for level in range(decoder.file.level_count):
            for ask in (decoder.positions, decoder.affines, decoder.residual):
                with pytest.raises(NeedsHostMesh, match="got none; expected the mesh that the file was made for"):
                    ask(0, level)
            with pytest.raises(NeedsHostMesh):
                decoder.level_rest(level)
        with pytest.raises(NeedsHostMesh):
            _ = decoder.file.rest
        with pytest.raises(NeedsHostMesh):
            decoder.file.check()


def test_another_mesh_is_refused_and_the_right_one_taken_after_it(hosted, mesh, source):
    wrong = {
        f"got {len(mesh) - 1} vertices; expected {len(mesh)}": mesh[1:],
        "got checksum 0x": np.nextafter(mesh, np.float32(9)),
        "; expected 0x": mesh[::-1],
        "vertex 7 with a number that is not finite": np.where(np.arange(len(mesh))[:, None] == 7, np.nan, mesh),
    }
    with opened(hosted) as decoder:
        for message, other in wrong.items():
            with pytest.raises(WrongHostMesh, match=message):
                decoder.file.set_host_mesh(other)
            assert decoder.file.needs_host_mesh
        for other in (mesh[:, :2], mesh.reshape(-1), "text".split(), None):
            with pytest.raises(ClipError, match="host mesh|text"):
                decoder.file.set_host_mesh(np.array(other))
        decoder.file.set_host_mesh(mesh)
        assert_kept(decoder, source)


def test_each_bit_of_the_mesh_counts(hosted, mesh):
    rng = np.random.default_rng(1)
    for at, bit in zip(rng.integers(mesh.size, size=30), rng.integers(23, size=30)):
        other = mesh.copy()
        other.reshape(-1).view(np.uint32)[at] ^= np.uint32(1) << np.uint32(bit)
        with pytest.raises(WrongHostMesh):
            opened(hosted, host_mesh=other)


def test_a_file_that_holds_its_rest_pose_passes_a_mesh_over(sample_ath, mesh):
    with athcodec.open(sample_ath, host_mesh=mesh) as decoder:
        assert decoder.file.host_checksum is None and not decoder.file.needs_host_mesh
        decoder.positions(0)
    with athcodec.open(sample_ath, host_mesh="no such file") as decoder:
        decoder.positions(0)


def test_truncating_needs_no_mesh_and_keeps_its_checksum(hosted, mesh, tmp_path):
    (tmp_path / "a.ath").write_bytes(hosted)
    athcodec.truncate(tmp_path / "a.ath", tmp_path / "b.ath", 1)
    with opened(hosted, host_mesh=mesh) as whole, athcodec.open(tmp_path / "b.ath", host_mesh=mesh) as less:
        assert less.file.host_checksum == whole.file.host_checksum and less.file.level_count == 2
        assert np.array_equal(less.positions(level=1), whole.positions(level=1))


# ---- meshes in files ----


def test_a_mesh_comes_from_any_format_that_keeps_its_numbers(hosted_sample, tmp_path):
    with athcodec.open(hosted_sample, host_mesh=SAMPLE) as decoder:
        expected = decoder.positions(0)
        for name in ("m.npz", "m.glb", "m.xdmf", "m.h5"):
            athcodec.write(athcodec.ClipView(decoder, 1), tmp_path / name)
            with athcodec.open(hosted_sample, host_mesh=tmp_path / name) as again:
                assert np.array_equal(again.positions(0), expected), name


def test_the_mesh_of_a_file_is_brought_to_the_units_and_axes_of_the_motion(tmp_path, capsys):
    ath = tmp_path / "a.ath"
    turned = ["--unit", "cm", "--up-axis", "z"]
    assert cli.main(["encode", SAMPLE, str(ath), "--rest", "host", "--effort", "fast", *turned]) == 0
    with athcodec.open(ath, host_mesh=SAMPLE) as decoder:
        assert np.ptp(decoder.file.rest[:, 2]) > 700 and decoder.metadata["unit"] == "cm"


# ---- C ----


def test_an_engine_gives_its_vertex_buffer(hosted, mesh):
    """Positions between other things, at an address that no float has."""
    player, fault = Player(hosted, build=False), Fault()
    with opened(hosted, host_mesh=mesh) as decoder:
        expected = decoder.positions(0, level=0)
    stride = 29
    buffer = np.full(1 + len(mesh) * stride, 0xAB, np.uint8)
    for v, position in enumerate(mesh):
        buffer[1 + v * stride : 13 + v * stride] = np.frombuffer(position.tobytes(), np.uint8)
    rest = np.empty_like(mesh, np.float64)
    assert player.info.rest_is_host == 1 and player.info.host_checksum[0] == ct.crc32c(mesh.tobytes())
    assert core.ath_build(player.address, player.address, 0) == NEEDS_HOST_MESH
    assert core.ath_level_rest(player.address, 0, FILE_ORDER, rest.ctypes.data, 24) == NEEDS_HOST_MESH
    assert core.ath_rest(player.address, FILE_ORDER, rest.ctypes.data, 12) == NEEDS_HOST_MESH
    assert player.refine(0) == NEEDS_HOST_MESH and f"of {len(mesh)} vertices" in text_of(player.refusal)
    work = player.work()
    start = core.ath_prepare_start(work.address, work.size, player.address, 0, 0, work.address, work.size)
    assert start == NEEDS_HOST_MESH
    at = buffer.ctypes.data
    wrong = core.ath_set_host_mesh(player.address, at, stride, len(mesh) - 1, ctypes.byref(fault))
    assert wrong == fault.code == WRONG_HOST_MESH and "host mesh: got" in text_of(fault)
    assert core.ath_set_host_mesh(player.address, at + 1, stride, len(mesh), ctypes.byref(fault)) == OK
    buffer[:] = 0  # the file has a copy
    player.bases = Memory(core.ath_build_size(player.address))
    assert core.ath_build(player.address, player.bases.address, player.bases.size) == OK
    segment = player.prepare(0, 0)
    out = np.empty_like(expected)
    held = ctypes.c_void_p(segment.address)
    assert core.ath_positions(player.address, ctypes.byref(held), 1, 0.0, 1, out.ctypes.data, 12) == OK
    assert out.tobytes() == expected.tobytes()


# ---- WebAssembly ----


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node.js")
@pytest.mark.web
def test_web_assembly_needs_and_takes_the_mesh_too(hosted, mesh, tmp_path):
    (tmp_path / "a.ath").write_bytes(hosted)
    (tmp_path / "mesh").write_bytes(mesh.tobytes())
    script = """
const file = AthFile.open(read(path)), mesh = new Float32Array(read(option).buffer);
const wrong = mesh.slice();
wrong[5] += 1;
const before = [() => file.rest(), () => file.prepare(0, 0)].map((call) => thrown(call).codeName);
const others = [wrong, mesh.slice(3)].map((other) => thrown(() => file.setHostMesh(other)).message);
const needed = file.needsHostMesh;
file.setHostMesh(mesh);
file.setHostMesh(mesh);
const early = AthFile.open(read(path), { hostMesh: mesh });
answer({ before, others, needed, still: file.needsHostMesh, checksum: file.info.hostChecksum,
  host: file.info.restIsHost, noMesh: thrown(() => file.setHostMesh([1, 2, 3])).type,
  levels: each(file.info.levelCount, (level) => frames(file, prepareAll(file, level))),
  alike: frames(early, prepareAll(early, 1)) === frames(file, prepareAll(file, 1)) });
"""
    found = run_node(tmp_path, script, tmp_path / "a.ath", tmp_path / "mesh")
    assert found["before"] == ["NEEDS_HOST_MESH"] * 2 and found["needed"] and not found["still"] and found["host"]
    assert "got checksum" in found["others"][0] and f"got {len(mesh) - 1} vertices" in found["others"][1]
    assert found["noMesh"] == "TypeError" and found["alike"]
    with opened(hosted, host_mesh=mesh) as decoder:
        assert found["checksum"] == decoder.file.host_checksum
        for level, digest in enumerate(found["levels"]):
            assert hashlib.sha256(decoder.positions(level=level).tobytes()).hexdigest() == digest


# ---- command line, batches, pages ----


def run(capsys, *words) -> tuple[int, str, str]:
    code = cli.main([str(word) for word in words])
    return code, *capsys.readouterr()


def test_every_verb_that_decodes_asks_for_the_mesh_in_one_line(hosted_sample, tmp_path, capsys):
    capsys.readouterr()
    outputs = [tmp_path / f"x.{suffix}" for suffix in ("h5", "glb", "npz", "pc2", "xdmf", "obj")]
    for words in (
        *(["decode", hosted_sample, output] for output in outputs),
        ["view", hosted_sample, "--export", tmp_path / "x.html"],
        ["view", hosted_sample, "--no-browser"],
    ):
        code, _, error = run(capsys, *words)
        assert code == 1 and error.count("\n") == 1 and "Traceback" not in error
        assert "host mesh: got none" in error and "--host-mesh" in error
    assert [path.name for path in tmp_path.iterdir()] == []
    code, _, error = run(capsys, "decode", hosted_sample, outputs[0], "--host-mesh", tmp_path / "none.h5")
    assert code == 1 and error.count("\n") == 1


def test_info_and_truncate_do_without(hosted_sample, tmp_path, capsys):
    capsys.readouterr()
    code, text, _ = run(capsys, "info", hosted_sample)
    assert code == 0 and "Rest pose: a mesh of 1,001 vertices that the host has, checksum" in text
    assert run(capsys, "truncate", hosted_sample, tmp_path / "less.ath", "--level", 0)[0] == 0
    assert run(capsys, "decode", tmp_path / "less.ath", tmp_path / "x.npz", "--host-mesh", SAMPLE)[0] == 0


def test_verify_compares_checksums_without_the_mesh_and_decodes_with_it(hosted_sample, tmp_path, capsys):
    capsys.readouterr()
    code, text, _ = run(capsys, "verify", hosted_sample)
    assert code == 0 and "nothing was decoded" in text
    for words in (["--host-mesh", SAMPLE], ["--against", SAMPLE]):
        code, text, _ = run(capsys, "verify", hosted_sample, *words)
        assert code == 0 and "every level decodes" in text
    code, text, _ = run(capsys, "verify", hosted_sample, "--json")
    assert json.loads(text)["decoded"] is False
    damaged = bytearray(hosted_sample.read_bytes())
    damaged[-9] ^= 1
    (tmp_path / "damaged.ath").write_bytes(damaged)
    assert run(capsys, "verify", tmp_path / "damaged.ath")[0] == 1


@pytest.mark.tools
def test_a_batch_leaves_rest_poses_to_the_host_and_verifies_with_them(source, tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    athcodec.write_hdf5(source, folder / "a.h5")
    settings = {"rest": "host", "effort": "fast", "segment_frames": 16}
    items = batch.find([str(folder / "*.h5")], str(tmp_path / "out"), settings=settings)
    for split in (1, 4):
        outcome = batch.run(items, str(tmp_path / "out"), workers=1, verify=True, split=split, redo=True)
        assert not outcome.failed and len(outcome.done) == 1
        with athcodec.open(tmp_path / "out" / "a.ath", host_mesh=source) as decoder:
            assert_kept(decoder, source)


@pytest.mark.parametrize(
    "host, mesh, output",
    [
        ("host.h5", "host.h5", "host.h5"),
        ("host.xdmf", "host.xdmf", "host.xdmf.h5"),
        ("host.obj", "host_0000.obj", "host_0001.obj"),
        ("host.usda", "top.usda", "host.usda"),
        ("host.pvd", "host.pvd", "host_0001.vtu"),
    ],
)
@pytest.mark.parametrize("link", [None, os.symlink, os.link], ids=["by name", "symbolic link", "hard link"])
def test_no_file_of_the_host_mesh_is_replaced(hosted_sample, tmp_path, capsys, host, mesh, output, link):
    if output.endswith(".usda"):
        pytest.importorskip("pxr")
        (tmp_path / "top.usda").write_text('#usda 1.0\n(\n subLayers = [@host.usda@]\n defaultPrim = "clip"\n)\n')
    with athcodec.read_hdf5(SAMPLE) as clip:
        pose = np.asarray(clip.rest, np.float32)
        athcodec.write(MotionClip(np.stack([pose, pose + 1]), np.arange(2.0), rest=pose), tmp_path / host)
    if link is not None:
        link(tmp_path / output, tmp_path / f"link_0000{Path(output).suffix}")
        output = f"link_0000{Path(output).suffix}"
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    code, _, error = run(capsys, "decode", hosted_sample, tmp_path / output, "--host-mesh", tmp_path / mesh)
    assert code == 1 and "is the input, or a file that belongs to it; choose another output name" in error
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_an_exported_page_carries_the_mesh(hosted_sample, tmp_path):
    view.export_page(hosted_sample, tmp_path / "p.html", host_mesh=SAMPLE)
    assert 'id="ath-mesh"' in (tmp_path / "p.html").read_text()


@pytest.mark.parametrize("method", [5, 6, 7, 12])
def test_is_host_stands_alone_in_method(hosted, method):
    parts = Parts.of(hosted)
    with pytest.raises(BadChunk):
        opened(parts.with_payload(ct.REST, bytes([method]) + parts.payload(ct.REST)[1:]))
