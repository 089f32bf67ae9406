"""Presence over time: the frames of a clip in which each of its objects is shown.

metadata["presence"] has an entry for each object that is not shown throughout: its name in "part_names", or
"name:number" for one of several copies of one shape, and the frames that show it as [first, stop] pairs. Hidden
vertices keep positions, which count like all others: for the diagonal, the error bound and the size of the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from athcodec.untyped import JsonMapping, JsonObject, JsonValue

PRESENCE = "presence"
FAR = 1.1  # Ratio of the diagonals with and without a hidden part above which the part is named.


def frame_runs(shown: np.ndarray) -> list[list[int]]:
    """Return the [first, stop] frames of each run of True in `shown` (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]])))
    return edges.reshape(-1, 2).tolist()


def stated_presence(metadata: JsonMapping) -> dict[str, list[list[int]]]:
    """Return metadata["presence"], without entries that are no list of [first, stop] frames."""
    stated = metadata.get(PRESENCE)
    return {name: runs for name, runs in stated.items() if _are_runs(runs)} if isinstance(stated, dict) else {}


def _are_runs(runs: JsonValue) -> bool:
    pairs = isinstance(runs, list) and all(isinstance(run, list) and len(run) == 2 for run in runs)
    return pairs and all(type(frame) is int and 0 <= frame < 1 << 31 for run in runs for frame in run)


def presence_within(metadata: JsonMapping, frames: range) -> JsonObject:
    """Return the metadata for a run of a clip's frames: the frames in which objects are shown are limited to the run
    and counted from its beginning."""
    if PRESENCE not in metadata:
        return dict(metadata)
    cut = {}
    for name, runs in stated_presence(metadata).items():
        bounds = [[max(first, frames.start), min(stop, frames.stop)] for first, stop in runs]
        kept = [[first - frames.start, stop - frames.start] for first, stop in bounds if first < stop]
        if kept != [[0, len(frames)]]:
            cut[name] = kept
    return {key: value for key, value in metadata.items() if key != PRESENCE} | ({PRESENCE: cut} if cut else {})


def presence_of_parts(
    metadata: JsonMapping, names: Sequence[str], copies: Sequence[int], frame_count: int
) -> dict[int, np.ndarray]:
    """Return which frames show each object that is hidden in some frame, by the object's number in `names`: bool (T,
    1), or (T, copies) if its copies differ. `copies` has the number of copies of each object."""
    presence: dict[int, np.ndarray] = {}
    stated = stated_presence(metadata)
    places = {name: number for number, name in enumerate(names)} if stated else {}
    for key, runs in stated.items():
        name, copy = (key, "") if key in places else key.rpartition(":")[::2]
        part = places.get(name)
        if part is None or copy and not (copy.isdecimal() and int(copy) < copies[part]):
            continue
        shown = np.zeros(frame_count, bool)
        for first, stop in runs:
            shown[first:stop] = True
        if copy:
            presence.setdefault(part, np.ones((frame_count, copies[part]), bool))[:, int(copy)] = shown
        else:
            presence[part] = shown[:, None]
    return presence


def parts_hidden_far_away(clip: Any) -> list[str]:
    """Return the names of objects that, while hidden, lie so far away that the clip's diagonal is more than FAR times
    as long as that of what is shown. This reads every frame of a clip with hidden objects."""
    counts, names = clip.attributes.get("part_vertex_counts"), clip.metadata.get("part_names")
    if not stated_presence(clip.metadata) or counts is None or np.shape(counts) != np.shape(names):
        return []
    copies = clip.attributes.get("part_copies", np.ones_like(counts))
    presence = presence_of_parts(clip.metadata, names, copies.tolist(), clip.frame_count)
    starts = np.cumsum(counts) - counts
    # The last row is what is shown.
    low, high = np.full((2, len(names) + 1, 3), np.inf) * np.array([1, -1])[:, None, None]
    for start, block in clip.blocks():
        for frame, positions in enumerate(block, start):
            is_shown = np.ones(len(positions), bool)
            for part, shown in presence.items():
                rows = slice(starts[part], starts[part] + counts[part])
                is_shown[rows] = np.repeat(shown[frame], counts[part] // shown.shape[1])
                hidden = positions[rows][~is_shown[rows]]
                low[part] = np.minimum(low[part], hidden.min(axis=0, initial=np.inf))
                high[part] = np.maximum(high[part], hidden.max(axis=0, initial=-np.inf))
            low[-1] = np.minimum(low[-1], positions[is_shown].min(axis=0, initial=np.inf))
            high[-1] = np.maximum(high[-1], positions[is_shown].max(axis=0, initial=-np.inf))
    with np.errstate(invalid="ignore"):  # inf - inf where nothing is shown or hidden
        diagonals = np.linalg.norm(np.maximum(high, high[-1]) - np.minimum(low, low[-1]), axis=1)
        return [names[part] for part in presence if diagonals[part] > FAR * diagonals[-1]]
