"""Files of other formats where an .ath file is expected, and the other way round: what they are is said, and what to do
next in Python."""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path

import fsspec
import numpy as np
import pytest

import athcodec
from athcodec import errors, exporters, sources
from athcodec.errors import ClipError, NotAnAthFile
from athcodec.files import kinds

STEM = np.zeros((3, 4, 3), np.float32)
BRANCH = {"vertex_branch": [0] * 4, "branch_parent": [-1]}


def zipped(name: str) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(name, b"content")
    return out.getvalue()


FILES = {  # by suffix: the kind, and bytes as other programs write them
    ".h5": ("HDF5", b"\x89HDF\r\n\x1a\n" + bytes(100)),
    ".npz": ("NumPy archive", zipped("positions.npy")),
    ".usdc": ("USD", b"PXR-USDC" + bytes(80)),
    ".usda": ("USD", b'#usda 1.0\ndef Xform "tree" {}\n'),
    ".usdz": ("USD", zipped("tree.usdc")),
    ".gltf": ("glTF", b'{\n "asset": {"version": "2.0"}}'),
    ".abc": ("Alembic", b"Ogawa\xff\0\1" + bytes(8)),
    ".pc2": ("PC2", b"POINTCACHE2\0" + bytes(20)),
    ".mdd": ("MDD", struct.pack(">ii", 1, 1) + bytes(16)),
    ".obj": ("OBJ or PLY", b"# made by hand\no tree\nv 0 0 0\nv 0 1 0\n"),
    ".ply": ("OBJ or PLY", b"ply\nformat ascii 1.0\n"),
    ".xdmf": ("XDMF", b'<?xml version="1.0" ?>\n<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>\n<Xdmf Version="2.0">'),
    ".vtu": ("VTK", b'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid">'),
    ".vtk": ("VTK", b"# vtk DataFile Version 3.0\n"),
    ".png": ("PNG", b"\x89PNG\r\n\x1a\n" + bytes(20)),
    ".gif": ("GIF", b"GIF89a" + bytes(20)),
    ".webp": ("WebP", b"RIFF\x10\0\0\0WEBPVP8 "),
    ".html": ("HTML", b"<!DOCTYPE html>\n<html>"),
    ".json": ("JSON", b"[1, 2]"),
    ".zip": ("ZIP", zipped("a.csv")),
    ".txt": ("text", b"no plant"),
}


@pytest.mark.parametrize("suffix", FILES)
@pytest.mark.parametrize("way", ["path", "Path", "bytes", "file", "URL"])
def test_opening_another_file_says_what_it_is_and_what_to_do_in_python(suffix, way, tmp_path, monkeypatch):
    kind, data = FILES[suffix]
    monkeypatch.chdir(tmp_path)
    Path(f"tree{suffix}").write_bytes(data)
    if way == "URL":
        fsspec.filesystem("memory").pipe(f"/tree{suffix}", data)
    url = f"memory://tree{suffix}"
    name = {"path": f"tree{suffix}", "Path": f"tree{suffix}", "URL": url}.get(way)
    source = {"Path": Path(f"tree{suffix}"), "bytes": data, "file": io.BytesIO(data)}.get(way, name)
    with pytest.raises(NotAnAthFile) as caught:
        athcodec.open(source)
    said = f"{f'{name}:' if name else 'this'} is not an .ath file (it looks like {kind})"
    stem = None if name is None else name.removesuffix(suffix)
    call = "athcodec.encode(PATH, 'a.ath')" if name is None else f"athcodec.encode({name!r}, '{stem}.ath')"
    is_source = kind in ("OBJ or PLY", "XDMF", "VTK", "MDD", "PC2", "Alembic", "glTF", "USD", "NumPy archive", "HDF5")
    assert str(caught.value) == said + (f"; {call} makes one" if is_source else "")
    assert caught.value.for_shell == said + ("; use `athcodec encode` first" if is_source else "")
    assert list(tmp_path.iterdir()) == [tmp_path / f"tree{suffix}"]


def test_files_of_no_known_kind_are_said_to_be_that_and_empty_ones_to_be_empty(tmp_path):
    for data, said in ((b"\0\1\2\3", "got first bytes of no format that athcodec knows"), (b"", "got no bytes")):
        (tmp_path / "a.ath").write_bytes(data)
        for call in (athcodec.open, athcodec.AthFile, lambda path: athcodec.truncate(path, tmp_path / "b.ath", 0)):
            with pytest.raises(NotAnAthFile, match=f"a.ath: is not an .ath file \\({said}\\)$"):
                call(tmp_path / "a.ath")


def test_every_format_that_is_read_has_a_kind_that_counts_as_a_source():
    for suffix in (suffix for kind in sources.FORMATS for suffix in kind.suffixes):
        assert kinds.kind_by_suffix(suffix) in kinds.SOURCES, suffix


def test_a_glb_without_a_motion_is_said_to_be_one(tmp_path):
    clip = athcodec.MotionClip(np.cumsum(np.ones((3, 4, 3), np.float32), axis=0), np.arange(3), **BRANCH)
    athcodec.write(clip, tmp_path / "a.glb")
    with pytest.raises(
        ClipError, match="a.glb: ATH_motion: got a GLB without a motion.*; athcodec.encode makes"
    ) as caught:
        athcodec.open(tmp_path / "a.glb")
    assert caught.value.for_shell.endswith(
        "; `athcodec encode` makes an .ath file of its animation, with --into a GLB that holds the motion"
    )


NAMES = sorted({suffix for kind in (*sources.FORMATS, *exporters.FORMATS) for suffix in kind.suffixes})


@pytest.mark.parametrize("suffix", [*NAMES, ".USDA", ".mtg", ".html", ".png", ".json", ".zip"])
def test_an_ath_file_is_not_written_under_the_name_of_another_format(suffix, tmp_path):
    for path in (tmp_path / f"a{suffix}", str(tmp_path / f"a{suffix}")):
        with pytest.raises(
            ClipError, match=f"a{suffix}: is a name for .*, expected .* .ath; athcodec.write writes"
        ) as caught:
            athcodec.encode(STEM, path, **BRANCH)
        assert caught.value.for_shell.endswith("; `athcodec decode` writes other formats, of an .ath file")
        if suffix != ".glb":
            with pytest.raises(ClipError, match=f"a{suffix}: is a name for "):
                athcodec.truncate(athcodec.sample_path("grass"), path, 0)
    assert list(tmp_path.iterdir()) == []


def test_names_that_promise_nothing_are_left_to_their_users(tmp_path):
    for name in ("a", "a.bin", "a.ath", "a.ATH", "tree.v2"):
        athcodec.encode(STEM, tmp_path / name, **BRANCH)
        assert athcodec.open(tmp_path / name).shape == STEM.shape


def test_an_ath_file_as_a_source_or_as_another_format_is_refused_in_the_words_of_python(tmp_path):
    grass = athcodec.sample_path("grass")
    for call in (athcodec.read, athcodec.encode):
        with pytest.raises(ClipError, match="grass.ath: is an .ath file already; athcodec.open opens it"):
            call(grass)
    with (
        athcodec.open(grass) as decoder,
        pytest.raises(ClipError, match="b.ath: is the name of .*; athcodec.encode writes"),
    ):
        athcodec.write(decoder, tmp_path / "b.ath")
    (tmp_path / "a.png").write_bytes(FILES[".png"][1])
    with pytest.raises(ClipError, match="a.png: got an unknown format .it looks like PNG., expected one of .h5"):
        athcodec.read(tmp_path / "a.png")
    with pytest.raises(ClipError, match="a.png: got PNG, expected glTF: a GLB or JSON"):
        athcodec.read(tmp_path / "a.png", "gltf")


def test_an_error_keeps_both_wordings_under_another_name():
    error = errors.ClipError("a: got b", python="call c", shell="type d")
    assert (str(error), error.for_shell) == ("a: got b; call c", "a: got b; type d")
    about = error.about("file")
    assert type(about) is ClipError and (str(about), about.for_shell) == (
        "file: a: got b; call c",
        "file: a: got b; type d",
    )
    assert errors.BoundError("plain").for_shell == "plain" and str(errors.AthError()) == ""
