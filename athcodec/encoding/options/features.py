"""Features of the format that an encoder can do without, so that the bytes that each saves can be measured."""

from __future__ import annotations

from enum import Enum


class Feature(Enum):
    """A feature that all settings of a file can leave out."""

    ROTATIONS = "rotations at attach points"
    SHAPES = "learned shapes"
    TIME_BASES = "learned time bases"
    COMMON_BASIS = "one time basis for all stages"
    WAVE_BASES = "learned time bases in waves"
    SHEETS = "affine functions first"
    RINGS = "tubes of rings"
    STILL = "branches whose bending turns nothing"
    RIGID = "rigid parts"
    FREE_RIGID = "loose rigid parts"
    TURN = "a largest step of rotations (Turn)"
    MEAN_POSE = "motion about the mean pose"
    PREDICTED = "predicted motion"
    ADAPTIVE = "adaptive vertices of rest poses"
    CONNECTED = "connected rest poses"
    COPIES = "copies in rest poses"
    STAGE_0_REST = "a rest pose for stage 0 alone"
    REFINED_REST = "rest poses in layers"
    HOST = "rest poses that the host has"
    WIDE = "corrections of several frames"
    JOINS = "joins"
    PERIODIC = "periodic time bases"
    REPEATS = "repeats"
    SIDES = "open sides as guesses of faces"
    ATTRIBUTES = "faces, edges and attributes"
