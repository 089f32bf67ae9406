"""STEMS: pieces, their modes, sheets, tangents."""

from spec.make.base import *
from spec.make.bases import basis

NOT_A_NUMBER = [Stem(-1, 3), Stem(0, 2, 2), Stem(1, 1, 1, SHEET)]


def stems(*head, **fields) -> Callable[[], bytes]:
    """Return STEMS of level 1 with another head."""
    return lambda: stems_head(*head, **fields) + fork().content(STEMS, 1, 0)[6:]


def stems_motion(head: bytes, frames: int):
    made = rules.no_motion(forked_plan(), frames, False)
    rules.read_stems_head(head, made, 1)
    return made


def along_x(*places: float) -> list[list[float]]:
    return [[x, 0.5 * (i % 2), 0.0] for i, x in enumerate(places)]


class Counts(Chance):
    """Rows of 20 to 40 frequencies, most of them of 30 and 31, and empty ones."""

    def answer(self, asked: str, most: int):
        if asked == "count":
            return min(most, int(self.random.choice([0, 20, 29, 30, 30, 31, 31, 32, 40])))
        return int(self.random.integers(-1, 2) * self.random.integers(0, 2))


for title, make in {
    "smallest: one vertex, one frame, nothing moves": lone,
    "smallest-wide: the same with binary64 positions and rest pose": lambda: lone(is_float64=True),
    "one-vertex-moves: one vertex whose translation has three frequencies in five frames": lambda: lone(
        frames=5, scripts={(STEMS, 0): row((1, 2, 3), (-40, 5, 0), (7, 0, -1))}
    ),
    "one-frame: a bush in a single frame": lambda: moving(FORK, 5, frames=1, heads=HEADS),
    "all-equal: all vertices at one point: no length, no extent, no rotations, no maps": lambda: moving(
        [Stem(-1, 4), Stem(0, 2, 1), Stem(0, 2, 3, SHEET)], 6, points=[[1.0, 1.0, 1.0]] * 8, heads=HEADS
    ),
    "all-at-origin: all vertices at the origin, and the origin 0": lambda: still([Stem(-1, 3)], points=[[0.0] * 3] * 3),
    "empty-streams: streams all of whose decisions are 1 and that have no bytes": lambda: still(FORK, frames=3),
    "loose: LOOSE branches: a node by its modes, one with a map of its own, one inside a WHOLE subtree": lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1, LOOSE), Stem(0, 3, 2, LOOSE), Stem(2, 2, 1, WHOLE), Stem(3, 2, 0, LOOSE)],
        13,
        heads=HEADS,
    ),
    "loose-long: a LOOSE stem of two pieces: only its first has a translation": lambda: moving(
        [Stem(-1, 2), Stem(0, 65, 1, LOOSE)], 14, frames=2, heads=HEADS
    ),
    "long-stem: a stem of 129 vertices: three pieces, a root with a map of its own": lambda: moving(
        [Stem(-1, 129)], 15, frames=2, heads=HEADS
    ),
    "stem-of-64: a stem of 64 vertices: one piece, by its modes": lambda: moving([Stem(-1, 64)], 16, frames=2),
    "sheet: SHEET branches that others hang on: flat, of one vertex, of two, in a line": lambda: moving(
        [Stem(-1, 9, 0, SHEET), Stem(0, 1, 4, SHEET), Stem(1, 2, 0, SHEET), Stem(0, 5, 8, SHEET), Stem(3, 2, 4)],
        17,
        frames=4,
        heads=HEADS,
        points=[[float(i % 3), float(i // 3), 0.0] for i in range(9)]
        + [[5.0, 1.0, 1.0]]
        + [[6.0, 1.0, 1.0], [6.0, 2.0, 1.0]]
        + [[2.0 + i, 2.0, 0.0] for i in range(5)]
        + [[7.0, 2.0, 1.0], [8.0, 2.0, 1.0]],
    ),
    "sheet-long: a SHEET of 70 vertices in two pieces, and a branch on the second": lambda: moving(
        [Stem(-1, 70, 0, SHEET), Stem(0, 2, 69)], 18, frames=2, heads=HEADS
    ),
    "sheet-mirrored: a sheet that is turned inside out: the gradient is followed, not Newton's step": lambda: Plant(
        [Stem(-1, 4, 0, SHEET), Stem(0, 2, 3)],
        2,
        points=[[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0], [0.0, 0.0, 9.0], [0.0, 0.0, 10.0]],
        scripts={
            (STEMS, 1): [
                *row(),
                0,
                *row((0, 0, 0), (-200, 30, 0)),
                *row((0, 0, 0), (0, -170, 0)),
                *row((3, 3, -160), (0, 0, 40)),
            ]
        },
    ),
    "tangent-opposed: a parent that folds back on itself: the kept rotation is not turned": lambda: Plant(
        [Stem(-1, 2), Stem(0, 2, 1)],
        2,
        points=[[0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 8.0, 0.0], [0.0, 9.0, 1.0]],
        scripts={(STEMS, 1): [*row(), *row((0, -60, 0), (0, 60, 0)), *row((0, -9, 1))]},
    ),
    "tangent-none: coincident vertices: no tangent to follow, at rest and in motion": lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(0, 2, 2)],
        19,
        points=[[1.0, 2.0, 3.0]] * 3 + [[1.0, 3.0, 3.0], [1.0, 4.0, 3.0], [1.0, 2.0, 3.0], [2.0, 2.0, 3.0]],
    ),
    "rotations: every rotation factor there is: 0, 1, 8": lambda: moving(
        [Stem(-1, 3), *(Stem(b, 2, 1) for b in range(4))], 21, frames=4, heads=HEADS
    ),
    "frames-256: a segment of as many frames as there can be, with rows that code all of them": lambda: lone(
        frames=256, scripts={(STEMS, 0): row(*[(1, 0, -1)] * 256), (STEMS, 1): []}
    ),
    "frames-257: one frame more: segments of 128 and 129": lambda: moving([Stem(-1, 2)], 24, frames=257, segments=2),
    "steps-per-segment: segments with steps, rotations and bases of their own": lambda: moving(
        FORK,
        27,
        frames=6,
        segments=2,
        heads={
            (1, 0): stems_head(0.5, 2),
            (1, 1): stems_head(0.001, 0),
            (2, 1): stems_head(0.25, 1, 2, 2, basis_stream([[6400, -6400, 6400], [8192, 0, -8192]])),
        },
    ),
    "steps-largest: Step at the end of binary32: infinities and NaN as the arithmetic yields them": lambda: moving(
        FORK, 41, heads={level: stems_head(FLOAT_MAX, 2) for level in range(3)}
    ),
    "steps-smallest: the smallest Step": lambda: moving(
        FORK, 42, heads={level: stems_head(FLOAT_TINY, 2) for level in range(3)}
    ),
    "numbers-largest: integers at the ends of what a stream can hold": lambda: lone(
        frames=3, scripts={(STEMS, 0): row((2**30 - 1, 1 - 2**30, 0), (2**29, -1, 1), (2**20 + 1, 0, 9))}
    ),
    "not-a-number: vertices at NaN, others hang on them": lambda: Plant(
        NOT_A_NUMBER,
        2,
        heads={level: stems_head(FLOAT_MAX, 1) for level in range(4)},
        rest=exact_rest(NOT_A_NUMBER, (1e200 * np.array(grown(NOT_A_NUMBER, 4))).ravel().tolist(), True),
        scripts={(STEMS, level): lambda level=level: Chance(57 + level, empty=0.1, large=25) for level in range(4)},
    ),
}.items():
    valid(title, make)

motion(STEMS, 1, "empty: no bytes", b"")
motion(STEMS, 1, "short: 5 bytes", bytes(5))
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    motion(STEMS, 1, f"step-{word}: Step is {value}", stems(value))
for title, make in {
    "rotation-3: Rotation 3": stems(0.5, 3),
    "rotation-8: bit 3 of Rotation": stems(0.5, 8),
    "rotation-turn-3: Turn 1 and Rotation 3": stems(0.5, 19),
    "frequencies: a row codes three frequencies of two": lambda: (
        stems_head() + write(rules.decode_stems, [3], forked_plan(), stems_motion(stems_head(), 2), 1)
    ),
    "frequencies-of-basis: a row codes two frequencies of a learned basis of rank 1": lambda: (
        basis(1, 2, basis_stream([[64, 128]]))()
        + write(rules.decode_stems, [2], forked_plan(), stems_motion(basis(1, 2, basis_stream([[64, 128]]))(), 2), 1)
    ),
    "zero-behind: a zero byte behind the stream": lambda: fork().content(STEMS, 1, 0) + b"\0",
}.items():
    motion(STEMS, 1, title, make)

motion(
    STEMS,
    2,
    "bytes-behind: bytes behind the stream of the second segment",
    lambda: fork().content(STEMS, 2, 1) + b"\1" * 12,
    1,
)
valid(
    "gaps: distances along stems of under 1/4 to over 16 of their mean, of which 1 to 64 quarters are told apart",
    lambda: placed(
        [Stem(-1, 24), Stem(0, 20, 3)],
        along_x(*range(12), *range(1011, 1023)) + along_x(3, *range(30, 40), 40.01, 40.02, 40.02, *range(241, 247)),
        131,
    ),
)
valid(
    "rows-of-30: rows of 30 and 31 frequencies, which are expected differently",
    lambda: Plant([Stem(-1, 9)], frames=40, scripts={(STEMS, k): lambda k=k: Counts(511 + k) for k in (0, 1)}),
)
motion(
    STEMS,
    1,
    "frequencies-1023: a row codes 1023 frequencies of two: as long as a number of them can be",
    lambda: stems_head() + write(rules.decode_stems, [1023], forked_plan(), stems_motion(stems_head(), 2), 1),
)
valid(
    "gaps-of-62-quarters: a distance along a stem of 15 times the mean",
    lambda: placed([Stem(-1, 24)], [[x + 38.2 * (x > 9), 0, 0] for x in range(24)], 516, is_float64=True),
)
valid(
    "tangent-short-exactly: a stem whose squares add up to 1e-200, which has no direction",
    placed,
    [Stem(-1, 2), Stem(0, 2, 1)],
    [[0, 0, 0], [2.207934554570487e-101, 9.753205883335675e-101, 0], [0, 1, 1], [0, 2, 1]],
    138,
)
