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
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from athcodec import errors
from athcodec.decoding.facts import LEVEL_COLUMNS, TICK_RATIO, Column, head, level_rows, parts_of, size_of
from athcodec.errors import AthError
from athcodec.files.shown import counted, echo, print_parts, print_table, redacted
from athcodec.options import DEFAULT_REL_ERROR
from athcodec.untyped import JsonObject, JsonValue

if TYPE_CHECKING:
    from athcodec.decoding.clip_view import ClipView
    from athcodec.decoding.file_tables import Level
    from athcodec.encoding import Seam
    from athcodec.exporters import Written
    from athcodec.motion.clip import MotionClip

JUMP = 3
"""How many times the ways from frame to frame are what the way over a loop's seam should not be."""

MEASURES = ["promised_max_error", "max_error", "rms_error", "kg_error_percent", "motion_normalised_error"]
LEFT_OUT = {"left_out_edges": "an edge", "left_out_faces": "a face"}

Report = Callable[[str, float], None]


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


def print_files(facts: list[JsonObject], as_json: bool) -> None:
    """Print the facts of a file, or of each motion of a GLB."""
    if as_json:
        print_motions(facts)
        return
    for each in facts:
        print_parts(parts_of(each))


def print_motions(results: list[JsonObject]) -> None:
    """Print the result of the only motion, or those of all of them, as JSON."""
    print_json(results[0] if len(results) == 1 else {"motions": results})


def answer(args: argparse.Namespace, facts: JsonObject, text: str) -> None:
    """Print a result as JSON, or in words if that was not asked for."""
    if args.json:
        print_json(facts)
    else:
        echo(text)


def print_demo(facts: JsonObject, diagonal: float) -> None:
    """Print the table of levels that `athcodec demo` shows. `diagonal` is the diagonal of the clip in scene units."""
    seconds = facts["frames"] / facts["fps"]
    columns = [*(head(name, facts["unit"]) for name in ("max", "RMS")), "max/diag", "RMS/diag", "B/s"]
    cells = []
    for level in facts["levels"]:
        errors = [level[f"measured_{name}_error"] for name in ("max", "rms")]
        relative = [f"{error / diagonal:.1e}" for error in errors]
        cells.append([*(f"{error:.3g}" for error in errors), *relative, f"{level['bytes'] / seconds:,.0f}"])
    echo(
        f"Encoded the sample {Path(facts['file']).stem} within {DEFAULT_REL_ERROR:g} of its diagonal, "
        "decoded every level and measured it against the source:"
    )
    print_table([*LEVEL_COLUMNS, *columns], level_rows(facts, cells))
    echo(size_of(facts))


def written_facts(written: Written, motion: ClipView | MotionClip, level: Level) -> JsonObject:
    """Return the facts about files that `athcodec decode` wrote: names, frames, vertices, level, and how much error
    their format adds."""
    counts = {"frames": motion.frame_count, "vertices": motion.vertex_count}
    facts = {
        name: written.facts[name]
        for name in ("animation", "instances", "max_error", "samples")
        if name in written.facts
    }
    named = {"level": level.level, "name": level.name, "unit": motion.metadata.get("unit")}
    return {"files": [os.fspath(path) for path in written.files]} | counts | named | facts


def print_written(facts: JsonObject) -> None:
    """Print the facts about written files that `written_facts` returns."""
    names, instances, how = facts["files"], facts.get("instances"), facts.get("animation", "textures")
    samples = f" in {counted(facts['samples'], 'sample')}" if "samples" in facts else ""
    echo(
        f"{names[0]}{f' to {names[-1]}' if len(names) > 1 else ''}: {counted(facts['frames'], 'frame')}{samples}, "
        f"{counted(facts['vertices'], 'vertex', 'vertices')}, level {facts['level']} ({facts['name']})"
    )
    if "max_error" in facts:
        how += f" and {counted(instances, 'instance')}" if instances and how in ("joints", "morphs") else ""
        unit = f" {facts['unit']}" if facts["unit"] else ""
        echo(f"Written as {how}, the motion is off this level by up to {facts['max_error']:.3g}{unit}.")


def print_verdict(result: JsonObject) -> None:
    """Print what `athcodec verify` found out about a file."""
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


def _print_errors(levels: Sequence[JsonObject], unit: JsonValue) -> None:
    lengths = [head(name, unit) for name in ("promised", "max", "RMS")]
    rows = [
        [f"{level['level']}", *(f"{level[name]:.4g}" for name in MEASURES), "yes" if level["kept"] else "NO"]
        for level in levels
    ]
    print_table(["level", *lengths, "KG (%)", "RMS/motion", "kept"], rows)


def _print_looks(levels: Sequence[JsonObject]) -> None:
    """Print the tables of smoothness and shape of all levels, with the columns for which there are values."""
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
    """Print which clips a batch would encode and why, as a table or as JSON. `todo` has an entry for each clip."""
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
    """Print the outcome of a batch: how many clips were encoded, kept and failed, and the bytes of their files; as JSON
    if `--json` was passed."""
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


def print_json(facts: JsonObject) -> None:
    print(json.dumps(_finite(facts), indent=2).replace("\x7f", "\\u007f"))


def _finite(value: JsonValue) -> JsonValue:
    """Return `value` as JSON can hold it: numbers that are infinite or NaN become None, and URLs lose their secrets."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, str):
        return redacted(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say(kind: str, message: str) -> None:
    echo(f"athcodec: {kind}: {errors.one_line(message)}", file=sys.stderr)


def say_seam(seam: Seam, path: str, unit: str | None) -> None:
    """Print how far vertices move from the last frame of a loop to its first, and whether that is a visible jump.
    `path` is the name of a clip without one, and `unit` that of lengths."""
    jumps = seam.step > JUMP * seam.step_beside + seam.error
    step, beside, error = (
        f"{length:.3g}{f' {unit}' if unit else ''}" for length in (seam.step, seam.step_beside, seam.error)
    )
    say(
        "loop",
        f"{seam.clip or path}: vertices move by up to {step} from the last frame to the first, and by up to {beside} "
        f"between the frames around them; the file's error there is up to {error}"
        + ("; the loop jumps: --loop-blend FRAMES smooths it" if jumps else ""),
    )


def one_line(error: Exception) -> str:
    """Return what went wrong in one line. An error that nobody foresaw is named by its class."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = " ".join((error.for_shell if isinstance(error, AthError) else str(error)).split())
    foreseen = isinstance(error, (AthError, OSError))
    return text if foreseen and text else f"{type(error).__name__}: {text} (--debug shows where)"


@contextmanager
def progress() -> Iterator[Report | None]:
    """Yield a function `report(phase, fraction)` that draws a progress bar on stderr, or None if stderr is no
    terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def report(phase: str, fraction: float) -> None:
            if fraction < bar.tasks[task].completed:  # other work, such as measuring what was encoded
                bar.reset(task, total=1.0)
            bar.update(task, completed=fraction, description=phase)

        yield report
