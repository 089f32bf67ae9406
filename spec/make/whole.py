"""All features in one file, what the encoder writes, and the same rules in binary64."""

import tempfile
from pathlib import Path

from spec import real_size
from spec.make.base import *
from spec.make.bases import basis_by_chance
from spec.make.clips import loop
from spec.make.polygons import FACES_3, derived, polygons
from spec.make.rest import coded_rest
from spec.make.source_rest import bent
from spec.make.static import WIND_FRAME, element, numbers

EVERYTHING = stems_of(
    "-1 6 lag=1, 0 1 3 lag=2, 0 66 5 LOOSE, 2 5 60 SHEET LOOSE, 3 3 0 LOOSE, 2 4 1 WHOLE lag=0, 5 4 3 SHEET "
    "lag=0, -1 7 0 SHEET, 7 2 3 SHEET WHOLE, 7 5 6 SHEET lag=0, 7 4 1, 10 2 2, -1 1 0 WHOLE, 12 2, 12 3 0 "
    "LOOSE, -1 3, 15 3 2 LOOSE WHOLE, 16 2 1 LOOSE"
)


def everything() -> Draft:
    """Return the draft of a file in which every feature of the format occurs at once."""
    random = np.random.default_rng(99)
    vertices = sum(stem.count for stem in EVERYTHING)
    places = [*range(vertices), 2, 0, 2]
    bases = {
        level: stems_head(0.03 + 0.01 * level, level % 3, 2, rank, basis_by_chance(random, rank, 5))
        for level, rank in ((1, 3), (2, 1), (4, 5))
    }
    plant = Plant(
        EVERYTHING,
        clips=(loop(Clip(5, 1, "up"), 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.0), Clip(5, 1, "down")),
        rest=coded_rest(EVERYTHING, Chance(71, begin=[0]), rest_type=1, origin=(10.0, -3.5, 0.25), step=0.01),
        source_rest=bent(EVERYTHING, Chance(93, large=9)),
        time=uneven_time(*random.random((2, 5)).cumsum(axis=1).ravel().tolist()),
        branch_source=random.permutation(len(EVERYTHING)).tolist(),
        vertex_source=random.permutation(vertices).tolist(),
        places=places,
        is_float64=True,
        layers=2,
        heads=HEADS | bases | {5: stems_head(0.01, 2)},
        scripts={(STEMS, level): 72 + level for level in range(6)}
        | {(AFFINES, level): lambda level=level: Chance(80 + level, large=3) for level in range(5)}
        | {(CORRECTIONS, level): 86 + level for level in (4, 5)}
        | {(REFINED_REST, 5, 0): lambda: Chance(92, large=4)}
        | {
            (SHAPES, 1, 0): [
                2,
                *row((1, 2, -3), (0, 0, 9)),
                *row((5, 0, 0)),
                1,
                *row((3, 1, 4)),
                0,
                0,
                9,
                *(n for i in range(9) for n in row((i, 1, -i), (0, 2, 0))),
            ],
            (SHAPES, 2, 0): [1, *row((0, 1, 0)), 0, 2, *row((1, 0, 0), (0, 0, 1)), *row((0, 0, 8))],
            (SHAPES, 5, 0): [2, *refined_row((0, -1, 0)), *refined_row((3, 0, 0), (0, 0, -1))],
        },
    )
    return plant.with_header(level_count=7, full_level_count=7).add(
        Entry(EXACT, b"", 6, 0),
        Entry(EXACT, b"", 6, 1),
        Entry(METADATA, b"\1" + WIND_FRAME),
        Entry(FACES, polygons(FACES_3, places)),
        Entry(EDGES, derived("<i2")),
        Entry(0x8009, FUTURE),
        Entry(0x8018, FUTURE, 1, 1),
        Entry(ATTRIBUTE, numbers(np.arange(6.0).reshape(2, 3), name="b")),
        Entry(ATTRIBUTE, element("|S3", b"oak", "a")),
        Entry(0x8040, FUTURE),
    )


def encoded(name: str) -> bytes:
    """Return the bytes of a small plant's file as athcodec's encoder writes it. `name` selects the plant and the
    options.
    """
    import athcodec
    from athcodec.motion.clip import MotionClip

    stems = {
        "encoded-tree": [Stem(-1, 9), Stem(0, 6, 4), Stem(1, 5, 3), Stem(0, 5, 8), Stem(3, 3, 2)],
        "encoded-wide": [Stem(-1, 5), Stem(0, 4, 3)],
        "encoded-exact-rest": [Stem(-1, 4), Stem(0, 3, 1), Stem(-1, 2)],
        "encoded-noise": [Stem(-1, 4), Stem(0, 3, 2)],
        "encoded-clips": [Stem(-1, 4), Stem(0, 3, 2)],
        "encoded-lossless": [Stem(-1, 4), Stem(0, 3, 1)],
        "encoded-lossless-wide": [Stem(-1, 3), Stem(0, 2, 1)],
        "encoded-layers": [Stem(-1, 9), Stem(0, 6, 4), Stem(1, 5, 3), Stem(0, 5, 8), Stem(3, 3, 2)],
        "encoded-layers-lossless": [Stem(-1, 4), Stem(0, 3, 1)],
    }[name]
    random = np.random.default_rng(7)
    rest = np.array(grown(stems, 7)) * 0.1
    lift = np.linalg.norm(rest - rest[0], axis=1)[:, None]
    swing = np.sin(np.linspace(0, 6, 40)[:, None, None] * [1.0, 2.0, 3.0] + 2 * lift) * lift**2 * 0.05
    noise = random.normal(size=(40, *rest.shape)) * (0.1 if name == "encoded-noise" else 1e-4)
    clip = MotionClip(
        positions=(rest + swing + noise).astype(np.float64 if "wide" in name else np.float32),
        rest=rest,
        time=np.arange(40) / 30,
        vertex_branch=np.repeat(np.arange(len(stems)), [s.count for s in stems]),
        branch_parent=np.array([s.parent for s in stems]),
        metadata={"unit": "m"},
    )
    if name == "encoded-clips":
        clip = athcodec.join({"whole": clip, "loop": athcodec.looped(clip, blend=9)})
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "clip.ath"
        athcodec.encode(
            clip,
            target,
            rel_error=2e-3,
            segment_frames=20,
            ladder=(1e-1, 2e-2) if "layers" in name else (),
            exact_rest=name == "encoded-exact-rest",
            lossless="lossless" in name,
        )
        return target.read_bytes()


valid("everything: every kind of chunk, flag, method and stream in one file", everything)
for name, why in (
    ("encoded-tree", "a small tree in wind"),
    ("encoded-wide", "binary64 positions"),
    ("encoded-exact-rest", "a rest pose bit for bit"),
    ("encoded-noise", "vertices that follow no plant"),
    ("encoded-clips", "two clips, one of them a loop"),
    ("encoded-lossless", "every bit of the source at the last level"),
    ("encoded-lossless-wide", "every bit of binary64 positions at the last level"),
    ("encoded-layers", "three layers of precision"),
    ("encoded-layers-lossless", "three layers of precision, then every bit of the source"),
):
    valid(f"{name}: what athcodec wrote: {why}", lambda name=name: encoded(name), scripted=False)
for name_, contents in (
    (
        "all",
        "clips, a loop, uneven times, repeats, layers, learned bases, tubes, a rest pose by faces, a second one, mixed "
        "faces, edges, attributes, every bit of the source",
    ),
    ("refined-rest", "the same with joins, loose branches and a rest pose that layers refine"),
    ("exact-rest", "the same about an exact rest pose, which excludes refined ones"),
    ("predicted", "the same in predicted motion, which excludes modes, shapes, bases, corrections, joins and layers"),
):
    valid(
        f"real-size-{name_}: what athcodec wrote of a tree with leaves: {contents}",
        lambda name_=name_: real_size.encoded(name_),
        scripted=False,
    )
