"""Split clips against welded ones: what it costs that vertices which coincide are there several times.

Of every clip, and of one whose vertices are all apart with its faces split: the clip as it is, one vertex for each
place, and the clip with its vertices in random order beside the welded one in the order of first occurrence there. In a
single layer, with faces and without.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec import MotionClip
from athcodec.encoding.clip.places import find_places
from athcodec.motion.frames import Frames
from bench.clips import add_clips, add_number, add_rel_error
from bench.memory import peak_bytes
from bench.tables import table

ROOT = Path(__file__).resolve().parent.parent
RUNS = 9  # Rounds of decoding.
SEED = 1
FRAMES = 30  # Frames of the clip whose places are found.
WELDED = 1.05  # Limit of the size over the welded clip's.
TABLE = 0.25  # Bytes of the table of places for each vertex, at most, in the mesh's order.
ENTROPY = 1.2  # Limit of the table's size over its entropy in a shuffled order.
DECODING = 1.1  # Limit of the time over that of the welded clip and a gather.

NOTE = f"""
Limits of a clip in its own order: {WELDED:g} x welded + {TABLE:g} byte a vertex; of a shuffled one {WELDED:g} x welded
in the same order of first occurrence + {ENTROPY:g} x the entropy of the table of places. / limit: size over it.
Same bits: what all files give for all vertices. Decoding: over that of the welded file and one gather of its output,
by seconds of the processor, the median of {RUNS} runs in turn; the limit is {DECODING:g}.
"""
FINDING_NOTE = """
Seconds of the processor, and of them those of reading the frames once; memory is what finding added to the peak of a
process, with the blocks of frames that are read, in MB of 1,000,000 bytes.
"""


@dataclass(frozen=True)
class Mesh:
    """Positions (T, N, 3), faces (F, k), of which rows of fewer corners end with -1, or None, and seconds (T,)."""

    positions: np.ndarray
    faces: np.ndarray | None
    time: np.ndarray

    @classmethod
    def of(cls, clip: MotionClip) -> Mesh:
        """Return a clip's positions, faces and times as a mesh. Faces are rows of vertex numbers, filled up with -1."""
        rows = None
        if clip.polygons is not None:
            counts, corners = clip.polygons
            column = np.arange(counts.max())
            rows = np.full((len(counts), len(column)), -1, np.int32)
            rows[column < counts[:, None]] = corners
        return cls(clip.block(0, clip.frame_count), rows, clip.time)

    def encoded(self) -> MotionClip:
        return MotionClip(self.positions, self.time, faces=self.faces)

    def without_faces(self) -> Mesh:
        return Mesh(self.positions, None, self.time)

    def with_vertices(self, vertices: np.ndarray, number: np.ndarray) -> Mesh:
        """Return the mesh with these vertices alone. `number` (N,) is the place of each vertex among them."""
        faces = None if self.faces is None else np.where(self.faces < 0, -1, number[self.faces]).astype(np.int32)
        return Mesh(np.ascontiguousarray(self.positions[:, vertices]), faces, self.time)

    def apart(self) -> Mesh:
        """Return each face with vertices of its own."""
        is_there = self.faces >= 0
        corners = self.faces[is_there]
        faces = np.full(self.faces.shape, -1, np.int32)
        faces[is_there] = np.arange(len(corners))
        return Mesh(np.ascontiguousarray(self.positions[:, corners]), faces, self.time)

    def shuffled(self) -> Mesh:
        order = np.random.default_rng(SEED).permutation(self.positions.shape[1])
        return self.with_vertices(order, np.argsort(order))


def places_of(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the first vertex of each place, ascending, and the place (N,) of each vertex. Vertices share a place if
    they coincide in all frames; this is found by sorting all coordinates, not as the encoder finds it.
    """
    rows = np.ascontiguousarray(mesh.positions.transpose(1, 0, 2)).reshape(mesh.positions.shape[1], -1) + 0.0
    whole = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
    _, first, place = np.unique(whole, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[place.ravel()]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_number(parser, "--vertices", 1_000_000, "vertices among which places are found; 0: no such line")
    add_number(parser, "--places", 300_000, "places of these")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode meshes whose vertices are split at faces, and the same meshes with one vertex per place. Return tables of
    bytes and times, and lines about meshes that do not decode to the same bits.
    """
    rows = []
    for path in args.clips:
        with athcodec.read(path) as clip:
            source = Mesh.of(clip)
        for name, mesh in _meshes(path.stem, source):
            rows += [{"clip": name} | row for row in _rows(mesh, args.rel_error)]
            print(rows[-1], file=sys.stderr, flush=True)
    tables = [table(f"Split against welded, bound {args.rel_error:g}", rows, NOTE)]
    if args.vertices:
        tables.append(table("Finding places", [_finding(args.vertices, args.places)], FINDING_NOTE))
    broken = [f"{row['clip']}, {row['faces']}: other bits" for row in rows if not row["same bits"]]
    return {"tables": tables, "broken": broken}


def _meshes(name: str, mesh: Mesh) -> Iterator[tuple[str, Mesh]]:
    """Yield pairs of a name and a mesh: a clip in which vertices coincide as it is, any other clip with its vertices
    split; each with its faces, if it has any, and without.
    """
    first, _ = places_of(mesh)
    if len(first) == mesh.positions.shape[1]:
        if mesh.faces is None:
            raise SystemExit(f"{name}: vertices: got none at one place, and no faces to split; expected either")
        name, mesh = f"{name}, split", mesh.apart()
    if mesh.faces is not None:
        yield name, mesh
    yield name, mesh.without_faces()


def _rows(mesh: Mesh, rel_error: float) -> Iterator[dict[str, Any]]:
    """Yield rows, one for each order of the vertices, that compare a mesh whose vertices are split at faces with the
    same mesh welded to one vertex per place: bytes, the allowed bytes, decoded bits and times.
    """
    for order, split in (("own", mesh), ("shuffled", mesh.shuffled())):
        first, place = places_of(split)
        count = len(place)
        welded = split.with_vertices(first, place)
        files = [athcodec.encode(one.encoded(), rel_error=rel_error, ladder="none") for one in (split, welded)]
        share = np.bincount(place) / count
        entropy = -float((share * np.log2(share)).sum()) * count / 8
        sizes = [len(file) for file in files]
        limit = WELDED * sizes[1] + (TABLE * count if order == "own" else ENTROPY * entropy)
        same, ratio, seconds = _decoded(*files, place)
        yield {
            "faces": "yes" if split.faces is not None else "no",
            "order": order,
            "vertices": count,
            "places": len(first),
            "split": sizes[0],
            "welded": sizes[1],
            "limit": round(limit),
            "/ limit": sizes[0] / limit,
            "same bits": same,
            "decoding": ratio,
            "ms": 1e3 * seconds,
        }


def _decoded(split: bytes, welded: bytes, place: np.ndarray) -> tuple[bool, float, float]:
    """Return three results about the files of a split mesh and of the same mesh welded: whether both decode to the same
    bits, the decoding time of the split file over that of the welded one, and the former in seconds. `place` (N,) is
    the welded vertex of each vertex.
    """

    def one(data: bytes) -> np.ndarray:
        with athcodec.open(data) as decoder:
            return decoder.positions()

    times: list[tuple[float, float]] = []
    same = True
    for _ in range(RUNS):
        start = time.process_time()
        whole = one(split)
        middle = time.process_time()
        gathered = np.take(one(welded), place, axis=1)
        times.append((middle - start, time.process_time() - middle))
        same = same and whole.tobytes() == gathered.tobytes()
    split_seconds, welded_seconds = (median(column) for column in zip(*times))
    return same, split_seconds / welded_seconds, split_seconds


def _finding(vertices: int, places: int) -> dict[str, Any]:
    command = [sys.executable, "-m", "bench.split", str(vertices), str(places)]
    return json.loads(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)


# ---- the process that is measured ----


def _find(vertices: int, places: int) -> dict[str, Any]:
    """Measure the search for coinciding vertices in a random mesh of `vertices` vertices at `places` places. Return the
    seconds, the seconds of reading alone, and the memory in megabytes.
    """
    rng = np.random.default_rng(SEED)
    base = rng.random((places, 3)).astype(np.float32)
    place = np.concatenate([np.arange(places), rng.integers(0, places, vertices - places)])
    rng.shuffle(place)

    def read(start: int, stop: int) -> np.ndarray:
        return np.stack([(base + np.float32(0.01 * frame) * base[:, [1, 2, 0]])[place] for frame in range(start, stop)])

    clip = MotionClip(Frames(read, FRAMES, vertices, np.float32), np.arange(FRAMES) / 30)
    before, begun = peak_bytes(), time.process_time()
    merged = find_places(clip)
    seconds, peak = time.process_time() - begun, peak_bytes()
    begun = time.process_time()
    for _ in clip.blocks():
        pass
    figures = {"vertices": vertices, "frames": FRAMES, "places": int(merged.count), "seconds": seconds}
    return figures | {"of which reading": time.process_time() - begun, "memory": (peak - before) / 1e6}


if __name__ == "__main__":  # VERTICES PLACES
    print(json.dumps(_find(*map(int, sys.argv[1:]))))
