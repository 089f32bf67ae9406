"""Writes GLB: glTF 2.0 in one file, moved by joints or by morph targets. Structure and skinning are written by hand.

"joints": a joint for each part that moves as one at the excerpt's depth (node or stem of the .ath file, branch of a
clip), all side by side below one node. A joint has translation, rotation and three scales; a part that this leaves
further off than the level itself is (of a clip: parts.OF_CLIP of its size) is cut into shorter ones (parts.py).
"morphs": a morph target per frame, exact but for float32, large. "auto": whichever is smaller, of a clip that is short;
else joints. Some engines, three.js among them, move triangles only: lines and points stand still there.

The error against what was to be written is in asset.extras.athcodec.max_error, in the unit of the vertices, and is
what write_clip returns. A node above all turns and scales to glTF's metres with y up, so that vertices keep their
numbers. Keys of animations are held in memory, morph targets are written frame by frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.excerpt import Excerpt
from athcodec.exporters import WriteOptions
from athcodec.exporters.fitting import allowed_error
from athcodec.exporters.gltf_build import (
    UNKNOWN_BOUND,
    VERTICES,
    Glb,
    Shape,
    add_mesh,
    branch_extras,
    clock,
    root_transform,
    shapes,
)
from athcodec.exporters.gltf_joints import Joints, fit_joints
from athcodec.files import new_file

MOST_JOINTS = 65536
SHORT_FRAMES, SHORT_BYTES = 300, 256 << 20
MORPH_FRAMES, MORPH_BYTES = 4096, 2 << 30
BYTES_PER_JOINT_KEY, BYTES_PER_JOINT, BYTES_PER_TARGET = 40, 900, 180


def write_clip(motion: Any, path: str | PathLike[str], options: WriteOptions,
               report: Callable[[float], None]) -> dict[str, Any]:
    """Write a MotionClip or an Excerpt as GLB to `path`; returns what asset.extras.athcodec says of it.

    Raises ClipError where it has more joints, frames or bytes than glTF can sensibly hold.
    """
    wanted, joints = options.animation, None
    if wanted != "morphs":
        joints = fit_joints(motion, allowed_error(motion), MOST_JOINTS, lambda done: report(0.95 * done))
    if wanted == "joints" and joints is None:
        raise ClipError(f"joints: got more than {MOST_JOINTS} that it takes to move the clip, expected fewer: choose a "
                        "lower depth, or morphs")
    if wanted == "auto":
        wanted = _smaller(motion, joints)
    if wanted == "morphs":
        _check_morphs(motion)
    facts = {"animation": wanted, "unit": str(motion.metadata.get("unit") or "")}
    if isinstance(motion, Excerpt):
        facts |= {"depth": motion.depth, "level_max_error": float(motion.max_error)}
    try:
        found, left_out = shapes(motion, Path(fspath(path)).stem)
        if wanted == "joints":
            facts["joints"] = len(joints.bind)
        facts |= ({"left_out": left_out} if left_out else {}) | branch_extras(motion)
        write = _Joined(motion, joints) if wanted == "joints" else _Morphed(motion)
        glb = Glb(clock(motion) | {"athcodec": facts})
        root = glb.node(name="plant", **root_transform(motion.metadata))
        later = write.add(glb, root, found, lambda done: report(done if wanted == "morphs" else 1.0))
        facts |= {"max_error": write.max_error, "vertices": motion.vertex_count}
        with new_file(path) as out:
            glb.write(out, later)
    except ValueError as error:
        if isinstance(error, ClipError):
            raise
        raise ClipError(f"{fspath(path)}: got values that glTF cannot hold: {error}") from None
    report(1.0)
    return facts


def write_rest(motion: Any, path: str, name: str, more: Mapping[str, np.ndarray], extras: Mapping[str, Any]) -> None:
    """The rest pose alone, with attributes by their semantic (N, width) besides those of the clip."""
    found, left_out = shapes(motion, name, more)
    glb = Glb(clock(motion) | {"athcodec": dict(extras) | ({"left_out": left_out} if left_out else {})})
    root = glb.node(name="plant", **root_transform(motion.metadata))
    for shape in found:
        if "TEXCOORD_1" in shape.attributes:  # the second set may not be without the first
            shape.attributes.setdefault("TEXCOORD_0", np.zeros((len(shape.source), 2), np.float32))
        glb.node(root, name=shape.name, mesh=add_mesh(glb, shape, np.asarray(motion.rest)))
    with open(path, "wb") as out:
        glb.write(out)


def _smaller(motion: Any, joints: Joints | None) -> str:
    morphs = motion.frame_count * (12 * motion.vertex_count + 4 * motion.frame_count + BYTES_PER_TARGET)
    if joints is None:
        return "morphs"
    is_short = motion.frame_count <= SHORT_FRAMES and morphs <= SHORT_BYTES
    size = len(joints.bind) * (BYTES_PER_JOINT_KEY * motion.frame_count + BYTES_PER_JOINT)
    return "morphs" if is_short and morphs < size else "joints"


def _check_morphs(motion: Any) -> None:
    size = 12 * motion.frame_count * motion.vertex_count
    if motion.frame_count > MORPH_FRAMES or size > MORPH_BYTES:
        raise ClipError(f"morph targets: got {motion.frame_count} frames of {motion.vertex_count} vertices, "
                        f"{size} bytes; expected at most {MORPH_FRAMES} frames and {MORPH_BYTES} bytes: choose joints, "
                        "or fewer frames")


def _key_times(glb: Glb, motion: Any) -> int:
    times = (np.asarray(motion.time) - motion.time[0]).astype(np.float32)
    if (np.diff(times) <= 0).any():
        raise ClipError("time: got frames closer to each other than float32 seconds tell, expected longer steps")
    return glb.array(times, bounds=True)


class _Joined:
    """Adds joints, and meshes that hang on them. It is all in memory."""

    def __init__(self, motion: Any, joints: Joints):
        self._motion, self._joints = motion, joints
        self.max_error = joints.max_error

    def add(self, glb: Glb, root: int, found: list[Shape], report: Callable[[float], None]) -> Iterator[bytes]:
        joints = self._joints
        nodes = [glb.node(root, name=f"part_{i}", translation=t.tolist(), rotation=_unit(r))
                 for i, (t, r) in enumerate(zip(*joints.rest[:2]))]
        bind = glb.array(np.ascontiguousarray(joints.bind.swapaxes(1, 2)).reshape(-1, 16))
        glb.json["skins"] = [{"joints": nodes, "inverseBindMatrices": bind, "skeleton": root}]
        dtype = np.uint8 if len(nodes) <= 256 else np.uint16
        for shape in found:
            own = np.zeros((len(shape.source), 4), dtype)
            own[:, 0] = joints.vertex_joint[shape.source]
            weights = np.zeros((len(shape.source), 4), np.uint8)
            weights[:, 0] = 255
            mesh = add_mesh(glb, shape, np.asarray(self._motion.rest), {"JOINTS_0": own, "WEIGHTS_0": weights})
            glb.node(name=shape.name, mesh=mesh, skin=0)
        self._animate(glb, nodes)
        return iter(())

    def _animate(self, glb: Glb, nodes: list[int]) -> None:
        """Channels of what moves; one key where something stands still elsewhere than at rest."""
        joints, times, first = self._joints, _key_times(glb, self._motion), None
        samplers, channels = [], []
        for path, values, rest in zip(("translation", "rotation", "scale"), joints.poses, joints.rest):
            is_still = (values == values[:1]).all(axis=(0, 2))
            is_rest = is_still & (values[0] == rest).all(axis=1)
            for which, frames in ((~is_still, len(values)), (is_still & ~is_rest, 1)):
                moving = np.flatnonzero(which)
                if not len(moving):
                    continue
                if frames == 1 and first is None:
                    first = glb.array(np.zeros(1, np.float32), bounds=True)
                data = np.ascontiguousarray(values[:frames, moving].swapaxes(0, 1))
                view, size = glb.stored(data), data[0].nbytes
                for place, joint in enumerate(moving):
                    output = glb.accessor(view, data.dtype, frames, data.shape[2], byteOffset=place * size)
                    samplers.append({"input": times if frames == len(values) else first, "output": output})
                    channels.append({"sampler": len(samplers) - 1, "target": {"node": nodes[joint], "path": path}})
        if channels:
            glb.json["animations"] = [{"name": "motion", "samplers": samplers, "channels": channels}]


def _unit(quaternion: np.ndarray) -> list[float]:
    wide = quaternion.astype(np.float64)
    return (wide / np.linalg.norm(wide)).tolist()


class _Morphed:
    """Adds meshes with a morph target per frame; the targets are written last, frame by frame."""

    def __init__(self, motion: Any):
        self._motion = motion
        self.max_error = 0.0

    def add(self, glb: Glb, root: int, found: list[Shape], report: Callable[[float], None]) -> Iterator[bytes]:
        frames = self._motion.frame_count
        weights = glb.array(np.eye(frames, dtype=np.float32).reshape(-1, 1))
        times = _key_times(glb, self._motion)
        meshes = [add_mesh(glb, shape, np.asarray(self._motion.rest)) for shape in found]
        count = sum(len(shape.source) for shape in found)
        view = glb.view(12 * count * frames, target=VERTICES, byteStride=12)
        channels = []
        for mesh, shape in zip(meshes, found):
            node = glb.node(root, name=shape.name, mesh=mesh)
            channels.append({"sampler": 0, "target": {"node": node, "path": "weights"}})
        bounds = self._add_targets(glb, found, meshes, view, count)
        glb.json["animations"] = [{"name": "motion", "samplers": [{"input": times, "output": weights}],
                                   "channels": channels}]
        self.max_error = UNKNOWN_BOUND
        return self._targets(glb, found, bounds, report)

    def _add_targets(self, glb: Glb, found: list[Shape], meshes: list[int], view: int, count: int) -> list[list[dict]]:
        """The accessors, by frame and shape, whose bounds are not known yet."""
        accessors, place = [], 0
        for frame in range(self._motion.frame_count):
            accessors.append([])
            for mesh, shape in zip(meshes, found):
                index = glb.accessor(view, np.dtype(np.float32), len(shape.source), 3, byteOffset=place,
                                     min=[UNKNOWN_BOUND] * 3, max=[UNKNOWN_BOUND] * 3)
                accessors[-1].append(glb.json["accessors"][index])
                primitive = glb.json["meshes"][mesh]["primitives"][0]
                primitive.setdefault("targets", []).append({"POSITION": index})
                place += 12 * len(shape.source)
        return accessors

    def _targets(self, glb: Glb, found: list[Shape], accessors: list[list[dict]],
                 report: Callable[[float], None]) -> Iterator[bytes]:
        rest = np.asarray(self._motion.rest).astype(np.float32)
        largest = 0.0
        for start, frames in self._motion.blocks():
            for i, frame in enumerate(frames):
                offsets = (frame.astype(np.float64) - rest).astype(np.float32)
                away = rest.astype(np.float64) + offsets - frame
                largest = max(largest, float(np.einsum("ni,ni->n", away, away).max()))
                for shape, accessor in zip(found, accessors[start + i]):
                    values = offsets[shape.source]
                    accessor["min"], accessor["max"] = values.min(axis=0).tolist(), values.max(axis=0).tolist()
                    yield values.tobytes()
            report((start + len(frames)) / self._motion.frame_count)
        self.max_error = float(np.sqrt(largest))
        glb.json["asset"]["extras"]["athcodec"]["max_error"] = self.max_error
