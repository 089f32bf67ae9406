"""REST: the reference pose by steps, beams and exact numbers."""

from __future__ import annotations

from spec.document import rules
from spec.make.base import *

AWKWARD_FLOATS = [-0.0, FLOAT_TINY, -FLOAT_MAX, FLOAT_MAX, 1.0, -1e-40, 0.0, 1 + 2**-23, -1.0]
AWKWARD_DOUBLES = [-0.0, TINY, -1e300, 1e300, 1.0, -1e-310, 0.0, 1 + 2**-52, -1.0]


def coded_rest(stems: list[Stem], script: list | Chance, **fields) -> bytes:
    return rest_chunk(write(rules.decode_rest, script, branches_of(stems), 1.0), **fields)


def with_rest(stems: list[Stem], rest: bytes, **fields) -> Plant:
    return Plant(stems, rest=rest, **fields)


valid(
    "rest-lags",
    "rest poses by steps, predicted from 1, 2 and 3 vertices before",
    lambda: still(
        [Stem(-1, 7, lag=1), Stem(0, 6, 3, lag=2), Stem(1, 8, 5, lag=3)],
        points=grown([Stem(-1, 7), Stem(0, 6, 3), Stem(1, 8, 5)], 3),
    ),
)
valid(
    "rest-lag-65535",
    "the largest Lag: every vertex is expected where the one before is",
    lambda: still([Stem(-1, 3, lag=65535)]),
)
valid(
    "rest-beams",
    "beams: runs of 1, 16 and 17 and of 32 vertices, from roots and from attach vertices",
    lambda: with_rest(
        [Stem(-1, 2, lag=0), Stem(0, 33, 1, lag=0), Stem(0, 32, 0, lag=0), Stem(-1, 1, lag=0)],
        coded_rest([Stem(-1, 2, lag=0), Stem(0, 33, 1, lag=0), Stem(0, 32, 0, lag=0), Stem(-1, 1, lag=0)], Chance(31)),
    ),
)
valid(
    "rest-beams-and-steps",
    "stems of both kinds that share their models",
    lambda: with_rest(
        [Stem(-1, 5, lag=0), Stem(0, 3, 1, lag=1), Stem(0, 4, 4, lag=0)],
        coded_rest(
            [Stem(-1, 5, lag=0), Stem(0, 3, 1, lag=1), Stem(0, 4, 4, lag=0)],
            Chance(32),
            rest_type=1,
            origin=(1e6, -0.5, 3.0),
        ),
    ),
)
valid(
    "rest-exact",
    "binary32 bit for bit: -0.0, subnormal and largest numbers",
    lambda: with_rest([Stem(-1, 3)], exact_rest([Stem(-1, 3)], AWKWARD_FLOATS, False)),
)
valid(
    "rest-exact-wide",
    "binary64 bit for bit, in a file whose positions are binary32",
    lambda: with_rest([Stem(-1, 3)], exact_rest([Stem(-1, 3)], AWKWARD_DOUBLES, True, origin=(1.0, -0.0, FLOAT_TINY))),
)
valid(
    "rest-exact-predicted",
    "exact numbers expected from vertices before; the expectation overflows to infinity",
    lambda: with_rest(
        [Stem(-1, 4), Stem(0, 3, 2)],
        exact_rest(
            [Stem(-1, 4), Stem(0, 3, 2)],
            [1.0, 2.0, -3e38, 2.0, 4.0, 1e38, 3.0, 6.0, 3e38, 4.0, 8.0, 0.0] + [0.5] * 9,
            False,
        ),
    ),
)
valid(
    "rest-exact-wraps",
    "differences beyond half of all numbers wrap around",
    lambda: with_rest([Stem(-1, 2)], exact_rest([Stem(-1, 2)], [1.0, 0.0, 0.0, (2**64 - 1, True), 0.0, 0.0], True)),
)
valid(
    "rest-steps-vast",
    "Rest_Step at the end of binary32: positions are infinite",
    lambda: moving([Stem(-1, 3), Stem(0, 2, 1)], 33, step=FLOAT_MAX, heads=HEADS),
)
valid(
    "rest-vast",
    "an exact rest pose at 1e300: distances overflow, nothing has a length",
    lambda: moving(FORK, 33, rest=exact_rest(FORK, [1e300 * (i * i % 7) for i in range(15)], True), heads=HEADS),
)
valid("rest-steps-tiny", "a subnormal Rest_Step", lambda: moving(FORK, 34, step=FLOAT_TINY, heads=HEADS))
valid(
    "rest-tiny",
    "an exact rest pose of subnormal numbers: squares of distances vanish",
    lambda: moving(FORK, 34, rest=exact_rest(FORK, [TINY * (i * i % 7) for i in range(15)], True), heads=HEADS),
)
valid(
    "origin-far", "an origin that eats what the rest pose adds", lambda: moving(FORK, 35, origin=(1e9, -1e9, 2.0**60))
)
valid(
    "origin-overflows",
    "binary32 positions beyond its range are infinite",
    lambda: still(FORK, rest=exact_rest(FORK, [1e39, -1e39, 0.0] * 5, True, origin=(FLOAT_MAX, -FLOAT_MAX, 0.0))),
)


def corrupted_rest(**fields) -> bytes:
    return rest_chunk(fork().content(REST)[17:], **fields)


def exact_of_fork(numbers_: list, is_float64: bool, **fields) -> bytes:
    return exact_rest(FORK, numbers_, is_float64, **fields)


INFINITE_BITS = {False: (0xFF << 23, False), True: (0x7FF << 52, False)}  # how far infinity is from 0.0
prelude("empty", REST, "no bytes", b"")
prelude("short", REST, "16 bytes", lambda: corrupted_rest()[:16])
for bit in (0, 2, 3, 4, 5):
    prelude(f"method-{bit}", REST, f"bit {bit + 2} of Method is set", lambda bit=bit: corrupted_rest(reserved=1 << bit))
prelude(
    "exact-and-adaptive",
    REST,
    "Method has Is_Exact and Is_Adaptive",
    lambda: exact_rest(FORK, [0.5] * 15, False, reserved=REST_ADAPTIVE >> 2),
)
for what, value in (("nan", NAN), ("infinite", -INFINITY)):
    prelude(f"origin-{what}", REST, f"Origin has {value}", lambda value=value: corrupted_rest(origin=(0.0, 0.0, value)))
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    prelude(f"step-{what}", REST, f"Rest_Step is {value}", lambda value=value: corrupted_rest(step=value))
prelude(
    "step-of-exact",
    REST,
    "Rest_Step is 0 with Method 1, where it has no meaning",
    lambda: exact_of_fork([0.0] * 15, False, step=0.0),
)
prelude("zero-behind", REST, "a zero byte behind the stream", lambda: corrupted_rest() + b"\0")
prelude("bytes-behind", REST, "bytes behind the stream", lambda: corrupted_rest() + b"\1" * 12)
prelude(
    "exact-infinite", REST, "an infinite binary32 number", lambda: exact_of_fork([0.0, INFINITE_BITS[False]], False)
)
prelude(
    "exact-wide-infinite", REST, "an infinite binary64 number", lambda: exact_of_fork([0.0, INFINITE_BITS[True]], True)
)
prelude("exact-nan", REST, "a number that is NaN", lambda: exact_of_fork([((0xFF << 23) + 1, False)], False))
prelude(
    "exact-zero-behind",
    REST,
    "a zero byte behind the stream of exact numbers",
    lambda: exact_of_fork([0.5] * 15, False) + b"\0",
)
invalid(
    "rest-beam-frequencies",
    "a run of two vertices codes three frequencies",
    lambda: (
        with_rest([Stem(-1, 3, lag=0)], coded_rest([Stem(-1, 3, lag=0)], []))
        .draft()
        .change(REST, content=coded_rest([Stem(-1, 3, lag=0)], [0, 0, 0, 3]))
    ),
)
