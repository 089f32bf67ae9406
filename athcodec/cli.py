"""The command `athcodec`: arguments, progress and printing.

Results go to stdout, as a table or with --json as one JSON object; messages and progress go to stderr,
progress only where that is a terminal. Exit codes: 0 done, 1 an error or a failed check, 2 wrong usage,
130 interrupted. An error is one line; its traceback comes with --debug. How a clip is coded is not known here
(encoder.py, decoder.py), nor what an error measure is (metrics.py).
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import os
import re
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

import athcodec
from athcodec import discovery
from athcodec.ath import Thresholds
from athcodec.clip import MotionClip
from athcodec.decoder import Decoder, Depth
from athcodec.encoder import DEFAULT_REL_ERROR, EFFORTS, Seam
from athcodec.errors import AthError, ClipError, LevelUnavailable, RemoteError
from athcodec.excerpt import Excerpt
from athcodec.files import check_target
from athcodec.hierarchy import branch_orders
from athcodec.joining import BLEND
from athcodec.metrics import ErrorMeter, compare_clips
from athcodec.transform import DEFAULT_SEGMENT, MAX_SEGMENT, MIN_SEGMENT
from athcodec.units import METRES, Length, parse_length, parse_size

INTERRUPTED, BROKEN_PIPE, TERMINATED = 130, 141, 143
"""Exit codes: 128 and the number of the signal, as shells have it."""

ROUNDING = 1e-6
"""How far, relatively, the encoder's figure of an error and that of ErrorMeter may differ."""

JUMP = 3
"""How many times the ways from frame to frame are what the way over a loop's seam should not be."""

TRACEBACK = "show the traceback of an error"
WRITTEN = "file to write; replaced when the new one is complete"
READ = 'a file or a URL, http://, https:// or another that fsspec knows (pip install "athcodec[remote]")'
LEVEL_COLUMNS = ["depth", "nodes", "bytes", "share"]
MEASURES = ["promised_max_error", "max_error", "rms_error", "kg_error_percent", "motion_normalised_error"]

DEMO_PAGE = "athcodec_demo.html"

_TABLE_WIDTH = 250  # wider than any table here: a narrow terminal wraps its lines, nothing is left out

Report = Callable[[str, float], None]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line `argv` (default: that of the process) and return its exit code.

    Raises SystemExit: code 2 for wrong usage, 0 after --help and --version, 143 when told to terminate.
    """
    args = _parser().parse_args(argv)
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file name need not be valid text
    try:
        with _termination_unwinds():
            code = args.run(args)
            sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read stdout has left. What is still buffered goes nowhere, or Python complains at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except Exception as error:
        if args.debug:
            traceback.print_exc()
        _say("error", _one_line(error))
        return 1


# ---- the verbs ----


def _encode(args: argparse.Namespace) -> int:
    paths = [args.input, *(args.paths or ())]
    output = args.output or paths.pop()
    for path in paths:
        _check_output(output, path)
    with _clip_to_encode(paths, args) as clip, _naming(paths[0]), _progress() as report:
        unit = clip.metadata.get("unit")
        summary = athcodec.encode(
            _with_branches(clip, args.hierarchy),
            output,
            segment_frames=args.segment_frames,
            tam=_thresholds(args.tam, unit),
            exact_rest=args.exact_rest, lossless=args.lossless, weights=args.weights,
            attributes=args.attributes,
            effort=args.effort,
            jobs=args.jobs,
            progress=report,
            **_bound(args, unit),
        )
    with _open(output, strict=True) as decoder:
        _print_file(output, decoder, args.json)
    for seam in summary.seams:
        _say_seam(seam, paths[0])
    return 0


def _say_seam(seam: Seam, path: str) -> None:
    jumps = seam.step > JUMP * seam.step_beside + seam.error
    _say("loop", f"{seam.clip or path}: vertices go up to {seam.step:.3g} from the last frame to the first, "
                 f"{seam.step_beside:.3g} from frame to frame beside that; the file is off by {seam.error:.3g} there"
                 + ("; it jumps, --loop-blend smooths it" if jumps else ""))


def _batch(args: argparse.Namespace) -> int:
    from athcodec import batch
    from athcodec.batch.show import show_of_terminal

    inputs = [*args.inputs, *(_listed(args.list) if args.list else ())]
    items = batch.find(inputs, args.out, settings=_batch_settings(args),
                       patterns=batch.load_settings(args.settings) if args.settings else None)
    where = {"manifest": args.manifest, "redo": args.redo}
    how = {"workers": args.workers, "scheduler": args.scheduler, "verify": args.verify}
    if args.split:
        how["split"] = args.split
    if args.dry_run:
        _print_preview(batch.preview(items, args.out, **where), args.json)
        return 0
    outcome = batch.run(items, args.out, **where, **how, show=show_of_terminal())
    _print_outcome(outcome, args)
    return 1 if outcome.failed else 0


def _listed(path: str) -> list[str]:
    """Inputs from a file, one per line; "-" is stdin."""
    with nullcontext(sys.stdin) if path == "-" else open(path, encoding="utf-8") as file:
        return [line.rstrip("\r\n") for line in file if line.strip()]


def _batch_settings(args: argparse.Namespace) -> dict[str, Any]:
    """The settings of a clip that options of the command line give."""
    from athcodec.batch.settings import BOUNDS, READING

    names = (*BOUNDS, *READING, "segment_frames", "hierarchy", "weights", "loop_blend")
    given = {name: getattr(args, name) for name in names if getattr(args, name) is not None}
    given |= {name: True for name in ("exact_rest", "lossless", "loop") if getattr(args, name)}
    given |= {name: getattr(args, name) for name, usual in (("attributes", "all"), ("effort", "default"))
              if getattr(args, name) != usual}
    if given.get("rest") == "auto":
        del given["rest"]
    if args.max_error is not None:
        given["max_error"] = str(args.max_error) if args.max_error.unit else args.max_error.value
    if args.tam is not None:
        epsilon, eta, xi, lam = args.tam
        given["tam"] = [str(epsilon), eta, str(xi), lam]
    return given


def _hierarchy(args: argparse.Namespace) -> int:
    if args.save:
        _check_output(args.save, args.input)
    with _read(args, args.input) as clip, _naming(args.input), _progress() as report:
        if report:
            report("branches", 0.0)
        found = athcodec.find_branches(clip, args.method, args.root)
    if args.save:
        discovery.save(found, args.save)
    sizes = np.bincount(found.vertex_branch)
    orders = branch_orders(found.branch_parent)
    if args.json:
        _print_json({"file": args.input, "method": found.method, "vertices": len(found.vertex_branch),
                     "branches": len(sizes), "roots": int((found.branch_parent < 0).sum()),
                     "branches_per_order": np.bincount(orders).tolist(),
                     "vertices_per_order": np.bincount(orders, sizes).astype(int).tolist(), "saved": args.save})
        return 0
    print(f"{args.input}: {found}")
    rows = [[f"{order}", f"{(orders == order).sum():,}", f"{sizes[orders == order].sum():,}"]
            for order in range(orders.max() + 1)]
    _print_table(["order", "branches", "vertices"], rows)
    if args.save:
        print(f"{args.save}: edit it, and use it with athcodec encode --hierarchy")
    return 0


def _decode(args: argparse.Namespace) -> int:
    _check_output(args.output, args.input)
    with _open(args.input, args.stats, clip=args.clip, allow_partial=args.allow_partial) as decoder:
        excerpt = _excerpt(decoder, args)
        with _progress() as report:
            athcodec.write(excerpt, args.output, args.format, progress=report, gzip=args.gzip, animation=args.animation)
        if decoder.missing:
            _say("warning", f"{args.input}: decoded to level {excerpt.depth}; {_what_is_missing(decoder)}")
        print(f"{args.output}: {excerpt.frame_count:,} frames, {excerpt.vertex_count:,} vertices, "
              f"level {excerpt.depth}")
    return 0


def _info(args: argparse.Namespace) -> int:
    with _open(args.file, args.stats) as decoder:
        _print_file(args.file, decoder, args.json)
    return 0


def _verify(args: argparse.Namespace) -> int:
    result: dict[str, Any] = {"file": args.file, "ok": False, "clips": []}
    try:
        with _open(args.file, args.stats, strict=True, clip=args.clip) as decoder, ExitStack() as opened:
            decoder.check()
            result |= {"max_error_bound": decoder.max_error_bound, "unit": decoder.metadata.get("unit")}
            for played, source, clip in _with_sources(decoder, args, opened):
                measured = {"name": played.clip.name, "against": source}
                measured["depths"] = _measure_against(played, source, clip)
                result["clips"].append(measured)
                _refuse_broken_promises(result, measured)
        result["ok"] = True
    except AthError as error:
        result["error"] = _one_line(error)
    if args.json:
        _print_json(result)
    else:
        _print_verdict(result)
    if not result["ok"]:
        _say("error", result["error"])
    return 0 if result["ok"] else 1


def _truncate(args: argparse.Namespace) -> int:
    _check_output(args.output, args.input)
    with _naming(args.input):
        athcodec.truncate(args.input, args.output, args.depth)
    before, after = (os.path.getsize(path) for path in (args.input, args.output))
    print(f"{args.output}: levels 0 to {args.depth}, {after:,} of {before:,} bytes")
    return 0


def _formats(args: argparse.Namespace) -> int:
    from athcodec import exporters, sources

    read, written = ({each.name: each for each in module.FORMATS} for module in (sources, exporters))
    rows = [{"format": name, "reads": _suffixes(read.get(name)), "writes": _suffixes(written.get(name)),
             "title": each.title, "extra": each.extra, "installed": each.is_installed}
            for name, each in (written | read).items()]
    if args.json:
        _print_json({"formats": rows})
        return 0
    cells = [[row["format"], " ".join(row["reads"]), " ".join(row["writes"]), row["title"], _needs(row)]
             for row in rows]
    _print_table(["format", "reads", "writes", "what", "needs"], cells, justify="left")
    return 0


def _suffixes(kind: Any) -> list[str]:
    return list(kind.suffixes) if kind else []


def _needs(row: dict[str, Any]) -> str:
    if not row["extra"]:
        return ""
    return f"athcodec[{row['extra']}]" + (", installed" if row["installed"] else "")


def _view(args: argparse.Namespace) -> int:
    from athcodec import view

    with _naming(args.file):
        if args.export:
            _check_output(args.export, args.file)
            print(f"{args.export}: {view.export_page(args.file, args.export, args.clip):,} bytes, opens in any browser")
            return 0
        view.serve(args.file, args.port, lambda address: _say_where(address, args.no_browser), args.clip)
    return 0


def _say_where(address: str, no_browser: bool) -> None:
    from athcodec import view

    print(f"{address} (Ctrl-C ends it)", flush=True)
    if not no_browser:
        view.open_browser(address)


def _demo(args: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory() if args.keep is None else nullcontext(args.keep) as folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        source = athcodec.sample_path()
        encoded = Path(folder, f"{source.stem}.ath")
        with athcodec.read_hdf5(source) as clip:
            with _progress() as report:
                athcodec.encode(clip, encoded, rel_error=DEFAULT_REL_ERROR, progress=report)
            with _open(encoded, strict=True) as decoder:
                meters = [_decode_and_measure(decoder, clip, encoded, d) for d in range(decoder.level_count)]
                _print_demo(_facts(encoded, decoder), meters)
        _export_demo(encoded, Path(args.keep or ".", DEMO_PAGE))
        if args.keep is not None:
            print(f"The file and its decoded levels are in {folder}.")
    return 0


def _export_demo(encoded: Path, page: Path) -> None:
    from athcodec import view

    try:
        view.export_page(encoded, page)
    except OSError as error:  # a folder that is read-only is no reason to fail at the end
        _say("warning", f"no page to look at: {_one_line(error)}")
    else:
        print(f"The sample moves in {page.resolve()}: open it in a browser.")


# ---- what they do with clips and decoders ----


def _clip_to_encode(paths: Sequence[str], args: argparse.Namespace) -> MotionClip:
    """The clip in a file, or all of several files and of their takes, as one."""
    with ExitStack() as opened:
        parts = []
        for path in paths:
            whole = opened.enter_context(_read(args, path))
            _say_takes(whole, path, args)
            parts += [(name, Path(path).stem, part) for name, part in athcodec.split(whole).items()]
        names = args.names or [name or (stem if len(parts) > 1 else "") for name, stem, _ in parts]
        loops = _checked_names(names, len(parts), args)
        clips: dict[str, MotionClip] = {}
        for name, (_, _, clip) in zip(names, parts):
            if args.rest != "auto" and clips:  # one that was made: the first clip's is as good for all
                clip = dataclasses.replace(clip, rest=next(iter(clips.values())).rest)
            clips[name] = athcodec.looped(clip, args.loop_blend) if name in loops else clip
        joined = athcodec.join(clips) if len(clips) > 1 or names != [""] else clips[""]
        opened.pop_all()
    return joined


def _checked_names(names: Sequence[str], clip_count: int, args: argparse.Namespace) -> Sequence[str]:
    """Those of the loops. ClipError where they do not fit the clips."""
    if len(names) != clip_count:
        raise ClipError(f"--names: got {len(names)}, expected {clip_count}, one for each clip")
    loops = names if args.loop == ["all"] else args.loop or []
    for name in (*loops, *({name: name for name in names if names.count(name) > 1})):
        if names.count(name) != 1:
            raise ClipError(f"clip {name!r}: got {names.count(name)} of this name, expected one (see --names)")
    if args.loop_blend and not loops:
        raise ClipError("--loop-blend: got no clips to make loops of, expected some with --loop")
    return loops


def _say_takes(clip: MotionClip, path: str, args: argparse.Namespace) -> None:
    played, others = (clip.metadata.get(name) for name in ("animations", "other_animations"))
    if others and not args.only:
        _say("takes", f"{path}: this is {', '.join(played or ['none'])}; there are {', '.join(others)} too, and "
                      "--takes all makes a clip of each")


def _excerpt(decoder: Decoder, args: argparse.Namespace) -> Excerpt:
    """What of a file is decoded: frames of a clip, or all clips."""
    if args.clip is not None or len(decoder.clips) == 1:
        return Excerpt(decoder, args.depth, _frames(args.frames, decoder.frame_count))
    if args.frames != (None, None):
        names = ", ".join(clip.name for clip in decoder.clips)
        raise ClipError(f"--frames: got several clips, {names}; expected one of them with --clip")
    return Excerpt(decoder, args.depth, all_clips=True)


def _with_sources(decoder: Decoder, args: argparse.Namespace,
                  opened: ExitStack) -> list[tuple[Decoder, str, MotionClip]]:
    """The clips to verify, and what to compare each with: a clip of a file."""
    if not args.against:
        return []
    if args.clip is not None or len(decoder.clips) == 1:
        played = [decoder]
    else:
        played = [decoder.play(clip.name) for clip in decoder.clips]
    sources = [(path, clip) for path in args.against
               for clip in athcodec.split(opened.enter_context(_read(args, path))).values()]
    if len(sources) != len(played):
        raise ClipError(f"--against: got {len(sources)} sources, expected {len(played)}, one for each clip")
    return [(each, path, clip) for each, (path, clip) in zip(played, sources)]


def _read(args: argparse.Namespace, path: str) -> MotionClip:
    """The clip in `path`, read as the options of _source_arguments say."""
    return athcodec.read(path, args.source_format, rest=getattr(args, "rest", "auto"), fps=args.fps, mesh=args.mesh,
                         field=args.field, only=args.only or (), takes=args.takes or (), unit=args.unit,
                         up_axis=args.up_axis)


@contextmanager
def _open(path: str | Path, stats: bool = False, **options: Any) -> Iterator[Decoder]:
    with _naming(path), athcodec.open(path, **options) as decoder:
        try:
            yield decoder
        finally:
            if stats:
                _say("stats", _stats(decoder))


@contextmanager
def _naming(path: str | Path) -> Iterator[None]:
    """Let the errors of the block say which file they are about."""
    try:
        yield
    except AthError as error:
        if str(error).startswith(f"{path}: ") or isinstance(error, RemoteError):
            raise
        raise type(error)(f"{path}: {error}") from error


def _with_branches(clip: MotionClip, hierarchy: str | None) -> MotionClip:
    """The clip on the branches that --hierarchy asks for: a method's, or a file's; its own without it."""
    if hierarchy is None and clip.has_branches:
        return clip
    if hierarchy is None or hierarchy == "auto" or hierarchy in discovery.METHODS:
        found = athcodec.find_branches(clip, hierarchy or "auto")
        _say("hierarchy", str(found))
    elif hierarchy.lower().endswith(".mtg"):
        from athcodec.sources.mtg import mtg_branches

        found = athcodec.Found(*mtg_branches(hierarchy, clip), "file")
    else:
        found = discovery.load(hierarchy)
    return discovery.with_branches(clip, found)


def _bound(args: argparse.Namespace, unit: Any) -> dict[str, float | int]:
    """The one keyword of encode() that says how far off the clip may be, or how large the file."""
    if args.max_error is not None:
        return {"max_error": args.max_error.in_scene_units(unit)}
    if args.target_size is not None:
        return {"target_size": args.target_size}
    return {"rel_error": args.rel_error or DEFAULT_REL_ERROR}


def _thresholds(tam: tuple[Length, int, Length, int] | None, unit: Any) -> Thresholds | None:
    if tam is None:
        return None
    epsilon, eta, xi, lam = tam
    return Thresholds(epsilon.in_scene_units(unit), eta, xi.in_scene_units(unit), lam)


def _frames(bounds: tuple[int | None, int | None], frame_count: int) -> range:
    """Frames A to B - 1 of A:B, where None is the clip's end; LevelUnavailable beyond it."""
    start = 0 if bounds[0] is None else bounds[0]
    stop = frame_count if bounds[1] is None else bounds[1]
    if not start < stop <= frame_count:
        raise LevelUnavailable(f"frames: got {start}:{stop}, expected A:B with A < B <= {frame_count}")
    return range(start, stop)


def _measure_against(decoder: Decoder, source: str, clip: MotionClip) -> list[dict[str, Any]]:
    """One entry per level: what it promises, and how far off the source it is."""
    with _naming(source), clip.watched(), _progress() as report:
        if isinstance(blend := decoder.metadata.get(BLEND), int) and BLEND not in clip.metadata:
            clip = athcodec.looped(clip, blend)
        got, expected = ((item.frame_count, item.vertex_count) for item in (clip, decoder))
        if got != expected:
            raise ClipError(f"got {got} frames and vertices, expected {expected} as in the .ath file")
        weights = decoder.error_weights
        meters = [ErrorMeter(clip.rest, weights) for _ in decoder.depths]
        for start, stop in decoder.segments:
            reference = clip.block(start, stop)
            for depth, meter in enumerate(meters):
                meter.add(reference, decoder.positions(slice(start, stop), depth))
            if report:
                report("measure", stop / clip.frame_count)
    levels = [_measured(level, meter) for level, meter in zip(decoder.depths, meters, strict=True)]
    if weights is not None:
        promised = decoder.max_error_bound / float(weights.max())
        levels[-1]["kept"] &= meters[-1].max_weighted_error <= promised * (1 + ROUNDING)
    return levels


def _measured(level: Depth, meter: ErrorMeter) -> dict[str, Any]:
    return {
        "depth": level.depth,
        "promised_max_error": level.max_error,
        "max_error": meter.max_error,
        "rms_error": meter.rms_error,
        "kg_error_percent": meter.kg_error,
        "motion_normalised_error": meter.motion_normalised_error,
        "kept": meter.max_error <= level.max_error * (1 + ROUNDING),
    }


def _refuse_broken_promises(result: dict[str, Any], measured: dict[str, Any]) -> None:
    levels = measured["depths"]
    broken = [(level, level["promised_max_error"]) for level in levels if not level["kept"]]
    if levels[-1]["max_error"] > result["max_error_bound"]:
        broken.append((levels[-1], result["max_error_bound"]))
    for level, promised in broken[:1]:
        raise AthError(
            f"{result['file']}: level {level['depth']}: got max error {level['max_error']:.6g} against "
            f"{measured['against']}, expected at most {promised:.6g}"
        )


def _decode_and_measure(decoder: Decoder, clip: MotionClip, encoded: Path, depth: int) -> ErrorMeter:
    decoded = encoded.with_name(f"{encoded.stem}_level_{depth}.h5")
    athcodec.write(Excerpt(decoder, depth), decoded)
    with athcodec.read_hdf5(decoded) as again:
        return compare_clips(clip, again)


def _check_output(path: str, source: str) -> None:
    """Refuse, before any work, what can only fail after it, and what would destroy the input."""
    check_target(path)
    if os.path.exists(path) and os.path.exists(source) and os.path.samefile(path, source):
        raise FileExistsError(f"{path}: is the input, expected another file name")


def _stats(decoder: Decoder) -> str:
    """What was read of a file, and what that asked of a server."""
    requests = getattr(decoder.source, "requests", None)
    if requests is None:
        return f"{decoder.bytes_read:,} bytes read of {decoder.file_length:,}"
    return f"{_count(requests, 'request')}, {decoder.source.bytes:,} bytes fetched of {decoder.file_length:,}"


def _what_is_missing(decoder: Decoder) -> str:
    if decoder.complete:
        return decoder.missing
    got, expected = decoder.info()["available_bytes"], decoder.file_length
    return f"cut off at {got:,} of {expected:,} bytes; missing {decoder.missing}"


# ---- printing ----


def _print_file(path: str, decoder: Decoder, as_json: bool) -> None:
    facts = _facts(path, decoder)
    if as_json:
        _print_json(facts)
    else:
        _print_facts(facts)


def _facts(path: str | Path, decoder: Decoder) -> dict[str, Any]:
    """decoder.info(), and per level what it adds to the file cut before it."""
    facts = {"file": os.fspath(path)} | decoder.info()
    facts |= {"unit": decoder.metadata.get("unit"), "missing": decoder.missing}
    facts["raw_bytes"] = facts["frames"] * decoder.vertex_count * 12
    facts["ratio"] = facts["raw_bytes"] / facts["bytes"]
    before = decoder.container.prelude_length
    for level in facts["depths"]:
        level["added_bytes"] = level["bytes"] - before
        level["share"] = level["added_bytes"] / facts["bytes"]
        before = level["bytes"]
    return facts


def _print_facts(facts: dict[str, Any]) -> None:
    ath = facts["ath"]
    rate = f" at {facts['fps']:.6g} per second" if facts["fps"] else ""
    print(
        f"{facts['file']}: {_count(facts['vertices'], 'vertex', 'vertices')} on "
        f"{_count(facts['branches'], 'branch', 'branches')}, {_count(facts['frames'], 'frame')}{rate} in "
        f"{_count(facts['segments'], 'segment')}, format {facts['format']}"
    )
    print(
        f"ATH: depth {ath['depth']}, {_count(ath['nodes'], 'node')}, {ath['leaves']:,} of them leaves; "
        f"epsilon {ath['epsilon']:g}, eta {ath['eta']}, xi {ath['xi']:g}, lambda {ath['lam']}"
    )
    unit = f" {facts['unit']}" if facts["unit"] else ""
    print(f"Error bound: {facts['max_error_bound']:.4g}{unit}. {_size(facts)}")
    if facts["levels"] < facts["full_levels"]:
        print(f"Holds levels 0 to {facts['levels'] - 1} of 0 to {facts['full_levels'] - 1}.")
    if facts["missing"]:
        print(f"{facts['available_bytes']:,} bytes are there; missing {facts['missing']}.")
    if len(facts["clips"]) > 1 or facts["clips"][0]["name"] or facts["clips"][0]["loop"]:
        _print_clips(facts)
    _print_levels(facts)


def _print_clips(facts: dict[str, Any]) -> None:
    """Errors at the seam are those of the deepest stored level."""
    rows = [[clip["name"], f"{clip['frames']:,}", f"{clip['seconds']:.4g}", f"{clip['segments']:,}",
             f"{clip['seam_errors'][facts['levels'] - 1]:.3g}" if clip["loop"] else "",
             *(f"{error:.3g}" for error in clip["max_errors"])] for clip in facts["clips"]]
    levels = [f"max at {level}" for level in range(facts["levels"])]
    _print_table(["clip", "frames", "seconds", "segments", _head("loop's seam", facts["unit"]), *levels], rows)


def _print_levels(facts: dict[str, Any]) -> None:
    columns = ["bytes so far", _head("max error", facts["unit"]), _head("RMS error", facts["unit"])]
    cells = [
        [f"{level['bytes']:,}", f"{level['max_error']:.3g}", f"{level['rms_error']:.3g}"]
        for level in facts["depths"]
    ]
    _print_table([*LEVEL_COLUMNS, *columns], _level_rows(facts, cells))


def _level_rows(facts: dict[str, Any], cells: Sequence[Sequence[str]]) -> list[list[str]]:
    """One row per level, ending in its `cells`, between what the file holds before and behind them."""
    levels, total = facts["depths"], facts["bytes"]

    def row(name: str, nodes: str, size: int) -> list[str]:
        return [name, nodes, f"{size:,}", f"{size / total:.1%}"]

    rows = [row("prelude", "", levels[0]["bytes"] - levels[0]["added_bytes"])]
    for level, more in zip(levels, cells, strict=True):
        name = f"{level['depth']}" if level["available"] else f"{level['depth']} (incomplete)"
        rows.append(row(name, f"{level['nodes']:,}", level["added_bytes"]) + list(more))
    behind = total - levels[-1]["bytes"]
    return [*rows, row("arrays", "", behind)] if behind else rows


def _print_demo(facts: dict[str, Any], meters: Sequence[ErrorMeter]) -> None:
    seconds = facts["frames"] / facts["fps"]
    columns = [*(_head(name, facts["unit"]) for name in ("max", "RMS")), "max/diag", "RMS/diag", "B/s"]
    cells = []
    for level, meter in zip(facts["depths"], meters, strict=True):
        errors = [f"{meter.max_error:.3g}", f"{meter.rms_error:.3g}"]
        relative = [f"{error / meter.diagonal:.1e}" for error in (meter.max_error, meter.rms_error)]
        cells.append([*errors, *relative, f"{level['bytes'] / seconds:,.0f}"])
    print(
        f"Encoded the sample {Path(facts['file']).stem} within {DEFAULT_REL_ERROR:g} of its diagonal, "
        "decoded every depth and measured it against the source:"
    )
    _print_table([*LEVEL_COLUMNS, *columns], _level_rows(facts, cells))
    print(_size(facts))


def _print_verdict(result: dict[str, Any]) -> None:
    for clip in result["clips"]:
        if clip["name"]:
            print(f"{clip['name']}, against {clip['against']}:")
        lengths = [_head(name, result["unit"]) for name in ("promised", "max", "RMS")]
        rows = []
        for level in clip["depths"]:
            measures = [f"{level[name]:.4g}" for name in MEASURES]
            rows.append([f"{level['depth']}", *measures, "yes" if level["kept"] else "NO"])
        _print_table(["depth", *lengths, "KG (%)", "RMS/motion", "kept"], rows)
    if result["ok"]:
        sources = ", ".join(clip["against"] for clip in result["clips"])
        more = f"; every depth is as close to {sources} as the file says" if sources else ""
        print(f"{result['file']}: whole, all checksums match, every level decodes{more}")


def _print_preview(todo: Sequence[Any], as_json: bool) -> None:
    if as_json:
        _print_json({"clips": [{"input": each.item.shown, "output": each.item.output, "settings": each.item.settings,
                                "reason": each.reason or None} for each in todo]})
        return
    rows = [[each.item.name, each.reason or "kept", each.item.output,
             ", ".join(f"{name}={value}" for name, value in each.item.settings.items()) or "default"] for each in todo]
    _print_table(["clip", "why", "output", "settings"], rows, "left")
    print(f"{_count(sum(bool(each.reason) for each in todo), 'clip')} of {len(todo):,} to do.")


def _print_outcome(outcome: Any, args: argparse.Namespace) -> None:
    if args.json:
        failed = [{name: record[name] for name in ("input", "output", "reason")} for record in outcome.failed]
        _print_json({"done": len(outcome.done), "kept": len(outcome.kept), "failed": failed, "bytes": outcome.bytes,
                     "raw_bytes": outcome.raw_bytes, "seconds": outcome.seconds})
    else:
        ratio = f", {outcome.raw_bytes / outcome.bytes:.1f} to 1" if outcome.bytes else ""
        print(f"{args.out}: {_count(len(outcome.done), 'clip')} done, {len(outcome.kept):,} kept, "
              f"{len(outcome.failed):,} failed; {outcome.bytes:,} bytes{ratio}, {outcome.seconds:.1f} s")
    for record in outcome.failed:
        _say("failed", f"{record['output']}: {record['reason']}")


def _print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], justify: str = "right") -> None:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, collapse_padding=True)
    for index, name in enumerate(columns):
        table.add_column(Text(name), justify=justify if index else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    Console(file=sys.stdout, width=_TABLE_WIDTH).print(table)


def _print_json(facts: dict[str, Any]) -> None:
    print(json.dumps(_finite(facts), indent=2))


def _finite(value: Any) -> Any:
    """`value` for JSON, which knows neither infinity nor NaN: they become null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def _head(name: str, unit: Any) -> str:
    return f"{name} ({unit})" if unit else name


def _size(facts: dict[str, Any]) -> str:
    return (
        f"{facts['bytes']:,} bytes; the positions as float32 take {facts['raw_bytes']:,}: "
        f"{facts['ratio']:.1f} to 1."
    )


def _say(kind: str, message: str) -> None:
    print(f"athcodec: {kind}: {message}", file=sys.stderr)


def _one_line(error: Exception) -> str:
    """What went wrong, where, got, expected. An error that nobody foresaw is named by its class."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    foreseen = isinstance(error, (AthError, OSError))
    return text if foreseen and text else f"{type(error).__name__}: {text} (--debug shows where)"


# ---- the process ----


@contextmanager
def _progress() -> Iterator[Report | None]:
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


@contextmanager
def _termination_unwinds() -> Iterator[None]:
    """Let SIGTERM end the block as an exception does, so that unfinished files are removed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


# ---- arguments ----


def _parser() -> argparse.ArgumentParser:
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=TRACEBACK)
    parser = argparse.ArgumentParser(
        prog="athcodec",
        description="A codec for plant motion: levels of detail over its branches, within an error bound.",
        epilog="athcodec VERB --help explains a verb. Exit codes: 0 done, 1 error or failed check, 2 usage.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"athcodec {athcodec.__version__}")
    parser.add_argument("--debug", action="store_true", help=TRACEBACK)
    verbs = parser.add_subparsers(metavar="VERB", required=True)

    def verb(name: str, run: Callable, text: str, more: str = "") -> argparse.ArgumentParser:
        description = f"{text[0].upper()}{text[1:]}. {more}"
        sub = verbs.add_parser(name, parents=[shared], allow_abbrev=False, help=text, description=description)
        sub.set_defaults(run=run)
        return sub

    _encode_arguments(verb(
        "encode", _encode, "compress a motion into an .ath file",
        f"Without one of the first three options it is --rel-error {DEFAULT_REL_ERROR:g}.",
    ))
    _batch_arguments(verb(
        "batch", _batch, "compress many motions, by several processes",
        "An interrupted run goes on where it ended when the command is given again. Exit code 1 where a clip failed; "
        "the others are done all the same.",
    ))
    _decode_arguments(verb(
        "decode", _decode, "write the motion of an .ath file in another format",
        "A file that was cut off is decoded to its deepest complete level, with a warning.",
    ))
    _info_arguments(verb("info", _info, "show what an .ath file holds, level by level"))
    _verify_arguments(verb(
        "verify", _verify, "check that an .ath file is whole and undamaged, and how far off its source it is",
        "Exit code 1 where a checksum fails, the file is cut off, or a level is further off than it says.",
    ))
    _truncate_arguments(verb("truncate", _truncate, "leave out the levels beyond a depth, without decoding"))
    _hierarchy_arguments(verb(
        "hierarchy", _hierarchy, "find the branches of a source that names none",
        "Encoding does so by itself; here the result is shown, and saved to be edited.",
    ))
    formats = verb("formats", _formats, "list the formats that are read and written, and what each needs")
    formats.add_argument("--json", action="store_true", help="print as JSON")
    _view_arguments(verb(
        "view", _view, "play an .ath file in a browser",
        "Serves the viewer on this computer only, until it is interrupted.",
    ))
    _demo_arguments(verb(
        "demo", _demo, "encode the included sample, decode and measure every depth",
        f"Ends with a page that shows it, {DEMO_PAGE}, in DIR or in the current folder.",
    ))
    return parser


def _encode_arguments(verb: argparse.ArgumentParser) -> None:
    verb.usage = "athcodec encode IN [IN ...] OUT.ath [options]"
    verb.add_argument("input", metavar="IN", help="a clip in one of the formats that `athcodec formats` lists; several "
                      "of one plant share their hierarchy and rest pose in the file")
    verb.add_argument("paths", metavar="OUT.ath", nargs="+", help=WRITTEN)
    verb.add_argument("-o", "--output", metavar="OUT.ath", action=_Output, help="the same, with all of IN in front of it or "
                      "behind")
    verb.add_argument("--names", metavar="NAME,...", type=_argument(_names),
                      help="of the clips (default: their own, such as those of takes; else, of several, their files' "
                      "names without suffix)")
    verb.add_argument("--loop", metavar="NAME,...", type=_argument(_names),
                      help="clips that are loops, their first frame following their last; all: every one")
    verb.add_argument("--loop-blend", metavar="FRAMES", type=_argument(_whole), default=0,
                      help="for loops that do not end where they began: take so many frames off their end and blend them "
                      "into those at their beginning")
    _source_arguments(verb)
    _coding_arguments(verb)
    verb.add_argument("--jobs", metavar="N", type=_argument(_jobs), help="threads (default: one per core, at most 4, "
                      "fewer for large meshes); the file is the same whatever their number")
    verb.add_argument("--json", action="store_true", help="print the result as JSON")


class _Output(argparse.Action):
    """Says where to, so that no further path has to."""

    def __call__(self, parser: argparse.ArgumentParser, args: argparse.Namespace, value: Any, option: Any = None) -> None:
        args.output = value
        next(action for action in parser._actions if action.dest == "paths").required = False


def _batch_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("inputs", metavar="IN", nargs="*", help="files, directories, patterns such as 'trees/**/*.h5', "
                      "or URLs of them that fsspec knows (a directory's ends in a slash)")
    verb.add_argument("--list", metavar="FILE", help="a file with further inputs, one per line; - is stdin")
    verb.add_argument("--out", metavar="DIR", required=True, help="directory of the .ath files and of the manifest, or the "
                      "URL of one that fsspec can write to")
    verb.add_argument("--settings", metavar="FILE.toml", help='settings by pattern of the clip\'s name: ["oaks/*"] and '
                      'below it options of encode, such as max_error = "1mm"; they come before those given here')
    verb.add_argument("--workers", metavar="N", type=_argument(_jobs), help="processes (default: one per core)")
    verb.add_argument("--scheduler", metavar="ADDRESS", help="of a running Dask cluster that sees the same paths, in "
                      "place of processes on this machine")
    verb.add_argument("--split", metavar="SEGMENTS", type=_argument(_jobs), help="clips of more segments are "
                      "coded so many at a time by whatever worker is free (default 4)")
    verb.add_argument("--manifest", metavar="FILE.jsonl", help="what is done and what failed (default: "
                      "athcodec-batch.jsonl in DIR; needed where that is a URL)")
    verb.add_argument("--redo", action="store_true", help="encode everything again")
    verb.add_argument("--verify", action="store_true", help="decode every level of a file before it counts as done")
    verb.add_argument("--dry-run", action="store_true", help="only say what would be done with each clip, and why")
    verb.add_argument("--loop", action="store_true", help="mark clips as loops, their first frame following their last")
    verb.add_argument("--loop-blend", metavar="FRAMES", type=_argument(_whole), help="make loops of clips that do not "
                      "end where they began: take so many frames off their end and blend them into those at their "
                      "beginning")
    _source_arguments(verb)
    _coding_arguments(verb)
    verb.add_argument("--json", action="store_true", help="print the result as JSON")


def _coding_arguments(verb: argparse.ArgumentParser) -> None:
    bound = verb.add_mutually_exclusive_group()
    bound.add_argument(
        "--max-error", metavar="LENGTH", type=_argument(_positive_length),
        help="largest distance of any vertex in any frame from the source: in scene units, or 1mm, 0.5cm, "
        f"2in ({', '.join(METRES)}) where the clip says its unit",
    )
    bound.add_argument(
        "--rel-error", metavar="FRACTION", type=_argument(_fraction),
        help="the same as a fraction of the diagonal of the bounding box over all frames "
        f"(default {DEFAULT_REL_ERROR:g})",
    )
    bound.add_argument(
        "--target-size", metavar="SIZE", type=_argument(parse_size),
        help="the smallest error whose file is not larger: bytes, 50kB, 1.5MB (1 kB = 1,000 bytes), 48KiB",
    )
    verb.add_argument(
        "--segment-frames", metavar="FRAMES", type=_argument(_segment_frames),
        help=f"longest segment, {MIN_SEGMENT} to {MAX_SEGMENT} frames (default {DEFAULT_SEGMENT}); what is "
        "decoded at once, so shorter ones seek faster and make larger files",
    )
    verb.add_argument(
        "--tam", metavar="EPS,ETA,XI,LAMBDA", type=_argument(_tam),
        help="which subtrees move as one below the last level: thresholds of the paper's test, EPS and XI "
        "lengths, ETA frames, LAMBDA vertices (default: those that the error bound allows)",
    )
    verb.add_argument(
        "--hierarchy", metavar="FILE|METHOD", help="branches from a file of `athcodec hierarchy --save` or a .mtg, or "
        f"found by auto, {', '.join(discovery.METHODS)} (default: the source's own, else auto)",
    )
    verb.add_argument("--exact-rest", action="store_true", help="keep the rest pose bit for bit")
    verb.add_argument("--lossless", action="store_true",
                      help="one more level gives positions and rest pose bit for bit; the bound is for the one before")
    verb.add_argument("--weights", metavar="NAME", help="attribute with a factor on the bound for each vertex: 4 where "
                      "it may be four times as far off")
    verb.add_argument(
        "--attributes", choices=("all", "none"), default="all",
        help="keep edges, faces, metadata and all named arrays, or only unit and up axis (default all)",
    )
    verb.add_argument(
        "--effort", choices=EFFORTS, default="default",
        help="how long to look for a smaller file (default: default)",
    )
    verb.add_argument(
        "--rest", choices=("auto", "first", "mean"), default="auto",
        help="rest pose: the file's (the first frame where it has none), the first frame, or the mean of all "
        "(default auto)",
    )


def _source_arguments(verb: argparse.ArgumentParser) -> None:
    source = verb.add_argument_group("reading the source")
    source.add_argument("--source-format", metavar="NAME",
                        help="of `athcodec formats` (default: known by the file's content and suffix)")
    source.add_argument("--fps", metavar="RATE", type=_argument(_rate),
                        help="frames per second, a number or a fraction such as 24000/1001: the rate at which curves "
                        "are sampled, or that of a source that does not say its own")
    source.add_argument("--mesh", metavar="FILE", help="the mesh of a point cache: OBJ, PLY or GLB")
    source.add_argument("--field", metavar="NAME", help="the displacement of a finite-element result")
    source.add_argument("--only", metavar="PATTERN", action="append",
                        help="read the prims, objects or meshes of these names only; may be repeated")
    source.add_argument("--takes", metavar="NAME,...", type=_argument(_names),
                        help="read these animations of a glTF file, each as a clip of its own; all: every one "
                        "(default: the one that players begin with)")
    source.add_argument("--unit", metavar="UNIT", help="unit of length to convert to, or that of a source without one")
    source.add_argument("--up-axis", choices=("x", "y", "z"), help="axis to turn up, or that of a source without one")


def _decode_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("input", metavar="IN.ath", help=READ)
    verb.add_argument("output", metavar="OUT", help=f"{WRITTEN}; its suffix says the format, see `athcodec formats`")
    verb.add_argument("--format", metavar="NAME", help="write this format whatever the suffix")
    verb.add_argument("--clip", metavar="NAME", help="the clip to decode; without it glTF holds all of a file that "
                      "has several, as animations of their names")
    _stats_argument(verb)
    verb.add_argument(
        "--depth", metavar="LEVEL", type=_argument(_whole),
        help="level of detail, from 0, the whole plant as one piece (default: the deepest complete one)",
    )
    verb.add_argument(
        "--frames", metavar="A:B", type=_argument(_frame_bounds), default=(None, None),
        help="frames A to B - 1, counted from 0; A: to the end, :B from the start (default: all)",
    )
    verb.add_argument("--gzip", action="store_true", help="compress where the format can: smaller, slower, no loss")
    verb.add_argument("--animation", choices=("auto", "joints", "morphs"), default="auto",
                      help="how glTF moves (default auto: joints where they keep within the file's error)")
    verb.add_argument(
        "--allow-partial", action="store_true",
        help="leave out a damaged level and those beyond it instead of giving up",
    )


def _stats_argument(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--stats", action="store_true", help="say on stderr how many requests and bytes it took")


def _hierarchy_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("input", metavar="IN", help="a clip in one of the formats that `athcodec formats` lists")
    verb.add_argument("--method", choices=("auto", *discovery.METHODS), default="auto",
                      help="by attributes named like branch ids, the joints of a skin, an edge graph, the pieces of a "
                      "mesh, or motion (default auto: the first of them that applies)")
    verb.add_argument("--root", metavar="VERTEX", type=_argument(_whole),
                      help="a vertex of the trunk (default: of a large branch that moves least)")
    verb.add_argument("--save", metavar="FILE.json", help="write the branches there, for encode --hierarchy")
    _source_arguments(verb)
    verb.add_argument("--json", action="store_true", help="print as JSON")


def _info_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("file", metavar="FILE.ath", help=READ)
    _stats_argument(verb)
    verb.add_argument("--json", action="store_true", help="print as JSON")


def _verify_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("file", metavar="FILE.ath", help=READ)
    _stats_argument(verb)
    verb.add_argument("--against", metavar="SOURCE", action="append",
                      help="the source: measure the error of every depth; of several clips all, in the file's order")
    verb.add_argument("--clip", metavar="NAME", help="compare this clip only")
    _source_arguments(verb)
    verb.add_argument("--json", action="store_true", help="print the result as JSON")


def _truncate_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("input", metavar="IN.ath")
    verb.add_argument("output", metavar="OUT.ath", help=WRITTEN)
    verb.add_argument(
        "--depth", metavar="LEVEL", type=_argument(_whole), required=True, help="the last level to keep"
    )


def _view_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("file", metavar="FILE.ath", help=READ)
    verb.add_argument("--port", metavar="PORT", type=_argument(_whole), default=0,
                      help="of the address (default: a free one)")
    verb.add_argument("--clip", metavar="NAME", help="begin with it (default: the file's first)")
    verb.add_argument("--no-browser", action="store_true", help="print the address and open nothing")
    verb.add_argument("--export", metavar="PAGE.html",
                      help="write one page with the file and the viewer inside, and serve nothing")


def _demo_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--keep", metavar="DIR", help="put the .ath file and every decoded depth there")


def _argument(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """`parse` for argparse, which shows the message of its own kind of error only."""

    def parsed(text: str) -> Any:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parsed


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _positive_length(text: str) -> Length:
    length = parse_length(text)
    if not length.value > 0:
        raise ValueError(f"got {text!r}, expected a length above 0")
    return length


def _fraction(text: str) -> float:
    value = _number(text, float)
    if not 0 < value < 1:
        raise ValueError(f"got {text!r}, expected a number between 0 and 1, such as 1e-4")
    return value


def _segment_frames(text: str) -> int:
    value = _number(text, int)
    if not MIN_SEGMENT <= value <= MAX_SEGMENT:
        raise ValueError(f"got {text!r}, expected {MIN_SEGMENT} to {MAX_SEGMENT} frames")
    return value


def _frame_bounds(text: str) -> tuple[int | None, int | None]:
    match = re.fullmatch(r"(\d*):(\d*)", text)
    if not match:
        raise ValueError(f"got {text!r}, expected A:B, A: or :B")
    start, stop = (int(bound) if bound else None for bound in match.groups())
    return start, stop


def _tam(text: str) -> tuple[Length, int, Length, int]:
    parts = text.split(",")
    if len(parts) != 4:
        raise ValueError(f"got {text!r}, expected four values: EPS,ETA,XI,LAMBDA")
    epsilon, eta, xi, lam = parts
    return parse_length(epsilon), _whole(eta), parse_length(xi), _whole(lam)


def _jobs(text: str) -> int:
    value = _number(text, int)
    if value < 1:
        raise ValueError(f"got {text!r}, expected a whole number, 1 or more")
    return value


def _rate(text: str) -> float:
    parts = [_number(part, float) for part in text.split("/")]
    value = parts[0] / parts[1] if len(parts) == 2 and parts[1] else parts[0] if len(parts) == 1 else 0.0
    if not 0 < value < math.inf:
        raise ValueError(f"got {text!r}, expected a number above 0 or a fraction such as 24000/1001")
    return value


def _whole(text: str) -> int:
    value = _number(text, int)
    if value < 0:
        raise ValueError(f"got {text!r}, expected a whole number, 0 or more")
    return value


def _number(text: str, kind: type) -> Any:
    try:
        return kind(text)
    except ValueError:
        raise ValueError(f"got {text!r}, expected a {'whole ' if kind is int else ''}number") from None
