"""Branches for a clip that names none."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass

import numpy as np

from athcodec.clip import MotionClip
from athcodec.errors import ClipError
from athcodec.hierarchy import branches_from_edges

METHODS = ("attributes", "skeleton", "edges", "components", "motion")


@dataclass(frozen=True)
class Found:
    """Branches as in MotionClip; method: one of METHODS, or "file"; note: what was found, one line."""

    vertex_branch: np.ndarray
    branch_parent: np.ndarray
    stem_index: np.ndarray | None
    method: str
    note: str = ""


def find_branches(clip: MotionClip, method: str = "auto") -> Found:
    raise NotImplementedError


def with_branches(clip: MotionClip, found: Found) -> MotionClip:
    """The clip on these branches."""
    return dataclasses.replace(clip, vertex_branch=found.vertex_branch, branch_parent=found.branch_parent,
                               stem_index=found.stem_index, rest=clip.rest.astype(clip.rest_dtype))
