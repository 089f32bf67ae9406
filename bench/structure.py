"""What the encoder finds of the structure of scenes: found against true branches, scene against parts, and so on.

The scenes are those of bench/scenes. Sizes are of positions alone in a single layer (`--attributes none --ladder
none`); the columns of default options say what a user of `athcodec encode` gets and waits for.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

import athcodec
from bench.clips import POSITIONS, add_effort, add_rel_error, file_and_seconds
from bench.scenes import SCENES, Scene
from bench.scenes.assembly import bare
from bench.tables import table

PARTS = 8  # Plants of a scene that are encoded alone, where it has more; their sum is extrapolated.
SEGMENTS = (16, 32, 64, 128, 256)
SEGMENT_SCENES = ("cloth_leaf", "storm")
SEGMENT_BOUNDS = (1e-3, 1e-4)

FOUND_NOTE = f"""
Roots and branches: of the maker, and those found for positions and faces alone. True: bytes on the maker's
branches; found: bytes on those found. Parts: bytes of each plant, and of what stands still, in a file of its own within
the same bound in units, branches found too; of more than {PARTS} plants as many were encoded, and their mean counts for
all. Limits: found / true 1.05, found / parts 1.05. Seconds: of the processor, of encoding with branches found.
"""
DEFAULT_NOTE = """
`athcodec encode` at its defaults. Source MB: float32. First: share of the file in the first level. RMS: of it, over the
diagonal. Feet: how far what stands in the ground strays at the first level, over the scene's height. Limits: a file
above 20 kB has three levels, and at most a quarter of it in the first. Seconds: of the processor.
"""
TURNING_NOTE = "Limit: 1.05 x standing + 500 bytes, within the same bound in units."
SEGMENT_NOTE = """
Bytes by longest segment in frames, and of the default, on branches found. Limit: default / best fixed 1.02.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"by default all: {', '.join(SCENES)}")
    add_rel_error(parser)
    add_effort(parser)
    parser.add_argument("--short", action="store_true", help="leave out the files of parts and of default options")


def run(args: argparse.Namespace) -> dict[str, Any]:
    if unknown := [name for name in args.scenes if name not in SCENES]:
        raise SystemExit(f"scene: got {', '.join(unknown)}; expected some of {', '.join(SCENES)}")
    branches, defaults, turning, segments = [], [], [], []
    for name in args.scenes or SCENES:
        scene = SCENES[name].make()
        row = _found_row(scene, args.rel_error, args.effort, has_parts=not args.short)
        branches.append({"scene": name} | row)
        if not args.short:
            defaults.append({"scene": name} | _default_row(scene, args.rel_error, args.effort))
        if scene.standing is not None:
            turning.append({"scene": name} | _turning_row(scene, row["found"], args.rel_error, args.effort))
        if name in SEGMENT_SCENES:
            segments += [{"scene": name} | _segment_row(scene, bound, args.effort) for bound in SEGMENT_BOUNDS]
        print(f"{name}: {branches[-1]}", flush=True)
    tables = [
        table(f"Found against true branches and against parts, bound {args.rel_error:g}", branches, FOUND_NOTE),
        table("Default options", defaults, DEFAULT_NOTE),
        table("Turning against standing", turning, TURNING_NOTE),
        table("Segments", segments, SEGMENT_NOTE),
    ]
    return {"tables": [part for part in tables if part["rows"]], "broken": []}


def _bound(scene: Scene, rel_error: float) -> float:
    """Return the bound of a scene, to which its parts are held too, in scene units."""
    low = np.min(scene.clip.positions, axis=(0, 1)).astype(np.float64)
    return rel_error * float(np.linalg.norm(np.max(scene.clip.positions, axis=(0, 1)) - low))


def _branches(data: bytes) -> list[int]:
    """Return the number of roots and the number of branches of an .ath file."""
    with athcodec.open(data) as decoder:
        parent = decoder.file.hierarchy.branch_parent
        return [int((parent < 0).sum()), len(parent)]


def _found_row(scene: Scene, rel_error: float, effort: str, has_parts: bool) -> dict[str, Any]:
    """Return sizes and times of a scene encoded with the branches that are found, and with its true ones."""
    options = POSITIONS | {"max_error": _bound(scene, rel_error), "effort": effort}
    branches, seconds = file_and_seconds(scene.bare(), **options)
    true, true_seconds = file_and_seconds(scene.clip, **options)
    parent = scene.clip.branch_parent
    row = {
        "vertices": scene.clip.vertex_count,
        "frames": scene.clip.frame_count,
        "roots, branches": [int((parent < 0).sum()), len(parent)],
        "found ones": _branches(branches),
        "true": len(true),
        "found": len(branches),
        "found / true": len(branches) / len(true),
        "seconds": seconds,
        "seconds, true": true_seconds,
    }
    if not has_parts:
        return row
    parts = _parts(scene, options)
    return row | {"parts": round(parts), "found / parts": len(branches) / parts}


def _parts(scene: Scene, options: dict[str, Any]) -> float:
    """Return the estimated bytes of a scene if each of its plants were a file of its own, from some of them."""
    plants = np.unique(scene.plant)
    chosen = plants[np.unique(np.linspace(0, len(plants) - 1, PARTS).round().astype(int))]
    still = _still_plants(scene)  # They are few, and unlike plants.
    sizes = {plant: len(file_and_seconds(scene.part(plant), **options)[0]) for plant in {*chosen.tolist(), *still}}
    moving = [size for plant, size in sizes.items() if plant not in still]
    rest = sum(sizes[plant] for plant in still)
    return rest + (len(plants) - len(still)) * float(np.mean(moving)) if moving else rest


def _still_plants(scene: Scene) -> set[int]:
    positions = scene.clip.positions
    moves = np.ptp(positions, axis=0).max(axis=-1) > 0
    return {*np.unique(scene.plant).tolist()} - {*np.unique(scene.plant[moves]).tolist()}


def _default_row(scene: Scene, rel_error: float, effort: str) -> dict[str, Any]:
    """Return size, time and the quality of level 0 of a scene encoded with default options."""
    data, seconds = file_and_seconds(scene.bare(), rel_error=rel_error, effort=effort)
    clip = scene.clip
    with athcodec.open(data) as decoder:
        levels = decoder.levels
        coarse = decoder.positions(slice(None), 0)
        diagonal = _bound(scene, 1.0)
        strayed = np.linalg.norm(coarse - clip.positions, axis=-1)
        height = float(np.ptp(clip.positions[..., 1]))
        return {
            "source MB": 12e-6 * clip.vertex_count * clip.frame_count,
            "bytes": len(data),
            "seconds": seconds,
            "levels": len(levels),
            "first": levels[0].bytes / len(data),
            "RMS": float(np.sqrt(np.square(strayed).mean())) / diagonal,
            "feet": float(strayed[:, scene.foot].max(initial=0.0)) / height,
        }


def _turning_row(scene: Scene, turning: int, rel_error: float, effort: str) -> dict[str, Any]:
    """Return the bytes of a scene of standing plants beside those of the same scene that turns as a whole."""
    options = POSITIONS | {"max_error": _bound(scene, rel_error), "effort": effort}
    standing = len(file_and_seconds(bare(scene.standing), **options)[0])
    return {
        "standing": standing,
        "turning": turning,
        "limit": round(1.05 * standing + 500),
        "ratio": turning / standing,
    }


def _segment_row(scene: Scene, bound: float, effort: str) -> dict[str, Any]:
    """Return the bytes of a scene by the length of its segments, beside those by the default length."""
    options = POSITIONS | {"rel_error": bound, "effort": effort}
    lengths = [length for length in SEGMENTS if length < 2 * scene.clip.frame_count]
    sizes = {
        str(length): len(file_and_seconds(scene.bare(), segment_frames=length, **options)[0]) for length in lengths
    }
    default = len(file_and_seconds(scene.bare(), **options)[0])
    return {"bound": bound, **sizes, "default": default, "default / best": default / min(sizes.values())}
