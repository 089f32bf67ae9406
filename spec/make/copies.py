"""REST: copies of shapes."""

from spec.make.base import *
from spec.make.rest import coded_rest, with_rest

COPIED = stems_of(  # a shape and its copies, of branches that have detail and that have none
    "-1 8 lag=2, 0 4 3 lag=2, 0 4 5 SHEET lag=2 detail=118, 0 4 0 lag=1, 0 8 2 lag=2"
)


def by_chance(count: int, seed: int, most: int = 4) -> list:
    """Return script of so many vertices of a rest pose, whose first numbers are even."""
    random = np.random.default_rng(seed)
    return [n for x, y, z in random.integers(-most, most + 1, (count, 3)).tolist() for n in (2 * x, y, z)]


def along(*places: tuple[int, int, int]) -> list:
    """Return the same of these numbers, all of them even."""
    return [n for x, y, z in places for n in (x, y // 2, z // 2)]


def with_copies(stems: Sequence[int | Stem], *script: list, step: float = 0.3, still: bool = False) -> Plant:
    """Return a root of four vertices that is no shape, at one place or not, and branches of so many on it, or
    others."""
    branches = [stem if isinstance(stem, Stem) else Stem(0, stem, b % 4) for b, stem in enumerate(stems)]
    stems = [Stem(-1, 4), *branches]
    root = [0] * 12 if still else by_chance(4, 160)
    values = [1, 0, *root, *(value for values in script for value in values)]
    return with_rest(stems, coded_rest(stems, values, step, rest_type=1))


def broken_rest(make: Callable[[], Plant], goes_on: bool = True) -> Draft:
    """Return a draft whose rest pose a decoder refuses, made from the plant that `make` returns; all else is as for a
    plant that stands still. If `goes_on` is true, the stream continues behind the fault.
    """
    kept, rules.require = rules.require, (lambda *_: None) if goes_on else rules.require
    try:
        plant = make()
    finally:
        rules.require = kept
    rest = coded_rest(plant.stems, [], 0.3, rest_type=1)
    return replace(plant, rest=rest).change(REST, content=plant.rest)


def copy_of(tip: tuple[int, int, int], *places: Sequence[int], largest: int = 0) -> Plant:
    """Return copies of a shape of two vertices that are so far apart, in quarters of a unit."""
    copies = [value for place in places for value in (*copied(0, place, largest), 0, 0, 0)]
    return with_copies([2] * (1 + len(places)), [1, *along((0, 0, 0), tip)], copies, still=True)


def copies_turned() -> Plant:
    """Return a plant of 38 stems that are copies of shapes. Their integers are alike at first, so that a decoder comes
    to expect them, and are near 0 again later.
    """
    random = np.random.default_rng(280)
    script = [[1, *by_chance(4, 162, 40)], [0, 1, *by_chance(4, 163, 40)]]
    for i in range(36):
        place = random.integers(-1, 2, 4) * (random.random(4) < 0.4)
        place = np.array([12, -19, 16, 14]) if i < 4 else place - (i in (18, 19)) * np.array([12, -19, 16, 14])
        largest = (0, 0, 0, 1, 1, 3, 2)[i % 7] if i > 7 else 0
        script += [copied(int(i > 0), place.tolist(), largest, int(i % 7 > 4)), by_chance(1, 164 + i)]
    return with_copies([4] * 38, *script)


def copies_of_many() -> Plant:
    """Return a plant of 64 shapes of one vertex and then stems that copy such shapes; one of the shapes has two
    vertices.
    """
    random, counts, script = np.random.default_rng(165), [1, 1, 2, *[1] * 64], []
    for b, count in enumerate(counts):
        script += [[*([0] if b not in (0, 2) else []), 1, *by_chance(count, 166 + b)]]
    for rank in (63, 63, 0, 1, 63, *random.integers(0, 64, 12).tolist(), 0, 0, 0, 0, 0, 5):
        script += [copied(rank), by_chance(1, 300 + rank)]
        counts.append(1)
    return with_copies([*counts, 2], *script, [1, *by_chance(2, 170)])


def copies_of_lengths() -> Plant:
    """Return a plant of shapes, copies and other branches of 15 to 17 vertices. Up to 16, a decoder expects a branch to
    be what others of its length were.
    """
    counts, script = [15, 16, 17, 15, 17, 16, 16, 15, 17, 16, 15, 17], []
    shapes: list[int] = []
    for b, (count, kind) in enumerate(zip(counts, (1, 1, 0, 2, 1, 2, 0, 0, 2, 1, 2, 0))):
        script += [[0] if kind < 2 and count in shapes else []]
        script += [copied(0), by_chance(1, 180 + b)] if kind == 2 else [[kind, *by_chance(count, 180 + b)]]
        shapes += [count] if kind == 1 else []
    return with_copies(counts, *script)


FAR, MOST = ((1 << 30) - 2,) * 3, (1 << 29) - 1


valid(
    "rest-copies: copies of shapes that are mirrored and scaled",
    lambda: with_rest(COPIED, coded_rest(COPIED, Chance(3, large=3, begin=[1]))),
)
for name_, seed_, title_ in (
    ("rest-copies-of-no-shape", 5, "a copy of a shape that is not there"),
    ("rest-copies-scale", 4, "the scale of a copy is not above 0"),
    ("rest-copies-rotation", 40, "a quaternion of more than 1"),
):
    invalid(
        f"{name_}: {title_}",
        lambda seed_=seed_: with_rest(COPIED, coded_rest(COPIED, Chance(3, large=3, begin=[1]))).change(
            REST, content=coded_rest(COPIED, Chance(seed_, large=3, begin=[1]))
        ),
    )
for title, make in {
    "rest-copies-between: the last turn of a shape is two and a half steps of the next copy, "
    "but for rounding": lambda: copy_of((36, 0, 0), (0, 0, 1, 0), (15, 0, 3, 0), *[(0, 0, 0, 0), (15, 0, 0, 0)] * 3),
    "rest-copies-turned: the last turn and scale of a shape, which its next copy is about, of "
    "two shapes in turn": copies_turned,
    "rest-copies-of-many: 64 shapes are remembered, and the last of these is copied": copies_of_many,
    "rest-copies-of-lengths: branches of 15, 16 and 17 vertices that are shapes, copies or neither": copies_of_lengths,
    "rest-copies-of-roots: a root that is a copy of a branch, a branch that is one of a root, "
    "and a root of a root": lambda: with_copies(
        [3, Stem(-1, 3), Stem(-1, 2), Stem(3, 2, 1), Stem(-1, 2), Stem(5, 3, 1)],
        *([1, *by_chance(3, 190, 9)], copied(0, (1, 1, 2, -1)), by_chance(1, 191)),
        *([1, *by_chance(2, 192, 9)], copied(0, (0, -1, 2, 0)), by_chance(1, 193)),
        *(copied(0, (1, 0, 0, 1)), by_chance(1, 194), copied(0), by_chance(1, 195)),
    ),
    "rest-copies-of-a-point: a shape of one vertex, whose copies have whole numbers for their scale, up to 999, and "
    "for their turn": lambda: with_copies(
        [1] * 4,
        *([1, *by_chance(1, 196)], copied(0, (998, 1, 0, 0)), by_chance(1, 197)),
        *(copied(0, (0, 0, -1, 0), 3), by_chance(1, 198), copied(0, (2, 0, 0, 0), 2), by_chance(1, 199)),
    ),
    "rest-copies-tiny: a copy of just over 1/1000 of its shape": lambda: copy_of((8, 0, 68), (-19, 0, 0, 0)),
    "rest-copies-far: numbers of a copy of 29 bits, and what is expected of many behind it": lambda: copy_of(
        FAR, (MOST, MOST, -MOST, 0), *[(0, 0, 1, 0), (1, -1, 0, 0)] * 25
    ),
}.items():
    valid(title, make)

for name_, reason_, tip_, places_ in (
    ("scale-1000", "a scale of 1000", (0, 0, 0), [(999, 0, 0, 0)]),
    ("scale-tiny", "a scale of just under 1/1000", (4, 0, 90), [(-25, 0, 0, 0)]),
    ("number", "a number of 2^29", FAR, [(MOST, MOST + 1, 0, 0)]),
    ("number-negative", "a number of -2^29", FAR, [(MOST, -MOST - 1, 0, 0)]),
):
    invalid(
        f"rest-copies-{name_}: {reason_}, of a copy",
        lambda tip_=tip_, places_=places_: broken_rest(lambda: copy_of(tip_, *places_)),
    )
invalid(
    "rest-copies-rotation-little: a quaternion of little more than 1",
    lambda: broken_rest(lambda: copy_of((10, 0, 0), (0, 2, 2, 0)), goes_on=False),
)
invalid(
    "rest-copies-of-the-65th: a copy of the shape before the last 64",
    lambda: broken_rest(
        lambda: with_copies([1] * 66, [1, 0, 0, 0], *([0, 1, *by_chance(1, 400 + b)] for b in range(64)), copied(64)),
        goes_on=False,
    ),
)
