"""CORRECTIONS."""

from spec.make.base import *


def corrections(step: float) -> Callable[[], bytes]:
    return lambda: struct.pack("<f", step) + fork().content(CORRECTIONS, 2, 0)[4:]


def corrected_lone(stream: Callable[[bytes], bytes], **fields) -> Draft:
    """Return a vertex with other bytes in place of a stream of CORRECTIONS that corrects nothing."""
    draft = lone(scripts={(CORRECTIONS, 1): [0]}, **fields).draft()
    content = draft.content(CORRECTIONS, 1, 0)
    return draft.change(CORRECTIONS, 1, 0, content=content[:4] + stream(content[4:]))


valid(
    "corrections: corrections on the last level: blocks of 8 frames, the last of 2, and vertices that have none",
    lambda: Plant([Stem(-1, 6)], 18, scripts={(CORRECTIONS, 1): 54}),
)
valid(
    "corrections-footprints: corrections of all widths that overlap, are cut off at both ends of a segment, and sum "
    "up to 0 in a frame",
    lambda: Plant(
        [Stem(-1, 2)],
        5,
        scripts={
            (CORRECTIONS, 1): [
                *(1, 1, *(1, 1), *(1, 0, 3), 0, 0, 0, 0, 0, 1, *(1, 1), *(1, 1, 3), 0, 0),  # 4 and -4 along x
                *(1, 0, 1, *(1, 0), 0, *(1, 0, 0), 0, 1, 0, 0, 0, *(1, 1), 0, 0),  # 1 along y, -2 along z
            ]
        },
    ),
)
valid(
    "corrections-wide: corrections of binary64 positions",
    lambda: Plant(FORK, 3, is_float64=True, origin=(0.1, 0.2, 0.3), scripts={(CORRECTIONS, 2): 55}),
)
valid(
    "corrections-none: a CORRECTIONS chunk that corrects nothing, in one of two segments",
    lambda: Plant(FORK, 3, 2, scripts={(CORRECTIONS, 2, 1): []}),
)
valid(
    "corrections-to-infinity: a Correction_Step at the end of binary32",
    lambda: Plant(FORK, 2, scripts={(CORRECTIONS, 2): 56}).change(
        CORRECTIONS,
        2,
        content=struct.pack("<f", FLOAT_MAX)
        + Plant(FORK, 2, scripts={(CORRECTIONS, 2): 56}).draft().content(CORRECTIONS, 2)[4:],
    ),
)
motion(CORRECTIONS, 2, "empty: no bytes", b"")
motion(CORRECTIONS, 2, "short: 3 bytes", bytes(3))
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    motion(CORRECTIONS, 2, f"step-{word}: Correction_Step is {value}", corrections(value))
motion(CORRECTIONS, 2, "zero-behind: a zero byte behind the stream", lambda: fork().content(CORRECTIONS, 2, 0) + b"\0")
motion(
    CORRECTIONS, 2, "bytes-behind: bytes behind the stream", lambda: fork().content(CORRECTIONS, 2, 1) + b"\1" * 12, 1
)
valid(
    "corrections-of-one-frame: corrections in a segment of one frame, before which there is none",
    lambda: Plant(SHORT, scripts={(CORRECTIONS, 1, 0): [1, *(2, 3, 1, 0), 0, 1, *(1, 0, 5, 1)]}),
)
valid(
    "corrections-no-bytes: a stream of no bytes, whose decisions are all 1: the largest corrections of all frames",
    lambda: corrected_lone(lambda stream: b"", frames=3),
)
valid(
    "corrections-negative-zero: positions that are -0.0 stay so where nothing is corrected",
    Plant,
    [Stem(-1, 1), Stem(-1, 1)],
    frames=5,
    points=[[0.0, 0.0, 0.0]] * 2,
    default_head=stems_head(FLOAT_TINY),
    scripts={
        (STEMS, 0): [*row((-1, -1, 1)), *row((-1, 1, -1))],
        (CORRECTIONS, 1): [0, 1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 0, 0],
    },
)
