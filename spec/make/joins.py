"""Joins of segments."""

from itertools import product

from spec.make.base import *
from spec.make.clips import loop
from spec.make.predicted import ROOTED, predicted, swayed


def joined(stems: list[Stem], seed: int, *widths: float, **fields) -> Plant:
    """Return random rows in two segments of six frames."""
    return moving(stems, seed, **{"frames": 12, "segments": 2, "heads": HEADS, "joins": joins(*widths)} | fields)


valid("joins: maps and vertices are joined, over all frames that may be", lambda: joined(FORK, 101, 0, 4, 0, 1, 0, 4))
valid("joins-sloped: in value and slope", lambda: joined(FORK, 102, 0, 4.5, 0, 1.5, 0, 3.5))
valid("joins-of-some: at one level alone", lambda: joined(FORK, 103, 0, 0, 0, 3.5, 0, 0))
valid("joins-float64: positions of binary64", lambda: joined(FORK, 104, 0, 2.5, 0, 4, 0, 3, is_float64=True))
valid(
    "joins-forms: sheets, loose branches, several pieces and roots",
    joined,
    [Stem(-1, 4), Stem(0, 3, 2, SHEET), Stem(1, 2, 1, LOOSE), Stem(0, 70, 3), Stem(-1, 6, 0, SHEET)],
    *(105, 0, 3, 0, 4.5, 0, 2, 0, 1.5),
)
valid(
    "joins-whole: nodes whose maps serve several levels",
    lambda: joined([Stem(-1, 3), Stem(0, 2, 1, WHOLE), Stem(1, 2, 1), Stem(0, 4, 2), Stem(3, 3, 1)], 106, *(0, 4) * 4),
)
valid(
    "joins-many: segments of different lengths and joins, none of them at first",
    lambda: joined(FORK, 107, *(0, 3, 0, 2.5), *(0, 0, 2, 2), *(0, 1, 3.5, 1), frames=19, segments=4),
)
valid("joins-longest: over 127 frames", lambda: joined([Stem(-1, 2)], 108, 0, 127.5, 0, 127, frames=258, segments=2))
valid("joins-of-three-frames: the shortest segment that is joined", lambda: joined(FORK, 109, *(0, 1.5) * 3, frames=6))
valid(
    "joins-loop: the first segment of a loop goes on from its last",
    joined,
    FORK,
    110,
    *(3, 2.5, 4, 0, 4.5, 0, 0, 0, 3, 0, 2, 0),
    clips=(loop(Clip(18, 3, "loop"), 0.0, 0.0, 0.0), Clip(6, 1, "once")),
)
valid(
    "joins-clips: a loop of two segments behind a clip that is none",
    lambda: joined(
        FORK, 111, *(0, 2, 3, 4.5) * 3, clips=(Clip(12, 2, "once"), loop(Clip(11, 2, "loop"), 0.0, 0.0, 0.0))
    ),
)
valid(
    "joins-corrections: corrections are added to what is joined, and what is joined goes on from what is not corrected",
    joined,
    FORK,
    112,
    *(0, 4, 0, 4, 0, 3.5),
    scripts={(STEMS, 1): 1, (STEMS, 2): 2, (AFFINES, 0): lambda: Chance(3, large=4), (CORRECTIONS, 2): 4},
)
for title, make in {
    "joins-layers: three layers, of which each is joined and none predicts from that": lambda: refinements(
        MIXED, 113, frames=12, segments=2, joins=joins(*(0, 4.5) * 6)
    ),
    "joins-lossless: the source's own numbers about positions that are joined": lambda: replace(
        joined(FORK, 114)
        .with_header(level_count=4, full_level_count=4)
        .add(*(Entry(EXACT, b"", 3, s) for s in range(2))),
        joins=joins(0, 2, 0, 3, 0, 4.5, 0, 0),
    ),
    "joins-truncated: shortened: level 1 of 3": lambda: joined(FORK, 115, *(0, 4) * 3).upto(1),
    "joins-predicted: maps of level 0 before predicted motion": lambda: replace(
        predicted(ROOTED, swayed(5, 116), segments=2, scripts={(AFFINES, 0): lambda: Chance(116, large=4)}),
        joins=joins(0, 3, 0, 0),
    ),
}.items():
    valid(title, make)

for name, reason, of in (
    ("first", "the first segment of a clip that is no loop is joined", (1, 0)),
    ("too-long", "over more frames than the segment has, less two", (0, 5)),
    ("128", "over 128 frames", (0, 128)),
    ("negative", "over -1 frames", (0, -1)),
    ("largest", "over 2^29 frames", (0, 1 << 29)),
):
    invalid(f"joins-{name} BAD_CHUNK_TABLE: {reason}", lambda of=of: joined(FORK, 120, 0, 0, *of, 0, 0).file())
for title, make in {
    "joins-lone-loop BAD_CHUNK_TABLE: a loop of one segment is joined to itself": lambda: joined(
        *(FORK, 121, 2, 0, 0, 0, 0, 0), clips=(loop(Clip(9, 1, "loop"), 0.0, 0.0, 0.0), Clip(3, 1, "once"))
    ).file(),
    "joins-exact BAD_CHUNK_TABLE: the source's own numbers are joined": lambda: replace(
        joined(FORK, 122)
        .with_header(level_count=4, full_level_count=4)
        .add(*(Entry(EXACT, b"", 3, s) for s in range(2))),
        joins=joins(0, 0, 0, 0, 0, 0, 0, 2),
    ).file(),
    "joins-of-predicted-motion BAD_CHUNK_TABLE: predicted motion is joined": lambda: replace(
        predicted(ROOTED, swayed(5, 123), segments=2), joins=joins(0, 0, 0, 2)
    ).file(),
    "joins-0 BAD_CHUNK_TABLE: a segment is joined over 0 frames": lambda: not_refused(
        lambda: joined(FORK, 500, 0, 0.5, 0, 0, 0, 0).draft()
    ),
}.items():
    invalid(title, make)


def apart(stems: list[Stem], seed: int, *widths: float, **fields) -> Plant:
    """Return the same, of segments that move in different ways."""
    plant = joined(stems, seed, *widths, **fields)
    plant.scripts = {}
    for level, s in product(range(8), range(len(widths))):
        plant.scripts[STEMS, level, s] = chance = seed + 100 * s + level
        plant.scripts[AFFINES, level, s] = lambda chance=chance: Chance(chance + 50, large=4)
    return plant


valid(
    "joins-clips-apart: the first segment of a loop of two goes on from the loop's last one, not from the clip before, "
    "and each moves in its own way",
    lambda: apart(
        FORK,
        3000,
        *(0, 2, 3.5, 3.5) * 3,
        clips=(Clip(12, 2, "once"), loop(Clip(11, 2, "loop"), 0.0, 0.0, 0.0)),
        is_float64=True,
    ),
)
