"""Output of the command line: tables, JSON, one-line messages, progress."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from athcodec.decoding.decoder import Decoder
from athcodec.errors import AthError
from athcodec.files.shown import redacted, shown
from athcodec.metrics import ErrorMeter
from athcodec.options import DEFAULT_REL_ERROR
from athcodec.sources import LISTED

if TYPE_CHECKING:
    from athcodec.decoding.clip_view import ClipView
    from athcodec.decoding.file_tables import Level
    from athcodec.encoding import Seam
    from athcodec.exporters import Written

JUMP = 3
"""How many times the ways from frame to frame are what the way over a loop's seam should not be."""

LEVEL_COLUMNS = ["level", "", "nodes", "bytes", "share"]
MEASURES = ["promised_max_error", "max_error", "rms_error", "kg_error_percent", "motion_normalised_error"]
LEFT_OUT = {"left_out_edges": "an edge", "left_out_faces": "a face"}
_TABLE_WIDTH = 250  # wider than any table here: a narrow terminal wraps its lines, nothing is left out

Report = Callable[[str, float], None]


class Column(NamedTuple):
    """How a measure is shown in a table."""

    head: str
    format: str = ".3g"

    def cell(self, value: float | None) -> str:
        return "" if value is None else f"{value:{self.format}}"


TICK_RATIO = Column("tick ratio")
LOOKS = {
    "smoothness": {
        "max_second_difference": Column("max"),
        "rms_second_difference": Column("RMS"),
        "worst_share_above_bound": Column("vertices above 1", ".1%"),
        "median_share_above_bound": Column("in the median frame", ".1%"),
        "tick_ratio": TICK_RATIO,
        "source_tick_ratio": Column("source's own"),
        "acceleration_ratio": Column("over the source's"),
        "acceleration_ratio_frame": Column("in frame", "d"),
    },
    "shape": {
        "rms_stretch": Column("RMS stretch", ".2%"),
        "tail_stretch": Column("99.9 %", ".2%"),
        "rms_normal_angle": Column("RMS angle of normals (deg)"),
        "tail_normal_angle": Column("99.9 % (deg)"),
        "tail_excess_turn": Column("more turn per frame, 99.9 % (deg)"),
        "degenerate_faces": Column("degenerate", ","),
    },
}
"""What is shown of a level beside its errors, by the names of MotionMeter.figures."""


def echo(text: str, *, file: TextIO | None = None, flush: bool = False) -> None:
    """Print lines of text, as `shown`."""
    print(shown(text), file=file, flush=flush)


def print_files(facts: list[dict[str, Any]], as_json: bool) -> None:
    """Return the facts of a file, or of each motion of a GLB."""
    if as_json:
        print_json(facts[0] if len(facts) == 1 else {"motions": facts})
        return
    for each in facts:
        _print_facts(each)


def facts_of(
    path: str | Path, decoder: Decoder, tick_ratios: Sequence[Sequence[float | None]] | None = None
) -> dict[str, Any]:
    """decoder.file.info(), and per level what it adds to the file cut before it. tick_ratios: of each clip at each
    level, where they were measured."""
    facts = {"file": os.fspath(path)} | decoder.file.info()
    facts |= {"unit": decoder.metadata.get("unit"), "missing": decoder.file.missing}
    facts["raw_bytes"] = facts["frames"] * decoder.file.vertex_count * 12
    facts["ratio"] = facts["raw_bytes"] / facts["bytes"]
    before = decoder.file.prelude_length
    for level in facts["levels"]:
        level["added_bytes"] = level["bytes"] - before
        level["share"] = level["added_bytes"] / facts["bytes"]
        before = level["bytes"]
    for clip, ratios in zip(facts["clips"], tick_ratios or ()):
        clip["tick_ratios"] = list(ratios)
    for level, ratios in zip(facts["levels"], zip(*(tick_ratios or ()))):
        level["tick_ratio"] = max((ratio for ratio in ratios if ratio is not None), default=None)
    return facts


def _print_facts(facts: dict[str, Any]) -> None:
    ath = facts["ath"]
    rate = f" at {facts['fps']:.6g} per second" if facts["fps"] else ""
    echo(
        f"{facts['file']}: {counted(facts['vertices'], 'vertex', 'vertices')} on "
        f"{counted(facts['branches'], 'branch', 'branches')}, {counted(facts['frames'], 'frame')}{rate} in "
        f"{counted(facts['segments'], 'segment')}, format {facts['format']}"
    )
    thresholds = ""
    if "epsilon" in ath:
        thresholds = f"; epsilon {ath['epsilon']:.2g}, eta {ath['eta']}, xi {ath['xi']:.2g}, lambda {ath['lam']}"
    echo(
        f"ATH: depth {ath['depth']}, {counted(ath['nodes'], 'node')}, "
        f"{counted(ath['leaves'], 'leaf', 'leaves')} among them{thresholds}"
    )
    unit = f" {facts['unit']}" if facts["unit"] else ""
    share = facts["predicted_error_share"]
    held = "" if share is None else f", errors of predicted motion held to {share:.2g} of it"
    echo(f"Error bound: {facts['max_error_bound']:.4g}{unit}{held}. {_size(facts)}")
    echo(f"Rest pose: {_rest(facts)}.")
    if len(facts["levels"]) < facts["full_level_count"]:
        echo(f"Holds levels 0 to {len(facts['levels']) - 1} of 0 to {facts['full_level_count'] - 1}.")
    if facts["missing"]:
        echo(f"{facts['available_bytes']:,} bytes are there; missing {facts['missing']}.")
    if (
        len(facts["clips"]) > 1
        or facts["clips"][0]["name"]
        or any(facts["clips"][0][key] for key in ("loop", "wind", "transitions"))
    ):
        _print_clips(facts)
    for clip in facts["clips"]:
        _print_presence(clip)
    _print_levels(facts)


def _print_presence(clip: dict[str, Any]) -> None:
    """The objects that some frame does not show, the first `LISTED` of them, and the frames that do."""
    named = [
        f"{name} in {', '.join(f'{first} to {stop - 1}' for first, stop in runs) or 'none'}"
        for name, runs in list(clip["presence"].items())[:LISTED]
    ]
    if named:
        more = len(clip["presence"]) - len(named)
        of_clip = f" of {clip['name']}" if clip["name"] else ""
        echo(f"Shown in some frames{of_clip} only: {'; '.join(named)}{f'; and {more:,} more' if more else ''}.")


def _rest(facts: dict[str, Any]) -> str:
    """Where it is, and what it takes."""
    if facts["host_mesh"]:
        vertices = counted(facts["vertices"], "vertex", "vertices")
        return f"a mesh of {vertices} that the host has, checksum {facts['host_mesh']['checksum']}"
    return f"{facts['rest_bytes']:,} bytes of these"


def _print_clips(facts: dict[str, Any]) -> None:
    """Errors at the seam are those of the deepest stored level."""
    rows = [
        [
            clip["name"],
            f"{clip['frames']:,}",
            f"{clip['seconds']:.4g}",
            f"{clip['segments']:,}",
            f"{clip['wind']['strength']:g} to {clip['wind']['heading']:g}°" if clip["wind"] else "",
            f"{clip['transitions']:,}" if clip["transitions"] else "",
            f"{clip['seam_errors'][len(facts['levels']) - 1]:.3g}" if clip["loop"] else "",
            *(f"{error:.3g}" for error in clip["max_errors"]),
        ]
        for clip in facts["clips"]
    ]
    levels = [f"max at {level}" for level in range(len(facts["levels"]))]
    seam = _head("loop's seam", facts["unit"])
    print_table(["clip", "frames", "seconds", "segments", "wind", "transitions", seam, *levels], rows)


def _print_levels(facts: dict[str, Any]) -> None:
    measures = {"max": "max_error", "99 %": "p99_error", "RMS": "rms_error"}
    columns = ["bytes so far", *(_head(f"{name} error", facts["unit"]) for name in measures)]
    cells = [
        [f"{level['bytes']:,}", *(f"{level[field]:.3g}" for field in measures.values())] for level in facts["levels"]
    ]
    if "tick_ratio" in facts["levels"][0]:
        columns.append(TICK_RATIO.head)
        for row, level in zip(cells, facts["levels"], strict=True):
            row.append(TICK_RATIO.cell(level["tick_ratio"]))
    print_table([*LEVEL_COLUMNS, *columns], _level_rows(facts, cells))


def _level_rows(facts: dict[str, Any], cells: Sequence[Sequence[str]]) -> list[list[str]]:
    """One row per level, ending in its `cells`, between what the file holds before and behind them."""
    levels, total = facts["levels"], facts["bytes"]

    def row(level: str, name: str, nodes: str, size: int) -> list[str]:
        return [level, name, nodes, f"{size:,}", f"{size / total:.1%}"]

    rows = [row("prelude", "", "", levels[0]["bytes"] - levels[0]["added_bytes"])]
    for level, more in zip(levels, cells, strict=True):
        name = level["name"] if level["available"] else f"{level['name']} (incomplete)"
        rows.append(row(f"{level['level']}", name, f"{level['nodes']:,}", level["added_bytes"]) + list(more))
    behind = total - levels[-1]["bytes"]
    return [*rows, row("arrays", "", "", behind)] if behind else rows


def print_demo(facts: dict[str, Any], meters: Sequence[ErrorMeter]) -> None:
    seconds = facts["frames"] / facts["fps"]
    columns = [*(_head(name, facts["unit"]) for name in ("max", "RMS")), "max/diag", "RMS/diag", "B/s"]
    cells = []
    for level, meter in zip(facts["levels"], meters, strict=True):
        errors = [f"{meter.max_error:.3g}", f"{meter.rms_error:.3g}"]
        relative = [f"{error / meter.diagonal:.1e}" for error in (meter.max_error, meter.rms_error)]
        cells.append([*errors, *relative, f"{level['bytes'] / seconds:,.0f}"])
    echo(
        f"Encoded the sample {Path(facts['file']).stem} within {DEFAULT_REL_ERROR:g} of its diagonal, "
        "decoded every level and measured it against the source:"
    )
    print_table([*LEVEL_COLUMNS, *columns], _level_rows(facts, cells))
    echo(_size(facts))


def print_written(written: Written, motion: ClipView, level: Level) -> None:
    """The files that are there now, and what their format costs."""
    names = [os.fspath(path) for path in written.files]
    error = written.facts.get("max_error")
    echo(
        f"{names[0]}{f' to {names[-1]}' if len(names) > 1 else ''}: {counted(motion.frame_count, 'frame')}, "
        f"{counted(motion.vertex_count, 'vertex', 'vertices')}, level {level.level} ({level.name})"
    )
    if error is not None:
        unit = f" {motion.metadata['unit']}" if motion.metadata.get("unit") else ""
        how, instances = written.facts.get("animation", "textures"), written.facts.get("instances")
        how += f" and {counted(instances, 'instance')}" if instances and how in ("joints", "morphs") else ""
        echo(f"As {how} that is off the level by up to {error:.3g}{unit}.")


def print_verdict(result: dict[str, Any]) -> None:
    for clip in result["clips"]:
        if clip["name"]:
            echo(f"{clip['name']}, against {clip['against']}:")
        _print_errors(clip["levels"], result["unit"])
        _print_looks(clip["levels"])
    if result["ok"]:
        sources = ", ".join(clip["against"] for clip in result["clips"])
        more = f"; every level is as close to {sources} as the file says" if sources else ""
        decodes = "every level decodes" if result["decoded"] else "nothing was decoded, which takes --host-mesh"
        echo(f"{result['file']}: whole, all checksums match, {decodes}{more}")


def _print_errors(levels: Sequence[dict[str, Any]], unit: Any) -> None:
    lengths = [_head(name, unit) for name in ("promised", "max", "RMS")]
    rows = [
        [f"{level['level']}", *(f"{level[name]:.4g}" for name in MEASURES), "yes" if level["kept"] else "NO"]
        for level in levels
    ]
    print_table(["level", *lengths, "KG (%)", "RMS/motion", "kept"], rows)


def _print_looks(levels: Sequence[dict[str, Any]]) -> None:
    """Smoothness and shape, each with the columns that the clip has something for."""
    shape = levels[0]["shape"]
    captions = {
        "smoothness": "second differences over frames, of the error in bounds; tick ratio: those of the motion near "
        "seams over those of its median frame",
        "shape": " and ".join(f"{shape[name]:,} {name}" for name in ("edges", "faces") if shape[name]),
    }
    for part, columns in LOOKS.items():
        named = [name for name in columns if any(level[part][name] is not None for level in levels)]
        rows = [[f"{level['level']}", *(columns[name].cell(level[part][name]) for name in named)] for level in levels]
        if named:
            echo(f"{part.capitalize()}: {captions[part]}")
            print_table(["level", *(columns[name].head for name in named)], rows)
    left_out = [f"{one} {shape[name]:,} times" for name, one in LEFT_OUT.items() if shape[name]]
    if left_out:
        echo(f"Left out where the source has no extent: {', '.join(left_out)}.")


def print_preview(todo: Sequence[Any], as_json: bool) -> None:
    if as_json:
        print_json(
            {
                "clips": [
                    {
                        "input": task.item.shown,
                        "output": task.item.output,
                        "settings": task.item.settings,
                        "reason": task.reason or None,
                    }
                    for task in todo
                ]
            }
        )
        return
    rows = [
        [
            task.item.name,
            task.reason or "kept",
            task.item.output,
            ", ".join(f"{name}={value}" for name, value in task.item.settings.items()) or "default",
        ]
        for task in todo
    ]
    print_table(["clip", "why", "output", "settings"], rows, "left")
    echo(f"{counted(sum(bool(task.reason) for task in todo), 'clip')} of {len(todo):,} to do.")


def print_outcome(outcome: Any, args: argparse.Namespace) -> None:
    if args.json:
        failed = [{name: record[name] for name in ("input", "output", "reason")} for record in outcome.failed]
        print_json(
            {
                "done": len(outcome.done),
                "kept": len(outcome.kept),
                "failed": failed,
                "bytes": outcome.bytes,
                "raw_bytes": outcome.raw_bytes,
                "seconds": outcome.seconds,
            }
        )
    else:
        ratio = f", {outcome.raw_bytes / outcome.bytes:.1f} to 1" if outcome.bytes else ""
        echo(
            f"{args.out}: {counted(len(outcome.done), 'clip')} done, {len(outcome.kept):,} kept, "
            f"{len(outcome.failed):,} failed; {outcome.bytes:,} bytes{ratio}, {outcome.seconds:.1f} s"
        )
    for record in outcome.done:
        if "not_read" in record:
            say("not read", f"{record['input']}: {record['not_read']}")
    for record in outcome.failed:
        say("failed", f"{record['output']}: {record['reason']}")


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], justify: str = "right") -> None:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, collapse_padding=True)
    for index, name in enumerate(columns):
        table.add_column(Text(shown(name)), justify=justify if index else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(shown(cell)) for cell in row))
    Console(file=sys.stdout, width=_TABLE_WIDTH).print(table)


def print_json(facts: dict[str, Any]) -> None:
    print(json.dumps(_finite(facts), indent=2).replace("\x7f", "\\u007f"))


def _finite(value: Any) -> Any:
    """`value` for JSON, which knows neither infinity nor NaN: they become null; URLs as people are shown them."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, str):
        return redacted(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def counted(number: int, one: str, many: str = "") -> str:
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def _head(name: str, unit: Any) -> str:
    return f"{name} ({unit})" if unit else name


def _size(facts: dict[str, Any]) -> str:
    return f"{facts['bytes']:,} bytes; the positions as float32 take {facts['raw_bytes']:,}: {facts['ratio']:.1f} to 1."


def say(kind: str, message: str) -> None:
    echo(f"athcodec: {kind}: {message}".replace("\n", " "), file=sys.stderr)


def say_seam(seam: Seam, path: str) -> None:
    jumps = seam.step > JUMP * seam.step_beside + seam.error
    say(
        "loop",
        f"{seam.clip or path}: vertices go up to {seam.step:.3g} from the last frame to the first, "
        f"{seam.step_beside:.3g} from frame to frame beside that; the file is off by {seam.error:.3g} there"
        + ("; it jumps, --loop-blend smooths it" if jumps else ""),
    )


def one_line(error: Exception) -> str:
    """Return what went wrong in one line. An error that nobody foresaw is named by its class."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    foreseen = isinstance(error, (AthError, OSError))
    return text if foreseen and text else f"{type(error).__name__}: {text} (--debug shows where)"


@contextmanager
def progress() -> Iterator[Report | None]:
    """A function for encode()'s `progress` that draws a bar on stderr; None where that is no terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def report(stage: str, fraction: float) -> None:
            if fraction < bar.tasks[task].completed:  # other work, such as measuring what was encoded
                bar.reset(task, total=1.0)
            bar.update(task, completed=fraction, description=stage)

        yield report
