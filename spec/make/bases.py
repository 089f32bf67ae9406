"""Waves over time and learned bases."""

from spec.make.base import *
from spec.make.clips import periodic
from spec.make.predicted import SINGLE


def all_waves(frames: int) -> Callable[[], Plant]:
    clips = Clip(frames, 1, "once"), periodic(Clip(frames, 1, "again"), 0.0, 0.0)
    rows = row(*(tuple((k + axis) % 5 - 2 for axis in range(3)) for k in range(frames)))
    return lambda: lone(clips=clips, scripts={(STEMS, 0): rows})


WAVE_ROWS = (  # Four rows over four frames: exponents, integers; unused axes of the last row are not 0.
    *(-6, 3, -1),
    *row((9, 0, 1), (-4, 60, 0), (0, 2, 700)),
    -200 + 4,
    *row((1, 2, 3), (5, 0, 0)),
)


def basis_by_chance(random: np.random.Generator, rank: int, frames: int) -> bytes:
    return basis_stream(random.integers(-8192, 8193, (rank, frames)).tolist())


def basis(rank: int, kind: int, stream: bytes) -> Callable[[], bytes]:
    return lambda: stems_head(0.5, 0, kind, rank, stream)


def shrunk(last: int) -> Plant:
    """Return a plant whose learned basis has a row of which about 1e-100 remains once it is made orthogonal to 15 known
    rows. `last` / 8192 is every entry of the last known row.
    """
    known = [[1235] * 44] * 14 + [[last] * 44]
    rows = [[entry / 8192 for entry in entries] for entries in known]
    in_waves = basis_in_waves(44, -200, *row((1, 0, 0)), rank=16, known=rows)
    return Plant(
        [Stem(-1, 3)],
        frames=44,
        heads={0: stems_head(0.25, 0, 2, 15, basis_stream(known)), 1: stems_head(0.25, 0, 1, 16, in_waves, base=0)},
        scripts={(STEMS, 1): row(*[(0, 0, 0)] * 15, (50, -30, 10))},
    )


ROUNDED = (263597123, 32053444), (241475353, 36228921), (79323412, 26324395), (170050111, 70213091)


for frames in (2, 3, 4, 7, 33, 255, 256):
    valid(f"waves-{frames}: all waves of {frames} frames, once of a beam and once periodic", all_waves(frames))
for title, make in {
    "learned-basis: a learned basis of one row, at the ends of its range": lambda: lone(
        frames=4,
        heads={0: stems_head(0.5, 0, 2, 1, basis_stream([[8192, -8192, 8192, 0]]))},
        scripts={(STEMS, 0): row((3, -1, 70))},
    ),
    "learned-basis-full: a learned basis of as many rows as frames, beside waves on other levels": lambda: moving(
        FORK, 43, heads={1: stems_head(0.5, 1, 2, 3, basis_stream([[8192, 1, -5], [-8192, 8192, -8192], [0, 0, 77]]))}
    ),
    "learned-basis-zero: a learned basis of zeros, of no bytes but the stream's": lambda: moving(
        [Stem(-1, 3)], 44, heads={0: stems_head(0.5, 1, 2, 2, basis_stream([[0] * 3] * 2))}
    ),
    "basis-in-waves: a learned basis of four rows in waves, one of them of the least step": lambda: moving(
        FORK, 45, frames=4, heads={1: stems_head(0.5, 1, 1, 4, basis_in_waves(4, *WAVE_ROWS, rank=4))}
    ),
    "basis-in-waves-zero: a learned basis of two rows in waves: one of zeros, and one like the first of its level "
    "before": lambda: moving(
        FORK,
        46,
        frames=4,
        heads={
            1: stems_head(0.5, 1, 1, 2, basis_in_waves(4, 0, 0, *row((1, 0, 0), (2, 0, 0)), rank=2)),
            2: stems_head(0.25, 0, 1, 3, basis_in_waves(4, 8, *row((1, 0, 0), (2, 0, 0)), rank=1), base=1),
        },
    ),
    "basis-shared: levels that share a learned basis, which lies with the first of them": lambda: moving(
        FORK,
        47,
        frames=4,
        heads={
            1: stems_head(0.5, 1, 1, 4, basis_in_waves(4, *WAVE_ROWS, rank=4)),
            2: stems_head(0.25, 0, 1, 4, b"", base=1),
        },
    ),
    "basis-of-both-kinds: learned bases in waves that begin with rows by their entries, and the "
    "other way round": lambda: moving(
        FORK,
        48,
        frames=4,
        segments=1,
        heads={
            1: stems_head(0.5, 1, 2, 1, basis_stream([[8192, -8192, 8192, 6400]])),
            2: stems_head(0.25, 0, 1, 3, basis_in_waves(4, -3, 2, *row((3, 1, 0), (0, 2, 0)), rank=2), base=1),
            3: stems_head(0.25, 0, 2, 4, basis_stream([[160, 192, 224, -6400]]), base=2),
        },
    ),
}.items():
    valid(title, make)

motion(STEMS, 1, "basis-3: Basis 3", basis(1, 3, basis_stream([[0, 0]])))
motion(STEMS, 1, "basis-255: Basis 255", basis(1, 255, basis_stream([[0, 0]])))
motion(STEMS, 1, "rank-0: Basis_Rank 0 though there is a basis", basis(0, 2, b""))
motion(
    STEMS, 1, "rank-more-than-frames: Basis_Rank 3 in a segment of two frames", basis(3, 2, basis_stream([[0, 0]] * 3))
)
motion(STEMS, 1, "basis-length-missing: the chunk ends inside Basis_Length", lambda: stems_head(0.5, 0, 2, 1)[:11])
motion(
    STEMS,
    1,
    "basis-length-more: Basis_Length is more than the chunk holds",
    lambda: struct.pack("<fBBHBI", 0.5, 0, 2, 1, 255, 100) + basis_stream([[64, 128]]),
)
for name, level, reason, base in (
    ("own", 1, "Basis_Stage is the level itself", 1),
    ("later", 1, "Basis_Stage is a later level", 2),
    ("waves", 2, "Basis_Stage is a level in waves", 1),
    ("missing", 2, "Basis_Stage is a level without STEMS", 0),
):
    motion(
        STEMS, level, f"basis-level-{name}: {reason}", lambda base=base: stems_head(0.5, 0, 2, 1, base=base), segment=1
    )
invalid(
    "stems-basis-level-rank BAD_CHUNK 2: Basis_Rank 1 though Basis_Stage has a basis of two rows",
    lambda: forked(heads={1: stems_head(0.5, 0, 2, 2, basis_stream([[64, 128], [192, 256]]))}).change(
        STEMS, 2, 0, content=stems_head(0.5, 0, 2, 1, base=1)
    ),
)
motion(STEMS, 1, "basis-beyond-1: an entry of a learned basis is 8193", basis(1, 2, basis_stream([[8192, 8193]])))
motion(STEMS, 1, "basis-below-1: an entry of a learned basis is -8193", basis(1, 2, basis_stream([[-8193, 0]])))
for name, reason, exponents in (
    ("change", "an exponent of a row of a basis changes by 401", (-200, 401)),
    ("high", "an exponent of a row of a basis is 201", (201, 0)),
    ("low", "an exponent of a row of a basis is -201", (0, -201)),
):
    motion(
        STEMS,
        1,
        f"basis-exponent-{name}: {reason}",
        lambda exponents=exponents: basis(2, 1, basis_in_waves(2, *exponents, *row((1, 1, 0)), rank=2))(),
    )
for title, make in {
    "basis-in-waves-frequencies: a row of a basis codes three frequencies of two frames": lambda: basis(
        1, 1, basis_in_waves(2, 0, *row((1, 0, 0), (1, 0, 0), (1, 0, 0)), rank=1)
    )(),
    "basis-in-waves-zero-behind: a zero byte behind the stream of a basis in waves": lambda: basis(
        1, 1, basis_in_waves(2, 0, *row((1, 0, 0)), rank=1) + b"\0"
    )(),
    "basis-zero-behind: a zero byte behind the stream of a basis": basis(1, 2, basis_stream([[64, 128]]) + b"\0"),
}.items():
    motion(STEMS, 1, title, make)

valid(
    "basis-exponents: the exponent of a row of a basis is -200, and 400 more in the next",
    Plant,
    SHORT,
    frames=2,
    heads={0: stems_head(0.25, 0, 1, 2, basis_in_waves(2, -200, 400, *row((1, 1, 0), (2, -1, 0)), rank=2))},
    scripts={(STEMS, 0): 513},
)
for title, make in {
    "basis-length-one-more: Basis_Length is one more than the chunk holds": lambda: (
        struct.pack("<fBBHBI", 0.5, 0, 2, 2, 255, 1 + len(IMPULSES)) + IMPULSES
    ),
    "basis-length-cut: the chunk ends before the last byte of Basis_Length": lambda: stems_head(0.5, 0, 2, 1)[:12],
}.items():
    motion(STEMS, 1, title, make)

valid(
    "basis-of-level-0: learned bases that begin with that of level 0",
    Plant,
    SHORT,
    frames=3,
    heads={
        0: stems_head(0.25, 0, 2, 1, basis_stream([[6336, -8192, 192]])),
        1: stems_head(0.25, 0, 2, 2, basis_stream([[8192, 0, -2464]]), base=0),
    },
    scripts={(STEMS, 0): 514, (STEMS, 1): 515},
)
for side, last in (("above", 1237), ("below", 1236)):
    valid(
        f"basis-short-{side}: a row of a basis whose squares add up to {side} 1e-200, since the known rows are no unit "
        "vectors",
        lambda last=last: shrunk(last),
    )
valid(
    "basis-rounded: rows of bases, of which an entry is within 2^-56 of the middle between two numbers of binary32",
    Plant,
    [Stem(-1, 2)],
    frames=8,
    segments=4,
    heads={
        (0, s): stems_head(0.25, 0, 1, 1, basis_in_waves(2, 0, *row((a, 0, 0), (b, 0, 0)), rank=1))
        for s, (a, b) in enumerate(ROUNDED)
    },
    is_float64=True,
    scripts={(STEMS, 0): [*row((1, 3, 0)), *row((0, 1, 7))]},
)
valid(
    "waves-of-nodes-8: all waves of maps of 8 frames; what the third one is computed from goes to and fro by the "
    "last bit, for 32 times",
    Plant,
    FORK,
    frames=8,
    is_float64=True,
    points=[[0, 0, 0], [1, 0, 2], [2, 0, 4], [1, 3, 2], [1, 5, 3]],
    scripts={(AFFINES, 0): [0, *row(), *row(), *row(*[(k == 2, k == 5, 3 - k) for k in range(8)])]},
)
valid(
    "waves-of-stems-66: the fourth wave of 66 frames, of which the same is true",
    Plant,
    SINGLE,
    frames=66,
    is_float64=True,
    points=[[0, 0, 0]],
    scripts={(STEMS, 0): row((0, 0, 0), (0, 0, 0), (0, 0, 0), (1, -3, 7))},
)
