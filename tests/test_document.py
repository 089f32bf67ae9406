"""FORMAT.md's code as a whole against the C core, bit for bit: on what the encoder writes of plants of all sorts, and
on damaged files; and its command line. Vectors and files by hand: test_vectors.py, test_format.py."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from files import Parts, opened
from plants import awkward, bush, chain_plant, plant, tube

import athcodec
from athcodec.errors import FormatError
from spec import conformance, document
from spec.document import TEXT, File, rules

ROOT = Path(__file__).resolve().parent.parent
VECTORS = ROOT / "spec" / "vectors" / "valid"
WITH_MODES = athcodec.Thresholds(0, 0, 0, 0)  # whatever is smaller
LAYERS = {"rel_error": 1e-4, "ladder": (1e-2, 1e-3), "tam": WITH_MODES}


def assert_same_bits(data: bytes) -> None:
    """Every level, the rest pose of the last, the times and the static data; NaN only as such."""
    file = File(data, strict=True)
    with athcodec.open(io.BytesIO(data), strict=True) as decoder:
        played = [decoder.play(clip.name) for clip in decoder.file.clips]
        for level in range(decoder.file.level_count):
            assert_same_numbers(file.positions(level), np.concatenate([clip.positions(level=level) for clip in played]))
        assert_same_numbers(file.rest(decoder.file.level_count - 1), decoder.file.rest)
        assert [list(clip.time) for clip in played] == file.file.times
        assert all_arrays(decoder) == file.arrays()


def assert_same_numbers(got: np.ndarray, expected: np.ndarray) -> None:
    assert got.dtype == expected.dtype and got.shape == expected.shape
    assert np.array_equal(np.isnan(got), np.isnan(expected))
    assert np.nan_to_num(got, nan=0.0).tobytes() == np.nan_to_num(expected, nan=0.0).tobytes()


def outcome(call) -> object:
    """What a call gives, or the name of what it refuses a file for."""
    try:
        return call()
    except FormatError as error:
        return error.name
    except rules.Invalid as error:
        return str(error)


@pytest.mark.parametrize(
    "make, options",
    [
        (
            lambda: awkward(seed=8, branches=5, dtype=np.float64, offset=1e3, motion="sway", frames=12),
            {"rel_error": 1e-6},
        ),
        (lambda: plant(seed=2, roots=2, branches=5, offset=50.0, frames=12), {"exact_rest": True}),
        (lambda: plant(seed=3, branches=5, dtype=np.float64, frames=18), {"exact_rest": True, "segment_frames": 16}),
        (lambda: tube(rings=6, around=6, frames=8), {}),
        (lambda: awkward(seed=4, shape="flat", motion="spin", longest=9, frames=12), {}),
        (lambda: awkward(seed=5, motion="mirror", longest=30, shuffled=True, frames=12), {}),
        (lambda: awkward(seed=6, shape="coincident", motion="teleport"), {}),
        (lambda: chain_plant(branches=6, longest=3), {"segment_frames": 16}),
        (lambda: bush(branches=10), {"rel_error": 1e-2}),
    ],
    ids=["wide", "exact rest", "wide exact rest", "tube", "sheets", "mirrored", "coincident", "chain", "bush"],
)
@pytest.mark.parametrize("layers", [{}, LAYERS], ids=["one layer", "layers"])
def test_plants_of_all_sorts_have_the_same_bits(make, options, layers, tmp_path):
    athcodec.encode(make(), tmp_path / "clip.ath", **{"effort": "fast"} | layers | options)
    assert_same_bits((tmp_path / "clip.ath").read_bytes())


@pytest.mark.parametrize("lossless", [pytest.param(False, marks=pytest.mark.vectors), True])
def test_several_clips_have_the_same_bits(medley_clips, lossless, tmp_path):
    athcodec.encode(athcodec.join(medley_clips), tmp_path / "clips.ath", effort="fast", lossless=lossless, **LAYERS)
    assert_same_bits((tmp_path / "clips.ath").read_bytes())


def with_a_bit_changed(parts, random, kinds):
    """A file with one bit of a chunk of these kinds changed, and a checksum that fits; that chunk."""
    chosen = [i for i, (chunk, content) in enumerate(parts.chunks) if content and chunk.kind in kinds]
    i, chunks = int(random.choice(chosen)), list(parts.chunks)
    content = bytearray(chunks[i][1])
    content[random.integers(len(content))] ^= 1 << random.integers(8)
    chunks[i] = chunks[i][0], bytes(content)
    return parts.with_chunks(chunks), chunks[i][0]


RESTS = "vertices copies-of-many copies-far".split()
RESTS += "connected-quads connected-order connected-places connected-places-exact".split()
FACES = ["mixed", "many-quads", "up-and-on"]
LARGE = ["clips-time-uneven", "tubes", *(f"rest-{name}" for name in RESTS[:-1])]
MANY = [*LARGE, "layers-mixed", "layers-three", "clips-loops"]
CORRUPTED = [(name, 40) for name in (f"rest-{RESTS[-1]}", *(f"faces-{name}" for name in FACES))]
CORRUPTED += [(name, 12) for name in LARGE]


@pytest.mark.parametrize(
    ("name", "changes"), [*CORRUPTED, *(pytest.param(name, 40, marks=pytest.mark.vectors) for name in MANY)]
)
def test_corrupted_chunks_are_refused_alike_or_mean_the_same(name, changes):
    """Any chunk of the prelude and of motion, or that of the rest pose or the faces which the vector is about."""
    parts, random = Parts.of((VECTORS / f"{name}.ath").read_bytes()), np.random.default_rng(6)
    every = {chunk.kind for chunk, _ in parts.chunks if chunk.is_motion or chunk.kind < 16}
    kinds = {"rest": {rules.REST}, "faces": {rules.FACES}}.get(name.split("-")[0], every)
    refused = 0
    for _ in range(changes):
        data, chunk = with_a_bit_changed(parts, random, kinds)
        level = chunk.level if chunk.is_motion else parts.header.level_count - 1
        if chunk.kind == rules.FACES:
            got = outcome(lambda data=data: File(data).arrays())
            expected = outcome(lambda data=data: all_arrays(opened(data)))
        else:
            got = outcome(lambda data=data, level=level: File(data).positions(level))
            expected = outcome(lambda data=data, level=level: all_positions(data, level))
        refused += isinstance(expected, str)
        if isinstance(expected, np.ndarray) and isinstance(got, np.ndarray):
            assert_same_numbers(got, expected)
        else:
            assert got == expected
    assert 0 < refused < changes


def all_arrays(decoder: athcodec.Decoder) -> list[bytes]:
    arrays = [decoder.file.faces, decoder.file.edges, *decoder.file.attributes.values()]
    return [array.tobytes() for array in arrays if array is not None]


def all_positions(data: bytes, level: int) -> np.ndarray:
    with opened(data) as decoder:
        return np.concatenate([decoder.play(clip.name).positions(level=level) for clip in decoder.file.clips])


def test_a_prefix_plays_as_far_as_it_goes():
    data = (VECTORS / "layers-mixed.ath").read_bytes()
    for size in np.random.default_rng(1).integers(0, len(data), 12).tolist():
        got = outcome(lambda size=size: File(data[:size]).positions())
        expected = outcome(lambda size=size: athcodec.open(io.BytesIO(data[:size])).positions())
        assert type(got) is type(expected)
        assert got == expected if isinstance(got, str) else np.array_equal(got, expected)
        with pytest.raises(rules.Invalid, match=r"TRUNCATED|NOT_AN_ATH_FILE"):
            File(data[:size], strict=True)


MISTAKES = {  # By a vector that tells it: what the document says, and what a decoder's author could write in its place.
    "gaps": ("gaps.append(64 if quarters >= 64.0", "gaps.append(65 if quarters >= 64.0"),
    "rigid-diagonal": ("norm2 * 1e-30:\n            continue", "norm2 * 1e-30:\n            pass"),
    "sheet-mode-below": ("if after > before * keep:", "if True:"),
    "tangent-short-above": (
        "\n    if not squared(tangent) > LEAST_SQUARE:",
        "\n    if not squared(tangent) > 1.0625e-200:",
    ),
    "smallest": ("if self.range < (1 << 32):", "if self.range < (1 << 31):"),
}


def answers(vector: conformance.Vector, own: ModuleType) -> dict[str, str]:
    def ask(data: bytes, item: str, mesh: bytes | None) -> bytes:
        try:
            return File(data, item == "strict", mesh, own).answer(item)
        except own.Invalid as error:
            raise conformance.Refused(str(error)) from None

    return {item: conformance.result(ask, vector.path.read_bytes(), item) for item in vector.results}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_vector_tells_a_changed_decoder_from_the_true_one(name):
    (true, changed), vectors = MISTAKES[name], conformance.vectors()
    vector = next(vector for vector in vectors if vector.path.stem == name)
    assert TEXT.count(true) == 1 and answers(vector, rules) == vector.results
    with suppress(ArithmeticError, LookupError, TypeError):  # with which a changed decoder stops
        assert answers(vector, document.run(TEXT.replace(true, changed))) != vector.results


def run(*words) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "spec.document", *map(str, words)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, timeout=120)


def test_the_command_answers_items_and_names_what_is_wrong(tmp_path):
    path = VECTORS / "layers-mixed.ath"
    done = run(path, 1)
    assert done.returncode == 0 and done.stdout == all_positions(path.read_bytes(), 1).tobytes()
    (tmp_path / "cut.ath").write_bytes(path.read_bytes()[:-1])
    done = run(tmp_path / "cut.ath", "strict")
    assert done.returncode == 1 and done.stdout == b"" and done.stderr == b"TRUNCATED\n"
    assert run(tmp_path / "none.ath").returncode == 1 and run(path, 99).returncode == 1
