"""Congruent parts share one shape in a rest pose: what they take, and how far off they are."""

from __future__ import annotations

import numpy as np
import pytest

from athcodec._native import BRANCH
from athcodec.encoding.streams import streams

STEP = 0.02
REACH = 0.6989 * STEP  # of a lattice point at most
LEAF = np.array([[-0.3, 0, 0], [0.3, 0, 0.05], [-0.4, 0.5, 0.2], [0.4, 0.5, 0.2], [-0.1, 1, 0.1], [0.1, 1, 0.1]])


def parts(
    shapes: list[np.ndarray], seed: int, scale: float = 0.0, mirror: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Branches and pose of a stem of 20 vertices with the shapes on it, each turned by chance."""
    random = np.random.default_rng(seed)
    stem = np.linspace(0, 4, 20)[:, None] * [0, 1, 0.1]
    attach = random.integers(0, 20, len(shapes))
    placed = [stem]
    for at, shape in zip(attach, shapes):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        turn *= 1 if mirror else np.linalg.det(turn)
        placed.append(stem[at] + random.uniform(1 - scale, 1 + scale) * shape @ turn.T)
    branches = np.zeros(len(placed), BRANCH)
    branches["parent"], branches["attach"], branches["lag"] = 0, [-1, *attach], [1, *map(len, shapes)]
    branches["parent"][0] = -1
    branches["count"] = [len(part) for part in placed]
    branches["first"] = np.cumsum(branches["count"]) - branches["count"]
    return branches, np.concatenate(placed)


def coded(branches: np.ndarray, pose: np.ndarray, copies: bool = True) -> streams.CodedRest:
    found = streams.find_copies(branches, STEP, pose, 0.0) if copies else None
    assert not copies or found is not None
    return streams.encode_rest(branches, STEP, pose, shape_of=found)


def bits_each(rest: streams.CodedRest, others: streams.CodedRest, count: int) -> float:
    return 8 * (len(rest.stream) - len(others.stream)) / count


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scale, mirror, most", [(0.0, False, 32), (0.0, True, 32), (0.3, False, 40)])
def test_congruent_parts_stay_within_the_rest_error_and_take_few_bits(seed, scale, mirror, most):
    branches, pose = parts([LEAF] * 200, seed, scale, mirror)
    alone = coded(branches[:1], pose[:20], copies=False)
    rest, plain = coded(branches, pose), coded(branches, pose, copies=False)
    assert np.linalg.norm(rest.decoded - pose, axis=1).max() <= REACH
    assert bits_each(rest, alone, 200) < most < 90 < bits_each(plain, alone, 200)


@pytest.mark.parametrize("seed", range(3))
def test_unrelated_parts_are_no_copies_and_cost_the_others_nothing(seed):
    random = np.random.default_rng(seed)
    unrelated = [random.normal(size=(6, 3)) * 0.4 for _ in range(100)]
    branches, pose = parts(unrelated, seed)
    assert streams.find_copies(branches, STEP, pose, 0.0) is None
    mixed = [shape for pair in zip(unrelated, [LEAF] * 100) for shape in pair]
    branches, pose = parts(mixed, seed)
    rest = coded(branches, pose)
    unrelated_alone = coded(*parts(unrelated, seed), copies=False)
    assert np.linalg.norm(rest.decoded - pose, axis=1).max() <= REACH
    assert bits_each(rest, unrelated_alone, 100) < 40


def test_needles_take_two_directions_and_no_twist():
    needle = np.array([[0, 0, 0], [0, 0.5, 0], [0, 1.0, 0]])
    branches, pose = parts([needle] * 200, 1)
    rest = coded(branches, pose)
    assert bits_each(rest, coded(branches[:1], pose[:20], copies=False), 200) < 20
    assert np.linalg.norm(rest.decoded - pose, axis=1).max() <= REACH
