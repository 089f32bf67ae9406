"""Branches of whatever a caller has: `athcodec.find_branches`."""

from __future__ import annotations

from typing import Any

from athcodec.arrays import Source, clip_of
from athcodec.motion.branches import finding
from athcodec.motion.branches.result import Found


def find_branches(source: Source, method: str = "auto", root: int | None = None, **options: Any) -> Found:
    """Find branches for a motion; those that it has are ignored.

    Parameters
    ----------
    source : (frames, vertices, 3) array, MotionClip, Decoder, str or path-like
        As for `encode`; a few frames of it are read.
    method : str, optional
        "attributes": arrays named like branch numbers, per vertex or face. "skeleton": the joints that moved the
        vertices. "edges": a graph of centre lines. "objects": the objects of a scene, each of which moves by one
        affine map; those whose names share more words are the more likely to hang on each other. "components": the
        connected components of a mesh. "runs": points without faces or edges, linked to those that keep their distance:
        blades, needles, strands, centre lines. "motion": patches that move rigidly. "auto": the first of these that the
        source has the data for.
    root : int, optional
        A vertex of the branch that all others hang on, directly or not; by default the largest branch is that.
    **options
        What the source does not say, as for `encode`: faces, fps, unit, up_axis.

    Returns
    -------
    Found
        The branches. `encode` takes them as vertex_branch and branch_parent; a clip gets them by
        ``clip.replace(vertex_branch=..., branch_parent=..., stem_index=...)``.

    Raises
    ------
    ClipError
        If the source does not have the data that the method needs, or is no usable motion.
    MissingExtra
        If scipy is missing.
    ValueError
        For a method that does not exist.

    Examples
    --------
    >>> with athcodec.read(athcodec.sample_path()) as tree:
    ...     len(athcodec.find_branches(tree, "edges").branch_parent)
    99
    """
    with clip_of(source, **options) as (clip, _):
        return finding.find_branches(clip, method, root)
