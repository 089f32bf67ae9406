"""A constant has the same value wherever it is written. The headers of the C core define those of the format, which
Python, JavaScript and FORMAT.md repeat."""

from __future__ import annotations

import re
from ctypes import Structure, byref, c_uint32, c_uint64
from pathlib import Path

import numpy as np
import pytest

from athcodec import _native, errors
from athcodec._native import lib
from athcodec.decoding import container, core_file
from athcodec.encoding.segments import layers
from athcodec.encoding.segments.segmentation import decoding_bytes

ROOT = Path(__file__).resolve().parent.parent
CORE, VIEWER = ROOT / "athcodec" / "core", ROOT / "athcodec" / "viewer"
FORMAT = (ROOT / "FORMAT.md").read_text("utf-8")


def c_constants(*headers: str) -> dict[str, int]:
    """All enumerators, by name without ATH_."""
    found: dict[str, int] = {}
    for header in headers:
        code = re.sub(r"/\*.*?\*/", "", (CORE / header).read_text("utf-8"), flags=re.S)
        for body in re.findall(r"\benum\s*\w*\s*\{([^}]*)\}", code):
            last = -1
            for entry in filter(None, map(str.strip, body.split(","))):
                name, _, value = map(str.strip, entry.partition("="))
                last = eval(value, {}, {f"ATH_{key}": known for key, known in found.items()}) if value else last + 1
                found[name.removeprefix("ATH_")] = last
    return found


C = c_constants("include/ath.h", "bits/format.h", "model/motion.h", "container/container.h", "container/header.h")


def js_constants(path: str) -> dict[str, int]:
    """Integers that are declared at the top of a module."""
    code = (VIEWER / path).read_text("utf-8")
    lines = re.findall(r"^(?:export )?const ((?:[A-Z_]+ = (?:0x)?[0-9a-f]+(?:, )?)+);", code, flags=re.M)
    return {name: int(value, 0) for line in lines for name, value in re.findall(r"([A-Z_]+) = (\w+)", line)}


def test_the_version_of_the_format_is_the_same_everywhere():
    version = C["FORMAT_MAJOR"], C["FORMAT_MINOR"]
    assert version == (container.MAJOR, container.MINOR)
    assert FORMAT.splitlines()[2] == "Format_Version {}.{}".format(*version)
    assert f"\nVERSION = {version}  #" in FORMAT
    [in_table] = re.findall(r"\| Major_Version \| u8 \| (\d+) \|\n.*\| Minor_Version \| u8 \| (\d+),", FORMAT)
    assert tuple(map(int, in_table)) == version


def test_chunks_have_the_same_kinds_and_names_everywhere():
    in_format = {name: int(kind, 16) for name, kind in re.findall(r"^\| ([A-Z_]+) \| (0x\w{4}) \|", FORMAT, flags=re.M)}
    assert len(in_format) == 17 and in_format == {name: kind for kind, name in container.KIND_NAMES.items()}
    for name, kind in in_format.items():
        assert C[name] == getattr(container, name) == kind and lib.ath_kind_name(kind) == name.encode()
    assert {kind for kind in range(1 << 16) if lib.ath_kind_name(kind)} == set(in_format.values())
    assert (C["OPTIONAL"], C["NO_LEVEL"]) == (container.OPTIONAL, container.NO_LEVEL)
    for module in ("src/statics.js", "src/ATHMotion.js", "ath_decoder.template.mjs"):
        kinds = {name: value for name, value in js_constants(module).items() if name in (*in_format, "NO_LEVEL")}
        assert kinds and kinds.items() <= C.items()


def test_levels_layers_and_errors_are_the_same_everywhere():
    assert (C["LEVELS"], C["LAYERS"]) == (layers.MOST_LEVELS, layers.MOST_LAYERS)
    most = {name: int(most) for name, most in re.findall(r"^\| (\w+) \| \d+ to (\d+)\b", FORMAT, flags=re.M)}
    assert (most["Full_Level_Count"], most["Layer_Count"]) == (layers.MOST_LEVELS, layers.MOST_LAYERS)
    assert (C["SHORT_SHIFT"], C["SHORT_FLOATS"]) == (_native.SHORT_SHIFT, _native.SHORT_FLOATS)
    assert (C["MEASURES"], C["LEVEL_NAME"]) == (len(_native.MEASURES), core_file.LEVEL_NAME)
    assert [C["LARGEST"], C["P99"], C["RMS"]] == [_native.MEASURES.index(name) for name in ("max", "p99", "rms")]


def test_limits_are_the_same_everywhere():
    rows = re.findall(r"^\| Max_(\w+) \| (\d+) \| (\d+) \|", FORMAT, flags=re.M)
    full, small = ({name.lower(): int(limits[i]) for name, *limits in rows} for i in range(2))
    assert full == vars(container.Limits()) and small == vars(container.Limits.small())
    for start, limits in ((lib.ath_default_limits, full), (lib.ath_small_limits, small)):
        of_core = core_file.Limits()
        start(byref(of_core))
        assert {name: getattr(of_core, name) for name, _ in of_core._fields_ if name != "reserved"}.items() <= (
            limits.items()
        )


def test_what_is_within_the_small_profile_is_within_the_full_one():
    full, small = vars(container.Limits()), vars(container.Limits.small())
    assert all(small[name] <= full[name] for name in full) and small != full


@pytest.mark.parametrize("vertices, frames", [(1, 1), (7, 256), (8000, 33)])
def test_the_memory_of_a_segment_is_the_same_everywhere(vertices, frames):
    of_places = f"Place_Count * ({C['BYTES_PER_FRAME']} * F + {C['BYTES_PER_VERTEX']})"
    assert f"{of_places} + {C['BYTES_PER_TWIN']} * (Vertex_Count - Place_Count)" in FORMAT
    assert decoding_bytes(vertices, frames) == vertices * (C["BYTES_PER_FRAME"] * frames + C["BYTES_PER_VERTEX"])


def test_codes_of_errors_are_the_same_everywhere():
    in_format = {name: int(code) for code, name in re.findall(r"^\| (\d+) \| ([A-Z_]+) \| [a-z]", FORMAT, flags=re.M)}
    of_python = {error.name: error.code for error in (errors.FormatError, *errors.FormatError.__subclasses__())}
    assert len(in_format) == 14 and in_format == of_python
    for name, code in in_format.items():
        assert C[name] == code and lib.ath_result_name(code) == name.encode()


def test_python_and_javascript_repeat_the_numbers_of_the_core():
    names = "PIECE_VERTICES SEGMENT_FRAMES SHAPE_MODES SHEET LOOSE WHOLE".split()
    assert {name: getattr(_native, name) for name in names}.items() <= C.items()
    names = "OK HELD MISSING FILE_ORDER SOURCE_ORDER FAULT_TEXT".split()
    assert {name: getattr(core_file, name) for name in names}.items() <= C.items()
    repeated = {name: value for name, value in js_constants("ath_decoder.template.mjs").items() if name in C}
    assert repeated.items() <= C.items() and {"MORE", "HELD", "MISSING", "NO_MEMORY", "FAULT_TEXT"} <= repeated.keys()


def test_a_struct_that_python_mirrors_otherwise_is_refused_by_its_name():
    class Range(Structure):
        _fields_ = [("offset", c_uint64), ("size", c_uint32)]

    swapped = [(name, core_file.PART[name]) for name in ("count", "first", "branch", "index")]
    for name, mirror in {"ath_range": Range, "ath_part": np.dtype(swapped), "ath_lost": core_file.PART}.items():
        with pytest.raises(ImportError, match=f"struct {name}: got .* expected .* pip install"):
            _native.check_layouts({name: mirror})


def test_every_struct_in_the_table_of_the_core_is_mirrored():
    assert _native.MIRRORS.keys() | core_file.MIRRORS.keys() == _native.CORE_LAYOUTS.keys()
