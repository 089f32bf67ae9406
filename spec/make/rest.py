"""REST: the reference pose by steps, beams and exact numbers."""

from spec.make.base import *

AWKWARD_FLOATS = [-0.0, FLOAT_TINY, -FLOAT_MAX, FLOAT_MAX, 1.0, -1e-40, 0.0, 1 + 2**-23, -1.0]
AWKWARD_DOUBLES = [-0.0, TINY, -1e300, 1e300, 1.0, -1e-310, 0.0, 1 + 2**-52, -1.0]


def coded_rest(stems: list[Stem], script: Script | list, step: float = 0.25, **fields) -> bytes:
    return rest_chunk(write(rules.decode_rest, script, branches_of(stems), step), step=step, **fields)


def with_rest(stems: list[Stem], rest: bytes, **fields) -> Plant:
    return Plant(stems, rest=rest, **fields)


RUNS = [Stem(-1, 2, lag=0), Stem(0, 33, 1, lag=0), Stem(0, 32, 0, lag=0), Stem(-1, 1, lag=0)]


def corrupted_rest(**fields) -> bytes:
    return rest_chunk(fork().content(REST)[17:], **fields)


def exact_of_fork(numbers_: list, is_float64: bool, **fields) -> bytes:
    return exact_rest(FORK, numbers_, is_float64, **fields)


INFINITE_BITS = {False: (0xFF << 23, False), True: (0x7FF << 52, False)}  # how far infinity is from 0.0


BY_VERTEX = stems_of(  # every filter, phases within lags and across stems, rows of several vertices, a beam among them
    "-1 30 lag=1, 0 12 3 lag=2, 0 12 4 lag=3, 2 14 5 SHEET lag=4, 0 40 9 SHEET lag=7, -1 9 lag=0, 5 3 2 lag=65535"
)
DETAILED = [  # finer and coarser than the step, the largest and the smallest, alike and unlike by lag
    replace(stem, detail=detail) for stem, detail in zip(BY_VERTEX, (0, 121, 118, 0, 255, 110, 1))
]


def vertices_of_fork() -> bytes:
    return coded_rest(FORK, Chance(37, large=4))


LONE_POINTS = [Stem(-1, 1, lag=2), Stem(-1, 1, lag=2), Stem(-1, 1, lag=2, detail=100), Stem(-1, 1, lag=2, detail=100)]
FAR_UNITS = [10**9, 495 * 10**6, 515 * 10**6]  # units in x, in y and z pairs of them
LAGS = [Stem(-1, 12, lag=4), Stem(0, 17, 2, lag=5), Stem(0, 262, 4, SHEET, lag=256)]


for title, make in {
    "rest-lag-65535: the largest Lag: no vertex is a row behind another": lambda: still([Stem(-1, 3, lag=65535)]),
    "rest-beams: beams: runs of 1, 16 and 17 and of 32 vertices, from roots and from attach vertices": lambda: (
        with_rest(RUNS, coded_rest(RUNS, Chance(31, begin=[0])))
    ),
    "rest-beams-and-steps: stems of both kinds that share their models": lambda: with_rest(
        [Stem(-1, 5, lag=0), Stem(0, 3, 1, lag=1), Stem(0, 4, 4, lag=0)],
        coded_rest(
            [Stem(-1, 5, lag=0), Stem(0, 3, 1, lag=1), Stem(0, 4, 4, lag=0)],
            Chance(32, begin=[0]),
            rest_type=1,
            origin=(1e6, -0.5, 3.0),
        ),
    ),
    "rest-exact: binary32 bit for bit: -0.0, subnormal and largest numbers": lambda: with_rest(
        [Stem(-1, 3)], exact_rest([Stem(-1, 3)], AWKWARD_FLOATS, False)
    ),
    "rest-exact-wide: binary64 bit for bit, in a file whose positions are binary32": lambda: with_rest(
        [Stem(-1, 3)], exact_rest([Stem(-1, 3)], AWKWARD_DOUBLES, True, origin=(1.0, -0.0, FLOAT_TINY))
    ),
    "rest-exact-predicted: exact numbers expected from vertices before; the expectation "
    "overflows to infinity": lambda: with_rest(
        [Stem(-1, 4), Stem(0, 3, 2)],
        exact_rest(
            [Stem(-1, 4), Stem(0, 3, 2)],
            [1.0, 2.0, -3e38, 2.0, 4.0, 1e38, 3.0, 6.0, 3e38, 4.0, 8.0, 0.0] + [0.5] * 9,
            False,
        ),
    ),
    "rest-exact-wraps: differences beyond half of all numbers wrap around": lambda: with_rest(
        [Stem(-1, 2)], exact_rest([Stem(-1, 2)], [1.0, 0.0, 0.0, (2**64 - 1, True), 0.0, 0.0], True)
    ),
    "rest-steps-vast: Rest_Step at the end of binary32: positions are infinite": lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1)], 33, step=FLOAT_MAX, heads=HEADS
    ),
    "rest-vast: an exact rest pose at 1e300: distances overflow, nothing has a length": lambda: moving(
        FORK, 33, rest=exact_rest(FORK, [1e300 * (i * i % 7) for i in range(15)], True), heads=HEADS
    ),
    "rest-steps-tiny: a subnormal Rest_Step": lambda: moving(FORK, 34, step=FLOAT_TINY, heads=HEADS),
    "rest-tiny: an exact rest pose of subnormal numbers: squares of distances vanish": lambda: moving(
        FORK, 34, rest=exact_rest(FORK, [TINY * (i * i % 7) for i in range(15)], True), heads=HEADS
    ),
    "origin-far: an origin that eats what the rest pose adds": lambda: moving(FORK, 35, origin=(1e9, -1e9, 2.0**60)),
    "origin-overflows: binary32 positions beyond its range are infinite": lambda: still(
        FORK, rest=exact_rest(FORK, [1e39, -1e39, 0.0] * 5, True, origin=(FLOAT_MAX, -FLOAT_MAX, 0.0))
    ),
}.items():
    valid(title, make)

prelude(REST, "empty: no bytes", b"")
prelude(REST, "short: 16 bytes", lambda: corrupted_rest()[:16])
prelude(REST, "method-0: bit 2 of Method is set", lambda: corrupted_rest(reserved=1) + b"\1")
for bit in (2, 3, 4, 5):
    prelude(REST, f"method-{bit}: bit {bit + 2} of Method is set", lambda bit=bit: corrupted_rest(reserved=1 << bit))
for word, value in (("nan", NAN), ("infinite", -INFINITY)):
    prelude(REST, f"origin-{word}: Origin has {value}", lambda value=value: corrupted_rest(origin=(0.0, 0.0, value)))
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    prelude(REST, f"step-{word}: Rest_Step is {value}", lambda value=value: corrupted_rest(step=value))
for title, make in {
    "step-of-exact: Rest_Step is 0 with Method 1, where it has no meaning": lambda: exact_of_fork(
        [0.0] * 15, False, step=0.0
    ),
    "zero-behind: a zero byte behind the stream": lambda: corrupted_rest() + b"\0",
    "bytes-behind: bytes behind the stream": lambda: corrupted_rest() + b"\1" * 12,
    "exact-infinite: an infinite binary32 number": lambda: exact_of_fork([0.0, INFINITE_BITS[False]], False),
    "exact-wide-infinite: an infinite binary64 number": lambda: exact_of_fork([0.0, INFINITE_BITS[True]], True),
    "exact-nan: a number that is NaN": lambda: exact_of_fork([((0xFF << 23) + 1, False)], False),
    "exact-zero-behind: a zero byte behind the stream of exact numbers": lambda: (
        exact_of_fork([0.5] * 15, False) + b"\0"
    ),
}.items():
    prelude(REST, title, make)

invalid(
    "rest-beam-frequencies: a run of two vertices codes three frequencies",
    lambda: with_rest([Stem(-1, 3, lag=0)], coded_rest([Stem(-1, 3, lag=0)], [])).change(
        REST, content=coded_rest([Stem(-1, 3, lag=0)], [0, 0, 0, 0, 3])
    ),
)
for title, make in {
    "rest-vertices: vertices one by one": lambda: with_rest(
        BY_VERTEX, coded_rest(BY_VERTEX, Chance(33, large=6), rest_type=1)
    ),
    "rest-vertices-phases: a lag of more vertices than there are phases": lambda: with_rest(
        [Stem(-1, 900, lag=300)], coded_rest([Stem(-1, 900, lag=300)], Chance(34, large=3))
    ),
    "rest-vertices-still: a rest pose without bytes, which is a point": lambda: with_rest(
        BY_VERTEX, coded_rest(BY_VERTEX, [])
    ),
    "rest-vertices-vast: integers of 30 bits under the largest Rest_Step: weighted guesses are out of range": lambda: (
        with_rest(BY_VERTEX, coded_rest(BY_VERTEX, Chance(35, large=29), FLOAT_MAX))
    ),
    "rest-vertices-tiny: a subnormal Rest_Step": lambda: with_rest(
        BY_VERTEX, coded_rest(BY_VERTEX, Chance(36, large=9), FLOAT_TINY)
    ),
    "rest-detail: steps of branches of their own, of single vertices and of beams": lambda: with_rest(
        DETAILED, coded_rest(DETAILED, Chance(37, large=6))
    ),
}.items():
    valid(title, make)


prelude(REST, "vertices-zero-behind: a zero byte behind single vertices", lambda: vertices_of_fork() + b"\0")
prelude(REST, "vertices-bytes-behind: bytes behind single vertices", lambda: vertices_of_fork() + b"\1" * 12)
valid(
    "rest-vertices-far: what is expected by the weights is 10^9 units, a little less, or more than is allowed",
    lambda: with_rest(
        LONE_POINTS, coded_rest(LONE_POINTS, [0, *FAR_UNITS, 0, 0, 0, *(-n for n in FAR_UNITS), 0, 0, 0], rest_type=1)
    ),
)
valid(
    "rest-vertices-lags: lags of 4 and 5, of which one has filters by phase, and of 256, of which a phase has two "
    "vertices",
    lambda: with_rest(LAGS, coded_rest(LAGS, Chance(410, large=3, empty=0.0), rest_type=1)),
)
