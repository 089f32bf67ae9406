"""REST: adaptive rest poses and detail."""

from __future__ import annotations

from dataclasses import replace

from spec.document import rules
from spec.make.base import *
from spec.make.rest import with_rest


def adaptive_rest(
    stems: list[Stem], script: list | Chance, step: float = 0.25, connected: bool = False, **fields
) -> bytes:
    stream = write(rules.decode_rest, script, branches_of(stems), step, None, True)
    bits = REST_ADAPTIVE | REST_CONNECTED * connected
    return rest_chunk(stream, step=step, reserved=bits >> 2, **fields)


ADAPTIVE = [  # every filter, phases within lags and across stems, rows of several vertices, a beam among them
    Stem(-1, 30, lag=1),
    Stem(0, 12, 3, lag=2),
    Stem(0, 12, 4, lag=3),
    Stem(2, 14, 5, SHEET, lag=4),
    Stem(0, 40, 9, SHEET, lag=7),
    Stem(-1, 9, lag=0),
    Stem(5, 3, 2, lag=65535),
]
valid(
    "rest-adaptive",
    "an adaptive rest pose",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, Chance(33, large=6), rest_type=1)),
)
valid(
    "rest-adaptive-phases",
    "an adaptive rest pose of a lag of more vertices than there are phases",
    lambda: with_rest([Stem(-1, 900, lag=300)], adaptive_rest([Stem(-1, 900, lag=300)], Chance(34, large=3))),
)
valid(
    "rest-adaptive-still",
    "an adaptive rest pose without bytes, which is a point",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, [])),
)
valid(
    "rest-adaptive-vast",
    "integers of 30 bits under the largest Rest_Step: weighted guesses are out of range",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, Chance(35, large=29), FLOAT_MAX)),
)
valid(
    "rest-adaptive-tiny",
    "a subnormal Rest_Step",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, Chance(36, large=9), FLOAT_TINY)),
)
DETAILED = [  # finer and coarser than the step, the largest and the smallest, alike and unlike by lag
    replace(stem, detail=detail) for stem, detail in zip(ADAPTIVE, (0, 121, 118, 0, 255, 110, 1))
]
valid(
    "rest-detail",
    "steps of branches of their own, in an adaptive rest pose and in beams",
    lambda: with_rest(DETAILED, adaptive_rest(DETAILED, Chance(37, large=6))),
)
valid(
    "rest-detail-steps",
    "the same in a rest pose that is not adaptive",
    lambda: with_rest(DETAILED, rest_chunk(write(rules.decode_rest, Chance(38, large=6), branches_of(DETAILED), 0.25))),
)


def adaptive_fork() -> bytes:
    return adaptive_rest(FORK, Chance(37, large=4))


prelude("adaptive-zero-behind", REST, "a zero byte behind an adaptive rest pose", lambda: adaptive_fork() + b"\0")
prelude("adaptive-bytes-behind", REST, "bytes behind an adaptive rest pose", lambda: adaptive_fork() + b"\1" * 12)
LONE_POINTS = [Stem(-1, 1, lag=2), Stem(-1, 1, lag=2), Stem(-1, 1, lag=2, detail=100), Stem(-1, 1, lag=2, detail=100)]
FAR_UNITS = [10**9, 495 * 10**6, 515 * 10**6]  # units in x, in y and z pairs of them
valid(
    "rest-adaptive-far",
    "what is expected by the weights is 10^9 units, a little less, or more than is allowed",
    lambda: with_rest(
        LONE_POINTS,
        adaptive_rest(LONE_POINTS, [0, *FAR_UNITS, 0, 0, 0, *(-n for n in FAR_UNITS), 0, 0, 0], rest_type=1),
    ),
)
LAGS = [Stem(-1, 12, lag=4), Stem(0, 17, 2, lag=5), Stem(0, 262, 4, SHEET, lag=256)]
valid(
    "rest-adaptive-lags",
    "lags of 4 and 5, of which one has filters by phase, and of 256, of which a phase has two vertices",
    lambda: with_rest(LAGS, adaptive_rest(LAGS, Chance(410, large=3, empty=0.0), rest_type=1)),
)
