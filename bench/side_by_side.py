"""A page on which a clip and what codecs make of it move beside each other, trembling vertices lit.

One HTML file that needs nothing else: the source, then a panel for every bound and level asked for and for every
further file, in step. A vertex is lit where the second difference over frames of its error is above the bound: there it
trembles or ticks. Below, the RMS second difference of each panel over the frames, seams marked.
"""

from __future__ import annotations

import argparse
import base64
import html
import json
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.metrics import MotionMeter, edges_of, level_meters, second_differences, stem_links
from bench.clips import add_effort, add_ladder, add_segment_frames, encoded, read
from bench.tables import table

TEMPLATE = Path(__file__).with_name("side_by_side.html")
GRID, HEAT = 32767, 64
"""Positions are whole numbers up to GRID from the middle; second differences are HEAT to the bound, 255 at most."""


@dataclass
class Panel:
    """One motion of the page: (T, N, 3) positions, and what is said of it."""

    name: str
    about: str
    positions: np.ndarray
    meter: MotionMeter | None = None

    @property
    def seams(self) -> list[int]:
        return self.meter.smoothness.seams if self.meter else []


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("clip", type=Path, metavar="CLIP.h5", help="the source")
    parser.add_argument(
        "files",
        nargs="*",
        type=Path,
        metavar="FILE",
        help="further panels: an .ath file of the clip, or decoded motion in any format that athcodec reads",
    )
    parser.add_argument(
        "--rel-error",
        type=float,
        nargs="*",
        default=[1e-3],
        metavar="FRACTION",
        help="bounds over the diagonal at which to encode the clip (default 1e-3; none: only the files given)",
    )
    parser.add_argument(
        "--level", type=int, nargs="+", metavar="LEVEL", help="levels of .ath files to show (default: the deepest)"
    )
    add_ladder(parser, "decades")
    add_segment_frames(parser)
    add_effort(parser)
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="PAGE.html", help="the page to write")


def run(args: argparse.Namespace) -> dict[str, Any]:
    with read(args.clip) as clip:
        source = clip.block(0, clip.frame_count).astype(np.float64)
        panels = [Panel("Source", args.clip.name, source)]
        for rel_error in args.rel_error:
            how = {"effort": args.effort, "ladder": args.ladder, "segment_frames": args.segment_frames}
            with encoded(args.clip, rel_error, **how) as result:
                panels += _levels(result.decoder, clip, f"Bound {rel_error:g}", args.level)
        for path in args.files:
            panels += _of_file(path, clip, source, args)
        for panel in panels[1:]:
            panel.meter.add(source, panel.positions)
        text = _page(args.clip.stem, clip, panels)
    args.out.write_text(text, "utf-8")
    rows = [_row(panel) for panel in panels[1:]]
    return {"tables": [table(f"{args.out.name}: {len(text):,} bytes", rows)], "broken": []}


def _levels(
    decoder: athcodec.Decoder, clip: athcodec.MotionClip, name: str, levels: Sequence[int] | None
) -> Iterator[Panel]:
    _check(name, (decoder.frame_count, decoder.file.vertex_count), clip)
    meters = level_meters(decoder, clip)
    for number in levels or [decoder.file.deepest]:
        level = decoder.levels[number]
        positions = decoder.positions(level=number, dtype=np.float64)
        yield Panel(f"{name}, level {number}", f"{level.name}, {level.bytes:,} bytes", positions, meters[number])


def _of_file(path: Path, clip: athcodec.MotionClip, source: np.ndarray, args: argparse.Namespace) -> Iterator[Panel]:
    if path.suffix == ".ath":
        with athcodec.open(path, host_mesh=clip) as decoder:
            yield from _levels(decoder, clip, path.name, args.level)
        return
    with athcodec.read(path) as other:
        _check(path.name, (other.frame_count, other.vertex_count), clip)
        positions = other.block(0, other.frame_count).astype(np.float64)
        bound = float(np.sqrt(((positions - source) ** 2).sum(axis=2).max()))  # it says none
        yield Panel(path.name, f"{path.stat().st_size:,} bytes", positions, MotionMeter(clip, bound=bound or 1.0))


def _check(name: str, got: tuple[int, int], clip: athcodec.MotionClip) -> None:
    expected = clip.frame_count, clip.vertex_count
    if got != expected:
        raise SystemExit(f"{name}: got {got} frames and vertices, expected {expected} as of the source")


def _page(title: str, clip: athcodec.MotionClip, panels: Sequence[Panel]) -> str:
    source = panels[0].positions
    low = np.min([panel.positions.min(axis=(0, 1)) for panel in panels], axis=0)
    high = np.max([panel.positions.max(axis=(0, 1)) for panel in panels], axis=0)
    middle, half = (low + high) / 2, float((high - low).max()) / 2 or 1.0
    data = {
        "title": title,
        "frames": clip.frame_count,
        "vertices": clip.vertex_count,
        "fps": clip.fps,
        "up": clip.metadata.get("up_axis", "y"),
        "size": ((high - low) / 2 / half).tolist(),
        "grid": GRID,
        "heat": HEAT,
        "triangles": _packed(_triangles(clip).astype("<u4")),
        "links": _packed(_links(clip).astype("<u4")),
        "panels": [_panel_data(panel, source, middle, half) for panel in panels],
    }
    inside = json.dumps(data).replace("<", "\\u003c")
    page = TEMPLATE.read_text("utf-8").replace("PAGE_TITLE", html.escape(title))
    return page.replace("PAGE_DATA", inside)


def _panel_data(panel: Panel, source: np.ndarray, middle: np.ndarray, half: float) -> dict[str, Any]:
    numbers = np.rint((panel.positions - middle) / half * GRID).astype("<i2")
    data = {
        "name": panel.name,
        "about": [panel.about, *_said(panel)],
        "seams": panel.seams,
        "positions": _packed(np.diff(numbers, axis=0, prepend=np.zeros_like(numbers[:1]))),
    }
    if panel.meter is None:
        return data | {"acceleration": _series(_rms(source))}
    heat = _heat(panel.positions - source, panel.meter.bounds, 0 in panel.seams)
    return data | {"acceleration": _series(panel.meter.smoothness.acceleration), "heat": _packed(heat)}


def _said(panel: Panel) -> Iterator[str]:
    """What was measured, in lines below a panel's name."""
    if panel.meter is None:
        return
    smoothness = panel.meter.smoothness
    if smoothness.tick_ratio is not None:
        yield f"tick ratio {smoothness.tick_ratio:.3g}, the source's own {smoothness.source_tick_ratio:.3g}"
    worst, rms = smoothness.max_error_acceleration, smoothness.rms_error_acceleration
    yield f"second difference of the error: {worst:.3g} bounds at most, {rms:.3g} RMS"
    shape = panel.meter.shape
    angle = f", normals off by {shape.angle.rms:.3g} degrees" if shape.face_count else ""
    yield f"edges stretched by {shape.stretch.rms:.2%}{angle}, RMS"


def _heat(error: np.ndarray, bound: float | np.ndarray, loop: bool) -> np.ndarray:
    """(T, N) uint8: second differences of the error, HEAT for a bound."""
    around = np.concatenate([error[-1:], error, error[:1]]) if loop else np.pad(error, ((1, 1), (0, 0), (0, 0)))
    sizes = np.sqrt((second_differences(around) ** 2).sum(axis=2)) / bound
    if not loop:
        sizes[[0, -1]] = 0
    return np.minimum(np.rint(sizes * HEAT), 255).astype(np.uint8)


def _links(clip: athcodec.MotionClip) -> np.ndarray:
    """Lines to draw: those whose stretch is measured, or the vertices in their order."""
    links = edges_of(clip)
    return stem_links(np.zeros(clip.vertex_count, np.int32)) if links is None else links


def _rms(frames: np.ndarray) -> np.ndarray:
    """(T,) RMS second difference, NaN in the first and the last frame."""
    inner = np.sqrt((second_differences(frames) ** 2).sum(axis=2).mean(axis=1))
    return np.concatenate([[np.nan], inner, [np.nan]]) if len(frames) > 2 else np.full(len(frames), np.nan)


def _triangles(clip: athcodec.MotionClip) -> np.ndarray:
    """(F, 3): fans over the faces."""
    if clip.polygons is None:
        return np.empty((0, 3), int)
    counts, indices = clip.polygons
    starts = np.cumsum(counts) - counts
    fans = [
        np.stack([indices[starts[wide]], indices[starts[wide] + corner], indices[starts[wide] + corner + 1]], axis=1)
        for corner in range(1, int(counts.max(initial=0)) - 1)
        for wide in [counts > corner + 1]
    ]
    return np.concatenate(fans) if fans else np.empty((0, 3), int)


def _series(values: np.ndarray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def _packed(array: np.ndarray) -> str:
    return base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 6)).decode()


def _row(panel: Panel) -> dict[str, Any]:
    assert panel.meter is not None
    figures = panel.meter.figures()
    return {
        "panel": panel.name,
        "what": panel.about,
        "max": figures["max_error"],
        "d2 max": figures["smoothness"]["max_second_difference"],
        "d2 RMS": figures["smoothness"]["rms_second_difference"],
        "tick ratio": figures["smoothness"]["tick_ratio"],
        "source's": figures["smoothness"]["source_tick_ratio"],
        "stretch": figures["shape"]["rms_stretch"],
        "normals": figures["shape"]["rms_normal_angle"],
    }
