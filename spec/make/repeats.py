"""Repeats of frames."""

from spec.make.base import *
from spec.make.clips import periodic
from spec.make.joins import joined
from spec.make.predicted import ROOTED, predicted, swayed

TWOS, THREES = (0, 1) * 6, (0, 1, 1) * 4


def repeats_by_chance(frames: int) -> tuple[int, ...]:
    random, repeats = np.random.default_rng(420), list[int]()
    while len(repeats) < frames:
        repeats += [0] * random.choice([1, 2, 6]) + [1] * random.choice([1, 1, 2, 3, 10])
    return (*repeats[: frames - 1], 0)


valid(
    "repeats: poses held for one to eleven frames", moving, FORK, 124, frames=14, repeats=(0, 0, *(0, 1), *(1,) * 9, 0)
)
valid("repeats-of-one: all frames are alike, and one is coded", moving, FORK, 125, frames=12, repeats=(0, *(1,) * 11))
valid(
    "repeats-by-chance: now many poses that are held, now few, for one frame to ten",
    lambda: moving(FORK, 420, frames=160, repeats=repeats_by_chance(160)),
)
valid("repeats-joined: over all coded frames that may be", lambda: joined(FORK, 126, *(0, 1.5) * 3, repeats=TWOS))
valid(
    "repeats-clips: a periodic loop, and a clip of which a segment has no repeats",
    moving,
    FORK,
    127,
    heads=HEADS,
    clips=(periodic(Clip(6, 1, "loop"), 0.0, 0.0, 0.0), Clip(12, 2, "once")),
    repeats=(*TWOS, *(0,) * 6),
)
valid("repeats-layers: two layers", lambda: refinements(MIXED, 128, frames=12, repeats=THREES))
valid(
    "repeats-predicted: predicted motion", lambda: replace(predicted(ROOTED, swayed(4, 129)), frames=12, repeats=THREES)
)
valid(
    "repeats-lossless: the source's own numbers",
    lambda: (
        moving(FORK, 130, frames=12, repeats=THREES)
        .with_header(level_count=4, full_level_count=4)
        .add(Entry(EXACT, b"", 3, 0))
    ),
)
for name, reason, widths, repeats in (
    ("first", "the first frame of the second segment is a repeat", (0, 0), (*(0,) * 6, 1, *(0,) * 5)),
    ("join-too-long", "a join over as many frames as are coded, less one", (0, 3), (*(0,) * 7, 1, 1, *(0,) * 3)),
    ("join-to-one", "a segment goes on from one with a single coded frame", (0, 2), (0, *(1,) * 5, *(0,) * 6)),
):
    invalid(
        f"repeats-{name} BAD_CHUNK_TABLE: {reason}",
        lambda widths=widths, repeats=repeats: joined(FORK, 136, *widths * 3, repeats=repeats).file(),
    )
