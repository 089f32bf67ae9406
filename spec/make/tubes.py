"""Tubes and rigid branches."""

from spec.make.base import *

RIGID = [replace(stem, rigid=q % 4, detail=q % 3 * 120) for q, stem in enumerate(MIXED)]
TUBES = stems_of(
    "-1 13 0 SHEET lag=4 ring=4, 0 70 5 SHEET lag=6 ring=6, 1 8 69 SHEET LOOSE ring=2, 1 5 30, 0 62 3 SHEET "
    "ring=30, 0 20 1 SHEET ring=32, -1 9 0 SHEET rigid=1 ring=3, 6 12 4 SHEET WHOLE ring=3, 7 6 2 SHEET ring=2"
)


def of_sizes(*powers: int) -> list[list[float]]:
    """Return a stem, and for each power of two three vertices by chance that are as far away from its first one; every
    second three are flat."""
    random = np.random.default_rng(531)
    triples = [
        math.ldexp(1.0, power - 10) * random.integers(-1024, 1025, (3, 3)) * [1, 1, i % 2]
        for i, power in enumerate(powers)
    ]
    return [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], *np.vstack(triples).tolist()]


def of_any_size(*powers: int) -> Plant:
    """Return a plant of rigid branches, all turned, whose extents in metres are powers of two with the exponents
    `powers`.
    """
    stems = [Stem(-1, 2), *(Stem(0, 3, 0, rigid=1) for _ in powers)]
    size = [1 << 28 if power > 0 else 1 for power in powers]
    turned = [row((n * (1 + i % 3), n * (2 - i % 4), n), (i % 2, 3 * n, -n)) for i, n in enumerate(size)]
    return Plant(
        stems,
        frames=2,
        is_float64=True,
        rest=exact_rest(stems, [x for point in of_sizes(*powers) for x in point], True),
        heads={level: stems_head(1e38, 3 << 4 | 2) for level in range(3)},
        scripts={(STEMS, 1): [*row() * 4, *(value for each in turned for value in each)]},
    )


valid("rigid: branches that move as they are: alone, with others on them, loose", refinements(RIGID, 38, layers=1))
valid(
    "rigid-turn: the same with a largest step of rotations",
    refinements(RIGID, 39, layers=1, default_head=stems_head(0.5, 161)),
)
valid(
    "tubes: tubes: with a tip, of two pieces, loose, of a ring that is none, rigid, and what hangs on them",
    refinements(TUBES, 41, layers=1),
)
valid(
    "tube-gaps: the same of the rings of a tube",
    placed,
    [Stem(-1, 40, flags=SHEET, ring=2)],
    [[1000.0 * (i > 17) + i, j, 0.1 * i * j] for i in range(20) for j in (0, 1)],
    132,
)
valid(
    "rigid-diagonal: rigid branches whose inertia has no products: nothing to reduce, axes that are equally long",
    placed,
    [Stem(-1, 2), Stem(0, 3, 1, rigid=1), Stem(0, 3, 0, rigid=1), Stem(0, 2, 1, rigid=1)],
    [[0, 0, 0], [1, 0, 0], [5, 0, 0], [1, 8, 0], [1, 0, 2], [0, 0, 3], [0, 3, 0], [3, 0, 0], [1, 4, 0], [1, 5, 0]],
    133,
)
valid(
    "rigid-tiny: branches that move as they are, of 1e-78 to 1e-84 and of 1e-160: squares of their moments are 0",
    lambda: of_any_size(*[*range(-274, -265)] * 2, *[-268] * 12, -279, -276, -260, *[*range(-536, -531)] * 2),
)
valid(
    "rigid-huge: rigid branches of 1e77 to 1e150: squares of their moments are infinite, and nothing is reduced",
    lambda: of_any_size(250, 257, 258, 259, 260, 300, 400, 500),
)
valid(
    "tubes-of-three-in-binary64: a tube of rings of three vertices, whose centres are rounded",
    placed,
    [Stem(-1, 9, flags=SHEET, ring=3)],
    [[1000.1 * i + j, 1.3 * j - 70.7 * i * i, 0.4 * (j == 1) + 300.3 * i] for i in range(3) for j in range(3)],
    134,
    is_float64=True,
)
valid(
    "rigid-in-a-plane: rigid branches whose inertia has one product, of the first axis and the last",
    placed,
    [Stem(-1, 2), Stem(0, 3, 1, rigid=1)],
    [[0, 0, 0], [1, 0, 0], [3, 0, 1], [5, 0, 4], [6, 0, 9]],
    135,
)
