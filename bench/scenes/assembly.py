"""Parts of a scene put together: each part is a branch, and those that hang on nothing are the plants' roots."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from athcodec import MotionClip

FPS = 30.0
UNNAMED = {"vertex_branch": None, "branch_parent": None}


@dataclass(frozen=True)
class Scene:
    """A clip with its maker's branches; `plant` (N,) numbers what would be a scene of its own; `foot` vertices that
    stand still; `standing` is what it is compared with where the whole scene travels."""

    clip: MotionClip
    plant: np.ndarray
    foot: np.ndarray
    standing: MotionClip | None = None

    def bare(self) -> MotionClip:
        """Return the clip as a source without branches gives it."""
        return bare(self.clip)

    def without_faces(self) -> Scene:
        return replace(self, clip=self.clip.replace(faces=None))

    def part(self, plant: int) -> MotionClip:
        """Return one plant alone, without branches."""
        kept = np.flatnonzero(self.plant == plant)
        number = np.full(len(self.plant), -1, np.int32)
        number[kept] = np.arange(len(kept))
        faces = self.clip.faces
        if faces is not None:
            corners = number[faces]
            faces = corners[(corners >= 0).any(axis=1)]  # Corners that are not there stay -1.
            faces = faces if len(faces) else None
        return MotionClip(
            self.clip.positions[:, kept],
            self.clip.time,
            rest=self.clip.source_rest[kept] if self.clip.rest_given else None,
            faces=faces,
            metadata=dict(self.clip.metadata),
        )


def bare(clip: MotionClip) -> MotionClip:
    return clip.replace(**UNNAMED, stem_index=None)


class Assembly:
    """Parts of one shape at a time, each a branch, its vertices from base to tip."""

    def __init__(self) -> None:
        self._positions: list[np.ndarray] = []
        self._faces: list[np.ndarray] = []
        self._branch: list[np.ndarray] = []
        self._parent: list[np.ndarray] = []
        self._foot: list[np.ndarray] = []
        self._vertices = self._branches = 0

    def add(
        self, positions: np.ndarray, faces: np.ndarray, parent: np.ndarray | int = -1, feet: int | None = None
    ) -> np.ndarray:
        """Add S parts, (T, S, n, 3), with the same faces (F, 4), and return their (S,) branches; the first `feet`
        vertices of each stand in the ground (None: all)."""
        frames, count, size, _ = positions.shape
        first = self._vertices + size * np.arange(count)
        branches = self._branches + np.arange(count, dtype=np.int32)
        parents = np.broadcast_to(np.asarray(parent, np.int32), (count,))
        self._positions.append(positions.reshape(frames, -1, 3).astype(np.float32))
        if len(faces):
            self._faces.append(np.where(faces < 0, -1, faces + first[:, None, None]).reshape(-1, faces.shape[1]))
        self._branch.append(np.repeat(branches, size))
        self._parent.append(parents)
        standing = first[parents < 0][:, None] + np.arange(size if feet is None else feet)
        self._foot.append(standing.ravel())
        self._vertices += count * size
        self._branches += count
        return branches

    def scene(self) -> Scene:
        parent = np.concatenate(self._parent)
        branch = np.concatenate(self._branch)
        root = np.arange(len(parent))
        for number, below in enumerate(parent.tolist()):  # Parents are added first.
            root[number] = number if below < 0 else root[below]
        positions = np.concatenate(self._positions, axis=1)
        clip = MotionClip(
            positions,
            np.arange(len(positions)) / FPS,
            branch,
            parent,
            faces=np.concatenate(self._faces).astype(np.int32) if self._faces else None,
            metadata={"unit": "m", "up_axis": "y", "fps": FPS},
        )
        return Scene(clip, root[branch], np.concatenate(self._foot))
