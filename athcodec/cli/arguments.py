"""The arguments of the command line: parser, help, and what their words mean."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import Any

import athcodec
from athcodec.files.shown import shown
from athcodec.motion.units import AXES, METRES, Length, checked_axis, checked_unit, parse_length, parse_size
from athcodec.options import (
    DEFAULT_LADDER,
    DEFAULT_REL_ERROR,
    DEFAULT_SEGMENT,
    EFFORTS,
    HOST,
    LOSSLESS_REL_ERROR,
    MAX_SEGMENT,
    METHODS,
    MIN_SEGMENT,
    RIG_JOINTS,
    SAMPLES,
    SMOOTHNESS,
    ladder_of,
)

DEMO_PAGE = "athcodec_demo.html"
DEMO_FLOOR = {"fern": 4.0, "grass": 9.0}
"""Samples on the floor of the demo's forest, and how many of each around a tree."""

SHELLS = ("bash", "zsh", "tcsh")
WORDS = "docs/command-line.md#words explains the words that it prints."
TRACEBACK = "show the traceback of an error"
WRITTEN = (
    "file to write; once complete it replaces an older file of its kind, but never an input or any other file; "
    "- is standard output, with encode and decode"
)
READ = 'a file or a URL, http://, https:// or another that fsspec knows (pip install "athcodec[remote]")'
READ_OR_PIPED = f"{READ}, or - for standard input"


class _Parser(argparse.ArgumentParser):
    """Whose messages are shown as all others are: they quote arguments, such as names of files."""

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Return the arguments; of those that a verb does not know, it is the verb whose usage is shown."""
        known, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}{self._meant(unknown)}")
        return known, unknown

    def _meant(self, unknown: Sequence[str]) -> str:
        """Return the end of an error about unknown options: the options of this verb that look like them."""
        names = [word.partition("=")[0] for word in unknown if word.startswith("--")]
        like = [get_close_matches(name, self._option_string_actions, 1, 0.75) for name in names]
        meant = [match for matches in like for match in matches]
        return f"; did you mean {' '.join(meant)}?" if meant else ""

    def _print_message(self, message: str, file: Any = None) -> None:
        super()._print_message(shown(message), file)


class _Completion(argparse.Action):
    """Print the script of a shell, made by shtab, and leave."""

    def __call__(
        self, parser: argparse.ArgumentParser, args: argparse.Namespace, shell: Any, option: Any = None
    ) -> None:
        """Print the completion script for `shell` and exit."""
        try:
            import shtab
        except ImportError:
            parser.error('--print-completion: needs shtab: pip install "athcodec[completion]"')
        [verbs] = (action.choices for action in parser._actions if isinstance(action, argparse._SubParsersAction))
        for action in (action for verb in verbs.values() for action in verb._actions):
            if re.search(r"IN\b|OUT|FILE|DIR|SOURCE", str(action.metavar)):
                action.complete = shtab.FILE
        print(shtab.complete(parser, shell))
        parser.exit()


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line, with one subparser for each verb."""
    shared = _Parser(add_help=False)
    shared.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=TRACEBACK)
    shared.add_argument("--json", action="store_true", help="print the result as JSON")
    parser = _Parser(
        prog="athcodec",
        description="A codec for plant motion: levels of detail over its branches, within an error bound.",
        epilog="athcodec VERB --help explains a verb. Exit codes: 0 done, 1 error or failed check, 2 usage, "
        "130 interrupted.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"athcodec {athcodec.__version__}")
    parser.add_argument("--debug", action="store_true", help=TRACEBACK)
    parser.add_argument(
        "--print-completion",
        choices=SHELLS,
        action=_Completion,
        help="print a script that lets a shell complete verbs, options and files: docs/command-line.md",
    )
    choices = parser.add_subparsers(metavar="VERB", required=True)

    def verb(name: str, text: str, more: str = "") -> argparse.ArgumentParser:
        description = f"{text[0].upper()}{text[1:]}. {more}"
        sub = choices.add_parser(name, parents=[shared], allow_abbrev=False, help=text, description=description)
        sub.set_defaults(verb=name)
        return sub

    _encode_arguments(
        verb(
            "encode",
            "compress a motion into an .ath file",
            f"The error bound is --rel-error {DEFAULT_REL_ERROR:g} by default, with --lossless {LOSSLESS_REL_ERROR:g}.",
        )
    )
    _batch_arguments(
        verb(
            "batch",
            "compress many motions, by several processes",
            "An interrupted run goes on where it ended when the command is given again. "
            "Exit code 1 if a clip failed; the others are done all the same.",
        )
    )
    _decode_arguments(
        verb(
            "decode",
            "write the motion of an .ath file in another format",
            "A file that was cut off is decoded to its deepest complete level, with a warning.",
        )
    )
    _info_arguments(verb("info", "show what an .ath file holds, level by level", WORDS))
    _verify_arguments(
        verb(
            "verify",
            "check that an .ath file is whole and undamaged, and how far off its source it is",
            f"Exit code 1 if a checksum fails, the file is cut off, or a level is further off than it says. {WORDS}",
        )
    )
    _truncate_arguments(verb("truncate", "leave out the levels beyond one, without decoding"))
    _hierarchy_arguments(
        verb(
            "hierarchy",
            "find the branches of a source that names none",
            "Encoding does so by itself; here the result is shown, and saved to be edited.",
        )
    )
    verb("formats", "list the formats that are read and written, and what each needs")
    _view_arguments(
        verb(
            "view",
            "play an .ath file in a browser",
            "Serves the viewer on this computer only, until it is interrupted.",
        )
    )
    _picture_arguments(
        verb(
            "picture",
            "make a picture of a plant, still or moving",
            "Drawn in Chromium by the viewer; takes athcodec[picture].",
        )
    )
    _demo_arguments(
        verb(
            "demo",
            "encode an included sample, decode and measure every level",
            f"Ends with a page that shows it, {DEMO_PAGE}, in DIR or in the current folder.",
        )
    )
    return parser


def _encode_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec encode` to the verb's parser."""
    verb.usage = "athcodec encode IN [IN ...] OUT.ath [options]"
    verb.add_argument(
        "input",
        metavar="IN",
        help="a clip in one of the formats that `athcodec formats` lists, - for standard input; several "
        "of one plant share their hierarchy and rest pose in the file; numbered files of one name are one clip",
    )
    verb.add_argument("paths", metavar="OUT.ath", nargs="+", help=WRITTEN)
    verb.add_argument(
        "-o",
        "--output",
        metavar="OUT.ath",
        action=_Output,
        help="file to write; every path without an option is then an input",
    )
    verb.add_argument(
        "--into",
        metavar="OUT.glb",
        action=_Output,
        help="write a GLB in place of OUT.ath: a copy of IN, an animated GLB, whose vertices the extension ATH_motion "
        "moves; each animation becomes a clip, unless they are played together",
    )
    verb.add_argument(
        "--keep-animation",
        action="store_true",
        help="with --into: keep skins and morph targets in the GLB, for programs that do not know ATH_motion",
    )
    _gltf_motion_argument(verb, "with --into: the name of the motion, of which a GLB may have several")
    verb.add_argument(
        "--names",
        metavar="NAME,...",
        type=_argument(_names),
        help="names of the clips (default: those that the sources state, such as names of takes; if there are none, "
        "and several clips, the names of their files without suffix)",
    )
    verb.add_argument(
        "--loop",
        metavar="NAME,...",
        type=_argument(_names),
        help="names of the clips that are loops: their first frame follows their last; all: every clip is",
    )
    verb.add_argument(
        "--loop-blend",
        metavar="FRAMES",
        type=_argument(_whole),
        default=0,
        help="number of frames to take off the end of each loop and to blend into its beginning, for loops that do "
        "not end where they began",
    )
    verb.add_argument(
        "--strength",
        metavar="S,...",
        type=_argument(_numbers),
        help="strength of the wind in each clip, in a unit of your choice; players choose clips to blend by it",
    )
    verb.add_argument(
        "--heading",
        metavar="DEG,...",
        type=_argument(_numbers),
        help="with --strength: direction that the wind of each clip blows to, degrees about the up axis (default 0)",
    )
    _source_arguments(verb)
    _coding_arguments(verb)
    verb.add_argument(
        "--jobs",
        metavar="N",
        type=_argument(_jobs),
        help="threads (default: one per core, at most 4, "
        "fewer for large meshes); the file is the same whatever their number",
    )


class _Output(argparse.Action):
    """Says where to, so that no further path has to."""

    def __call__(
        self, parser: argparse.ArgumentParser, args: argparse.Namespace, value: Any, option: Any = None
    ) -> None:
        setattr(args, self.dest, value)
        next(action for action in parser._actions if action.dest == "paths").required = False


def _batch_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec batch` to the verb's parser."""
    verb.add_argument(
        "inputs",
        metavar="IN",
        nargs="*",
        help="files, directories, patterns such as 'trees/**/*.h5', "
        "or URLs of them that fsspec knows (a directory's ends in a slash)",
    )
    verb.add_argument("--list", metavar="FILE", help="a file with further inputs, one per line; - is stdin")
    verb.add_argument(
        "--out",
        metavar="DIR",
        required=True,
        help="directory of the .ath files and of the manifest, or the URL of one that fsspec can write to",
    )
    verb.add_argument(
        "--settings",
        metavar="FILE.toml",
        help='settings by pattern of the clip\'s name: ["oaks/*"] and '
        'below it options of encode, such as max_error = "1mm"; they come before those given here',
    )
    verb.add_argument("--workers", metavar="N", type=_argument(_jobs), help="processes (default: one per core)")
    verb.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="address of a running Dask cluster to use in place of processes on this machine; it must see the same "
        "paths",
    )
    verb.add_argument(
        "--split",
        metavar="SEGMENTS",
        type=_argument(_jobs),
        help="code clips of more segments than this in parts of so many, each by any worker that is free (default 4)",
    )
    verb.add_argument(
        "--manifest",
        metavar="FILE.jsonl",
        help="file that lists what is done and what failed (default: athcodec-batch.jsonl in DIR; required if DIR is "
        "a URL)",
    )
    verb.add_argument("--redo", action="store_true", help="encode everything again")
    verb.add_argument("--verify", action="store_true", help="decode every level of a file before it counts as done")
    verb.add_argument("--dry-run", action="store_true", help="only say what would be done with each clip, and why")
    verb.add_argument("--loop", action="store_true", help="mark clips as loops, their first frame following their last")
    verb.add_argument(
        "--loop-blend",
        metavar="FRAMES",
        type=_argument(_whole),
        help="number of frames to take off the end of each clip and to blend into its beginning, which makes a loop "
        "of a clip that does not end where it began",
    )
    _source_arguments(verb)
    _coding_arguments(verb)


def _coding_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options that say how motion is coded, which `encode` and `batch` share, to a verb's parser."""
    verb.add_argument("--still", action="store_true", help="a source of a single frame is meant: do not warn of it")
    bound = verb.add_mutually_exclusive_group()
    bound.add_argument(
        "--max-error",
        metavar="LENGTH",
        type=_argument(_positive_length),
        help="largest distance of any vertex in any frame from the source: in scene units, or 1mm, 0.5cm, "
        f"2in ({', '.join(METRES)}) if the clip states its unit, or --unit does",
    )
    bound.add_argument(
        "--rel-error",
        metavar="FRACTION",
        type=_argument(_fraction),
        help="--max-error as a fraction of the diagonal of the bounding box over all frames "
        f"(default {DEFAULT_REL_ERROR:g}, with --lossless {LOSSLESS_REL_ERROR:g})",
    )
    bound.add_argument(
        "--target-size",
        metavar="SIZE",
        type=_argument(parse_size),
        help="largest size of the file, whose error is the smallest that fits: bytes, 50kB, 1.5MB (1 kB = 1,000 "
        "bytes), 48KiB",
    )
    verb.add_argument(
        "--segment-frames",
        metavar="FRAMES",
        type=_argument(_segment_frames),
        help=f"longest segment, a run of frames that is decoded at once: {MIN_SEGMENT} to {MAX_SEGMENT} (default "
        f"{MAX_SEGMENT}, for large plants {DEFAULT_SEGMENT}, or shorter if the file is smaller); shorter ones seek "
        "faster and mostly make larger files",
    )
    verb.add_argument(
        "--tam",
        metavar="EPS,ETA,XI,LAMBDA",
        type=_argument(_tam),
        help="thresholds of the paper's test of which subtrees move as one at coarse levels: lengths EPS and XI, ETA "
        "frames, LAMBDA vertices (default: those that the error bound allows)",
    )
    verb.add_argument(
        "--hierarchy",
        metavar="FILE|METHOD",
        help="branches from a file of `athcodec hierarchy --save` or a .mtg, or "
        f"found by auto, {', '.join(METHODS)} (default: the source's own, "
        "else those of several candidates that make the smallest file)",
    )
    verb.add_argument(
        "--rest-error",
        metavar="FRACTION|LENGTH",
        type=_argument(_rest_error),
        help="largest error of the rest pose: a fraction of the diagonal, a length such as 2mm, or bound for the error "
        "bound (default: for a mesh with faces, small enough for these to keep their shape; else the error bound)",
    )
    verb.add_argument("--exact-rest", action="store_true", help="keep the rest pose bit for bit")
    verb.add_argument(
        "--lossless",
        action="store_true",
        help="add a last level with positions and rest pose bit for bit; the error bound is that of the level before",
    )
    verb.add_argument(
        "--weights",
        metavar="NAME",
        help="name of an attribute with a factor on the error bound of each vertex: 4 allows four times the error",
    )
    verb.add_argument(
        "--attributes",
        choices=("all", "none"),
        default="all",
        help="keep edges, faces, metadata and all named arrays, or only unit and up axis (default all)",
    )
    verb.add_argument(
        "--effort", choices=EFFORTS, default="default", help="how long to look for a smaller file (default: default)"
    )
    verb.add_argument(
        "--smoothness",
        choices=tuple(SMOOTHNESS),
        default="default",
        help="bytes that may be spent on predicted motion, such as growth, without flicker: up to 15 %% (default), "
        "none (bytes), or as many again (motion)",
    )
    verb.add_argument(
        "--ladder",
        metavar="ERROR,...",
        type=_argument(ladder_of),
        default=ladder_of(DEFAULT_LADDER),
        help="error bounds of the layers of precision before the last one, as fractions of the diagonal, such as "
        "1e-2,1e-3; decades: 1e-2, 1e-3 and so on down to the error bound; none: a single layer, a few percent "
        "smaller, for archives (default decades)",
    )
    verb.add_argument(
        "--rest",
        choices=("auto", "first", "mean", HOST),
        default="auto",
        help="rest pose: the file's (the first frame where it has none), the first frame, or the mean of all, which "
        "are not stored; host: as auto, but left out, because whoever plays the file has the mesh: see decode "
        "--host-mesh (default auto)",
    )


def _source_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options that say how files of other programs are read to a verb's parser."""
    source = verb.add_argument_group("reading the source")
    source.add_argument(
        "--source-format",
        metavar="NAME",
        help="name of the source's format, one of `athcodec formats` (default: known by the file's content and suffix)",
    )
    source.add_argument(
        "--fps",
        metavar="RATE",
        type=_argument(_rate),
        help="frames per second, a number or a fraction such as 24000/1001: the rate at which curves "
        "are sampled, or the rate of a source that states none",
    )
    source.add_argument("--mesh", metavar="FILE", help="the mesh of a point cache: OBJ, PLY or GLB")
    source.add_argument("--field", metavar="NAME", help="name of the displacement in a finite-element result")
    source.add_argument(
        "--dataset", metavar="/PATH", help="of HDF5, NumPy and MATLAB files, the array with the positions, or its group"
    )
    source.add_argument(
        "--axes",
        metavar="NAME,...",
        type=_argument(_axes),
        help="the order of that array's axes (default: frames,vertices,xyz), such as vertices,frames,xyz; "
        "frames,vertices+xyz where x, y and z of all vertices lie in one axis; vertices,xyz for a single frame",
    )
    source.add_argument(
        "--only",
        metavar="PATTERN",
        action="append",
        help="read the prims, objects or meshes of these names only; may be repeated",
    )
    source.add_argument(
        "--takes",
        metavar="NAME,...",
        type=_argument(_names),
        help="read these animations of a glTF file, each as a clip; all: every one "
        "(default: the one that players begin with)",
    )
    source.add_argument(
        "--allow-outside",
        action="store_true",
        help="let XDMF, VTK, .series, HDF5 and USD files name files outside their folder",
    )
    source.add_argument(
        "--max-memory",
        metavar="SIZE",
        type=_argument(parse_size),
        help="bytes of memory that reading a source may take, such as 500MB or 16GiB (default 4GiB)",
    )
    source.add_argument(
        "--unit",
        metavar="UNIT",
        type=_argument(checked_unit),
        help=f"unit of length to convert to, or that of a source without one: {', '.join(METRES)}",
    )
    source.add_argument(
        "--up-axis",
        metavar="AXIS",
        type=_argument(checked_axis),
        help=f"axis to turn up, or that of a source without one: {', '.join(AXES)}",
    )


def _decode_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec decode` to the verb's parser."""
    verb.add_argument("input", metavar="IN.ath", help=READ_OR_PIPED)
    verb.add_argument("output", metavar="OUT", help=f"{WRITTEN}; its suffix says the format, see `athcodec formats`")
    verb.add_argument("--format", metavar="NAME", help="name of the format to write, whatever the suffix")
    verb.add_argument(
        "--clip",
        metavar="NAME",
        help="the clip to decode; without it glTF holds all of a file that has several, as animations of their names",
    )
    verb.add_argument(
        "--onto",
        metavar="MESH",
        help="move this mesh as the plant moves, and write it: a file of any format that is read, whose rest pose, or "
        "else first frame, lies on the plant's rest pose; it keeps its faces and attributes",
    )
    verb.add_argument(
        "--onto-frame",
        metavar="N",
        type=int,
        help="the mesh is in the pose of this frame of the clip, counted from 0 or, from the end, -1, in place of the "
        "rest pose: -1 for a mesh of a plant that has grown",
    )
    for name, kind, checked, choices in (
        ("unit", "UNIT", checked_unit, METRES),
        ("up-axis", "AXIS", checked_axis, AXES),
    ):
        verb.add_argument(
            f"--onto-{name}",
            metavar=kind,
            type=_argument(checked),
            help=f"{name.replace('-', ' ')} of that mesh, in place of what it states: {', '.join(choices)}",
        )
    verb.add_argument(
        "--bind",
        action="store_true",
        help="with --onto, to GLB: write the mesh with bones at rest in place of its motion; in three.js, ATHBones "
        "moves any number of such meshes by IN.ath",
    )
    _host_mesh_argument(verb)
    _gltf_motion_argument(
        verb, "name of the motion to decode, in a GLB with several (ATH_motion); to a GLB the default is all"
    )
    _stats_argument(verb)
    shown = verb.add_mutually_exclusive_group()
    shown.add_argument(
        "--level",
        "--depth",
        metavar="LEVEL",
        type=_argument(_whole),
        help="level of detail, from 0, the whole plant as one piece; `athcodec info` lists them "
        "(default: the deepest complete one)",
    )
    shown.add_argument(
        "--max-error",
        metavar="LENGTH",
        type=_argument(_positive_length),
        help="the coarsest level whose largest error is this or less, in scene units or such as 1mm",
    )
    verb.add_argument(
        "--frames",
        metavar="A:B",
        type=_argument(_frame_bounds),
        default=(None, None),
        help="frames A to B - 1, counted from 0; A: to the end, :B from the start (default: all)",
    )
    verb.add_argument("--gzip", action="store_true", help="compress where the format can: smaller, slower, no loss")
    verb.add_argument(
        "--animation",
        choices=("auto", "joints", "morphs"),
        default="auto",
        help="how glTF moves (default auto: joints where they keep within the file's error)",
    )
    verb.add_argument(
        "--rig",
        metavar="JOINTS",
        nargs="?",
        type=_argument(_jobs),
        const=RIG_JOINTS,
        help="write a skeleton for engines to USD or glTF, with at most this many joints (default %(const)s), and "
        "print its error",
    )
    verb.add_argument(
        "--nanite",
        action="store_true",
        help="with --rig and USD: laid out as Nanite Assemblies of Unreal Engine 5.7, copies as instances on the "
        "joints, and the JSON of Dynamic Wind beside it; not run in Unreal",
    )
    verb.add_argument(
        "--instances",
        action="store_true",
        help="write copies of one shape, such as leaves of an instancer, to USD, Alembic or glTF as instances, if "
        "their error is no larger than the level's",
    )
    verb.add_argument(
        "--velocities",
        action="store_true",
        help="write to USD or Alembic the velocity of every vertex in every frame, in lengths per second, for motion "
        "blur: as many bytes again as the positions",
    )
    verb.add_argument(
        "--samples",
        metavar="N",
        type=_argument(_jobs),
        default=1,
        help="write to USD or Alembic so many samples for each frame, evenly in time and on straight lines between "
        "frames: N times the bytes (default: %(default)s)",
    )
    verb.add_argument(
        "--allow-partial",
        action="store_true",
        help="leave out a damaged level and those beyond it instead of giving up",
    )


def _host_mesh_argument(verb: argparse.ArgumentParser, more: str = "") -> None:
    """Add `--host-mesh` to a verb. more: text behind its help."""
    verb.add_argument(
        "--host-mesh",
        metavar="FILE",
        help="the mesh of a file without a rest pose (encode --rest host): the file's source, or a file of any format "
        f"that is read, with the same vertices in the same order{more}",
    )


def _gltf_motion_argument(
    verb: argparse.ArgumentParser, text: str = "name of the motion to use, in a GLB with several (ATH_motion)"
) -> None:
    verb.add_argument("--gltf-motion", metavar="NAME", help=text)


def _stats_argument(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--stats", action="store_true", help="print on stderr how many requests and bytes were needed")


def _hierarchy_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec hierarchy` to the verb's parser."""
    verb.add_argument("input", metavar="IN", help="a clip in one of the formats that `athcodec formats` lists")
    verb.add_argument(
        "--method",
        choices=("auto", *METHODS),
        default="auto",
        help="by attributes named like branch ids, the joints of a skin, an edge graph, the pieces of a "
        "mesh, or motion (default auto: the first of them that applies)",
    )
    verb.add_argument(
        "--root",
        metavar="VERTEX",
        type=_argument(_whole),
        help="a vertex of the trunk (default: of a large branch that moves least)",
    )
    verb.add_argument("--save", metavar="FILE.json", help="file to write the branches to, for encode --hierarchy")
    _source_arguments(verb)


def _info_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec info` to the verb's parser."""
    verb.add_argument("file", metavar="FILE.ath", help=READ_OR_PIPED)
    verb.add_argument(
        "--motion",
        action="store_true",
        help="decode every level as well, and print how much more it jerks near seams, where segments meet or a "
        "loop begins again, than in its median frame",
    )
    _host_mesh_argument(verb, "; --motion needs it")
    _gltf_motion_argument(verb)
    _stats_argument(verb)


def _verify_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec verify` to the verb's parser."""
    verb.add_argument("file", metavar="FILE.ath", help=READ)
    _stats_argument(verb)
    verb.add_argument(
        "--against",
        metavar="SOURCE",
        action="append",
        help="the source: measure error, smoothness and shape of every level; of several clips all, in order",
    )
    verb.add_argument("--clip", metavar="NAME", help="compare this clip only")
    _host_mesh_argument(verb, " (default: the first SOURCE; without any, only checksums are compared)")
    _gltf_motion_argument(verb)
    _source_arguments(verb)


def _truncate_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec truncate` to the verb's parser."""
    verb.add_argument("input", metavar="IN.ath", help="or a GLB whose vertices such a file moves (ATH_motion)")
    verb.add_argument("output", metavar="OUT.ath", help=f"{WRITTEN}; of a GLB also OUT.glb: the same with less motion")
    kept = verb.add_mutually_exclusive_group(required=True)
    kept.add_argument("--level", "--depth", metavar="LEVEL", type=_argument(_whole), help="the last level to keep")
    kept.add_argument(
        "--max-error",
        metavar="LENGTH",
        type=_argument(_positive_length),
        help="keep the levels down to the first whose largest error this is or less, in scene units or such as 1mm",
    )
    kept.add_argument(
        "--target-size",
        metavar="SIZE",
        type=_argument(parse_size),
        help="keep as many levels as fit: bytes, 50kB, 1.5MB, 48KiB",
    )
    _gltf_motion_argument(verb)


def _view_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec view` to the verb's parser."""
    verb.add_argument("file", metavar="FILE.ath", help=READ)
    verb.add_argument(
        "--port", metavar="PORT", type=_argument(_whole), default=0, help="port of the address (default: a free one)"
    )
    verb.add_argument(
        "--clip", metavar="NAME", help="clip to begin with (default: that of the strongest wind, else the first)"
    )
    _host_mesh_argument(verb)
    verb.add_argument(
        "--floor",
        metavar="FILE.ath[=COUNT]",
        action="append",
        type=_argument(_counted),
        help="a plant for the forest's floor, so many around each tree (default: 4); may be given again",
    )
    verb.add_argument("--no-browser", action="store_true", help="print the address and open nothing")
    subject = verb.add_mutually_exclusive_group()
    subject.add_argument("--forest", action="store_true", help="show 10,000 plants in the wind, on WebGPU")
    subject.add_argument(
        "--export",
        metavar="PAGE.html",
        help="write one page with the file and the viewer inside, in place of an older HTML page alone, and serve "
        "nothing",
    )


def _counted(text: str) -> tuple[str, float]:
    """Return the path and the number of plants in FILE=COUNT; FILE alone means 4."""
    file, equals, count = text.rpartition("=")
    return (file, _above_zero(count)) if equals else (text, 4.0)


def _picture_arguments(verb: argparse.ArgumentParser) -> None:
    """Add the options of `athcodec picture` to the verb's parser."""
    verb.add_argument("file", metavar="FILE.ath", help=READ)
    kind = verb.add_mutually_exclusive_group(required=True)
    kind.add_argument("--gif", metavar="OUT.gif", help="write one round of the clip as a GIF")
    kind.add_argument(
        "--webp", metavar="OUT.webp", help="write one round of the clip as a WebP: more colours, fewer bytes"
    )
    kind.add_argument("--png", metavar="OUT.png", help="write one picture")
    verb.add_argument("--clip", metavar="NAME", help="clip to show (default: the file's first)")
    verb.add_argument(
        "--size",
        metavar="WxH",
        type=_argument(_width_and_height),
        default=(640, 480),
        help="width and height in pixels (default: 640x480)",
    )
    verb.add_argument(
        "--fps", metavar="N", type=_argument(_above_zero), default=15, help="pictures a second (default: %(default)s)"
    )
    verb.add_argument(
        "--time",
        metavar="SECONDS",
        type=float,
        default=0.0,
        help="with --png: seconds from the first frame of the clip to the picture (default: 0)",
    )
    _host_mesh_argument(verb)


def _width_and_height(text: str) -> tuple[int, int]:
    """Return width and height in pixels from text such as "640x480". Raises ValueError."""
    if not re.fullmatch(r"[1-9]\d{0,3}x[1-9]\d{0,3}", text):
        raise ValueError(f"got {text!r}, expected width and height in pixels, as 640x480")
    width, height = text.split("x")
    return int(width), int(height)


def _above_zero(text: str) -> float:
    number = float(text)
    if not 0 < number < math.inf:
        raise ValueError(f"got {text!r}, expected a number above 0")
    return number


def _demo_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--sample", choices=SAMPLES, default=SAMPLES[0], help="a tree in wind, or one that grows (default: %(default)s)"
    )
    verb.add_argument("--keep", metavar="DIR", help="folder to keep the .ath file and every decoded level in")


def _argument(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a function for argparse that parses the text of an argument as `parse` does. Its errors become those whose
    message argparse shows."""

    def parsed(text: str) -> Any:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parsed


def _numbers(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _axes(text: str) -> str:
    from athcodec.motion.positions import parse_order, written  # The import takes longer than all of this module.

    return written(parse_order(text))


def _positive_length(text: str) -> Length:
    length = parse_length(text)
    if not length.value > 0:
        raise ValueError(f"got {text!r}, expected a length above 0")
    return length


def _rest_error(text: str) -> float | str:
    """Return a fraction, a length with its unit, or OF_BOUND."""
    from athcodec.encoding.options.shape import RestPrecision  # heavy, as all that encodes is

    option = float(text) if re.fullmatch(r"[\d.]+([eE][+-]?\d+)?", text) else text
    RestPrecision.of(option)
    return option


def _fraction(text: str) -> float:
    """Return a number between 0 and 1 from text. Raises ValueError."""
    value = _number(text, float)
    if not 0 < value < 1:
        raise ValueError(f"got {text!r}, expected a number between 0 and 1, such as 1e-4")
    return value


def _segment_frames(text: str) -> int:
    """Return the longest segment in frames from text. Raises ValueError beyond its limits."""
    value = _number(text, int)
    if not MIN_SEGMENT <= value <= MAX_SEGMENT:
        raise ValueError(f"got {text!r}, expected {MIN_SEGMENT} to {MAX_SEGMENT} frames")
    return value


def _frame_bounds(text: str) -> tuple[int | None, int | None]:
    """Return first frame and the frame behind the last from "A:B", "A:" or ":B", None for a missing one. Raises
    ValueError."""
    match = re.fullmatch(r"(\d*):(\d*)", text)
    if not match:
        raise ValueError(f"got {text!r}, expected A:B, A: or :B")
    start, stop = (int(bound) if bound else None for bound in match.groups())
    return start, stop


def _tam(text: str) -> tuple[Length, int, Length, int]:
    """Return the thresholds from text "EPS,ETA,XI,LAMBDA". Raises ValueError."""
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
