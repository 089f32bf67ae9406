"""Clips and .ath files as the arguments of a verb ask for them, and what is measured on them."""

from __future__ import annotations

import argparse
import shlex
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import athcodec
from athcodec.cli.printing import progress, say
from athcodec.decoding.clip_view import ClipView
from athcodec.decoding.decoder import Decoder
from athcodec.decoding.file_tables import Level
from athcodec.errors import AthError, ClipError, GuessWarning, LevelUnavailable, RemoteError, SourceWarning
from athcodec.exporters import check_ath_name
from athcodec.files.atomic import check_target, file_ids, is_url, keeping
from athcodec.files.kinds import SOURCES, kind_of
from athcodec.files.reading import naming_file
from athcodec.files.shown import counted
from athcodec.metrics import MotionMeter, SmoothnessMeter, level_meters
from athcodec.motion.branches.result import with_branches as clip_with_branches
from athcodec.motion.clip import MotionClip
from athcodec.motion.joining import BLEND, in_wind
from athcodec.options import HOST, MAX_MEMORY
from athcodec.sources import ATH, LISTED, ReadOptions, find_format, listed
from athcodec.sources.branches import find_or_load
from athcodec.sources.numbering import each_once
from athcodec.sources.one_frame import warn_of_still
from athcodec.untyped import JsonObject

if TYPE_CHECKING:
    from athcodec.binding import OntoMesh
    from athcodec.exporters.gltf_into import Into

ROUNDING = 1e-6
"""How far, relatively, the encoder's figure of an error and that of ErrorMeter may differ."""


def clip_to_encode(
    paths: Sequence[str], args: argparse.Namespace, read: Callable[[str], MotionClip] | None = None
) -> MotionClip:
    """Return the clip to encode, as the options in `args` say. All clips and takes in the files `paths` are joined into
    one. `read` opens a file; by default it is `read_clip`."""
    with ExitStack() as opened:
        parts = []
        for path, called in each_once(paths):
            whole = opened.enter_context(read(path) if read else read_clip(args, path))
            if not read and not args.still:
                warn_of_still(whole, path, args.source_format, args.axes)
            parts += [(name, called, part) for name, part in athcodec.split(whole).items()]
        names = args.names or [name or (stem if len(parts) > 1 else "") for name, stem, _ in parts]
        loops = _checked_names(names, len(parts), args)
        winds = _checked_winds(len(parts), args)
        clips: dict[str, MotionClip] = {}
        for name, wind, (_, _, clip) in zip(names, winds, parts):
            if args.rest not in ("auto", HOST) and clips:  # one that was made: the first clip's is as good for all
                clip = clip.replace(rest=next(iter(clips.values())).source_rest, rest_given=False)
            clip = in_wind(clip, *wind) if wind else clip
            clips[name] = athcodec.looped(clip, args.loop_blend) if name in loops else clip
        joined = athcodec.join(clips) if len(clips) > 1 or names != [""] else clips[""]
        opened.pop_all()
    return joined


def arrays_of_frames(clip: MotionClip) -> list[str]:
    """Return the names of a clip's arrays that have a value for each frame and vertex, such as another motion."""
    moving = (clip.frame_count, clip.vertex_count)
    return [name for name, array in clip.attributes.items() if array.shape[:2] == moving and clip.frame_count > 1]


def gltf_to_fill(paths: Sequence[str], args: argparse.Namespace) -> Into:
    """Return the GLB in `paths` whose vertices get a motion (`--into`). Raises ClipError if there is more than one
    path, it is no GLB, or an option says otherwise how to read it."""
    from athcodec.exporters.gltf_into import Into

    if len(paths) != 1 or args.output:
        raise ClipError(f"--into: got {len(paths)} inputs or an output besides, expected one GLB and no other output")
    if (kind := kind_of(paths[0])) != "glTF":
        path, glb = shlex.quote(paths[0]), shlex.quote(args.into)
        encoded = shlex.quote(str(Path(paths[0]).with_suffix(ATH)))
        hint = f"; `athcodec decode {path} {glb}` writes one of it" if kind == ATH else ""
        if kind in SOURCES:
            hint = f"; `athcodec encode {path} {encoded}` makes an .ath file of it, and "
            hint += f"`athcodec decode {encoded} {glb}` a GLB of that"
        raise ClipError(f"{paths[0]}: is no GLB (it looks like {kind}), expected an animated one for --into{hint}")
    for name in ("source_format", "mesh", "field", "dataset", "axes", "unit", "up_axis"):
        if getattr(args, name) is not None:
            raise ClipError(f"--into: got --{name.replace('_', '-')} too, expected the GLB as it is")
    if args.rest not in ("auto", HOST) or args.exact_rest:
        raise ClipError("--into: got another rest pose, expected the meshes of the GLB")
    return Into(paths[0], _gltf_options(args), args.keep_animation, args.gltf_motion)


def _checked_names(names: Sequence[str], clip_count: int, args: argparse.Namespace) -> Sequence[str]:
    """Return the names of the clips that become loops. `names` has a name for each clip. Raises ClipError if names and
    options do not fit the clips."""
    if len(names) != clip_count:
        raise ClipError(f"--names: got {len(names)}, expected {clip_count}, one for each clip")
    loops = names if args.loop == ["all"] else args.loop or []
    for name in (*loops, *names):
        if names.count(name) != 1:
            raise ClipError(f"clip {name!r}: got {names.count(name)} of this name, expected one (see --names)")
    if args.loop_blend and not loops:
        raise ClipError("--loop-blend: got no clips to make loops of, expected some with --loop")
    return loops


def _checked_winds(clip_count: int, args: argparse.Namespace) -> Sequence[tuple[float, ...]]:
    """Return (strength, heading) of the wind for each clip, or an empty tuple if the options state none. Raises
    ClipError if their number is not that of the clips."""
    winds = {"--strength": args.strength, "--heading": args.heading}
    if args.strength is None and args.heading is not None:
        raise ClipError("--heading: got no strengths, expected some with --strength")
    for option, numbers in winds.items():
        if numbers is not None and len(numbers) != clip_count:
            raise ClipError(f"{option}: got {len(numbers)}, expected {clip_count}, one for each clip")
    if args.strength is None:
        return [()] * clip_count
    return list(zip(args.strength, args.heading or [0.0] * clip_count))


def view_to_decode(decoder: Decoder, args: argparse.Namespace) -> ClipView:
    """Return the frames to decode, as `--clip`, `--frames`, `--level` and `--max-error` choose them; by default all
    clips of the file. Raises ClipError."""
    level, of_one = args.level, args.clip is not None or len(decoder.file.clips) == 1
    if args.max_error is not None:
        level = (decoder if of_one else decoder.file).level_within(args.max_error)
    if of_one:
        return ClipView(decoder, level, _frames(args.frames, decoder.frame_count))
    if args.frames != (None, None):
        names = ", ".join(clip.name for clip in decoder.file.clips)
        raise ClipError(f"--frames: got several clips, {names}; expected one of them with --clip")
    return ClipView(decoder, level, all_clips=True)


def mesh_onto(view: ClipView, args: argparse.Namespace) -> OntoMesh:
    """Return the mesh in the file `--onto`, bound to the decoded plant so that it moves with it. The caller has to
    close it."""
    with naming(args.onto), warnings.catch_warnings():
        warnings.simplefilter("ignore", SourceWarning)  # said below
        warnings.simplefilter("always", GuessWarning)
        how = {"frame": args.onto_frame, "unit": args.onto_unit, "up_axis": args.onto_up_axis}
        moving = athcodec.onto(view, args.onto, **how)
    _say_not_read(moving.clip, args.onto)
    return moving


def with_sources(
    decoder: Decoder, args: argparse.Namespace, opened: ExitStack
) -> list[tuple[Decoder, str, MotionClip]]:
    """Return the clips to verify as (decoder of the clip, path of its source, source clip). The list is empty without
    `--against`. Sources are closed with `opened`. Raises ClipError if there is not one for each clip."""
    if not args.against:
        return []
    played = [decoder] if args.clip is not None else [decoder.play(clip.name) for clip in decoder.file.clips]
    sources = [
        (path, clip)
        for path in args.against
        for clip in athcodec.split(opened.enter_context(_source_of(decoder, args, path))).values()
    ]
    if len(sources) != len(played):
        raise ClipError(f"--against: got {len(sources)} sources, expected {len(played)}, one for each clip")
    return [(decoder, path, clip) for decoder, (path, clip) in zip(played, sources)]


def _source_of(decoder: Decoder, args: argparse.Namespace, path: str) -> MotionClip:
    """Return the clip in the source `path`. If the decoded motion lies inside a GLB and the source is glTF, it is the
    motion of the vertices that were put into the GLB."""
    from athcodec.files.gltf.motion import GltfMotion

    if not isinstance(decoder.file.source, GltfMotion) or find_format(path).name != "gltf":
        return read_clip(args, path)
    from athcodec.exporters.gltf_into import Into

    return Into(path, _gltf_options(args)).clip


def _gltf_options(args: argparse.Namespace) -> ReadOptions:
    return ReadOptions(
        fps=args.fps, only=args.only or (), takes=args.takes or (), max_memory=args.max_memory or MAX_MEMORY
    )


def read_clip(args: argparse.Namespace, path: str) -> MotionClip:
    """Return the clip in the file `path`, read as the options in `args` say, and print what is not read."""
    rest = getattr(args, "rest", "auto")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SourceWarning)  # said below, with what is no shape
        warnings.simplefilter("always", GuessWarning)
        clip = athcodec.read(
            path,
            args.source_format,
            rest="auto" if rest == HOST else rest,
            fps=args.fps,
            mesh=args.mesh,
            field=args.field,
            dataset=args.dataset,
            axes=args.axes,
            only=args.only or (),
            takes=args.takes or (),
            allow_outside=args.allow_outside,
            max_memory=args.max_memory or MAX_MEMORY,
            unit=args.unit,
            up_axis=args.up_axis,
        )
    _say_not_read(clip, path)
    return clip


def _say_not_read(clip: MotionClip, path: str) -> None:
    """Print what the file `path` holds and the clip does not: other animations, and parts that a clip has no place
    for."""
    not_read = dict(clip.not_read)
    if others := not_read.pop("animation", None):
        played = ", ".join(clip.metadata.get("animations", ["none"]))
        text = f"this is {played}; there are {', '.join(others)} too, and --takes all makes a clip of each"
        say("takes", f"{path}: {text}")
    if not_read:
        say("not read", f"{path}: {listed(not_read)}")


def motions_of(path: str, args: argparse.Namespace) -> list[str | None]:
    """Return the names of the motions to open in `path`, which is a GLB with several motions; [None] if it has one at
    most."""
    from athcodec.files.gltf.motion import motions_in

    if args.gltf_motion is not None or is_url(path):
        return [args.gltf_motion]
    with naming(path):
        names = motions_in(path)
    return list(names) if len(names) > 1 else [None]


@contextmanager
def open_file(path: str | Path, stats: bool = False, **options: Any) -> Iterator[Decoder]:
    with naming(path), athcodec.open(path, **options) as decoder:
        try:
            yield decoder
        finally:
            if stats:
                say("stats", _stats(decoder))


@contextmanager
def naming(path: str | Path) -> Iterator[None]:
    """Make the messages of errors in the block begin with the file `path`."""
    try:
        with naming_file(path):
            yield
    except AthError as error:
        if str(error).startswith(f"{path}: ") or isinstance(error, RemoteError):
            raise
        raise error.about(str(path)) from error


def with_branches(clip: MotionClip, hierarchy: str | None) -> MotionClip:
    """Return the clip on the branches that --hierarchy asks for; as it is without it: encoding finds what is
    missing."""
    if hierarchy is None:
        return clip
    branches = find_or_load(clip, hierarchy)
    say("hierarchy", str(branches))
    return clip_with_branches(clip, branches)


def _frames(bounds: tuple[int | None, int | None], frame_count: int) -> range:
    """Return frames A to B - 1 of A:B, where None is the clip's end. Raises LevelUnavailable beyond it."""
    start = 0 if bounds[0] is None else bounds[0]
    stop = frame_count if bounds[1] is None else bounds[1]
    if not start < stop <= frame_count:
        raise LevelUnavailable(f"frames: got {start}:{stop}, expected A:B with A < B <= {frame_count}")
    return range(start, stop)


def measure_against(decoder: Decoder, source: str, clip: MotionClip) -> list[JsonObject]:
    """Return for each level of a file the error that it promises and the errors measured against the source clip, which
    is called `source` in messages. Raises ClipError if the clip has other numbers of frames or vertices."""
    with naming(source), clip.watched(), progress() as report:
        if isinstance(blend := decoder.metadata.get(BLEND), int) and BLEND not in clip.metadata:
            clip = athcodec.looped(clip, blend)
        got = clip.frame_count, clip.vertex_count
        expected = decoder.frame_count, decoder.file.vertex_count
        if got != expected:
            raise ClipError(f"got {got} frames and vertices, expected {expected} as in the .ath file")
        weights = decoder.file.error_weights
        meters = level_meters(decoder, clip)
        for start, stop in decoder.segments:
            reference = clip.block(start, stop)
            for number, meter in enumerate(meters):
                meter.add(reference, decoder.positions(slice(start, stop), number))
            if report:
                report("measure", stop / clip.frame_count)
    levels = [_measured(level, meter) for level, meter in zip(decoder.levels, meters, strict=True)]
    if weights is not None:
        promised = decoder.file.max_error_bound / float(weights.max())
        levels[-1]["kept"] &= meters[-1].error.max_weighted_error <= promised * (1 + ROUNDING)
    return levels


def tick_ratios(decoder: Decoder) -> list[list[float | None]]:
    """Return for each clip, at each complete level, how many times larger accelerations are near seams between segments
    than in the median frame; None where this cannot be measured."""
    ratios: list[list[float | None]] = []
    with progress() as report:
        for clip in decoder.file.clips:
            played = decoder.play(clip.name)
            starts = [start for start, _ in played.segments]
            meters = [SmoothnessMeter(clip.frame_count, starts=starts, loop=clip.loop) for _ in played.levels]
            for start, stop in played.segments:
                for number, meter in enumerate(meters[: decoder.file.deepest + 1]):
                    frames = played.positions(slice(start, stop), number)
                    meter.add(frames, frames)
                if report:
                    report("measure", (clip.first_frame + stop) / decoder.file.frame_count)
            ratios.append([meter.tick_ratio for meter in meters])
    return ratios


def _measured(level: Level, meter: MotionMeter) -> JsonObject:
    kept = meter.error.max_error <= level.max_error * (1 + ROUNDING)
    return {"level": level.level, "promised_max_error": level.max_error} | meter.figures() | {"kept": kept}


def refuse_broken_promises(result: JsonObject, measured: JsonObject) -> None:
    """Raise AthError if a level's measured error is larger than the file states. `result` has the facts about the file,
    and `measured` those about one of its clips (`measure_against`)."""
    levels = measured["levels"]
    broken = [(level, level["promised_max_error"]) for level in levels if not level["kept"]]
    if levels[-1]["max_error"] > result["max_error_bound"]:
        broken.append((levels[-1], result["max_error_bound"]))
    for level, promised in broken[:1]:
        raise AthError(
            f"{result['file']}: level {level['level']}: got max error {level['max_error']:.6g} against "
            f"{measured['against']}, expected at most {promised:.6g}"
        )


def check_output(path: str, *inputs: str | None, suffix: str | None = None) -> None:
    """Refuse, before any work, what can only fail after it, and what would destroy another file: an input, or one that
    is not of the kind that the suffix promises (default: that of `path`)."""
    with keeping(file_ids(*inputs)):
        check_target(path, Path(path).suffix if suffix is None else suffix)


def check_name(output: str, suffix: str, inputs: Sequence[str] = ()) -> None:
    """Raise ClipError unless the output's name ends in `suffix`. If the output is a source like the `inputs`, the user
    probably forgot to name an output, and the message shows commands that do."""
    if output.lower().endswith(suffix):
        return
    is_source = False
    with suppress(ClipError, OSError):
        is_source = bool(inputs) and find_format(output) is not None
    if not is_source:
        if suffix == ATH:
            check_ath_name(output)
        raise ClipError(f"{output}: got this name for the output, expected one that ends in {suffix}")
    paths = [path for path, _ in each_once([*inputs, output])]
    words = " ".join(map(shlex.quote, paths if len(paths) <= LISTED else [*paths[:2], "...", paths[-1]]))
    raise ClipError(
        f"{output}: is a source, expected an output that ends in {suffix} as the last name or after -o. For one file "
        f"of all inputs, where numbered files are one: athcodec encode {words} -o OUT{suffix}; for a file of each: "
        f"athcodec batch {words} --out DIR"
    )


def _stats(decoder: Decoder) -> str:
    """Return the text of `--stats`: how many bytes of a file were read, and by how many requests over the network."""
    requests = getattr(decoder.file.source, "requests", None)
    if requests is None:
        return f"{decoder.file.bytes_read:,} bytes read of {decoder.file.file_length:,}"
    return (
        f"{counted(requests, 'request')}, {decoder.file.source.bytes:,} bytes fetched of {decoder.file.file_length:,}"
    )


def what_is_missing(decoder: Decoder) -> str:
    if decoder.file.complete:
        return decoder.file.missing
    got, expected = decoder.file.info()["available_bytes"], decoder.file.file_length
    return f"cut off at {got:,} of {expected:,} bytes; missing {decoder.file.missing}"
