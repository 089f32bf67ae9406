"""The record of a clip as it is coded, which is made once and never replaced.

Places of vertices, branches, and the pose that motion is coded about are found for a source's clip before the record is
made. What a search decides afterwards is in records of its own (segments/settings.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from athcodec.encoding.clip.places import PlacedClip
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.motion.branches.grown_pose import with_grown_branches
from athcodec.motion.branches.result import Found, hierarchy_on
from athcodec.motion.clip import MotionClip, stands_still
from athcodec.motion.frames import Frames
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.polygons import Polygons


def host_rest(clip: MotionClip) -> np.ndarray:
    """Return the rest pose of a clip as a host has it, (N, 3) float32."""
    return clip.rest.astype(np.float32) + np.float32(0)  # -0.0 is 0.0


def stored_polygons(clip: MotionClip, options: EncodingOptions) -> Polygons | None:
    """Return the polygons of a clip that are stored as FACES."""
    if options.attributes == "none":
        return None
    return Polygons.of_attributes(clip.attributes) if clip.faces is None else Polygons.of_rows(clip.faces)


def hierarchy_and_pose(
    placed: PlacedClip, branches: Found | None, options: EncodingOptions
) -> tuple[Hierarchy, np.ndarray]:
    """Return two things: the hierarchy of a clip's places, and the reference pose that their motion is coded about, (P,
    3) float64 in file order, which is the rest pose or a pose that shows more of the plant. `branches`: the branches
    that were found for a clip that states none; None for other clips.
    """
    clip = placed.clip
    if options.keeps_rest:
        pose = host_rest(clip) if options.host_rest else clip.rest
    else:
        pose = placed.grown_pose
    if branches is None:
        assert clip.vertex_branch is not None and clip.branch_parent is not None
        branches = Found(clip.vertex_branch, clip.branch_parent, clip.stem_index, "file")
    hierarchy = hierarchy_on(branches, pose, clip.edges)
    if not options.keeps_rest:
        pose = with_grown_branches(pose, clip, hierarchy)
    return hierarchy, pose[hierarchy.vertex_source].astype(np.float64)


@dataclass(frozen=True, eq=False)
class CodedClip:
    """A clip as it is coded: a vertex for each place, on branches, with the rest pose that the file stores and the pose
    that motion is coded about. Arrays in file order say so; others are in the order of `motion`, (P, 3)."""

    placed: PlacedClip  # The clip as the source has it, and which of its vertices are at one place.
    motion: MotionClip  # Positions, times and clip ranges of the places; its rest pose and branches are not coded.
    hierarchy: Hierarchy
    rest: np.ndarray  # (P, 3) float64: the rest pose that the file stores.
    rest_dtype: np.dtype
    rest_given: bool  # Whether files keep the rest pose because the source has one.
    branches: Found | None = None  # Those that were found for a clip without.
    reference: np.ndarray | None = None  # (P, 3) float64 in file order: what motion is coded about; None: `rest`.
    exact_rest: bool = False  # Whether the rest pose comes back bit for bit.
    host_rest: bool = False  # Whether a host has the rest pose.
    host_mesh: np.ndarray | None = None  # Rest pose of the host with all vertices; None: `rest`.
    weights: np.ndarray | None = None  # (P,) float64 factors on the bound, in file order.
    shares: np.ndarray | None = None  # (P,) int32 in file order: vertices of the source at each place; None: one.
    polygons: Polygons | None = None  # Polygons that the file stores as FACES, by places.
    is_still: bool | None = None  # Whether all frames are the rest pose; None: frames are read to tell.

    @classmethod
    def of(
        cls,
        placed: PlacedClip,
        branches: Found | None,
        hierarchy: Hierarchy,
        pose: np.ndarray,
        options: EncodingOptions,
    ) -> CodedClip:
        """Make the record of a clip as it is coded. `placed`: the clip and its places; `branches`: those that were
        found for a clip that states none; `hierarchy`, `pose`: the hierarchy and the reference pose that
        `hierarchy_and_pose` returns.
        """
        clip, order, places = placed.clip, hierarchy.vertex_source, placed.places
        stored = host_rest(clip) if options.host_rest else clip.source_rest
        rest, reference = stored.astype(np.float64), None
        if not np.array_equal(pose, rest[order]):
            if clip.rest_given:
                reference = pose
            else:
                rest = np.empty_like(pose)
                rest[order] = pose.astype(stored.dtype)
        return cls(
            placed,
            clip,
            hierarchy,
            rest,
            stored.dtype,
            clip.rest_given or options.host_rest,
            branches,
            reference,
            options.keeps_rest or (options.lossless and clip.rest_given),
            options.host_rest,
            host_rest(placed.source) if options.host_rest else None,
            None if placed.weights is None else placed.weights.values[places.first[order]],
            places.sizes[order] if places.are_shared else None,
            stored_polygons(clip, options),
        )

    @property
    def pose(self) -> np.ndarray:
        """What motion is coded about before a search has chosen another pose, (P, 3) float64 in file order."""
        return self.rest[self.hierarchy.vertex_source] if self.reference is None else self.reference

    @property
    def source_rest(self) -> np.ndarray:
        """The rest pose in its dtype, (P, 3)."""
        return self.rest.astype(self.rest_dtype)

    @property
    def vertex_count(self) -> int:
        """Number of places, P."""
        return self.motion.vertex_count

    @property
    def frame_count(self) -> int:
        """Number of frames, T."""
        return self.motion.frame_count

    @property
    def dtype(self) -> np.dtype:
        """dtype of the positions, float32 or float64."""
        return self.motion.dtype

    @cached_property
    def stands_still(self) -> bool:
        """Whether all frames are the rest pose; they are read once for a clip."""
        if self.is_still is not None:
            return self.is_still
        if np.array_equal(self.source_rest, self.motion.source_rest):
            return stands_still(self.motion)
        frames = (self.motion.block(frame, frame + 1)[0] for frame in range(self.frame_count))
        return all(np.array_equal(frame, self.source_rest) for frame in frames)

    def among(self, vertices: np.ndarray, hierarchy: Hierarchy, with_faces: bool = False) -> CodedClip:
        """Return the record of a part of the clip, which has some of its vertices alone. `vertices`: their numbers in
        file order, ascending; `hierarchy`: the hierarchy of these vertices, whose `vertex_source` counts them in the
        order of `motion`; `with_faces`: whether to keep the faces all of whose corners are among them.
        """
        motion, chosen = self.motion, np.sort(self.hierarchy.vertex_source[vertices])
        frames = Frames(
            lambda start, stop: motion.block(start, stop)[:, chosen], motion.frame_count, len(chosen), motion.dtype
        )
        faces = self.polygons.among(chosen) if with_faces and self.polygons is not None else None
        return replace(
            self,
            motion=MotionClip(
                frames,
                motion.time,
                rest=self.source_rest[chosen],
                metadata=motion.metadata,
                clip_ranges=motion.clip_ranges,
            ),
            hierarchy=hierarchy,
            rest=self.rest[chosen],
            reference=None if self.reference is None else self.reference[vertices],
            weights=None if self.weights is None else self.weights[vertices],
            shares=None if self.shares is None else self.shares[vertices],
            polygons=faces if faces is not None and faces.face_count else None,
            is_still=None,
        )

    def standing(self) -> CodedClip:
        """Return the record of a clip of one frame, its rest pose."""
        pose = self.source_rest
        motion = MotionClip(
            pose[None].astype(self.dtype), self.motion.time[:1], rest=pose, metadata=self.motion.metadata
        )
        return replace(self, motion=motion, is_still=True)
