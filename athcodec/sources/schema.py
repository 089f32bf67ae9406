"""Parts that the formats with the names of athcodec's schema share: HDF5 (see hdf5.py) and NumPy archives (npz.py).
It opens no files.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from athcodec.motion.clip import MotionClip, frame_rate
from athcodec.motion.hierarchy import branch_orders, branches_from_edges
from athcodec.motion.joining import read_clip_metadata
from athcodec.sources import ReadOptions

BRANCHES = ("vertex_branch", "branch_parent", "stem_index")


def clip_of_arrays(
    positions: Any,
    array: Callable[[str], np.ndarray | None],
    attributes: dict[str, np.ndarray],
    metadata: dict[str, Any],
    options: ReadOptions,
    **watched: Any,
) -> MotionClip:
    """The clip of positions and of the arrays that `array` gives by their names in the schema, None for one that is
    missing. watched: resource and unchanged as in MotionClip. Raises ClipError."""
    time = array("time")
    if time is None:
        time = np.arange(positions.shape[0] if positions.shape else 0) / frame_rate(metadata)
    clip = MotionClip(
        positions,
        time,
        rest=array("rest") if options.rest == "auto" else None,
        rest_pose="mean" if options.rest == "mean" else "first",
        edges=array("edges"),
        faces=array("faces"),
        attributes=attributes,
        metadata=metadata,
        **_branches(positions, array, metadata, options),
        **watched,
    )
    order = clip.attributes.get("branch_order")
    if order is not None and clip.has_branches and np.array_equal(order, branch_orders(clip.branch_parent)):
        del clip.attributes["branch_order"]
    read_clip_metadata(clip)
    return clip


def _branches(
    positions: Any, array: Callable[[str], np.ndarray | None], metadata: dict[str, Any], options: ReadOptions
) -> dict[str, np.ndarray | None]:
    """Return the branches of the file, else those that its edges make."""
    found = {name: array(name) for name in BRANCHES}
    edges = array("edges")
    if found["vertex_branch"] is not None or found["branch_parent"] is not None:
        return found
    if edges is None:
        return {}
    rest = MotionClip(positions, np.arange(len(positions)), rest=array("rest")).rest  # checked, as the clip's will be
    made = branches_from_edges(edges, len(rest), rest, options.root, metadata.get("up_axis", "y"))
    return dict(zip(BRANCHES, made, strict=True))
