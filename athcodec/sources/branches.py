"""Branches of a clip by a method, or out of a file of their own."""

from __future__ import annotations

from athcodec.motion.branches.finding import find_branches
from athcodec.motion.branches.result import Found
from athcodec.motion.branches.saving import load
from athcodec.motion.clip import MotionClip
from athcodec.options import METHODS
from athcodec.sources.mtg import mtg_branches


def find_or_load(clip: MotionClip, hierarchy: str) -> Found:
    """Return branches by "auto" or one of METHODS, or from a file of `save` or in MTG. Raises ClipError, OSError."""
    if hierarchy == "auto" or hierarchy in METHODS:
        return find_branches(clip, hierarchy)
    if hierarchy.lower().endswith(".mtg"):
        return Found(*mtg_branches(hierarchy, clip), "file")
    return load(hierarchy)
