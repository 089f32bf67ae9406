"""Fuzzing of the readers of other formats: `python -m fuzz.sources KIND SECONDS SEED`, for cli.py.

An input is a file of one format. It passes where it gives a clip, or one line of a ClipError, within SECONDS of time
and MEMORY; warnings are one line, too. Inputs are valid files, mutated by what they are made of: members of JSON,
numbers in text, fields of headers, arrays of archives.
"""

from __future__ import annotations

import io
import json
import random
import re
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import glb
import numpy as np

KINDS = ("glb", "pc2", "mdd", "obj", "ply", "xdmf", "npz", "vtu", "vtk")
BUDGET = 64 << 20  # bytes, max_memory
MEMORY = 256 << 20  # bytes by which a process may grow: the budget, Python's own objects and what NumPy keeps
SECONDS = 20
CORPUS = Path(__file__).resolve().parent.parent / "corpus"
NUMBERS = (0, 1, -1, 2, 3, 255, 65535, -(2**31), 2**31 - 1, 2**32, 2**53, 2**63, 10**30, 1e308, -1e-320, 0.5)
WORDS = ("nan", "inf", "-inf", "1e400", "9" * 4400, "0x1", "", "1_0", "/", "..", "\0", "ü", "<", "-0", "1e-400")
VALUES = (*NUMBERS, None, True, "x", "..", "\0", [], {}, [0], [[]], {"a": 1}, float(1 << 60))


class Failed(Exception):
    """What is no clip and no ClipError of one line."""


def attempt(kind: str, data: bytes, folder: Path) -> bool:
    """Whether the file gives a clip. Raises Failed."""
    import athcodec
    from athcodec.errors import LONGEST_MESSAGE, ClipError

    path = folder / f"a.{kind}"
    path.write_bytes(data)
    with _timed(), warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("error")
        warnings.simplefilter("always", athcodec.errors.SourceWarning)
        try:
            with athcodec.read(path, max_memory=BUDGET) as clip:
                clip.block(0, min(clip.frame_count, 2))
            refused = None
        except ClipError as error:
            refused = error
        except Exception as error:
            raise Failed("".join(traceback.format_exception(error)[-6:])) from error
    for text in (str(message) for message in (refused, *(one.message for one in warned)) if message is not None):
        if not text.isprintable() or not text.strip() or len(text) > LONGEST_MESSAGE:
            raise Failed(f"a message that is not one short line: {text[:300]!r}") from refused
    return refused is None


@contextmanager
def _timed() -> Iterator[None]:
    def late(*_: object) -> None:
        raise Failed(f"no end after {SECONDS} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def peak() -> int:
    """Bytes."""
    status = Path("/proc/self/status")
    return int(re.search(r"VmHWM:\s+(\d+)", status.read_text())[1]) * 1024 if status.exists() else 0


# ---- valid files ----


@cache
def seeds(kind: str) -> tuple[bytes, ...]:
    """Small valid files of a format, and those that once went wrong."""
    if kind == "vtk":
        return tuple(text.encode() for text in LEGACY)
    from moving_meshes import quad_clip
    from plants import plant

    import athcodec

    found = []
    with tempfile.TemporaryDirectory() as name:
        for number, clip in enumerate((plant(seed=1, branches=3, frames=4), quad_clip(frames=3, rings=3))):
            for more in ({}, {"gzip": True}) if kind in ("npz", "vtu") else ({},):
                for animation in ("joints", "morphs") if kind == "glb" else ("auto",):
                    folder = Path(name, f"{number}{len(found)}")
                    folder.mkdir()
                    athcodec.write(clip, folder / f"a.{kind}", animation=animation, **more)
                    file = next(file for file in sorted(folder.iterdir()) if file.suffix == f".{kind}")
                    found.append(file.read_bytes())
    if kind == "xdmf":
        found.append(XDMF.encode())
    found += [path.read_bytes() for path in sorted(CORPUS.glob(f"*.{kind}"))]
    return tuple(found)


_LEGACY = "# vtk DataFile Version {}\ntime 0.5\n{}\nDATASET {}\n"
_POINTS = "POINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n"
_DATA = """POINT_DATA 4
SCALARS a double 1
LOOKUP_TABLE default
0 1 2 3
LOOKUP_TABLE default 2
0 0 0 1 1 1 1 1
VECTORS displacement float
0 0 0 1 0 0 0 1 0 1 1 0
FIELD FieldData 2
names 1 4 string
a

c
d
age 1 4 short
0 1 2 3
METADATA
COMPONENT_NAMES
a

CELL_DATA 2
NORMALS n float
0 0 1 0 0 1
"""
LEGACY = (
    _LEGACY.format("3.0", "ASCII", "POLYDATA")
    + "FIELD FieldData 1\nTIME 1 1 double\n0.5\n"
    + _POINTS
    + "LINES 1 3\n2 0 1\nPOLYGONS 1 4\n3 0 1 2\n"
    + _DATA,
    _LEGACY.format("5.1", "ASCII", "UNSTRUCTURED_GRID")
    + _POINTS
    + "CELLS 3 7\nOFFSETS vtktypeint64\n0 3 7\nCONNECTIVITY vtktypeint64\n0 1 2 0 1 3 2\nCELL_TYPES 2\n5 9\n"
    + _DATA,
    _LEGACY.format("3.0", "ASCII", "STRUCTURED_GRID") + "DIMENSIONS 2 2 1\n" + _POINTS,
    _LEGACY.format("3.0", "ASCII", "STRUCTURED_POINTS") + "DIMENSIONS 2 3 4\nORIGIN 0 0 0\nSPACING 1 1 1\n",
    _LEGACY.format("3.0", "ASCII", "RECTILINEAR_GRID")
    + "DIMENSIONS 2 1 1\nX_COORDINATES 2 float\n0 1\nY_COORDINATES 1 float\n0\nZ_COORDINATES 1 float\n0\n",
    _LEGACY.format("3.0", "BINARY", "POLYDATA")
    + "POINTS 2 float\n"
    + 24 * "\0"
    + "\nLINES 1 3\n"
    + "\0\0\0\2\0\0\0\0\0\0\0\1\nPOINT_DATA 2\nFIELD FieldData 2\nb 1 2 bit\nA\ns 1 2 string\n\0\0\0\0\0\0\0\1aA\n",
)


XDMF = """<Xdmf Version="3.0"><Domain><Grid GridType="Collection" CollectionType="Temporal">
<Grid><Time Value="0"/><Topology TopologyType="Mixed" NumberOfElements="2"><DataItem Dimensions="9" Format="XML"
 NumberType="Int">4 0 1 2 5 0 1 2 3</DataItem></Topology><Geometry GeometryType="XYZ"><DataItem Dimensions="4 3"
 Format="XML">0 0 0 1 0 0 0 1 0 1 1 0</DataItem></Geometry><Attribute Name="u" Center="Node"><DataItem
 Dimensions="4 3" Format="XML">0 0 0 1 0 0 0 1 0 1 1 0</DataItem></Attribute><Attribute Name="c" Center="Cell">
<DataItem Dimensions="2" Format="XML">1 2</DataItem></Attribute></Grid>
<Grid><Time Value="0.1"/><Topology TopologyType="Mixed" NumberOfElements="2"><DataItem Dimensions="9" Format="XML"
 NumberType="Int">4 0 1 2 5 0 1 2 3</DataItem></Topology><Geometry GeometryType="XYZ"><DataItem ItemType="HyperSlab"
 Dimensions="4 3"><DataItem Dimensions="3 2" Format="XML" NumberType="Int">0 0 1 1 4 3</DataItem><DataItem
 Dimensions="4 3" Format="XML">0 0 0 1 0 0 0 1 0 1 1 0</DataItem></DataItem></Geometry><Attribute Name="u">
<DataItem Dimensions="4 3" Format="XML">0 0 1 1 0 0 0 1 0 1 1 0</DataItem></Attribute></Grid></Grid></Domain></Xdmf>"""


# ---- mutation ----


def mutated(kind: str, data: bytes, rng: random.Random) -> bytes:
    """The file with a few changes, by the ways of its format."""
    ways = WAYS[kind]
    for _ in range(rng.choice((1, 1, 2, 4))):
        try:
            data = rng.choice(ways)(data, rng)
        except Exception:  # what it was made of is gone already
            data = _bytes(data, rng)
    return data


def _bytes(data: bytes, rng: random.Random) -> bytes:
    """Some bytes changed, taken out, put in or doubled."""
    made, at = bytearray(data), rng.randrange(len(data) + 1)
    how = rng.randrange(5)
    if how == 0 and made:
        made[at % len(made)] = rng.randrange(256)
    elif how == 1:
        del made[at : at + rng.choice((1, 4, 100))]
    elif how == 2:
        made[at:at] = rng.randbytes(rng.choice((1, 4, 16)))
    elif how == 3:
        made[at:at] = made[at : at + rng.choice((4, 12, 200))]
    else:
        del made[at:]
    return bytes(made)


def _fields(data: bytes, rng: random.Random) -> bytes:
    """A number of four bytes in the first of the file, or anywhere."""
    at = 4 * rng.randrange(max(1, min(len(data), rng.choice((64, len(data)))) // 4))
    number = rng.choice((0, 1, -1, 2**31 - 1, -(2**31), rng.randrange(-(2**31), 2**31), rng.randrange(64)))
    return data[:at] + struct.pack(rng.choice("<>") + "i", number) + data[at + 4 :]


def _text(data: bytes, rng: random.Random) -> bytes:
    """A word of a text replaced by another, or by a number that is hard to hold."""
    words = re.split(rb"([\s\"<>=/]+)", data)
    at = rng.randrange(len(words))
    new = rng.choice((str(rng.choice(NUMBERS)), rng.choice(WORDS))).encode()
    words[at] = rng.choice((new, rng.choice(words), b""))
    return b"".join(words)


def _json(data: bytes, rng: random.Random) -> bytes:
    """A member of the JSON of a GLB, whose lengths fit again."""
    gltf, behind = glb.apart(data)
    places = list(_places(gltf))
    holder, key = rng.choice(places)
    if rng.random() < 0.2 and isinstance(holder, dict):
        del holder[key]
    elif rng.random() < 0.2:
        other, name = rng.choice(places)
        holder[key] = json.loads(json.dumps(other[name]))
    else:
        holder[key] = rng.choice(VALUES)
    text = json.dumps(gltf)
    if rng.random() < 0.1:
        text = re.sub(r"\d+", lambda found: "9" * 4400 if rng.random() < 0.05 else found[0], text)
    return glb.together(text.encode(), behind)


def _places(value: object) -> Iterator[tuple]:
    for key, item in list(value.items() if isinstance(value, dict) else enumerate(value)):
        yield value, key
        if isinstance(item, (dict, list)):
            yield from _places(item)


def _archive(data: bytes, rng: random.Random) -> bytes:
    """An array of an .npz: another shape, type or name, or bytes of it; with the checksum that belongs to it."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    name = rng.choice(list(members))
    how = rng.randrange(4)
    if how == 0:
        members[name] = _bytes(members[name], rng)
    elif how == 1:
        shape = tuple(rng.choice((0, 1, 2, 3, 2**40, 7)) for _ in range(rng.randrange(4)))
        dtype = rng.choice(("<f4", ">f8", "<i8", "|b1", "<U3", "|S4", "<c8", "<M8[s]", "|V0", "<f2", "|O"))
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(header, {"descr": dtype, "fortran_order": how == 2, "shape": shape})
        members[name] = header.getvalue() + members[name][-rng.choice((4, 100)) :]
    elif how == 2:
        array = rng.choice(
            (np.array(rng.choice((3.5, -1, "x", b"y", True))), np.zeros((2, 3)), np.full((4, 3), np.nan))
        )
        members[name] = _saved(array)
    else:
        new = rng.choice(("faces", "edges", "rest", "time", "vertex_branch", "branch_parent", "stem_index", "metadata"))
        members[f"{new}.npy"] = members.pop(name)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return out.getvalue()


def _saved(array: np.ndarray) -> bytes:
    out = io.BytesIO()
    np.lib.format.write_array(out, array)
    return out.getvalue()


WAYS: dict[str, tuple[Callable[[bytes, random.Random], bytes], ...]] = {
    "glb": (_json, _json, _json, _bytes, _fields),
    "pc2": (_fields, _bytes),
    "mdd": (_fields, _bytes),
    "obj": (_text, _text, _bytes),
    "ply": (_text, _fields, _bytes),
    "xdmf": (_text, _text, _bytes),
    "npz": (_archive, _archive, _bytes, _fields),
    "vtu": (_text, _text, _bytes),
    "vtk": (_text, _text, _bytes, _fields),
}


# ---- runs ----


def blind(kind: str, seconds: float, seed: int, runs: int = 1 << 62) -> dict:
    """Mutates valid files for some time, or so many times: {"tried", "failure", "input"}."""
    rng, tried, until = random.Random(seed), 0, time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as name:
        for data in seeds(kind):
            attempt(kind, data, Path(name))
        start = peak()
        while tried < runs and time.monotonic() < until:
            data = mutated(kind, rng.choice(seeds(kind)), rng)
            try:
                attempt(kind, data, Path(name))
                if peak() - start > MEMORY:
                    raise Failed(f"the process has grown by {peak() - start:,} bytes")
            except Failed as error:
                return {"tried": tried, "failure": str(error), "input": data.hex()}
            tried += 1
    return {"tried": tried, "failure": "", "input": ""}


def main() -> None:
    kind, seconds, seed = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    result = blind(kind, seconds, seed)
    print(json.dumps(result))
    sys.exit(bool(result["failure"]))


if __name__ == "__main__":
    main()
