"""Writes vertex animation textures of node matrices: a folder of EXR textures, a JSON file and the rest pose as GLB.

A node has three texels per frame. Nodes are the parts of a level; stems that bend are cut until a map of each is no
further off than the level itself (fitting.py), so textures are small at any level. The error is measured on what is
written, rounding included, and stated in the JSON and by write_clip. The layout is in vat.md. Textures are made in
memory, as image files are.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from os import fspath
from pathlib import Path

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.fitting import Mapped, Moving, allowed_error, fit
from athcodec.exporters.gltf import write_rest
from athcodec.exporters.gltf_build import branch_extras
from athcodec.exporters.textures import WIDEST, facts_of, write_exr, write_json
from athcodec.files.atomic import new_folder
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonObject

PER_ROW = WIDEST // 3
MOST_NODES = PER_ROW * WIDEST
FLOAT16_MAX = 65504.0


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write a MotionClip or a ClipView to the new folder `path`, and return the contents of its JSON file.
    `options.half` selects half precision in place of float32.

    Raise ClipError if there are more nodes than a texture holds or if half precision cannot hold the motion,
    FileExistsError if `path` exists.
    """
    moving = fit(motion, Mapped, allowed_error(motion), MOST_NODES, lambda done: report(0.6 * done))
    if moving is None:
        raise ClipError(f"vat: got more than {MOST_NODES} nodes, expected fewer: choose a lower level")
    rows = _rows(moving, np.float16 if options.half else np.float32)
    name = Path(fspath(path)).stem or "clip"
    with new_folder(path) as folder:
        facts = _write(motion, moving, rows, folder, name, report)
    report(1.0)
    return facts


def _write(motion: Motion, moving: Moving, rows: np.ndarray, folder: str, name: str, report: Progress) -> JsonObject:
    """Write the textures, the pivots and the JSON file to `folder`, and return the contents of the JSON file. `rows` is
    the result of `_rows`.
    """
    pivots, vertex_node = moving.parts.middle.astype(np.float32), moving.parts.vertex_part()
    grid = _Grid(len(pivots), motion.frame_count)
    textures = []
    for texture, pixels in grid.textures(rows, name):
        write_exr(os.path.join(folder, texture["file"]), {"RGBA": pixels})
        textures.append(texture)
    write_exr(os.path.join(folder, f"{name}_pivots.exr"), {"RGB": grid.pivots(pivots)})
    error, low, high = _measured(motion, rows, pivots, vertex_node, lambda done: report(0.6 + 0.4 * done))
    facts = (
        {"format": "athcodec-vat", "version": 1}
        | facts_of(motion)
        | {
            "nodes": len(pivots),
            "precision": "half" if rows.dtype == np.float16 else "float",
            "width": grid.width,
            "height": grid.height,
            "nodes_per_row": grid.per_row,
            "rows_per_frame": grid.rows_per_frame,
            "max_error": error,
            "bounds": {"min": low, "max": high},
            "textures": textures,
            "pivots": f"{name}_pivots.exr",
            "mesh": f"{name}.glb",
        }
    )
    dtype = np.uint16 if len(pivots) <= 65536 else np.float32
    more = {"_NODE": vertex_node.astype(dtype)[:, None], "TEXCOORD_1": grid.places(vertex_node)}
    write_rest(motion, os.path.join(folder, f"{name}.glb"), name, more, branch_extras(motion))
    write_json(os.path.join(folder, f"{name}.json"), facts)
    return facts


def _rows(moving: Moving, dtype: type) -> np.ndarray:
    """Return the matrices (T, K, 3, 4) that K nodes add to the rest pose, in frames of T, relative to the middle of the
    node.
    """
    rows = np.empty((*moving.places.shape, 4), dtype)
    linear = moving.values[0].reshape(*moving.places.shape, 3) - np.eye(3)
    offset = moving.places - moving.parts.middle.astype(np.float32)
    largest = max(float(np.abs(linear).max()), float(np.abs(offset).max()))
    if dtype == np.float16 and largest > FLOAT16_MAX:
        raise ClipError(
            f"vat: got motion by {largest:g} units, expected at most {FLOAT16_MAX:g} in half precision: "
            "choose another unit"
        )
    rows[..., :3], rows[..., 3] = linear, offset
    return rows


class _Grid:
    """Where the texels of nodes and frames are."""

    def __init__(self, nodes: int, frames: int):
        self.per_row = min(nodes, PER_ROW)
        self.rows_per_frame = -(-nodes // self.per_row)
        self.width = 3 * self.per_row
        self.frames = min(frames, WIDEST // self.rows_per_frame)  # Frames that one texture holds.
        self.height = self.frames * self.rows_per_frame

    def textures(self, rows: np.ndarray, name: str) -> Iterator[tuple[JsonObject, np.ndarray]]:
        """Yield (what the JSON says of it, (height, width, 4)) each; texels without a node are 0."""
        for number, start in enumerate(range(0, len(rows), self.frames)):
            frames = rows[start : start + self.frames]
            texels = np.zeros((self.frames, self.rows_per_frame * self.per_row, 3, 4), rows.dtype)
            texels[: len(frames), : rows.shape[1]] = frames
            facts = {"file": f"{name}_matrices_{number}.exr", "first_frame": start, "frames": len(frames)}
            yield facts, texels.reshape(self.height, self.width, 4)

    def pivots(self, pivots: np.ndarray) -> np.ndarray:
        texels = np.zeros((self.rows_per_frame * self.per_row, 3), np.float32)
        texels[: len(pivots)] = pivots
        return texels.reshape(self.rows_per_frame, self.per_row, 3)

    def places(self, vertex_node: np.ndarray) -> np.ndarray:
        """Return (N, 2): the middle of the first texel of each vertex's node in frame 0, from 0 to 1."""
        x, y = 3 * (vertex_node % self.per_row) + 0.5, vertex_node // self.per_row + 0.5
        return np.stack([x / self.width, y / self.height], axis=1).astype(np.float32)


def _measured(
    motion: Motion, rows: np.ndarray, pivots: np.ndarray, vertex_node: np.ndarray, report: Progress
) -> tuple[float, list[float], list[float]]:
    """Return three results: the largest distance between the motion and what a shader makes of the textures, and the
    lowest and highest corner (x, y, z) of the box around all of it.
    """
    rest = np.asarray(motion.rest).astype(np.float32).astype(np.float64)
    away = np.concatenate([rest - pivots[vertex_node], np.ones((len(rest), 1))], axis=1)
    largest, low, high = 0.0, np.full(3, np.inf), np.full(3, -np.inf)
    for start, frames in motion.blocks():
        for i, frame in enumerate(frames):
            shown = rest + np.einsum("nij,nj->ni", rows[start + i].astype(np.float64)[vertex_node], away)
            low, high = np.minimum(low, shown.min(axis=0)), np.maximum(high, shown.max(axis=0))
            largest = max(largest, float(((shown - frame) ** 2).sum(axis=1).max()))
        report((start + len(frames)) / motion.frame_count)
    return float(np.sqrt(largest)), low.tolist(), high.tolist()
