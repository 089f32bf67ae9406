"""Branches that were found for a clip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec.motion.clip import MotionClip, check_branches, check_stem_index
from athcodec.motion.hierarchy import Hierarchy, branch_orders, build_hierarchy


@dataclass(frozen=True, eq=False, repr=False)
class Found:
    """Branches that were found for a clip; `str` describes them in one line.

    Parameters
    ----------
    vertex_branch : (N,) int32 array
        The branch of each vertex.
    branch_parent : (B,) int32 array
        The branch that each branch grows on, -1 for a root.
    stem_index : (N,) int32 array or None
        The place of each vertex on its stem, as in MotionClip.
    method : str
        How they were found: "attributes", "skeleton", "edges", "components", "runs", "motion", or "file".
    array_name : str, optional
        The name of the array that was taken for the numbers of branches.
    links : (L, 2) integer array, optional
        Pairs of vertices, of a branch and of its parent, by which the encoder hangs branches on each other; a branch
        without one hangs on the vertex of its parent that is nearest to its base.
    is_carried : bool, optional
        Whether the last branch carries all others, which turn or travel with it.

    Examples
    --------
    >>> with athcodec.read(athcodec.sample_path()) as tree:
    ...     athcodec.find_branches(tree, "edges").method
    'edges'
    """

    vertex_branch: np.ndarray
    branch_parent: np.ndarray
    stem_index: np.ndarray | None
    method: str
    array_name: str = ""
    links: np.ndarray | None = None
    is_carried: bool = False

    def __repr__(self) -> str:
        return f"<Found: {self}>"

    def __str__(self) -> str:
        """Return a line that says how many branches were found, and how."""
        roots = int((self.branch_parent < 0).sum())
        sizes = np.bincount(self.vertex_branch)
        method = f"{self.method} ({self.array_name})" if self.array_name else self.method
        if len(sizes) == 1:
            return f"1 branch by {method}: all {sizes[0]:,} vertices"
        return (
            f"{len(sizes):,} branches by {method}: {roots:,} without a parent, "
            f"up to order {order_of(self)}, {sizes.min():,} to {sizes.max():,} vertices each"
        )


def order_of(branches: Found) -> int:
    """Return the highest order of any of the branches, 0 if all are roots."""
    return int(branch_orders(branches.branch_parent).max())


def checked_branches(vertex_branch: np.ndarray, parent: np.ndarray, stem_index: np.ndarray, method: str) -> Found:
    vertex_branch, parent = check_branches(vertex_branch.astype(np.int64), parent.astype(np.int64), len(vertex_branch))
    return Found(vertex_branch, parent, check_stem_index(stem_index.astype(np.int64), vertex_branch), method)


def hierarchy_on(branches: Found, rest: np.ndarray, edges: np.ndarray | None) -> Hierarchy:
    """Return the hierarchy of a clip on branches that were found for it. `rest`: the clip's rest pose, (N, 3); `edges`:
    its edges, (E, 2), or None.
    """
    links = [pairs for pairs in (edges, branches.links) if pairs is not None]
    return build_hierarchy(
        branches.vertex_branch,
        branches.branch_parent,
        rest,
        np.concatenate(links) if links else None,
        branches.stem_index,
    )


def with_branches(clip: MotionClip, branches: Found) -> MotionClip:
    """Return the clip on branches that were found. Raises ClipError if they are for another number of vertices."""
    return clip.replace(
        vertex_branch=branches.vertex_branch, branch_parent=branches.branch_parent, stem_index=branches.stem_index
    )
