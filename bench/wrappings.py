"""Bytes and errors of one clip in files that other programs open: USD, Alembic, glTF, textures, and ours in each.

Files of positions hold the source, the skin has the joints asked for, and ours keep the bound. Errors are measured by
reading each file again; those of textures are what their writer measured.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.errors import ClipError
from athcodec.exporters import Written
from athcodec.exporters.gltf_into import Into
from athcodec.metrics import ErrorMeter
from athcodec.sources import ReadOptions
from bench.clips import add_clips, add_rel_error
from bench.tables import MISSING, table

JOINTS = 1024
LAYER = '#usda 1.0\n(\n    defaultPrim = "plant"\n)\ndef "plant" (references = @{}@)\n{{\n}}\n'
NOTE = """
Bytes of all files together, with faces and branches and no other attributes. Largest error over the diagonal of all
frames. USD, Alembic and morph targets hold float32 positions of every frame, and morph targets normals of faces too.
Our bytes in USD: the .ath file and a layer that references it. In a GLB the mesh at rest is there too, with its
normals, for programs that do not know ATH_motion, and is the rest pose of the motion.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench wrappings` to a parser: clips, the error bound, and the largest number of joints."""
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument(
        "--joints",
        type=int,
        default=JOINTS,
        metavar="NUMBER",
        help="largest number of joints of a skin (default %(default)s)",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Write each clip to the files that other programs open and return the table of their bytes and errors, and lines
    about .ath files that exceed the bound.
    """
    rows, broken = [], []
    for path in args.clips:
        with tempfile.TemporaryDirectory() as folder, athcodec.read(path) as clip:
            bare = clip.replace(attributes={key: clip.attributes[key] for key in _FACES if key in clip.attributes})
            for row in _Wrappings(bare, Path(folder), args.rel_error, args.joints).rows():
                rows.append({"clip": path.stem} | row)
                if row["file"].startswith("ours") and row["max error"] > args.rel_error * (1 + 1e-3):
                    broken.append(f"{path.stem}: {row['file']}: got an error of {row['max error']:g}")
    return {"tables": [table(f"Wrappings, bound {args.rel_error:g}", rows, NOTE)], "broken": broken}


_FACES = ("face_vertex_counts", "face_vertex_indices", "part_vertex_counts", "curve_vertex_counts")


class _Wrappings:
    def __init__(self, clip: athcodec.MotionClip, folder: Path, rel_error: float, joints: int):
        self._clip, self._folder, self._bound, self._joints = clip, folder, rel_error, joints
        self._diagonal = _diagonal(clip)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each kind of file: its name, its bytes and its largest error over the diagonal. Formats that
        refuse the clip get a row with the reason.
        """
        yield self._row("float32", 12 * self._clip.frame_count * self._clip.vertex_count, 0.0)
        for name, file, options in (
            ("USD crate", "a.usdc", {}),
            ("Alembic", "a.abc", {}),
            ("GLB, morph targets", "a.glb", {"animation": "morphs"}),
            (f"GLB, skin of {self._joints:,} joints", "rig.glb", {"rig": self._joints}),
            (f"USD, UsdSkel of {self._joints:,} joints", "rig.usdc", {"rig": self._joints}),
            ("textures as OpenVAT has them, half", "a.openvat", {}),
        ):
            yield self._unless_refused(name, lambda file=file, options=options: self._exported(file, options))
        yield from self._ours()

    def _unless_refused(self, name: str, write: Callable[[], tuple[int, float]]) -> dict[str, Any]:
        try:
            return self._row(name, *write())
        except ClipError as error:
            return {"file": name, "bytes": MISSING, "of float32": MISSING, "max error": str(error).split(";")[0]}

    def _row(self, name: str, size: int, error: float) -> dict[str, Any]:
        whole = 12 * self._clip.frame_count * self._clip.vertex_count
        return {"file": name, "bytes": size, "of float32": size / whole, "max error": error}

    def _exported(self, file: str, options: dict[str, Any]) -> tuple[int, float]:
        path = self._folder / file
        written: Written = athcodec.write(self._clip, path, **options)
        if path.is_dir():
            return sum(each.stat().st_size for each in path.iterdir()), written.facts["max_error"] / self._diagonal
        return path.stat().st_size, self._error_of(path)

    def _error_of(self, path: Path) -> float:
        scene = {key: self._clip.metadata[key] for key in ("unit", "up_axis") if self._clip.metadata.get(key)}
        with athcodec.read(path, **scene) as again:
            blocks = ((start, again.block(start, start + len(block))) for start, block in self._clip.blocks())
            return _largest(self._clip, blocks) / self._diagonal

    def _ours(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the .ath file alone, of an .ath file that a USD layer references, and of a GLB with the
        motion inside.
        """
        path, settings = self._folder / "ours.ath", {"rel_error": self._bound, "rest_error": "bound", "ladder": "none"}
        athcodec.encode(self._clip, path, **settings)
        with athcodec.open(path) as decoder:
            error = _largest(self._clip, decoder.blocks()) / self._diagonal
        yield self._row("ours: .ath", path.stat().st_size, error)
        layer = LAYER.format(path.name)
        yield self._row("ours: .ath and a USD layer that references it", path.stat().st_size + len(layer), error)
        if (self._folder / "a.glb").exists():
            yield self._in_gltf(settings)

    def _in_gltf(self, settings: dict[str, Any]) -> dict[str, Any]:
        """Put the clip's motion into the GLB that was written before and return its row. `settings` are the options of
        the encoder.
        """
        path, glb = self._folder / "inside.ath", self._folder / "ours.glb"
        with Into(self._folder / "a.glb", ReadOptions()) as into:
            clip = into.clip.replace(positions=into.clip.block(0, into.clip.frame_count))
            athcodec.encode(clip, path, attributes="none", host_rest=True, **settings)
            into.write(glb, path)
        with athcodec.open(glb) as decoder:
            error = _largest(clip, decoder.blocks()) / _diagonal(clip)
        inside = path.stat().st_size
        return self._row(
            f"ours: GLB with ATH_motion, of which the motion is {inside:,} bytes", glb.stat().st_size, error
        )


def _diagonal(clip: athcodec.MotionClip) -> float:
    low, high = zip(*((block.min(axis=(0, 1)), block.max(axis=(0, 1))) for _, block in clip.blocks()))
    return float(np.linalg.norm(np.max(high, axis=0) - np.min(low, axis=0)))


def _largest(clip: athcodec.MotionClip, blocks: Iterable[tuple[int, np.ndarray]]) -> float:
    meter = ErrorMeter()
    for start, block in blocks:
        meter.add(clip.block(start, start + len(block)), block)
    return meter.max_error
