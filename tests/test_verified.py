"""What was encoded holds what it says: `verify --against` its source accepts every fresh file."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from plants import awkward_plants

import athcodec
from athcodec import cli

FORMATS = ("h5", "npz", "obj", "ply", "pc2", "mdd", "xdmf", "pvd", "glb", "usdc", "abc")
QUICK = ("h5", "npz", "obj", "ply", "pc2", "xdmf")  # read in this process
HOLDS_FLOAT64 = ("h5", "npz", "obj", "ply", "xdmf", "pvd")
SETTINGS = settings(
    deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck), max_examples=6
)
OPTIONS = st.fixed_dictionaries(
    {"--rel-error": st.floats(1e-7, 1e-1).map(repr), "--effort": st.just("fast")},
    optional={
        "--ladder": st.sampled_from(["none", "1e-1,1e-2"]),
        "--rest": st.sampled_from(["first", "mean"]),
        "--segment-frames": st.sampled_from(["16", "20"]),
        "--lossless": st.none(),
        "--exact-rest": st.none(),
        "--rest-error": st.sampled_from(["1e-2", "bound"]),
        "--unit": st.just("mm"),
        "--up-axis": st.sampled_from("xz"),
    },
)
POWERS = st.floats(-30, 8)  # of ten, by which all is scaled
REFUSALS = ("twice the spacing", "expected more than", "expected at least")
"""For which a clip is not encoded."""
READING = ("--unit", "--up-axis")


def words_of(options: dict) -> list[str]:
    return [word for name, value in options.items() for word in (name, value) if word is not None]


def holds(folder, suffix: str, clip, scale: float, wide: bool, options: dict, capsys) -> None:
    dtype = np.float64 if wide and suffix in HOLDS_FLOAT64 else np.float32
    positions = (clip.positions.astype(np.float64) * scale).astype(dtype)
    made = athcodec.MotionClip(positions, clip.time, clip.vertex_branch, clip.branch_parent)
    for old in folder.iterdir():
        old.unlink()
    how = {"animation": "morphs"} if suffix == "glb" else {}
    source = athcodec.write(made, folder / f"a.{suffix}", **how).files[0]
    encoded = str(folder / "a.ath")
    code = cli.main(["encode", str(source), encoded, *words_of(options)])
    err = capsys.readouterr().err
    if code:
        assert any(reason in err for reason in REFUSALS), err
        return
    reading = words_of({name: value for name, value in options.items() if name in READING})
    code = cli.main(["verify", encoded, "--against", str(source), *reading])
    assert code == 0, capsys.readouterr().err
    capsys.readouterr()


@SETTINGS
@given(suffix=st.sampled_from(QUICK), clip=awkward_plants(), power=POWERS, wide=st.booleans(), options=OPTIONS)
def test_a_fresh_file_is_as_close_to_its_source_as_it_says(suffix, clip, power, wide, options, capsys, tmp_path):
    holds(tmp_path, suffix, clip, 10.0**power, wide, options, capsys)


@pytest.mark.slow
@settings(SETTINGS, max_examples=400)
@given(suffix=st.sampled_from(FORMATS), clip=awkward_plants(), power=POWERS, wide=st.booleans(), options=OPTIONS)
def test_so_is_every_other_of_any_format(suffix, clip, power, wide, options, capsys, tmp_path):
    holds(tmp_path, suffix, clip, 10.0**power, wide, options, capsys)


def test_errors_of_tiny_and_huge_motions_are_measured_by_their_true_size():
    """Squares of them are no numbers any more."""
    from athcodec.metrics import ErrorMeter

    for scale in (1e-200, 1e-162, 1.0, 1e160):
        meter = ErrorMeter()
        meter.add(np.zeros((1, 2, 3)), np.array([[[3 * scale, 0, 4 * scale], [0, 0, 0]]]))
        assert np.isclose(meter.max_error, 5 * scale, rtol=1e-12, atol=0)
