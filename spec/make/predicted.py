"""PREDICTED: motion without modes."""

from spec.make.base import *

ROOTED = [Stem(-1, 4, flags=WHOLE), Stem(0, 3, 2), Stem(1, 2, 2), Stem(0, 3, 3)]
SINGLE = [Stem(-1, 1, flags=WHOLE)]
TWINS = [Stem(-1, 6, flags=WHOLE), Stem(-1, 6, flags=WHOLE), Stem(1, 2, 5)]
ROOTS = [Stem(-1, 1), Stem(-1, 3), Stem(-1, 2, flags=WHOLE), Stem(2, 2, 1)]
LONG = [Stem(-1, 5, flags=WHOLE), Stem(0, 4, 3)]
FORKED = [Stem(-1, 3), Stem(0, 2, 1)]
RESTING = [0, 1, *[0] * 16]  # a frame of them that is no copy, and in which none follow


def frame_of(stems: list[Stem], of_vertex: Callable[[], list[int]], follow: Callable[[], int]) -> list[int]:
    """Return the integers that code one predicted frame. `of_vertex` returns those of a vertex, and `follow` how the
    inner vertices of a stem are coded: 0 one by one, else as followers of the stem's ends.
    """
    values = []
    for stem in stems:
        ends = 2 if stem.parent < 0 and stem.count > 1 else 1
        for _ in range(ends):
            values += of_vertex()
        if stem.count > ends:
            followed = follow()
            values += ([0], [1, 0], [1, 1, 0])[followed]
            for _ in range(stem.count - ends if not followed else 0):
                values += of_vertex()
    return values


def followed_at(share: float) -> int:
    """Return who follows the ends of a stem: none from 1 on, below that all, in two ways."""
    return 2 if share < 0.5 else int(share < 1)


def frame_steps(stems: list[Stem], seed: int, large: int = 12, still: float = 0.5, follow: float = 0.3) -> list[int]:
    """Return random integers that code the vertices of one predicted frame. A vertex stands still with probability
    `still`, inner vertices follow their stem's ends with probability `follow`, and `large` bounds the integers, in
    bits.
    """
    chance = Chance(seed, large=large)

    def of_vertex() -> list[int]:
        moved = int(chance.random.random() >= still)
        return [1, *(chance.answer("signed", 0) for _ in range(3))] if moved else [0]

    return frame_of(stems, of_vertex, lambda: followed_at(chance.random.random() / follow))


def predicted(stems: list[Stem], frames: list, segments: int = 1, **fields) -> Plant:
    """Return PREDICTED. frames: of each segment alike what it is coded about, (copied, 1) or (copied, 0, distance - 1),
    and its steps."""
    scripts = {(PREDICTED, 1, s): [x for frame in frames for x in frame] for s in range(segments)}
    fields = {"predicted": predicted_head()} | fields
    fields["scripts"] = scripts | fields.get("scripts", {})
    return Plant(stems, len(frames) * segments, segments, **fields)


def swayed(frames: int, seed: int, stems: list[Stem] = ROOTED, **options) -> list:
    return [[0, 1, *frame_steps(stems, seed + t, **options)] for t in range(frames)]


def swaying() -> Draft:
    return predicted(ROOTED, swayed(3, 18), 2).draft()


PREDICTED_PLACE = PREDICTED, 1, 1


def with_source(draft: Draft, seed: int) -> Draft:
    """Return a draft with a last level that is the source's own motion, up to 2^22 floating-point numbers away from the
    level before it.
    """
    file, level, chance = rules.open_file(draft.file()), draft.header["level_count"], Chance(seed, large=22)
    plans = rules.plans_of(file, level - 1)

    def stream(s: int) -> bytes:
        positions = rules.decode_segment(file, plans, s, level - 1)
        differences = [chance.answer("signed", 0) for track in positions for x in track for _ in x]
        return write(rules.decode_exact, [(abs(n), n < 0) for n in differences], positions, file.header.is_float64)

    added = [Entry(EXACT, stream(s), level, s) for s in range(draft.header["segment_count"])]
    joins_there = draft.joins and (*draft.joins, *joins(*(0,) * len(added)))
    return replace(draft, joins=joins_there).with_header(level_count=level + 1, full_level_count=level + 1).add(*added)


SOURCE_FRAMES = [  # with copies, of the frame before, of earlier ones and of the rest pose
    [0, 1, *frame_steps(ROOTED, 150)],
    [1, 1],
    [0, 0, 1, *frame_steps(ROOTED, 151)],
    [1, 0, 3],
    [0, 1, *frame_steps(ROOTED, 152)],
    [1, 0, 1],
]


def cells(seed: int) -> list[list[float]]:
    """Return places of vertices, each of them of two that are less or more than half a cell apart, or beyond all
    cells."""
    random, cell = np.random.default_rng(seed), 0.0625 / 256
    first = random.integers(-3000, 3000, (32, 3))
    first[29:] *= 10**6
    second = first + random.choice([-0.7, -0.4, 0.0, 0.0, 0.4], (32, 1)) * random.integers(0, 2, (32, 3))
    return (cell * np.vstack([first, second])[np.argsort(random.random(64))]).tolist()


PAIR, POINTS = [Stem(-1, 2, flags=WHOLE)], [Stem(-1, 1)] * 64
LEAVING = [  # both ends of a stem, and those between them: a root that leaves binary32, and others that follow it
    *([0, 1, 1, 20, 0, 1, 1, move, 1, 0, 0, 0, 0] for move in (20, 1, 0, 0, -1, 0, 0)),
    *([0, 1, 1, 60, 3, 0, 1, 0, 1, move, 1, 0] for move in (2, 0, 0, 1)),
    *([0, 0, distance, 0, 1, 0, move, 0, 1, 0] for distance, move in ((8, 1), (0, 2))),
]


def turns(seed: int) -> list:
    """Return frames of two vertices that move far, about late and about early ones."""
    random = np.random.default_rng(seed)
    return [
        [0, 0, int(random.integers(0, min(t + 1, 6)) * (t % 3 == 2)), *frame_steps(PAIR, seed + t, large=9, still=0.2)]
        for t in range(24)
    ]


RUNS_OF_COPIES = (3, 9, 8, 12, 7, 10, 6, 8, 9, 7, 11, 8, 0, 8, 1, 9)


def in_runs() -> Plant:
    """Return each frame that is no copy is followed by so many copies."""
    frames = []
    for seed, copies in enumerate(RUNS_OF_COPIES):
        frames += [[0, 1, *frame_steps(SINGLE, 500 + seed)], *[[1, 1]] * copies]
    return predicted(SINGLE, frames)


for title, make in {
    "predicted-still: nothing moves": lambda: predicted(ROOTED, [RESTING] * 3),
    "predicted-smallest: one vertex, one frame": lambda: predicted(SINGLE, [[0, 1]]),
    "predicted: vertices move at random, longer than any line": lambda: predicted(ROOTED, swayed(30, 1, large=5)),
    "predicted-following: most stems follow their ends, for long and then for a while not": lambda: predicted(
        ROOTED, swayed(8, 21, follow=0.9) + swayed(4, 40, follow=0.1) + swayed(8, 50, follow=0.9)
    ),
    "predicted-following-huge: what follows leaves the range of binary32, and of binary64": lambda: predicted(
        LONG, swayed(6, 60, LONG, large=30, follow=1.0), predicted=predicted_head(FLOAT_MAX), is_float64=True
    ),
    "predicted-references: frames that are copies of earlier ones, of the rest pose, and coded "
    "about earlier ones": lambda: predicted(
        ROOTED,
        [
            [0, 1, *frame_steps(ROOTED, 3)],
            [0, 1, *frame_steps(ROOTED, 4)],
            [1, 1],
            [1, 1],
            [0, 0, 2, *frame_steps(ROOTED, 5)],
            [1, 0, 5],
            [0, 1, *frame_steps(ROOTED, 6)],
            [0, 0, 0, *frame_steps(ROOTED, 7)],
        ],
    ),
    "predicted-all-copied: every frame is the rest pose": lambda: predicted(ROOTED, [[1, 1]] + [[1, 0, 0], [1, 0, 2]]),
    "predicted-twins: vertices that rest at the same places, and a stem as long as another": lambda: predicted(
        TWINS, swayed(9, 8, TWINS, large=6), points=[[4.0 * (i % 3), float(i % 2), 1.0] for i in range(14)]
    ),
    "predicted-collapsed: all vertices rest at one place": lambda: predicted(
        ROOTED, swayed(6, 9), points=[[2.0, 2.0, 2.0]] * 12
    ),
    "predicted-huge: the largest integers and steps: positions leave the range of binary32": lambda: predicted(
        SINGLE, [[0, 1, 1, (1 << 30) - 1, -((1 << 30) - 1), 1]] * 5, predicted=predicted_head(FLOAT_MAX)
    ),
    "predicted-tiny: a subnormal Step": lambda: predicted(ROOTED, swayed(4, 10), predicted=predicted_head(FLOAT_TINY)),
    "predicted-wide: binary64 positions far from the origin": lambda: predicted(
        ROOTED, swayed(7, 11), is_float64=True, origin=(1e6, -3e5, 0.125)
    ),
    "predicted-rounded: binary32 positions far from the origin, a step below their spacing": lambda: predicted(
        ROOTED, swayed(7, 12), origin=(1e6, -3e5, 0.125)
    ),
    "predicted-segments: two segments, of which one has maps for level 0": lambda: predicted(
        ROOTED, swayed(5, 13), 2, scripts={(AFFINES, 0, 1): [-8, *row((5, -3, 1), (0, 2, 0))]}
    ),
    "predicted-roots: maps of roots of one vertex, of one stem and of a subtree": lambda: predicted(
        ROOTS, swayed(3, 14, ROOTS), scripts={(AFFINES, 0, 0): lambda: Chance(15, large=4)}
    ),
    "predicted-level-0: shortened: level 0 of 2": lambda: predicted(ROOTED, swayed(2, 16)).upto(0),
    "predicted-lossless: the source's own numbers behind it": lambda: (
        predicted(ROOTED, swayed(2, 17)).with_header(level_count=3, full_level_count=3).add(Entry(EXACT, b"", 2, 0))
    ),
}.items():
    valid(title, make)

for title, make in {
    "predicted-missing BAD_CHUNK_TABLE: a segment has none": lambda: swaying().without(*PREDICTED_PLACE),
    "predicted-stems BAD_CHUNK_TABLE: a segment has STEMS too": lambda: swaying().add(Entry(STEMS, stems_head(), 1, 0)),
    "predicted-corrections BAD_CHUNK_TABLE: a segment has CORRECTIONS too": lambda: swaying().add(
        Entry(CORRECTIONS, struct.pack("<f", 0.5), 1, 0)
    ),
    "predicted-unsaid BAD_CHUNK_TABLE: PREDICTED where Is_Predicted is 0": lambda: fork().add(
        Entry(PREDICTED, predicted_head(), 2, 0)
    ),
    "predicted-at-level-0 BAD_CHUNK_TABLE: PREDICTED of level 0": lambda: swaying().add(
        Entry(PREDICTED, predicted_head(), 0, 0)
    ),
    "predicted-layers BAD_HEADER: Layer_Count 2": lambda: swaying().with_header(layer_count=2, full_level_count=3),
    "predicted-nodes BAD_HEADER: h is 1": lambda: predicted(FORKED, swayed(1, 19, FORKED)).with_header(
        full_level_count=3, level_count=2
    ),
}.items():
    invalid(title, make)

for name, reason, content in (
    ("short", "3 bytes", predicted_head()[:3]),
    ("step-0", "Step 0", predicted_head(0.0)),
    ("step-nan", "Step is NaN", predicted_head(math.nan)),
    ("left-over", "a byte behind the stream", predicted_head() + b"\1" * 400),
    ("zero", "a stream that ends in 0", predicted_head() + b"\1\0"),
):
    invalid(
        f"predicted-{name} BAD_CHUNK 1: {reason}",
        lambda content=content: swaying().change(*PREDICTED_PLACE, content=content),
    )
invalid(
    "predicted-before-first BAD_CHUNK 1: a frame is coded about one before the rest pose",
    lambda: predicted(ROOTED, [RESTING, [0, 0, 2]]),
)
valid(
    "predicted-on-vertex-0: a stem on vertex 0, whose first vertex is no end",
    lambda: predicted([Stem(-1, 2, flags=WHOLE), Stem(0, 3, 0)], swayed(6, 510, [Stem(-1, 2), Stem(0, 3, 0)])),
)
for name_, more_ in (("", {}), ("-wide", {"is_float64": True, "origin": (3.0, -1e3, 0.1)})):
    valid(
        f"predicted-lossless-repeats{name_}: the source's own numbers, which differ where predicted motion has copies, "
        "of frames that are shown for long; level 0 is joined",
        lambda more_=more_: with_source(
            replace(
                predicted(ROOTED, SOURCE_FRAMES, 2, scripts={(AFFINES, 0): lambda: Chance(153, large=4)}, **more_),
                frames=20,
                repeats=(0, 1, 0, 0, 1, 1, 0, 0, 0, 1) + (0, 0, 0, 1, 0, 0, 1, 0, 1, 1),
                joins=joins(0, 2.5, 0, 0),
            ).draft(),
            154,
        ),
    )
for title, make in {
    "predicted-long: more frames than means are of, and more than vertices are of any line": lambda: predicted(
        PAIR, swayed(200, 213, PAIR, large=5, still=0.1)
    ),
    "predicted-cells: vertices that follow others at the same places, unless the entry of their "
    "cell has been taken": lambda: predicted(
        POINTS,
        swayed(3, 310, POINTS, large=6, still=0.2),
        rest=exact_rest(POINTS, np.array(cells(223)).ravel().tolist(), True),
        is_float64=True,
    ),
    "predicted-beyond: a root that leaves binary32: what is expected to go with it stays, and so does what follows "
    "ends": lambda: predicted([Stem(-1, 4, flags=WHOLE)], LEAVING, predicted=predicted_head(1e36)),
    "predicted-turns: lines that begin anew in frames that are coded about earlier ones": lambda: predicted(
        PAIR, turns(330)
    ),
    "predicted-about-copies: frames that are coded about copies, about copies of copies, and about frames that were "
    "coded about these": lambda: predicted(
        ROOTED,
        [
            *swayed(2, 320, still=0.1),
            *([1, 1], *swayed(1, 322, still=0.1), [1, 1], [1, 1], *swayed(2, 323, still=0.1)),
            *([0, 0, 3, *frame_steps(ROOTED, 325, still=0.1)], [0, 0, 0, *frame_steps(ROOTED, 326, still=0.1)]),
            *([1, 0, 6], [0, 0, 0, *frame_steps(ROOTED, 327, still=0.1)], *swayed(2, 328, still=0.1)),
        ],
    ),
    "predicted-copied-rest: a copy of the rest pose, rounded as it is shown, which others are coded about": lambda: (
        predicted(
            ROOTED,
            [[1, 1], *swayed(2, 315, still=0.1), [1, 0, 3], *swayed(2, 317, still=0.1)],
            origin=(1e6, -3e5, 0.125),
            step=0.01,
        )
    ),
    "predicted-long-runs: runs of copied frames of up to 12, of which those from 7 on are alike": in_runs,
}.items():
    valid(title, make)


invalid(
    "predicted-step-infinite BAD_CHUNK 1: Step is infinite",
    lambda: swaying().change(*PREDICTED_PLACE, content=predicted_head(INFINITY)),
)
valid(
    "predicted-short-exactly: a step and a way at rest whose squares add up to 1e-60, which is no more than that",
    predicted,
    [Stem(-1, 3, flags=WHOLE)],
    swayed(6, 140, [Stem(-1, 3, flags=WHOLE)], follow=1.0, still=0.1),
    rest=exact_rest([Stem(-1, 3)], [0, 0, 0, 0, 3e-31, 2e-31, 9.50870501981432e-31, 2.9299366694240276e-31, 0], True),
    predicted=predicted_head(1e-31),
    is_float64=True,
)
GROWING = [  # of both stems: how far the tip is off what is expected of it, which vertices follow, and how many do not
    *(((-72, 1, 0), (4, 2, 0)), ((14, 3, 0), (2, 3, 0)), ((4, 3, 1), (4, 2, 0)), ((-6, 2, 0), (0, 3, 1))),
    *(((12, 3, 2), (0, 3, 1)), ((20, 2, 0), (0, 3, 2)), ((0, 1, 0), (-10, 0, 3)), ((0, 3, 3), (12, 3, 3))),
]


def growing() -> Plant:
    """Return a plant of two stems whose tips move along them, from near the base to the end. The first stem's tip
    arrives earlier.
    """
    stems, frames = [Stem(-1, 5)] * 2, []
    for frame in GROWING:
        values = [0, 1]
        for move, mode, others in frame:
            values += [0, *([1, move, 0, 0] if move else [0]), *([1] * mode + [0])[:3], *[0] * others]
        frames.append(values)
    points = [[10.0 * i, 40.0 * j, 0.0] for j in range(2) for i in range(5)]
    return predicted(stems, frames, points=points, predicted=predicted_head(0.5))


valid(
    "predicted-growing: two tips that go along their stems at the same pace, until one is at its end: vertices follow "
    "their tip in all ways, one after the other",
    growing,
)
valid(
    "predicted-tiny-plant: a plant of 2^-70, whose guesses are wrong by far less than 1",
    lambda: predicted(
        ROOTED,
        swayed(6, 511, large=5, still=0.1),
        rest=exact_rest(ROOTED, (2.0**-70 * np.array(grown(ROOTED, 511))).ravel().tolist(), True),
        predicted=predicted_head(2.0**-74),
        is_float64=True,
    ),
)


# ---- some trees beside others in modes ----

BESIDE = stems_of("-1 4, 0 3 2, -1 5 LOOSE, 2 3 3, 3 2 1, -1 3 0 SHEET, -1 2 LOOSE WHOLE, 6 2 1")
GROWN = [Stem(-1, 5), Stem(0, 3, 3), Stem(1, 2, 1), Stem(-1, 2), Stem(3, 2, 1)]  # Those of BESIDE that are predicted.


def beside(seed: int, frames: int = 5, segments: int = 1, layers: int = 1, **fields) -> Plant:
    """Return trees with predicted motion among others, which hold random rows like any others."""
    make = moving if layers == 1 else refinements
    heads = HEADS if layers == 1 else LAYER_HEADS
    fields = {"frames": frames * segments, "segments": segments, "heads": heads, "layers": layers} | fields
    plant, last = make(BESIDE, seed, trees=predicted_head(), **fields), 2 + layers
    steps = swayed(frames, 10 * seed, GROWN)
    plant.scripts[PREDICTED, last] = [x for frame in steps for x in frame]
    return plant


for title, make in {
    "predicted-trees: two trees that are predicted among two that are not": lambda: beside(600),
    "predicted-trees-copied: the same with copies of frames and of the rest pose, in binary64": lambda: replace(
        beside(601, is_float64=True, origin=(1e6, -3e5, 0.125)),
        scripts=beside(601, is_float64=True).scripts
        | {(PREDICTED, 3): [1, 1, 0, 1, *frame_steps(GROWN, 602), 1, 1, 1, 0, 2, 0, 0, 2, *frame_steps(GROWN, 603)]},
    ),
    "predicted-trees-layers: in three layers, about the rest pose of the last": lambda: beside(604, layers=3),
    "predicted-trees-joins: in two joined segments, with corrections of all trees: none of both moves what is "
    "predicted": lambda: (lambda plant: replace(plant, scripts=plant.scripts | {(CORRECTIONS, 3): 605}))(
        beside(605, 6, 2, joins=joins(0, 3, 0, 2.5, 0, 4, 0, 1.5))
    ),
    "predicted-trees-shortened: without the last level, which alone is predicted": lambda: beside(606).upto(2),
    "predicted-trees-twins: vertices of both trees and of others that rest at one place": lambda: beside(
        607, points=[[4.0 * (i % 3), float(i % 2), 1.0] for i in range(24)]
    ),
    "predicted-trees-alone: no tree is left that is not predicted": lambda: replace(
        moving(stems_of("-1 3 LOOSE, 0 2 1"), 608, trees=predicted_head(), heads=HEADS),
        scripts=moving(stems_of("-1 3 LOOSE, 0 2 1"), 608).scripts
        | {(PREDICTED, 2): [x for frame in swayed(3, 608, FORKED) for x in frame]},
    ),
    "predicted-trees-lossless: the source's own numbers behind it": lambda: with_source(beside(609, 4).draft(), 610),
}.items():
    valid(title, make)
for title, make in {
    "predicted-trees-missing BAD_CHUNK_TABLE: a segment has no PREDICTED": lambda: (
        beside(611, 5, 2).draft().without(PREDICTED, 3, 1)
    ),
    "predicted-trees-early BAD_CHUNK_TABLE: PREDICTED of the level before, too": lambda: beside(612).add(
        Entry(PREDICTED, predicted_head(), 2, 0)
    ),
    "predicted-trees-of-layer BAD_CHUNK_TABLE: PREDICTED of each layer": lambda: beside(613, layers=2).add(
        Entry(PREDICTED, predicted_head(), 3, 0)
    ),
    "predicted-trees-of-predicted BAD_HEADER: a root is LOOSE and Is_Predicted is set": lambda: predicted(
        [Stem(-1, 4, flags=WHOLE | LOOSE)], swayed(2, 614, [Stem(-1, 4)])
    ),
}.items():
    invalid(title, make)
invalid(
    "predicted-trees-left-over BAD_CHUNK 3: a byte behind the stream",
    lambda: beside(615).change(PREDICTED, 3, 0, content=predicted_head() + b"\1" * 400),
)
