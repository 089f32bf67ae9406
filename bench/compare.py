"""Tables of what rd.py measured: athcodec beside the best of the other codecs, and sentences that say where it loses.

A codec's size at a bound is that of the smallest file that it makes within the bound.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from bench.codec_registry import OURS
from bench.codecs import simple
from bench.codecs.ours import Athcodec, LayeredAthcodec, WholeAthcodec
from bench.store import IN_BRACKETS, commits
from bench.tables import markdown

Point = dict[str, Any]
Sizes = Mapping[tuple[str, float], Point]

BOUNDS = (1e-3, 1e-4, 1e-5)
[WHOLE_BOUND] = WholeAthcodec.bounds
OK, MISSING, SLOW = "ok", "missing", "too slow"
DONE = (OK, MISSING)  # Statuses that are no failure of a codec.

CAPTION = """
Bound: largest distance of any vertex in any frame, over the diagonal of the bounding box of all frames, checked by
another process that has only the bytes. Source: bytes of its file, or of all files of a sequence. All arrays:
`athcodec encode SOURCE` at 1e-4, with faces, names and every array, in layers. Ours: `--attributes none --rest-error
bound --ladder none`, which is what the others keep; they have no header, times and checksums. Best other: the
smallest file of the other codecs, each tuned for the bound, over ours; bold where it is smaller. Simple: the integers
of a grid, differences in time and along the vertices, zstd at level 19. Processor: seconds of all threads that
encoding all arrays takes, without other processes that read the source, and that the best other took at this bound
with its search. Levels: largest ratio of a level's error to that of the level before, of the largest error and of the
RMS. Ticks: largest second difference over frames near a seam, where segments meet or a loop begins again, over that of
the median frame. It is given at the level where it is largest, with the source's in the same frames. Levels and ticks
are those of the file at 1e-4 in the default layers. Commits: those that measured ours / the best others. Side
information: where the source names no branches, codecs that learn from branches or order vertices by them were given
those that athcodec finds, and the time for that was not counted; none was given faces.
"""
OVERVIEW = {
    "sample": "finite-element tree in wind, the sample",
    "blender_armature_tree": "Blender: tree on keyed bones",
    "mujoco_cable_vine": "MuJoCo: vine of cables",
    "helios_bean_8d": "Helios: bean that grows",
    "helios_tomato_8d": "Helios: tomato that grows, held out",
    "shader_card_sapling": "leaf cards that a vertex shader moves, held out",
}
SUITES_IN_WORDS = "files of other programs and clips that were held out"
OVERVIEW_TOTALS = """
In all, {compared} sizes were compared, of {clips} clips ({suites}), within 1e-3, 1e-4 and 1e-5 of the diagonal.
athcodec is the smallest in {won}, and the smallest file of the others takes {ratio:.1f} times as many bytes in the
median. Another codec is smaller in {lost}, by {less:.0f} % in the median and by {most:.0f} % at most.
[Benchmarks](docs/benchmarks.md) has all of them, levels, speed and memory; below are some, chosen by hand, at 1e-4.
"""
OVERVIEW_CAPTION = """
Bytes of files within 1e-4 of the diagonal of the bounding box of all frames. *Its file* is the source as its program
wrote it. *With all arrays* is `athcodec encode SOURCE` at its default options: faces, names, levels of detail, and a
rest pose in which faces keep their shape. *Positions* is `--attributes none --rest-error bound --ladder none`, which
is all that the other codecs keep. *Best other* is the smallest file of the other codecs, and how many times as large as
*positions* it is. The other codecs are SZ3, Blosc2, zfp, meshoptimizer, four kinds of PCA, skeletal tracks, and
differences with zstd, each tuned for the clip. Commits that measured athcodec / the best others: {} / {}{}.
"""


OTHER_KIND = "others"
LOST_CLIPS = (  # Kinds of motion that another codec may describe in fewer bytes, and how names of their clips begin.
    ("cards in the wind of a shader", "shader_card"),
    ("blades displaced by a texture that travels", "blender_bent_grass"),
    ("shape keys", "blender_shape_keys"),
    ("one leaf that vibrates", "skfem"),
    ("stems held at both ends", "mujoco_cable_vine"),
    ("organs that grow, triangles apart", "helios_bindweed"),
    ("cloth at the tightest bound", "blender_cloth"),
    ("cloth at the tightest bound", "blender_bract"),
)
LOST_WHY: Mapping[str, str] = {
    "cards in the wind of a shader": "A few waves of one formula move all cards. PCA stores the form of each wave over "
    "the whole plant, often with one weight of a vertex for all three axes. athcodec stores maps of each card in a "
    "time basis that all share, with weights for each axis.",
    "blades displaced by a texture that travels": "One displacement passes through all blades. Both codecs learn one "
    "time basis from all of them. PCA then has weights of vertices that differ little from one to the next; athcodec "
    "has modes of each blade, which suit bending and not a displacement that changes from vertex to vertex.",
    "shape keys": "The motion is a weighted sum of a few forms of the whole tree, which are as many components of PCA, "
    "each with one weight of a vertex for all three axes. athcodec stores the forms stem by stem and axis by axis.",
    "one leaf that vibrates": "A few forms of the whole blade vibrate. PCA stores each once, with one weight of a "
    "vertex for all three axes; athcodec stores them for each piece of 64 vertices and for each axis.",
    "stems held at both ends": "What moves a stem from both of its ends at once is a few forms of the whole stem, "
    "which PCA stores once. athcodec repeats it in all pieces of the stem, each coded about the one before.",
    "organs that grow, triangles apart": "Most vertices stand still or move as a neighbour does. Differences say so in "
    "as few bytes as predictions, and need no rest pose.",
    "cloth at the tightest bound": "No codec predicts many vertices within the bound: what is left is noise.",
}
MOTION_CHUNKS = ("STEMS", "SHAPES", "AFFINES", "PREDICTED")
REST_CHUNKS = ("REST", "SOURCE_REST", "REFINED_REST")
JOINT = "joint 1"  # What settings say of PCA whose components are paths in space.
LOST_CAPTION = """
Smaller by: the smallest file of another codec against ours, in per cent, least and most. Codecs: how many of these
files each made. One weight: in how many of them one weight of a vertex stands for all three axes, as no weight of
athcodec does. Motion, rest pose: shares of our files that both take; the rest is corrections, hierarchy and header.
"""


def measured(points: Iterable[Point]) -> list[Point]:
    """Return the points with a file whose error is within their bound."""
    return [point for point in points if point["status"] == OK]


def sizes_of(points: Iterable[Point], clip: str) -> Sizes:
    """Return a clip's measured points by codec and bound."""
    return {(point["codec"], point["bound"]): point for point in measured(points) if point["clip"] == clip}


def best_other(sizes: Sizes, bound: float) -> Point | None:
    """Return the smallest file of another codec."""
    others = [point for (_, at), point in sizes.items() if at == bound and point["kind"] != OURS]
    return min(others, key=lambda point: point["bytes"], default=None)


def exponent(bound: float) -> str:
    """Return a bound as documents write it: 1e-4, and "lossless" for 0."""
    return f"{bound:.0e}".replace("e-0", "e-") if bound else "lossless"


def short(codec: str) -> str:
    """Return the name of a codec without what stands in brackets behind it."""
    return codec.partition(" (")[0]


def rows(
    clips: Iterable[Mapping[str, Any]], points: Sequence[Point], bounds: Collection[float]
) -> list[dict[str, Any]]:
    """Return a row for each clip."""
    return [_row(clip, sizes_of(points, clip["clip"]), sorted(bounds, reverse=True)) for clip in clips]


def _row(clip: Mapping[str, Any], sizes: Sizes, bounds: Sequence[float]) -> dict[str, Any]:
    """Return a row of the table for one clip: its name, and at each of `bounds` the bytes of athcodec's file and of the
    smallest file of another codec.
    """

    def size(codec: str, bound: float) -> int | None:
        return sizes[codec, bound]["bytes"] if (codec, bound) in sizes else None

    whole, layers = (sizes.get((kind.name, WHOLE_BOUND), {}) for kind in (WholeAthcodec, LayeredAthcodec))
    best = best_other(sizes, WHOLE_BOUND) or {}
    made_by = (commits(some) for some in _shown(sizes, bounds))
    sizes_of_athcodec = {bound: size(Athcodec.name, bound) for bound in bounds}
    shares = [(sizes_of_athcodec[bound], size(simple.NAME, bound)) for bound in bounds]
    return {
        "clip": clip["clip"],
        "program": clip.get("program"),
        "frames x vertices": f"{clip['frames']} x {clip['vertices']:,}" if "frames" in clip else clip["what"],
        "source": clip.get("source_bytes"),
        "all arrays": whole.get("bytes"),
        **{f"ours {exponent(bound)}": sizes_of_athcodec[bound] for bound in bounds},
        **{
            f"best other {exponent(bound)}": _beside(sizes_of_athcodec[bound], best_other(sizes, bound))
            for bound in bounds
        },
        "ours/simple": " ".join(
            f"{of_athcodec / plain:.2f}" if of_athcodec and plain else "-" for of_athcodec, plain in shares
        ),
        "processor s": " / ".join(_rounded(point.get("encode_cpu_s")) for point in (whole, best)),
        "levels": " / ".join(_rounded(layers.get(name)) for name in ("level_max_ratio", "level_rms_ratio")),
        "ticks": " / ".join(_rounded(layers.get(name)) for name in ("tick_ratio", "source_tick_ratio")),
        "commits": " / ".join(name or "-" for name in made_by),
    }


def _shown(sizes: Sizes, bounds: Collection[float]) -> tuple[list[Point], list[Point]]:
    """Return the points of athcodec and the best ones of other codecs."""
    points_of_athcodec = [point for (_, bound), point in sizes.items() if point["kind"] == OURS and bound in bounds]
    return points_of_athcodec, [best for bound in bounds if (best := best_other(sizes, bound))]


def _rounded(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}" if value < 10 else f"{value:.0f}"


def _beside(size_of_athcodec: int | None, best: Point | None) -> str | None:
    """Return the size and name of a file, and its ratio to ours; bold where it is smaller."""
    if best is None:
        return None
    text = f"{best['bytes']:,} {short(best['codec'])}" + (
        f" x{best['bytes'] / size_of_athcodec:.2f}" if size_of_athcodec else ""
    )
    return f"**{text}**" if size_of_athcodec and best["bytes"] < size_of_athcodec else text


def losses(clips: Iterable[Mapping[str, Any]], points: Sequence[Point], bounds: Collection[float]) -> str:
    """Return sentences about where athcodec does worse: clips on which another codec's file or the source's own is
    smaller, clips with a level that is worse than the level before, and clips without a file. The sentences end with
    the versions and time limits of the codecs.
    """
    compared, smaller, larger, coarser = 0, [], [], []
    names = [clip["clip"] for clip in clips]
    points_of_clips = [point for point in points if point["clip"] in names and point["bound"] in bounds]
    for clip in clips:
        sizes, name = sizes_of(points, clip["clip"]), f"`{clip['clip']}`"
        for bound in sorted(bounds, reverse=True):
            point_of_athcodec, best = sizes.get((Athcodec.name, bound)), best_other(sizes, bound)
            compared += bool(point_of_athcodec and best)
            if point_of_athcodec and best and best["bytes"] < point_of_athcodec["bytes"]:
                by = f"{short(best['codec'])} by {_percent(best['bytes'], point_of_athcodec['bytes'])}"
                smaller.append(f"{name} at {exponent(bound)} ({by})")
        whole = sizes.get((WholeAthcodec.name, WHOLE_BOUND))
        if whole and clip.get("source_bytes", whole["bytes"]) < whole["bytes"]:
            larger.append(f"{name} (by {_percent(whole['bytes'], clip['source_bytes'])})")
        growth = sizes.get((LayeredAthcodec.name, WHOLE_BOUND), {}).get("level_max_ratio") or 0
        if growth > 1:
            coarser.append(f"{name} ({growth:.2f} times)")
    failed = Counter(
        f"{short(point['codec'])} {point['status']}" for point in points_of_clips if point["status"] not in DONE
    )
    versions = sorted({point["depends"]["athcodec"].split()[0] for point in points_of_clips if "depends" in point})
    limits = sorted(
        {f"{point['limit_s']:g}" for point in points_of_clips if point["kind"] != OURS and "limit_s" in point}
    )
    parts = {
        "Measured with athcodec": versions,
        "Processor seconds of other codecs for a file:": limits,
        _count_in_words(compared, len(smaller)): smaller or ["none"],
        "With all arrays the file is larger than its source:": larger,
        "The largest error of a level exceeds that of the level before:": coarser,
        "Without a file:": [f"{name} {count} times" for name, count in failed.items()],
    }
    return " ".join(f"{words} {', '.join(some)}." for words, some in parts.items() if some)


def _count_in_words(compared: int, smaller: int) -> str:
    words = f"Of {compared} sizes of athcodec, another codec's is smaller in"
    return f"{words} {smaller}:" if smaller else words


def lost_text(suites: Iterable[Mapping[str, Any]], bounds: Collection[float] = BOUNDS) -> str:
    """Return a Markdown table, by kinds of motion, of the pairs of clip and bound at which another codec's file is
    smaller than athcodec's, with the reasons.
    """
    kinds: dict[str, list[tuple[str, Point, Point]]] = {}
    compared = 0
    for contents in suites:
        for clip in contents["clips"]:
            sizes = sizes_of(contents["points"], clip["clip"])
            for bound in bounds:
                ours, best = sizes.get((Athcodec.name, bound)), best_other(sizes, bound)
                compared += bool(ours and best)
                if ours and best and best["bytes"] < ours["bytes"]:
                    kind = next((kind for kind, start in LOST_CLIPS if clip["clip"].startswith(start)), OTHER_KIND)
                    kinds.setdefault(kind, []).append((clip["clip"], ours, best))
    table = [_lost_row(kind, kinds[kind]) for kind in sorted(kinds, key=lambda kind: -len(kinds[kind]))]
    count = sum(map(len, kinds.values()))
    sentence = f"Of {compared} foreign and held-out sizes, another codec's file is smaller in {count}:"
    return f"{sentence}\n\n{markdown(table)}\n\n{' '.join(LOST_CAPTION.split())}\n"


def _lost_row(kind: str, lost: Sequence[tuple[str, Point, Point]]) -> dict[str, Any]:
    """Return the table's row for one kind of motion. `lost` has a triple for each case in which another codec's file is
    smaller: the clip's name, athcodec's result, and the other codec's result.
    """
    savings = [100 * (1 - best["bytes"] / ours["bytes"]) for _, ours, best in lost]
    chunks = [_chunk_bytes(ours) for _, ours, _ in lost]
    motion, rest = (
        100
        * sum(sum(sizes.get(name, 0) for name in names) for sizes in chunks)
        / sum(sum(one.values()) for one in chunks)
        for names in (MOTION_CHUNKS, REST_CHUNKS)
    )
    codecs = Counter(short(best["codec"]) for _, _, best in lost)
    return {
        "motion": kind,
        "clips": ", ".join(f"`{clip}`" for clip in dict.fromkeys(clip for clip, _, _ in lost)),
        "sizes": len(lost),
        "smaller by %": f"{min(savings):.1f} to {max(savings):.1f}",
        "codecs": ", ".join(f"{name} {number}" for name, number in codecs.items()),
        "one weight": sum(JOINT in best["settings"] for _, _, best in lost),
        "motion, rest pose %": f"{motion:.0f}, {rest:.0f}",
        "why": LOST_WHY.get(kind, "-"),
    }


def _chunk_bytes(ours: Point) -> dict[str, int]:
    """Return the bytes of each kind of chunk in a file of athcodec, as its settings state them."""
    words = ours["settings"].partition("chunk_bytes ")[2].split(", ")
    return {name: int(size) for name, size in (word.split() for word in words if word)}


def _percent(one: int, other: int) -> str:
    """Return how far a size is from another one, in per cent of that."""
    return f"{100 * abs(one / other - 1):.1f} %"


def by_codec(points: Sequence[Point], clip: str, bounds: Collection[float]) -> list[dict[str, Any]]:
    """Return one row per codec for the clip named `clip`: the bytes at each bound and without loss, or the reason why
    there is no file.
    """
    points_of_clip = [point for point in points if point["clip"] == clip and point["bound"] in (*bounds, 0)]
    columns = dict.fromkeys(
        exponent(bound) for bound in sorted({point["bound"] for point in points_of_clip}, reverse=True)
    )
    table: dict[str, dict[str, Any]] = {}
    for point in sorted(points_of_clip, key=lambda point: -point["bound"]):
        name = point["codec"].removesuffix(", lossless")
        row = table.setdefault(name, {"bytes of": name} | columns)
        row[exponent(point["bound"])] = point["bytes"] if point["status"] == OK else point["status"]
    for name, row in table.items():
        row["commit"] = commits(point for point in points_of_clip if point["codec"].removesuffix(", lossless") == name)
    return list(table.values())


def suite_text(contents: Mapping[str, Any], bounds: Collection[float] = BOUNDS) -> str:
    """Return sentences and the table of a suite, for a document."""
    clips, points = contents["clips"], contents["points"]
    table, caption = markdown(rows(clips, points, bounds)), " ".join(CAPTION.split())
    return "\n\n".join([losses(clips, points, bounds), table, caption]) + "\n"


def clips_text(contents: Mapping[str, Any], bounds: Collection[float] = BOUNDS) -> str:
    """Return sentences and a table of all codecs for each clip, for a document."""
    clips, points = contents["clips"], contents["points"]
    parts = [losses(clips, points, bounds)]
    for clip in (clip for clip in clips if "frames" in clip):
        title = f"`{clip['clip']}`, {clip['frames']} x {clip['vertices']:,}: {clip['what']}"
        parts += [title, markdown(by_codec(points, clip["clip"], bounds))]
    return "\n\n".join(parts) + "\n"


def totals_text(suites: Iterable[Mapping[str, Any]]) -> str:
    """Return a sentence about all results of the suites: in how many cases athcodec's file is smaller or larger than
    that of the best other codec, and by how much.
    """
    clips, ratios = set(), []
    for contents in suites:
        for clip in contents["clips"]:
            sizes = sizes_of(contents["points"], clip["clip"])
            for bound in BOUNDS:
                ours, best = sizes.get((Athcodec.name, bound)), best_other(sizes, bound)
                if ours and best:
                    clips.add(clip["clip"])
                    ratios.append(best["bytes"] / ours["bytes"])
    lost = [ratio for ratio in ratios if ratio < 1]
    text = OVERVIEW_TOTALS.format(
        compared=len(ratios),
        clips=len(clips),
        suites=SUITES_IN_WORDS,
        won=len(ratios) - len(lost),
        ratio=statistics.median(ratios),
        lost=len(lost),
        less=100 * (1 - statistics.median(lost)),
        most=100 * (1 - min(lost)),
    )
    return " ".join(text.split())


def overview_text(suites: Sequence[Mapping[str, Any]]) -> str:
    """Return a short comparison for readers: a sentence with the totals of all suites but the first, which has only the
    sample, and a table of a few clips at an error bound of 1e-4, below the options that were used.
    """
    shown, points = [], ([], [])
    for contents in suites:
        clips = [clip for clip in contents["clips"] if clip["clip"] in OVERVIEW]
        for clip in clips:
            for columns, more in zip(points, _shown(sizes_of(contents["points"], clip["clip"]), [WHOLE_BOUND])):
                columns += more
        for clip, row in zip(clips, rows(clips, contents["points"], [WHOLE_BOUND])):
            sizes = {"float32": 12 * clip["frames"] * clip["vertices"], "its file": row["source"]}
            sizes |= {"with all arrays": row["all arrays"]}
            sizes |= {"positions": row["ours 1e-4"], "best other": row["best other 1e-4"]}
            shown.append({"clip": OVERVIEW[clip["clip"]], "frames x vertices": row["frames x vertices"]} | sizes)
    made_by = [commits(some) for some in points]
    note = f", {IN_BRACKETS}" if "(" in "".join(made_by) else ""
    caption = " ".join(OVERVIEW_CAPTION.format(*made_by, note).split())
    return "\n\n".join([totals_text(suites[1:]), markdown(shown), caption])
