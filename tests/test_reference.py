"""The reference decoder against the C core, bit for bit: on what the encoder writes, on files by hand with
everything that FORMAT.md allows, and on damaged ones; and its command line."""

from __future__ import annotations

import io
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from files import Parts, opened
from plants import awkward, bush, chain_plant, clip_of, grow, plant, random_hierarchy, tube
from test_format import HandMade, Sapling

import athcodec
from athcodec.errors import FormatError

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "spec" / "reference_decoder.py"
VECTORS = ROOT / "spec" / "vectors" / "valid"
sys.path.append(str(ROOT))  # for spec, which is not installed; athcodec stays the installed one

from spec import reference_decoder as reference  # noqa: E402

WITH_MODES = athcodec.Thresholds(0, 0, 0, 0)  # whatever is smaller


def assert_same_bits(data: bytes) -> None:
    """Every level, the rest pose of the last, the times and the static data; NaN only as such."""
    file = reference.AthFile(data, strict=True)
    with athcodec.open(io.BytesIO(data), strict=True) as decoder:
        played = [decoder.play(clip.name) for clip in decoder.clips]
        for level in range(decoder.level_count):
            assert_same_numbers(file.positions(level), np.concatenate([clip.positions(level=level) for clip in played]))
        assert_same_numbers(file.rest(decoder.level_count - 1), decoder.rest)
        assert_same_numbers(np.concatenate(file.times), np.concatenate([clip.time for clip in played]))
        assert [(clip.name, clip.frames, clip.segments, clip.seams) for clip in file.clips] == [
            (clip.name, clip.frame_count, clip.segment_count, clip.seam_errors if clip.loop else None)
            for clip in decoder.clips
        ]
        common = file.metadata()
        own = common.pop("clips", {})
        assert [common | own.get(clip.clip.name, {}) for clip in played] == [clip.metadata for clip in played]
        assert_same_static(
            [file.faces(), file.edges(), *file.attributes().values()],
            [decoder.faces, decoder.edges, *decoder.attributes.values()],
        )
        assert list(file.attributes()) == list(decoder.attributes)


def assert_same_numbers(got: np.ndarray, expected: np.ndarray) -> None:
    assert got.dtype == expected.dtype and got.shape == expected.shape
    assert np.array_equal(np.isnan(got), np.isnan(expected))
    assert np.nan_to_num(got, nan=0.0).tobytes() == np.nan_to_num(expected, nan=0.0).tobytes()


def assert_same_static(got: list, expected: list) -> None:
    for one, other in zip(got, expected, strict=True):
        assert (one is None) == (other is None)
        if one is not None:
            assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())


def encoded(clip, folder: Path, **options) -> bytes:
    athcodec.encode(clip, folder / "clip.ath", **options)
    return (folder / "clip.ath").read_bytes()


def chunk_kinds(data: bytes) -> set[str]:
    return {athcodec.container.KIND_NAMES[chunk.kind] for chunk, _ in Parts.of(data).chunks}


# ---- what the encoder writes ----


@pytest.mark.parametrize(
    "options",
    [
        pytest.param({"effort": "fast"}, id="default bound"),
        pytest.param({"rel_error": 1e-3, "segment_frames": 256}, id="coarse, one segment", marks=pytest.mark.slow),
        pytest.param({"max_error": 1e-5, "effort": "fast"}, id="fine", marks=pytest.mark.slow),
    ],
)
def test_the_sample_has_the_same_bits(options, sample_clip, tmp_path):
    assert_same_bits(encoded(sample_clip, tmp_path, **options))


def test_files_with_shapes_and_every_kind_of_chunk_have_the_same_bits(full_ath):
    data = full_ath.read_bytes()
    others = {"CLIPS", "EXACT", "REFINED_REST", "PREDICTED"}
    assert chunk_kinds(data) == set(athcodec.container.KIND_NAMES.values()) - others
    assert_same_bits(data)


def test_a_bush_in_several_segments_has_the_same_bits(bushy_ath):
    assert_same_bits(bushy_ath.read_bytes())


def test_learned_time_bases_have_the_same_bits(tmp_path):
    rng = np.random.default_rng(3)
    labels, parents = random_hierarchy(rng, branches=20, longest=9)
    rest = grow(rng, labels, parents)
    signals, reach = rng.normal(size=(48, 3)), 0.3 * rng.normal(size=(3, len(rest), 3))
    data = encoded(
        clip_of(rest + np.einsum("tk,knc->tnc", signals, reach), rest, labels, parents),
        tmp_path,
        rel_error=1e-4,
        segment_frames=24,
    )
    file = reference.AthFile(data)
    stems = [file.content(16, chunk.level, chunk.segment) for chunk in file.chunks if chunk.kind == 16]
    assert any(content[5] for content in stems), "no basis was learned"
    assert_same_bits(data)


def test_coarse_layers_in_the_waves_of_maps_have_the_same_bits(sample_clip, tmp_path):
    data = encoded(sample_clip, tmp_path, rel_error=1e-3, ladder=(1e-2,), segment_frames=40, effort="fast")
    file = reference.AthFile(data)
    kinds = {chunk.level: file.content(16, chunk.level, 0) for chunk in file.chunks if chunk.kind == 16}
    assert kinds.pop(max(kinds))[7] == 0 and all(content[5] == 1 for content in kinds.values())
    assert_same_bits(data)


@pytest.mark.parametrize(
    "make, options",
    [
        (lambda: awkward(seed=8, branches=9, dtype=np.float64, offset=1e3, motion="sway"), {"rel_error": 1e-6}),
        (lambda: plant(seed=2, roots=2, offset=50.0), {"exact_rest": True}),
        (lambda: plant(seed=3, dtype=np.float64), {"exact_rest": True}),
        (lambda: tube(rings=10, around=8, frames=20), {}),
        (lambda: awkward(seed=4, shape="flat", motion="spin", longest=12), {}),
        (lambda: awkward(seed=5, motion="mirror", longest=70, shuffled=True), {}),
        (lambda: awkward(seed=6, shape="coincident", motion="teleport"), {}),
        (lambda: chain_plant(branches=12, longest=3), {"segment_frames": 16}),
        (lambda: bush(branches=25), {"rel_error": 1e-2}),
    ],
    ids=["wide", "exact rest", "wide exact rest", "tube", "sheets", "mirrored", "coincident", "chain", "bush"],
)
def test_plants_of_all_sorts_have_the_same_bits(make, options, tmp_path):
    assert_same_bits(encoded(make(), tmp_path, effort="fast", **options))


@pytest.mark.parametrize(
    "make, options",
    [
        (lambda: plant(seed=21, roots=2, branches=9), {"segment_frames": 16}),
        (lambda: awkward(seed=8, branches=9, dtype=np.float64, offset=1e3, motion="sway"), {"rel_error": 1e-6}),
        (lambda: plant(seed=3, dtype=np.float64), {"exact_rest": True}),
        (lambda: plant(seed=9, branches=5, frames=20), {"lossless": True, "rel_error": 1e-3, "ladder": (1e-1, 1e-2)}),
        (lambda: tube(rings=10, around=8, frames=20), {"effort": "default"}),
        (lambda: awkward(seed=4, shape="flat", motion="spin", longest=12), {}),
        (lambda: awkward(seed=5, motion="mirror", longest=70, shuffled=True), {"effort": "default"}),
        (lambda: awkward(seed=6, shape="coincident", motion="teleport"), {}),
        (lambda: chain_plant(branches=12, longest=3), {}),
    ],
    ids=["sway", "wide", "exact rest", "lossless", "tube", "sheets", "mirrored", "coincident", "chain"],
)
def test_layers_have_the_same_bits(make, options, tmp_path):
    given = {"rel_error": 1e-4, "ladder": (1e-2, 1e-3), "effort": "fast", "tam": WITH_MODES} | options
    data = encoded(make(), tmp_path, **given)
    assert reference.AthFile(data).header.layer_count > 1
    assert_same_bits(data)


def test_shapes_of_layers_and_several_clips_have_the_same_bits(full_clip, medley_clips, tmp_path):
    given = {"rel_error": 1e-4, "ladder": (1e-2, 1e-3), "tam": WITH_MODES, "rest_error": "bound"}
    data = encoded(full_clip, tmp_path, segment_frames=16, **given)
    assert chunk_kinds(data) >= {"SHAPES", "REFINED_REST"}
    assert_same_bits(data)
    data = encoded(athcodec.join(medley_clips), tmp_path, **given)
    assert reference.AthFile(data).header.layer_count > 1
    assert_same_bits(data)


def with_a_bit_changed(parts, chosen, random):
    """A file with one bit of one of the chosen chunks changed, and a checksum that fits; that chunk."""
    i, chunks = int(random.choice(chosen)), list(parts.chunks)
    content = bytearray(chunks[i][1])
    content[random.integers(len(content))] ^= 1 << random.integers(8)
    chunks[i] = chunks[i][0], bytes(content)
    return parts.with_chunks(chunks), chunks[i][0]


@pytest.mark.parametrize("name", [pytest.param("layers-mixed", marks=pytest.mark.slow), "layers-three"])
def test_corrupted_refinements_are_refused_alike_or_mean_the_same(name):
    """One byte of a chunk of a refinement is another, and its checksum fits."""
    parts, random = Parts.of((VECTORS / f"{name}.ath").read_bytes()), np.random.default_rng(6)
    h = reference.AthFile(parts.file()).plan.height
    chosen = [
        i for i, (chunk, content) in enumerate(parts.chunks) if chunk.is_motion and chunk.level > h + 1 and content
    ]
    refused = 0
    for _ in range(15):
        data, chunk = with_a_bit_changed(parts, chosen, random)
        level = chunk.level
        got = outcome(lambda data=data, level=level: reference.AthFile(data).positions(level))
        expected = outcome(lambda data=data, level=level: opened(data).positions(level=level))
        refused += isinstance(expected, str)
        if isinstance(expected, str) or isinstance(got, str):
            assert isinstance(got, str) and got == expected
        else:
            assert_same_numbers(got, expected)
    assert 0 < refused < 15


def test_several_clips_have_the_same_bits(medley_ath):
    assert_same_bits(medley_ath.read_bytes())


def test_uneven_times_and_static_data_have_the_same_bits(forked_clip, tmp_path):
    assert_same_bits(encoded(forked_clip, tmp_path, max_error=1e-3))


# ---- what no encoder writes ----


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_lossless_files_have_the_same_bits(dtype, tmp_path):
    clip = plant(seed=9, branches=5, frames=20, dtype=dtype)
    assert_same_bits(encoded(clip, tmp_path, rel_error=1e-3, lossless=True, segment_frames=16))


@pytest.mark.parametrize("seed, is_float64, exact", [(1, False, None), (4, True, np.float64)])
def test_every_feature_has_the_same_bits(seed, is_float64, exact):
    assert_same_bits(HandMade(seed, is_float64, exact).file())


@pytest.mark.parametrize("seed", range(4))
def test_saplings_have_the_same_bits(seed):
    assert_same_bits(Sapling(seed).file())


def outcome(call) -> object:
    """What a call gives, or the name of what it refuses a file for."""
    try:
        return call()
    except (FormatError, reference.AthError) as error:
        return error.name


@pytest.mark.parametrize("name", ["clips-loops", "clips-time-uneven"])
def test_corrupted_clips_and_times_are_refused_alike_or_mean_the_same(name):
    parts = Parts.of((VECTORS / f"{name}.ath").read_bytes())
    outcomes = []
    for kind, content in changed_contents(parts, {"CLIPS", "TIME"}):
        data = parts.with_payload(kind, content)
        outcomes.append(outcome(lambda data=data: assert_same_bits(data)))
        assert outcomes[-1] == outcome(lambda data=data: opened(data).file.check())
    assert 15 < outcomes.count("BAD_CHUNK") < 59


def changed_contents(parts: Parts, names: set[str]) -> Iterator[tuple[int, bytes]]:
    """Contents of chunks of these kinds, each with a bit flipped, a byte less or a byte more."""
    random = np.random.default_rng(5)
    chunks = [(c.kind, content) for c, content in parts.chunks if athcodec.container.KIND_NAMES[c.kind] in names]
    for i in range(60):
        kind, content = chunks[i % len(chunks)]
        at, changed = int(random.integers(len(content))), bytearray(content)
        way = random.integers(6)
        if way == 0:
            del changed[at]
        elif way == 1:
            changed.insert(at, int(random.integers(256)))
        else:
            changed[at] ^= 1 << int(random.integers(8))
        yield kind, bytes(changed)


def test_corrupted_chunks_are_refused_alike_or_mean_the_same(full_ath):
    """Motion, hierarchy, rest and times with some bytes changed, and checksums that fit."""
    parts, rng = Parts.of(full_ath.read_bytes()), np.random.default_rng(0)
    motion_or_prelude = [i for i, (c, _) in enumerate(parts.chunks) if c.is_motion or c.kind < 4]
    refused = 0
    for _ in range(40):
        data, chunk = with_a_bit_changed(parts, motion_or_prelude, rng)
        level = chunk.level if chunk.is_motion else parts.header.level_count - 1
        got = outcome(lambda data=data, level=level: reference.AthFile(data).positions(level))
        expected = outcome(lambda data=data, level=level: opened(data).positions(level=level))
        if isinstance(expected, str) or isinstance(got, str):
            refused += 1
            assert isinstance(got, str) and got == expected
        else:
            assert_same_numbers(got, expected)
    assert 5 < refused < 38


# ---- files that end early ----


def test_a_prefix_plays_as_far_as_it_goes(bushy_ath):
    data = bushy_ath.read_bytes()
    for size in np.random.default_rng(1).integers(0, len(data), 12).tolist():
        got = outcome(lambda size=size: reference.AthFile(data[:size]).positions())
        expected = outcome(lambda size=size: athcodec.open(io.BytesIO(data[:size])).positions())
        assert type(got) is type(expected)
        assert got == expected if isinstance(got, str) else np.array_equal(got, expected)
        with pytest.raises(reference.AthError, match="TRUNCATED"):
            reference.AthFile(data[:size], strict=True)


# ---- the command, and what it is made of ----


def run(*words) -> subprocess.CompletedProcess:
    command = [sys.executable, str(SOURCE), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def test_the_command_shows_a_level_and_writes_it(bushy_ath, tmp_path):
    done = run(bushy_ath, "--level", 1, "--out", tmp_path / "positions.npy", "--checksum")
    assert done.returncode == 0, done.stderr
    with athcodec.open(bushy_ath) as decoder:
        expected = decoder.positions(level=1)
    assert np.load(tmp_path / "positions.npy").tobytes() == expected.tobytes()
    assert "level 1 of" in done.stdout
    assert done.stdout.split()[-1] == f"{athcodec.container.crc32c(expected.tobytes()):08x}"


def test_the_command_lists_clips():
    done = run(VECTORS / "clips-loops.ath", "--level", 0)
    assert done.stdout.splitlines()[1:] == ["'calm': 3 frames, a loop", "'once': 2 frames", "'storm': 4 frames, a loop"]


def test_the_command_names_what_is_wrong_and_fails(bushy_ath, tmp_path):
    (tmp_path / "cut.ath").write_bytes(bushy_ath.read_bytes()[:-1])
    done = run("--strict", tmp_path / "cut.ath")
    assert done.returncode == 1 and done.stderr.startswith("TRUNCATED: ") and "\n" not in done.stderr.strip()
    assert run(tmp_path / "none.ath").returncode == 1
    assert run(bushy_ath, "--level", 99).returncode == 1


def test_it_needs_numpy_and_zstandard_alone():
    """Else it would not be a second decoder."""
    text = SOURCE.read_text(encoding="utf-8")
    imported = set(re.findall(r"^ *(?:import (\w+)|from (\w+) import)", text, re.M))
    names = {name for pair in imported for name in pair if name}
    assert names - sys.stdlib_module_names == {"numpy", "zstandard"}


def test_its_limits_are_those_of_the_package():
    assert vars(reference.Limits()) == vars(athcodec.container.Limits())
