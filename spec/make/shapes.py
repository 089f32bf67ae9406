"""SHAPES: learned shapes."""

from spec.make.base import *


def shapes(*script) -> Callable[[], bytes]:
    def make() -> bytes:
        plan = forked_plan()
        return write(rules.decode_shapes, list(script), plan, rules.no_motion(plan, 1, False), 1)

    return make


LONE_STEMS = [Stem(-1, 3, rigid=1), Stem(-1, 3), Stem(-1, 3, flags=SHEET, rigid=1)]


for title, make in {
    "shapes: learned shapes at base levels and at the levels that complete a piece, in both segments": fork,
    "shapes-high: as many shapes as there can be: of the first modes, then of the others": lambda: Plant(
        [Stem(-1, 4)],
        3,
        scripts={
            (SHAPES, 0, 0): [6, *(n for i in range(6) for n in row((1, -i, 2), (i, 5, 0), (0, 0, 3)))],
            (SHAPES, 1, 0): [6, *(n for i in range(6) for n in row((0, 1, i), (0, -i, 0), (2, 2, 2), (9, 9, i)))],
            (STEMS, 0): 45,
            (STEMS, 1): 46,
        },
    ),
    "shapes-few: a shape less than its mode has axes, and none at the level that completes the piece": lambda: Plant(
        [Stem(-1, 20)],
        3,
        scripts={
            (SHAPES, 0, 0): [2, *row((2**29, 0, 0)), *row(*[(0, 0, 0)] * 15, (1, 0, 0))],
            (SHAPES, 1, 0): [],
            (STEMS, 0): 47,
            (STEMS, 1): 48,
        },
    ),
    "shapes-of-sheets: shapes of a sheet, and of pieces inside a WHOLE subtree": lambda: Plant(
        [Stem(-1, 4, 0, SHEET), Stem(0, 3, 3, WHOLE), Stem(1, 2, 1, SHEET)],
        3,
        scripts={
            (SHAPES, 1, 0): [3, *row((1, 2, 3)), *row((3, 2, 1), (1, 1, 1)), *row((0, 0, 5))],
            (SHAPES, 2, 0): [1, *row((4, 0, 0)), 2, *row((0, 7, 0)), *row((0, 0, 7))],
            (STEMS, 1): 49,
            (STEMS, 2): 50,
            (AFFINES, 0): lambda: Chance(51, large=3),
            (AFFINES, 1): lambda: Chance(52, large=3),
        },
    ),
    "shapes-in-one-level: shapes at the last level alone, of pieces that begin there": lambda: Plant(
        [Stem(-1, 2), Stem(0, 2, 1, WHOLE), Stem(1, 2, 1)],
        2,
        scripts={(SHAPES, 2, 0): [2, *row((1, 0, 0)), *row((0, 1, 1))], (STEMS, 2): 53},
    ),
}.items():
    valid(title, make)

motion(SHAPES, 1, "too-many: a piece of three modes has ten shapes", shapes(10))
motion(SHAPES, 1, "too-many-of-base: a piece whose base level has two modes has seven shapes there", shapes(0, 7))
motion(SHAPES, 1, "all-zero: a shape is all 0", shapes(1, *row((0, 0, 0))))
motion(SHAPES, 1, "empty-row: a shape whose row is empty", shapes(1, 0))
motion(SHAPES, 1, "modes: a shape has numbers for four modes of three", shapes(1, 4))
motion(SHAPES, 1, "zero-behind: a zero byte behind the stream", lambda: fork().content(SHAPES, 1) + b"\0")
motion(SHAPES, 1, "bytes-behind: bytes behind the stream", lambda: fork().content(SHAPES, 1) + b"\1" * 12)
invalid(
    "shapes-too-many-at-last BAD_CHUNK 1: a level adds more shapes than the other modes have axes",
    lambda: Plant(
        [Stem(-1, 3)],
        scripts={(SHAPES, 0, 0): [6, *(n for i in range(6) for n in row((1, i, 0)))], (SHAPES, 1, 0): [4]},
    ),
)
valid(
    "shapes-of-rigid: SHAPES of rigid stems, which have no modes: both levels have a number of shapes of each, 0",
    lambda: moving(
        LONE_STEMS,
        505,
        heads=HEADS,
        scripts=moving(LONE_STEMS, 505).scripts
        | {
            (SHAPES, 0, 0): [0, 6, *(n for i in range(6) for n in row((1, i, 0), (0, 2, 5 - i))), 0],
            (SHAPES, 1, 0): [0, 2, *row((0, 1, 0)), *row((0, 0, 1), (4, 0, 0)), 0],
        },
    ),
)
valid(
    "shapes-in-both-parts: a stream with the first shapes of two pieces and the further ones of a third, whose numbers "
    "are expected about others",
    lambda: Plant(
        [Stem(-1, 6), Stem(0, 4, 5), Stem(1, 3, 3), Stem(0, 4, 3)],
        2,
        scripts={
            (SHAPES, 1, 0): [1, *row((1, 2, 3)), 6, *(n for i in range(6) for n in row((i, 1, 0), (2, 0, -i)))],
            (SHAPES, 2, 0): [
                *(3, *row((1, 0, 0)), *row((0, 1, 2)), *row((0, 0, 3), (1, 1, 1))),
                *(2, *row((4, 0, 1)), *row((0, -1, 0))),
                *(4, *row((1, 0, 5)), *row((0, 2, 0)), *row((3, 3, 0)), *row((0, 0, 1), (0, 1, 0))),
            ],
            **{(STEMS, level): 48 + level for level in (1, 2, 3)},
        },
    ),
)
