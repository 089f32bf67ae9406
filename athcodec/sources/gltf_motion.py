"""Computes where the vertices of glTF nodes are at any time, and at which times a clip has its frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import DEFAULT_FPS
from athcodec.motion.frames import is_far
from athcodec.sources.gltf_nodes import GltfNode, is_number, moving_nodes, triples
from athcodec.sources.gltf_scene import Scene, key_rate, off_grid
from athcodec.sources.scene_objects import Facing
from athcodec.sources.timing import warn_of_missed
from athcodec.untyped import JsonObject

WORK_BYTES = 64 << 20
MOST_FRAMES = 1 << 20
FACING_FRAMES = 64  # Frames whose transforms are held at once to see whether they mirror.
SAME = 1e-5  # Distance between the ends of a loop, over the plant's size.


class NodeMotion:
    """Positions of all nodes at any times."""

    def __init__(self, scene: Scene, nodes: list[GltfNode], from_world: np.ndarray | None = None):
        """Prepare the motion of the given nodes of a scene. `from_world` (4, 4) takes world space to the space of the
        positions; by default positions are in world space."""
        self.scene, self._nodes, self._from_world = scene, nodes, from_world
        self.count = nodes[-1].first + nodes[-1].count
        self.ancestors = scene.ancestors(moving_nodes(nodes))
        self.dtype: np.dtype = np.dtype(np.float64)
        placed = self.read(None)[0]
        loses = is_far(placed) and not np.array_equal(placed, placed.astype(np.float32))
        self.dtype = np.dtype(np.float64 if loses else np.float32)

    def read(self, times: np.ndarray | None) -> np.ndarray:
        """Return the positions (k, N, 3) of all nodes' vertices at `times` (k,) in seconds; with None, the scene
        without animation, k = 1. The type is `self.dtype`: float32, or float64 if the positions are too far from the
        origin for it."""
        out = np.empty((1 if times is None else len(times), self.count, 3), self.dtype)
        largest = max(node.count for node in self._nodes)
        step = max(1, WORK_BYTES // (48 * largest + 512 * len(self.ancestors)))
        with np.errstate(all="ignore"):
            for start in range(0, len(out), step):
                now = None if times is None else times[start : start + step]
                matrices = self.scene.matrices(self.ancestors, now)
                if self._from_world is not None:
                    matrices = {index: self._from_world @ matrix for index, matrix in matrices.items()}
                for node in self._nodes:
                    rows = node.vertices
                    out[start : start + step, rows] = self._positions(node, matrices, now)
        return out

    def _positions(self, node: GltfNode, matrices: dict[int, np.ndarray], times: np.ndarray | None) -> np.ndarray:
        """Return the positions (k, n, 3) of the n vertices of a node at `times` (k,), after morphing and skinning.
        `matrices` has the matrices (k, 4, 4) from each node to the space of the positions, by the node's number."""
        local = self._morphed(node, times)
        if node.skin is None:
            matrix = matrices[node.index]
            if node.copies is not None:
                matrix = (matrix[:, None] @ node.copies).reshape(-1, 4, 4)
                local = np.repeat(
                    np.broadcast_to(local, (len(matrices[node.index]), *local.shape[1:])), len(node.copies), axis=0
                )
                placed = local @ matrix[:, :3, :3].swapaxes(1, 2) + matrix[:, None, :3, 3]
                return placed.reshape(-1, node.count, 3)
            return local @ matrix[:, :3, :3].swapaxes(1, 2) + matrix[:, None, :3, 3]
        return self._skinned(node, matrices, local)

    def _morphed(self, node: GltfNode, times: np.ndarray | None) -> np.ndarray:
        """Return the vertices of a node after its morph targets and before its transforms, (k, n, 3), or (1, n, 3) if
        it has no targets. Targets with weight 0 in all of `times` (k,) are not read."""
        if not node.targets:
            return node.base[None].astype(np.float64)
        weights = self.scene.weights(node.index, times, node.weights)
        local = np.repeat(node.base[None].astype(np.float64), len(weights), axis=0)
        for column in np.flatnonzero((weights != 0).any(axis=0)):
            if (target := node.targets[column]) is not None:
                rows = np.flatnonzero(weights[:, column])
                moved = triples(self.scene.file, target, node.shape_count, "morph target")
                local[rows] += weights[rows, column, None, None] * moved
        return local

    def _skinned(self, node: GltfNode, matrices: dict[int, np.ndarray], local: np.ndarray) -> np.ndarray:
        """Return the vertices (k, n, 3) of a node as its joints move them. `local` has the vertices before skinning,
        (k, n, 3) or (1, n, 3); `matrices` has the matrices (k, 4, 4) of each joint by its number."""
        frames = max(len(local), *(len(matrices[joint]) for joint in node.joints))
        out = np.zeros((frames, 3, node.count))
        for joint, vertices, weights in node.influences:
            matrix = (matrices[node.joints[joint]] @ node.bind[joint])[:, :3]
            points = np.ones((len(local), 4, len(vertices)))
            points[:, :3] = local[:, vertices].swapaxes(1, 2)
            points *= weights
            out[:, :, vertices] += _product(matrix, points)
        return out.swapaxes(1, 2)

    def add_facings(self, times: np.ndarray, facings: Sequence[Facing]) -> None:
        """Note in `facings`, one for each node, whether transforms mirror the node at these times."""
        world = np.eye(4) if self._from_world is None else self._from_world
        for start in range(0, len(times), FACING_FRAMES):
            matrices = self.scene.matrices(self.ancestors, times[start : start + FACING_FRAMES])
            for node, facing in zip(self._nodes, facings):
                placed = (world @ self._placed(node, matrices))[:, None]
                facing.add(placed if node.copies is None else placed @ node.copies)

    def placed(self, node: GltfNode) -> np.ndarray:
        """Return (4, 4) from a node's mesh to the world without animation; of a skin, by the joint that counts most."""
        return self._placed(node, self.scene.matrices(self.ancestors, None))[0]

    def _placed(self, node: GltfNode, matrices: dict[int, np.ndarray]) -> np.ndarray:
        if node.skin is None:
            return matrices[node.index]
        strongest = np.bincount(node.strongest).argmax()
        return matrices[node.joints[strongest]] @ node.bind[strongest]

    def turned(self, node: GltfNode, directions: np.ndarray, is_normal: bool) -> np.ndarray:
        """Return unit directions (n, 3) at a node's vertices in the space of the positions, in the pose without
        animation. `directions` (n, 3) are in the node's own space; `is_normal` says that they transform as normals and
        not as tangents."""
        matrices = self.scene.matrices(self.ancestors, None)
        linear = np.eye(3) if self._from_world is None else self._from_world[:3, :3]

        def moved(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
            matrix = linear @ matrix[:3, :3]
            return vectors @ (np.linalg.pinv(matrix) if is_normal else matrix.T)

        if node.skin is None:
            turned = moved(matrices[node.index][0], directions)
        else:
            turned = np.zeros((node.count, 3))
            for joint, vertices, weights in node.influences:
                matrix = matrices[node.joints[joint]][0] @ node.bind[joint]
                turned[vertices] += weights[:, None] * moved(matrix, directions[vertices])
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        return turned / np.where(length > 0, length, 1.0)

    def normal_matrix(self, node: GltfNode) -> np.ndarray:
        """Return (3, 3) that turns normals of an unskinned node into the world."""
        matrix = self.scene.matrices(self.ancestors, None)[node.index][0, :3, :3]
        return np.linalg.pinv(matrix).T if np.isfinite(matrix).all() else np.eye(3)


def _product(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return (k, 3, 4) by (k or 1, 4, m); one multiplication where all frames have the same points."""
    if len(points) > 1:
        return matrices @ points
    return (matrices.reshape(-1, 4) @ points[0]).reshape(len(matrices), 3, -1)


@dataclass(frozen=True, eq=False)
class Sampling:
    """Frames per second, the times (T,) to evaluate, and metadata of both; whether the first follows the last."""

    fps: float
    times: np.ndarray
    clock: JsonObject
    is_loop: bool = False


def sampling_of(motion: NodeMotion, wanted: float | None) -> Sampling:
    """Return the frame rate and the times at which the animations are sampled. `wanted` is the caller's rate in frames
    per second; with None, the rate is the file's stated one, or else the rate that the animation keys lie on."""
    scene, keys = motion.scene, motion.scene.keys
    if not len(keys):
        return Sampling(DEFAULT_FPS, np.zeros(1), {})
    extras = _stated_extras(scene)
    fps = wanted or _stated_rate(extras, keys) or key_rate(keys)
    if fps is None:
        fps = DEFAULT_FPS
        warn_of_missed(keys, off_grid(keys, fps), fps, scene.file.path)
    count = float(keys[-1] - keys[0]) * fps
    if not count < MOST_FRAMES:
        raise ClipError(f"animations: got {count:.0f} frames, expected at most {MOST_FRAMES}; sample at a lower rate")
    scene.file.budget.take(32 * int(count), "animations")
    is_loop = extras.get("loop") is True
    frames = int(count + 0.02) + 1
    if is_loop and frames > 1 and _returns(motion, keys):
        frames = round(count)
        if abs(count - frames) > 0.02:  # the time of all frames is that of the loop
            fps *= frames / count
    times = keys[0] + np.arange(frames) / fps
    first = float(keys[0] * fps) + (extras["start_frame"] if is_number(extras.get("start_frame")) else 0)
    whole = round(first)
    clock = {"fps": float(fps), "start_frame": whole if abs(first - whole) < 1e-3 else first}
    return Sampling(float(fps), _on_keys(times, keys, fps), clock, is_loop)


def _stated_extras(scene: Scene) -> JsonObject:
    """Return the extras: those of the file, overridden by those of the animation."""
    items = [scene.file.json["asset"]]
    if len(scene.played) == 1:
        items.append(scene.file.item("animations", scene.played[0]))
    return {
        key: value for item in items if isinstance(item.get("extras"), dict) for key, value in item["extras"].items()
    }


def _returns(motion: NodeMotion, keys: np.ndarray) -> bool:
    """Return whether the scene has the same pose at the last key as at the first, as a loop does."""
    first, last = motion.read(keys[[0, -1]]).astype(np.float64)
    return bool(np.linalg.norm(last - first, axis=1).max() <= SAME * np.linalg.norm(np.ptp(first, axis=0)))


def _stated_rate(extras: JsonObject, keys: np.ndarray) -> float | None:
    """Return the frame rate that the file states, if its keys agree."""
    fps = extras.get("fps")
    return float(fps) if is_number(fps) and 0 < fps < 1e6 and not off_grid(keys, fps).any() else None


def _on_keys(times: np.ndarray, keys: np.ndarray, fps: float) -> np.ndarray:
    """Return times that are those of a key but for rounding become exactly it, which STEP asks for."""
    after = np.clip(np.searchsorted(keys, times), 1, max(len(keys) - 1, 1))
    right = keys[np.minimum(after, len(keys) - 1)]
    nearest = np.where(np.abs(times - keys[after - 1]) <= np.abs(right - times), keys[after - 1], right)
    return np.where(np.abs(nearest - times) * fps < 0.02, nearest, times)
