"""CLIPS: several motions, loops, periodic waves."""

from spec.make.base import *

CALM, STORM = Clip(3, 1, "calm"), Clip(4, 2, "storm")


def two_clips(**fields) -> Draft:
    """Return the fork with two clips, of 3 frames, and of 4 in two segments."""
    return forked(**{"clips": (CALM, STORM)} | fields).draft()


def loop(clip: Clip, *seams: float) -> Clip:
    return replace(clip, seams=seams)


def periodic(clip: Clip, *seams: float) -> Clip:
    return replace(loop(clip, *seams), periodic=True)


def named(*names: str) -> Plant:
    """Return one vertex with a clip of a frame for each name."""
    return lone(clips=tuple(Clip(1, 1, name) for name in names))


CALM_ENTRY, STORM_ENTRY = CALM.entry(), STORM.entry()


def clips(title: str, *entries: bytes, count: int = 2) -> None:
    """Declare a vector of the two clips with another CLIPS."""
    invalid(
        f"clips-{title}", lambda: two_clips().with_header(clip_count=count).change(CLIPS, content=b"".join(entries))
    )


def lone_clips(frames: int, segments: int, *entries: bytes, **header_fields) -> Draft:
    """Return one vertex, and any CLIPS."""
    draft = lone(frames=frames, segments=segments).add(Entry(CLIPS, b"".join(entries)))
    return draft.with_header(clip_count=len(entries), **header_fields)


UNEVEN = clip_entry(256, 1, "long"), clip_entry(2, 2, "short")


for title, make in {
    "clips-two: two clips of different lengths, that share the shapes of pieces": two_clips,
    "clips-three: 13 frames in 6 segments, which without the clips would begin elsewhere": lambda: moving(
        FORK, 28, heads=HEADS, clips=(Clip(5, 2, "a"), Clip(1, 1, "b"), Clip(7, 3, "c"))
    ),
    "clips-of-one-frame: three clips of one frame each, one of them a loop": lambda: moving(
        FORK, 29, heads=HEADS, clips=(Clip(1, 1, "a"), loop(Clip(1, 1, "b"), 0.0, 0.0, 0.0), Clip(1, 1, "c"))
    ),
    "clips-segment-lengths: a segment of as many frames as there can be before shorter ones": lambda: lone(
        clips=(Clip(256, 1, "long"), Clip(257, 2, "longer"), Clip(2, 2, "short")), scripts={(STEMS, 0): row((1, 2, 3))}
    ),
    "clips-255: as many clips as there can be, the last with a segment more": lambda: lone(
        clips=(*(Clip(1, 1, f"{i}") for i in range(254)), Clip(2, 2, "last")), scripts={(STEMS, 0): row((1, 2, 3))}
    ),
    "clips-loops: two loops around a clip that is none: seams at the ends of binary32, and -0.0": lambda: two_clips(
        clips=(loop(CALM, 0.5, FLOAT_TINY, 0.0), Clip(2, 1, "once"), loop(STORM, FLOAT_MAX, 1.0, -0.0))
    ),
    "clip-named: a single clip with a name": lambda: two_clips(clips=(CALM,)),
    "clip-loop: a single clip with a name, a loop": lambda: two_clips(clips=(loop(STORM, 3.0, 2.0, 1.0),)),
    "clips-periodic: of three loops of one segment the first and the last are periodic": lambda: moving(
        FORK,
        30,
        heads=HEADS,
        clips=(
            periodic(CALM, 0.5, 0.25, 0.0),
            loop(Clip(3, 1, "jerks"), 0.5, 0.25, 0.0),
            periodic(Clip(1, 1, "one"), 0.0, 0.0, 0.0),
        ),
    ),
    "clip-unnamed: a single clip that CLIPS gives an empty name": lambda: two_clips(clips=(Clip(4, 2),)),
    "clip-unnamed-loop: a single loop with an empty name": lambda: two_clips(
        clips=(loop(Clip(4, 2), 0.25, 0.25, 0.0),)
    ),
    "clips-time: First and Step of each clip: the second begins before the first and overlaps it": lambda: two_clips(
        time=steady_times((10.0, 0.5), (-1.0, 0.25))
    ),
    "clips-time-rate: a rate of each clip, which all begin at 0": lambda: two_clips(time=whole_rates(24, 30)),
    "clips-time-uneven: times one by one, that descend and repeat from clip to clip": lambda: two_clips(
        time=uneven_time(0.0, 0.5, 2.0, -1.0, 0.5, 0.75, 2.0)
    ),
    "clips-time-of-one-frame: clips of one frame, all at the same time, one by one": lambda: replace(
        named("a", "b", "c"), time=uneven_time(1.5, 1.5, 1.5)
    ),
    "clips-time-vast: what a time is expected to be, from clips before, overflows to infinity": lambda: replace(
        named("a", "b", "c", "d"), time=uneven_time(LOWEST, HIGHEST, LOWEST, 0.0)
    ),
    "clips-time-step-vanishes: a Step that vanishes, in a clip of one frame": lambda: two_clips(
        clips=(CALM, Clip(1, 1, "still")), time=steady_times((0.0, 0.5), (1e30, 1.0)), scripts={}
    ),
    "clips-steps: segments with steps, rotations and bases of their own, of as many rows as each has frames": lambda: (
        moving(
            FORK,
            30,
            clips=(CALM, STORM),
            heads={
                (1, 0): stems_head(0.5, 2, 2, 3, basis_stream([[6400, -6400, 6400], [8192, 0, -8192], [64, 128, 192]])),
                (1, 1): stems_head(0.001, 0, 2, 2, basis_stream([[32, 64], [8192, -8192]])),
                (2, 2): stems_head(0.25, 1),
            },
        )
    ),
    "clips-corrections: corrections in the second clip alone": lambda: Plant(
        FORK, clips=(CALM, STORM), is_float64=True, scripts={(CORRECTIONS, 2, 2): 58}
    ),
    "clips-truncated: shortened: level 0 of 3, seams of all three": lambda: two_clips(
        clips=(CALM, loop(STORM, 3.0, 2.0, 1.0))
    ).upto(0),
    "clips-lossless: two loops whose last level is the source's own numbers: seams of four levels": lambda: (
        two_clips(clips=(loop(CALM, 3.0, 2.0, 1.0, 0.0), loop(STORM, 0.5, 0.25, 0.125, 0.0)))
        .with_header(level_count=4, full_level_count=4)
        .add(*(Entry(EXACT, b"", 3, s) for s in range(3)))
    ),
    "clips-names: names that differ in case, in accents, in their ends, by spaces alone": lambda: named(
        "wind",
        "Wind",
        "WIND",
        "win",
        "winds",
        " ",
        "  ",
        "B\u00f6e",
        "Bo\u0308e",
        "\u98ce",
        "\U0001f333",
        '"\\/',
        "a.b/c",
    ),
    "clips-names-ends: characters at the ends of the ranges of UTF-8": lambda: named(
        " ",
        "~",
        "\x80",
        "\x9f",
        "\u07ff",
        "\u0800",
        "\ud7ff",
        "\ue000",
        "\ufeff",
        "\ufffe",
        "\uffff",
        "\U00010000",
        "\U0010ffff",
    ),
    "clips-names-longest: names of 255 bytes": lambda: named("n" * 255, "n" * 254 + "m", "\u98ce" * 85),
}.items():
    valid(title, make)

invalid("clips-missing BAD_CHUNK_TABLE: two clips and no CLIPS", lambda: two_clips().without(CLIPS))
clips("empty: no bytes")
clips("cut-in-entry: ends inside the fields of the first clip", CALM_ENTRY[:9])
clips("cut-before-name: ends before the Name of the first clip", CALM_ENTRY[:10])
clips("cut-in-name: ends inside the Name of the second clip", CALM_ENTRY, STORM_ENTRY[:-1])
clips("less: one clip of two", CALM_ENTRY)
clips("less-than-count: two clips of three", CALM_ENTRY, STORM_ENTRY, count=3)
clips("more-than-count: a clip more than Clip_Count", CALM_ENTRY, STORM_ENTRY, clip_entry(1, 1, "more"))
clips("more-than-one: two clips where Clip_Count is 1", CALM_ENTRY, STORM_ENTRY, count=1)
clips("byte-behind: a byte behind the last clip", CALM_ENTRY, STORM_ENTRY, b"\0")
clips("frames-0: Clip_Frames and Clip_Segments are 0", clip_entry(0, 0, "calm"), clip_entry(7, 3, "storm"))
clips("segments-0: Clip_Segments 0", clip_entry(3, 0, "calm"), clip_entry(4, 3, "storm"))
clips("segments-more-than-frames: Clip_Segments above Clip_Frames", clip_entry(1, 2, "calm"), clip_entry(6, 1, "storm"))
invalid(
    "clips-frames-257: Clip_Frames 257 in one segment",
    lambda: lone_clips(513, 3, clip_entry(257, 1, "long"), clip_entry(256, 2, "short")),
)
clips("frames-do-not-add-up: Clip_Frames add up to less than Frame_Count", clip_entry(2, 1, "calm"), STORM_ENTRY)
clips("frames-add-up-to-more: Clip_Frames add up to more than Frame_Count", CALM_ENTRY, clip_entry(5, 2, "storm"))
clips("segments-do-not-add-up: Clip_Segments add up to less than Segment_Count", CALM_ENTRY, clip_entry(4, 1, "storm"))
clips("segments-add-up-to-more: Clip_Segments add up to more than Segment_Count", clip_entry(3, 2, "calm"), STORM_ENTRY)
clips(
    "sums-wrap: Clip_Frames and Clip_Segments add up to 2^32 more than they should",
    clip_entry(2**32 - 4, 2**32 - 4, "calm"),
    clip_entry(11, 7, "storm"),
)
clips("of-one-do-not-add-up: the only clip has less frames than the file", clip_entry(6, 3, "all"), count=1)
for bit in range(2, 8):
    clips(
        f"flags-{bit}: reserved bit {bit} of Clip_Flags is set", clip_entry(3, 1, "calm", flags=1 << bit), STORM_ENTRY
    )
clips("periodic-no-loop: Periodic of a clip that is no loop", clip_entry(3, 1, "calm", flags=2), STORM_ENTRY)
clips("periodic-segments: Periodic of two segments", CALM_ENTRY, clip_entry(4, 2, "storm", (0.0,) * 3, flags=3))
clips("name-none: Name_Length 0 in a file of two clips", CALM_ENTRY, clip_entry(4, 2))
clips("name-twice: two clips with the same Name", CALM_ENTRY, clip_entry(4, 2, "calm"))
clips(
    "name-twice-apart: the first and the third clip with the same Name",
    CALM_ENTRY,
    clip_entry(1, 1, "storm"),
    clip_entry(3, 1, "calm"),
    count=3,
)
clips("name-length-more: Name_Length is more than the chunk holds", CALM_ENTRY, clip_entry(4, 2, "storm", length=6))
clips("name-length-less: Name_Length is less: a byte remains", CALM_ENTRY, clip_entry(4, 2, "storm", length=4))
for name, why, text in (
    ("continuation", "a continuation byte alone", b"\x80"),
    ("latin-1", "Latin-1", b"B\xf6e"),
    ("overlong-2", "an overlong form of two bytes", b"\xc1\xbf"),
    ("overlong-nul", "U+0000 in two bytes", b"\xc0\x80"),
    ("overlong-3", "an overlong form of three bytes", b"\xe0\x9f\xbf"),
    ("overlong-4", "an overlong form of four bytes", b"\xf0\x8f\xbf\xbf"),
    ("surrogate-first", "the first surrogate", b"\xed\xa0\x80"),
    ("surrogate-last", "the last surrogate", b"\xed\xbf\xbf"),
    ("surrogates", "a surrogate pair", b"\xed\xa0\xbc\xed\xbc\xb3"),
    ("beyond", "U+110000", b"\xf4\x90\x80\x80"),
    ("far-beyond", "U+140000", b"\xf5\x80\x80\x80"),
    ("five-bytes", "a sequence of five bytes", b"\xf8\x88\x80\x80\x80"),
    ("fe", "the byte FE", b"a\xfe"),
    ("ff", "the byte FF", b"a\xff"),
    ("cut-2", "a sequence cut before its second byte", b"a\xc3"),
    ("cut-3", "a sequence cut before its third byte", b"a\xe9\xa3"),
    ("cut-4", "a sequence cut before its fourth byte", b"a\xf0\x9f\x8c"),
    ("broken", "a letter inside a sequence", b"\xe9\xa3a"),
    ("broken-4", "a letter behind a first byte", b"\xf0a\x8c\xb3"),
):
    clips(f"name-{name}: a Name that is not UTF-8: {why}", CALM_ENTRY, clip_entry(4, 2, text))
invalid(
    "clips-name-cut-before-continuation: a Name that ends inside a sequence, which the Clip_Frames behind it would "
    "complete",
    lambda: lone_clips(131, 2, clip_entry(3, 1, b"\xc3"), clip_entry(128, 1, "b")),
)
for code in (0x00, 0x01, 0x0A, 0x1F, 0x7F):
    clips(f"name-control-{code:02x}: U+{code:04X} in a Name", CALM_ENTRY, clip_entry(4, 2, f"st{chr(code)}rm"))
for word, value in (("nan", NAN), ("infinite", INFINITY), ("negative", -FLOAT_TINY)):
    clips(f"seam-{word}: the last of Seam_Errors is {value}", CALM_ENTRY, clip_entry(4, 2, "storm", (0.0, 0.0, value)))
clips("seams-missing: a Loop without Seam_Errors", CALM_ENTRY, clip_entry(4, 2, "storm", flags=1))
clips("seams-cut: ends inside Seam_Errors", CALM_ENTRY, clip_entry(4, 2, "storm", (1.0, 1.0, 1.0))[:-1])
clips("seams-less: Seam_Errors of two levels of three", CALM_ENTRY, clip_entry(4, 2, "storm", (1.0, 1.0)))
clips("seams-more: Seam_Errors of four levels of three", CALM_ENTRY, clip_entry(4, 2, "storm", (1.0,) * 4))
clips(
    "seams-of-none: Seam_Errors of a clip that is no loop", CALM_ENTRY, clip_entry(4, 2, "storm", (0.0,) * 3, flags=0)
)
invalid(
    "clips-seams-of-stored-levels: a shortened file with Seam_Errors of its level 0 alone",
    lambda: two_clips(clips=(CALM, loop(STORM, 1.0))).upto(0),
)
invalid(
    "clips-seam-not-stored-nan: a shortened file whose Seam_Errors of a level not stored is NaN",
    lambda: two_clips(clips=(CALM, loop(STORM, 1.0, 1.0, NAN))).upto(0),
)
table("twice-clips: CLIPS twice", lambda: two_clips().add(Entry(CLIPS, CALM_ENTRY)))
table(
    "order-clips: METADATA behind CLIPS", lambda: inserted(3, Entry(CLIPS, clip_entry(4, 2)), Entry(METADATA, b"\0{}"))
)
table("order-clips-motion: CLIPS behind the first motion chunk", lambda: inserted(4, Entry(CLIPS, clip_entry(4, 2))))
for title, make in {
    "clips-damaged BAD_CHECKSUM: a bit of CLIPS is flipped": lambda: flipped(
        two_clips().file(), end_of(two_clips(), CLIPS) - 1
    ),
    "clips-cut TRUNCATED: the file ends inside CLIPS": lambda: two_clips().file()[: end_of(two_clips(), CLIPS) - 1],
    "clips-cut-in-motion TRUNCATED 0: level 0 of the first clip alone has arrived": lambda: two_clips().file()[
        : end_of(two_clips(), AFFINES, 0, 0)
    ],
    "clips-before-hierarchy: CLIPS is not valid and HIERARCHY is damaged: CLIPS comes first": lambda: (
        two_clips().change(CLIPS, content=CALM_ENTRY).change(HIERARCHY, checksum=0)
    ),
    "clips-missing-before-hierarchy BAD_CHUNK_TABLE: CLIPS is missing and HIERARCHY is damaged: "
    "CLIPS comes first": lambda: two_clips().without(CLIPS).change(HIERARCHY, checksum=0),
    "clips-damaged-before-hierarchy BAD_CHECKSUM: CLIPS is damaged and HIERARCHY is missing: "
    "CLIPS comes first": lambda: two_clips().without(HIERARCHY).change(CLIPS, checksum=0),
    "clips-before-levels: Seam_Errors of the three levels of the hierarchy, while Full_Level_Count says 5: CLIPS "
    "comes first": lambda: two_clips(clips=(CALM, loop(STORM, 1.0, 1.0, 1.0))).with_header(full_level_count=5),
    "clips-levels BAD_HEADER: Full_Level_Count 5, and as many Seam_Errors; the hierarchy has 3": lambda: two_clips(
        clips=(CALM, loop(STORM, *[1.0] * 5))
    ).with_header(full_level_count=5),
    "clips-memory LIMIT_EXCEEDED: 2^18 vertices and a segment of 256 frames, though the mean is 86": lambda: lone_clips(
        258, 3, *UNEVEN, place_count=1 << 18
    ),
    "clips-before-memory BAD_CHECKSUM: CLIPS is damaged, and its longest segment takes too much memory": lambda: (
        lone_clips(258, 3, *UNEVEN, place_count=1 << 18).change(CLIPS, checksum=0)
    ),
    "clips-memory-of-mean LIMIT_EXCEEDED: 2^22 vertices are too many, before CLIPS is missed": lambda: lone(
        frames=2, segments=2
    ).with_header(place_count=1 << 22, clip_count=2),
}.items():
    invalid(title, make)

valid(
    "clips-long-segments: 512 frames in two segments, of which all but two are repeats",
    lambda: lone(clips=(Clip(512, 2, "long"),), repeats=(0, *(1,) * 255) * 2),
)
invalid(
    "clips-flags-5-of-loop: bit 2 of Clip_Flags is set, of a loop of one segment, as a periodic clip is",
    lambda: lone_clips(3, 1, clip_entry(3, 1, "loop", (0.0, 0.0), flags=5)),
)
