"""AFFINES: maps of nodes."""

from spec.make.base import *


def affines(*script) -> Callable[[], bytes]:
    def make() -> bytes:
        plan = forked_plan()
        return write(rules.decode_affines, list(script), plan, rules.no_motion(plan, 2, False), 0)

    return make


valid(
    "whitening: nodes whose subtrees extend in 0, 1, 2 and 3 directions",
    moving,
    [Stem(-1, 2), Stem(0, 1, 1), Stem(-1, 2), Stem(2, 1, 1), Stem(-1, 2), Stem(4, 2, 1), Stem(-1, 2), Stem(6, 3, 1)],
    20,
    heads=HEADS,
    points=points_of(
        "0 0 0, 0 0 0, 0 0 0, 5 0 0, 6 1 0, 7 2 0, 0 5 0, 1 5 0, 1 6 0, 3 9 0, 0 0 9, 1 0 9, 1 2 9, 1 2 12, 2 3 14"
    ),
)
valid(
    "maps-largest: maps whose steps are 2^100 and 2^-100 in turn",
    Plant,
    [Stem(-1, 2), Stem(0, 1, 1), Stem(-1, 2), Stem(2, 1, 1), Stem(-1, 2), Stem(4, 1, 1)],
    2,
    points=[[float(x), 0.0, 0.0] for x in range(9)],
    scripts={
        (AFFINES, 0): [
            200,
            *row((1, 2, 3)),
            *row((0, 1, 0)),
            -400,
            *row((5, 5, 5)),
            *row(),
            399,
            *row(),
            *row((0, 0, 1)),
        ]
    },
)
motion(AFFINES, 0, "step-beyond: the step of a map is 2^100.5", affines(201))
motion(AFFINES, 0, "step-below: the step of a map is 2^-100.5", affines(-201))
motion(AFFINES, 0, "frequencies: a row codes three frequencies of two frames", affines(0, 3))
motion(AFFINES, 0, "zero-behind: a zero byte behind the stream", lambda: fork().content(AFFINES, 0, 1) + b"\0", 1)
motion(AFFINES, 0, "bytes-behind: bytes behind the stream", lambda: fork().content(AFFINES, 0, 0) + b"\1" * 12)
invalid(
    "affines-change BAD_CHUNK 0: a step changes by more than 400",
    lambda: Plant(
        [Stem(-1, 2), Stem(0, 1, 1), Stem(-1, 2), Stem(2, 1, 1)],
        points=[[0.0] * 3] * 6,
        scripts={(AFFINES, 0): [200, 0, -401]},
    ),
)
for side_, width_ in (("above", 203), ("below", 197)):
    valid(
        f"whitening-{side_}: a node that extends {side_} 1/100 as far in its second direction as in its first",
        lambda width_=width_: placed([Stem(-1, 2), Stem(0, 1, 1)], [[0, 0, 0], [10000, 0, 0], [10000, width_, 0]], 134),
    )
