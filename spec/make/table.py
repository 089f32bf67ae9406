"""The chunk table and chunks that are skipped, missing or damaged."""

from spec.make.base import *
from spec.make.static import attributes, element, metadata, numbers


def swapped(i: int, j: int) -> Draft:
    draft = fork()
    entries = list(draft.entries)
    entries[i], entries[j] = entries[j], entries[i]
    return replace(draft, entries=tuple(entries))


def moved(kind: int, **place: int) -> Draft:
    """Return the last chunk of a kind, with another level or segment in the table."""
    draft = fork()
    i = max(i for i, entry in enumerate(draft.entries) if entry.kind == kind)
    return replace(draft, entries=(*draft.entries[:i], replace(draft.entries[i], **place), *draft.entries[i + 1 :]))


RADIUS = numbers(np.arange(5.0), name="radius")


def segments_of_tables() -> Draft:
    draft = lone().upto(0)
    first, second, *others = draft.entries
    count = (1 << 20) - len(draft.entries)
    return replace(draft, entries=(second, first, *others)).with_header(frame_count=count, segment_count=count)


valid(
    "kind-spelt: known Kinds by all their bits",
    lambda: fork().change(STEMS, 1, 1, spelt=True).change(AFFINES, 0, 0, spelt=True),
)
valid(
    "unknown-optional: optional kinds that are not known, in every place where they may stand, some twice",
    lambda: fork().add(
        Entry(0x8000, FUTURE),
        Entry(0x8009, FUTURE),
        Entry(0x800F, b""),
        Entry(0x8018, FUTURE, 0, 1),
        Entry(0x8018, FUTURE, 1, 1),
        Entry(0x801F, FUTURE, 1, 1),
        Entry(0x801F, b"", 2, 0),
        Entry(0x8022, FUTURE),
        Entry(0x8022, FUTURE),
        Entry(0xFFFF, FUTURE),
        Entry(0xFFFF, b""),
    ),
)
valid(
    "private-kinds: private kinds that METADATA names, one of them twice, and one that it does not name",
    lambda: fork().add(
        Entry(METADATA, b'\0{"private_kinds":{"C000":"org.example.leaf_age","E0A1":"org.example.licence"}}'),
        Entry(0xC000, FUTURE),
        Entry(0xC000, b""),
        Entry(0xC001, FUTURE),
        Entry(0xE0A1, FUTURE),
    ),
)
table("private-required UNKNOWN_CHUNK: a private kind without Is_Optional", lambda: fork().add(Entry(0x4000, FUTURE)))
valid(
    "unknown-optional-damaged: what is skipped is not read: its Checksum does not fit",
    lambda: fork().add(Entry(0x8009, FUTURE, checksum=0), Entry(0x8064, FUTURE, checksum=0)),
)
table("damaged BAD_CHECKSUM: a bit of the front stream is flipped", lambda: flipped(lone().file(), 30))
for kind, level, why in (
    (0x0000, 255, "kind 0"),
    (0x0009, 255, "in the prelude"),
    (0x0018, 0, "of motion"),
    (0x0022, 255, "behind the motion"),
    (0x7FFF, 255, "the last one"),
):
    table(
        f"unknown-{kind:04x} UNKNOWN_CHUNK: a required kind that is not known, {why}",
        lambda kind=kind, level=level: fork().add(Entry(kind, b"", level)),
    )
for kind, level, name in (
    (0x8001, 255, "HIERARCHY"),
    (0x0004, 255, "METADATA"),
    (0x8010, 1, "STEMS"),
    (0x8013, 1, "SHAPES"),
    (0x8015, 1, "REFINED_REST"),
    (0x8007, 255, "CLIPS"),
    (0x8021, 255, "SOURCE_REST"),
    (0x0020, 255, "ATTRIBUTE"),
):
    table(
        f"twin-{kind:04x} UNKNOWN_CHUNK: {name} with the wrong bit 15",
        lambda kind=kind, level=level: fork().add(Entry(kind, b"", level)),
    )
for title, make in {
    "no-level: the last CORRECTIONS with Level 255": lambda: moved(CORRECTIONS, level=255),
    "level-beyond: a motion chunk of a level that is not stored": lambda: moved(CORRECTIONS, level=3),
    "segment-beyond: a motion chunk of a segment that is not there": lambda: moved(CORRECTIONS, segment=2),
    "unknown-without-level: an unknown optional motion kind with Level 255": lambda: fork().add(Entry(0x8018, b"")),
    "order-prelude: REST before HIERARCHY": lambda: swapped(0, 1),
    "order-motion-first: a motion chunk before TIME": lambda: swapped(2, 3),
    "order-kinds: SHAPES before STEMS": lambda: swapped(5, 6),
    "order-optional: an unknown optional motion kind before the known ones of its level: bit 15 counts": lambda: (
        inserted(3, Entry(0x8018, b"", 0, 0))
    ),
    "order-attributes: ATTRIBUTE before the motion": lambda: inserted(3, Entry(ATTRIBUTE, element("|u1", b"a"))),
    "order-behind: METADATA behind the motion": lambda: inserted(len(fork().entries), Entry(METADATA, b"\0{}")),
    "twice-time: TIME twice": lambda: fork().add(Entry(TIME, steady_time())),
    "twice-metadata: METADATA twice: only kinds from 32 on may repeat": lambda: fork().add(
        Entry(METADATA, b"\0{}"), Entry(METADATA, b"\0{}")
    ),
    "twice-stems: STEMS of a level and segment twice": lambda: fork().add(
        Entry(STEMS, fork().content(STEMS, 1, 0), 1, 0)
    ),
    "twice-unknown: an unknown optional kind of the prelude twice": lambda: fork().add(
        Entry(0x8009, b""), Entry(0x8009, b"")
    ),
    "twice-unknown-motion: an unknown optional motion kind twice": lambda: fork().add(
        Entry(0x8018, b"", 0, 0), Entry(0x8018, b"", 0, 0)
    ),
    "length-limit LIMIT_EXCEEDED: a chunk of 2^28 + 1 bytes": lambda: fork().add(
        Entry(0x8009, b"", length=(1 << 28) + 1)
    ),
    "length-limit-of-unknown UNKNOWN_CHUNK: the Kind is checked before the Length": lambda: fork().add(
        Entry(9, b"", length=2**30 - 1)
    ),
    "length-limit-before-place LIMIT_EXCEEDED: the Length is checked before the Level": lambda: fork().add(
        Entry(0x8018, b"", length=2**30 - 1)
    ),
}.items():
    table(title, make)

for kind in (HIERARCHY, REST, TIME):
    table(f"no-{KIND_NAMES[kind].lower()}: {KIND_NAMES[kind]} is missing", lambda kind=kind: fork().without(kind))
table("no-chunk-of-motion: a file without motion", lambda: replace(fork(), entries=fork().entries[:3]))
table("no-stems: STEMS of a segment is missing", lambda: fork().without(STEMS, 2, 1))
table("no-affines: AFFINES of level 0 is missing in one segment", lambda: fork().without(AFFINES, 0, 1))
table("more-stems: STEMS of a level that has no pieces", lambda: fork().add(Entry(STEMS, stems_head(), 0, 0)))
table("more-affines: AFFINES of a level without coded nodes", lambda: fork().add(Entry(AFFINES, b"", 1, 0)))
table(
    "more-corrections: CORRECTIONS of a level that is not the last",
    lambda: fork().add(Entry(CORRECTIONS, struct.pack("<f", 1.0), 1, 0)),
)
table(
    "corrections-of-short-file: CORRECTIONS on the last level of a shortened file",
    lambda: fork().upto(1).add(Entry(CORRECTIONS, struct.pack("<f", 1.0), 1, 0)),
)
table("more-shapes: SHAPES of a level without STEMS", lambda: fork().add(Entry(SHAPES, b"", 0, 0)))
table("shapes-of-segment-1: SHAPES stands with segment 0", lambda: fork().add(Entry(SHAPES, b"", 1, 1)))
for kind, item in ((HIERARCHY, "open"), (REST, "open"), (TIME, "open")):
    invalid(
        f"damaged-{KIND_NAMES[kind].lower()}: a bit of {KIND_NAMES[kind]} is flipped",
        lambda kind=kind: flipped(fork().file(), end_of(fork(), kind) - 1),
        "BAD_CHECKSUM",
        item,
    )
for kind, level in ((AFFINES, 0), (STEMS, 1), (SHAPES, 1), (CORRECTIONS, 2)):
    invalid(
        f"damaged-{KIND_NAMES[kind].lower()}: a bit of {KIND_NAMES[kind]} is flipped",
        lambda kind=kind, level=level: flipped(fork().file(), end_of(fork(), kind, level) - 1),
        "BAD_CHECKSUM",
        level,
    )
invalid(
    "damaged-metadata BAD_CHECKSUM static: a bit of METADATA is flipped; the motion plays",
    lambda: metadata("{}").change(METADATA, checksum=0),
)
invalid(
    "damaged-attribute BAD_CHECKSUM static: a bit of an attribute is flipped; the motion plays",
    lambda: attributes(element("|u1", b"1")).change(ATTRIBUTE, checksum=0),
)
invalid(
    "damaged-before-table BAD_CHECKSUM: HIERARCHY is damaged and STEMS is missing: HIERARCHY comes first",
    lambda: fork().without(STEMS, 2, 1).change(HIERARCHY, checksum=0),
)
invalid(
    "table-before-rest BAD_CHUNK_TABLE: STEMS is missing and REST is damaged: the table comes first",
    lambda: fork().without(STEMS, 2, 1).change(REST, checksum=0),
)
table(
    "one-chunk: Chunk_Count 1 is allowed, but chunks are missing",
    lambda: replace(lone().draft(), entries=lone().draft().entries[:1]),
)
table(
    "longest-and-order: as many segments and chunks as Max_Table_Bytes allows, of which the first two are the wrong "
    "way round",
    segments_of_tables,
)
table(
    "repeatable-order: an attribute behind a chunk whose number is larger",
    lambda: not_refused(lambda: fork().add(Entry(0x8040, FUTURE), Entry(ATTRIBUTE, RADIUS), sort=False)),
)
invalid(
    "table-longest-chunk TRUNCATED strict: a last chunk of 2^28 bytes is allowed, but has not arrived",
    lambda: fork().add(Entry(0x8040, FUTURE, length=1 << 28)),
)
valid(
    "unknown-optional-numbers: chunks whose Kind is written out behind the numbers 17 to 31, which all say that it is",
    lambda: fork().add(
        Entry(METADATA, b"\0{}", number=31),
        Entry(0x8009, FUTURE, number=17),
        Entry(0x800F, b"", number=30),
        Entry(0x8018, FUTURE, 0, 1, number=24),
        Entry(0x801F, FUTURE, 1, 1, number=18),
        Entry(0x8022, FUTURE, number=31),
        Entry(0x8022, FUTURE, number=20),
    ),
)
