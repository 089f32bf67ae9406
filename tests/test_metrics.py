"""The error figures against their definitions."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from athcodec.metrics import ErrorMeter, blocks


@given(st.integers(0, 2**32), st.integers(1, 12), st.integers(1, 9), st.integers(1, 12), st.integers(3, 60))
def test_streamed_figures_equal_their_definitions(seed, frames, vertices, block, slice_values):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(frames, vertices, 3)) + 50
    y = x + rng.normal(size=x.shape) * 1e-3
    rest = x[0] + 1
    whole, blocks.SLICE_VALUES = blocks.SLICE_VALUES, slice_values
    try:
        meter = ErrorMeter(rest)
        for start in range(0, frames, block):
            meter.add(x[start : start + block], y[start : start + block])
    finally:
        blocks.SLICE_VALUES = whole
    distance = np.linalg.norm(x - y, axis=2)
    assert meter.max_error == pytest.approx(distance.max())
    assert (meter.worst_frame, meter.worst_vertex) == np.unravel_index(distance.argmax(), distance.shape)
    assert meter.rms_error == pytest.approx(np.sqrt((distance**2).mean()))
    spread = np.linalg.norm(x - x.mean(axis=1, keepdims=True))
    expected = 100 * np.linalg.norm(x - y) / spread if vertices > 1 else inf
    assert meter.kg_error == pytest.approx(expected)
    motion = np.sqrt((np.linalg.norm(x - rest, axis=2) ** 2).mean())
    assert meter.motion_normalised_error == pytest.approx(meter.rms_error / motion)
    assert meter.diagonal == pytest.approx(np.linalg.norm(np.ptp(x.reshape(-1, 3), axis=0)))


def test_float32_blocks_far_from_the_origin_are_measured_in_float64():
    x = np.full((4, 100, 3), 1e6, np.float32)
    x[:, 1:] += 1000
    meter = ErrorMeter()
    meter.add(x, x.astype(np.float64) + 1e-4)
    assert meter.rms_error == pytest.approx(np.sqrt(3) * 1e-4, rel=1e-5)


def test_a_decoded_nan_is_the_worst_error_there_is():
    x = np.zeros((2, 3, 3))
    y = x.copy()
    y[1, 2, 0] = np.nan
    meter = ErrorMeter()
    meter.add(x, y)
    meter.add(x, x + 1)
    assert meter.max_error == inf and (meter.worst_frame, meter.worst_vertex) == (1, 2)
    assert meter.rms_error == inf


def test_a_plant_that_does_not_move_has_no_error_or_an_infinite_one():
    still = np.zeros((2, 1, 3))
    meter = ErrorMeter(still[0])
    meter.add(still, still)
    assert meter.kg_error == meter.motion_normalised_error == 0.0
    meter.add(still, still + 1)
    assert meter.kg_error == meter.motion_normalised_error == inf


def test_motion_is_not_normalised_without_a_rest_pose():
    with pytest.raises(ValueError, match="no rest pose"):
        _ = ErrorMeter().motion_normalised_error


def test_blocks_of_unequal_shape_are_refused():
    with pytest.raises(ValueError, match=r"\(1, 2, 3\) and \(1, 3, 3\)"):
        ErrorMeter().add(np.zeros((1, 2, 3)), np.zeros((1, 3, 3)))


@pytest.mark.parametrize("error", [1e-300, 1e-170, 1e-30, 1e180])
def test_the_largest_error_is_exact_where_its_square_is_no_number(error):
    reference, decoded = np.zeros((2, 4, 3)), np.zeros((2, 4, 3))
    decoded[1, 2] = 3 * error, 0, 4 * error
    meter = ErrorMeter(weights=np.ones(4))
    with np.errstate(over="ignore"):
        meter.add(reference, decoded)
    assert meter.max_error == pytest.approx(5 * error, rel=1e-12)
    assert meter.max_weighted_error == meter.max_error
    assert (meter.worst_frame, meter.worst_vertex) == (1, 2)
