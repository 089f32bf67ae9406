"""The decoder that FORMAT.md's Python blocks are, with what they take for granted, and a command line.

    python -m spec.document FILE [ITEM [MESH]]     answers as spec/conformance.py asks; ITEM is `open` if left out

The blocks run as they stand but for three things that change no result: a quotient by zero is what IEEE 754 says, where
Python would stop, pure functions that are asked the same again keep their answers, and models of numbers make a row of
their contexts when it is first used.
"""

from __future__ import annotations

import argparse
import ast
import json
import math
import re
import struct
import sys
import types
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import zstandard

FORMAT = Path(__file__).resolve().parent.parent / "FORMAT.md"
TEXT = FORMAT.read_text(encoding="utf-8")
# How many answers each of these pure functions keeps; those of the second take lists, too.
KEPT_OF_NUMBERS = {"averaged": 1 << 16, "number_class": 1 << 16}
KEPT = {"crc32c": 256, "waves_over_time": 64, "node_waves_over_time": 64, "cantilever": 1024}

# ---- what the document takes for granted ---------------------------------------------------------------------


def section(title: str) -> str:
    """Return the text under a heading, up to the next of the same or a higher rank."""
    heading = re.search(rf"^(#+) {re.escape(title)}\n", TEXT, re.M)
    assert heading, title
    rest = TEXT[heading.end() :]
    following = re.search(rf"^#{{1,{len(heading[1])}}} ", rest, re.M)
    return rest[: following.start()] if following else rest


def table(title: str, first_column: str) -> list[dict[str, str]]:
    """Return the rows of a table of FORMAT.md as mappings from the column's name to the cell. It is the first table in
    the section `title` whose first column is named `first_column`.
    """
    lines = section(title).splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"| {first_column} |"))
    rows = []
    for line in lines[start:]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return [dict(zip(rows[0], row)) for row in rows[2:]]


def limits_of(profile: str) -> dict[str, int]:
    """Return the limits of a profile, "full" or "small"."""
    return {row["Limit"]: int(row[profile.capitalize()]) for row in table("Limits", "Limit")}


def reader(code: str):
    form = struct.Struct("<" + code)
    return lambda data, at: form.unpack_from(data, at)[0]


def sqrt(x: float) -> float:
    return math.sqrt(x) if x >= 0.0 else math.nan


def quotient(a: float, b: float) -> float:
    try:
        return a / b
    except ZeroDivisionError:
        return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


SINGLE = struct.Struct("<f")
FLOATS = {32: "<f", 64: "<d"}


def single(x: float) -> float:
    try:
        return SINGLE.unpack(SINGLE.pack(x))[0]
    except OverflowError:
        return math.copysign(math.inf, x)


def is_json_object(text: bytes) -> bool:
    """Return whether UTF-8 bytes are a JSON object by the rules of FORMAT.md, "JSON"."""

    def unique(pairs: list) -> dict:
        if len(dict(pairs)) < len(pairs):
            raise ValueError("an object has a member twice")
        return dict(pairs)

    def number(literal: str) -> float:
        if not math.isfinite(float(literal)):
            raise ValueError("a number is not finite")
        return float(literal)

    try:
        value = json.loads(text.decode("utf-8"), object_pairs_hook=unique, parse_float=number, parse_constant=number)
        json.dumps(value, ensure_ascii=False).encode("utf-8")  # refuses halves of surrogate pairs
    except (ValueError, RecursionError):
        return False
    return isinstance(value, dict)


def zstd_frame(data: bytes) -> SimpleNamespace:
    """Read a zstd frame, and return its window size, its stated content size and its content; the latter two are None
    if they are not stated or the frame is damaged.
    """
    frame = SimpleNamespace(window_size=0, content_size=None, content=None)
    if len(data) >= 6 and not data[4] & 0x20:  # without Single_Segment_flag: RFC 8878, 3.1.1.1.2
        least = 1 << (10 + (data[5] >> 3))
        frame.window_size = least + (least >> 3) * (data[5] & 7)
    with suppress(zstandard.ZstdError, MemoryError):
        frame.content_size = zstandard.frame_content_size(data)
        if 0 < frame.content_size < 1 << 28:
            frame.content = zstandard.ZstdDecompressor().decompress(data, allow_extra_data=False)
    return frame


TAKEN_FOR_GRANTED = {
    **{name: reader(code) for name, code in {"u8": "B", "u16": "H", "u32": "I", "f32": "f", "f64": "d"}.items()},
    "sqrt": sqrt,
    "quotient": quotient,
    "single": single,
    "to_bits": lambda x, n: int.from_bytes(struct.pack(FLOATS[n], x), "little"),
    "from_bits": lambda b, n: struct.unpack(FLOATS[n], b.to_bytes(n // 8, "little"))[0],
    "limit": limits_of("full").__getitem__,
    "is_json_object": is_json_object,
    "zstd_frame": zstd_frame,
}
KINDS = {row["Name"]: int(row["Kind"], 16) for row in table("Chunk table", "Name")}

# ---- the code ------------------------------------------------------------------------------------------------


class Divisions(ast.NodeTransformer):
    """Turns a / b into quotient(a, b), unless b is a number."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.op, ast.Div) and not isinstance(node.right, ast.Constant):
            return ast.copy_location(ast.Call(ast.Name("quotient", ast.Load()), [node.left, node.right], []), node)
        return node


def code_of(text: str) -> ast.Module:
    """Parse all blocks; line numbers are those of the text."""
    lines, is_code = [], False
    for line in text.splitlines():
        is_code = line == "```python" or (is_code and line != "```")
        lines.append(line if is_code and line != "```python" else "")
    return ast.parse("\n".join(lines), str(FORMAT))


class Rows(dict):
    """Rows of contexts by their number. A decoder uses few of the thousand of a model, and most of its time went by
    making the others."""

    def __init__(self, context: type, rows: list[list]):
        self.context, self.rows = context, rows

    def __missing__(self, number: int) -> list:
        self[number] = [self.context(first.one) for first in self.rows[number]]
        return self[number]


def row_by_row(model: type, context: type):
    """Return a function that makes such a model, whose attributes are all rows of contexts."""
    rows = vars(model())
    return lambda: SimpleNamespace(**{name: Rows(context, rows[name]) for name in rows})


@lru_cache(1)
def compiled(text: str) -> types.CodeType:
    return compile(ast.fix_missing_locations(Divisions().visit(code_of(text))), str(FORMAT), "exec")


def run(text: str = TEXT) -> types.ModuleType:
    """Execute all Python blocks of FORMAT.md, or of another text, and return them as one module. Line numbers in errors
    are those of the text.
    """
    module = types.ModuleType("FORMAT")
    names = module.__dict__

    def utf8(data: bytes) -> str:
        try:
            return data.decode()
        except UnicodeDecodeError:
            raise names["Invalid"]("BAD_CHUNK") from None

    names.update(TAKEN_FOR_GRANTED | KINDS | {"utf8": utf8})
    exec(compiled(text), names)
    for name in ("NumberModel", "ExactModel"):
        names[name] = row_by_row(names[name], names["Context"])
    names.update({name: lru_cache(size)(names[name]) for name, size in KEPT_OF_NUMBERS.items()})
    for name, size in KEPT.items():
        kept = lru_cache(size)(names[name])
        names[name] = lambda *arguments, kept=kept: kept(*(tuple(x) if isinstance(x, list) else x for x in arguments))
    return module


rules = run()
KIND_NAMES = {number: name for name, number in KINDS.items()}
REMAINDERS = [rules.crc32c(bytes([255 ^ byte])) ^ 0xFF000000 for byte in range(256)]


def crc32c(data: bytes) -> int:
    """Return the checksum of FORMAT.md, "Checksums", a byte at a time instead of a bit at a time."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ REMAINDERS[(crc ^ byte) & 255]
    return crc ^ 0xFFFFFFFF


# ---- a file --------------------------------------------------------------------------------------------------


class File:
    """An opened file. What is wrong with it is `Invalid` of the rules, when it is opened or asked."""

    def __init__(self, data: bytes, strict: bool = False, mesh: bytes | None = None, rules: types.ModuleType = rules):
        self.rules, self.file = rules, rules.open_file(bytes(data), strict)
        self.header, self.chunks = self.file.header, self.file.chunks
        if mesh is not None and self.file.is_host:
            rules.take_host_mesh(self.file, mesh)

    def content(self, kind: int, level: int | None = None, segment: int = 0) -> bytes:
        return self.rules.content(self.chunks, kind, level, segment)

    @cached_property
    def deepest(self) -> int:
        """The deepest complete level."""
        late = [key[1] for key, chunk in self.chunks.items() if key[1] is not None and not chunk.is_there]
        levels = self.header.stages[: self.header.level_count]
        deepest = sum(level < min(late, default=32) for level in levels) - 1
        self.rules.require(deepest >= 0, "TRUNCATED")
        return deepest

    def positions(self, level: int | None = None) -> np.ndarray:
        """Return (frames, vertices, 3) in source order, the frames of all clips."""
        level = self.deepest if level is None else level
        if not 0 <= level < self.header.level_count:
            raise ValueError(f"level {level}: the file has 0 to {self.header.level_count - 1}")
        return np.array(self.rules.decode_level(self.file, level), "<f8" if self.header.is_float64 else "<f4")

    def rest(self, level: int = 0) -> np.ndarray:
        """Return (vertices, 3) of Rest_Type in source order: the rest pose, as a level's reference pose gives it."""
        return np.array(self.rules.rest_pose(self.file, level), "<f8" if self.file.rest_is_float64 else "<f4")

    def arrays(self) -> list[bytes]:
        """Return elements of FACES, of EDGES and of all attributes."""
        return self.rules.read_static(self.file)[1]

    def answer(self, item: str) -> bytes:
        """Return the bytes that answer an item of conformance.py, such as "rest", "time" or the number of a level."""
        if item in ("strict", "open"):
            return b""
        if item == "time":
            return b"".join(struct.pack(f"<{len(times)}d", *times) for times in self.file.times)
        if item == "clips":
            return b"".join(clip_entry(clip) for clip in self.file.clips)
        if item != "static":
            return (self.rest() if item == "rest" else self.positions(int(item))).tobytes()
        text, arrays = self.rules.read_static(self.file)
        return b"".join([text or b"", *arrays])


def clip_entry(clip) -> bytes:
    """Return what CLIPS says of a clip; Periodic, which is how it is coded, is left at 0."""
    name, seams = clip.name.encode(), clip.seams or ()
    head = struct.pack("<IIBB", clip.frames, clip.segments, clip.seams is not None, len(name))
    return head + name + struct.pack(f"<{len(seams)}f", *seams)


def main(words: list[str] | None = None) -> int:
    """Write an item of a file to standard output, decoded as FORMAT.md says. Return the exit status: 1 if the file is
    refused or cannot be read.
    """
    parser = argparse.ArgumentParser(prog="python -m spec.document", description="Decodes a file as FORMAT.md says.")
    parser.add_argument("file", type=Path)
    parser.add_argument("item", nargs="?", default="open", help="what is written to standard output, raw: a level, ...")
    parser.add_argument("mesh", nargs="?", type=Path, help="positions of the host's mesh, binary32")
    options = parser.parse_args(words)
    try:
        mesh = options.mesh and options.mesh.read_bytes()
        sys.stdout.buffer.write(File(options.file.read_bytes(), options.item == "strict", mesh).answer(options.item))
    except (rules.Invalid, OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
