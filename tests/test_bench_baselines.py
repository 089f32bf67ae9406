"""Baselines of the benchmark keep their bound and count what they need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from athcodec.motion.clip import MotionClip
from bench.codecs import Source, check
from bench.codecs.acl import SEGMENT, SkeletalTracks, _Track
from bench.codecs.baseline import Choice, Ladder, Search
from bench.codecs.baselines import BASELINES
from bench.codecs.coder import Reader, Writer
from bench.codecs.ours import Athcodec

pytestmark = pytest.mark.tools

ROOT = Path(__file__).resolve().parent.parent
BOUND = 3e-4  # over the diagonal


@pytest.fixture(autouse=True)
def short_search(monkeypatch):
    monkeypatch.setattr("bench.codecs.baseline.Baseline.rounds", 1)


@pytest.fixture(scope="module")
def piece():
    """A short piece of the sample."""
    from athcodec.sources import read_hdf5, sample_path

    with read_hdf5(sample_path()) as clip:
        return Source(
            MotionClip(
                clip.block(40, 56), clip.time[40:56], clip.vertex_branch, clip.branch_parent, clip.rest, clip.edges
            )
        )


@pytest.fixture(scope="module")
def encodings(piece):
    """What each baseline encoded, and what it decodes to in the same process."""
    return {}


@pytest.mark.parametrize("codec", BASELINES, ids=lambda codec: codec.name)
def test_a_piece_of_the_sample_decodes_within_the_bound(codec, piece, encodings):
    assert codec.missing() is None
    encodings[codec.name] = check(codec, piece, BOUND * piece.diagonal)
    data, _ = encodings[codec.name]
    assert 0 < len(data) < piece.positions.nbytes / 3
    assert set(codec.settings) == set(codec.grid(piece, BOUND * piece.diagonal))


def test_bytes_alone_decode_in_another_process(piece, encodings, tmp_path):
    for index, codec in enumerate(BASELINES):
        if codec.name not in encodings:
            encodings[codec.name] = check(codec, piece, BOUND * piece.diagonal)
        (tmp_path / f"{index}.bin").write_bytes(encodings[codec.name][0])
    script = (
        "import sys, pathlib, numpy\nfrom bench.codecs.baselines import BASELINES\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        "for index, codec in enumerate(BASELINES):\n"
        "    numpy.save(folder / f'{index}.npy', codec.decode((folder / f'{index}.bin').read_bytes()))\n"
    )
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], cwd=ROOT, check=True, timeout=120)
    for index, codec in enumerate(BASELINES):
        decoded = np.load(tmp_path / f"{index}.npy")
        np.testing.assert_allclose(decoded, encodings[codec.name][1], rtol=0, atol=1e-6 * piece.diagonal)


@pytest.mark.parametrize("codec", BASELINES, ids=lambda codec: codec.name)
def test_vertices_numbered_at_random_decode_in_the_order_of_the_source(codec, bushy_clip):
    source = Source(bushy_clip)
    check(codec, source, 1e-3 * source.diagonal)


def test_clips_longer_than_a_segment_are_coded_in_parts(piece):
    some = np.linspace(0, 15, 270)
    start = np.minimum(some.astype(int), 14)
    frames = piece.positions[start] + (some - start)[:, None, None] * (
        piece.positions[start + 1] - piece.positions[start]
    )
    clip = piece.clip
    longer = MotionClip(frames.astype(np.float32), np.arange(270.0), clip.vertex_branch, clip.branch_parent, clip.rest)
    source = Source(longer)
    codec = BASELINES[0]
    settings = {name: axis.values[axis.start] for name, axis in codec.grid(source, 1.0).items()}
    bound = 1e-3 * source.diagonal
    decoded = codec.decode(codec._trial(source, bound, settings))
    assert np.linalg.norm(decoded - source.positions, axis=2).max() <= bound


@pytest.mark.parametrize("codec", [codec for codec in BASELINES if "PCA" in codec.name], ids=lambda codec: codec.name)
def test_settings_found_with_a_part_of_a_large_clip_are_about_as_good(codec, piece, monkeypatch):
    bound = BOUND * piece.diagonal
    whole = len(check(codec, piece, bound)[0])
    monkeypatch.setattr("bench.codecs.baseline.LARGE", 0)
    monkeypatch.setattr("bench.codecs.baseline.SEARCHED", 600)
    assert len(check(codec, Source(piece.clip), bound)[0]) < 1.03 * whole


def test_skeletal_tracks_keep_their_errors_with_the_fewest_bits():
    random, frames = np.random.default_rng(1), 5 * SEGMENT + 3
    numbers = np.cumsum(random.normal(size=(7, frames, 3)), axis=1) * np.geomspace(1e-6, 1, 7)[:, None, None]
    error = np.full(7, 1e-3)
    track = _Track(error, frames)
    decoded = track.write(np.arange(7), numbers)
    assert (np.linalg.norm(decoded - numbers, axis=2).max(axis=1) <= error).all()
    assert (track._rates(slice(None))[0] == 0).all() and track._rates(slice(None)).max() < 14
    again = _Track(error, frames)
    again.set_ranges(*track.ranges())
    for tier in (0, 1):
        bits = track.bits(tier)
        assert again.set_bits(tier, bits, 0) == len(bits)
    assert np.array_equal(again.values(), decoded)


def test_the_first_tier_of_skeletal_tracks_shows_every_other_frame(piece):
    codec = SkeletalTracks()
    bound = BOUND * piece.diagonal
    data = codec.encode(piece, bound)
    [one, both] = [SkeletalTracks(tiers).read(Reader(data))[0] for tiers in (1, 2)]
    assert np.allclose(one[:, :, ::2], both[:, :, ::2])
    assert np.allclose(one[:, :, 1], (one[:, :, 0] + one[:, :, 2]) / 2, atol=0.02 * piece.diagonal)
    assert not np.array_equal(one, both)


def test_athcodec_is_compared_as_a_codec_like_others(piece):
    codec = Athcodec()
    data, _ = check(codec, piece, BOUND * piece.diagonal)
    assert 0 < len(data) < piece.positions.nbytes / 3 and codec.kind == "athcodec"
    assert len(codec.settings["rotations"]) == 4


def test_coefficients_take_about_as_many_bytes_as_in_athcodec():
    random = np.random.default_rng(0)
    rows = (random.laplace(size=(200, 3, 50)) * 40 / np.arange(1, 51)).astype(np.int64)
    entropy = sum(
        -(p * np.log2(p)).sum()
        for axis in rows.reshape(-1, 50).T
        for p in [np.unique(axis, return_counts=True)[1] / len(axis)]
    )
    writer = Writer()
    writer.rows(rows)
    assert len(writer.data()) < 1.15 * entropy * 600 / 8, entropy * 600 / 8


def test_a_search_finds_the_minimum_of_a_convex_cost():
    grid = {"x": Ladder(tuple(range(20)), 3), "name": Choice(("a", "b")), "y": Ladder.geometric(0.1, 10, 1)}
    search = Search(lambda s: (s["x"] - 14) ** 2 + (s["name"] == "a") + np.log(s["y"] / 5) ** 2, grid)
    best = search.run(3)
    assert best["x"] == 14 and best["name"] == "b" and 4 < best["y"] < 6.5
    assert len(search.known) < 40


def test_a_search_ends_with_the_best_so_far_where_processor_time_runs_out(monkeypatch):
    limited = Search(lambda s: abs(s["x"] - 14), {"x": Ladder(tuple(range(20)), 3)})
    monkeypatch.setattr("resource.getrlimit", lambda kind: (1, -1) if len(limited.known) > 3 else (-1, -1))
    monkeypatch.setattr("time.process_time", lambda: 0.9)
    assert limited.run(3)["x"] == 9 and len(limited.known) == 4
