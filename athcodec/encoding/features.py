"""Features of the format that an encoder can do without, so that what each of them is worth can be measured."""

from __future__ import annotations

from enum import Enum


class Feature(Enum):
    """What may be left out of all of a file's settings."""

    ROTATIONS = "rotations at attach points"
    SHAPES = "learned shapes"
    TIME_BASES = "learned time bases"
    SHEETS = "affine functions first"
    RINGS = "tubes of rings"
    LOOSE = "loose branches"
    RIGID = "rigid parts"
    FREE_RIGID = "loose rigid parts"
    MEAN_POSE = "motion about the mean pose"
    PREDICTED = "predicted motion"
    LATTICE = "lattice points of predicted motion"
    CONNECTED = "connected rest poses"
    WIDE = "corrections of several frames"
    JOINS = "joins"
    PERIODIC = "periodic time bases"
