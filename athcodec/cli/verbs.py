"""The verbs of the command line: each is a function that takes the parsed arguments and returns the exit code."""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack, nullcontext, suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import athcodec
from athcodec.cli.arguments import DEMO_FLOOR, DEMO_PAGE
from athcodec.cli.clips import (
    arrays_of_frames,
    check_name,
    check_output,
    clip_to_encode,
    gltf_to_fill,
    measure_against,
    mesh_onto,
    motions_of,
    naming,
    open_file,
    read_clip,
    refuse_broken_promises,
    tick_ratios,
    view_to_decode,
    what_is_missing,
    with_branches,
    with_sources,
)
from athcodec.cli.printing import (
    answer,
    one_line,
    print_demo,
    print_files,
    print_json,
    print_motions,
    print_outcome,
    print_preview,
    print_verdict,
    print_written,
    progress,
    say,
    say_seam,
    written_facts,
)
from athcodec.cli.streams import ATH, STREAM, standard_streams
from athcodec.decoding.clip_view import ClipView
from athcodec.decoding.facts import facts_of
from athcodec.errors import AthError, ClipError
from athcodec.files.atomic import scratch_folder
from athcodec.files.shown import echo, print_table
from athcodec.motion.branches.saving import save
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import branch_orders
from athcodec.motion.thresholds import Thresholds
from athcodec.options import DEFAULT_LADDER, DEFAULT_REL_ERROR, HOST, ladder_of
from athcodec.untyped import JsonObject

if TYPE_CHECKING:
    from athcodec.binding import OntoMesh
    from athcodec.encoding.assembly.summary import Summary
    from athcodec.exporters import Written
    from athcodec.viewer.view import Floor

ROUNDING_SHARE = 0.05  # Part of a level's error above which decode names what float32 adds to it.


def encode(args: argparse.Namespace) -> int:
    """Run `athcodec encode` and return its exit code."""
    paths = [args.input, *(args.paths or ())]
    output = args.into or args.output or paths.pop()
    if args.into:
        check_name(output, ".glb")
    elif output != STREAM:
        check_name(output, ATH, () if args.output else paths)
    with standard_streams() as streams:
        paths = [streams.source(path, args.source_format) for path in paths]
        if not args.into:
            output = streams.target(output, None)
        check_output(output, *paths)
        if args.into:
            summary = _encode_into(paths, args)
        else:
            with clip_to_encode(paths, args) as clip:
                summary = _encode(clip, paths[0], output, args, attributes=args.attributes, host_rest=args.rest == HOST)
        with open_file(output, strict=True, gltf_motion=_last_motion(output) if args.into else None) as decoder:
            if not streams.writes:
                untried = {"untried": list(summary.untried)} if args.json else {}
                print_files([facts_of(output, decoder) | untried], args.json)
    return 0


def _last_motion(path: str) -> str:
    from athcodec.files.gltf.motion import motions_in

    return motions_in(path)[-1]


def _encode_into(paths: list[str], args: argparse.Namespace) -> Summary:
    """Encode the motion of a GLB and write a GLB that holds the motion and moves by it (`--into`). Return the encoder's
    summary."""
    from athcodec.sources import listed

    with gltf_to_fill(paths, args) as host, scratch_folder(args.into) as folder:
        encoded = os.path.join(folder, "motion.ath")
        with clip_to_encode(paths, args, lambda _: host.clip) as clip:
            summary = _encode(clip, paths[0], encoded, args, attributes="none", host_rest=True)
            host.write(args.into, encoded)
        if host.lost:
            say("not written", f"{args.into}: {listed(host.lost)}")
    return summary


def _encode(clip: MotionClip, path: str, output: str, args: argparse.Namespace, **options: Any) -> Summary:
    """Encode a clip into the file `output` as `args` and further options say, and return the encoder's summary. `path`
    is the source's name in messages."""
    with naming(path), progress() as report:
        summary = athcodec.encode(
            with_branches(clip, args.hierarchy),
            output,
            segment_frames=args.segment_frames,
            max_error=args.max_error,
            rel_error=args.rel_error,
            target_size=args.target_size,
            tam=None if args.tam is None else Thresholds(*args.tam),
            exact_rest=args.exact_rest,
            rest_error=args.rest_error,
            lossless=args.lossless,
            weights=args.weights,
            effort=args.effort,
            smoothness=args.smoothness,
            ladder=args.ladder,
            jobs=args.jobs,
            progress=report,
            **options,
        )
    if summary.found_branches is not None:
        say("hierarchy", summary.found_branches)
    for seam in summary.seams:
        say_seam(seam, path, clip.metadata.get("unit"))
    if options.get("attributes") != "none" and (moving := arrays_of_frames(clip)):
        say(
            "arrays",
            f"{path}: {', '.join(moving)}: a value for each frame and vertex is packed without loss and takes many "
            "bytes; --attributes none leaves out all arrays, athcodec.read(skip=[...]) in Python some of them",
        )
    return summary


def batch(args: argparse.Namespace) -> int:
    """Run `athcodec batch` and return its exit code, 1 if a clip failed."""
    from athcodec import batch

    inputs = [*args.inputs, *(_listed(args.list) if args.list else ())]
    items = batch.find(
        inputs,
        args.out,
        settings=_batch_settings(args),
        patterns=batch.load_settings(args.settings) if args.settings else None,
    )
    where = {"manifest": args.manifest, "redo": args.redo}
    how = {"workers": args.workers, "scheduler": args.scheduler, "verify": args.verify}
    if args.split:
        how["split"] = args.split
    if args.dry_run:
        print_preview(batch.preview(items, args.out, **where), args.json)
        return 0
    outcome = batch.run(items, args.out, **where, **how, report=partial(echo, file=sys.stderr))
    print_outcome(outcome, args)
    return 1 if outcome.failed else 0


def _listed(path: str) -> list[str]:
    """Return the inputs that a text file lists, one in each line; the path "-" is standard input."""
    with nullcontext(sys.stdin) if path == "-" else open(path, encoding="utf-8") as file:
        return [line.rstrip("\r\n") for line in file if line.strip()]


def _batch_settings(args: argparse.Namespace) -> JsonObject:
    """Return the settings of a batch's clips that the command line sets to other values than the defaults."""
    from athcodec.batch.settings import BOUNDS, READING

    names = (*BOUNDS, *READING, "segment_frames", "hierarchy", "weights", "loop_blend", "rest_error")
    settings = {name: value for name in names if (value := getattr(args, name)) is not None and value is not False}
    settings |= {name: True for name in ("exact_rest", "lossless", "loop", "still") if getattr(args, name)}
    settings |= {
        name: getattr(args, name)
        for name, usual in (("attributes", "all"), ("effort", "default"), ("smoothness", "default"))
        if getattr(args, name) != usual
    }
    if args.ladder != ladder_of(DEFAULT_LADDER):
        settings["ladder"] = list(args.ladder)
    if settings.get("rest") == "auto":
        del settings["rest"]
    if args.max_error is not None:
        settings["max_error"] = str(args.max_error) if args.max_error.unit else args.max_error.value
    if args.tam is not None:
        epsilon, eta, xi, lam = args.tam
        settings["tam"] = [str(epsilon), eta, str(xi), lam]
    return settings


def hierarchy(args: argparse.Namespace) -> int:
    """Find the branches of a clip, print how many there are of each order, and save them to a JSON file if `--save`
    names one: the command `athcodec hierarchy`. Return the exit code.
    """
    if args.save:
        check_output(args.save, args.input, suffix=".json")
    with read_clip(args, args.input) as clip, naming(args.input), progress() as report:
        if report:
            report("branches", 0.0)
        branches = athcodec.find_branches(clip, args.method, args.root)
    if args.save:
        save(branches, args.save)
    sizes = np.bincount(branches.vertex_branch)
    orders = branch_orders(branches.branch_parent)
    if args.json:
        print_json(
            {
                "file": args.input,
                "method": branches.method,
                "vertices": len(branches.vertex_branch),
                "branches": len(sizes),
                "roots": int((branches.branch_parent < 0).sum()),
                "branches_per_order": np.bincount(orders).tolist(),
                "vertices_per_order": np.bincount(orders, sizes).astype(int).tolist(),
                "saved": args.save,
            }
        )
        return 0
    echo(f"{args.input}: {branches}")
    rows = [
        [f"{order}", f"{(orders == order).sum():,}", f"{sizes[orders == order].sum():,}"]
        for order in range(orders.max() + 1)
    ]
    print_table(["order", "branches", "vertices"], rows)
    if args.save:
        echo(f"{args.save}: edit it, and use it with athcodec encode --hierarchy")
    return 0


def decode(args: argparse.Namespace) -> int:
    with standard_streams() as streams:
        if args.output == STREAM and args.format is None:
            raise ClipError(f"{STREAM}: got no suffix that says the format to write, expected --format")
        args.input, args.output = streams.ath(args.input), streams.target(args.output, args.format)
        return _decode(args, quiet=streams.writes)


def _decode(args: argparse.Namespace, quiet: bool) -> int:
    """Decode a file and write it in another format, as `args` say, and return the exit code. With `quiet`, facts are
    not printed."""
    from athcodec.exporters import format_to_write
    from athcodec.sources import listed

    check_output(args.output, args.input, args.host_mesh, args.onto, suffix="" if args.format else None)
    if args.onto is None:
        for name in ("onto_unit", "onto_up_axis", "onto_frame", "bind"):
            if (value := getattr(args, name)) is not None and value is not False:
                raise ClipError(f"--{name.replace('_', '-')}: got no mesh, expected one with --onto")
    wanted = format_to_write(args.output, args.format)  # What cannot be written is refused before there is work.
    with naming(args.output):
        wanted.check()
    if args.bind and wanted.name != "gltf":
        raise ClipError(f"--bind: got {args.output}, expected a .glb file, which has bones")
    if args.bind and (args.rig is not None or args.instances or args.animation != "auto" or _blurs(args)):
        raise ClipError("--bind: got another way to move the mesh too, expected its bones alone")
    how = {"clip": args.clip, "allow_partial": args.allow_partial, "host_mesh": args.host_mesh}
    with ExitStack() as opened:
        names = motions_of(args.input, args) if _goes_back(args) else [args.gltf_motion]
        decoders = [opened.enter_context(open_file(args.input, args.stats, gltf_motion=name, **how)) for name in names]
        motions = [view_to_decode(decoder, args) for decoder in decoders]
        moving = None if args.onto is None else opened.enter_context(mesh_onto(motions[0], args))
        shown: Sequence[ClipView | MotionClip] = motions if moving is None else [moving.clip]
        if moving is None:
            written = _write_views(motions, args)
        else:
            written = _bound(moving, args.output) if args.bind else _write_clip(moving.clip, args)
        for decoder, motion in zip(decoders, motions):
            if decoder.file.missing:
                say("warning", f"{args.input}: decoded to level {motion.level}; {what_is_missing(decoder)}")
        results = [
            written_facts(written, clip, decoder.levels[motion.level])
            for decoder, motion, clip in zip(decoders, motions, shown)
        ]
        if moving is not None:
            results[0]["onto"] = {"file": args.onto} | asdict(moving.report)
        if args.json and not quiet:
            print_motions(results)
        elif not quiet:
            for result in results:
                print_written(result)
            if moving is not None:
                echo(f"{args.onto}: {moving.report}.")
        rounding, level_error = written.facts.get("rounding", 0.0), decoders[0].levels[motions[0].level].max_error
        if rounding > ROUNDING_SHARE * level_error:
            say(
                "warning",
                f"{args.output}: float32 moves positions by up to {rounding:.3g}, the level is off by "
                f"{level_error:.3g}; .h5, .npz, .xdmf, .pvd, .obj and .ply keep float64",
            )
        if lost := written.facts.get("not_written"):
            say("not written", f"{args.output}: {listed(lost)}")
    return 0


def _bound(moving: OntoMesh, path: str) -> Written:
    from athcodec.exporters import Written

    facts = moving.write_bound(path)
    return Written((Path(path),), facts | {"animation": f"a mesh on {facts['bones']:,} bones"})


def _goes_back(args: argparse.Namespace) -> bool:
    """Return whether a GLB with motions is to be written as a copy of it, with morph targets."""
    is_gltf = (args.format or Path(args.output).suffix.lower()) in ("gltf", ".glb")
    is_plain = args.animation != "joints" and args.rig is None and not args.instances and not _blurs(args)
    return is_gltf and args.onto is None and is_plain


def _blurs(args: argparse.Namespace) -> bool:
    return args.samples > 1 or args.velocities


def _write_views(motions: Sequence[ClipView], args: argparse.Namespace) -> Written:
    """Write the decoded frames in the format that `args` ask for. Motions that come from a GLB and go into one again
    are written back into it."""
    from athcodec.files.gltf.motion import GltfMotion

    if _goes_back(args) and isinstance(motions[0].decoder.file.source, GltfMotion):
        from athcodec.exporters import Written
        from athcodec.exporters.gltf_into import write_back

        write_back(args.input, motions, args.output)
        return Written((Path(args.output),))
    return _write_clip(motions[0], args)


def _write_clip(motion: ClipView | MotionClip, args: argparse.Namespace) -> Written:
    """Write a clip in the format that `args` ask for, and return which files were written."""
    from athcodec import exporters

    name = exporters.format_to_write(args.output, args.format).name
    options = ("gzip", "animation", "instances", "rig", "nanite", "samples", "velocities")
    how = {option: getattr(args, option) for option in options}
    with progress() as report:
        return athcodec.write(motion, args.output, name, progress=report, **how)


def info(args: argparse.Namespace) -> int:
    with standard_streams() as streams:
        called, args.file = args.file, streams.ath(args.file)
        return _info(args, called)


def _info(args: argparse.Namespace, called: str) -> int:
    """Print facts about a file and return the exit code. `called` is the file's name as it is printed."""
    rows = []
    for name in motions_of(args.file, args):
        with open_file(args.file, args.stats, host_mesh=args.host_mesh, gltf_motion=name) as decoder:
            ratios = tick_ratios(decoder) if args.motion else None
            rows.append(facts_of(_called(called, name), decoder, ratios))
    print_files(rows, args.json)
    return 0


def _called(path: str, motion: str | None) -> str:
    return path if motion is None else f"{path}, {motion}"


def verify(args: argparse.Namespace) -> int:
    """Run `athcodec verify` and return its exit code, 1 if the file is damaged or breaks a promise."""
    names: list[str | None] = [None]
    with suppress(AthError):  # which is said below, as of any damaged file
        names = motions_of(args.file, args)
    results = [_verified(args, name) for name in names]
    if args.json:
        print_motions(results)
    for result in results:
        if not args.json:
            print_verdict(result)
        if not result["ok"]:
            say("error", result["error"])
    return 0 if all(result["ok"] for result in results) else 1


def _verified(args: argparse.Namespace, name: str | None) -> JsonObject:
    """Return the result of verifying a file: "ok", "error" if it is not, and measured errors. `name` names the motion
    of a GLB, None if there is nothing to choose."""
    result: JsonObject = {"file": _called(args.file, name), "ok": False, "clips": []}
    try:
        how = {"strict": True, "clip": args.clip, "host_mesh": args.host_mesh, "gltf_motion": name}
        with open_file(args.file, args.stats, **how) as decoder, ExitStack() as opened:
            if decoder.file.needs_host_mesh and args.against:
                decoder.file.set_host_mesh(opened.enter_context(read_clip(args, args.against[0])))
            result["decoded"] = not decoder.file.needs_host_mesh
            decoder.file.check(result["decoded"])
            result |= {"max_error_bound": decoder.file.max_error_bound, "unit": decoder.metadata.get("unit")}
            for played, source, clip in with_sources(decoder, args, opened):
                measured: JsonObject = {"name": played.clip.name, "against": source}
                measured["levels"] = measure_against(played, source, clip)
                result["clips"].append(measured)
                refuse_broken_promises(result, measured)
        result["ok"] = True
    except AthError as error:
        result["error"] = one_line(error)
    return result


def truncate(args: argparse.Namespace) -> int:
    """Run `athcodec truncate` and return its exit code."""
    if not args.output.lower().endswith(".glb"):
        check_name(args.output, ATH)
    check_output(args.output, args.input)
    with naming(args.input):
        athcodec.truncate(
            args.input,
            args.output,
            args.level,
            max_error=args.max_error,
            target_size=args.target_size,
            gltf_motion=args.gltf_motion,
        )
    kept = args.gltf_motion if args.output.lower().endswith(".glb") else None
    with open_file(args.output, gltf_motion=kept) as decoder:
        last = decoder.file.level_count - 1
    before, after = (os.path.getsize(path) for path in (args.input, args.output))
    facts = {"file": args.output, "levels": last + 1, "bytes": after, "bytes_before": before}
    answer(args, facts, f"{args.output}: levels 0 to {last}, {after:,} of {before:,} bytes")
    return 0


def formats(args: argparse.Namespace) -> int:
    """Run `athcodec formats` and return its exit code."""
    from athcodec import exporters, sources

    read, written = ({kind.name: kind for kind in module.formats()} for module in (sources, exporters))
    rows = [
        {
            "format": name,
            "reads": _suffixes(read.get(name)),
            "writes": _suffixes(written.get(name)),
            "title": kind.title,
            "extra": kind.extra,
            "package": kind.package or "athcodec",
            "installed": kind.is_installed,
        }
        for name, kind in (written | read).items()
    ]
    if args.json:
        print_json({"formats": rows})
        return 0
    cells = [
        [row["format"], " ".join(row["reads"]), " ".join(row["writes"]), row["title"], _needs(row)] for row in rows
    ]
    print_table(["format", "reads", "writes", "what", "needs"], cells, justify="left")
    return 0


def _suffixes(kind: Any) -> list[str]:
    return list(kind.suffixes) if kind else []


def _needs(row: JsonObject) -> str:
    if not row["extra"]:
        return "" if row["package"] == "athcodec" else row["package"]
    return f"{row['package']}[{row['extra']}]" + (", installed" if row["installed"] else "")


def view(args: argparse.Namespace) -> int:
    """Run `athcodec view` and return its exit code."""
    from athcodec.viewer import view

    file = args.file
    if args.export and Path(args.export).suffix.lower() not in (".html", ".htm"):
        raise ClipError(f"--export: got {args.export}, expected PAGE.html")
    floor = dict(args.floor or [])
    with naming(file):
        if args.export:
            check_output(args.export, file, args.host_mesh, *floor)
            size = view.export_page(file, args.export, args.clip, args.host_mesh, floor)
            facts = {"file": args.export, "bytes": size}
            answer(args, facts, f"{args.export}: {size:,} bytes, opens in any browser")
            return 0
        ready = partial(_say_where, args)
        view.serve(file, args.port, ready, args.clip, args.host_mesh, forest=args.forest, floor=floor)
    return 0


def _say_where(args: argparse.Namespace, address: str) -> None:
    """Print the address of the viewer's page and open a browser there, unless `--no-browser` was passed."""
    from athcodec.viewer import view

    # Printed as it is, with the key that the page asks for.
    print(json.dumps({"address": address}) if args.json else f"{address} (Ctrl-C ends it)", flush=True)
    if not args.no_browser:
        view.open_browser(address)


def picture(args: argparse.Namespace) -> int:
    """Run `athcodec picture` and return its exit code."""
    from athcodec.viewer import picture

    kind = next(name for name in picture.FORMATS if getattr(args, name))
    out = getattr(args, kind)
    with naming(args.file):
        check_output(out, args.file, args.host_mesh, suffix=f".{kind}")
        how = {"fps": args.fps, "time": args.time, "host_mesh": args.host_mesh}
        size = picture.save_picture(args.file, out, kind, args.clip, args.size, **how)
    answer(args, {"file": out, "bytes": size}, f"{out}: {size:,} bytes")
    return 0


def demo(args: argparse.Namespace) -> int:
    """Compress a sample plant into an .ath file, measure the error of each of its levels, write a page that shows the
    plant, and print what was found: the command `athcodec demo`. With `--keep`, keep the file and each level in a
    folder. Return the exit code.
    """
    with tempfile.TemporaryDirectory() if args.keep is None else nullcontext(args.keep) as folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        source = athcodec.sample_path(args.sample)
        encoded = Path(folder, f"{source.stem}.ath")
        with athcodec.read_hdf5(source) as clip:
            with progress() as report:
                summary = athcodec.encode(clip, encoded, rel_error=DEFAULT_REL_ERROR, progress=report)
            with open_file(encoded, strict=True) as decoder:
                facts, errors = facts_of(encoded, decoder), athcodec.compare(clip, decoder)
                for level, largest, rms in zip(facts["levels"], errors.max_error, errors.rms_error, strict=True):
                    level["measured_max_error"] = float(largest.max())
                    level["measured_rms_error"] = float(np.sqrt(np.mean(rms**2)))
                    if args.keep is not None:
                        shown = decoder.at_level(level["level"])
                        athcodec.write(shown, encoded.with_name(f"{encoded.stem}_level_{shown.level}.h5"))
        page = Path(args.keep or ".", DEMO_PAGE).resolve()
        floor: Floor | None = None
        if args.sample == "tree":
            floor = {athcodec.sample_path(name): share for name, share in DEMO_FLOOR.items()}
        made = _export_demo(encoded, page, floor)
        if args.json:
            print_json(facts | {"page": str(page) if made else None})
            return 0
        print_demo(facts, summary.max_error_bound / summary.relative_bound)
        if made:
            leafed = shlex.quote(str(athcodec.sample_path("leafed")))
            echo(f"It moves in {page}: open it in a browser. `athcodec view {leafed}` shows one with leaves.")
        if args.keep is not None:
            echo(f"The file and its decoded levels are in {folder}.")
    return 0


def _export_demo(encoded: Path, page: Path, floor: Floor | None) -> bool:
    """Write the demo's web page, and return whether that succeeded. `floor` has further clips of the scene and their
    shares."""
    from athcodec.viewer import view

    try:
        view.export_page(encoded, page, floor=floor)
    except OSError as error:  # a folder that is read-only is no reason to fail at the end
        say("warning", f"no page to look at: {one_line(error)}")
        return False
    return True
