"""Fixtures that several test files share."""

from __future__ import annotations

import numpy as np
import pytest

from athcodec.clip import MotionClip
from athcodec.sources import read_hdf5, sample_path


@pytest.fixture
def sample_file():
    return sample_path()


@pytest.fixture
def sample_clip():
    with read_hdf5(sample_path()) as clip:
        yield clip


@pytest.fixture
def forked():
    """Arguments of a small clip: a trunk of four vertices with a branch of two on its third, five frames."""
    rest = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0], [1, 2, 0], [2, 2, 0]], np.float32)
    sway = np.linspace(0, 1, 5, dtype=np.float32)[:, None, None] * rest[:, 1:2] * np.float32(0.1)
    return {
        "positions": rest + sway * np.array([1, 0, 0], np.float32),
        "time": np.array([0.0, 0.1, 0.3, 0.35, 2.0]),
        "vertex_branch": np.array([0, 0, 0, 0, 1, 1]),
        "branch_parent": np.array([-1, 0]),
        "rest": rest,
        "edges": np.array([[0, 1], [1, 2], [2, 3], [2, 4], [4, 5]], np.uint16),
        "metadata": {"unit": "m", "up_axis": "y"},
    }


@pytest.fixture
def forked_clip(forked):
    return MotionClip(**forked)
