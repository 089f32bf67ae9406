"""Layers: refined stems, shapes and rest poses."""

from spec.make.base import *
from spec.make.bases import basis_by_chance
from spec.make.clips import loop, periodic
from spec.make.connected import connected
from spec.make.polygons import MANY_FACES
from spec.make.rest import BY_VERTEX, coded_rest
from spec.make.tubes import RIGID, TUBES


def layered(layers: int = 3, *left_out: tuple, **fields) -> Plant:
    """Return a forked plant, which makes the levels 0 to 2, with refinements that use everything a refinement may have.
    `left_out` has the keys (kind, level, segment) of scripts to leave out.
    """
    more = {"scripts": {}} | fields
    scripts = forked().scripts | {
        (SHAPES, 3, 0): [
            3,
            *refined_row((1, 0, -2), (0, 3, 0)),
            0,
            *refined_row((0, 0, 5)),
            1,
            *refined_row((2, 0, 0)),
        ],
        (SHAPES, 4, 0): [2, *refined_row((-1, 1, 0), (0, 0, 7), (1, 0, 0)), *refined_row((0, 0, 1)), 0],
    }
    for q in range(1, layers):
        scripts |= {
            (STEMS, 2 + q): 10 + q,
            (CORRECTIONS, 2 + q): 20 + q,
            (REFINED_REST, 2 + q, 0): lambda q=q: Chance(30 + q, large=4),
        }
    scripts = {place: script for place, script in scripts.items() if place not in left_out}
    return forked(**{"layers": layers, "heads": LAYER_HEADS} | more | {"scripts": scripts | more["scripts"]})


SHARED_BASES = {
    1: stems_head(0.5, 1, 2, 1, basis_stream([[4928, -5760]])),
    2: stems_head(0.5, 1, 2, 1, base=1),
    3: stems_head(0.125, 2, 2, 2, basis_stream([[-4800, 8192]]), base=2),
    4: stems_head(0.03125, 2, 2, 2, base=3),
}
BEAMS = stems_of("-1 36 lag=0, 0 5 20 lag=0, 0 1 35 lag=0, 0 40 7 SHEET lag=2, -1 1 lag=0")
LEVEL_1_REST = {(REFINED_REST, 1, 0): lambda: Chance(81, large=4)}


def rest_by_level(stems: list[Stem], seed: int, **fields) -> Plant:
    """Return the plant of `refinements`, with a rest pose of stage 0 alone."""
    plant = refinements(stems, seed, **fields)
    plant.scripts |= LEVEL_1_REST
    return plant


def learned(*levels: int) -> dict:
    """Return the heads of motion chunks, by level, with learned bases over time for some levels, in segments of two
    frames.
    """
    random = np.random.default_rng(5)
    return LAYER_HEADS | {
        level: stems_head(
            0.5 / 4 ** max(level - 2, 0), level % 3, 2, 1 + level % 2, basis_by_chance(random, 1 + level % 2, 2)
        )
        for level in levels
    }


def lossless_layers() -> Draft:
    """Return an additional last level with empty streams."""
    return (
        layered().with_header(level_count=6, full_level_count=6).add(Entry(EXACT, b"", 5, 0), Entry(EXACT, b"", 5, 1))
    )


LOOSE_BEAMS = [*BEAMS[:3], Stem(0, 9, 30, LOOSE), Stem(-1, 70, lag=0)]


def refinement(kind: int, title: str, content: bytes | Callable[[bytes], bytes], segment: int = 0) -> None:
    """Declare a vector with other content for a chunk of level 3. A function as content gets the usual content."""

    def make() -> Draft:
        draft = layered().draft()
        made = content(draft.content(kind, 3, segment)) if callable(content) else content
        return draft.change(kind, 3, segment, content=made)

    invalid(f"refined-{KIND_NAMES[kind].lower().removeprefix('refined_')}-{title}", make, item=3)


def scripted_refinement(place: tuple, title: str, *script) -> None:
    """Declare a vector with another script for the last stream that is written of level 3."""
    invalid(title, lambda: layered(2, scripts={place: list(script)}).draft(), item=3)


def bad_rest_of_1(change: Callable[[bytes], dict] | None) -> Draft:
    """Declare a vector whose level 1 refines a rest pose that is exact, or does so by a changed chunk."""
    if change is None:
        exact = layered(3, (REFINED_REST, 3, 0), (REFINED_REST, 4, 0), rest=exact_rest(FORK, [0.5] * 15, False))
        return exact.add(Entry(REFINED_REST, refined_rest_chunk(b""), 1))
    draft = layered(scripts=LEVEL_1_REST).draft()
    return draft.change(REFINED_REST, 1, **change(draft.content(REFINED_REST, 1)))


def refined_run(count: int) -> bytes:
    """Return the stream of a root of three vertices, the last two of which are a run with so many modes."""
    branches = branches_of([Stem(-1, 3, lag=0)])
    before = rules.Record(rest=[[0.0] * 3] * 3, rows={})
    return write(rules.decode_rest, [0, 0, 0, count], branches, 0.0625, before)


HALVED_RATIOS = (63000, 0.36065), (67000, 0.34967), (0.45, 0.5)


class Turns(Chance):
    """Two frequencies of each row, as large as it takes to turn by up to 360 degrees and back."""

    def answer(self, asked: str, most: int):
        if asked == "count":
            return min(2, most)
        return int(self.random.integers(-130, 131)) if asked == "signed" else super().answer(asked, most)


STIFF = stems_of(  # in one, two or three layers, with others on them
    "-1 4 rigid=1, 0 3 2 rigid=2, 1 2 1 LOOSE rigid=3, 2 3 0 rigid=3, 0 3 1 SHEET rigid=1, 4 2 0 rigid=2, -1 3 rigid=2"
)


def stiff(seed: int, **fields) -> Plant:
    """Return STIFF in three layers, of which the first has rotations of any size."""
    plant = refinements(STIFF, seed, large=5, is_float64=True, **fields)
    plant.scripts |= {(STEMS, level): lambda level=level: Turns(seed + level) for level in range(5)}
    return plant


LAST_BASIS = 2, 2, basis_stream([[4800, -3200], [1232, 8176]])
HALF_TURNS = (16, 0, 0), (0, 16, 0), (0, 0, 16), (16, 0, 1), (0, -16, 3)


for title, make in {
    "layers-smallest: one vertex in two layers, all of it empty": lone(layers=2),
    "layers-eight: as many layers as there may be": refinements([Stem(-1, 2), Stem(0, 2, 1)], 31, layers=8),
    "layers-two: a refinement of motion alone: the rest pose is that of the layer before, and "
    "no piece has shapes": layered(2, (REFINED_REST, 3, 0), (SHAPES, 3, 0), (CORRECTIONS, 3)),
    "layers-three: refinements with REFINED_REST, SHAPES and CORRECTIONS": layered(),
    "layers-rest-of-last: the second refinement refines the rest pose of the layer before the one before": layered(
        3, (REFINED_REST, 3, 0)
    ),
    "layers-rest-of-first: the second refinement has the rest pose of the first": layered(3, (REFINED_REST, 4, 0)),
    "layers-shapes-of-last: shapes in a refinement alone": layered(3, (SHAPES, 1, 0), (SHAPES, 3, 0)),
    "layers-shapes-of-first: shapes in the first layer alone": layered(3, (SHAPES, 3, 0), (SHAPES, 4, 0)),
    "layers-learned-first: learned time bases in the first layer: predictions in waves are of all frequencies": layered(
        heads=learned(1, 2)
    ),
    "layers-learned-one: a learned time basis in one refinement": layered(heads=learned(3)),
    "layers-learned-low: a learned time basis of a level that holds the first modes of a piece": layered(
        heads=learned(1)
    ),
    "layers-learned-all: learned time bases in all layers": layered(heads=learned(1, 2, 3, 4)),
    "layers-learned-shared: learned time bases that begin with those of earlier layers: some "
    "with further rows": layered(heads=LAYER_HEADS | SHARED_BASES),
    "layers-learned-apart: two roots of learned time bases: predictions of pieces of level 1 alone are of all "
    "frequencies": layered(
        heads=LAYER_HEADS | SHARED_BASES | {2: stems_head(0.5, 1, 2, 1, basis_stream([[192, 6336]]))}
    ),
    "layers-rigid: branches that move as they are in the first layers": refinements(
        RIGID,
        40,
        heads={level: stems_head(0.5 / 4 ** max(level - 2, 0), 16 * level | level % 3) for level in range(12)},
    ),
    "layers-unturned: branches whose bending turns nothing": refinements(UNTURNED, 46, frames=9, segments=2),
    "layers-tubes: the same in layers": refinements(TUBES, 42, frames=9, segments=2),
    "layers-mixed: rotations, loose stems, sheets, a stem of two pieces and a subtree that is whole": refinements(
        MIXED, 32, frames=9, segments=2
    ),
    "layers-still: refinements whose rows are all predictions": layered(
        scripts={(STEMS, 3): [], (STEMS, 4): [], (REFINED_REST, 3, 0): [], (REFINED_REST, 4, 0): []}
    ),
    "layers-beams: runs of beams, some of two, and steps, in all rest poses": refinements(
        BEAMS, 33, rest=coded_rest(BEAMS, Chance(61, large=4))
    ),
    "layers-large: large integers in all streams": refinements(MIXED[:3], 34, large=29, frames=5, is_float64=True),
    "layers-ratio-1: Ratio 1": refinements(
        MIXED[:3],
        35,
        frames=5,
        ratio=1,
        heads=learned(2) | {3: stems_head(0.5, 1), 4: stems_head(0.5, 1)},
        segments=2,
        clips=(Clip(2, 1, "a"), Clip(2, 1, "b")),
    ),
    "layers-ratio-largest: Ratio 65535": layered(ratio=65535, heads=learned(1, 2)),
    "layers-shift-15: Shift 15: what it takes beyond 30 bits is kept there": layered(
        shift=15, scripts={(SHAPES, 1, 0): [2, *row((1 << 20, 0, -(1 << 14)), (0, -(1 << 29), 0)), *row((0, 0, 1)), 0]}
    ),
    "layers-exact-rest: refinements of an exact rest pose": layered(
        3,
        (REFINED_REST, 3, 0),
        (REFINED_REST, 4, 0),
        rest=exact_rest(FORK, [float(i * i % 7) for i in range(15)], False),
    ),
    "layers-wide: binary64 positions": layered(is_float64=True),
    "layers-clips: two clips, one of them a loop": layered(
        clips=(loop(Clip(3, 1, "up"), 0.5, 0.4, 0.3, 0.2, 0.1), Clip(2, 1, "down"))
    ),
    "layers-periodic: two clips, one of them periodic": layered(
        clips=(periodic(Clip(3, 1, "up"), 0.5, 0.4, 0.3, 0.2, 0.1), Clip(2, 1, "down"))
    ),
    "layers-lossless: EXACT behind three layers": lossless_layers,
}.items():
    valid(title, make)

for level_ in range(5):
    valid(
        f"layers-upto-{level_}: three layers, shortened after level {level_}",
        lambda level=level_: layered().upto(level),
    )
valid("rest-of-level-1: level 1 refines the rest pose, and so do the refinements", layered(scripts=LEVEL_1_REST))
valid(
    "rest-of-level-1-alone: level 1 refines the rest pose, which the refinements have, too",
    layered(3, (REFINED_REST, 3, 0), (REFINED_REST, 4, 0), scripts=LEVEL_1_REST),
)
for level_ in range(4):
    valid(
        f"rest-of-level-1-upto-{level_}: level 1 refines the rest pose, and the file is shortened after level {level_}",
        lambda level=level_: layered(scripts=LEVEL_1_REST).upto(level),
    )
for title, make in {
    "rest-of-level-1-of-point: the rest pose of level 0 is a point: its maps have no "
    "directions, those of level 1 have": rest_by_level(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(1, 2, 1)], 41, points=[(0, 0, 0)] * 7
    ),
    "rest-of-level-1-beams: runs of beams, loose stems, a root of two pieces and two roots": rest_by_level(
        LOOSE_BEAMS,
        42,
        rest=coded_rest(LOOSE_BEAMS, Chance(47, large=6, begin=[0]), rest_type=1),
        frames=5,
        segments=2,
        is_float64=True,
    ),
    "rest-of-level-1-whole: all that level 0 moves is shown exactly at level 1": rest_by_level(
        [Stem(-1, 4, 0, WHOLE), Stem(0, 3, 2)], 43
    ),
    "layers-rest-vertices: single vertices of all layers": refinements(
        BY_VERTEX, 46, rest=coded_rest(BY_VERTEX, Chance(38, large=4), 1.0)
    ),
    "layers-connected-rest: rest poses of all layers by faces": refinements(
        BY_VERTEX, 46, rest=connected(MANY_FACES["strip"]).rest, faces=MANY_FACES["strip"]()
    ),
    "rest-of-level-1-vertices: single vertices by level": rest_by_level(
        BEAMS[:3], 47, rest=coded_rest(BEAMS[:3], Chance(39, large=4), 1.0)
    ),
    "rest-of-level-1-still: the chunk has no bytes in its stream": layered(scripts={(REFINED_REST, 1, 0): []}),
}.items():
    valid(title, make)

header("layers-9: Layer_Count 9", layer_count=9, level_count=10, full_level_count=10)
header("layers-not-those: Layer_Count 4: a file of h = 0 has 5 levels, or 6 with EXACT", layer_count=4)
for count in (1, 4):
    invalid(
        f"layers-count-{count} BAD_HEADER: Layer_Count {count}, Full_Level_Count is that of 3 layers",
        lambda count=count: layered().with_header(layer_count=count),
    )
table(
    "layers-exact-taken: Layer_Count 2 makes the last level the lossless one: EXACT is missing",
    lambda: layered().with_header(layer_count=2),
)
table("layers-no-stems: a refinement lacks the STEMS of a segment", lambda: layered().without(STEMS, 3, 1))
table("layers-affines: AFFINES of a refinement", lambda: layered().add(Entry(AFFINES, b"", 3, 0)))
table("layers-exact-early: EXACT at the level of the last refinement", lambda: layered().add(Entry(EXACT, b"", 4, 0)))
table(
    "layers-corrections-low: CORRECTIONS below level h + 1",
    lambda: layered().add(Entry(CORRECTIONS, struct.pack("<f", 1.0), 1, 0)),
)
table(
    "layers-corrections-exact: CORRECTIONS of the lossless level behind three layers",
    lambda: lossless_layers().add(Entry(CORRECTIONS, struct.pack("<f", 1.0), 5, 0)),
)
table(
    "layers-shapes-of-segment-1: SHAPES of a refinement stands with segment 0",
    lambda: layered().add(Entry(SHAPES, b"\0", 3, 1)),
)
for level_, why in ((0, "level 0"), (2, "a level of the hierarchy above 1"), (5, "the lossless level")):
    table(
        f"refined-rest-{level_}: REFINED_REST of {why}",
        lambda level=level_: lossless_layers().add(Entry(REFINED_REST, b"", level, 0)),
    )
table(
    "refined-rest-of-segment-1: REFINED_REST stands with segment 0",
    lambda: layered(3, (REFINED_REST, 3, 0)).add(Entry(REFINED_REST, b"", 3, 1)),
)
for name, why, plant in (
    ("with-stems", "level 0 has STEMS", rest_by_level([*FORK, Stem(-1, 2)], 44)),
    (
        "with-affines",
        "AFFINES of level 0 serve level 1",
        rest_by_level([Stem(-1, 2, 0, WHOLE), Stem(0, 2, 1), *[Stem(-1, 2), Stem(2, 2, 1)]], 45),
    ),
    ("of-one-layer", "Layer_Count is 1", Plant(FORK, scripts=LEVEL_1_REST)),
):
    table(f"refined-rest-1-{name}: REFINED_REST of level 1, though {why}", lambda plant=plant: plant.draft())
refinement(STEMS, "ratio-0: Ratio is 0", lambda content: bytes(2) + content[2:])
refinement(STEMS, "empty: STEMS of a refinement without bytes", b"")
refinement(STEMS, "ratio-alone: nothing behind Ratio", b"\4\0")
refinement(STEMS, "step-zero: Step of a refinement is 0", lambda content: content[:2] + bytes(4) + content[6:])
refinement(STEMS, "zero-behind: a zero byte behind the stream of refined stems", lambda content: content + b"\0")
refinement(STEMS, "bytes-behind: bytes behind the stream of refined stems", lambda content: content + b"\1" * 12, 1)
scripted_refinement((STEMS, 3, 0), "refined-stems-frequencies: a refined row codes three frequencies of two", 3)
refinement(SHAPES, "empty: SHAPES of a refinement without bytes", b"")
refinement(SHAPES, "shift-16: Shift is 16", lambda content: b"\x10" + content[1:])
refinement(SHAPES, "zero-behind: a zero byte behind the stream of refined shapes", lambda content: content + b"\0")
refinement(SHAPES, "bytes-behind: bytes behind the stream of refined shapes", lambda content: content + b"\1" * 12)
scripted_refinement(
    (SHAPES, 3, 0), "refined-shapes-too-many: a piece of three modes has ten shapes in a refinement", 10
)
scripted_refinement((SHAPES, 3, 0), "refined-shapes-modes: a refined shape has numbers for four modes of three", 1, 4)
scripted_refinement((SHAPES, 3, 0), "refined-shapes-all-zero: a shape that the layer before lacks is all 0", 3, 0, 0, 0)
scripted_refinement((SHAPES, 3, 0), "refined-shapes-cancelled: differences make a shape all 0", 2, 0, *[1, 0, 0, 4, 1])
refinement(REFINED_REST, "short: 3 bytes", bytes(3))
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    refinement(
        REFINED_REST,
        f"step-{word}: Rest_Step of a refinement is {value}",
        lambda content, value=value: refined_rest_chunk(content[4:], value),
    )
refinement(
    REFINED_REST, "zero-behind: a zero byte behind the stream of a refined rest pose", lambda content: content + b"\0"
)
refinement(
    REFINED_REST, "bytes-behind: bytes behind the stream of a refined rest pose", lambda content: content + b"\1" * 20
)
for title, make in {
    "refined-rest-of-exact BAD_CHUNK 3: REFINED_REST of a rest pose that is exact": lambda: layered(
        3, (REFINED_REST, 3, 0), (REFINED_REST, 4, 0), rest=exact_rest(FORK, [0.5] * 15, False)
    ).add(Entry(REFINED_REST, refined_rest_chunk(b""), 3)),
    "refined-rest-modes BAD_CHUNK 2: a refined run of two vertices has three modes": lambda: Plant(
        [Stem(-1, 3, lag=0)], rest=coded_rest([Stem(-1, 3, lag=0)], []), layers=2
    ).add(Entry(REFINED_REST, refined_rest_chunk(refined_run(3)), 2)),
    "refined-rest-checksum BAD_CHECKSUM 3: the Checksum of REFINED_REST is another": lambda: layered().change(
        REFINED_REST, 3, checksum=0
    ),
    "refined-rest-cut TRUNCATED 3: the file ends inside REFINED_REST": lambda: cut(
        lambda draft: end_of(draft, REFINED_REST, 3) - 1, layered().draft()
    ),
}.items():
    invalid(title, make)

for name, why, error, change in (
    ("exact", "of a rest pose that is exact", "BAD_CHUNK", None),
    ("step", "whose Rest_Step is 0", "BAD_CHUNK", lambda content: dict(content=bytes(4) + content[4:])),
    ("behind", "with a zero byte behind its stream", "BAD_CHUNK", lambda content: dict(content=content + b"\0")),
    ("checksum", "whose Checksum is another", "BAD_CHECKSUM", lambda content: dict(checksum=0)),
):
    invalid(
        f"refined-rest-1-{name}: REFINED_REST of level 1 {why}", lambda change=change: bad_rest_of_1(change), error, 1
    )
for title, make in {
    "layers-shapes-of-many-modes: eight shapes of a piece of 18 modes, the last of which have "
    "rows of their own": lambda: Plant(
        [Stem(-1, 18)],
        frames=3,
        layers=2,
        heads=LAYER_HEADS,
        scripts={
            (SHAPES, 0, 0): [6, *(n for i in range(6) for n in row((i, 1, 0), (2, 0, -i)))],
            (SHAPES, 1, 0): [2, *row((0, 0, 1)), *row((1, 0, 0), (0, 0, 0), (0, 3, 1))],
            (SHAPES, 2, 0): [8, *(n for i in range(8) for n in refined_row((i % 3, -1, 0)))],
        }
        | {(STEMS, level): lambda level=level: Chance(517 + level, large=6, empty=0.1) for level in range(3)},
    ),
    "layers-shapes-largest: a shape with the largest integers there are, which a refinement of "
    "Shift 0 goes back from": lambda: Plant(
        SHORT,
        frames=2,
        layers=2,
        shift=0,
        heads=LAYER_HEADS,
        scripts={
            (SHAPES, 0, 0): [2, *row((LARGEST, 1, 0)), *row((0, -LARGEST, 3))],
            (SHAPES, 2, 0): [2, *refined_row((-LARGEST, 0, 0)), *refined_row((0, -LARGEST, 0))],
        }
        | {(STEMS, level): lambda level=level: Chance(521 + level, large=6, empty=0.0) for level in range(3)},
    ),
    "layers-halves: what is predicted of one vertex is half the ratio, in another basis than before, and half a "
    "step in the same": lambda: Plant(
        [Stem(-1, 1)],
        frames=4,
        segments=2,
        layers=2,
        heads={
            0: stems_head(0.5, 0, 2, 2, IMPULSES),
            (2, 0): stems_head(0.25, 0, 2, 2, IMPULSES),
            (2, 1): stems_head(1.0, 0, 2, 2, base=0),
        },
        scripts={(STEMS, 0): row((1, 0, -1), (-1, 2, 3)), (STEMS, 2): row()},
    ),
    "layers-rigid-turned-300: a branch that moves as it is turned by 100, 180, 250 and 300 degrees, one after the "
    "other": lambda: Plant(
        [Stem(-1, 4, rigid=1)],
        frames=5,
        layers=2,
        is_float64=True,
        rest=exact_rest([Stem(-1, 4)], [0.0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5], True),
        heads={
            0: stems_head(8.0, 4 << 4, 2, 5, basis_stream([[8192 * (k == t) for t in range(5)] for k in range(5)])),
            2: stems_head(0.25),
        },
        scripts={
            (STEMS, 0): [*row(), *row(*((0, 0, n) for n in (0, 7, 16, 31, 60)))],
            (STEMS, 2): [0, *refined_row((3, -5, 2))],
        },
    ),
    "layers-rigid-from-a-point: rigid branches at one place in the first layer, where they have no rotation, and "
    "not in the next": lambda: Plant(
        [Stem(-1, 2), Stem(0, 3, 1, rigid=1), Stem(0, 3, 1, rigid=2)],
        frames=2,
        layers=2,
        points=[[0, 0, 0], *[[1, 2, 3]] * 7],
        heads=LAYER_HEADS,
        scripts={(STEMS, level): lambda level=level: Chance(525 + level, large=6) for level in range(4)}
        | {(REFINED_REST, 3, 0): lambda: Chance(529, large=4, empty=0.0)},
    ),
    "layers-rigid-ratios-near: steps of rotations are 63000 and 67000 times those of the next layer, and less than "
    "half of them": lambda: Plant(
        [Stem(-1, 3, rigid=2)],
        frames=6,
        segments=3,
        layers=2,
        is_float64=True,
        points=[[0, 0, 0], [3, 0, 0], [1, 4, 0]],
        heads={0: stems_head(0.125)}
        | {
            (2, s): stems_head(0.125 / ratio, 0, 2, 1, basis_stream([[int(size * 8192)] * 2]))
            for s, (ratio, size) in enumerate(HALVED_RATIOS)
        },
        scripts={(STEMS, 0): [*row(), *row((1, -1, 1))]}
        | {(STEMS, 2, s): [*row(), *refined_row((1, 0, 2))] for s in range(3)},
    ),
    "layers-rigid-turned: branches that move as they are, turned by up to 360 degrees, which the next layers go on "
    "from": lambda: stiff(
        217, frames=12, heads={level: stems_head(((8.0,) * 5 + (2.0, 0.5))[level], 3 << 4) for level in range(7)}
    ),
    "layers-rigid-ratios: the step of a rotation is over 65535 times that of the next layer, and that less than the "
    "one of the last": lambda: stiff(
        218,
        frames=4,
        segments=2,
        heads={
            **{level: stems_head(64.0, 2) for level in range(5)},
            5: stems_head(1e-4, 0, *LAST_BASIS),
            6: stems_head(1e-4, 2),
        },
    ),
    "layers-rigid-half-turns: a branch that moves as it is, turned by 180 degrees about each of its axes: whose "
    "quaternions begin with 0": lambda: Plant(
        [Stem(-1, 4, rigid=1)],
        frames=5,
        segments=5,
        layers=2,
        is_float64=True,
        rest=exact_rest([Stem(-1, 4)], [0.0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5], True),
        heads={0: stems_head(8.0, 4 << 4), 2: stems_head(0.25)},
        scripts={(STEMS, 0, s): [*row(), *row(turn)] for s, turn in enumerate(HALF_TURNS)}
        | {(STEMS, 2, s): [0, *refined_row((3, -5, 2))] for s in range(5)},
    ),
}.items():
    valid(title, make)


refinement(STEMS, "ratio-cut: STEMS of a refinement of 1 byte", b"\4")


class Lasting(Chance):
    """Rows of the first frequency alone."""

    def answer(self, asked: str, most: int):
        return min(1, most) if asked == "count" else super().answer(asked, most)


valid(
    "layers-shapes-of-first-piece: one of two pieces has shapes, in the first layer alone: predictions in the next are "
    "of all its modes, and of the frequencies of the first",
    lambda: Plant(
        FORK,
        frames=7,
        layers=2,
        heads={level: stems_head(0.5 / 4 ** max(level - 2, 0), 1) for level in range(5)},
        scripts={
            (SHAPES, 1, 0): [1, *row((1, 0, 2), (0, 5, 0), (3, 0, 4)), 0],
            **{(STEMS, level): lambda level=level: Lasting(530 + level, large=7, empty=0.0) for level in range(3)},
            (STEMS, 3): lambda: Chance(534, large=9, empty=0.0),
        },
    ),
)
valid(
    "layers-rigid-turned-340: a branch that moves as it is, turned by up to 335 degrees one after the other, and "
    "rotations that the next layer predicts from there: beyond 308 degrees they turn the other way",
    lambda: Plant(
        [Stem(-1, 4, rigid=1)],
        frames=7,
        layers=2,
        is_float64=True,
        rest=exact_rest([Stem(-1, 4)], [0.0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5], True),
        heads={
            0: stems_head(8.0, 4 << 4, 2, 7, basis_stream([[8192 * (k == t) for t in range(7)] for k in range(7)])),
            2: stems_head(0.25, 1),
        },
        scripts={
            (STEMS, 0): [*row(), *row(*((0, 0, n) for n in (0, 7, 16, 31, 60, 88, 140)))],
            (STEMS, 2): [0, 0, *refined_row((3, -5, 2))],
        },
    ),
)
