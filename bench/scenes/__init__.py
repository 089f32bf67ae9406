"""Scenes of plants side by side, of plants beside what stands still, and of single plants whose structure is easily
missed: small, seeded, made by formulas, with the branches that their maker knows.

Every plant of a field moves by its own phase and stiffness, in gusts that travel over the field; its foot stands still.
Plants stand so close that their parts reach through each other. They are not of the suites: `python -m bench
structure` makes them, and shows what an encoder that is given positions alone finds of their structure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from bench.scenes import fields, mixed, singles
from bench.scenes.assembly import Scene


@dataclass(frozen=True)
class Recipe:
    """A scene by its maker and what that is given, and whether those who encode it get its faces."""

    text: str
    maker: Callable[..., Scene]
    options: dict[str, int] = field(default_factory=dict)
    has_faces: bool = True

    def make(self) -> Scene:
        scene = self.maker(**self.options)
        return scene if self.has_faces else scene.without_faces()


SCENES: dict[str, Recipe] = {
    "wheat": Recipe("a wheat field of ribbons", fields.ribbons, {"seed": 31, "plants": 300, "points": 20}),
    "wheat_points": Recipe(
        "the same without faces", fields.ribbons, {"seed": 31, "plants": 300, "points": 20}, has_faces=False
    ),
    "hedge_tubes": Recipe("tubes of a hedge", fields.tubes, {"seed": 32, "plants": 150, "rings": 16, "sides": 5}),
    "hedge_ribbons": Recipe("ribbons of a hedge", fields.hedge_ribbons, {"seed": 33, "plants": 200, "points": 20}),
    "hedge_stems": Recipe("stems of a hedge with twigs and leaves", fields.stems, {"seed": 34, "plants": 80}),
    "willow": Recipe("leaves of a willow as cards", singles.willow, {"seed": 35, "leaves": 600}),
    "willow_points": Recipe("the same without faces", singles.willow, {"seed": 35, "leaves": 600}, has_faces=False),
    "bush": Recipe("a bush of many stems in the ground", fields.bush, {"seed": 36, "stems": 60}),
    "stalks_500": Recipe("500 stalks of 48 vertices", fields.stalks, {"seed": 37, "plants": 500}, has_faces=False),
    "stalks_2000": Recipe("2,000 of them", fields.stalks, {"seed": 37, "plants": 2000}, has_faces=False),
    "terrain": Recipe("the sample tree beside a still terrain", singles.tree_on_terrain, {"side": 100}),
    "terrain_points": Recipe(
        "the same without the terrain's faces", singles.tree_on_terrain, {"side": 100}, has_faces=False
    ),
    "turntable": Recipe("the sample tree on a turntable", singles.turning_tree),
    "cloth_leaf": Recipe("a cloth leaf", singles.cloth_leaf, {"seed": 38, "frames": 120}),
    "storm": Recipe("a leafed tree in a storm", singles.storm, {"seed": 39}),
    "kelp": Recipe("kelp with blades in a swell", fields.kelp, {"seed": 40, "plants": 40}),
    "trellis": Recipe("a vine on a still trellis", singles.trellis, {"seed": 41}),
    "ivy": Recipe("ivy on a tree that sways", singles.ivy, {"seed": 42}),
    "meadow": Recipe("a tree in a storm beside wheat and stems", mixed.meadow, {"seed": 43, "blades": 60, "stems": 12}),
    "meadow_points": Recipe(
        "the same without faces", mixed.meadow, {"seed": 43, "blades": 60, "stems": 12}, has_faces=False
    ),
    "willow_and_kelp": Recipe(
        "leaves of a willow beside kelp", mixed.crown_and_kelp, {"seed": 44, "leaves": 200, "plants": 10}
    ),
    "willow_and_kelp_points": Recipe(
        "the same without faces", mixed.crown_and_kelp, {"seed": 44, "leaves": 200, "plants": 10}, has_faces=False
    ),
}

__all__ = ["SCENES", "Recipe", "Scene"]
