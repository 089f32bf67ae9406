"""Weights: a vertex may be as far off as its own factor on the bound says, and no further."""

from __future__ import annotations

import json

import numpy as np
import pytest
from files import coded
from plants import plant

import athcodec
from athcodec.cli import main
from athcodec.errors import BoundError, ClipError


def largest_errors(clip, decoder) -> np.ndarray:
    """(N,) of each vertex over all frames."""
    apart = decoder.positions(dtype=np.float64) - clip.block(0, clip.frame_count)
    return np.linalg.norm(apart, axis=2).max(axis=0)


@pytest.fixture
def twiggy():
    """A plant with a weight of 4 on all but its first branch, 0.5 on some vertices of that."""
    clip = plant(7, branches=30, longest=12, frames=40)
    weights = np.where(clip.vertex_branch > 0, 4.0, 1.0).astype(np.float32)
    weights[:3] = 0.5
    clip.attributes["slack"] = weights
    return clip


@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_every_vertex_keeps_its_own_bound(twiggy, tmp_path, effort):
    weights = twiggy.attributes["slack"]
    with coded(twiggy, tmp_path / "a.ath", max_error=0.02, weights="slack", effort=effort) as decoder:
        errors = largest_errors(twiggy, decoder)
        assert (errors <= 0.02 * weights).all()
        assert errors.max() > 0.02, "nothing was coarser where it might be"
        assert decoder.file.max_error_bound == pytest.approx(0.08)
        assert np.array_equal(decoder.file.error_weights, weights)


def test_coarser_vertices_make_a_smaller_file(twiggy, tmp_path):
    plain = athcodec.encode(twiggy, tmp_path / "a.ath", max_error=0.02, effort="fast")
    weighted = athcodec.encode(twiggy, tmp_path / "b.ath", max_error=0.02, weights="slack", effort="fast")
    assert weighted.bytes < 0.9 * plain.bytes


def test_weights_may_be_an_array_and_are_kept(twiggy, tmp_path):
    weights = twiggy.attributes.pop("slack")
    with coded(twiggy, tmp_path / "a.ath", max_error=0.02, weights=weights) as decoder:
        assert np.array_equal(decoder.file.error_weights, weights)
    assert "error_weights" not in twiggy.attributes


def test_verify_checks_vertex_by_vertex(twiggy, tmp_path, capsys):
    source, coded = str(tmp_path / "a.h5"), str(tmp_path / "a.ath")
    athcodec.write_hdf5(twiggy, source)
    assert main(["encode", source, coded, "--max-error", "0.02", "--weights", "slack"]) == 0
    assert main(["verify", coded, "--against", source]) == 0
    capsys.readouterr()
    moved = np.array(twiggy.positions)
    moved[5, 0, 0] += 0.03  # within what the file promises for all, beyond what it promises for vertex 0
    twiggy.positions = moved
    athcodec.write_hdf5(twiggy, source)
    assert main(["verify", coded, "--against", source, "--json"]) == 1
    assert not json.loads(capsys.readouterr().out)["clips"][0]["levels"][-1]["kept"]


@pytest.mark.parametrize(
    "weights, message",
    [
        ("nothing", "weights: got 'nothing', expected one of slack"),
        (np.ones(3), "weights: got float64 of shape"),
        ("zero", "weights: vertex 4 has 0 in 'zero', expected a number above 0"),
        ("nan", "weights: vertex 4 has nan"),
    ],
)
def test_unusable_weights_are_refused(twiggy, tmp_path, weights, message):
    for name, value in (("zero", 0.0), ("nan", np.nan)):
        if isinstance(weights, str) and weights == name:
            twiggy.attributes[name] = np.ones(twiggy.vertex_count)
            twiggy.attributes[name][4] = value
    with pytest.raises(ClipError, match=message.replace("(", r"\(")):
        athcodec.encode(twiggy, tmp_path / "a.ath", weights=weights)
    assert not list(tmp_path.iterdir())


def test_a_weight_below_what_the_source_can_say_is_refused(twiggy, tmp_path):
    with pytest.raises(BoundError):
        athcodec.encode(twiggy, tmp_path / "a.ath", max_error=0.02, weights=np.full(twiggy.vertex_count, 1e-7))
