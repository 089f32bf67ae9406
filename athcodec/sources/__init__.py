"""Readers: one module per file format, each giving a MotionClip. Nothing here knows .ath files."""

from __future__ import annotations

from pathlib import Path

from athcodec.sources.hdf5 import read_hdf5

__all__ = ["read_hdf5", "sample_path"]


def sample_path() -> Path:
    """Where the clip that ships with athcodec lies: a small finite-element tree in wind, HDF5, 120 frames."""
    return Path(__file__).resolve().parent.parent / "sample" / "tree_1k_120f.h5"
