"""Stems that bend, for many plants at once, and what covers them: ribbons and tubes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.trees.ride import rotations, sideways

UP = np.array([0.0, 1.0, 0.0])
GUSTS = 8


@dataclass(frozen=True)
class Stems:
    """S stems of P points: centres (T, S, P, 3), the rotations there (T, S, P, 3, 3) and the directions (S, 3) in which
    they leave their base before they bend."""

    centres: np.ndarray
    turns: np.ndarray
    heading: np.ndarray

    def feet(self, stem: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places (T, M, 3) and rotations (T, M, 3, 3) at points of stems, on which others grow."""
        return self.centres[:, stem, point], self.turns[:, stem, point]


def bent(
    foot: np.ndarray,
    heading: np.ndarray,
    length: np.ndarray,
    points: int,
    bend: np.ndarray,
    base: np.ndarray | None = None,
) -> Stems:
    """Return stems of equal pieces whose tips are turned by `bend` (T, S, 3) against their bases, in even shares.

    foot: (S, 3), or (T, S, 3) where it moves; base: (T, S, 3, 3) rotations of the feet.
    """
    share = np.arange(points) / (points - 1)
    turns = rotations(bend[:, :, None] * share[:, None])
    between = rotations(bend[:, :, None] * (share[1:, None] - 0.5 / (points - 1)))
    if base is not None:
        turns, between = base[:, :, None] @ turns, base[:, :, None] @ between
    steps = (between @ heading[:, None, :, None])[..., 0] * (length / (points - 1))[:, None, None]
    rise = np.cumsum(steps, axis=2)
    foot = np.broadcast_to(foot, (len(bend), *np.shape(foot)[-2:]))
    return Stems(foot[:, :, None] + np.concatenate([np.zeros_like(rise[:, :, :1]), rise], axis=2), turns, heading)


def ribbons(stems: Stems, azimuth: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (T, S, 2 P, 3) pairs of vertices and (F, 4) faces; width: (P,) or (S, P), of half a ribbon."""
    side = sideways(stems.heading, azimuth, np.pi / 2)
    across = (stems.turns @ side[:, None, :, None])[..., 0] * np.broadcast_to(width, stems.centres.shape[1:3])[
        ..., None
    ]
    pairs = np.stack([stems.centres - across, stems.centres + across], axis=3)
    first = 2 * np.arange(pairs.shape[2] - 1)[:, None]
    return pairs.reshape(*pairs.shape[:2], -1, 3), first + [0, 1, 3, 2]


def tubes(stems: Stems, radius: np.ndarray, sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (T, S, P * sides, 3) rings and (F, 4) faces; radius: (P,) or (S, P)."""
    angle = 2 * np.pi * np.arange(sides) / sides
    around = np.stack([sideways(stems.heading, np.full(len(stems.heading), one), np.pi / 2) for one in angle], axis=1)
    offsets = np.einsum("tspij,skj->tspki", stems.turns, around, optimize=True)
    rings = stems.centres[:, :, :, None] + offsets * np.broadcast_to(radius, stems.centres.shape[1:3])[..., None, None]
    side, after = np.arange(sides), np.roll(np.arange(sides), -1)
    lower = sides * np.arange(rings.shape[2] - 1)[:, None]
    faces = np.stack([lower + side, lower + after, lower + sides + after, lower + sides + side], axis=-1)
    return rings.reshape(*rings.shape[:2], -1, 3), faces.reshape(-1, 4)


def gusts(
    rng: np.random.Generator, time: np.ndarray, place: np.ndarray, speed: float = 2.0, fastest: float = 1.2
) -> np.ndarray:
    """Return (T, S) strengths about 0 of one wind that travels along x over (S, 3) places."""
    hertz, phase = rng.uniform(0.15, fastest, GUSTS), rng.uniform(0, 2 * np.pi, GUSTS)
    late = place[:, :1] / speed + rng.normal(0, 0.5, GUSTS) * place[:, 2:] / speed
    waves = np.sin(2 * np.pi * hertz * (time[:, None, None] - late) + phase)
    return waves @ (rng.uniform(0.5, 1.0, GUSTS) / np.sqrt(GUSTS))


def swayed(
    rng: np.random.Generator,
    time: np.ndarray,
    place: np.ndarray,
    amount: float,
    lean: float = 0.2,
    flutter: float = 0.25,
) -> np.ndarray:
    """Return (T, S, 3) bends of stems that stand at places: a lean of each, the wind, and an oscillation of each."""
    count = len(place)
    limp = rng.uniform(0.6, 1.4, count)
    still = rng.normal(0, lean, (count, 3)) * [1, 0, 1]
    push = (limp * (amount + gusts(rng, time, place) * amount))[..., None] * [0.0, 0.0, -1.0]
    waves = np.sin(2 * np.pi * rng.uniform(0.8, 2.5, count) * time[:, None] + rng.uniform(0, 2 * np.pi, count))
    strength = rng.uniform(0.5, 1.5, count) * flutter * amount
    return still + push + (waves * strength)[..., None] * rng.normal(size=(count, 3)) * [1, 0.3, 1]


def headings(rng: np.random.Generator, count: int, spread: float) -> np.ndarray:
    """Return (S, 3) unit vectors about upwards."""
    vectors = UP + rng.normal(0, spread, (count, 3)) * [1, 0, 1]
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def ground(rng: np.random.Generator, count: int, width: float, depth: float) -> np.ndarray:
    """Return (S, 3) feet in a rectangle."""
    return rng.uniform(-0.5, 0.5, (count, 3)) * [width, 0.0, depth]
