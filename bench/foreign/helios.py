"""Growth that the plant simulator Helios writes: USD with an Xform per organ, scaled to nothing before its birth."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom
from pyhelios import Context, PlantArchitecture
from pyhelios.types import vec3

import athcodec


def growth(path: Path, species: str, start: int, days: int, step: int, seed: int) -> None:
    """Make a plant from its library from day `start` on, a pose every `step` days, 1 / `step` seconds apart."""
    _grown(path, species, [(0.0, 0.0)], start, days, step, seed)


def bed(
    path: Path, species: str, rows: int, columns: int, apart: float, start: int, days: int, step: int, seed: int
) -> None:
    """Make plants side by side, `apart` metres between neighbours, as one stage; each grows by chances of its own."""
    places = [(apart * row, apart * column) for row in range(rows) for column in range(columns)]
    _grown(path, species, places, start, days, step, seed)


def array(path: Path, species: str, start: int, days: int, step: int, seed: int, has_faces: bool) -> None:
    """Write a NumPy archive of a growing plant's positions, with faces if `has_faces` is true, as a script would keep
    them. The plant is shown every `step` days for `days` days, from an age of `start` days on.
    """
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "growth.usdc"
        growth(stage, species, start, days, step, seed)
        with athcodec.read(stage) as clip:
            positions = clip.block(0, clip.frame_count).astype(np.float32)
            faces = {} if clip.faces is None or not has_faces else {"faces": clip.faces}
            if has_faces and not faces:
                raise RuntimeError(f"{species}: got polygons of several sizes, expected one; take another species")
            np.savez(path, positions=positions, fps=clip.fps, **faces)


def _grown(
    path: Path, species: str, places: Sequence[tuple[float, float]], start: int, days: int, step: int, seed: int
) -> None:
    """Grow a plant of a species at each (x, y) of `places` in Helios, and write its growth as USD: a frame every `step`
    days, for `days` days from an age of `start` days on.
    """
    with tempfile.TemporaryDirectory() as folder, Context() as context, PlantArchitecture(context) as architecture:
        architecture.disableMessages()
        context.seedRandomGenerator(seed)
        architecture.loadPlantModelFromLibrary(species)
        plants = [architecture.buildPlantInstanceFromLibrary(vec3(x, y, 0), 1.0) for x, y in places]
        for _ in range(start):
            architecture.advanceTime(1.0)
        for _ in range(days // step):
            for plant in plants:
                architecture.registerGrowthFrame(plant)
            architecture.advanceTime(float(step))
        files = [str(Path(folder) / f"plant{number}.usda") for number in range(len(plants))]
        for plant, file in zip(plants, files):
            architecture.writePlantGrowthUSD(plant, file, 1.0 / step)
        stage = Usd.Stage.Open(files[0])
        if len(files) > 1:
            stage = _side_by_side(files)
        stage.Export(str(path))


def _side_by_side(files: Sequence[str]) -> Usd.Stage:
    """Return a USD stage in which the contents of several USD files are prims beside each other."""
    first, stage = Usd.Stage.Open(files[0]), Usd.Stage.CreateInMemory()
    for name in ("timeCodesPerSecond", "framesPerSecond", "startTimeCode", "endTimeCode", "upAxis", "metersPerUnit"):
        if first.HasAuthoredMetadata(name):
            stage.SetMetadata(name, first.GetMetadata(name))
    root = UsdGeom.Xform.Define(stage, "/bed").GetPrim()
    stage.SetDefaultPrim(root)
    for number, file in enumerate(files):
        plant = Usd.Stage.Open(file)
        for child in plant.GetPseudoRoot().GetChildren():
            prim = stage.DefinePrim(Sdf.Path(f"/bed/plant{number}_{child.GetName()}"))
            prim.GetReferences().AddReference(file, child.GetPath())
    return Usd.Stage.Open(stage.Flatten())
