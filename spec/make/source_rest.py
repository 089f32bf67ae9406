"""SOURCE_REST: a rest pose beside the reference pose."""

from spec.make.base import *
from spec.make.layers import layered
from spec.make.rest import AWKWARD_DOUBLES, AWKWARD_FLOATS, INFINITE_BITS, coded_rest, exact_of_fork

BUSH = stems_of(
    "-1 70 lag=0, 0 5 3 SHEET lag=1, 1 4 4 lag=0, 0 33 69 LOOSE lag=0, 3 1 32 lag=0, -1 6 lag=2, 5 3 0 lag=0"
)
DETAILED_BUSH = [replace(stem, detail=detail) for stem, detail in zip(BUSH, (0, 120, 119, 0, 121, 0, 118))]


def detailed_rest() -> bytes:
    return rest_chunk(write(rules.decode_rest, Chance(214, large=6), branches_of(DETAILED_BUSH), 0.25))


def bent(stems: list[Stem], script: list | Chance, rest: bytes | None = None) -> bytes:
    """Return SOURCE_REST about the pose of REST, by default that of `still`, at the same step."""
    branches, reference = branches_of(stems), 0.25 * np.array(grown(stems), float)
    if rest is not None:
        reference = rules.decode_rest(rest[17:], branches, 0.25).rest
    return source_rest_chunk(write(rules.decode_source_rest, script, branches, 0.25, reference))


def bent_bush(script: list | Chance, rest: list | Chance, **fields) -> Plant:
    reference = coded_rest(BUSH, rest, **{"rest_type": 1, "origin": fields.pop("origin")} if fields else {})
    return still(BUSH, rest=reference, source_rest=bent(BUSH, script, reference), **fields)


def source_rest(
    title: str, content: bytes | Callable[[], bytes], plant: Callable[..., Plant] = forked, item: str = "rest"
) -> None:
    def make() -> Plant:
        return plant(source_rest=content() if callable(content) else content)

    invalid(f"source-rest-{title}", make, item=item)


TWO = [Stem(-1, 2, lag=0)]
ATTACHED_TO_0 = stems_of("-1 3 lag=0, 0 32 0 lag=0, 1 2 0 lag=0, 1 31 5 lag=0, -1 1 lag=0")


def attached_rest(seed: int, reference_seed: int) -> Plant:
    reference = coded_rest(ATTACHED_TO_0, Chance(reference_seed, large=9))
    return still(
        ATTACHED_TO_0, rest=reference, source_rest=bent(ATTACHED_TO_0, Chance(seed, large=6, empty=0.0), reference)
    )


for title, make in {
    "source-rest: a rest pose about the reference pose: beams of several runs, stems that are none, roots": lambda: (
        bent_bush(Chance(201, large=6), Chance(211, large=9))
    ),
    "source-rest-same: the same pose once more: a stream of no bytes": lambda: bent_bush([], Chance(212, large=9)),
    "source-rest-detail: steps of branches of their own": lambda: still(
        DETAILED_BUSH, source_rest=bent(DETAILED_BUSH, Chance(204, large=6), detailed_rest()), rest=detailed_rest()
    ),
    "source-rest-far: steps as large as the plant: tangents are opposed and vanish": lambda: bent_bush(
        Chance(202, large=12), Chance(213, large=9)
    ),
    "source-rest-point: a reference pose that is one point: no tangents, no turns": lambda: bent_bush(
        Chance(203, large=4), []
    ),
    "source-rest-wide: with a pose of binary64": lambda: bent_bush(
        Chance(204, large=9), Chance(214, large=9), is_float64=True, origin=(FLOAT_MAX, 0.0, -FLOAT_MAX)
    ),
    "source-rest-largest-step: Rest_Step is the largest number: positions beyond binary32": lambda: still(
        FORK, source_rest=source_rest_chunk(bent(FORK, Chance(205))[5:], FLOAT_MAX)
    ),
    "source-rest-exact: the very numbers of the source, the reference pose at a step": lambda: still(
        FORK, source_rest=source_rest_chunk(exact_rest(FORK, [*AWKWARD_FLOATS, *[1.5] * 6], False)[17:], method=1)
    ),
    "source-rest-exact-wide: the same in binary64": lambda: still(
        FORK,
        is_float64=True,
        source_rest=source_rest_chunk(exact_rest(FORK, [*AWKWARD_DOUBLES, *[1.5] * 6], True)[17:], method=1),
    ),
    "source-rest-layers: a rest pose about the reference poses of all layers": lambda: layered(
        source_rest=bent(FORK, Chance(207, large=9))
    ),
}.items():
    valid(title, make)

source_rest("empty: no bytes", b"")
source_rest("method: Method 2", b"\2" + bytes(8))
source_rest("short: 3 bytes of Rest_Step", bytes(4))
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    source_rest(f"step-{word}: Rest_Step is {value}", lambda value=value: source_rest_chunk(b"", value))
source_rest("zero-behind: a zero byte behind the stream", lambda: bent(FORK, Chance(206)) + b"\0")
source_rest("bytes-behind: bytes behind the stream", lambda: bent(FORK, Chance(206)) + b"\1" * 12)
source_rest(
    "frequencies: a run of one vertex codes two modes",
    lambda: bent(TWO, [0, 0, 0, 2], coded_rest(TWO, [])),
    lambda **fields: still(TWO, rest=coded_rest(TWO, []), **fields),
)
source_rest(
    "exact-infinite: an infinite number",
    lambda: source_rest_chunk(exact_of_fork([0.0, INFINITE_BITS[False]], False)[17:], method=1),
)
source_rest(
    "of-exact: REST is exact",
    lambda: bent(FORK, []),
    lambda **fields: forked(rest=exact_of_fork([0.0] * 15, False), **fields),
    "open",
)
invalid(
    "source-rest-damaged BAD_CHECKSUM rest: a bit of SOURCE_REST is flipped",
    lambda: forked(source_rest=bent(FORK, Chance(206))).change(SOURCE_REST, checksum=0),
)
valid(
    "source-rest-attached-to-0: beams that hang on vertex 0, and on the first vertex of such; runs of 31 and 32; a "
    "root of one vertex",
    lambda: attached_rest(503, 504),
)
valid(
    "source-rest-exact-no-bytes: the very numbers of the source by a stream of no bytes, whose decisions are all 1",
    lambda: still(FORK, source_rest=source_rest_chunk(b"", method=1)),
)
