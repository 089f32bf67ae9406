"""Root systems that CPlantBox grows, as the nodes of the last day: those not there yet stand at the tip that grows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plantbox

import athcodec

FOLDER = Path(plantbox.__file__).parent / "modelparameter/structural/rootsystem"
FRAMES, FPS = 120, 24.0


def growth(path: Path, plant: str, days: float, seed: int) -> None:
    """Write a root system that grows for `days` days, with a branch for each root. CPlantBox has no file format for
    motion of one topology, so athcodec's own is written.
    """
    system = plantbox.Plant()
    system.setSeed(seed)
    system.readParameters(str(FOLDER / f"{plant}.xml"))
    system.initialize(False)
    system.simulate(days, False)
    nodes = np.array([(node.x, node.y, node.z) for node in system.getNodes()])
    roots = [organ for organ in system.getOrgans() if organ.getNumberOfNodes() > 1]
    number = {root.getId(): index for index, root in enumerate(roots)}
    days_of_frames = np.linspace(0, days, FRAMES)
    positions = np.repeat(nodes[None], FRAMES, axis=0)
    branch = np.zeros(len(nodes), np.int32)
    for root in sorted(roots, key=lambda root: root.getNodeCT(0)):  # What carries a root is older.
        ids, born = root.getNodeIds(), [root.getNodeCT(i) for i in range(root.getNumberOfNodes())]
        for below, node, start, stop in zip(ids, ids[1:], born, born[1:]):
            part = np.clip((days_of_frames - start) / max(stop - start, 1e-9), 0, 1)[:, None]
            positions[:, node] = positions[:, below] + part * (nodes[node] - nodes[below])
            branch[node] = number[root.getId()]
    clip = athcodec.MotionClip(
        positions.astype(np.float32),
        np.arange(FRAMES) / FPS,
        branch,
        np.array([number.get(root.getParent().getId(), -1) for root in roots]),
        rest=nodes.astype(np.float32),
        edges=np.array([(segment.x, segment.y) for segment in system.getSegments()], np.int32),
        metadata={"unit": "cm", "up_axis": "z", "fps": FPS},
    )
    athcodec.write_hdf5(clip, path)
