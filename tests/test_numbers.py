"""Every number of the API may be a NumPy scalar, an array without dimensions, or what else `float` and `index` take."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import athcodec
from athcodec import metrics
from athcodec.decoding.container import Limits
from athcodec.errors import ClipError
from athcodec.exporters import WriteOptions
from athcodec.motion.clip import ClipRange
from athcodec.motion.units import Length
from athcodec.sources import ReadOptions


class Scalar:
    """A number that only `float` understands, like a tensor of another library."""

    def __init__(self, value: float):
        self._value = value

    def __float__(self) -> float:
        return self._value


class Index:
    """A whole number that only `operator.index` understands."""

    def __init__(self, value: int):
        self._value = value

    def __index__(self) -> int:
        return self._value


FLOATS = (np.float16, np.float32, np.float64, np.longdouble)
INTEGERS = (np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64)
REALS = (np.float32, lambda value: np.array(value, np.longdouble), Scalar)
WHOLES = (np.uint8, lambda value: np.array(value, np.int64), Index)
FRAMES, VERTICES = 300, 16
VERTEX_BRANCH, BRANCH_PARENT = np.repeat([0, 1], VERTICES // 2), [-1, 0]


def motion(frames: int) -> np.ndarray:
    positions = np.zeros((frames, VERTICES, 3), np.float32)
    positions[..., 1] = np.tile(np.linspace(0, 2, VERTICES // 2), 2)
    positions[:, VERTICES // 2 :, 0] = np.linspace(0, 1, VERTICES // 2)
    positions[..., 2] = 0.2 * np.sin(np.arange(frames) / 10)[:, None] * positions[..., 1] ** 2
    return positions


def encoded(**options: Any) -> bytes:
    """The bytes of a short clip with these options."""
    options = {"effort": "fast", "ladder": "none"} | options
    return athcodec.encode(motion(20), vertex_branch=VERTEX_BRANCH, branch_parent=BRANCH_PARENT, **options)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A clip, and a file of two clips in winds."""
    branches = {"vertex_branch": VERTEX_BRANCH, "branch_parent": BRANCH_PARENT}
    clip = athcodec.MotionClip(motion(FRAMES), np.arange(FRAMES) / 30, **branches, metadata={"unit": "m"})
    clips = {"calm": athcodec.in_wind(clip, 1.0), "gale": athcodec.in_wind(clip, 9.0, 90.0)}
    path = tmp_path_factory.mktemp("numbers") / "whole.ath"
    athcodec.encode(athcodec.join(clips), path, effort="fast", max_error=0.01)
    with athcodec.open(path) as decoder:
        yield SimpleNamespace(clip=clip, path=path, decoder=decoder, file=decoder.file)


def truncated(made, **options: Any) -> bytes:
    target = made.path.with_name("part.ath")
    athcodec.truncate(made.path, target, **options)
    return target.read_bytes()


def measured(made, **options: Any) -> dict[str, Any]:
    meter, frames = metrics.MotionMeter(made.clip, **options), made.clip.block(0, FRAMES)
    meter.add(frames, frames + 0.01)
    return meter.figures()


def quantile(fraction: Any) -> float:
    values = metrics.Spread()
    values.add(np.linspace(0, 1, 100))
    return values.quantile(fraction)


def ath(made, number: Any) -> list[Any]:
    """Everything that an ATH takes a level or a node for."""
    hierarchy, clip = athcodec.build_ath(made.clip, max_error=0.01), made.clip
    of_clip = (hierarchy.affine, hierarchy.residual, hierarchy.attachment_gaps)
    return [hierarchy.cut(number), hierarchy.approximation(motion(2), number), *(of(clip, number) for of in of_clip)]


# Calls that take a real number, each with a value that no binary type holds exactly.
TAKE_REALS: dict[str, tuple[float, Callable[[Any, Any], Any]]] = {
    "encode: max_error": (0.013, lambda x, _: encoded(max_error=x)),
    "encode: rel_error": (0.0013, lambda x, _: encoded(rel_error=x)),
    "encode: target_size": (1234.0, lambda x, _: encoded(target_size=x)),
    "encode: rest_error": (0.013, lambda x, _: encoded(rest_error=x)),
    "encode: rest_error as a length": (3.7, lambda x, _: encoded(rest_error=Length(x, "mm"), unit="m")),
    "encode: ladder": (0.13, lambda x, _: encoded(ladder=[x, 0.0101])),
    "encode: fps": (23.97, lambda x, _: encoded(fps=x)),
    "encode: tam": (0.013, lambda x, _: encoded(tam=athcodec.Thresholds(x, 1, x, 0))),
    "encode: lossless": (0.013, lambda x, _: encoded(lossless=True, max_error=x)),
    "Thresholds": (0.013, lambda x, _: athcodec.Thresholds(x, 1, x, 0)),
    "build_ath: epsilon, xi": (0.013, lambda x, made: athcodec.build_ath(made.clip, x, 1, x).table1()),
    "build_ath: max_error": (0.013, lambda x, made: athcodec.build_ath(made.clip, max_error=x).table1()),
    "MotionClip: metadata": (23.97, lambda x, _: still(fps=x).fps),
    "MotionClip: metadata inside": (0.7, lambda x, _: still(deep=[{"x": (x, 1)}]).metadata["deep"][0]["x"][0]),
    "in_wind": (0.7, lambda x, made: athcodec.in_wind(made.clip, x, x).metadata),
    "read": (23.97, lambda x, _: ReadOptions(fps=x)),
    "truncate: max_error": (0.113, lambda x, made: truncated(made, max_error=x)),
    "truncate: target_size": (2345.0, lambda x, made: truncated(made, target_size=x)),
    "Decoder.level_for": (7.3, lambda x, made: made.decoder.level_for(x, x, x, x)),
    "Decoder.level_within": (0.113, lambda x, made: made.decoder.level_within(x)),
    "Decoder.at": (3.13, lambda x, made: made.decoder.at(x)),
    "Decoder.at several": (3.13, lambda x, made: made.decoder.at([x, 0.0])),
    "Decoder.wind_weights": (3.13, lambda x, made: made.decoder.wind_weights(x, x)),
    "Decoder.blended": (0.73, lambda x, made: made.decoder.blended({"calm": x, "gale": 1}, x)),
    "Decoder.blended: each": (
        0.73,
        lambda x, made: made.decoder.blended({"calm": x, "gale": x}, {"calm": x, "gale": x}),
    ),
    "Decoder.blended_places": (0.73, lambda x, made: made.decoder.blended_places([(x, x), (1.0, 1.0)])),
    "MotionMeter": (0.013, lambda x, made: measured(made, bound=x, file_bound=x)),
    "SmoothnessMeter.jerks": (0.013, lambda x, _: metrics.SmoothnessMeter(9, x).jerks(x)),
    "Spread.quantile": (0.73, lambda x, _: quantile(x)),
}
TAKE_WHOLES: dict[str, tuple[int, Callable[[Any, Any], Any]]] = {
    "encode: target_size": (250, lambda n, _: encoded(target_size=n)),
    "encode: segment_frames": (17, lambda n, _: encoded(segment_frames=n)),
    "encode: jobs": (2, lambda n, _: encoded(jobs=n)),
    "encode: fps": (24, lambda n, _: encoded(fps=n)),
    "Thresholds": (3, lambda n, _: athcodec.Thresholds(n, n, n, n)),
    "build_ath": (3, lambda n, made: athcodec.build_ath(made.clip, 0.1, n, 0.1, n, max_depth=n).table1()),
    "Ath": (0, lambda n, made: ath(made, n)),
    "looped": (13, lambda n, made: athcodec.looped(made.clip, n).metadata),
    "find_branches": (3, lambda n, made: athcodec.find_branches(made.clip, "runs", n)),
    "ClipRange": (20, lambda n, _: ClipRange("calm", n)),
    "MotionClip: metadata": (7, lambda n, _: still(start_frame=n).metadata["start_frame"]),
    "MotionClip.block": (250, lambda n, made: [made.clip.block(n, FRAMES), made.clip.block(0, n)]),
    "MotionClip.blocks": (100, lambda n, made: list(made.clip.blocks(n))),
    "read": (100, lambda n, _: ReadOptions(max_memory=n)),
    "write": (100, lambda n, _: WriteOptions(rig=n)),
    "open: limits": (100, lambda n, _: Limits(frames=n)),
    "truncate: level": (1, lambda n, made: truncated(made, level=n)),
    "AthFile": (
        1,
        lambda n, made: [made.file.rest_at(n), made.file.static.level_rest(n), made.file.tables.nodes_at(n)],
    ),
    "AthFile.available": (1, lambda n, made: [made.file.available(n), made.file.segments.prepare(n, n) is None]),
    "Decoder.at_level": (1, lambda n, made: [made.decoder.at_level(n)[3], made.decoder.at_level(n).level]),
    "Decoder: level": (1, lambda n, made: [made.decoder.positions(3, n), list(made.decoder.blocks(n))]),
    "Decoder: level of a blend": (1, lambda n, made: made.decoder.blended({"calm": 1.0}, 1.0, {"calm": n})),
    "Decoder: level of maps": (1, lambda n, made: [made.decoder.affines(3, n), made.decoder.residual(3, n)]),
    "Decoder: frame": (120, lambda n, made: [made.decoder[n], made.decoder[1:n], made.decoder[[n, 1]]]),
    "Decoder: frame of maps": (120, lambda n, made: [made.decoder.affines(n), made.decoder.residual(n)]),
    "Decoder.blocks": (120, lambda n, made: list(made.decoder.blocks(frames=n))),
    "ClipView": (1, lambda n, made: athcodec.ClipView(made.decoder, n).positions[n:3]),
    "ClipView.block": (250, lambda n, made: athcodec.ClipView(made.decoder, all_clips=True).block(n, FRAMES + 9)),
    "ClipView.affines": (250, lambda n, made: athcodec.ClipView(made.decoder, all_clips=True).affines(n)),
    "SmoothnessMeter": (100, lambda n, _: metrics.SmoothnessMeter(n, starts=[0, n]).seams),
    "bits_per_vertex_frame": (100, lambda n, _: metrics.bits_per_vertex_frame(n, n, n)),
}


def still(**metadata: Any) -> athcodec.MotionClip:
    return athcodec.MotionClip(motion(1), [0.0], metadata=metadata)


def exact(value: Any) -> Any:
    """The value by its types and bits."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.shape, value.tobytes()
    if isinstance(value, (list, tuple)):
        return type(value), [exact(item) for item in value]
    if dataclasses.is_dataclass(value):
        return type(value), [exact(getattr(value, field.name)) for field in dataclasses.fields(value)]
    return repr(value)


@pytest.mark.parametrize("call", TAKE_REALS)
def test_a_real_number_of_another_type_means_its_float(call, made):
    value, run = TAKE_REALS[call]
    expected = {}
    for kind in REALS:
        number = kind(value)
        if float(number) not in expected:
            expected[float(number)] = exact(run(float(number), made))
        assert exact(run(number, made)) == expected[float(number)]


@pytest.mark.parametrize("call", TAKE_WHOLES)
def test_a_whole_number_of_another_type_means_its_int(call, made):
    value, run = TAKE_WHOLES[call]
    expected = exact(run(value, made))
    for kind in WHOLES:
        assert exact(run(kind(value), made)) == expected


def test_a_bound_of_every_real_type_of_numpy_gives_the_bytes_of_its_float():
    numbers = [kind(3) for kind in INTEGERS] + [kind(0.37) for kind in FLOATS] + [Fraction(1, 3)]
    expected = {number: encoded(max_error=number) for number in {float(number) for number in numbers}}
    for number in numbers:
        assert encoded(max_error=number) == expected[float(number)]


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.longdouble, np.uint8])
def test_weights_of_every_real_type_are_those_of_their_floats(kind):
    weights = np.linspace(1, 3, VERTICES).astype(kind)
    with athcodec.open(encoded(weights=weights)) as decoder, athcodec.open(encoded(weights=list(weights))) as other:
        for file in (decoder.file, other.file):
            assert exact(file.error_weights) == exact(weights.astype(np.float64))


def test_frames_of_integers_that_numpy_has_no_common_type_for_are_frames(made):
    assert (made.decoder[[np.uint64(7), -1]] == made.decoder[[7, FRAMES - 1]]).all()


@pytest.mark.parametrize("value", [b"0.1", np.array(["0.1"]), 1j, np.complex64(1), True, np.bool_(1), np.array([0.1])])
def test_what_is_no_number_is_refused_by_name(value):
    with pytest.raises(TypeError, match="max_error: got .*expected a number"):
        encoded(max_error=value)
    with pytest.raises(ClipError, match="fps: got .*expected a positive number"):
        encoded(fps=value)
