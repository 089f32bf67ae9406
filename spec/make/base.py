"""Vectors and how they are declared, files that others are derived from, and the names that all modules use."""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from spec.document import KIND_NAMES, KINDS, rules
from spec.scripted import *  # noqa: F403

globals().update(KINDS)  # STEMS, AFFINES and so on
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
INFINITY, NAN = math.inf, math.nan
LOWEST, HIGHEST = -sys.float_info.max, sys.float_info.max
TINY = 5e-324
FLOAT_MAX, FLOAT_TINY = float(np.finfo(np.float32).max), float(np.finfo(np.float32).smallest_subnormal)


@dataclass(frozen=True)
class Vector:
    """A file, and its error of an item (conformance.py); none if it is valid."""

    name: str
    reason: str
    make: Callable[[], bytes]
    error: str = ""
    item: str = ""
    scripted: bool = True
    mesh: bytes | None = None  # A mesh of the host, which is given to the decoder.

    @property
    def path(self) -> str:
        return f"{'invalid' if self.error else 'valid'}/{self.name}.ath"


VECTORS: list[Vector] = []
MADE: dict[str, Plant | Draft | bytes | Callable] = {}  # by the name of the vector


def valid(title: str, make: Plant | Draft | bytes | Callable, *arguments, scripted=True, mesh=None, **fields) -> None:
    """Declare a valid vector by "NAME: REASON", and what makes it, which may get arguments."""
    name, reason = title.split(": ", 1)
    MADE[name] = make = partial(make, *arguments, **fields) if arguments or fields else make
    VECTORS.append(Vector(name, reason, lambda: bytes_of(make), scripted=scripted, mesh=mesh_bytes(mesh)))


def invalid(title: str, make: Draft | bytes | Callable, error="BAD_CHUNK", item: str | int = "open", mesh=None) -> None:
    """Declare an invalid vector by "NAME: REASON", or by "NAME ERROR ITEM: REASON" where these are others."""
    head, reason = title.split(": ", 1)
    name, *expected = head.split()
    expected += [error, str(item)][len(expected) :]
    VECTORS.append(Vector(name, reason, lambda: bytes_of(make), *expected, mesh=mesh_bytes(mesh)))


def mesh_bytes(mesh: np.ndarray | None) -> bytes | None:
    return None if mesh is None else mesh.tobytes()


def bytes_of(made: Plant | Draft | bytes | Callable) -> bytes:
    if callable(made):
        made = made()
    return made if isinstance(made, bytes) else made.file()


def stems_of(text: str) -> list[Stem]:
    """Return the stems that a text describes, separated by commas. A stem is its parent, its number of vertices and its
    place on the parent, and then names of flags and other fields as name=value.
    """
    stems = []
    for words in map(str.split, text.split(",")):
        named = dict(word.split("=") for word in words if "=" in word)
        flags = sum(getattr(rules, word) for word in words if word.isupper())
        numbers = [int(word) for word in words if word.lstrip("-").isdigit()]
        stems.append(Stem(*numbers, flags=flags, **{name: int(value) for name, value in named.items()}))
    return stems


def points_of(text: str) -> list[list[float]]:
    """Return points, three numbers each."""
    return np.array(text.replace(",", " ").split(), float).reshape(-1, 3).tolist()


def lone(**fields) -> Plant:
    """Return one vertex, one frame."""
    return Plant([Stem(-1, 1)], points=[[4.0, 8.0, 12.0]], **fields)


FORK = [Stem(-1, 3), Stem(0, 2, 1)]


def forked(**fields) -> Plant:
    """Return a plant of a trunk and one branch, with four frames in two segments and with every kind of motion chunk.
    `fields` replace fields of Plant.
    """
    scripts = {
        (SHAPES, 1, 0): [2, *row((3, 0, 4), (0, 1, 0)), *row((0, 0, 1)), 0],
        (STEMS, 1): 1,
        (STEMS, 2): 2,
        (AFFINES, 0): [-8, *row((5, -3, 1), (0, 2, 0))],
        (CORRECTIONS, 2): 3,
    }
    return Plant(FORK, **{"frames": 4, "segments": 2, "scripts": scripts} | fields)


def fork() -> Draft:
    return forked().draft()


def still(stems: list[Stem], **fields) -> Plant:
    """Return a plant whose rows are all empty."""
    return Plant(stems, **fields)


def moving(stems: list[Stem], seed: int, frames: int = 3, segments: int = 1, **fields) -> Plant:
    """Return a plant with random rows at all levels."""
    scripts = {}
    for level in range(33):
        scripts[STEMS, level] = 100 * seed + level
        scripts[AFFINES, level] = lambda level=level: Chance(100 * seed + level + 50, large=4)
    return Plant(stems, frames, segments, **{"scripts": scripts} | fields)


HEADS = {level: stems_head(0.01 * (level + 1), level % 3) for level in range(33)}


def chain(branches: int, count: int = 1, **last) -> list[Stem]:
    return [Stem(b - 1, count, count - 1 if b else 0) for b in range(branches - 1)] + [
        Stem(branches - 2, count, count - 1, **last)
    ]


def branches_of(stems: list[Stem]) -> list:
    count = sum(stem.count for stem in stems)
    return rules.decode_hierarchy(
        write(rules.decode_hierarchy, hierarchy_script(stems), len(stems), count), len(stems), count
    )[0]


def exact_rest(stems: list[Stem], numbers: list, is_float64: bool, **fields) -> bytes:
    stream = write(rules.decode_exact_rest, numbers, branches_of(stems), is_float64)
    return rest_chunk(stream, exact=1, rest_type=int(is_float64), **fields)


FUTURE = b"from the future"
LAYER_HEADS = {level: stems_head(0.5 / 4 ** max(level - 2, 0), level % 3) for level in range(12)}
MIXED = stems_of("-1 4, 0 3 2 SHEET, 1 2 1 LOOSE, 0 70 3, 3 5 66 SHEET LOOSE, -1 6 0 SHEET, 5 3 4 WHOLE, 6 2 1")
UNTURNED = stems_of(
    "-1 70 STILL, 0 5 66, 1 4 3 SHEET STILL, 2 3 1, 0 9 5 SHEET STILL ring=3, 4 3 7 STILL rigid=1, 5 2 1,"
    "-1 6 SHEET STILL, 7 4 4 WHOLE STILL, 8 3 2"
)


def refinements(stems: list[Stem], seed: int, large: int = 12, **fields) -> Plant:
    """Return a plant of three layers with random rows and refined rest poses. `large` bounds the size of the random
    integers, in bits; `fields` replace fields of Plant.
    """
    plant = moving(stems, seed, **{"layers": 3, "heads": LAYER_HEADS} | fields)
    plant.scripts |= {
        (STEMS, level): lambda level=level: Chance(100 * seed + level, large=large) for level in range(40)
    }
    plant.scripts |= {
        (REFINED_REST, level, 0): lambda level=level: Chance(100 * seed + level + 70, large=6) for level in range(2, 40)
    }
    return plant


def header(title: str, **fields) -> None:
    invalid(f"header-{title}", lambda: lone().with_header(**fields), "BAD_HEADER")


def joins(*widths: float) -> tuple[Join, ...]:
    """Return joins, one for each level and segment, from widths; the fraction 0.5 means that a join is sloped."""
    return tuple(Join(int(width), width % 1 > 0) for width in widths)


def flipped(data: bytes, place: int) -> bytes:
    return data[:place] + bytes([data[place] ^ 0x10]) + data[place + 1 :]


def table(title: str, make: Callable[[], Draft | bytes]) -> None:
    invalid(f"table-{title}", make, "BAD_CHUNK_TABLE")


def inserted(at: int, *entries: Entry) -> Draft:
    draft = fork()
    return replace(draft, entries=(*draft.entries[:at], *entries, *draft.entries[at:]))


def cut(short: Callable[[Draft], int], draft: Draft | None = None) -> bytes:
    """Return the first chunks of a file, of the fork if none is given, less some bytes."""
    draft = draft or fork()
    return draft.file()[: short(draft)]


def end_of(draft: Draft, kind: int, level: int = NO_LEVEL, segment: int = 0) -> int:
    behind = draft.entries[draft.index(kind, level, segment) + 1 :]
    return len(draft.file()) - sum(len(entry.content) for entry in behind)


def prelude(kind: int, title: str, content: bytes | Callable[[], bytes]) -> None:
    def make() -> Draft:
        return fork().change(kind, content=content() if callable(content) else content)

    invalid(f"{KIND_NAMES[kind].lower()}-{title}", make)


def motion(kind: int, level: int, title: str, content: bytes | Callable[[], bytes], segment: int = 0) -> None:
    def make() -> Draft:
        return fork().change(kind, level, segment, content=content() if callable(content) else content)

    invalid(f"{KIND_NAMES[kind].lower()}-{title}", make, item=level)


def forked_plan():
    plant = forked()
    plant.draft()
    return plant.plan


def placed(stems: list[Stem], points: Sequence, seed: int, frames: int = 3, **fields) -> Plant:
    """Return random rows of stems that rest at any points, in binary64."""
    rest = exact_rest(stems, np.array(points, float).ravel().tolist(), True)
    return moving(stems, seed, frames, **{"rest": rest, "heads": HEADS} | fields)


def not_refused(make: Callable[[], Draft]) -> bytes:
    """Return the file with streams that go on behind what is refused."""
    kept, rules.require = rules.require, lambda *_: None
    try:
        return make().file()
    finally:
        rules.require = kept


LONGEST_TEXT, MANY_CORNERS = 1 << 20, 1 << 25
IMPULSES = basis_stream([[8192, 0], [0, 8192]])  # a learned basis of two frames: each alone
SHORT, LARGEST = [Stem(-1, 3)], (1 << 30) - 1


def copied(rank: int, place: Sequence[int] = (0, 0, 0, 0), largest: int = 0, mirrored: int = 0) -> list:
    """Return script of a copy of the shape of that rank: differences of its scale and of the smaller numbers of its
    turn."""
    return [1, rank, mirrored, place[0], largest >> 1, largest & 1, *place[1:]]
