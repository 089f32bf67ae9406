"""Streams and files with exactly the values of a script, for vectors that no encoder would write.

Every function of FORMAT.md's code that reads a stream also writes it here: it runs with a coder that encodes each
decision instead of decoding it, with the value taken from a script. So a stream can hold any numbers in the order of
FORMAT.md, valid or not, and athcodec is not needed. `Plant` makes complete files of such streams; `Draft` is a file in
pieces that can be corrupted.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np

from spec.document import crc32c, rules

LOOSE, SHEET, WHOLE = rules.LOOSE, rules.SHEET, rules.WHOLE
REST_EXACT, REST_FLOAT64, IS_HOST, REST_CONNECTED = 1, 2, 4, 8  # Bits of REST's Method.
NO_LEVEL = 255  # Level of a chunk that is not of motion.

RECENT = 32  # corners that a vertex may be said by

# ---- scripts -----------------------------------------------------------------------------------------------


class Script:
    """Values in the order in which a stream reads them; 0 (an empty row, a bit 0) when they are used up."""

    def __init__(self, *values):
        self.values = deque(values)

    def answer(self, asked: str, most: int):
        return self.values.popleft() if self.values else 0


class Chance(Script):
    """Random values behind those given: bits, small and sometimes large numbers, rows of any length."""

    def __init__(self, seed: int, empty: float = 0.3, large: int = 12, begin: Sequence[int] = ()):
        super().__init__(*begin)
        self.random, self.empty, self.large = np.random.default_rng(seed), empty, large

    def answer(self, asked: str, most: int):
        """Return the next given value, or else a random value of the kind `asked`: "count", "bit", "corner", "signed"
        or another number. `most` is the largest value of a count or corner.
        """
        if self.values:
            return self.values.popleft()
        if asked == "count":
            return 0 if self.random.random() < self.empty else int(self.random.integers(1, most + 1))
        if asked == "bit":
            return int(self.random.integers(2))
        if asked == "corner":
            return int(self.random.integers(most + 1))
        size = int(2 ** self.random.uniform(0, self.large if self.random.random() < 0.1 else 3)) - 1
        return -size if asked == "signed" and self.random.random() < 0.5 else size


def row(*frequencies: tuple[int, int, int]) -> list[int]:
    """Return script of a row: the number of coded frequencies, then x, y, z of each."""
    return [len(frequencies), *(n for xyz in frequencies for n in xyz)]


def refined_row(*frequencies: tuple[int, int, int]) -> list[int]:
    """Return script of a refined row: differences from predictions that are 0; from others, a minus is against the
    sign."""
    numbers = [n for xyz in frequencies for n in xyz]
    return [len(frequencies), *(value for n in numbers for value in ((abs(n), int(n < 0)) if n else (0,)))]


def magnitude_bits(magnitude: int, longest: int) -> list[int]:
    """Return decisions of a magnitude: its length in unary, and the bits after the leading one."""
    length = magnitude.bit_length()
    assert length <= longest, "no stream can hold this number"
    return [1] * length + [0] * (length < longest) + [int(bit) for bit in f"{magnitude:b}"[1:]]


class ScriptedCoder(rules.RangeDecoder):
    """Tracks the interval of its decisions, as an encoder does."""

    def __init__(self, script: Script):
        self.script, self.decisions = script, deque()
        self.low, self.range, self.length = 0, rules.MASK, 8

    def narrow(self, bound: int) -> int:
        bit = int(self.decisions.popleft() if self.decisions else self.script.answer("bit", 1))
        self.low, self.range = (self.low, bound) if bit else (self.low + bound, self.range - bound)
        if self.range < 1 << 32:
            self.low, self.range, self.length = self.low << 32, self.range << 32, self.length + 4
        return bit

    def is_finished(self) -> bool:
        assert not self.decisions and not self.script.values, "the script has more values than the stream reads"
        return True

    def stream(self) -> bytes:
        """Return a number of the interval with as many trailing zeros as possible; these are left out."""
        last, zeros = self.low + self.range - 1, 0
        while zeros < 8 * self.length and last >> zeros + 1 << zeros + 1 >= self.low:
            zeros += 1
        return (last >> zeros << zeros).to_bytes(self.length, "big").rstrip(b"\0")


def scripted_unsigned(original: Callable, coder, model, c):
    coder.decisions.extend(magnitude_bits(coder.script.answer("unsigned", 1 << 30), 30))
    return original(coder, model, c)


def scripted_signed(original: Callable, coder, model, c, sign=None):
    value = coder.script.answer("signed", 1 << 30)
    coder.decisions.extend(magnitude_bits(abs(value), 30))
    if original(coder, model, c):
        coder.decisions.append(value < 0)
        coder.raw_bit() if sign is None else coder.bit(sign)
    return value


def scripted_count(original: Callable, coder, model, history, above, rank):
    count = coder.script.answer("count", rank)
    coder.decisions.extend([0] + magnitude_bits(count, 10)[1:] if count else [1])
    return original(coder, model, history, above, rank)


def scripted_exact(original: Callable, coder, model, n, expected, before):
    """Code an exact floating-point number of `n` bits in place of the rule `original`. The script has the number, or a
    pair of the magnitude and the sign of its difference from the `expected` one.
    """
    value = coder.script.answer("exact", 0)
    if not isinstance(value, tuple):
        likely = rules.single(expected) if n == 32 else expected
        likely = likely if rules.finite(likely) else 0.0
        difference = rules.ordered(rules.to_bits(value, n), n) - rules.ordered(rules.to_bits(likely, n), n)
        value = abs(difference), difference < 0
    coder.decisions.extend(magnitude_bits(value[0], n) + ([value[1]] if value[0] else []))
    return original(coder, model, n, expected, before)


def scripted_corner(original: Callable, coder, model, bound, corners, first, j, previous):
    """Code the next corner of a face, whose vertex the script has, in place of the rule `original`. It is coded in the
    first way that can express the vertex.
    """
    vertex, script = coder.script.answer("corner", bound - 1), coder.script
    seen = copy(model)
    seen.ways = [dict(table) for table in model.ways]
    coder.decisions.extend(corner_decisions(seen, bound, corners, first, j, previous, vertex))
    about = corners[-1 if j > 0 else previous] if corners else 0
    coder.script = Script(vertex - about)
    original(coder, model, bound, corners, first, j, previous)
    coder.script = script


def corner_decisions(model, bound, corners, first, j, previous, vertex) -> list[int]:
    """Return the binary decisions that code a corner, up to the point at which its vertex is coded by its distance from
    another.
    """
    followed = [rules.follow(model, corners, table, length) for table, length in ((0, 12), (1, 3))]
    expected, bits = rules.repeated(corners, model.followed or followed[0], bound), []
    guesses = [rules.repeated(corners, followed[1], bound), model.next if model.next < bound else None]
    tried = dict.fromkeys(guess for guess in (expected, *guesses) if guess is not None)
    for guess in tried:
        bits.append(int(guess == vertex))
        if bits[-1]:
            return bits
    for place in dict.fromkeys(rules.guesses_of_sides(model, corners, first, j, previous)):
        members = model.members.get(place, [])[:16]
        if place is None or (len(model.members[place]) == 1 and members[0] in tried):
            continue
        bits.append(int(vertex in members))
        if bits[-1]:
            at = members.index(vertex)
            return bits + [0] * at + [1] * (at < len(members) - 1)
    recent = corners[: -RECENT - 1 : -1]
    if vertex in recent:
        return [*bits, 1, *_bits(recent.index(vertex), 5)]
    return [*bits, 0]


def scripted_face_count(original: Callable, coder, model, before):
    """Return the script has the number of corners."""
    count, script = coder.script.answer("unsigned", 8), coder.script
    coder.decisions.append(int(count == before))
    coder.script = Script(count)
    original(coder, model, before)
    coder.script = script
    return count


# Replacements in FORMAT.md's code, and the function that each calls.
SCRIPTED = {
    "code_in_class": (scripted_unsigned, "code_in_class"),
    "code_signed_in_class": (scripted_signed, "code_in_class"),
    "decode_count": (scripted_count, "decode_count"),
    "code_exact": (scripted_exact, "code_exact"),
    "decode_corner": (scripted_corner, "decode_corner"),
    "decode_face_count": (scripted_face_count, "decode_face_count"),
}


@contextmanager
def scripted(script: Script, decisions: bool = False) -> Iterator[list[ScriptedCoder]]:
    """Turn FORMAT.md's decoder into a writer while the context lasts, and yield a list that will hold the coder that it
    makes. With `decisions`, the script has single binary decisions instead of values.
    """
    made: list[ScriptedCoder] = []

    def coder(_: bytes) -> ScriptedCoder:
        made.append(ScriptedCoder(script))
        return made[-1]

    kept = {name: getattr(rules, name) for name in ("RangeDecoder", *SCRIPTED)}
    if not decisions:
        vars(rules).update({name: partial(function, kept[of]) for name, (function, of) in SCRIPTED.items()})
    rules.RangeDecoder = coder
    try:
        yield made
    finally:
        vars(rules).update(kept)


def write(
    function: Callable, script: Script | list, *arguments, lowest: bool = False, decisions: bool = False
) -> bytes:
    """Return the stream that `function` of FORMAT.md's code reads as the script.

    It ends at a value that the function refuses; `lowest`: who goes on behind that reads ones. `decisions`: the script
    has bits alone, and no numbers."""
    script = script if isinstance(script, Script) else Script(*script)
    with scripted(script, decisions) as made, suppress(rules.Invalid):
        function(b"", *arguments)
    return made[0].low.to_bytes(made[0].length, "big").rstrip(b"\0") if lowest else made[0].stream()


# ---- files in pieces ---------------------------------------------------------------------------------------

HEADER = struct.Struct("<8sBBHIII")
HEADER_FIELDS = "magic major minor features checksum front_length chunk_count".split()
MOST_ENTRIES = 4096  # Largest error table that is written.


@dataclass(frozen=True)
class Clip:
    frames: int
    segments: int
    name: str = ""
    seams: tuple[float, ...] | None = None  # For a loop: Seam_Errors, one for each level.
    periodic: bool = False  # a loop of one segment, in periodic waves

    def entry(self) -> bytes:
        """Return what CLIPS says of it."""
        flags = (self.seams is not None) | (self.periodic << 1)
        return clip_entry(self.frames, self.segments, self.name, self.seams, flags=flags)


@dataclass(frozen=True)
class Join:
    """How a segment goes on from the end of the one before it."""

    width: int  # frames; 0: it does not
    is_sloped: bool = False


@dataclass(frozen=True)
class Entry:
    """A chunk and what the front says of it; None: the true value."""

    kind: int
    content: bytes
    level: int = NO_LEVEL
    segment: int = 0
    length: int | None = None
    checksum: int | None = None
    spelt: bool = False  # the Kind by all its bits, although it has a number
    number: int | None = None  # from OTHER on: what says that all bits of the Kind follow

    @property
    def is_motion(self) -> bool:
        return 16 <= self.kind & 0x7FFF < 32

    @property
    def key(self) -> tuple:
        """What grows along the file."""
        kind_id = self.kind & 0x7FFF
        if self.is_motion:
            return (1, self.level, self.segment, self.kind)
        return (0, kind_id) if kind_id < 16 else (2, kind_id)


def _more_vertices(count: int) -> list[int]:
    """Return values of how many vertices there are beside one for each place."""
    return [1, count - 1] if count else [0]


class FrontScript:
    """Values of the front stream. It follows the contexts of the chunk table as far as they decide what is read."""

    def __init__(self, counts: dict):
        """Begin the integers that code the front of a file with the fields of its header, by name."""
        self.counts = counts
        self.values = [
            *(counts[f"{name}_count"] - 1 for name in ("place", "branch", "frame", "segment")),
            counts["full_level_count"] - 1,
            counts["full_level_count"] - counts["level_count"],
            counts["clip_count"] - 1,
            counts["layer_count"] - 1,
            *_more_vertices(counts["vertex_count"] - counts["place_count"]),
            int(counts["is_float64"]),
            int(counts["is_predicted"]),
            *_bits(rules.to_bits(counts["max_error"], 64), 63),
        ]
        stages, count = [-1, *counts.get("stages", ())], min(counts["full_level_count"], 32)
        stages += range(stages[-1] + 1, stages[-1] + 1 + count)  # Where none are given, none is left out.
        for before, stage in pairwise(stages[: count + 1]):
            self.values += [1] * (stage - before - 1) + [0]
        self.bits, self.before, self.was_motion, self.place = [8] * (rules.OTHER + 1), rules.OTHER, False, (0, 0)

    def add_chunk(self, entry: Entry) -> None:
        """Add the integers that code the table's entry of a chunk: its kind, level, segment and length."""
        known = entry.kind in rules.KINDS and not entry.spelt and entry.number is None
        index = rules.KINDS.index(entry.kind) if known else rules.OTHER
        number = index if entry.number is None else entry.number
        self.values += _bits(number, 5) + ([] if known else _bits(entry.kind, 16))
        if entry.is_motion:
            self._add_place(index, (entry.level, entry.segment))
        length = len(entry.content) if entry.length is None else entry.length
        size = length.bit_length()
        self.values += [size - self.bits[index], *_bits(length, size)[1:]]
        self.bits[index], self.before, self.was_motion = size, index, entry.is_motion

    def _add_place(self, index: int, place: tuple[int, int]) -> None:
        level, segment = usual = self.place
        if self.was_motion and index <= self.before:
            usual = (level, segment + 1) if segment + 1 < self.counts["segment_count"] else (level + 1, 0)
        up = place[0] - level
        self.values += [1] if place == usual else [0, up, place[1] - (0 if up else segment)]
        self.place = place

    def add_errors(self, errors: Sequence[int]) -> None:
        """Add the stored errors: three integers for each level and segment."""
        first = min(rules.to_bits(rules.single(self.counts["max_error"]), 32) >> 18, rules.SHORT_FLOATS - 1)
        row, above = 3 * self.counts["segment_count"], [first] * 3
        for start in range(0, len(errors), row):
            before = above
            for at in range(start, start + row, 3):
                changes = [error - last for error, last in zip(errors[at : at + 3], before)]
                self.values += [change - last for change, last in zip(changes, [0, *changes])]
                before = errors[at : at + 3]
            above = errors[start : start + 3]

    def add_joins(self, joins: Sequence[Join]) -> None:
        """Add one join for each level and segment. A sloped join of width 0 can be written, but is not valid."""
        last = 16
        for join in joins if self.counts["segment_count"] > 1 else ():
            is_said = join.width != 0 or join.is_sloped
            self.values.append(int(is_said))
            if is_said:
                self.values += [int(join.is_sloped), join.width - last]
                last = join.width

    def add_repeats(self, repeats: Sequence[int]) -> None:
        """Say of each frame whether it is a repeat; none: no frame is a repeat."""
        self.values += [int(any(repeats)), *(repeats[1:] if any(repeats) else ())]


def _bits(value: int, count: int) -> list[int]:
    """Return the bits of a number from the top."""
    return [value >> k & 1 for k in reversed(range(count))]


@dataclass(frozen=True)
class Draft:
    """A file whose counts, lengths and checksums are correct unless `header` has others."""

    header: dict
    entries: tuple[Entry, ...]
    errors: tuple[int, ...] | None = None  # the error table as stored
    joins: tuple[Join, ...] | None = None  # For each level and segment.
    repeats: tuple[int, ...] = ()  # For each frame.
    stream: Callable[[bytes], bytes] | None = None  # Change of the front stream.

    def file(self) -> bytes:
        """Return the bytes of the whole file."""
        fields = (
            dict(
                magic=rules.MAGIC,
                major=rules.VERSION[0],
                minor=rules.VERSION[1],
                features=0,
                checksum=None,
                front_length=None,
                chunk_count=len(self.entries),
                clip_count=1,
                is_float64=0,
                is_predicted=0,
                max_error=1.0,
                layer_count=1,
                vertex_count=self.header["place_count"],
            )
            | self.header
        )
        stream = self._stream(fields)
        checksums = b"".join(
            struct.pack("<I", crc32c(entry.content) if entry.checksum is None else entry.checksum)
            for entry in self.entries
        )
        if fields["front_length"] is None:
            fields["front_length"] = HEADER.size + len(stream) + len(checksums)
        if fields["checksum"] is None:
            blank = HEADER.pack(*((fields | {"checksum": 0})[name] for name in HEADER_FIELDS))
            fields["checksum"] = crc32c(blank + stream + checksums)
        front = HEADER.pack(*(fields[name] for name in HEADER_FIELDS)) + stream + checksums
        return front + b"".join(entry.content for entry in self.entries)

    def _stream(self, fields: dict) -> bytes:
        """Return the coded stream of the front, with the header's `fields`, the table of chunks, errors, joins and
        repeats.
        """
        script = FrontScript(fields)
        for entry in self.entries:
            script.add_chunk(entry)
        entries = fields["level_count"] * fields["segment_count"]
        if entries <= MOST_ENTRIES:
            script.add_errors((0,) * (3 * entries) if self.errors is None else self.errors)
            script.add_joins((Join(0),) * entries if self.joins is None else self.joins)
            script.add_repeats(self.repeats)
        stream = write(rules.decode_front, script.values, len(self.entries))
        return self.stream(stream) if self.stream else stream

    def with_header(self, **fields) -> Draft:
        if "place_count" in fields:  # As many vertices, unless something else is said.
            fields = {"vertex_count": fields["place_count"]} | fields
        return replace(self, header=self.header | fields)

    def index(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> int:
        return next(i for i, e in enumerate(self.entries) if (e.kind, e.level, e.segment) == (kind, level, segment))

    def content(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> bytes:
        return self.entries[self.index(kind, level, segment)].content

    def change(self, kind: int, level: int = NO_LEVEL, segment: int = 0, **fields) -> Draft:
        """Return the file with another content, or another entry in the table, for one chunk."""
        i = self.index(kind, level, segment)
        return replace(self, entries=(*self.entries[:i], replace(self.entries[i], **fields), *self.entries[i + 1 :]))

    def without(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> Draft:
        i = self.index(kind, level, segment)
        return replace(self, entries=self.entries[:i] + self.entries[i + 1 :])

    def add(self, *entries: Entry, sort: bool = True) -> Draft:
        together = [*self.entries, *entries]
        return replace(self, entries=tuple(sorted(together, key=lambda e: e.key) if sort else together))

    def upto(self, level: int) -> Draft:
        """Return the file without the levels after one."""
        header = self.header | {"level_count": level + 1}
        joins = self.joins and self.joins[: (level + 1) * header["segment_count"]]
        entries = tuple(e for e in self.entries if e.key[0] != 1 or e.level <= level)
        return replace(self, header=header, entries=entries, joins=joins)


# ---- plants ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Stem:
    """A branch: parent (-1: a root), vertices, place of its attach vertex on the parent's stem."""

    parent: int
    count: int
    place: int = 0
    flags: int = 0
    lag: int = 1
    rigid: int = 0
    detail: int = 0
    ring: int = 0


def hierarchy_script(stems: list[Stem], branch_source: list | None = None, vertex_source: list | None = None) -> list:
    """Return the integers that code a hierarchy of stems. `branch_source` and `vertex_source` have the source's numbers
    of branches and vertices; None means the predicted order.
    """
    script, lag = [], 0
    for b, stem in enumerate(stems):
        up, ancestor = 0, b - 1
        while ancestor != stem.parent:
            up, ancestor = up + 1, stems[ancestor].parent
        script += [up] if b > 0 else []
        script += [stem.count - 1, *(stem.flags >> i & 1 for i in range(4)), stem.lag - lag]
        lag = stem.lag
    last_place = [0] * len(stems)
    for stem in stems:
        if stem.parent >= 0:
            script.append(stem.place - last_place[stem.parent])
            last_place[stem.parent] = stem.place
    return (
        script
        + [
            n
            for name in ("rigid", "detail", "ring")
            for n in numbers_script([(s.lag, getattr(s, name)) for s in stems])
        ]
        + permutation_script(branch_source, stems, False)
        + permutation_script(vertex_source, stems, True, branch_source)
    )


def numbers_script(lags_and_numbers: list[tuple[int, int]]) -> list:
    """Return the integers that code a number for each branch, given pairs of the branch's lag, which selects the
    prediction, and the number.
    """
    if not any(number for _, number in lags_and_numbers):
        return [0]
    script, last = [1], [0] * 16
    for lag, number in lags_and_numbers:
        c = max(min(lag, 15), 0)
        script.append(number - last[c])
        last[c] = number
    return script


def permutation_script(source: list | None, stems: list[Stem], of_vertices: bool, branch_source=None) -> list:
    """Return the integers that code a permutation, of vertices or of branches; None stands for the predicted
    permutation.
    """
    if source is None:
        return [0]
    runs = [(0, len(stems))]
    if of_vertices:
        order = branch_source or list(range(len(stems)))
        starts, start = {}, 0
        for b in sorted(range(len(stems)), key=lambda b: order[b]):
            starts[b], start = start, start + stems[b].count
        runs = [(starts[b], stem.count) for b, stem in enumerate(stems)]
    script, numbers, before = [1], iter(source), []
    beside, step, step_beside = {}, 1, 1
    for start, length in runs:
        for i in range(length):
            value, known = next(numbers), beside.get(i)
            along, following = (before[-1] + step, before[-1] + 1) if i > 0 else (start, start)
            script.append(int(value == along))
            if value != along and known is not None:
                script.append(int(value == known + step_beside))
            if value != along and (known is None or value != known + step_beside):
                script.append(value - following)
            if i > 0:
                step = value - before[-1]
            if known is not None:
                step_beside = value - known
            if i < rules.PLACES:
                beside[i] = value
            before.append(value)
    return script


def grown(stems: list[Stem], seed: int = 0, size: int = 4) -> list[list[float]]:
    """Return positions of stems, as lists of three whole numbers, that are random walks from the place where each stem
    hangs.
    """
    random, points, first = np.random.default_rng(seed), [], []
    for stem in stems:
        first.append(len(points))
        at = np.zeros(3) if stem.parent < 0 else np.array(points[first[stem.parent] + stem.place])
        for step in random.integers(-1, size, (stem.count, 3)):
            at = at + step
            points.append(at.astype(float).tolist())
    return points


def rest_chunk(
    stream: bytes, *, exact: int = 0, rest_type: int = 0, origin=(0.0, 0.0, 0.0), step: float = 0.25, reserved: int = 0
) -> bytes:
    """Return REST. reserved: further bits of Method."""
    return struct.pack("<B3ff", exact | rest_type << 1 | reserved << 2, *origin, step) + stream


def host_rest_chunk(mesh: np.ndarray, origin=(0.0, 0.0, 0.0), **fields) -> bytes:
    data = (mesh + np.float32(0)).tobytes()  # 0.0 for -0.0
    checksums = struct.pack("<II", crc32c(data), crc32c(data[::-1]))
    return rest_chunk(checksums, **{"origin": origin, "step": 1.0, "reserved": IS_HOST >> 2} | fields)


def refined_rest_chunk(stream: bytes, step: float = 0.0625) -> bytes:
    return struct.pack("<f", step) + stream


def source_rest_chunk(stream: bytes, step: float = 0.25, method: int = 0) -> bytes:
    return bytes([method]) + (struct.pack("<f", step) if method == 0 else b"") + stream


def clip_entry(
    frames: int,
    segments: int = 1,
    name: bytes | str = b"",
    seams: Sequence[float] | None = None,
    *,
    flags: int | None = None,
    length: int | None = None,
) -> bytes:
    """Return a clip in CLIPS, a loop where it has seams."""
    name = name.encode() if isinstance(name, str) else name
    flags = int(seams is not None) if flags is None else flags
    head = struct.pack("<IIBB", frames, segments, flags, len(name) if length is None else length)
    return head + name + struct.pack(f"<{len(seams or ())}f", *seams or ())


def steady_time(first: float = 0.0, step: float = 0.25) -> bytes:
    return steady_times((first, step))


def steady_times(*clips: tuple[float, float]) -> bytes:
    """Return first and Step of each clip."""
    return bytes(1) + b"".join(struct.pack("<dd", first, step) for first, step in clips)


def whole_rates(*rates: int, method: int = 1) -> bytes:
    """Return the rate of each clip."""
    return bytes([method]) + b"".join(struct.pack("<H", rate) for rate in rates)


def uneven_time(*times: float | tuple) -> bytes:
    return b"\2" + write(rules.decode_times, list(times), len(times))


def stems_head(
    step: float = 0.125, rotation: int = 0, kind: int = 0, rank: int = 0, basis: bytes = b"", base: int = 255
) -> bytes:
    head = struct.pack("<fBB", step, rotation, kind)
    return head + struct.pack("<HBI", rank, base, len(basis)) + basis if kind > 0 else head


def predicted_head(step: float = 0.0625) -> bytes:
    return struct.pack("<f", step)


def basis_stream(rows: list[list[int]]) -> bytes:
    """Return the stream that codes a learned basis over time with rows of integers."""
    script = []
    for integers in rows:
        before = slope = 0
        for t, value in enumerate(integers):
            script.append(value - before - slope)
            slope, before = value - before if t > 0 else 0, value
    return write(rules.decode_temporal, script, len(rows), len(rows[0]))


def basis_in_waves(frames: int, *script: int, rank: int, known: list[list[float]] | None = None) -> bytes:
    """Return a learned basis in waves: of three rows at a time the changes of their exponents, then the script of a
    row."""
    return write(rules.decode_basis, list(script), known or [], rank, frames, rules.waves_over_time(frames, False))


def _no_motion(plan, frames: int, periodic: bool, shapes):
    motion = rules.no_motion(plan, frames, periodic)
    motion.shapes, motion.shape_rows = shapes.shapes, shapes.shape_rows
    return motion


def _of_draft(name: str) -> Callable:
    return lambda plant, *arguments, **fields: getattr(plant.draft(), name)(*arguments, **fields)


def mesh_of(faces: bytes, place_of: list, places: list | None = None):
    """Return the mesh of FACES as a connected rest pose takes it."""
    places = list(range(len(place_of))) if places is None else places
    return rules.mesh_of_faces(faces, places, [place_of.index(place) for place in places])


def places_chunk(places: list, place_count: int, columns: int = 3) -> bytes:
    """Return PLACES, by the place of each vertex."""
    stream = write(
        lambda data, *counts: rules.decode_places(bytes([columns]) + data, *counts), places, len(places), place_count
    )
    return bytes([columns]) + stream


@dataclass
class Plant:
    """A file of scripts, or seeds of random ones, by (kind, level, segment) or (kind, level). Streams without a script
    hold empty rows; SHAPES, CORRECTIONS and REFINED_REST are there only with one."""

    stems: list[Stem]
    frames: int = 1
    segments: int = 1
    clips: tuple[Clip, ...] = ()  # Clips of CLIPS; none: one of `frames` and `segments`, without the chunk.
    points: list | None = None  # integers in units of Rest_Step; None: `grown`
    rest: bytes | None = None  # REST
    faces: bytes | None = None  # FACES that it goes by
    source_rest: bytes | None = None  # SOURCE_REST
    mesh: np.ndarray | None = None  # The host's mesh, in source order, in place of a rest pose.
    time: bytes | None = None  # TIME
    branch_source: list | None = None
    vertex_source: list | None = None  # The place of each vertex in file order.
    places: list | None = None  # The place of each vertex in source order; none: each has its own.
    columns: int = 3  # Columns of PLACES.
    is_float64: bool = False
    scripts: dict = field(default_factory=dict)
    heads: dict = field(default_factory=dict)  # Heads of STEMS.
    default_head: bytes = stems_head()
    origin: tuple = (0.0, 0.0, 0.0)
    step: float = 0.25
    layers: int = 1
    ratio: int = 4  # Ratio of the steps of layers, as STEMS and REFINED_REST have it.
    shift: int = 2  # Shift of SHAPES.
    joins: tuple[Join, ...] | None = None
    repeats: tuple[int, ...] = ()  # For each frame of one clip; none: no frame is a repeat.
    predicted: bytes | None = None  # Predicted motion, Step and Settings; then AFFINES are there only with a script.
    trees: bytes | None = None  # The same of the trees of LOOSE roots, beside modes.

    def draft(self) -> Draft:
        """Return the draft of the plant's file, with its hierarchy, rest pose, times and all segments."""
        vertices = sum(stem.count for stem in self.stems)
        stream = write(
            rules.decode_hierarchy,
            hierarchy_script(self.stems, self.branch_source, self.vertex_source),
            len(self.stems),
            vertices,
        )
        branches, _, place_of = rules.decode_hierarchy(stream, len(self.stems), vertices)
        rest = self._rest(branches)
        self.branches, predicted = branches, self.predicted is not None
        rests = [self._decoded_rest(branches, rest, place_of)]
        self.plan = self.level_0 = rules.make_plan(branches, rests[-1].rest, predicted)
        clips = self.clips or (Clip(self.frames, self.segments),)
        entries = [
            Entry(rules.HIERARCHY, stream),
            Entry(rules.REST, rest),
            Entry(rules.TIME, self.time or steady_times(*[(0.0, 0.25)] * len(clips))),
        ]
        if self.clips:
            entries.append(Entry(rules.CLIPS, b"".join(clip.entry() for clip in clips)))
        if self.source_rest is not None:
            entries.append(Entry(rules.SOURCE_REST, self.source_rest))
        if self.faces is not None:
            entries.append(Entry(rules.FACES, self.faces))
        if self.places is not None:
            entries.append(Entry(rules.PLACES, places_chunk(self.places, vertices, self.columns)))
        if (rules.REFINED_REST, 1, 0) in self.scripts:
            entries.append(self._refined_rest(branches, 1, self.step / 2, rests))
            self.plan = rules.make_plan(branches, rests[-1].rest)
        self.plans, self.shapes = [self.plan], [rules.no_motion(self.plan, 1, False)]
        for level in range(self.plan.height + 2):
            if (rules.SHAPES, level, 0) in self.scripts:
                entries.append(Entry(rules.SHAPES, self._shapes(level), level))
        for q in range(1, self.layers):
            entries += self._layer(branches, q, rests)
        segments, start = [(n, clip.periodic) for clip in clips for n in rules.segment_lengths([clip])], 0
        for s, (frames, periodic) in enumerate(segments):
            entries += self._segment(s, frames - sum(self.repeats[start : start + frames]), periodic)
            start += frames
        entries.sort(key=lambda entry: entry.key)
        levels = self.plan.height + 1 + self.layers
        return Draft(
            dict(
                place_count=vertices,
                vertex_count=vertices if self.places is None else len(self.places),
                branch_count=len(self.stems),
                frame_count=sum(clip.frames for clip in clips),
                segment_count=len(segments),
                level_count=levels,
                full_level_count=levels,
                clip_count=len(clips),
                is_float64=int(self.is_float64),
                is_predicted=int(predicted),
                layer_count=self.layers,
            ),
            tuple(entries),
            joins=self.joins,
            repeats=self.repeats,
        )

    file, add, change, without = map(_of_draft, ("file", "add", "change", "without"))
    with_header, upto = map(_of_draft, ("with_header", "upto"))

    def _rest(self, branches: list) -> bytes:
        """Return the content of the chunk REST: the host's mesh, given bytes, or coded points."""
        if self.mesh is not None:
            return host_rest_chunk(self.mesh, self.origin)
        if self.rest is not None:
            return self.rest
        fields = {"origin": self.origin, "step": self.step, "rest_type": int(self.is_float64)}
        is_refined = any(kind == rules.REFINED_REST for kind, *_ in self.scripts)
        if self.points is None or is_refined:
            script = Chance(len(branches), large=4, begin=[0]) if self.points is None else []
            return rest_chunk(write(rules.decode_rest, script, branches, self.step), **fields)
        numbers = [x for point in self.points for x in point]
        return rest_chunk(write(rules.decode_exact_rest, numbers, branches, self.is_float64), exact=1, **fields)

    def _decoded_rest(self, branches: list, chunk: bytes, place_of: list):
        """Return the rest pose that a decoder gets from the chunk REST. Its `rows` is None if the rest pose is exact or
        the host's mesh.
        """
        origin, body, self.connectivity = struct.unpack_from("<3f", chunk, 1), chunk[17:], None
        if self.faces is not None and chunk[0] & REST_CONNECTED:
            self.connectivity = mesh_of(self.faces, place_of, self.places)
        if self.mesh is None and not chunk[0] & REST_EXACT:
            return rules.decode_rest(body, branches, rules.f32(chunk, 13), None, self.connectivity)
        if self.mesh is not None:
            places = list(range(len(place_of))) if self.places is None else self.places
            points = (self.mesh[[places.index(place) for place in place_of]] + np.float32(0)).tolist()
        else:
            points = rules.decode_exact_rest(body, branches, bool(chunk[0] & REST_FLOAT64), self.connectivity)
        return rules.Record(rest=[[x[k] - origin[k] for k in range(3)] for x in points], rows=None)

    def _shapes(self, level: int) -> bytes:
        """Return SHAPES by its script; its values are used by the streams of STEMS."""
        return self._write(rules.decode_shapes, (rules.SHAPES, level, 0), self.plan, self.shapes[0], level)

    def _layer(self, branches: list, q: int, rests: list) -> list[Entry]:
        """Return the chunks of refinement number `q` that all segments share: its rest pose and shapes."""
        level, entries = self.plan.height + 1 + q, []
        if (rules.REFINED_REST, level, 0) in self.scripts:
            entries.append(self._refined_rest(branches, level, self.step / self.ratio**q, rests))
        plan = rules.refined_plan(branches, rests[-1].rest, level, q)
        shapes = rules.no_motion(plan, 1, False)
        if (rules.SHAPES, level, 0) in self.scripts:
            stream = self._write(
                rules.decode_refined_shapes, (rules.SHAPES, level, 0), plan, shapes, self.shapes[-1], self.shift
            )
            entries.append(Entry(rules.SHAPES, bytes([self.shift]) + stream, level))
        self.plans.append(plan)
        self.shapes.append(shapes)
        return entries

    def _refined_rest(self, branches: list, level: int, step: float, rests: list) -> Entry:
        """Return the rest pose of a level, which is added to those before."""
        arguments = branches, step, rests[-1], self.connectivity
        stream = self._write(rules.decode_rest, (rules.REFINED_REST, level, 0), *arguments)
        rests.append(rules.decode_rest(stream, *arguments))
        return Entry(rules.REFINED_REST, refined_rest_chunk(stream, step), level)

    def _segment(self, s: int, frames: int, periodic: bool) -> list[Entry]:
        """Return the motion chunks of segment number `s`, which has `frames` frames."""
        motion = _no_motion(self.plan, frames, periodic, self.shapes[0])
        entries, last = [], self.plan.height + 1
        for level in range(last + 1):
            if rules.has_stems(self.plan, level):
                head = self._head(level, s, motion)
                stream = self._write(rules.decode_stems, (rules.STEMS, level, s), self.plan, motion, level)
                entries.append(Entry(rules.STEMS, head + stream, level, s))
            scripted = self.predicted is None or (rules.AFFINES, level, s) in self.scripts
            if rules.has_affines(self.plan, level, level) and scripted:
                plan = self.level_0 if level == 0 else self.plan
                stream = self._write(rules.decode_affines, (rules.AFFINES, level, s), plan, motion, level)
                entries.append(Entry(rules.AFFINES, stream, level, s))
        if self.predicted is not None:
            stream = self._write(self._predict, (rules.PREDICTED, 1, s), frames)
            entries.append(Entry(rules.PREDICTED, self.predicted + stream, 1, s))
        if self.trees is not None:
            stream = self._write(self._predict_trees, (rules.PREDICTED, last + self.layers - 1, s), frames)
            entries.append(Entry(rules.PREDICTED, self.trees + stream, last + self.layers - 1, s))
        if self.layers > 1:
            entries += self._refinements(s, motion, periodic)
        for level in range(last, last + self.layers):
            place = (rules.CORRECTIONS, level, s)
            if place in self.scripts or place[:2] in self.scripts:
                stream = self._write(rules.decode_corrections, place, sum(stem.count for stem in self.stems), frames)
                entries.append(Entry(rules.CORRECTIONS, struct.pack("<f", 0.5) + stream, *place[1:]))
        return entries

    def _predict(self, stream: bytes, frames: int) -> None:
        chunk, rest = self.predicted + stream, self.plan.rest
        rules.decode_predicted(chunk, self.branches, rest, self.origin, frames, self.is_float64)

    def _predict_trees(self, stream: bytes, frames: int) -> None:
        trees, rest = rules.predicted_trees(self.branches), self.plans[-1].rest
        rules.decode_trees(self.trees + stream, trees, rest, self.origin, frames, self.is_float64)

    def _head(self, level: int, s: int, motion) -> bytes:
        """Return the head of STEMS; the motion gets its steps and waves."""
        head = self.heads.get((level, s), self.heads.get(level, self.default_head))
        rules.read_stems_head(head, motion, level)
        return head

    def _refinements(self, s: int, motion, periodic: bool) -> list[Entry]:
        """Return the chunks STEMS of the layers after the first, in segment `s`, given the motion of the first
        layer.
        """
        placed, _, kept = rules.pose(self.plan, motion, self.plan.height + 1)
        entries, layers = [], [rules.Record(plan=self.plan, motion=motion, placed=placed, kept=kept)]

        def decode(stream: bytes, *arguments) -> None:
            layers.append(rules.decode_refined_stems(stream, *arguments))

        for q in range(1, self.layers):
            level, before = self.plan.height + 1 + q, layers[-1]
            motion = _no_motion(self.plans[q], motion.frames, periodic, self.shapes[q])
            motion.streams.update(before.motion.streams)
            head = struct.pack("<H", self.ratio) + self._head(level, s, motion)
            arguments = self.plans[q], motion, before, level, self.ratio
            entries.append(
                Entry(rules.STEMS, head + self._write(decode, (rules.STEMS, level, s), *arguments), level, s)
            )
        return entries

    def _write(self, function: Callable, place: tuple, *arguments) -> bytes:
        script = self.scripts.get(place, self.scripts.get(place[:2], []))
        script = Chance(script) if isinstance(script, int) else script() if callable(script) else script
        return write(function, script, *arguments)
