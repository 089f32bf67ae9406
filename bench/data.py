"""The clips that the benchmark measures: made once, kept in a folder, the same for everyone.

The shipped sample; render meshes of trees with leaves in wind (see bench/trees); small clips of many kinds (see
bench/odd); files that other programs write (see bench/foreign); and any clip by its path. All are seeded. Those of
trees/exact.py have the same bits on every machine, which their digests check; others of athcodec's own code differ by
rounding only. The attribute "recipe" of an HDF5 file, or NAME.recipe beside a file of another kind, describes how it
was made; when the recipe changes, the file is made again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import athcodec
from athcodec.motion.hierarchy import branch_orders
from bench import foreign, odd
from bench.clips import files_of
from bench.tables import table
from bench.trees import exact
from bench.trees.beams import bend
from bench.trees.mesh import SIDES, dress
from bench.trees.plant import grow
from bench.trees.wind import Wind

FOLDER_VARIABLE = "ATHCODEC_BENCH_DATA"
DEFAULT_FOLDER = Path("~/.cache/athcodec-bench")
FPS = 30.0
RECIPE_VERSION = 1  # goes up when the code below or in bench/trees gives other motion
SAMPLE = "sample"

NOTE = """
Seconds: to make the clip; "-" where the file existed. File MB: as it lies on disk.
Tips: RMS distance of the branches' ends from their mean positions, in per cent of the plant's height. Orders: of
the branches, trunk 0.
"""


class Different(Exception):
    """A clip that is the same on every machine came out otherwise."""


@dataclass(frozen=True)
class Canopy:
    """A tree of beams in turbulent wind as a render mesh: bark tubes, and leaves hinged on the outer stems."""

    nodes: int
    orders: int
    frames: int
    height: float
    wind_speed: float
    leaves: int
    species: str
    seed: int
    version: int = 1  # goes up when the code below bench/trees gives other leaves or beams

    def skeleton(self) -> athcodec.MotionClip:
        """Return the beams that were simulated, which carry the mesh."""
        plant = grow(self.nodes, self.orders, self.height, self.seed)
        described = {"wind_speed": self.wind_speed, "leaves": self.species}
        moved = bend(plant, self._wind, self.frames, FPS)
        return plant.clip(moved, np.arange(self.frames) / FPS, FPS, **described)

    def make(self) -> athcodec.MotionClip:
        return self.with_sides(SIDES)

    def with_sides(self, sides: int) -> athcodec.MotionClip:
        """Return the mesh with tubes of so many sides."""
        return dress(self.skeleton(), self._wind, self.frames, self.leaves, self.seed, self.species, sides)

    @property
    def _wind(self) -> Wind:
        return Wind(self.wind_speed, self.height, seed=self.seed)

    def __str__(self) -> str:
        return f"{self.height:g} m tree as a mesh: bark tubes and {self.leaves:,} {self.species} leaves in wind"


Recipe = Canopy | exact.Tree | exact.Cards | odd.Odd | foreign.Foreign

RECIPES: dict[str, Recipe] = {
    "canopy_4k_60f": Canopy(400, 2, 60, 6.0, 8.0, 260, "broadleaf", seed=11),
    "canopy_15k_200f": Canopy(1000, 2, 200, 8.0, 8.0, 1400, "broadleaf", seed=12),
    "canopy_67k_200f": Canopy(4000, 3, 200, 10.0, 8.0, 10000, "poplar", seed=13),
    "canopy_300k_60f": Canopy(16000, 3, 60, 14.0, 9.0, 16000, "compound", seed=14),
    # These stand for two clips that cannot be made: see docs/benchmarks.md.
    "fe_8k_200f": exact.Tree(
        ((1, 100), (40, 1800), (480, 6100)),
        frames=200,
        height=12.0,
        wind_speed=11.0,
        intensity=0.2,
        length=40.0,
        hertz=0.5,
        damping=0.1,
        seed=1,
        digest="8aa353e6af4d",
    ),
    "cards_373x121f": exact.Cards(373, 31, 4, (8.0, 2.0, 2.0), seed=1, digest="6a5c93f6c64e"),
}

SUITES = {
    "quick": (SAMPLE, "canopy_4k_60f"),
    "full": (SAMPLE, *RECIPES),
    "odd": tuple(odd.CLIPS),
    "odd-quick": odd.FEW,
    "foreign": tuple(name for name, clip in foreign.CLIPS.items() if not clip.held_out),
    "held-out": tuple(name for name, clip in foreign.CLIPS.items() if clip.held_out),
}
RECIPES |= odd.CLIPS | odd.SAMPLES | odd.MESHES | foreign.CLIPS
RECIPES["canopy_1k_60f"] = Canopy(120, 2, 60, 4.0, 8.0, 80, "broadleaf", seed=15)


def path_of(name: str, folder: Path | None = None) -> Path:
    """Return the file of a clip by name, made if it is missing, or of any clip by its path.

    Raises KeyError for a name that is neither, foreign.MissingProgram if the program that makes it is not installed.
    """
    return _found_or_made(name, folder or default_folder())[0]


def describe(name: str) -> str:
    if name == SAMPLE:
        return "ships with athcodec: finite-element tree in wind"
    return str(RECIPES[name]) if name in RECIPES else "given by its path"


def default_folder() -> Path:
    return Path(os.environ.get(FOLDER_VARIABLE) or DEFAULT_FOLDER).expanduser()


def _found_or_made(name: str, folder: Path) -> tuple[Path, float | None]:
    """Return the path of the clip's file, and the seconds that it took to make; None instead of the seconds if the file
    existed.
    """
    if name == SAMPLE:
        return athcodec.sample_path(), None
    if name not in RECIPES:
        if Path(name).is_file():
            return Path(name), None
        names = ", ".join([SAMPLE, *RECIPES])
        raise KeyError(f"clip: got {name!r}, expected the path of a file or one of {names}")
    recipe = RECIPES[name]
    path = folder / f"{name}{getattr(recipe, 'suffix', '.h5')}"
    if path.is_file() and _recipe_in(path, name) == recipe_text(name):
        return path, None
    folder.mkdir(parents=True, exist_ok=True)
    return path, _make(name, path)


def _make(name: str, path: Path) -> float:
    """Make the clip `name` by its recipe and write it to `path`; return the seconds that this took. Raise
    MissingProgram if its program is not installed, and Different if the content is not what every machine should make.
    """
    start, recipe = time.perf_counter(), RECIPES[name]
    if isinstance(recipe, foreign.Foreign) and (why := recipe.missing()):
        raise foreign.MissingProgram(why)
    for old in files_of(path) if path.exists() else ():  # They may be damaged, or more than will be written.
        old.unlink()
    if isinstance(recipe, foreign.Foreign):
        recipe.write(path)
    else:
        athcodec.write_hdf5(recipe.make(), path)
    if path.suffix == ".h5":
        with h5py.File(path, "r+") as file:
            file.attrs["recipe"] = recipe_text(name)
    else:
        path.with_name(f"{name}.recipe").write_text(recipe_text(name))
    expected = getattr(recipe, "digest", None)
    if expected and (made := digest(path)) != expected:
        path.unlink()
        raise Different(
            f"clip {name}: got digest {made}, expected {expected}, as every machine makes it; "
            "compare the versions of Python and NumPy, and report both"
        )
    return time.perf_counter() - start


def digest(path: Path) -> str:
    """Return a hexadecimal digest of a clip's positions, rest pose and branches, which are all that codecs get."""
    total = hashlib.sha256()
    with athcodec.read(path) as clip:
        for array in (clip.rest, clip.vertex_branch, clip.branch_parent):
            total.update(b"" if array is None else array.tobytes())
        for _, frames in clip.blocks():
            total.update(frames.tobytes())
    return total.hexdigest()[:12]


def recipe_text(name: str) -> str:
    """Return how the clip is made, as JSON."""
    recipe = RECIPES[name]
    return json.dumps({"kind": type(recipe).__name__, "version": RECIPE_VERSION} | asdict(recipe), sort_keys=True)


def _recipe_in(path: Path, name: str) -> str | None:
    """Return the description of how the file at `path` was made, as stored in or beside it; None if nothing is
    stored.
    """
    try:
        if path.suffix != ".h5":
            return path.with_name(f"{name}.recipe").read_text()
        with h5py.File(path, "r") as file:
            return str(file.attrs.get("recipe"))
    except OSError:
        return None


def tip_motion(clip: athcodec.MotionClip) -> float:
    """Return the RMS distance of the last vertices of all stems from their mean positions, as a fraction of the plant's
    height.
    """
    order = np.arange(clip.vertex_count) if clip.stem_index is None else clip.stem_index
    last = np.lexsort((order, clip.vertex_branch))
    ends = last[np.flatnonzero(np.diff(clip.vertex_branch[last], append=clip.branch_count))]
    motion = np.concatenate([frames[:, ends].astype(np.float64) for _, frames in clip.blocks()])
    up = {"x": 0, "y": 1, "z": 2}.get(str(clip.metadata.get("up_axis", "y")).lower(), 1)
    square = ((motion - motion.mean(axis=0)) ** 2).sum(axis=2).mean()
    return float(np.sqrt(square) / max(np.ptp(clip.rest[:, up]), 1e-30))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench data` to a parser: names of clips, a suite, and the folder in which clips are
    kept.
    """
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help=f"clips to make or find: {', '.join([SAMPLE, *RECIPES])}; or clips by path",
    )
    parser.add_argument(
        "--suite", choices=tuple(SUITES), help="suite of clips to make (default: quick, if nothing is named)"
    )
    parser.add_argument(
        "--folder",
        type=Path,
        metavar="DIR",
        help=f"where clips are kept (default ${FOLDER_VARIABLE} or {DEFAULT_FOLDER})",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Make the chosen clips that do not exist yet, and return a table of them: their sizes, branches and motion, how
    each was made, and the seconds this took.
    """
    names = _wanted(args.names, args.suite)
    folder = args.folder or default_folder()
    rows = []
    for name in names:
        try:
            path, seconds = _found_or_made(name, folder)
        except foreign.MissingProgram as error:
            rows.append({"name": name, "made": f"MISSING: {error}"})
            continue
        except (Different, KeyError) as error:
            raise SystemExit(f"bench data: {error.args[0]}") from error
        with athcodec.read(path) as clip:
            size = {"file MB": 1e-6 * sum(file.stat().st_size for file in files_of(path))}
            rows.append({"name": Path(name).stem} | _row(clip) | size | {"made": describe(name), "seconds": seconds})
    where = args.folder.name if args.folder else f"${FOLDER_VARIABLE} or {DEFAULT_FOLDER}"
    return {"tables": [table("Clips", rows, NOTE, f"In {where}.")], "broken": []}


def _wanted(names: Sequence[str], suite: str | None) -> list[str]:
    chosen = [*names, *(SUITES[suite or "quick"] if suite or not names else ())]
    return list(dict.fromkeys(chosen))


def _row(clip: athcodec.MotionClip) -> dict[str, Any]:
    """Return facts of a clip for a table: numbers of vertices, frames, branches and faces, the generations of branches,
    megabytes as float32, and how far tips move in per cent of the plant's height.
    """
    return {
        "vertices": clip.vertex_count,
        "frames": clip.frame_count,
        "branches": clip.branch_count,
        "orders": f"0-{int(branch_orders(clip.branch_parent).max())}" if clip.has_branches else None,
        "faces": None if clip.faces is None else len(clip.faces),
        "float32 MB": 12e-6 * clip.vertex_count * clip.frame_count,
        "tips %": 100 * tip_motion(clip) if clip.has_branches else None,
    }
