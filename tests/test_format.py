"""FORMAT.md against the code: its tables, its dumps, and its pseudo-code, which is run.

The Python blocks of FORMAT.md form a decoder. Executed as they stand, they have to give every bit that the
package gives, on files that use all features; what they make of a single stream, the package makes of a file
around it. Claims about limits, names and offsets are read from the document's tables.
"""

from __future__ import annotations

import ast
import io
import re
import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import test_document
from files import Parts, exact_rest_chunk, opened, roots, still_file
from test_document import assert_same_bits

import athcodec
from athcodec import errors
from athcodec._native import BRANCH, crc32c
from athcodec.decoding import container
from athcodec.encoding.streams import streams, writing
from spec.document import TAKEN_FOR_GRANTED, TEXT, File, code_of, rules, run, section, table
from spec.dump import lines as dump_lines
from spec.scripted import Script, write

FORMAT = Path(__file__).resolve().parents[1] / "FORMAT.md"
VALID = FORMAT.parent / "spec" / "vectors" / "valid"


# Vectors in one segment and one layer: loose stems, sheets, subtrees that are whole, shapes, corrections, binary64.
FEW = ["shapes-of-sheets-in-binary64", "clip-named", "loose"]
MORE = ["whole", "sheet", "corrections-wide", "rotations", "long-stem", "two-roots", "tubes"]
VECTORS = [*enumerate(FEW), *(pytest.param(3 + i, name, marks=pytest.mark.slow) for i, name in enumerate(MORE))]


def parts_of(name: str) -> Parts:
    return Parts.of((VALID / f"{name}.ath").read_bytes())


def branches_of(seed: int) -> np.ndarray:
    with opened((VALID / f"{FEW[seed % len(FEW)]}.ath").read_bytes()) as decoder:
        return decoder.file.tables.branches


def dump(text: str) -> bytes:
    """The bytes of an annotated hex dump; checks that its offsets leave no hole."""
    data = b""
    for offset, line in re.findall(r"^ {4}([0-9a-f]{8})  ((?:[0-9a-f]{2} ?)+)", text, re.M):
        assert int(offset, 16) == len(data), f"dump: line {offset}"
        data += bytes.fromhex(line)
    return data


@pytest.fixture(scope="module")
def spec() -> ModuleType:
    """The decoder that FORMAT.md's Python blocks make."""
    return rules


# ---- tables and dumps ----


@pytest.mark.parametrize(
    "title, form",
    [
        ("Header", container._HEADER),
        *((title, writing._STEP) for title in ("CORRECTIONS", "REFINED_REST", "Predicted motion")),
    ],
)
def test_field_tables_have_the_offsets_and_types_of_the_code(title, form):
    names = {"s": "bytes", "B": "u8", "H": "u16", "I": "u32", "Q": "u64", "f": "f32", "d": "f64"}
    expected, at = [], 0
    for code in re.findall(r"\d*[a-zA-Z]", form.format.lstrip("<")):
        expected.append((at, struct.calcsize("<" + code), names[code[-1]]))
        at += struct.calcsize("<" + code)
    rows = table(title, "Offset")
    rows = [row for row in rows if row["Size"] != "rest"]
    assert [(int(row["Offset"]), int(row["Size"]), row["Type"]) for row in rows] == expected


def test_magic_and_version_are_those_of_the_code(spec):
    rows = {row["Field"]: row["Range"] for row in table("Header", "Offset")}
    version = rows["Major_Version"], rows["Minor_Version"].partition(",")[0]
    assert bytes.fromhex(rows["Magic"]) == spec.MAGIC == container.MAGIC
    assert tuple(map(int, version)) == spec.VERSION


def test_chunk_kinds_are_those_of_the_code():
    rows = table("Chunk table", "Name")
    assert {int(row["Kind"], 16): row["Name"] for row in rows} == container.KIND_NAMES
    for row in rows:
        kind = int(row["Kind"], 16)
        assert kind & ~container.OPTIONAL == int(row["Kind_Id"])
        assert (row["Required"] == "no") == bool(kind & container.OPTIONAL)


def test_every_error_that_the_code_names_exists():
    names = {row["Name"] for row in table("Errors", "Code")}
    code = "".join(re.findall(r"^```python\n(.*?)^```", TEXT, re.M | re.S))
    used = set(re.findall(r'require\([^\n]*"([A-Z_]+)"\)$', code, re.M))
    assert used <= names and {"TRUNCATED", "BAD_HEADER", "BAD_CHUNK_TABLE", "LIMIT_EXCEEDED"} <= used


@pytest.mark.parametrize("name", ["errors-announced", "errors-by-chance", "everything", "clips-three"])
def test_the_error_table_of_a_vector_is_the_same_to_the_document_and_the_code(spec, name):
    """No item of the vectors asks for it."""
    data = (VALID / f"{name}.ath").read_bytes()
    with opened(data) as decoder:
        assert np.array(spec.read_front(data)[0].errors).tobytes() == decoder.file.errors.tobytes()


def test_checksum_has_the_check_value_of_the_document(spec):
    text = " ".join(section("Checksums").split())
    value = int(re.search(r'bytes "123456789" is (0x[0-9A-F]{8})', text)[1], 16)
    assert crc32c(b"123456789") == spec.crc32c(b"123456789") == value == 0xE3069283


def test_the_dump_is_that_of_a_vector_as_the_command_prints_it(spec):
    data, text = (VALID / "traced.ath").read_bytes(), section("A file in bytes")
    assert dump(text) == data
    assert "\n".join(dump_lines(data)) in text
    assert_same_bits(data)
    with athcodec.open(io.BytesIO(data), strict=True) as decoder:
        rows = {row["Quantity"]: row["Numbers"] for row in table("A level traced", "Quantity")}
        assert decoder.positions()[0, 2].tolist() == [float(x) for x in rows["as put out"].split(", ")]


def test_a_file_that_the_dump_has_no_words_for_is_refused():
    with pytest.raises(ValueError, match="Branch_Count 4.*describes any file"):
        list(dump_lines((VALID / "two-roots.ath").read_bytes()))


EXAMPLE = bytes.fromhex("ffd134")  # the stream of "Worked example"
# What the table "A way for a first decoder" says works after a step, of a file that it names, by a decoder.
WORKS: dict[int, Callable[[ModuleType, bytes], object]] = {
    2: lambda spec, data: spec.decode_temporal(data, 1, 3),
    3: lambda spec, data: spec.read_front(data),
    5: lambda spec, data: spec.open_file(data, True),
    6: lambda spec, data: spec.rest_pose(spec.open_file(data), 0),
    7: lambda spec, data: (straight_plan(spec), spec.waves_over_time(4, False), spec.node_waves_over_time(4, False)),
    8: lambda spec, data: (traced(spec), spec.decode(data, spec.read_front(data)[0].level_count - 1)),
}


def test_no_step_of_the_way_for_a_first_decoder_needs_a_function_or_a_constant_of_a_later_one():
    """The code is run anew, so that no answer is kept and each function that is needed is called."""
    spec, definitions = run(), definitions_of_the_code()
    rows = {int(row["Step"]): row for row in table("A way for a first decoder", "Step")}
    assert rows.keys() >= WORKS.keys()
    known: set[str] = set()
    for step, row in sorted(rows.items()):
        known |= sections_of(row)
        vectors = re.findall(r"`(\S+)\.ath`", row["What works then"])
        assert bool(vectors) == (step in {3, 5, 6, 8})
        with calls_noted(spec, definitions) as called:
            for data in [(VALID / f"{name}.ath").read_bytes() for name in vectors] or [EXAMPLE]:
                WORKS.get(step, lambda *_: None)(spec, data)
        needed = with_constants(definitions, called)
        assert bool(needed) == (step in WORKS)
        assert {name for name in needed if definitions[name].section not in known} == set(), f"step {step}"


FEATURES = table("Features", "A file uses")


@pytest.mark.parametrize("at", range(len(FEATURES)), ids=[row["Vector"].strip("`") for row in FEATURES])
def test_a_feature_needs_the_first_half_of_the_document_its_sections_and_those_of_the_rows_above(at):
    spec, definitions, row = run(), definitions_of_the_code(), FEATURES[at]
    known = set().union(*map(sections_of, [*table("A way for a first decoder", "Step"), *FEATURES[:at]]))
    path = VALID / f"{row['Vector'].strip('`')}.ath"
    mesh = path.with_suffix(".mesh")
    with calls_noted(spec, definitions) as called:
        file = File(path.read_bytes(), True, mesh.read_bytes() if mesh.exists() else None, spec)
        levels = [] if row["A file uses"] == "static data" else [*map(str, range(file.header.level_count)), "rest"]
        for item in levels or ["static"]:
            file.answer(item)
    stands = {definitions[name].section for name in with_constants(definitions, called)}
    assert stands - known <= sections_of(row) and stands & sections_of(row) - known


def sections_of(row: dict[str, str]) -> set[str]:
    return set(re.findall(r"\[([^\]]+)\]\(#", row["Sections"]))


@dataclass(frozen=True)
class Definition:
    """A function, class or constant of the code: where it stands, and which constants it names."""

    section: str
    constants: frozenset[str]


def with_constants(definitions: dict[str, Definition], names: set[str]) -> set[str]:
    return names.union(*(definitions[name].constants for name in names))


@cache
def definitions_of_the_code() -> dict[str, Definition]:
    headings = [(i, line.lstrip("# ")) for i, line in enumerate(text_without_code().splitlines(), 1) if line[:1] == "#"]
    nodes = {}
    for node in code_of(TEXT).body:
        names = [node.name] if hasattr(node, "name") else [name.id for name in ast.walk(node) if is_target(name)]
        nodes |= dict.fromkeys(names, node)
    constants = {name for name, node in nodes.items() if not hasattr(node, "name")}
    return {
        name: Definition(
            [title for at, title in headings if at <= node.lineno][-1],
            frozenset(constants & {part.id for part in ast.walk(node) if isinstance(part, ast.Name)} - {name}),
        )
        for name, node in nodes.items()
    }


def is_target(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)


@contextmanager
def calls_noted(spec: ModuleType, names: Iterable[str]) -> Iterator[set[str]]:
    """Put the names of functions and classes that are called into the set, each at its first call."""
    called: set[str] = set()
    originals = {name: getattr(spec, name) for name in names if callable(getattr(spec, name))}

    def noting(name: str) -> Callable:
        def first_call(*arguments, **fields):
            called.add(name)
            setattr(spec, name, originals[name])
            return originals[name](*arguments, **fields)

        return first_call

    vars(spec).update({name: noting(name) for name in originals})
    try:
        yield called
    finally:
        vars(spec).update(originals)


def test_no_variable_of_the_code_has_the_name_of_a_function():
    tree = code_of(TEXT)
    functions = {node.name for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    functions |= TAKEN_FOR_GRANTED.keys()
    variables = {node.id for node in ast.walk(tree) if is_target(node)}
    variables |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    assert len(functions) > 200 and len(variables) > 200 and functions & variables == set()


def test_every_section_stands_on_the_way_for_a_first_decoder_or_beside_the_feature_that_needs_it():
    named = set().union(*map(sections_of, table("A way for a first decoder", "Step") + FEATURES))
    with_code = set()
    for title, text in re.findall(r"^#+ (.+)\n((?:(?!#+ ).*\n)*?(?=^#+ |\Z))", text_without_code(), re.M):
        with_code |= {title} if "\nCODE\n" in text else set()
    assert len(with_code) > 30 and with_code - named == set()


def text_without_code() -> str:
    """FORMAT.md with as many lines, those of code replaced."""
    return re.sub(r"^```python\n.*?^```", lambda code: "CODE\n" * code[0].count("\n") + "CODE", TEXT, flags=re.M | re.S)


# ---- the pseudo-code ----


def test_worked_example_decodes_step_by_step(spec):
    text = section("Worked example")
    stream = bytes.fromhex(re.search(r"^ {4}([0-9a-f ]+)$", text, re.M).group(1))
    values = [int(n) for n in re.search(r"decodes\sto ([-0-9, ]+)\.", text).group(1).split(",")]
    steps: list[dict[str, str]] = []

    class Tracing(spec.RangeDecoder):
        probability = "raw"

        def bit(self, context):
            self.probability = str(context.one)
            return super().bit(context)

        def narrow(self, bound):
            numbers = {"range": self.range, "bound": bound, "code": self.code}
            steps.append({"Probability": self.probability} | {name: f"{x:016x}" for name, x in numbers.items()})
            self.probability = "raw"
            steps[-1]["Bit"] = str(super().narrow(bound))
            return int(steps[-1]["Bit"])

    decode = type(spec.decode_temporal)(
        spec.decode_temporal.__code__, spec.decode_temporal.__globals__ | {"RangeDecoder": Tracing}
    )
    assert decode(stream, 1, len(values)) == [values]
    assert steps == table("Worked example", "Probability")
    assert streams.encode_temporal(np.array([values], np.int32)) == stream


def straight_plan(spec) -> object:
    """The plan of the stem of "A level traced"."""
    branch = spec.Record(first=0, count=3, parent=-1, attach=-1, depth=0, subtree=1, flags=0, rigid=0, ring=0)
    return spec.make_plan([branch], [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]])


def traced(spec) -> dict[str, list]:
    """What "A level traced" tells: each quantity by the document's own functions."""
    plan = straight_plan(spec)
    (piece,) = plan.pieces
    motion = spec.no_motion(plan, 4, False)
    stream = spec.Record(step=0.25, rotation_step_factor=0.0, waves=motion.waves, root=-1)
    motion.streams = {0: stream, 1: stream}
    zeros = [0, 0, 0, 0]
    motion.coefficients = [[[3, -1, 0, 0], zeros, zeros], [zeros] * 3, [zeros] * 3]
    step = spec.row_step(motion, 0, piece, 0)
    track = spec.over_time(motion.coefficients[0], step, motion.waves, 4)
    placed, _, _ = spec.pose(plan, motion, 1)
    return {
        "gaps": spec.piece_gaps(plan, piece),
        "tip_weight": [spec.tip_weight(plan, piece)],
        "mode 0": piece.basis[0],
        "wave 0": motion.waves[0],
        "wave 1": motion.waves[1],
        "row, x": motion.coefficients[0][0],
        "row_step": [step],
        "track, x": track[0],
        "vertex 2 in frame 0": placed[2][0],
        "as put out": spec.output(placed, [0.0, 0.0, 0.0], 0)[2][0],
    }


def test_trace_of_a_level_is_what_the_code_computes(spec):
    rows = {
        row["Quantity"]: [float(x) for x in row["Numbers"].split(", ")] for row in table("A level traced", "Quantity")
    }
    computed = traced(spec)
    assert rows.keys() == computed.keys()
    for name, numbers in computed.items():
        assert rows[name] == [float(x) for x in numbers], name


@pytest.mark.parametrize("seed", range(20))
def test_random_decisions_mean_the_same_to_the_document_and_the_code(spec, seed):
    """Among them loose roots, whole parts of whole subtrees, wrong permutations, and valid streams."""
    random = np.random.default_rng(seed)
    branches, vertices = int(random.integers(1, 4)), int(random.integers(3, 7))
    fields = ["parent", "count", "attach", "flags", "lag", "first", "depth", "subtree", "rigid", "detail", "ring"]

    def by_document(stream):
        rows, *sources = spec.decode_hierarchy(stream, branches, vertices)
        return [[getattr(row, name) for name in fields] for row in rows], *sources

    for _ in range(20):
        stream = random_stream(spec, random, "decode_hierarchy", branches, vertices)
        document = outcome(spec, by_document, stream)
        like = roots(vertices + 1 - branches, *[1] * (branches - 1))
        if document != "invalid":
            for name, column in zip(fields, zip(*document[0])):
                like[name] = column
        assert document == outcome(spec, lambda stream: read_hierarchy(stream, like, fields), stream)


# ---- single streams in the least file around them ----


@contextmanager
def played(data: bytes, kind: int) -> Iterator[athcodec.Decoder]:
    """A file that plays to its end, or raises BadChunk for the one chunk that a test is about."""
    try:
        with opened(data, strict=True) as decoder:
            decoder.file.check()
            yield decoder
    except errors.BadChunk as error:
        assert str(error).startswith(f"chunk {container.KIND_NAMES[kind]} ")
        raise


def read_hierarchy(stream: bytes, like: np.ndarray, fields: list[str]) -> tuple:
    """Fields of the branches, and both permutations, in a file that else fits branches `like` those."""
    with played(still_file(branches=like, hierarchy=stream), container.HIERARCHY) as decoder:
        numbers = decoder.file.hierarchy
        assert not decoder.positions().any()
        rows = [[int(row[name]) for name in fields] for row in decoder.file.tables.branches]
        return rows, numbers.branch_source.tolist(), numbers.vertex_source.tolist()


def read_exact_rest(stream: bytes, branches: np.ndarray, dtype: type) -> np.ndarray:
    """From a file that is opened and not played: what its motion has to hold depends on the rest pose."""
    data = still_file(branches=branches, rest=exact_rest_chunk(stream, dtype))
    try:
        with opened(data, strict=True) as decoder:
            return decoder.file.rest
    except errors.BadChunk as error:
        assert str(error).startswith("chunk REST ")
        raise


def read_times(stream: bytes, frame_count: int) -> np.ndarray:
    with played(still_file(frame_count, time=writing.pack_time(stream)), container.TIME) as decoder:
        return decoder.time


# ---- decisions made by chance ----


def assert_same_on_levels(spec: ModuleType, data: bytes, levels: Iterable[int]) -> list[object]:
    """The positions that they have, or that they are invalid; returns what the document makes of them."""
    documents = [outcome(spec, lambda data, level=level: spec.decode(data, level), data) for level in levels]
    for level, document in zip(levels, documents):
        assert_same_numbers(
            document, outcome(spec, lambda data, level=level: opened(data).positions(level=level), data)
        )
    return documents


HEADS = {container.STEMS: 8, container.AFFINES: 0, container.CORRECTIONS: 4, container.SHAPES: 0}


@pytest.mark.parametrize("seed, name", VECTORS)
def test_random_decisions_about_motion_mean_the_same_to_the_document_and_the_code(spec, seed, name):
    parts, random = parts_of(name), np.random.default_rng(seed)
    for i, (chunk, payload) in enumerate(parts.chunks):
        if chunk.kind not in HEADS:
            continue
        head = HEADS[chunk.kind]
        stream = random_stream(spec, random, *motion_function(spec, parts, chunk))
        data = parts.with_chunks([*parts.chunks[:i], (chunk, payload[:head] + stream), *parts.chunks[i + 1 :]])
        assert_same_on_levels(spec, data, range(chunk.level, parts.header.level_count))


def motion_function(spec: ModuleType, parts: Parts, chunk: container.Chunk) -> tuple:
    """The name of the document's function that reads a chunk's stream, and its other arguments."""
    frames = parts.header.frame_count
    if chunk.kind == container.CORRECTIONS:
        return "decode_corrections", parts.header.vertex_count, frames
    file = spec.open_file(parts.file())
    plan = spec.make_plan(file.branches, file.rest.rest)
    if chunk.kind == container.SHAPES:
        motion = spec.no_motion(plan, 1, False)
        for level in range(chunk.level):
            if (container.SHAPES, level, 0) in file.chunks:
                spec.decode_shapes(spec.content(file.chunks, container.SHAPES, level), plan, motion, level)
        return "decode_shapes", plan, motion, chunk.level
    motion = spec.decode_motion(file, plan, 0, chunk.level)
    name = "decode_stems" if chunk.kind == container.STEMS else "decode_affines"
    return name, plan, motion, chunk.level


@pytest.mark.parametrize("refines_rest", [False, True])
@pytest.mark.parametrize("seed, name", VECTORS)
def test_random_decisions_about_refinements_mean_the_same_to_the_document_and_the_code(spec, seed, name, refines_rest):
    """A layer behind that of the vector: its rest pose, shapes and stems."""
    parts, random = parts_of(name), np.random.default_rng(seed)
    level, ratio, shift = parts.header.level_count, int(random.choice([1, 3, 4, 16, 65535])), int(random.integers(16))
    file = spec.open_file(parts.file())
    branches, rest = file.branches, file.rest
    plan = spec.make_plan(branches, rest.rest)
    motion = spec.decode_motion(file, plan, 0, level - 1)
    before = spec.Record(plan=plan, motion=motion, placed=spec.pose(plan, motion, level - 1)[0])
    added, step = [], 2.0**-9
    if refines_rest:
        arguments = branches, step, rest, None
        stream = random_stream(spec, random, "decode_rest", *arguments)
        added.append((container.REFINED_REST, writing.pack_refined_rest(step, stream)))
        made = outcome(spec, lambda stream: spec.decode_rest(stream, *arguments), stream)
        rest = rest if made == "invalid" else made
    motion = spec.no_motion(plan, parts.header.frame_count, False)
    refined = spec.refined_plan(branches, rest.rest, level, 1)
    if seed % 3:
        stream = random_stream(spec, random, "decode_refined_shapes", refined, motion, before.motion, shift)
        added.append((container.SHAPES, writing.pack_refined_shapes(shift, stream)))
    head = writing.StemsHead(0.02 / min(ratio, 16), container.ROTATION_FACTORS[seed % 3])
    spec.read_stems_head(writing.pack_stems(head, b""), motion, level)
    stream = random_stream(spec, random, "decode_refined_stems", refined, motion, before, level, ratio)
    added.append((container.STEMS, writing.pack_refined_stems(ratio, head, stream)))
    header = replace(parts.header, level_count=level + 1, full_level_count=level + 1, layer_count=2, joins=None)
    new = [(container.Chunk(kind, level, 0, 0, 0, 0), payload) for kind, payload in sorted(added)]
    data = Parts(header, np.zeros((level + 1, 1, 3)), parts.chunks + new).file()
    assert_same_on_levels(spec, data, [level - 1, level])


def assert_same_numbers(document: object, code: object) -> None:
    """The same bits, but for those of a NaN, or both "invalid"."""
    if isinstance(document, str) or isinstance(code, str):
        assert isinstance(document, str) and isinstance(code, str)
    else:
        test_document.assert_same_numbers(np.array(document, code.dtype), code)


class Coin(Script):
    """Decisions made by chance."""

    def __init__(self, random: np.random.Generator):
        super().__init__()
        self.random, self.chance = random, random.uniform(0.15, 0.85)

    def answer(self, asked: str, most: int) -> int:
        return int(self.random.random() < self.chance)


def random_stream(spec: ModuleType, random: np.random.Generator, name: str, *arguments: object) -> bytes:
    """What a function of the document reads as decisions made by chance, up to the first invalid one."""
    return write(getattr(spec, name), Coin(random), *arguments, decisions=True)


# ---- exact numbers ----

NUMBERS = {np.float32: 32, np.float64: 64}
INFINITY = {32: 0xFF << 23, 64: 0x7FF << 52}


def awkward_numbers(random: np.random.Generator, count: int, dtype: type) -> np.ndarray:
    """Finite numbers of all magnitudes and both signs, zeros among them, and some close to the one before."""
    limits = np.finfo(dtype)
    pool = np.array(
        [0, -0.0, 1, -1, limits.max, limits.min, limits.tiny, -limits.tiny, limits.smallest_subnormal], dtype
    )
    bits = random.integers(0, 256, count * limits.bits // 8, np.uint8).view(dtype)
    numbers = np.where(random.random(count) < 0.3, random.choice(pool, count), bits)
    near = np.cumsum(random.normal(size=count)).astype(dtype)
    return np.where(np.isfinite(numbers) & (random.random(count) < 0.5), numbers, near)


def stems(spec: ModuleType, branches: np.ndarray) -> list:
    return [spec.Record(**{name: int(row[name]) for name in BRANCH.names}) for row in branches]


@pytest.mark.parametrize("dtype", NUMBERS)
@pytest.mark.parametrize("seed", range(5))
def test_exact_rest_poses_come_back_bit_for_bit_by_document_and_code(spec, seed, dtype):
    branches = branches_of(seed)
    pose = awkward_numbers(np.random.default_rng(seed), 3 * branches["count"].sum(), dtype).reshape(-1, 3)
    stream = streams.encode_exact_rest(branches, pose)
    read = read_exact_rest(stream, branches, dtype)
    assert read.dtype == dtype and read.tobytes() == pose.tobytes()
    got = spec.decode_exact_rest(stream, stems(spec, branches), dtype is np.float64)
    assert np.array(got, dtype).tobytes() == pose.tobytes()


@pytest.mark.parametrize("seed", range(5))
def test_times_come_back_bit_for_bit_by_document_and_code(spec, seed):
    random = np.random.default_rng(seed)
    numbers = awkward_numbers(random, 50, np.float64)
    stream = streams.encode_times(numbers)
    assert np.array(spec.decode_times(stream, 50)).tobytes() == numbers.tobytes()
    assert outcome(spec, lambda data: read_times(data, 50), stream) == "invalid", "they do not ascend"
    for times in np.unique(numbers), np.logspace(-300, 300, 40 + seed):
        stream = streams.encode_times(times)
        assert read_times(stream, len(times)).tobytes() == times.tobytes()
        assert np.array(spec.decode_times(stream, len(times))).tobytes() == times.tobytes()


@pytest.mark.parametrize("seed", range(20))
def test_random_decisions_about_exact_numbers_mean_the_same_to_the_document_and_the_code(spec, seed):
    """Times of a few frames now and then ascend, those of 40 never do."""
    random = np.random.default_rng(seed)
    branches = branches_of(seed)
    rows = stems(spec, branches)
    for count in (1, 1, 2, 2, 2, 3, 3, 3, 40):
        assert_same_outcome(
            spec,
            random_stream(spec, random, "decode_times", count),
            lambda stream: np.array(spec.frame_times(writing.pack_time(stream), [spec.Record(frames=count)])),
            lambda stream: read_times(stream, count),
        )
    for dtype, n in NUMBERS.items():
        assert_same_outcome(
            spec,
            random_stream(spec, random, "decode_exact_rest", rows, n == 64, None),
            lambda stream: np.array(spec.decode_exact_rest(stream, rows, n == 64), dtype),
            lambda stream: read_exact_rest(stream, branches, dtype),
        )


def assert_same_outcome(spec: ModuleType, stream: bytes, *decoders: Callable) -> None:
    document, code = (outcome(spec, lambda data: decode(data).tobytes(), stream) for decode in decoders)
    assert document == code


def one_vertex(spec: ModuleType) -> list:
    return [spec.Record(first=0, count=1, attach=-1, lag=1)]


@pytest.mark.parametrize("dtype, n", NUMBERS.items())
@pytest.mark.parametrize(
    "beyond, negative, valid",
    [(-1, False, True), (0, False, False), (1, False, False), (0, True, True), (1, True, False), (2, True, False)],
)
def test_numbers_that_are_not_finite_are_refused_alike(spec, dtype, n, beyond, negative, valid):
    """Downwards there is one number more: -0.0."""
    stream = write(spec.decode_exact_rest, [(INFINITY[n] + beyond, negative)], one_vertex(spec), n == 64, None)
    number = float(np.finfo(dtype).min if negative else np.finfo(dtype).max)
    for decode in (
        lambda data: spec.decode_exact_rest(data, one_vertex(spec), n == 64),
        lambda data: read_exact_rest(data, roots(1), dtype).tolist(),
    ):
        assert outcome(spec, decode, stream) == ([[number, 0.0, 0.0]] if valid else "invalid")


def outcome(spec: ModuleType, decode, stream: bytes) -> object:
    try:
        return decode(stream)
    except (spec.Invalid, errors.BadChunk):
        return "invalid"
