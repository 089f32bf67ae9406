"""The vectors catch mistakes: `python -m spec.mutants` makes changes of the reference decoder and looks which vectors
tell. Here a few of them, the reasons of those that cannot be caught, and the vectors of real size."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent.parent))  # for spec, which is not installed

from spec import conformance, mutants, real_size  # noqa: E402

pytestmark = pytest.mark.tools

CAUGHT = {  # a change, and a vector that tells it
    "quarters_of_mean: 64 if q >= 64.0 else int(q) if q >= 1.0 else 1 -> "
    "65 if q >= 64.0 else int(q) if q >= 1.0 else 1": "gaps",
    "tridiagonalise: continue -> pass": "rigid-diagonal",
    "append_orthonormal: if after > before * keep -> if True": "sheet-mode-below",
    "Pose.attach_frame: if not length2 > 1e-200 -> if not length2 > 1.0625e-200": "tangent-short-above",
    "Pose.attach_frame: if not length2 > 1e-200 -> if not length2 > 9.375e-201": "tangent-short-below",
    "decode_branches: divide_to_zero(min(more, 1 << 16) * 16 - mean_count[c], 4) -> "
    "divide_to_zero(more * 16 - mean_count[c], 4)": "host-mesh-tall",
}


@pytest.fixture(scope="module")
def changes():
    return mutants.Changes(mutants.DECODER.read_text("utf-8"))


@pytest.fixture(scope="module")
def decoder(changes):
    return mutants.Decoder(changes.tree)


@pytest.fixture
def vector(decoder):
    """A vector and what it decodes to."""

    def known(name: str) -> mutants.Known:
        one = next(vector for vector in conformance.vectors() if vector.path.stem == name)
        found, opened = mutants.Known(one.name, one.path.read_bytes(), one.mesh), {}
        found.expected = {item: mutants.answer(decoder.usual, found, item, opened) for item in one.results}
        return found

    return known


@pytest.mark.parametrize("name", CAUGHT)
def test_a_vector_tells_a_changed_decoder_from_the_true_one(name, changes, decoder, vector):
    mutant = next(mutant for mutant in changes.mutants if mutant.name == name)
    known = vector(CAUGHT[name])
    with np.errstate(all="ignore"):
        assert mutants.is_as_expected(decoder.usual, known)
        with decoder.changed(mutant) as module:
            try:
                caught = not mutants.is_as_expected(module, known)
            except Exception:
                caught = True
        assert caught and mutants.is_as_expected(decoder.usual, known), "the change has been taken back"


def test_every_reason_is_of_a_change_that_there_is(changes):
    names = [mutant.name for mutant in changes.mutants]
    assert len(set(names)) == len(names)
    for reason in mutants.reasons():
        assert set(reason.mutants) <= set(names) and len(reason.why) > 20
        assert all(any(re.fullmatch(pattern, name) for name in names) for pattern in reason.like)


def test_changes_without_a_reason_and_reasons_without_need_are_faults():
    fates = {"a": mutants.MISSED, "b": mutants.MISSED, "c": "result of valid/x.ath", "e1": mutants.MISSED}
    known = [mutants.Reason("cannot be", ["a", "c", "d"]), mutants.Reason("never", like=[r"e\d", "f."])]
    found = mutants.faults(fates, known)
    assert [line.split(":")[0] for line in found] == [
        "not caught",
        "caught, result of valid/x.ath",
        "no such change",
        "no change that is not caught is like",
    ]
    assert "not caught: b" in found


def test_vectors_of_real_size_use_the_features_of_the_format_together():
    """All kinds of chunks, in the one file those that athcodec puts together."""
    uses = {
        name: real_size.features((conformance.FOLDER / f"valid/real-size-{name}.ath").read_bytes())
        for name in real_size.OPTIONS
    }
    assert set().union(*uses.values()) >= real_size.FEATURES
    assert set().union(*uses.values()) >= set(real_size.rd.KINDS.values())
    assert real_size.FEATURES - uses["all"] <= {
        "joins",
        "sloped joins",
        "loose branches",
        "exact rest pose",
        "predicted motion",
    }
    assert 50_000 < (conformance.FOLDER / "valid/real-size-all.ath").stat().st_size < 160_000
