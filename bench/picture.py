"""A picture of the levels: one frame of a clip as decoded at each level, over the original, as SVG.

Every branch is drawn as a line along its vertices, from its attach point to its tip, in front view. Colour shows the
largest error of a branch: from black at zero to red at a tenth of the largest error of all, and above.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from bench.clips import Encoded, add_clips, add_rel_error, encoded
from bench.tables import table

PANEL, MARGIN, CAPTION, LEAST_WIDTH = 320, 16, 44, 190
FADED, NEAR, FAR = "#c9cfd6", (32, 44, 56), (214, 64, 41)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument("--out", type=Path, default=Path("bench/results/levels.svg"), metavar="FILE")
    parser.add_argument("--frame", type=int, help="frame to draw (default: the one furthest from rest)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    with encoded(args.clips[0], args.rel_error) as result:
        frame = _furthest_frame(result) if args.frame is None else args.frame
        args.out.write_text(_svg(result, frame))
        levels = len(result.decoder.levels)
        rows = [{"clip": args.clips[0].stem, "frame": frame, "levels": levels, "file": args.out.name}]
    return {"tables": [table("picture", rows, "")], "broken": []}


def _furthest_frame(result: Encoded) -> int:
    rest = np.asarray(result.clip.rest)
    motion = [np.square(block - rest).sum(axis=(1, 2)) for _, block in result.clip.blocks()]
    return int(np.concatenate(motion).argmax())


def _chains(result: Encoded) -> list[np.ndarray]:
    """Return vertices of each branch in source numbers, its attach point first."""
    hierarchy = result.decoder.file.hierarchy
    chains = []
    for first, count, attach in zip(hierarchy.first_vertex, hierarchy.stem_count, hierarchy.attach):
        stem = np.arange(first, first + count)
        chains.append(hierarchy.vertex_source[np.append(attach, stem) if attach >= 0 else stem])
    return chains


def _svg(result: Encoded, frame: int) -> str:
    """Return an SVG, as text, with a panel for each level: one frame as decoded at the level, coloured by its error,
    over the original.
    """
    chains, original = _chains(result), np.asarray(result.clip.block(frame, frame + 1)[0], float)
    shown = [result.decoder.positions(frame, level.level) for level in result.decoder.levels]
    low = np.min([points.min(axis=0) for points in (original, *shown)], axis=0)
    high = np.max([points.max(axis=0) for points in (original, *shown)], axis=0)
    up = "xyz".index(result.clip.metadata.get("up_axis", "y"))
    across = 0 if up != 0 else 1
    scale = PANEL / max(high[up] - low[up], high[across] - low[across])
    width, height = (high[across] - low[across]) * scale, (high[up] - low[up]) * scale

    panel = max(width, LEAST_WIDTH)

    def path(points: np.ndarray, chain: np.ndarray) -> str:
        x, y = (points[chain, across] - low[across]) * scale, (high[up] - points[chain, up]) * scale
        return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y))

    worst = max(np.linalg.norm(points - original, axis=1).max() for points in shown)
    panels = []
    for i, (level, points) in enumerate(zip(result.decoder.levels, shown)):
        error = np.linalg.norm(points - original, axis=1)
        behind = "".join(path(original, chain) for chain in chains)
        lines = "".join(
            f'<path d="{path(points, chain)}" stroke="{_colour(error[chain].max() / worst)}"/>' for chain in chains
        )
        caption = f"level {level.level} &#183; {level.bytes / 1000:.1f} kB"
        furthest = _length(level.max_error, result.clip.metadata.get("unit", ""))
        detail = f"{level.nodes} part{'s' * (level.nodes > 1)} &#183; max error {furthest}"
        left = MARGIN + i * (panel + MARGIN) + (panel - width) / 2
        panels.append(
            f'<g transform="translate({left:.0f} {MARGIN})">'
            f'<path d="{behind}" stroke="{FADED}"/>{lines}'
            f'<text x="{width / 2:.0f}" y="{height + 20:.0f}">{caption}</text>'
            f'<text x="{width / 2:.0f}" y="{height + 36:.0f}" class="small">{detail}</text></g>'
        )
    total = len(panels) * (panel + MARGIN) + MARGIN
    style = (
        "path{fill:none;stroke-width:1;stroke-linejoin:round}text{font:13px sans-serif;text-anchor:middle;"
        "fill:#202c38}.small{font-size:11px}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total:.0f} {height + CAPTION + MARGIN:.0f}">'
        f'<style>{style}</style><rect width="100%" height="100%" fill="#fff"/>{"".join(panels)}</svg>\n'
    )


def _length(value: float, unit: str) -> str:
    return f"{value * 1000:.3g} mm" if unit == "m" and value < 1 else f"{value:.3g} {unit}".rstrip()


def _colour(part: float) -> str:
    weight = min(1.0, part * 10)
    return "#" + "".join(f"{round(a + (b - a) * weight):02x}" for a, b in zip(NEAR, FAR))
