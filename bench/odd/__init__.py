"""Small clips of many kinds, made by formulas in seconds: plants that grow or unfold, grass, captures, meshes that
stand still, and things that are no plants at all.

A codec that is good at swaying trees has to be no worse than a simple one here. Every maker is given a seed and nothing
from outside; `CLIPS` are the ones that are measured, by name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from athcodec import MotionClip
from bench.odd import bending, growing, others
from bench.odd.grass import grass


@dataclass(frozen=True)
class Odd:
    """A clip by the name of its maker, its seed and whatever else that is given; whether it shows a plant."""

    maker: str
    text: str
    seed: int
    options: Mapping[str, Any] = field(default_factory=dict)
    plant: bool = True
    version: int = 1  # goes up when the code of this folder gives other motion

    def make(self) -> MotionClip:
        return MAKERS[self.maker](seed=self.seed, **self.options)

    def __str__(self) -> str:
        return self.text


MAKERS: dict[str, Callable[..., MotionClip]] = {
    maker.__name__: maker
    for maker in (
        bending.swaying_tree,
        bending.moved_tree,
        bending.held_tree,
        bending.far_tree,
        bending.scanned_tree,
        growing.growth,
        growing.growth_in_wind,
        growing.sapling,
        growing.unfolding_leaves,
        grass,
        others.captured_stem,
        others.white_noise,
        others.still_mesh,
        others.morph_targets,
        others.rippling_sheet,
        others.drifting_points,
        others.one_vertex,
        others.tumbling_cube,
        others.triangulated_leaf,
    )
}


def _odd(maker: str, text: str, plant: bool = True, seed: int = 1, **options: Any) -> Odd:
    return Odd(maker, text, seed, options, plant)


def _morph(text: str, reach: tuple[float, float]) -> Odd:
    options = {"frames": 225, "points": 1528, "targets": 20, "active": 3, "key": 15, "reach": reach}
    return _odd("morph_targets", text, plant=False, **options)


SAMPLES: dict[str, Odd] = {
    "growth_flowing": _odd(
        "growth",
        "branches grow as the eased tips of their parents pass",
        seed=4,
        frames=120,
        vertices=1001,
        eased=True,
        carried=True,
        flowing=True,
    ),
    "sapling": _odd(
        "sapling", "a young tree grows and its leaves unfold: the sample", seed=4, frames=120, nodes=121, leaves=96
    ),
}
"""A clip that ships with athcodec, and one that is as growth without a stop; the tables of the odd clips are without
them."""

CLIPS: dict[str, Odd] = {
    "growth": _odd("growth", "branches grow one after the other", frames=120, vertices=1001),
    "growth_eased": _odd("growth", "as growth, eased", seed=2, frames=120, vertices=1001, eased=True),
    "growth_carried": _odd(
        "growth", "as growth, those that wait are carried", seed=4, frames=120, vertices=1001, carried=True
    ),
    "growth_in_wind": _odd("growth_in_wind", "grows while it sways", seed=3, frames=120, vertices=1001),
    "unfolding": _odd("unfolding_leaves", "leaves unfold on a twig", frames=120, leaves=60),
    "grass": _odd("grass", "800 blades in one wind"),
    "grass_unnamed": _odd("grass", "the same points, in order, no branches named", named=False),
    "grass_interleaved": _odd("grass", "the same, first points first", named=False, order="interleaved"),
    "grass_shuffled": _odd("grass", "the same, at random", named=False, order="shuffled"),
    "capture": _odd("captured_stem", "31 markers, noise of 1e-4", frames=2000, points=31, noise=1e-4),
    "capture_long": _odd("captured_stem", "the same for longer", seed=2, frames=6000, points=31, noise=1e-4),
    "calm": _odd("swaying_tree", "tree with little motion", frames=100, vertices=4000, amount=0.008),
    "scanned": _odd("scanned_tree", "stems of 1 to 5 vertices, blown far", frames=120, stems=120, longest=5, lean=0.6),
    "few_7": _odd("swaying_tree", "7 frames of a tree", seed=7, frames=7, vertices=11666, orders=3, fps=4.0),
    "few_9": _odd("swaying_tree", "9 frames of a tree", seed=9, frames=9, vertices=7207, orders=3, fps=4.0),
    "teleport": _odd("moved_tree", "a tree moved every 20 frames", frames=120, vertices=300, every=20),
    "held": _odd("held_tree", "each pose three times", seed=2, frames=120, vertices=300, repeats=3),
    "far": _odd("far_tree", "1e5 cm from the origin", seed=3, frames=60, vertices=300, distance=1e5),
    "still": _odd("still_mesh", "60 frames alike of a mesh", frames=60, nodes=1000, leaves=420),
    "one_frame": _odd("still_mesh", "the mesh alone", frames=1, nodes=1000, leaves=420),
    "morph": _morph("20 bumps, 3 at a time", (0.2, 0.5)),
    "morph_narrow": _morph("the same of few vertices", (0.05, 0.2)),
    "sheet": _odd("rippling_sheet", "bumps move over a sheet", plant=False, side=55, frames=120, bumps=12),
    "points": _odd("drifting_points", "points drift", plant=False, points=10000, frames=9, noise=1e-4),
    "noise": _odd("white_noise", "another place in every frame", plant=False, frames=100, points=100),
    "vertex": _odd("one_vertex", "one vertex", plant=False, frames=100),
    "cube": _odd("tumbling_cube", "thrown cube, rigid", plant=False, frames=127),
}

MESHES = {"triangles": _odd("triangulated_leaf", "a leaf of irregular triangles", frames=60, points=2000)}

SLOW = (
    *("growth_eased", "grass_unnamed", "grass_interleaved", "grass_shuffled", "points"),
    *("capture_long", "few_7", "still"),
)
FEW = tuple(name for name in CLIPS if name not in SLOW)  # which are measured in a few minutes
