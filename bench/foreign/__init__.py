"""Clips that other programs make, each in the file format that its program writes.

athcodec reads parts, joints and names from them as from any user's file, and a table can say how many bytes the program
itself takes.

One module per program, whose makers are given a path, seeds and options. A maker gives the same motion whenever it runs
on one machine. Clips with `held_out` are measured and never looked at when athcodec is changed (CONTRIBUTING.md).
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]

# What each program is called, and by module: the packages that it needs, which the extra bench-clips installs.
PROGRAMS: dict[str, tuple[str, dict[str, str]]] = {
    "helios": ("Helios", {"pyhelios": "pyhelios3d", "pxr": "usd-core"}),
    "blender": ("Blender", {"bpy": "bpy==5.0.1"}),
    "cables": ("MuJoCo", {"mujoco": "mujoco"}),
    "links": ("MuJoCo", {"mujoco": "mujoco"}),
    "roots": ("CPlantBox", {"plantbox": "cplantbox"}),
    "shader": ("vertex shader", {}),
    "lsystem": ("L-system", {"trimesh": "trimesh"}),
    "scan": ("skeletor", {"skeletor": "skeletor", "trimesh": "trimesh", "meshio": "meshio"}),
    "leaf": ("scikit-fem", {"skfem": "scikit-fem", "meshio": "meshio"}),
}


class MissingProgram(Exception):
    """The program that makes a clip is not installed."""


@dataclass(frozen=True)
class Foreign:
    """A clip by the module of its program, its maker there and what that is given, and the end of its file's name."""

    program: str
    text: str
    maker: str
    options: Mapping[str, Any]
    suffix: str
    held_out: bool = False
    version: int = 1  # goes up when the maker gives other motion

    def missing(self) -> str | None:
        """Return why the clip cannot be made here; None if it can."""
        title, needs = PROGRAMS[self.program]
        absent = [package for module, package in needs.items() if find_spec(module) is None]
        return f"{title}: not installed, expected `pip install {' '.join(absent)}`" if absent else None

    def write(self, path: Path) -> None:
        """Write the clip; of numbered files, `path` is the first.

        Every maker runs in a process of its own: programs print, and some cannot be loaded beside each other.
        """
        words = [sys.executable, "-m", "bench.foreign", self.program, self.maker, path.absolute()]
        done = subprocess.run([*words, json.dumps(dict(self.options))], cwd=ROOT, capture_output=True, text=True)
        if done.returncode or not path.exists():
            raise RuntimeError(f"{path.name}: {self.program}.{self.maker} wrote no file\n{done.stdout}{done.stderr}")

    def __str__(self) -> str:
        return f"{PROGRAMS[self.program][0]}: {self.text}"


# Days before which nothing of a plant shows.
DORMANT = {"strawberry": 5, "soybean": 4, "grapevine_VSP": 27}


def _helios(species: str, days: int, held_out: bool = False) -> Foreign:
    step = 1 if days < 10 else 2
    start = max(0, DORMANT.get(species, 0) - (0 if days < 10 else 5))
    options = {"species": species, "start": start, "days": days, "step": step, "seed": 1}
    return Foreign("helios", f"{species}, {days} days of growth by {step}", "growth", options, ".usdc", held_out)


def _clip(program: str, maker: str, suffix: str, text: str, held_out: bool = False, **options: Any) -> Foreign:
    return Foreign(program, text, maker, options, suffix, held_out)


def _array(species: str, start: int, days: int, step: int, held_out: bool = False, has_faces: bool = False) -> Foreign:
    options = {"species": species, "start": start, "days": days, "step": step, "seed": 1, "has_faces": has_faces}
    text = f"{species} from day {start} to {start + days} as {'a mesh' if has_faces else 'points'}, triangles apart"
    return Foreign("helios", text, "array", options, ".npz", held_out)


HELIOS = ("bean", "cowpea", "strawberry", "rice", "soybean", "grapevine_VSP")
AGES = (8, 20)

CLIPS: dict[str, Foreign] = {
    **{f"helios_{species}_{days}d".lower(): _helios(species, days) for days in AGES for species in HELIOS},
    "blender_armature_tree": _clip("blender", "armature", ".glb", "tree on keyed bones", seed=1),
    "blender_shape_keys": _clip("blender", "shape_keys", ".abc", "tree with shape keys of two winds", seed=2),
    "blender_bent_grass": _clip(
        "blender", "grass", ".usdc", "blades displaced by clouds that travel", seed=3, blades=80
    ),
    "mujoco_cable_grass": _clip("cables", "grass", ".h5", "stems of grass as cables in gusts", seed=1, stems=40),
    "mujoco_cable_vine": _clip("cables", "vine", ".h5", "a vine that hangs from two points", seed=2, joints=120),
    "cplantbox_brassica": _clip(
        "roots", "growth", ".h5", "roots of oilseed rape", plant="Brassica_napus_a_Leitner_2010", days=30, seed=1
    ),
    "cplantbox_maize": _clip(
        "roots", "growth", ".h5", "roots of maize", plant="Zea_mays_4_Leitner_2014", days=25, seed=2
    ),
    "shader_card_tree": _clip(
        "shader",
        "morphs",
        ".glb",
        "card tree in shader wind, as morph targets",
        seed=1,
        nodes=220,
        orders=3,
        height=8.0,
        frames=100,
    ),
    "shader_card_bush": _clip(
        "shader", "morphs", ".glb", "bush of cards in shader wind", seed=2, nodes=160, orders=2, height=1.2, frames=150
    ),
    "lsystem_fern": _clip("lsystem", "sequence", "_0000.ply", "fern unrolls, a file a frame", plant="fern", seed=1),
    "lsystem_tree": _clip("lsystem", "sequence", "_0000.obj", "tree grows, a file a frame", plant="tree", seed=2),
    "scan_skeleton_tree": _clip(
        "scan", "skeleton", "_0000.vtu", "skeleton of a scanned tree, swayed", seed=1, nodes=400
    ),
    "skfem_leaf": _clip(
        "leaf", "flutter", ".xdmf", "leaf blade of plate elements flutters", seed=1, shape=0.5, refine=4
    ),
    # Places: vertices that coincide in all frames.
    "helios_wheat_array": _array("wheat", 14, 42, 3),  # A simulator's crop as an array: each triangle has its vertices.
    "helios_bindweed_array": _array("bindweed", 8, 18, 2),  # The same, of many thin organs.
    "blender_flower": _clip(  # Hard edges that an exporter has split, opening by shape keys.
        "blender", "flower", ".glb", "flower that opens by shape keys, with flat faces", seed=4, whorls=3, petals=8
    ),
    "lsystem_split_fern": _clip(  # A mesh that a library has split, a file a frame.
        "lsystem", "sequence", "_0000.ply", "fern unrolls, faces apart", plant="fern", seed=3, is_split=True
    ),
    # Plants side by side, scenes, and plants that travel as a whole.
    "mujoco_wheat_field": _clip(  # A field of ribbons: many roots that nothing joins.
        "cables", "field", ".npz", "wheat field of ribbons", seed=21, stems=225, apart=0.05, speed=2.5, has_faces=True
    ),
    "mujoco_hedge": _clip(
        "cables", "hedge", ".npz", "hedge of tubes", seed=22, stems=120, sides=5
    ),  # The same, closer.
    "mujoco_bush": _clip(  # Many stems in one patch of ground, each with branches and leaves.
        "links", "bush", ".npz", "bush of many stems in the ground", seed=23, stems=30, nodes=30, height=1.2
    ),
    "helios_bed": _clip(  # A bed of crops: six plants that grow, as one stage.
        "helios",
        "bed",
        ".usdc",
        "bed of six capsicum plants",
        species="capsicum",
        rows=2,
        columns=3,
        apart=0.25,
        start=5,
        days=26,
        step=2,
        seed=1,
    ),
    "blender_forest": _clip(  # A forest: objects whose names share words, each with roots of its own.
        "blender", "forest", ".abc", "six trees in winds of their own", seed=6, trees=6, nodes=24
    ),
    "blender_terrain": _clip(  # What stands still beside what moves.
        "blender", "terrain", ".glb", "tree on still ground", seed=7, nodes=50, side=90
    ),
    "blender_turntable": _clip(  # A tree that turns as a whole.
        "blender", "turntable", ".abc", "tree on a turntable", seed=8, nodes=60
    ),
    "blender_cloth_leaf": _clip(  # A sheet without branches: length of segments.
        "blender", "cloth", ".abc", "leaf of cloth in wind", seed=5, width=0.5, rows=61, columns=25
    ),
    "shader_willow": _clip(  # Leaves as separate cards, whose twigs are not there.
        "shader", "willow", ".glb", "leaves of a willow as cards", seed=3, leaves=500, pairs=8, height=7.0, frames=80
    ),
    "helios_tomato_8d": _helios("tomato", 8, held_out=True),
    "helios_tomato_20d": _helios("tomato", 20, held_out=True),
    "blender_armature_sapling": _clip("blender", "armature", ".glb", "another tree on keyed bones", True, seed=11),
    "mujoco_cable_reed": _clip("cables", "grass", ".h5", "other stems as cables", True, seed=11, stems=16),
    "cplantbox_lupin": _clip(
        "roots", "growth", ".h5", "roots of lupin", True, plant="Lupinus_albus_Leitner_2014", days=25, seed=11
    ),
    "shader_card_sapling": _clip(
        "shader", "morphs", ".glb", "another card tree", True, seed=11, nodes=180, orders=3, height=6.0, frames=100
    ),
    "lsystem_herb": _clip("lsystem", "sequence", "_0000.ply", "a herb grows", True, plant="herb", seed=11),
    "scan_skeleton_shrub": _clip("scan", "skeleton", "_0000.vtu", "another skeleton", True, seed=11, nodes=250),
    "skfem_blade": _clip("leaf", "flutter", ".xdmf", "another leaf blade", True, seed=11, shape=0.15, refine=3),
    # Places.
    "helios_maize_array": _array("maize", 4, 22, 2, True, has_faces=True),
    "blender_peony": _clip("blender", "flower", ".glb", "another flower that opens", True, seed=14, whorls=4, petals=6),
    # Plants side by side, scenes, and plants that travel as a whole.
    "mujoco_reeds": _clip(  # A field as points.
        "cables", "field", ".npz", "reed as points", True, seed=31, stems=196, apart=0.08, speed=3.0, has_faces=False
    ),
    "mujoco_thicket": _clip(
        "links", "bush", ".npz", "another bush of many stems", True, seed=33, stems=24, nodes=36, height=1.6
    ),
    "blender_orchard": _clip("blender", "forest", ".abc", "other trees", True, seed=16, trees=5, nodes=28),
    "blender_hillside": _clip("blender", "terrain", ".glb", "another tree on ground", True, seed=17, nodes=40, side=80),
    "blender_bract": _clip(
        "blender", "cloth", ".abc", "another leaf of cloth", True, seed=15, width=0.9, rows=45, columns=33
    ),
    "shader_poplar": _clip(
        "shader", "willow", ".glb", "other leaves as cards", True, seed=13, leaves=700, pairs=4, height=9.0, frames=80
    ),
    "scan_skeleton_turntable": _clip(
        "scan", "skeleton", "_0000.vtu", "skeleton on a turntable", True, seed=12, nodes=250, turns=1.0
    ),
}
