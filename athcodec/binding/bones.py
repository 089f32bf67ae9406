"""A mesh on a plant's chains as bones and weights, which engines skin: what `OntoMesh.write_bound` writes.

A bone is a node of a stem: a vertex of a row of points, or a slice of a surface, which SLICE_VERTICES of its vertices
stand for. A point at a place along an element hangs on the bones at both ends by a smooth step: under
linear blending its place then follows, to first order at both ends, the cubic curve that `Chains.places` follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from athcodec.binding.chains import Chains, rotated
from athcodec.binding.search import Binding
from athcodec.errors import ClipError

SLICE_VERTICES = 8  # Vertices of a slice that its bone follows, at most.
INFLUENCES = 4  # Bones of a vertex, as glTF and engines have them in one set.
MOST_BONES = 65536


@dataclass(frozen=True)
class Bones:
    """J bones, parents before their children, and V vertices on them.

    Attributes
    ----------
    chains : Chains
        The nodes that the bones are.
    vertex : (J,) int64
        The vertex of the plant, in the source's order, whose place the bone has; of a slice one of its vertices.
    before, after : (J,) int64
        The bones that come before and after it along its stem, the foot's on the parent's stem; -1 for none.
    side : (J,) bool
        Whether the bone is the first of its stem, whose element belongs to it and not to the parent's stem.
    rest : (J, 3) float64
        Places in the rest pose.
    joint : (V, 4) int64
        The bones of each vertex.
    weight : (V, 4) float32
        Their weights, which add up to 1.
    """

    chains: Chains
    vertex: np.ndarray
    before: np.ndarray
    after: np.ndarray
    side: np.ndarray
    rest: np.ndarray
    joint: np.ndarray
    weight: np.ndarray

    @property
    def slices(self) -> dict[str, list[Any]]:
        """The bones that are slices: their numbers as "bone", how many vertices each follows as "count", and these
        vertices as "vertex", with their offsets (x, y, z) from the bone in the rest pose as "offset"."""
        chains = self.chains
        bones = np.flatnonzero(~chains.is_line[chains.node_branch]).tolist()
        vertices = [chains.vertices_of(bone) for bone in bones]
        off = [chains.vertex_rest[each] - self.rest[bone] for bone, each in zip(bones, vertices)]
        return {
            "bone": bones,
            "count": [len(each) for each in vertices],
            "vertex": [vertex for each in vertices for vertex in each.tolist()],
            "offset": [float(f"{number:.7g}") for each in off for number in each.reshape(-1).tolist()],
        }

    def skinned(self, frames: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return vertices (k, V, 3) that are at `points` (V, 3) in the rest pose, as an engine skins them in frames
        (k, N, 3) of the plant."""
        pose = self.chains.pose(frames)
        moved = np.zeros((len(frames), *points.shape))
        for joint, weight in zip(self.joint.T, self.weight.T):
            off = pose.size[:, joint, None] * rotated(pose.turn[:, joint], points - self.rest[joint])
            moved += weight[:, None] * (pose.centre[:, joint] + off)
        return moved


def bones_of(chains: Chains, binding: Binding, of_vertex: np.ndarray) -> Bones:
    """Return the bones that move the vertices of a mesh.

    Parameters
    ----------
    chains : Chains
        The plant.
    binding : Binding
        What moves each point of the mesh.
    of_vertex : (V,) array of integers
        The point of each vertex.

    Raises
    ------
    ClipError
        If there are more than MOST_BONES bones.
    """
    parent = chains.hierarchy.branch_parent
    is_used = np.bincount(chains.element_branch[binding.element], minlength=len(parent)) > 0
    for branch in np.flatnonzero(parent >= 0)[::-1].tolist():  # Parents come before their children.
        is_used[parent[branch]] |= is_used[branch] and chains.is_line[branch]
    node = np.flatnonzero(is_used[chains.node_branch])
    if len(node) > MOST_BONES:
        raise ClipError(f"bones: got {len(node):,}, expected at most {MOST_BONES:,} vertices or slices of the plant")
    number = np.full(len(chains.rest), -1)
    number[node] = np.arange(len(node))
    joint, weight = _influences(chains, binding, len(chains.rest))
    some = chains.thinned(node, SLICE_VERTICES)
    return Bones(
        some,
        some.vertex_of_nodes,
        some.before,
        some.after,
        np.append(True, np.diff(some.node_branch) != 0),
        some.rest,
        number[joint][of_vertex],
        weight[of_vertex],
    )


def _influences(chains: Chains, binding: Binding, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (P, 4) that move each of `count` points, the heaviest first, and their weights (P, 4),
    float32.
    """
    rise = binding.share**2 * (3 - 2 * binding.share)
    point = np.tile(binding.point, 2)
    node = np.concatenate([chains.start[binding.element], chains.end[binding.element]])
    weight = np.concatenate([binding.weight * (1 - rise), binding.weight * rise])
    pairs, of_pair = np.unique(point * count + node, return_inverse=True)
    total = np.bincount(of_pair.reshape(-1), weight)
    point, node = np.divmod(pairs, count)
    order = np.lexsort((-total, point))
    point, node, total = point[order], node[order], total[order]
    rank = np.arange(len(point)) - np.searchsorted(point, point)
    kept = rank < INFLUENCES
    # What has no weight names the first bone of its vertex, as glTF wants no joint named twice with weight.
    first = node[rank == 0]
    joints = np.repeat(first[:, None], INFLUENCES, axis=1)
    weights = np.zeros(joints.shape)
    joints[point[kept], rank[kept]], weights[point[kept], rank[kept]] = node[kept], total[kept]
    joints = np.where(weights > 0, joints, first[:, None])
    return joints, (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
