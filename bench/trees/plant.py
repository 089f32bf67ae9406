"""A branching plant of a chosen number of nodes: where its nodes are, which stem each is on, how thick it is
there.

Every stem shares what nodes it is given between its own elements and its side stems. These stand at the
golden angle around it (137.5 degrees, as buds do) and bend upwards. Thickness follows the pipe model
(Shinozaki, Yoda, Hozumi and Kira, "A quantitative analysis of plant form: the pipe model theory", Japanese
Journal of Ecology 14(3), 1964): the cross-section is proportional to the foliage above it. No species is
meant, and there are no roots.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from athcodec import MotionClip

UP = np.array([0.0, 1.0, 0.0])
GOLDEN_ANGLE = np.radians(137.508)
FORK_ANGLE = np.radians(55.0)
FIRST_FORK = 0.25  # bare part of a stem, as a fraction of its elements
BASE_RADIUS = 0.0065  # Radius over the plant's height.
SMALLEST_STEM = 2  # elements


@dataclass(frozen=True, eq=False)
class Plant:
    """N nodes on B stems; a node's element is the straight piece between it and its parent.

    parent         (N,) node below, -1 for the root; always a lower number
    branch         (N,) the stem of each node; along a stem, nodes run from base to tip
    branch_parent  (B,) -1 for the trunk
    position       (N, 3) metres, y up, the root at 0
    radius         (N,) metres
    foliage        (N,) share of all foliage that the node carries
    """

    parent: np.ndarray
    branch: np.ndarray
    branch_parent: np.ndarray
    position: np.ndarray
    radius: np.ndarray
    foliage: np.ndarray

    @property
    def height(self) -> float:
        return float(self.position[:, 1].max())

    @property
    def elements(self) -> np.ndarray:
        """(N, 3) from parent to node, zero for the root."""
        return self.position - self.position[np.maximum(self.parent, 0)]

    @property
    def lengths(self) -> np.ndarray:
        """(N,) metres, of the elements."""
        x, y, z = self.elements.T
        return np.sqrt(x * x + y * y + z * z)

    @property
    def edges(self) -> np.ndarray:
        """(N - 1, 2) node below and node."""
        return np.stack([self.parent[1:], np.arange(1, len(self.parent))], axis=1).astype(np.int32)

    @cached_property
    def generations(self) -> list[np.ndarray]:
        """Nodes by the number of elements below them."""
        depth = np.zeros(len(self.parent), int)
        for node, below in enumerate(self.parent[1:].tolist(), start=1):
            depth[node] = depth[below] + 1
        return np.split(np.argsort(depth, kind="stable"), np.cumsum(np.bincount(depth))[:-1])

    def clip(self, positions: np.ndarray, time: np.ndarray, fps: float, **metadata: Any) -> MotionClip:
        """Return the plant's motion as a clip: positions (T, N, 3) of its nodes at times (T,) in seconds, and
        `metadata` of the clip.
        """
        return MotionClip(
            positions,
            time,
            self.branch,
            self.branch_parent,
            rest=self.position.astype(np.float32),
            edges=self.edges,
            attributes={"radius": self.radius.astype(np.float32)},
            metadata={"unit": "m", "up_axis": "y", "fps": fps} | metadata,
        )


def grow(nodes: int, orders: int, height: float, seed: int) -> Plant:
    """Return a random plant of exactly `nodes` nodes, with stems of the generations 0 (the trunk) to `orders`. Raise
    ValueError if there are too few nodes for that.
    """
    fewest = 1 + SMALLEST_STEM * (orders + 1)
    if nodes < fewest:
        raise ValueError(f"plant: got {nodes} nodes for orders 0 to {orders}, expected at least {fewest}")
    grower = _Grower(orders, np.random.default_rng(seed))
    grower.stem(0, -1, UP, 1.0, nodes - 1, 0)
    parent, branch = np.array(grower.parent, np.int32), np.array(grower.branch, np.int32)
    position = np.array(grower.position)
    position *= height / position[:, 1].max()
    leafy = np.array(grower.order) == orders
    leafy |= np.bincount(parent[1:], minlength=nodes) == 0  # tips of stems whose last fork is lower
    foliage = leafy / leafy.sum()
    radius = BASE_RADIUS * height * np.sqrt(sum_above(parent, foliage))
    return Plant(parent, branch, np.array(grower.branch_parent, np.int32), position, radius, foliage)


class _Grower:
    """The lists that stems are appended to, depth first, so that every subtree is one range of nodes."""

    def __init__(self, orders: int, rng: np.random.Generator) -> None:
        self.orders, self.rng = orders, rng
        self.parent, self.branch, self.order, self.position = [-1], [0], [0], [np.zeros(3)]
        self.branch_parent: list[int] = []
        # about a tenth of the trunk's length at the last order, however many orders there are
        self.shortening = 0.1 ** (1.0 / max(2, orders))

    def stem(self, base: int, below: int, direction: np.ndarray, length: float, budget: int, order: int) -> None:
        """Grow a stem of a length, from node `base` of branch `below`, with all that it carries. `budget` is the number
        of elements of the stem and of everything on it, and `order` its generation.
        """
        branch = len(self.branch_parent)
        self.branch_parent.append(below)
        count, budgets = self._share(budget, self.orders - order)
        nodes, directions = self._elements(base, branch, direction, length, count, order)
        forks = np.linspace(max(1, round(FIRST_FORK * count)), count - 1, len(budgets)).round().astype(int)
        azimuth = self.rng.uniform(0, 2 * np.pi)
        for fork, side_budget in zip(forks, budgets, strict=True):
            azimuth += GOLDEN_ANGLE
            side = _side_direction(directions[fork], azimuth, FORK_ANGLE + self.rng.normal(0, 0.12))
            side_length = length * self.shortening * (1.15 - 0.6 * fork / count)
            side_length *= self.rng.uniform(0.85, 1.15)
            self.stem(nodes[fork], branch, side, side_length, int(side_budget), order + 1)

    def _share(self, budget: int, levels_above: int) -> tuple[int, np.ndarray]:
        """Divide `budget` elements and return how many the stem itself gets, and how many each of its side stems gets
        with all that it carries. `levels_above` is the number of generations that are still to grow.
        """
        if levels_above == 0:
            return budget, np.zeros(0, int)
        reserve = SMALLEST_STEM * levels_above
        fan = budget ** (1.0 / (levels_above + 1))
        count = int(np.clip(round(1.5 * fan), SMALLEST_STEM, budget - reserve))
        sides = int(np.clip(round(fan), 1, (budget - count) // reserve))
        weights = self.rng.uniform(0.6, 1.4, sides)
        spare = budget - count - sides * reserve
        ends = np.round(np.cumsum(weights) / weights.sum() * spare).astype(int)
        return count, reserve + np.diff(ends, prepend=0)

    def _elements(
        self, base: int, branch: int, direction: np.ndarray, length: float, count: int, order: int
    ) -> tuple[list[int], list[np.ndarray]]:
        """Append the `count` nodes of a stem that begins at node `base`. Return the nodes' numbers, and the direction
        of the element that ends at each.
        """
        nodes, directions = [], []
        for _ in range(count):
            upwards = 0.0 if order == 0 else 0.6 / count
            direction = direction + upwards * UP + self.rng.normal(0, 0.25 / np.sqrt(count), 3)
            direction = direction / np.linalg.norm(direction)
            self.parent.append(base)
            self.position.append(self.position[base] + direction * length / count)
            self.branch.append(branch)
            self.order.append(order)
            base = len(self.parent) - 1
            nodes.append(base)
            directions.append(direction)
        return nodes, directions


def _side_direction(direction: np.ndarray, azimuth: float, angle: float) -> np.ndarray:
    first = np.cross(direction, [0.0, 0.0, 1.0] if abs(direction[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    outwards = np.cos(azimuth) * first + np.sin(azimuth) * np.cross(direction, first)
    return np.cos(angle) * direction + np.sin(angle) * outwards


def sum_above(parent: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return (N,) each node's value and those of all nodes that it carries."""
    total = values.astype(np.float64).copy()
    for node in range(len(parent) - 1, 0, -1):
        total[parent[node]] += total[node]
    return total
