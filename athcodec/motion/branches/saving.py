"""Branches in a JSON file that a user keeps, edits and uses again."""

from __future__ import annotations

import json
import os

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.atomic import new_file
from athcodec.motion.branches.result import Found, checked_branches


def save(branches: Found, path: str | os.PathLike[str]) -> None:
    """Write branches to a JSON file that a user can edit, one line per branch.

    Parameters
    ----------
    branches : Found
    path : str or path
        The file: of each branch its parent, and its vertices from base to tip as runs, "0-5 9". Older JSON is replaced,
        no other file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    order = _stem_order(branches.vertex_branch, branches.stem_index)
    bounds = np.searchsorted(branches.vertex_branch[order], np.arange(len(branches.branch_parent) + 1))
    lines = [
        json.dumps({"branch": branch, "parent": int(parent), "vertices": _runs(order[first:last])})
        for branch, (parent, first, last) in enumerate(zip(branches.branch_parent, bounds[:-1], bounds[1:]))
    ]
    with new_file(path) as file:
        file.write(f'{{"vertex_count": {len(order)}, "method": {json.dumps(branches.method)}, "branches": [\n'.encode())
        file.write(",\n".join(lines).encode() + b"\n]}\n")


def load(path: str | os.PathLike[str]) -> Found:
    """Read branches from a file of `save`.

    Parameters
    ----------
    path : str or path
        The numbers of the branches in it may be any, in any order.

    Returns
    -------
    Found

    Raises
    ------
    ClipError
        If the file is no such JSON, or does not have every vertex once.
    OSError
        If it cannot be opened.
    """
    with open(path, encoding="utf-8") as file:
        try:
            content = json.load(file)
            vertex_count, branches = int(content["vertex_count"]), content["branches"]
            numbers = {branch["branch"]: number for number, branch in enumerate(branches)}
            parent = np.array([numbers.get(branch["parent"], -1) for branch in branches], np.int64)
            stems = [_vertices(branch["vertices"], vertex_count) for branch in branches]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ClipError(
                f"{os.fspath(path)}: got no branches ({type(error).__name__}: {error}), expected the JSON "
                "that athcodec hierarchy --save writes"
            ) from None
    labels = np.repeat(np.arange(len(stems)), [len(stem) for stem in stems])
    order = np.concatenate(stems) if stems else np.zeros(0, np.int64)
    if len(numbers) != len(branches) or not np.array_equal(np.sort(order), np.arange(vertex_count)):
        raise ClipError(
            f"{os.fspath(path)}: got vertices or branches twice or not at all, expected each of "
            f"{vertex_count} vertices once"
        )
    vertex_branch = np.empty(vertex_count, np.int64)
    vertex_branch[order] = labels
    place = np.concatenate([np.arange(len(stem)) for stem in stems])
    stem_index = np.empty(vertex_count, np.int64)
    stem_index[order] = place
    return checked_branches(vertex_branch, parent, stem_index, "file")


def _runs(vertices: np.ndarray) -> str:
    """Return runs of numbers, "0-5 9 7" for 0 1 2 3 4 5 9 7."""
    breaks = np.flatnonzero(np.diff(vertices) != 1) + 1
    firsts, lasts = vertices[np.append(0, breaks)], vertices[np.append(breaks, len(vertices)) - 1]
    return " ".join(f"{a}-{b}" if a != b else f"{a}" for a, b in zip(firsts.tolist(), lasts.tolist()))


def _vertices(text: str, vertex_count: int) -> np.ndarray:
    bounds = [[int(number) for number in run.split("-")] for run in text.split()]
    if any(not 0 <= run[0] <= run[-1] < vertex_count for run in bounds):
        raise ValueError(f"vertices {text[:40]!r}")
    return np.concatenate([np.arange(run[0], run[-1] + 1) for run in bounds]) if bounds else np.zeros(0, np.int64)


def _stem_order(vertex_branch: np.ndarray, stem_index: np.ndarray | None) -> np.ndarray:
    return np.lexsort((np.arange(len(vertex_branch)) if stem_index is None else stem_index, vertex_branch))
