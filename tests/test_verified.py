"""What was encoded holds what it says: `verify --against` its source accepts every fresh file."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from plants import awkward_plants

import athcodec
from athcodec import cli
from athcodec._native import MEASURES
from athcodec.errors import BoundError

FORMATS = ("h5", "npz", "obj", "ply", "pc2", "mdd", "xdmf", "pvd", "glb", "usdc", "abc")
QUICK = ("h5", "npz", "obj", "ply", "pc2", "xdmf")  # read in this process
HOLDS_FLOAT64 = ("h5", "npz", "obj", "ply", "xdmf", "pvd")
SETTINGS = settings(
    deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck), max_examples=6
)
BOUNDS = st.one_of(
    st.tuples(st.just("--rel-error"), st.floats(1e-7, 1e-1).map(repr)),
    st.tuples(st.just("--target-size"), st.sampled_from(["1kB", "3kB", "20kB"])),
)
OPTIONS = st.fixed_dictionaries(
    {"bound": BOUNDS, "--effort": st.just("fast")},
    optional={
        "--loop": st.just("all"),
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
PLACES = st.fixed_dictionaries(
    {
        "scale": st.floats(-30, 8).map(lambda power: 10.0**power),
        "away": st.sampled_from([0.0, 0.0, 1e3, 1e7]),  # From the origin, in sizes of the plant.
        "held": st.sampled_from([1, 1, 3]),  # Frames that show each pose.
    }
)
REFUSALS = ("expected at least",)
"""For which a clip is not encoded."""
READING = ("--unit", "--up-axis")


def words_of(options: dict) -> list[str]:
    options = dict(options)
    pairs = [options.pop("bound", (None, None)), *options.items()]
    return [word for pair in pairs for word in pair if word is not None]


def holds(folder, suffix: str, clip, place: dict, wide: bool, options: dict, capsys) -> None:
    dtype = np.float64 if wide and suffix in HOLDS_FLOAT64 else np.float32
    positions = clip.positions.astype(np.float64)
    positions = (positions + place["away"] * np.ptp(positions, axis=(0, 1)).max()) * place["scale"]
    assume(np.abs(positions).max() < 1e18)
    positions = np.repeat(positions, place["held"], axis=0).astype(dtype)
    made = athcodec.MotionClip(positions, np.arange(len(positions)) / 30, clip.vertex_branch, clip.branch_parent)
    for old in folder.iterdir():
        old.unlink()
    how = {"animation": "morphs"} if suffix == "glb" else {}
    source = athcodec.write(made, folder / f"a.{suffix}", **how).files[0]
    encoded = str(folder / "a.ath")
    code = cli.main(["encode", str(source), encoded, "--still", *words_of(options)])
    err = capsys.readouterr().err
    if code:
        assert any(reason in err for reason in REFUSALS), err
        return
    reading = words_of({name: value for name, value in options.items() if name in READING})
    code = cli.main(["verify", encoded, "--against", str(source), *reading])
    assert code == 0, capsys.readouterr().err
    capsys.readouterr()


@SETTINGS
@given(suffix=st.sampled_from(QUICK), clip=awkward_plants(), place=PLACES, wide=st.booleans(), options=OPTIONS)
def test_a_fresh_file_is_as_close_to_its_source_as_it_says(suffix, clip, place, wide, options, capsys, tmp_path):
    holds(tmp_path, suffix, clip, place, wide, options, capsys)


@pytest.mark.slow
@settings(SETTINGS, max_examples=400)
@given(suffix=st.sampled_from(FORMATS), clip=awkward_plants(), place=PLACES, wide=st.booleans(), options=OPTIONS)
def test_so_is_every_other_of_any_format(suffix, clip, place, wide, options, capsys, tmp_path):
    holds(tmp_path, suffix, clip, place, wide, options, capsys)


# ---- the error table ----


def small_clip(seed: int):
    """A clip of up to 40 vertices that stands still, moves as a whole, bends, or is a tube; and options of `encode`."""
    rng = np.random.default_rng(seed)
    vertices, frames, kind = int(rng.integers(1, 41)), int(rng.choice([1, 5, 12, 40])), rng.integers(5)
    rest = np.cumsum(rng.normal(size=(vertices, 3)), axis=0)
    if kind == 4:
        around = np.arange(8 * (vertices // 8 + 2))
        rest = np.stack([np.cos(around * np.pi / 4), np.sin(around * np.pi / 4), around // 8], axis=1)
    rest, time = rest * 10 ** rng.uniform(-3, 3), np.arange(frames)[:, None, None]
    amount = np.abs(rest).max() * [0.0, 0.3, 0.1, 0.3, 0.2][kind]
    phases = rng.normal(size=(1, 1 if kind == 1 else len(rest), 3))
    positions = rest + amount * np.sin(time / 5 + phases) + np.abs(rest).max() * rng.normal(size=3) * rng.integers(0, 2)
    if rng.integers(3) == 0:  # on twos
        positions = np.repeat(positions[::2], 2, axis=0)[:frames]
    dtype = rng.choice([np.float32, np.float64])
    branch = np.minimum(np.arange(len(rest)) // 9, 2)
    clip = athcodec.MotionClip(
        positions.astype(dtype), np.arange(frames) / 30, branch, np.arange(-1, branch.max(), dtype=np.int32)
    )
    options = {"exact_rest": True, "lossless": True, "ladder": "none", "segment_frames": 16, "effort": "fast"}
    chosen = {name: value for name, value in options.items() if rng.integers(2) == 0}
    return clip, {"rel_error": 10 ** rng.uniform(-5, -1)} | chosen


def understated(path, clip) -> list[str]:
    """The errors of a level and segment that the file states to be smaller than they are."""
    found = []
    with athcodec.open(path, strict=True) as decoder:
        for level in range(decoder.file.level_count):
            away = np.linalg.norm(decoder.positions(level=level).astype(np.float64) - clip.positions, axis=2)
            for segment, (start, stop) in enumerate(decoder.segments):
                errors = np.sort(away[start:stop], axis=None)
                measured = errors[-1], errors[len(errors) - len(errors) // 100 - 1], np.sqrt(np.mean(errors**2))
                stated = decoder.file.errors[level, segment]
                found += [
                    f"level {level}, segment {segment}, {name}: got {error}, stated {most}"
                    for name, error, most in zip(MEASURES, measured, stated, strict=True)
                    if error > most * (1 + 1e-12)  # sums of squares in another order
                ]
            pooled = np.sqrt(np.mean(away**2))
            if pooled > decoder.levels[level].rms_error * (1 + 1e-12):
                found.append(f"level {level}: got an RMS error of {pooled}, stated {decoder.levels[level].rms_error}")
    return found


@pytest.mark.parametrize("seeds", [range(16), pytest.param(range(16, 800), marks=pytest.mark.slow)])
def test_no_error_of_the_table_is_below_the_truth(seeds, tmp_path):
    found = []
    for seed in seeds:
        clip, options = small_clip(seed)
        try:
            athcodec.encode(clip, tmp_path / "a.ath", **options)
        except BoundError:
            continue
        athcodec.truncate(tmp_path / "a.ath", tmp_path / "cut.ath", 0)
        found += [f"{seed}: {one}" for name in ("a.ath", "cut.ath") for one in understated(tmp_path / name, clip)]
    assert found == []


def test_verify_accepts_still_clips_of_float64_with_an_exact_rest_pose(tmp_path, capsys):
    """Their errors are the last bits of numbers from which an origin was taken."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        pose = rng.normal(size=(1, 40, 3)) * 10 ** rng.uniform(-3, 3)
        frames = np.repeat(pose, 12, axis=0)
        clip = athcodec.MotionClip(frames, np.arange(12) / 30, np.zeros(40, int), [-1])
        source = athcodec.write(clip, tmp_path / "still.npz").files[0]
        encoded = str(tmp_path / "still.ath")
        assert cli.main(["encode", str(source), encoded, "--rel-error", "1e-3", "--exact-rest"]) == 0
        assert cli.main(["verify", encoded, "--against", str(source)]) == 0, capsys.readouterr().err


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("options", [{"rest_error": 1e-2}, {"exact_rest": True}])
def test_a_single_point_is_as_close_as_its_file_says(tmp_path, options, dtype):
    clip = athcodec.MotionClip(np.full((1, 1, 3), 1e-7, dtype), [0.0], [0], [-1])
    athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-2, effort="fast", **options)
    assert understated(tmp_path / "a.ath", clip) == []


def test_a_held_pose_counts_in_the_mean_error_for_as_long_as_it_is_shown(tmp_path):
    frames = np.random.default_rng(2).normal(size=(3, 30, 3)).astype(np.float32)
    held = np.concatenate([frames[:2], np.repeat(frames[2:], 40, axis=0)])
    clip = athcodec.MotionClip(held, np.arange(42) / 30, np.zeros(30, int), [-1])
    athcodec.encode(clip, tmp_path / "held.ath", rel_error=1e-2, segment_frames=16)
    assert understated(tmp_path / "held.ath", clip) == []


def turning_plant(seed: int, frames: int = 69):
    """A few stems that turn as a whole, far from the origin."""
    rng, time = np.random.default_rng(seed), np.arange(frames) / 30
    rest, angle = np.cumsum(rng.normal(size=(24, 3)), axis=0), 0.5 * np.sin(2 * time)
    turned = rest[None].repeat(frames, axis=0)
    turned[..., 0] = np.outer(np.cos(angle), rest[:, 0]) - np.outer(np.sin(angle), rest[:, 1])
    turned[..., 1] = np.outer(np.sin(angle), rest[:, 0]) + np.outer(np.cos(angle), rest[:, 1])
    positions = (turned + 1e4 * rng.normal(size=3) + time[:, None, None]).astype(np.float32)
    return athcodec.MotionClip(positions, time, np.arange(24) // 8, [-1, 0, 1])


def test_joined_maps_are_no_further_off_than_the_table_says(tmp_path):
    """Their positions are rounded behind the join, and not before and behind it."""
    for seed in range(12):
        clip = turning_plant(seed)
        bound = 40 * float(np.spacing(np.abs(clip.positions).max()))
        athcodec.encode(clip, tmp_path / "a.ath", max_error=bound, segment_frames=24, ladder="none", effort="fast")
        assert understated(tmp_path / "a.ath", clip) == [], seed
