"""Prints the bytes of a small .ath file with what each of them says; FORMAT.md has that of one vector.

    python -m spec.dump spec/vectors/valid/traced.ath

Fields and streams are read with the code of FORMAT.md. What is said of a field holds for files of one branch, one
segment and one layer with an exact rest pose; other files are refused.
"""

from __future__ import annotations

import struct
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

from spec.document import KIND_NAMES, rules

COLUMNS, TEXT_WIDTH = 8, 78  # Bytes and characters of text in a line.
AXES = "xyz"
Part = tuple[int, str]  # A number of bytes, and what they say.


def lines(data: bytes) -> Iterator[str]:
    """Yield the lines of a dump of a file: the bytes in hexadecimal, each group with what it says."""
    at = 0
    for size, text in parts(data):
        words = textwrap.wrap(text, TEXT_WIDTH)
        rows = [data[i : min(i + COLUMNS, at + size)] for i in range(at, at + size, COLUMNS)]
        for i in range(max(len(rows), len(words))):
            shown = rows[i].hex(" ") if i < len(rows) else ""
            place = f"{at + COLUMNS * i:08x}" if i < len(rows) else " " * COLUMNS
            yield f"    {place}  {shown:23}  {words[i] if i < len(words) else ''}".rstrip()
        at += size
    assert at == len(data), "every byte is said"


def parts(data: bytes) -> Iterator[Part]:
    """Yield the parts of a file in order, as pairs of a number of bytes and a text that says what they mean."""
    file = rules.open_file(data, True)
    header, table = rules.decode_front(data[24 : rules.u32(data, 16) - 4 * rules.u32(data, 20)], rules.u32(data, 20))
    check(data, file, header, table)
    yield 8, "Magic"
    yield 1, f"Major_Version {data[8]}"
    yield 1, f"Minor_Version {data[9]}"
    yield 2, f"Features {rules.u16(data, 10)}"
    yield 4, "Front_Checksum"
    yield 4, f"Front_Length {rules.u32(data, 16)}"
    yield 4, f"Chunk_Count {len(table)}"
    yield rules.u32(data, 16) - 24 - 4 * len(table), front(header, table)
    for chunk in table:
        yield 4, f"Checksum of {name(*chunk)}"
    at = rules.u32(data, 16)
    for chunk in table:
        content = data[at : at + chunk[3]]
        yield from described(file, chunk, content) if content else []
        at += chunk[3]


def check(data: bytes, file, header, table: list) -> None:
    """Raise ValueError unless the sentences of this module hold for a file."""
    methods, at = {}, rules.u32(data, 16)
    for kind, _, _, length in table:
        methods[kind] = data[at] if length else None
        at += length
    told = {rules.HIERARCHY, rules.REST, rules.TIME, rules.STEMS}
    counts = {word: getattr(header, word + "_count") for word in ("branch", "segment", "layer", "clip")}
    reasons = [f"{word.title()}_Count {count}" for word, count in counts.items() if count != 1]
    reasons += sorted({f"a chunk {KIND_NAMES.get(chunk[0], chunk[0])}" for chunk in table if chunk[0] not in told})
    reasons += [] if methods[rules.REST] == rules.IS_EXACT else ["a rest pose that is not exact, or not of binary32"]
    reasons += [] if methods[rules.TIME] == 1 else ["times without a rate"]
    reasons += [] if at == len(data) else [f"{len(data) - at} bytes behind its chunks"]
    if reasons:
        raise ValueError(
            f"got a file with {', '.join(reasons)}, expected one of one branch, one segment and one layer whose "
            "rest pose is exact, such as spec/vectors/valid/traced.ath; athcodec info FILE.ath describes any file"
        )


def name(kind: int, level: int | None, segment: int, length: int) -> str:
    return KIND_NAMES[kind] + ("" if level is None else f" of stage {level}, segment {segment}")


def front(header, table: list) -> str:
    """Return a sentence on what the coded front of a file says: its counts, its levels, its chunks and the errors of
    its levels.
    """
    counts = "place branch frame segment full_level level clip layer vertex".split()
    facts = [f"{word.title()}_Count {getattr(header, word + '_count')}" for word in counts]
    facts += [f"Is_Float64 {header.is_float64}", f"Is_Predicted {header.is_predicted}", f"Max_Error {header.max_error}"]
    chunks = ", ".join(f"{name(*chunk)}: {chunk[3]} bytes" for chunk in table)
    errors = "; ".join(", ".join(f"{x:g}" for x in entry) for row in header.errors for entry in row)
    return (
        f"Front_Stream: {', '.join(facts)}. Stages of the levels: {', '.join(map(str, header.stages))}. "
        f"Chunks: {chunks}. Errors of each level: {errors}. No joins, no repeats."
    )


def described(file, chunk: tuple, content: bytes) -> Iterator[Part]:
    """Yield the parts of one chunk, as pairs of a number of bytes and a text. `chunk` is a tuple of kind, level,
    segment and length.
    """
    kind, level, segment, length = chunk
    title = name(*chunk)
    if kind == rules.HIERARCHY:
        stems = ", ".join(f"parent {b.parent}, {b.count} vertices, flags {b.flags}, Lag {b.lag}" for b in file.branches)
        yield length, f"{title}: Hierarchy_Stream: {stems}; Rigid, Detail and Ring 0; both permutations as they are"
    elif kind == rules.REST:
        yield 1, f"{title}: Method {content[0]}: Is_Exact"
        for k in range(3):
            yield 4, f"Origin, {AXES[k]}: {rules.f32(content, 1 + 4 * k)}"
        yield 4, f"Rest_Step {rules.f32(content, 13)}, which an exact rest pose does not use"
        points = ", ".join(f"({', '.join(f'{x:g}' for x in point)})" for point in file.rest.positions)
        yield length - 17, f"Rest_Body, an exact rest stream: {points}"
    elif kind == rules.TIME:
        yield 1, f"{title}: Method {content[0]}"
        yield 2, f"Rate {rules.u16(content, 1)}"
    else:
        yield 4, f"{title}: Step {struct.unpack_from('<f', content)[0]}"
        yield 1, f"Rotation {content[4]}"
        yield 1, f"Basis {content[5]}"
        if length > 6:
            yield length - 6, f"Stems_Stream: {rows(file, level, segment)}"


def rows(file, level: int, segment: int) -> str:
    """Return as text the rows of integers that the chunk STEMS of a level adds for the first piece in a segment."""
    plan = rules.plans_of(file, level)[0]
    motion = rules.decode_motion(file, plan, segment, level)
    piece = plan.pieces[0]
    modes = range(piece.low_modes) if level == piece.low_stage else range(piece.low_modes, len(piece.basis))
    facts = ["translation: no frequency"] if level == piece.low_stage else []
    for m in modes:
        row = motion.coefficients[piece.first + m]
        count = rules.row_extent(row)
        axes = "; ".join(f"{AXES[k]} {', '.join(map(str, row[k][:count]))}" for k in range(3))
        facts.append(f"mode {m}: " + (f"{count} frequencies: {axes}" if count else "no frequency"))
    return ". ".join(facts)


if __name__ == "__main__":
    try:
        print("\n".join(lines(Path(sys.argv[1]).read_bytes())))
    except ValueError as error:
        sys.exit(f"{sys.argv[1]}: {error}")
