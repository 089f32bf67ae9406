"""File sizes per clip and error bound; the bound is verified by decoding.

Files hold only the motion: attributes, faces, edges and metadata other than unit and up axis are left out. Every file
is decoded completely and compared with the source; its size counts only if the bound holds.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path
from typing import Any

from athcodec.metrics import ErrorMeter, bits_per_vertex_frame
from athcodec.options import EFFORTS, LADDERS
from bench.clips import Encoded, add_clips, add_rel_error, encoded, measure
from bench.tables import table

REL_ERRORS = (1e-3, 1e-4, 1e-5)

SIZES_NOTE = """
Bound: largest distance of any vertex in any frame, over the diagonal of the bounding box of all frames.
Ratio: float32 positions over the whole file. RMS over the diagonal; KG in per cent; motion: RMS error over
the RMS distance from the rest pose. Rest host: bytes of the whole file where the host has the rest pose (--rest host).
"""

CHUNKS_NOTE = """
HEADER is header, chunk table and error table; AFFINES are the maps of inner nodes; AFFINES %: their share of the
file.
"""

CHOICES_NOTE = """
Rotations (step factors) and learned time bases by level.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser, REL_ERRORS)
    parser.add_argument("--effort", nargs="+", choices=EFFORTS, default=["default"], help="efforts of the encoder")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode each clip at each error bound, effort and ladder of layers, and check the errors by decoding. Return
    tables of sizes, of bytes per kind of chunk and of the encoder's choices, and lines about bounds that are not kept.
    """
    sizes, chunks, choices, broken = [], [], [], []
    for path in args.clips:
        for rel_error in args.rel_error:
            for effort, ladder in product(args.effort, LADDERS):
                case = {"clip": path.stem, "bound": f"{rel_error:g}", "effort": effort, "ladder": ladder}
                with encoded(path, rel_error, effort, LADDERS[ladder]) as result:
                    meter = measure(result.clip, result.decoder)
                with encoded(path, rel_error, effort, LADDERS[ladder], host_rest=True) as hosted:
                    host_bytes = hosted.summary.bytes
                sizes.append(case | _size_row(result, meter, rel_error) | {"rest host": host_bytes})
                chunks.append(case | _chunk_row(result.summary.chunk_bytes))
                choices.append(case | result.summary.choices)
                if not sizes[-1]["kept"]:
                    broken.append(_broken_line(path, rel_error, effort, meter.max_error, result))
    return {
        "tables": [
            table("Sizes", sizes, SIZES_NOTE),
            table("Bytes per kind of chunk", chunks, CHUNKS_NOTE),
            table("Choices of the encoder", choices, CHOICES_NOTE),
        ],
        "broken": broken,
    }


def _size_row(result: Encoded, meter: ErrorMeter, rel_error: float) -> dict[str, Any]:
    """Return the row of one file: bytes, compression ratio, bits per vertex and frame, its largest error over the
    bound, whether the bound is kept, and further errors. `rel_error` is the bound over the diagonal.
    """
    summary, clip = result.summary, result.clip
    # the bound in the file, and the one requested on the diagonal as measured here
    bound = min(summary.max_error_bound, rel_error * meter.diagonal)
    return {
        "bytes": summary.bytes,
        "ratio": summary.ratio,
        "bits/vertex/frame": bits_per_vertex_frame(summary.bytes, clip.frame_count, clip.vertex_count),
        "max/bound": meter.max_error / bound,
        "kept": meter.max_error <= bound,
        "RMS": meter.rms_error / meter.diagonal,
        "KG %": meter.kg_error,
        "motion": meter.motion_normalised_error,
    }


def _chunk_row(chunk_bytes: dict[str, int]) -> dict[str, Any]:
    return chunk_bytes | {"AFFINES %": 100 * chunk_bytes.get("AFFINES", 0) / sum(chunk_bytes.values())}


def _broken_line(path: Path, rel_error: float, effort: str, max_error: float, result: Encoded) -> str:
    return (
        f"{path.name} at {rel_error:g}, effort {effort}: got an error of {max_error:.6g}; "
        f"expected at most {result.summary.max_error_bound:.6g}"
    )
