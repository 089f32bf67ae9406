"""Many plants beside each other: fields, hedges, a bush, kelp."""

from __future__ import annotations

import numpy as np

from bench.scenes import stems as covers
from bench.scenes.assembly import FPS, Assembly, Scene
from bench.scenes.stems import Stems, bent, gusts, headings, swayed
from bench.trees.ride import sideways

FRAMES = 60


def _time(frames: int = FRAMES) -> np.ndarray:
    return np.arange(frames) / FPS


def _outwards(rng: np.random.Generator, stems: Stems, stem: np.ndarray, angle: float) -> np.ndarray:
    """Return (M, 3) directions away from stems, before they bend."""
    return sideways(stems.heading[stem], rng.uniform(0, 2 * np.pi, len(stem)), angle)


def _on(
    rng: np.random.Generator,
    stems: Stems,
    each: int,
    lowest: int,
    angle: float,
    length: float,
    points: int,
    bend: float,
) -> tuple[Stems, np.ndarray]:
    """Return so many stems on each stem, at random points from the lowest one up, and the stem that each is on."""
    count, available = stems.centres.shape[1:3]
    stem = np.repeat(np.arange(count), each)
    point = rng.integers(lowest, available - 1, len(stem))
    foot, base = stems.feet(stem, point)
    heading = _outwards(rng, stems, stem, angle)
    lengths = length * rng.uniform(0.6, 1.4, len(stem))
    moved = swayed(rng, _time(len(foot)), foot[0], bend, flutter=1.0)
    return bent(foot, heading, lengths, points, moved, base), stem


def _leaves(
    scene: Assembly, rng: np.random.Generator, stems: Stems, branch: np.ndarray, each: int, size: float
) -> None:
    """Return leaves of three pairs of vertices."""
    leaves, stem = _on(rng, stems, each, 2, np.radians(60), size, 3, 0.3)
    width = size * np.array([0.05, 0.3, 0.05])
    scene.add(*covers.ribbons(leaves, rng.uniform(0, 2 * np.pi, len(stem)), width), branch[stem])


def _field(rng: np.random.Generator, foot: np.ndarray, height: float, points: int, amount: float) -> Stems:
    count = len(foot)
    length = height * rng.uniform(0.75, 1.25, count)
    return bent(foot, headings(rng, count, 0.08), length, points, swayed(rng, _time(), foot, amount))


def ribbons(seed: int, plants: int, points: int) -> Scene:
    """Return blades of wheat, 400 on a square metre."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot = covers.ground(rng, plants, np.sqrt(plants / 400), np.sqrt(plants / 400))
    blades = _field(rng, foot, 0.8, points, 0.35)
    width = 0.008 * np.sqrt(1.02 - np.linspace(0, 1, points))
    scene.add(*covers.ribbons(blades, rng.uniform(0, 2 * np.pi, plants), width), feet=2)
    return scene.scene()


def tubes(seed: int, plants: int, rings: int, sides: int) -> Scene:
    """Return stems of a hedge, 60 to a metre, that lean through each other."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot = covers.ground(rng, plants, plants / 60, 0.4)
    shoots = _field(rng, foot, 1.4, rings, 0.2)
    radius = rng.uniform(0.006, 0.012, (plants, 1)) * np.linspace(1, 0.4, rings)
    scene.add(*covers.tubes(shoots, radius, sides), feet=sides)
    return scene.scene()


def hedge_ribbons(seed: int, plants: int, points: int) -> Scene:
    """Make wide leaves of a hedge that stand in the ground."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot = covers.ground(rng, plants, plants / 90, 0.3)
    blades = _field(rng, foot, 1.1, points, 0.25)
    width = 0.025 * np.sin(np.linspace(0.3, np.pi - 0.05, points))
    scene.add(*covers.ribbons(blades, rng.uniform(0, 2 * np.pi, plants), width), feet=2)
    return scene.scene()


def stems(seed: int, plants: int) -> Scene:
    """Return stems of a hedge, each with two twigs and six leaves."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot = covers.ground(rng, plants, plants / 40, 0.4)
    _shrubs(scene, rng, _field(rng, foot, 1.3, 12, 0.2), twigs=2, leaves=6)
    return scene.scene()


def bush(seed: int, stems: int) -> Scene:
    """Return stems that leave one patch of ground to all sides, with three twigs and eight leaves each."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot = rng.normal(0, 0.08, (stems, 3)) * [1, 0, 1]
    heading = headings(rng, stems, 0.35) + 2.0 * foot
    heading /= np.linalg.norm(heading, axis=1, keepdims=True)
    length = 1.2 * rng.uniform(0.6, 1.3, stems)
    _shrubs(scene, rng, bent(foot, heading, length, 12, swayed(rng, _time(), foot, 0.2)), twigs=3, leaves=8)
    return scene.scene()


def _shrubs(scene: Assembly, rng: np.random.Generator, shoots: Stems, twigs: int, leaves: int) -> None:
    count = shoots.centres.shape[1]
    radius = rng.uniform(0.006, 0.012, (count, 1)) * np.linspace(1, 0.4, shoots.centres.shape[2])
    branch = scene.add(*covers.tubes(shoots, radius, 5), feet=5)
    side, stem = _on(rng, shoots, twigs, 3, np.radians(40), 0.35, 6, 0.15)
    scene.add(*covers.tubes(side, 0.004 * np.linspace(1, 0.5, 6), 3), branch[stem])
    _leaves(scene, rng, shoots, branch, leaves, 0.08)


def stalks(seed: int, plants: int) -> Scene:
    """Return stalks of twelve rings of four vertices, 300 on a square metre."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot = covers.ground(rng, plants, np.sqrt(plants / 300), np.sqrt(plants / 300))
    shoots = _field(rng, foot, 0.9, 12, 0.3)
    scene.add(*covers.tubes(shoots, 0.003 * np.linspace(1, 0.5, 12), 4), feet=4)
    return scene.scene()


def kelp(seed: int, plants: int) -> Scene:
    """Return stipes on the sea's ground that a swell moves to and fro, with six blades each."""
    rng, scene = np.random.default_rng(seed), Assembly()
    foot, time = covers.ground(rng, plants, 2.0, 2.0), _time()
    swell = gusts(rng, time, foot, speed=1.0, fastest=0.4)
    limp = rng.uniform(0.7, 1.3, plants)
    bend = (limp * 0.9 * swell)[..., None] * [0, 0, -1.0] + 0.3 * swayed(rng, time, foot, 0.3)
    stipes = bent(foot, headings(rng, plants, 0.1), rng.uniform(2.0, 3.5, plants), 16, bend)
    branch = scene.add(*covers.tubes(stipes, 0.012 * np.linspace(1, 0.6, 16), 4), feet=4)
    blades, stem = _on(rng, stipes, 6, 4, np.radians(50), 0.8, 12, 0.6)
    width = 0.05 * np.sin(np.linspace(0.2, np.pi - 0.1, 12))
    scene.add(*covers.ribbons(blades, rng.uniform(0, 2 * np.pi, len(stem)), width), branch[stem])
    return scene.scene()
