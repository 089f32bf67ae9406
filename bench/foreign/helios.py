"""Growth that the plant simulator Helios writes: USD with an Xform per organ, scaled to nothing before its birth."""

from __future__ import annotations

import tempfile
from pathlib import Path


def growth(path: Path, species: str, start: int, days: int, step: int, seed: int) -> None:
    """A plant from its library from day `start` on, a pose every `step` days, 1 / `step` seconds apart."""
    from pxr import Usd
    from pyhelios import Context, PlantArchitecture
    from pyhelios.types import vec3

    with tempfile.TemporaryDirectory() as folder, Context() as context, PlantArchitecture(context) as plants:
        plants.disableMessages()
        context.seedRandomGenerator(seed)
        plants.loadPlantModelFromLibrary(species)
        plant = plants.buildPlantInstanceFromLibrary(vec3(0, 0, 0), 1.0)
        for _ in range(start):
            plants.advanceTime(1.0)
        for _ in range(days // step):
            plants.registerGrowthFrame(plant)
            plants.advanceTime(float(step))
        text = str(Path(folder) / "growth.usda")
        plants.writePlantGrowthUSD(plant, text, 1.0 / step)
        Usd.Stage.Open(text).Export(str(path))
