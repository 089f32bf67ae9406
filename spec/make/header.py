"""Header, counts, error table, and files that end early."""

from spec.document import rules
from spec.make.base import *
from spec.make.corrections import corrected_lone
from spec.make.predicted import SINGLE, predicted
from spec.make.source_rest import bent
from spec.make.static import attributes, element


def traced() -> Plant:
    """Return the plant of the file that FORMAT.md traces in "A file in bytes" and "A level traced"."""
    stem = [Stem(-1, 3)]
    return Plant(
        stem,
        frames=4,
        rest=exact_rest(stem, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0], False),
        time=whole_rates(25),
        scripts={(STEMS, 0): Script(*row(), *row((3, 0, 0), (-1, 0, 0)))},
        default_head=stems_head(0.25),
    )


def first_bytes(count: int, change: bytes = b"") -> bytes:
    data = lone().file()[:count]
    return data[: len(data) - len(change)] + change


def error_table(*values: int) -> Draft:
    return replace(lone().draft(), errors=values)


def front_stream(change: Callable[[bytes], bytes]) -> Draft:
    return replace(fork(), stream=change)


def cut_static() -> bytes:
    return attributes(element("|u1", b"1", "a"), element("|u1", b"2", "b")).file()[:-1]


def front_alone(draft: Draft) -> bytes:
    data = draft.file()
    return data[: rules.u32(data, 16)]


def errors_by_chance(count: int) -> tuple[int, ...]:
    """Return large and small steps up and down, to both ends of the range."""
    random, last, errors = np.random.default_rng(411), [4000] * 3, []
    for _ in range(count):
        step = random.choice([1, 3, 30, 400, 5000], 3) * random.integers(-2, 3, 3)
        last = np.clip(np.array(last) + step, 0, rules.SHORT_FLOATS - 1).tolist()
        errors += last
    return tuple(errors)


def of_memory(vertices: int) -> Draft:
    """Return a draft of 128 frames, whose first fault behind the front is a checksum."""
    return lone().with_header(place_count=vertices, frame_count=128).change(HIERARCHY, checksum=0)


def of_range(max_error: int) -> Draft:
    """Return a draft whose counts have a product of 2^38 + 56, just above a decoder's limit of 38 bits. A decoder that
    accepts it goes on to a wrong checksum, so the error tells which rule it applied. `max_error` has the bits of the
    error bound.
    """
    clips = [clip_entry(25, 17, "0"), *(clip_entry(1, 1, str(i)) for i in range(1, 25))]
    return (
        lone()
        .add(Entry(CLIPS, b"".join(clips), checksum=0))
        .with_header(
            place_count=13,
            branch_count=2,
            frame_count=49,
            segment_count=41,
            full_level_count=22,
            level_count=2,
            clip_count=25,
            layer_count=4,
            max_error=rules.from_bits(max_error, 64),
        )
    )


def later_minor() -> Draft:
    """Return a draft as a later minor version might write it: with unknown members of the metadata and chunks of
    unknown kinds.
    """
    return fork().add(
        Entry(METADATA, b'\0{"unit":"m","new":[1,{}]}'),
        Entry(0x800A, FUTURE),
        Entry(0x8019, FUTURE, 1, 0),
        Entry(0x8025, FUTURE),
        Entry(0xA025, FUTURE),
    )


def shown(*levels: int) -> Draft:
    """Return the fork, of which these levels are shown."""
    draft = fork().with_header(stages=levels, level_count=len(levels), full_level_count=len(levels))
    for segment in range(2 if 0 not in levels else 0):
        draft = draft.without(AFFINES, 0, segment)
    return draft


valid("traced: a stem of three vertices that bends, whose bytes and numbers FORMAT.md has", traced)
valid("uneven-segments: 7 frames in 3 segments, of 2, 2 and 3", moving, FORK, 25, frames=7, segments=3, heads=HEADS)
valid("segment-per-frame: as many segments as frames", lambda: moving(FORK, 26, frames=3, segments=3, heads=HEADS))
valid("level-0-alone: shortened: level 0 of 3", lambda: fork().upto(0))
valid("level-1-of-3: shortened: without the last level and its corrections", lambda: fork().upto(1))
valid(
    "errors-announced: an error table with the largest and the smallest numbers; those of the deepest level are "
    "above Max_Error 0",
    lambda: replace(lone().with_header(max_error=0.0), errors=(8159, 0, 4000, 0, 1, 8159)),
)
valid(
    "max-error-largest: the largest Max_Error, and errors of segments up and down",
    lambda: replace(fork().with_header(max_error=HIGHEST), errors=tuple(range(8000, 8018))),
)
valid("level-0-not-shown: level 0 is not shown and has no maps", lambda: shown(1, 2))
valid("level-1-not-shown: levels 0 and 2 are shown", lambda: shown(0, 2))
valid("last-alone-shown: only the last level is shown", lambda: shown(2))
invalid(
    "affines-not-shown BAD_CHUNK_TABLE: maps of a level that is not shown",
    lambda: shown(1, 2).add(*fork().entries[4:5]),
)
invalid(
    "last-not-shown BAD_HEADER: the last level is not shown",
    lambda: fork().upto(1).with_header(stages=(0, 1), full_level_count=2),
)
invalid("level-32-shown BAD_HEADER: level 32 is shown", lambda: shown(0, 1, 32))
invalid("empty NOT_AN_ATH_FILE: a file of no bytes", b"")
invalid(
    "magic-other NOT_AN_ATH_FILE: something else", b"PK\x03\x04 something else entirely, longer than a header would be"
)
invalid("magic-first-byte NOT_AN_ATH_FILE: one byte, not that of Magic", b"P")
header("magic-newline NOT_AN_ATH_FILE: CR LF of Magic became LF on the way", magic=b"\x89ATH\n\x1a\n\x00")
header("magic-last-byte NOT_AN_ATH_FILE: the last byte of Magic is another", magic=b"\x89ATH\r\n\x1a\r")
invalid("cut-in-magic TRUNCATED: three bytes, those of Magic", lambda: first_bytes(3))
invalid(
    "cut-before-version TRUNCATED: 11 bytes: the versions are not all there, and not looked at",
    lambda: first_bytes(11, b"\xff\xff\xff"),
)
invalid(
    "cut-behind-version UNSUPPORTED_VERSION: 12 bytes are enough to refuse a version",
    lambda: first_bytes(12, b"\xff\xff\xff\xff"),
)
invalid("cut-in-header TRUNCATED: 23 bytes", lambda: first_bytes(23))
invalid("cut-in-front-stream TRUNCATED: ends inside the front stream", lambda: first_bytes(40))
invalid("cut-in-checksums TRUNCATED: ends inside the checksums", lambda: first_bytes(rules.u32(lone().file(), 16) - 1))
header("major-next UNSUPPORTED_VERSION: the next Major_Version", major=rules.VERSION[0] + 1, minor=0)
header("major-last UNSUPPORTED_VERSION: the last Major_Version", major=255)
valid("minor-7: Minor_Version 7, an earlier or a later one", lambda: lone().with_header(minor=7))
valid("minor-last: Minor_Version 255", lambda: lone().with_header(minor=255))
valid(
    "minor-7-with-what-is-new: Minor_Version 7, with optional kinds and members that are new",
    lambda: later_minor().with_header(minor=7),
)
invalid(
    "minor-7-feature UNSUPPORTED_FEATURE: Minor_Version 7, with a feature that is new",
    lambda: lone().with_header(minor=7, features=1 << 6),
)
header("feature-first UNSUPPORTED_FEATURE: the lowest bit of Features is set", features=1)
header("feature-last UNSUPPORTED_FEATURE: the highest bit of Features is set", features=1 << 15)
header("feature-and-version UNSUPPORTED_VERSION: what Features means is for the version to say", major=254, features=1)
invalid(
    "cut-behind-features UNSUPPORTED_FEATURE: 12 bytes are enough to refuse a feature", lambda: first_bytes(12, b"\0\1")
)
header("vertices-limit LIMIT_EXCEEDED: Vertex_Count 2^26 + 1", place_count=(1 << 26) + 1)
header("branches-limit LIMIT_EXCEEDED: Branch_Count 2^20 + 1, more than vertices as well", branch_count=(1 << 20) + 1)
header("branches-more-than-vertices: two branches, one vertex", branch_count=2)
header("frames-limit LIMIT_EXCEEDED: Frame_Count 2^20 + 1", frame_count=(1 << 20) + 1)
header("frames-257: 257 frames in one segment", frame_count=257)
header("segments-limit LIMIT_EXCEEDED: Segment_Count 2^20 + 1, more than frames as well", segment_count=(1 << 20) + 1)
header("segments-more-than-frames: two segments, one frame", segment_count=2)
header("chunks-0: Chunk_Count 0", chunk_count=0)
header(
    "chunks-before-front-length LIMIT_EXCEEDED: a Chunk_Count beyond its limit comes before a Front_Length that "
    "is too small",
    chunk_count=2**32 - 1,
    front_length=0,
)
header("front-length-less: Front_Length has no room for the checksums", front_length=24 + 5 * 4 - 1)
header("front-length-0: Front_Length 0", front_length=0)
header("front-length-limit LIMIT_EXCEEDED: Front_Length above Max_Table_Bytes", front_length=(1 << 24) + 1)
header("front-length-more TRUNCATED: Front_Length is behind the end of the file", front_length=1 << 20)
header("chunks-more: more chunks announced than the front has room for", chunk_count=1000)
header("chunks-less BAD_CHUNK_TABLE: two chunks less than there are: the front stream is longer", chunk_count=3)
header(
    "tables-limit LIMIT_EXCEEDED: 2^20 segments at two levels: more than Max_Table_Bytes, and not there",
    frame_count=1 << 20,
    segment_count=1 << 20,
)
header(
    "limit-before-rules LIMIT_EXCEEDED: a count beyond its limit comes before others that are out of range",
    segment_count=1 << 29,
    clip_count=256,
)
header("clips-256: Clip_Count 256", clip_count=256)
header("levels-negative: Level_Count is below 0", level_count=-7)
header("counts-largest LIMIT_EXCEEDED: Vertex_Count 2^30", place_count=1 << 30)
header("chunks-limit LIMIT_EXCEEDED: Chunk_Count 2^20 + 1", chunk_count=(1 << 20) + 1)
header("levels-0: Level_Count 0", level_count=0)
header("full-levels-33: Full_Level_Count 33", full_level_count=33)
header("full-levels-not-those: Full_Level_Count 4, the hierarchy has 2, or 3 with EXACT", full_level_count=4)
invalid(
    "header-full-levels-less BAD_HEADER: Full_Level_Count 2, the hierarchy has 3",
    lambda: fork().upto(1).with_header(full_level_count=2),
)
header("max-error-nan: Max_Error is NaN", max_error=NAN)
header("max-error-infinite: Max_Error is infinite", max_error=INFINITY)
header("checksum BAD_CHECKSUM: Front_Checksum is another", checksum=0)
header("memory-limit LIMIT_EXCEEDED: 2^22 vertices take more than Max_Memory_Bytes", place_count=1 << 22)
for title, make in {
    "checksums-damaged BAD_CHECKSUM: a bit of a checksum is flipped": lambda: flipped(
        lone().file(), rules.u32(lone().file(), 16) - 2
    ),
    "errors-infinite BAD_CHUNK_TABLE: Level_Max_Error is 8160": lambda: error_table(8160, 0, 0, 0, 0, 0),
    "errors-negative BAD_CHUNK_TABLE: Level_P99_Error is -1": lambda: error_table(0, -1, 0, 0, 0, 0),
    "errors-largest BAD_CHUNK_TABLE: the last error is 2^29": lambda: error_table(0, 0, 0, 0, 0, 1 << 29),
    "front-zero-behind BAD_CHUNK_TABLE: a zero byte behind the front stream": lambda: front_stream(
        lambda stream: stream + b"\0"
    ),
    "front-bytes-behind BAD_CHUNK_TABLE: bytes behind the front stream": lambda: front_stream(
        lambda stream: stream + b"\1" * 12
    ),
    "front-nothing LIMIT_EXCEEDED: a front stream of no bytes, whose decisions are all 1: 2^30 vertices": lambda: (
        front_stream(lambda stream: b"")
    ),
    "trailing-byte TRAILING_BYTES strict: a byte behind the end": lambda: fork().file() + b"\0",
    "trailing-file TRAILING_BYTES strict: the file twice": lambda: fork().file() * 2,
    "cut-in-prelude TRUNCATED: the last byte of TIME is missing": lambda: cut(lambda d: end_of(d, TIME) - 1),
    "cut-behind-prelude TRUNCATED 0: no motion has arrived": lambda: cut(lambda d: end_of(d, TIME)),
    "cut-in-level-0 TRUNCATED 0: one segment of level 0 has arrived": lambda: cut(
        lambda d: end_of(d, AFFINES, 0, 1) - 1
    ),
    "cut-behind-level-0 TRUNCATED 1: level 0 has arrived and plays": lambda: cut(lambda d: end_of(d, AFFINES, 0, 1)),
    "cut-in-last-level TRUNCATED 2: the last byte is missing": lambda: cut(lambda d: len(d.file()) - 1),
    "cut-behind-damage TRUNCATED 1: STEMS of level 1 is damaged and SHAPES is missing: what is "
    "missing comes first": lambda: flipped(cut(lambda d: end_of(d, SHAPES, 1) - 1), end_of(fork(), STEMS, 1) - 1),
    "cut-in-source-rest TRUNCATED rest: all motion has arrived and plays, the rest pose of the "
    "source has not": lambda: forked(source_rest=bent(FORK, Chance(206))).file()[:-1],
    "cut-in-attributes TRUNCATED strict: all motion has arrived and plays, one of two attributes has": cut_static,
    "cut-behind-first-byte TRUNCATED: one byte, that of Magic": lambda: first_bytes(1),
    "header-alone BAD_HEADER: 24 bytes are a header: its Chunk_Count is 0": lambda: (
        lone().with_header(chunk_count=0).file()[:24]
    ),
}.items():
    invalid(title, make)


header("chunks-2-20: Chunk_Count 2^20 is allowed, but Front_Length is too small", chunk_count=1 << 20)
header("front-length-2-24 TRUNCATED: Front_Length 2^24 is allowed, but not there", front_length=1 << 24)
invalid(
    "front-alone-damaged BAD_CHECKSUM: a file that ends with its front, which is damaged",
    lambda: flipped(front_alone(lone().draft()), 30),
)
valid(
    "errors-by-chance: errors of thirty segments by chance, which are announced about those of the one before and "
    "of the level before",
    lambda: replace(predicted(SINGLE, [[1, 1]], 30).draft(), errors=errors_by_chance(60)),
)
valid(
    "stream-to-its-end: a stream of all the bytes that are read, the last ones of which say nothing",
    lambda: corrected_lone(lambda stream: stream.ljust(7, b"\0") + b"\1"),
)
invalid(
    "stream-behind-its-end BAD_CHUNK 1: a stream of one byte more than is read",
    lambda: corrected_lone(lambda stream: stream.ljust(8, b"\0") + b"\1"),
)
invalid(
    "memory-exactly BAD_CHECKSUM: 2^18 vertices of 128 frames take Max_Memory_Bytes: what is wrong is HIERARCHY",
    lambda: of_memory(1 << 18),
)
invalid(
    "memory-of-one-more LIMIT_EXCEEDED: 2^18 + 1 vertices of 128 frames take more than Max_Memory_Bytes",
    lambda: of_memory((1 << 18) + 1),
)
invalid(
    "front-range BAD_CHECKSUM: amid Max_Error the range is just 2^32, twice, which is not less: what is wrong is CLIPS",
    lambda: of_range(7 << 57),
)


def damaged_before_cut() -> bytes:
    """Return a file whose STEMS of level 1 is damaged, and whose AFFINES behind it is missing."""
    draft = moving([Stem(-1, 3), Stem(0, 3, 2), Stem(1, 2, 1)], 302).draft()
    return cut(lambda d: end_of(d, AFFINES, 1) - 1, draft.change(STEMS, 1, checksum=0))


def stages_without_end() -> bytes:
    """Return a front stream that ends where stages are left out: all decisions behind it are 1."""

    def stages(data: bytes) -> None:
        coder = rules.RangeDecoder(data)
        rules.decode_stages(coder, rules.decode_counts(coder).full_level_count)

    max_error = map(int, f"{rules.to_bits(1.0, 64):063b}")
    return write(stages, [0, 0, 0, 0, 1, *[0] * 6, *max_error, *[1] * 32], lowest=True)


invalid(
    "cut-behind-damaged-stems TRUNCATED 1: STEMS of level 1 is damaged and AFFINES, which is decoded later, is "
    "missing: what is missing comes first",
    damaged_before_cut,
)
invalid(
    "header-stages-without-end BAD_HEADER: stages are left out up to the end of the front stream and beyond",
    lambda: front_stream(lambda _: stages_without_end()),
)
