"""The vectors catch mistakes: `python -m spec.mutants` makes changes of the code of FORMAT.md and looks which vectors
tell. Here a few of them, the reasons of those that cannot be caught, and the vectors of real size."""

from __future__ import annotations

import re

import pytest

from spec import conformance, document, mutants, real_size

pytestmark = pytest.mark.tools

CAUGHT = {  # a change, and a vector that tells it
    "quarters_of_mean: 64 if quarters >= 64.0 else int(quarters) if quarters >= 1.0 else 1 -> "
    "65 if quarters >= 64.0 else int(quarters) if quarters >= 1.0 else 1": "gaps",
    "tridiagonalise: continue -> pass": "rigid-diagonal",
    "append_orthonormal: if after > before * keep -> if True": "sheet-mode-below",
    "attach_frame: if not squared(tangent) > 1e-200 -> if not squared(tangent) > 1.0625e-200": "tangent-short-above",
    "RangeDecoder.narrow: if self.range < 1 << 32 -> if self.range < 1 << 31": "smallest",
}


@pytest.fixture(scope="module")
def changes():
    return mutants.Changes()


@pytest.mark.parametrize("name", CAUGHT)
def test_a_vector_tells_a_changed_decoder_from_the_true_one(name, changes):
    mutant = next(mutant for mutant in changes.mutants if mutant.name == name)
    vector = next(vector for vector in conformance.vectors() if vector.path.stem == CAUGHT[name])
    known, decoder = mutants.Known(vector, vector.path.read_bytes()), mutants.Decoder(changes.tree)
    try:
        caught = not known.is_as_expected(decoder.changed(mutant))
    except Exception:
        caught = True
    assert caught and known.is_as_expected(document.run(decoder.parts)), "the change has been taken back"


def test_every_reason_is_of_a_change_that_there_is(changes):
    names = [mutant.name for mutant in changes.mutants]
    assert len(set(names)) == len(names)
    for reason in mutants.reasons():
        assert len(reason.why) > 20
        assert all(any(re.fullmatch(pattern, name) for name in names) for pattern in reason.like)


def test_changes_without_a_reason_and_reasons_without_need_are_faults():
    fates = {"a": mutants.MISSED, "b": mutants.MISSED, "c": "result of valid/x.ath", "e1": mutants.MISSED}
    known = [mutants.Reason("cannot be", ["a", "c"]), mutants.Reason("never", [r"e\d", "f."])]
    assert mutants.faults(fates, known) == [
        "not caught: b",
        "no change that is not caught is like: c",
        "no change that is not caught is like: f.",
    ]


def test_vectors_of_real_size_use_the_features_of_the_format_together():
    """All kinds of chunks, in the one file those that athcodec puts together."""
    uses = {
        name: real_size.features((conformance.FOLDER / f"valid/real-size-{name}.ath").read_bytes())
        for name in real_size.OPTIONS
    }
    assert set().union(*uses.values()) >= real_size.FEATURES
    assert set().union(*uses.values()) >= set(document.KINDS)
    others = {"joins", "sloped joins", "loose branches", "exact rest pose", "predicted motion"}
    assert real_size.FEATURES - uses["all"] <= others
    assert 50_000 < (conformance.FOLDER / "valid/real-size-all.ath").stat().st_size < 160_000
