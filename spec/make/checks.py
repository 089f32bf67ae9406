"""Files that one check alone refuses, and valid ones at its edge: who leaves it out reads on to the end."""

import struct

from spec.make.base import *
from spec.make.host import hosted
from spec.make.joins import joined
from spec.make.polygons import mixed_polygons
from spec.make.source_rest import bent
from spec.make.static import attribute, frame, metadata, plain, static, with_static

ONE, TWO_ROOTS = [Stem(-1, 1)], [Stem(-1, 2), Stem(-1, 2)]


def whole(title: str, make: Callable[[], Draft | Plant]) -> None:
    """Declare an invalid vector with streams that go on behind what is refused."""
    invalid(title, lambda: not_refused(make))


def above_root() -> Draft:
    script = hierarchy_script(TWO_ROOTS)
    script[6] = 2  # how far up the parent of the second branch is: one more than there are branches
    return still(TWO_ROOTS).draft().change(HIERARCHY, content=write(rules.decode_hierarchy, script, 2, 4))


for name_, reason_, stems_ in (
    ("lag-negative", "Lag -1", "-1 3, 0 2 1 lag=-1"),
    ("attach-beyond", "a branch hangs on the first vertex behind its parent", "-1 2, 0 2 0, 0 2 2"),
):
    whole(
        f"hierarchy-{name_}-in-whole-stream: {reason_}, in a stream that is whole",
        lambda stems_=stems_: still(stems_of(stems_)),
    )
whole("hierarchy-parent-above-root: a parent above a root, in a stream that is whole", above_root)
valid("rest-exact-no-bytes: an exact rest pose of no bytes", lambda: lone(rest=rest_chunk(b"", exact=1)))
invalid(
    "host-mesh-and-source-rest: SOURCE_REST beside the host's mesh",
    lambda: hosted().add(Entry(SOURCE_REST, source_rest_chunk(b""))),
)
whole(
    "table-source-rest-twice BAD_CHUNK_TABLE: two chunks SOURCE_REST",
    lambda: still(FORK, source_rest=bent(FORK, [])).add(Entry(SOURCE_REST, bent(FORK, []))),
)
invalid(
    "source-rest-method-2-in-whole-stream BAD_CHUNK rest: Method is 2, and the stream is whole",
    lambda: still(FORK, source_rest=b"\2" + bent(FORK, [])[1:]),
)
for kind_, place_, level_, segment_ in (("stage", "the last stage", 3, 0), ("segment", "the last segment", 2, 2)):
    whole(
        f"table-unknown-motion-{kind_}-beyond BAD_CHUNK_TABLE: an unknown chunk of motion behind {place_}",
        lambda level_=level_, segment_=segment_: fork().add(Entry(0x8018, FUTURE, level_, segment_)),
    )
whole(
    "clips-frames-beyond: a segment of 257 frames, in a file that has fewer for each segment",
    lambda: lone(clips=(Clip(257, 1, "long"), Clip(3, 2, "short"))),
)
motion(STEMS, 1, "head-of-5-bytes: five bytes", lambda: fork().content(STEMS, 1)[:5])
whole(
    "basis-of-waves BAD_CHUNK 1: Basis_Stage names a stage that has no learned basis",
    lambda: Plant(SHORT, 2, heads={0: stems_head(0.25), 1: stems_head(0.25, 0, 2, 2, b"", base=0)}),
)
whole(
    "shapes-beyond-modes BAD_CHUNK 0: four shapes of one mode",
    lambda: Plant(ONE, scripts={(SHAPES, 0, 0): [4, *row((1, 0, 0)) * 4]}),
)
whole(
    "refined-shapes-beyond-modes BAD_CHUNK 2: four shapes of one mode in a refinement",
    lambda: Plant(ONE, layers=2, scripts={(SHAPES, 2, 0): [4, *refined_row((1, 0, 0)) * 4]}),
)
whole(
    "refined-shapes-shift-16-in-whole-stream BAD_CHUNK 2: Shift is 16, and the stream is whole",
    lambda: Plant(ONE, layers=2, shift=16, scripts={(SHAPES, 0, 0): [1, *row((1, 0, 0))], (SHAPES, 2, 0): [1, 0]}),
)
whole(
    "joins-width-128 BAD_CHUNK_TABLE: a join over 128 frames of 130",
    lambda: joined([Stem(-1, 2)], 108, 0, 128, 0, 0, frames=260, segments=2),
)
valid("joins-after-two-frames: behind a segment of two frames", lambda: joined(FORK, 111, *(0, 1.5) * 3, frames=5))
invalid(
    "cut-in-metadata TRUNCATED: the file ends within METADATA",
    lambda: cut(lambda draft: end_of(draft, METADATA) - 1, metadata("{}")),
)
static("metadata-method-2-in-whole-stream: Method is 2 before a frame", lambda: metadata(plain(b"{}"), 2))
static(
    "metadata-zstd-large-and-damaged LIMIT_EXCEEDED: a frame that states more than there may be, and does not decode",
    lambda: metadata(frame(b"{}", stated=LONGEST_TEXT + 1, checksum=None), 1),
)
attribute(
    "name-beyond-of-none: a name that goes on behind the chunk, of an array without elements",
    struct.pack("<BBHII", 1, 1, 5, 1, 0) + b"age",
)
for name_, reason_, fields_ in (  # A count at its limit is refused for what is wrong behind it.
    (
        "vertices-2-26",
        "2^26 vertices are allowed, but not two branches of one place",
        {"vertex_count": 1 << 26, "branch_count": 2},
    ),
    ("branches-2-20", "2^20 branches are allowed, but not of one place", {"branch_count": 1 << 20}),
    ("frames-2-20", "2^20 frames are allowed, but not in one segment", {"frame_count": 1 << 20}),
    ("segments-2-20", "2^20 segments are allowed, but not of one frame", {"segment_count": 1 << 20}),
    (
        "full-levels-33-of-many-segments",
        "Full_Level_Count 33, and tables above Max_Table_Bytes",
        {"full_level_count": 33, "level_count": 33, "frame_count": 1 << 16, "segment_count": 1 << 16},
    ),
):
    header(f"{name_}: {reason_}", **fields_)
static(
    "faces-128-corners-of-int8: a face of more corners than the type of their numbers holds",
    lambda: not_refused(
        lambda: with_static((FACES, mixed_polygons([[k % 5 for k in range(128)]], types=("<u4", "|i1"))))
    ),
)
