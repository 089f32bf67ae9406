"""Tests the vectors: changes the code of FORMAT.md in one place at a time, and looks whether a vector tells.

    python -m spec.mutants                    all changes; writes spec/mutants.md
    python -m spec.mutants --draw N --seed S  N of them, drawn at random; writes spec/mutants.md
    python -m spec.mutants --only GLOB        those whose name matches; prints what no vector tells
    python -m spec.mutants --list [GLOB]      their names

A change is one that the author of a decoder could make: another constant, operator, comparison or order of operations,
a condition that is always true or never, a limit, a call or a statement that is missing, arguments that are swapped.
It is caught if a vector has another result than expected.txt says, or the changed decoder stops with an exception that
is none of its errors, or does not stop at all. It is tried with vectors whose decoding comes by the place, the fastest
ones first, up to some seconds. What no vector can catch is in spec/mutants.toml, with reasons. The exit status is 1 if
something else is not caught, or a reason is not needed.
"""

from __future__ import annotations

import argparse
import ast
import copy
import gc
import hashlib
import math
import os
import pickle
import random
import re
import resource
import signal
import sys
import time
import tomllib
import types
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from spec import conformance, document

HERE = Path(__file__).resolve().parent
REASONS, REPORT = HERE / "mutants.toml", HERE / "mutants.md"
CACHE = HERE.parent / "build" / "mutants.pickle"
LEFT_OUT = {"decode", "Invalid", "Record"}  # Changes of these have no effect on results, or are not asked for.
LONGEST_NAME = 72
QUICK_SECONDS, MOST_SECONDS = 1.0, 6.0  # Decoding time of the vectors that a change is tried with.
LARGEST = 14_000  # bytes of a vector that is tried: those of real size take too long
SECONDS, TIMES_AS_LONG = (
    1.0,
    10.0,
)  # Processor time for a vector, and the time over the decoder's that counts as never ending.
MEMORY = 3 << 30
NOT_CHANGED = (ast.operator, ast.unaryop, ast.boolop, ast.cmpop, ast.expr_context)
MISSED = "missed"
UNEXPLAINED = "*Unexplained.* A vector that is slower than the seconds above may tell these changes, or none does."


# ---- changes -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """Where a node hangs in the tree."""

    holder: ast.AST
    name: str
    index: int | None

    def put(self, node: ast.AST) -> ast.AST:
        """Put a node there and return the one that was there."""
        there = getattr(self.holder, self.name)
        if self.index is None:
            setattr(self.holder, self.name, node)
            return there
        before, there[self.index] = there[self.index], node
        return before


@dataclass
class Mutant:
    name: str  # function: what stands there -> what it is changed to
    place: Place
    node: ast.AST
    top: int  # the statement of the module that it is in
    function: str
    line: int  # Line of FORMAT.md that has to run; 0: any may do.
    of_floats: int  # the number of the expression that has to be of floats; -1: any


def parent_of(node: ast.AST) -> ast.AST:
    return node.up  # type: ignore[attr-defined]


class Changes:
    """All changes of the document's code."""

    def __init__(self) -> None:
        self.tree = document.parse()
        self.mutants: list[Mutant] = []
        self._names: Counter[str] = Counter()
        for number, node in enumerate(ast.walk(self.tree)):
            node.number = number  # type: ignore[attr-defined]
            for child in ast.iter_child_nodes(node):
                child.up = node  # type: ignore[attr-defined]
        for top, node in enumerate(self.tree.body):
            self.top, self.line, self.function = top, 0, ""
            if isinstance(node, (ast.Assign, ast.AugAssign)):
                self.function = ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
            self._visit(node, Place(self.tree, "body", top))

    def _visit(self, node: ast.AST, place: Place) -> None:
        before = self.function, self.line
        if isinstance(node, NOT_CHANGED):
            return
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            self.function = ".".join(filter(None, [self.function, node.name]))
            self.line = node.body[0].lineno if isinstance(node, ast.FunctionDef) else 0
        elif isinstance(node, ast.stmt) and place.holder is not self.tree:
            self.line = node.lineno
        if self.function not in LEFT_OUT:
            for replacement, of_floats in replacements(node):
                self._add(node, place, replacement, of_floats)
            for name, value in ast.iter_fields(node):
                for index, child in enumerate(value) if isinstance(value, list) else [(None, value)]:
                    if isinstance(child, ast.AST):
                        self._visit(child, Place(node, name, index))
        self.function, self.line = before

    def _add(self, node: ast.AST, place: Place, replacement: ast.AST, of_floats: bool) -> None:
        shown = shown_with(node)
        old = as_line(shown)
        if shown is node:
            new_text = as_line(replacement)
        else:
            place.put(replacement)
            new_text = as_line(shown)
            place.put(node)
        if old == new_text:
            return
        name = f"{self.function}: {old} -> {new_text}"
        self._names[name] += 1
        if self._names[name] > 1:
            name += f" ({self._names[name]})"
        number = node.number if of_floats else -1  # type: ignore[attr-defined]
        self.mutants.append(Mutant(name, place, replacement, self.top, self.function, self.line, number))


def shown_with(node: ast.AST) -> ast.AST:
    """The largest expression or simple statement about a node that is short enough to name it by."""
    while not isinstance(node, ast.stmt):
        up = parent_of(node)
        if isinstance(up, (ast.FunctionDef, ast.ClassDef, ast.arguments)) or len(as_line(up)) > LONGEST_NAME:
            break
        node = up
    return node


def as_line(node: ast.AST) -> str:
    """Of a compound statement its head."""
    if isinstance(node, (ast.If, ast.While)):
        return f"{type(node).__name__.lower()} {ast.unparse(node.test)}"
    if isinstance(node, ast.For):
        return f"for {ast.unparse(node.target)} in {ast.unparse(node.iter)}"
    return " ".join(ast.unparse(node).split())


# ---- what a node can be replaced by ------------------------------------------------------------------------

CHANGED_TO = (
    "Add Sub, Sub Add, Mult Add, Div Mult, Mod FloorDiv, LShift RShift, RShift LShift, BitAnd BitOr, BitOr BitAnd, "
    "BitXor BitOr, Pow Mult, Lt LtE, LtE Lt, Gt GtE, GtE Gt, Eq NotEq, NotEq Eq, In NotIn, NotIn In, Is IsNot, IsNot Is"
)
OPERATORS = {getattr(ast, old): getattr(ast, new) for old, new in map(str.split, CHANGED_TO.split(","))}
SYMMETRIC = "times", "distance"  # functions of two arguments in any order
SWAPPED = (ast.Sub, ast.Div, ast.FloorDiv, ast.Mod, ast.LShift, ast.RShift)
NEGATED = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}


def replacements(node: ast.AST) -> Iterator[tuple[ast.AST, bool]]:
    """And whether it makes a difference for floats alone."""
    for made in BY_TYPE[type(node)](node) if type(node) in BY_TYPE else ():
        yield made if isinstance(made, tuple) else (made, False)
    if is_condition(node):
        yield ast.Constant(True), False
        if not is_required(node):
            yield ast.Constant(False), False


def is_condition(node: ast.AST) -> bool:
    up = parent_of(node)
    return (
        isinstance(up, (ast.If, ast.IfExp))
        and up.test is node
        or isinstance(up, ast.comprehension)
        and node in up.ifs
        or isinstance(up, ast.BoolOp)
        or is_required(node)
    )


def is_required(node: ast.AST) -> bool:
    up = parent_of(node)
    return isinstance(up, ast.Call) and isinstance(up.func, ast.Name) and up.func.id == "require" and up.args[0] is node


def constants(node: ast.Constant) -> Iterator[Any]:
    value = node.value
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int):
        if is_probability(node):
            yield from (ast.Constant(value + value // 16), ast.Constant(value - value // 16))
        else:
            yield from (ast.Constant(value + 1), ast.Constant(value - 1))[1 if is_allocated(node) else 0 :]
    elif isinstance(value, float):
        yield from (ast.Constant(value * 1.0625), ast.Constant(value * 0.9375)) if value else [ast.Constant(1.0)]
        if len(repr(value)) > 9:
            yield ast.Constant(document.single(value))
    elif isinstance(value, bytes) and value:
        yield ast.Constant(value[:-1] + bytes([value[-1] ^ 1]))
    elif isinstance(value, str) and value in conformance.ERRORS:
        yield ast.Constant("BAD_CHUNK" if value != "BAD_CHUNK" else "BAD_CHUNK_TABLE")


def is_probability(node: ast.AST) -> bool:
    """That a context starts with: one 1/65536 larger tells once in 65536 decisions."""
    while isinstance(node, ast.expr):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Context":
            return True
        node = parent_of(node)
    return False


def is_allocated(node: ast.AST) -> bool:
    """Whether it is how many there are of something, of which one more would not be used."""
    up = parent_of(node)
    if isinstance(up, ast.BinOp) and isinstance(up.op, ast.Mult):
        return isinstance(up.left, ast.List)
    above = parent_of(up)
    return isinstance(above, ast.comprehension) and isinstance(above.target, ast.Name) and above.target.id == "_"


def binary(node: ast.BinOp) -> Iterator[Any]:
    left, op, right = node.left, node.op, node.right
    if isinstance(getattr(left, "value", 0), (str, bytes)):
        return
    if type(op) in OPERATORS:
        yield ast.BinOp(left, OPERATORS[type(op)](), right)
    if isinstance(op, SWAPPED):
        yield ast.BinOp(right, op, left)
    if isinstance(op, ast.FloorDiv):
        yield ast.UnaryOp(ast.USub(), ast.BinOp(ast.UnaryOp(ast.USub(), left), op, right))  # rounded up
        yield ast.Call(ast.Name("int", ast.Load()), [ast.BinOp(left, ast.Div(), right)], [])  # rounded to zero
    yield from ((made, True) for made in other_roundings(node))


def other_roundings(node: ast.BinOp) -> Iterator[ast.AST]:
    """The same number, but for its rounding: another order, a product with the reciprocal."""
    left, op, right = node.left, node.op, node.right
    sums, products = (ast.Add, ast.Sub), (ast.Mult, ast.Div)
    for kind, first, inverse in ((sums, ast.Add, ast.Sub), (products, ast.Mult, ast.Div)):
        if isinstance(op, kind) and isinstance(left, ast.BinOp) and isinstance(left.op, kind):
            if kind == products and any(map(is_power_of_two, (left.left, left.right, right))):
                continue
            forward = isinstance(left.op, first)
            within = op if forward else (inverse() if isinstance(op, first) else first())
            yield ast.BinOp(left.left, left.op, ast.BinOp(left.right, within, right))
    one = ast.Constant(1.0)
    if isinstance(op, ast.Div) and not is_power_of_two(left) and not is_power_of_two(right):
        yield ast.BinOp(left, ast.Mult(), ast.BinOp(one, op, right))
    by_reciprocal = isinstance(op, ast.Mult) and isinstance(right, ast.BinOp) and isinstance(right.op, ast.Div)
    if by_reciprocal and isinstance(right.left, ast.Constant) and right.left.value == 1.0:
        yield ast.BinOp(left, ast.Div(), right.right)


def is_power_of_two(node: ast.AST) -> bool:
    """A factor that does not round."""
    value = node.value if isinstance(node, ast.Constant) else None
    return isinstance(value, (int, float)) and value != 0 and abs(math.frexp(value)[0]) == 0.5


def augmented(node: ast.AugAssign) -> Iterator[Any]:
    if type(node.op) in OPERATORS:
        yield ast.AugAssign(node.target, OPERATORS[type(node.op)](), node.value)
    yield ast.Pass()


def compared(node: ast.Compare) -> Iterator[Any]:
    if chooses_one_of_them(node):  # which are the same where they are equal
        return
    for i, op in enumerate(node.ops):
        ops = [*node.ops[:i], OPERATORS[type(op)](), *node.ops[i + 1 :]]
        yield ast.Compare(node.left, ops, node.comparators)
    if len(node.ops) > 1:
        yield ast.Compare(node.left, node.ops[:-1], node.comparators[:-1])
        yield ast.Compare(node.comparators[0], node.ops[1:], node.comparators[1:])


def chooses_one_of_them(node: ast.Compare) -> bool:
    """Whether the comparison is that of a minimum or maximum: a if a > b else b."""
    up = parent_of(node)
    if not isinstance(up, ast.IfExp) or up.test is not node or len(node.ops) > 1:
        return False
    return {ast.unparse(x) for x in (up.body, up.orelse)} == {ast.unparse(x) for x in (node.left, *node.comparators)}


def joined(node: ast.BoolOp) -> Iterator[Any]:
    yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)


def unary(node: ast.UnaryOp) -> Iterator[Any]:
    yield node.operand
    inner = node.operand
    if (
        isinstance(node.op, ast.Not)
        and isinstance(inner, ast.Compare)
        and [type(op) in NEGATED for op in inner.ops] == [True]
    ):
        yield ast.Compare(inner.left, [NEGATED[type(inner.ops[0])]()], inner.comparators), False  # differs for NaN


def called(node: ast.Call) -> Iterator[Any]:
    name, args = node.func.id if isinstance(node.func, ast.Name) else "", node.args
    if name in ("min", "max") and len(args) > 1:
        yield from args
        yield ast.Call(ast.Name("max" if name == "min" else "min", ast.Load()), args, node.keywords)
    if name in ("abs", "sorted", "clipped", "divided_up", "single"):
        yield args[0]
    if name == "range" and not isinstance(args[-1], ast.Constant):
        for change in (ast.Add(), ast.Sub()):
            yield ast.Call(node.func, [*args[:-1], ast.BinOp(args[-1], change, ast.Constant(1))], [])
    if name == "reversed":
        yield args[0]
    if name in ("require", "range", "min", "max", *SYMMETRIC):
        return
    for i in range(len(args) - 1):
        if not isinstance(args[i], ast.Starred) and not isinstance(args[i + 1], ast.Starred):
            yield ast.Call(node.func, [*args[:i], args[i + 1], args[i], *args[i + 2 :]], node.keywords)


def missing(node: ast.AST) -> Iterator[Any]:
    yield ast.Pass()


def missing_return(node: ast.Return) -> Iterator[Any]:
    """But for the last one."""
    if not isinstance(parent_of(node), ast.FunctionDef):
        yield ast.Pass()


def missing_expression(node: ast.Expr) -> Iterator[Any]:
    """A check that is missing is a condition that is always true."""
    call = node.value
    if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "require"):
        yield ast.Pass()


BY_TYPE: dict[type, Callable[[Any], Iterator[Any]]] = {
    ast.Constant: constants,
    ast.BinOp: binary,
    ast.AugAssign: augmented,
    ast.Compare: compared,
    ast.BoolOp: joined,
    ast.UnaryOp: unary,
    ast.Call: called,
    ast.Return: missing_return,
    ast.Expr: missing_expression,
    **dict.fromkeys((ast.Continue, ast.Break, ast.Assign, ast.Raise), missing),
}


# ---- the decoder, whole or changed -------------------------------------------------------------------------


class Decoder:
    """The document's code, a statement at a time, so that a change takes to compile one of them."""

    def __init__(self, tree: ast.Module):
        self.tree, self.parts = tree, [compiled(node) for node in tree.body]

    def changed(self, mutant: Mutant) -> types.ModuleType:
        there = mutant.place.put(mutant.node)
        try:
            part = compiled(self.tree.body[mutant.top])
        finally:
            mutant.place.put(there)
        return document.run([*self.parts[: mutant.top], part, *self.parts[mutant.top + 1 :]])


def compiled(node: ast.stmt) -> types.CodeType:
    """The code of a statement, by its text: to compile a tree changes it, and nodes know what is above them."""
    return document.compiled(*ast.parse(ast.unparse(node)).body)


class Marked(ast.NodeTransformer):
    """Marks the lines that run, and the expressions that are of floats."""

    def __init__(self, floats: set[int]):
        self.floats = floats

    def generic_visit(self, node: ast.AST) -> ast.AST:
        super().generic_visit(node)
        if isinstance(node, ast.expr) and node.number in self.floats:  # type: ignore[attr-defined]
            return ast.Call(ast.Name("_typed", ast.Load()), [ast.Constant(node.number), node], [])  # type: ignore
        for name in ("body", "orelse"):
            block = getattr(node, name, None)
            if isinstance(block, list) and not isinstance(node, (ast.Module, ast.ClassDef)):
                marks = [ast.parse(f"_ran[{statement.lineno}] = 1").body[0] for statement in block]
                setattr(node, name, [each for pair in zip(marks, block) for each in pair])
        return node


# ---- vectors -----------------------------------------------------------------------------------------------


@dataclass
class Known:
    """A vector, how long it takes to decode, and which lines that runs."""

    vector: conformance.Vector
    data: bytes
    seconds: float = 0.0
    lines: frozenset[int] = frozenset()

    def is_as_expected(self, rules: types.ModuleType) -> bool:
        """Opening strictly comes last: it is the same as opening but for lengths."""
        opened: dict[tuple, document.File] = {}

        def ask(data: bytes, item: str, mesh: bytes | None) -> bytes:
            way = item == "strict", mesh if conformance.needs_rest(item) else None
            try:
                if way not in opened:
                    opened[way] = document.File(data, *way, rules)
                return opened[way].answer(item)
            except rules.Invalid as error:
                raise conformance.Refused(str(error)) from None

        results = sorted(self.vector.results.items(), key=lambda result: (result[0] == "strict", result))
        mesh = self.vector.mesh
        return all(conformance.result(ask, self.data, item, mesh) == expected for item, expected in results)


@dataclass
class Cache:
    """What earlier runs have found out, while the code stays the same: vectors never change."""

    source: str
    known: dict[str, Known] = field(default_factory=dict)  # by the name of the vector
    floats: set[int] = field(default_factory=set)  # numbers of expressions
    fates: dict[str, str] = field(default_factory=dict)  # Fates of changes.
    missed: dict[str, float] = field(default_factory=dict)  # Seconds of all these vectors that a change was tried with.

    @staticmethod
    def of(tree: ast.Module) -> Cache:
        own = hashlib.sha256(ast.unparse(tree).encode()).hexdigest()
        kept = pickle.loads(CACHE.read_bytes()) if CACHE.exists() else None
        return kept if kept and kept.source == own else Cache(own)

    def keep(self) -> None:
        CACHE.parent.mkdir(exist_ok=True)
        CACHE.with_suffix(".new").write_bytes(pickle.dumps(self))
        CACHE.with_suffix(".new").replace(CACHE)


def measure(changes: Changes, cache: Cache) -> list[Known]:
    """All vectors, the fastest ones first; the cache gets those that it lacks, and expressions that are of floats."""
    missing = [vector for vector in conformance.vectors() if vector.name not in cache.known]
    missing = [vector for vector in missing if vector.path.stat().st_size <= LARGEST]
    ran: dict[int, int] = {}

    def typed(number: int, value: Any) -> Any:
        if isinstance(value, float):
            cache.floats.add(number)
        return value

    marked = Marked({mutant.of_floats for mutant in changes.mutants}).visit(copy.deepcopy(changes.tree))
    parts = [compiled(node) for node in marked.body] if missing else []
    if missing:
        cache.missed.clear()
    for vector in missing:
        ran.clear()
        rules = document.run(parts, _ran=ran, _typed=typed)
        one, start = Known(vector, vector.path.read_bytes()), time.process_time()
        if not one.is_as_expected(rules):
            raise SystemExit(f"{vector.name}: another result than expected.txt has")
        one.seconds, one.lines = time.process_time() - start, frozenset(ran)
        cache.known[vector.name] = one
    cache.keep()
    return sorted(cache.known.values(), key=lambda one: one.seconds)


# ---- running -----------------------------------------------------------------------------------------------


class Run:
    """Tries changes, each in a process of its own."""

    def __init__(self, changes: Changes, vectors: list[Known], cache: Cache, seconds: float):
        self.decoder, self.vectors, self.cache, self.seconds = Decoder(changes.tree), vectors, cache, seconds
        self.lately: dict[str, list[str]] = defaultdict(list)  # By function: vectors that caught changes, last first.

    def all(self, mutants: list[Mutant], jobs: int) -> dict[str, str]:
        """Return what becomes of each change. What is known to be caught, or missed for as long, is not tried again."""
        caught = {name for name, fate in self.cache.fates.items() if fate != MISSED}
        known = caught | {name for name, seconds in self.cache.missed.items() if seconds >= self.seconds}
        waiting = [mutant for mutant in mutants if mutant.name not in known][::-1]
        running, told = {}, time.monotonic()
        while waiting or running:
            while waiting and len(running) < jobs:
                process, answer = self._start(waiting[-1])
                running[process] = waiting.pop(), answer
            process, _ = os.wait()
            mutant, answer = running.pop(process)
            with os.fdopen(answer) as source:
                self._note(mutant, source.read() or "no end in a vector")
            if time.monotonic() - told > 20.0:
                told = time.monotonic()
                self.cache.keep()
                print(f"{len(waiting)} of {len(mutants)} left", flush=True)
        self.cache.keep()
        return {mutant.name: self.cache.fates[mutant.name] for mutant in mutants}

    def _start(self, mutant: Mutant) -> tuple[int, int]:
        """The number of a process, and what its answer can be read from."""
        answer, out = os.pipe()
        process = os.fork()
        if process > 0:
            os.close(out)
            return process, answer
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        try:
            os.write(out, self._try(mutant).encode())
        finally:
            os._exit(0)

    def _try(self, mutant: Mutant) -> str:
        at = "the module"
        try:
            rules = self.decoder.changed(mutant)
            for known in self._vectors_for(mutant):
                at = known.vector.name
                signal.setitimer(signal.ITIMER_PROF, SECONDS + TIMES_AS_LONG * known.seconds)
                if not known.is_as_expected(rules):
                    return f"result of {at}"
        except Exception:
            return f"exception in {at}"
        return MISSED

    def _vectors_for(self, mutant: Mutant) -> Iterator[Known]:
        """First those that caught others in the same function; the fastest ones first."""
        lately, left = self.lately[mutant.function][:8], self.seconds
        for known in [self.cache.known[name] for name in lately] + self.vectors:
            if mutant.line == 0 or mutant.line in known.lines:
                yield known
                left -= known.seconds
                if left < 0.0:
                    break

    def _note(self, mutant: Mutant, fate: str) -> None:
        self.cache.fates[mutant.name] = fate
        if fate == MISSED:
            self.cache.missed[mutant.name] = self.seconds
        if fate.startswith("result of "):
            name, names = fate.removeprefix("result of "), self.lately[mutant.function]
            if name in names:
                names.remove(name)
            names.insert(0, name)


# ---- reasons and report ------------------------------------------------------------------------------------


@dataclass
class Reason:
    """Why no vector can catch changes: those whose names one of the regular expressions matches."""

    why: str
    like: list[str]
    gap: bool = False  # A vector could tell the changes, but none does.

    @property
    def sentence(self) -> str:
        return ("*Gap.* " if self.gap else "") + " ".join(self.why.split())

    def matches(self, name: str) -> bool:
        return any(re.fullmatch(pattern, name) for pattern in self.like)


def reasons() -> list[Reason]:
    return [Reason(**entry) for entry in tomllib.loads(REASONS.read_text("utf-8"))["reason"]]


def faults(fates: dict[str, str], known: list[Reason], is_complete: bool = True) -> list[str]:
    """Return what is missed without a reason and, if all changes were tried, the reasons that are not needed."""
    missed = [name for name, fate in fates.items() if fate == MISSED]
    lines = [f"not caught: {name}" for name in missed if not any(reason.matches(name) for reason in known)]
    patterns = [pattern for reason in known for pattern in reason.like if is_complete]
    unneeded = [pattern for pattern in patterns if not any(re.fullmatch(pattern, name) for name in missed)]
    return lines + [f"no change that is not caught is like: {pattern}" for pattern in unneeded]


def as_markdown(drawn: dict[str, str], changes: int, how: str, vectors: int, seconds: float) -> str:
    """Return the page about the changes that were tried: `drawn` has what became of each of them."""
    fates = Counter(MISSED if fate == MISSED else fate.split()[0] for fate in drawn.values())
    known = reasons()
    survivors: dict[str, list[str]] = defaultdict(list)
    for name, fate in drawn.items():
        if fate == MISSED:
            reason = next((reason for reason in known if reason.matches(name)), None)
            survivors[reason.sentence if reason else UNEXPLAINED].append(name)
    caught = len(drawn) - fates[MISSED]
    lines = [
        "# Mistakes that the vectors find",
        "",
        f"`python -m spec.mutants {how}".rstrip() + "` wrote this page. The command makes one mistake at a time in the",
        "Python code of [FORMAT.md](../FORMAT.md), which is a complete decoder: another constant, operator, comparison",
        "or order of operations, a condition that is always true or never, a missing statement, swapped arguments. It",
        "decodes the vectors that run the changed line, the fastest first, until one tells the changed decoder from",
        f"the true one or {seconds:g} s of decoding have passed. A change survives if none of them does.",
        "",
        "| | changes |",
        "|---|---:|",
        f"| possible | {changes} |",
        f"| tried with up to {vectors} vectors | {len(drawn)} |",
        f"| told apart by another result | {fates['result']} |",
        f"| told apart by an exception that is no error of the format | {fates['exception']} |",
        f"| told apart because decoding does not end | {fates['no']} |",
        f"| **told apart in all** | **{caught} ({100 * caught / len(drawn):.1f} %)** |",
        f"| survived | {fates[MISSED]} |",
        "",
        "## Survivors",
        "",
        "`spec/mutants.toml` has the reasons. *Gap* marks changes that a vector could tell, but none does.",
    ]
    for sentence, names in survivors.items():
        lines += ["", sentence, "", *(f"- `{name}`" for name in names)]
    return "\n".join(lines) + "\n"


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m spec.mutants", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", metavar="GLOB", default="*", help="changes whose name matches; writes no report")
    parser.add_argument("--list", nargs="?", const="*", metavar="GLOB", help="print the names of changes")
    parser.add_argument("--draw", type=int, metavar="N", help="try N changes, drawn at random")
    parser.add_argument(
        "--seed", type=int, default=0, help="of the draw; a larger N adds to the same draw (%(default)s)"
    )
    parser.add_argument("--quick", action="store_true", help="only with the fastest vectors; writes no report")
    parser.add_argument(
        "--seconds", type=float, default=MOST_SECONDS, help="of vectors that a change is tried with (%(default)s)"
    )
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(words)
    changes, begun = Changes(), time.monotonic()
    if options.list:
        names = [mutant.name for mutant in changes.mutants if fnmatchcase(mutant.name, options.list)]
        print(*names, f"{len(names)} changes", sep="\n")
        return 0
    cache = Cache.of(changes.tree)
    vectors = measure(changes, cache)
    print(f"{len(vectors)} vectors in {sum(known.seconds for known in vectors):.0f} s", flush=True)
    possible = [mutant for mutant in changes.mutants if mutant.of_floats < 0 or mutant.of_floats in cache.floats]
    mutants = [mutant for mutant in possible if fnmatchcase(mutant.name, options.only)]
    if options.draw is not None:
        random.Random(options.seed).shuffle(mutants)
        mutants = mutants[: options.draw]
    gc.freeze()  # pages that all processes share
    seconds = QUICK_SECONDS if options.quick else options.seconds
    fates = Run(changes, vectors, cache, seconds).all(mutants, options.jobs)
    if options.only != "*" or options.quick:
        missed = [name for name, fate in fates.items() if fate == MISSED]
        print(*missed, f"{len(fates)} changes, {len(missed)} not caught", sep="\n")
        return 0
    how = "" if options.draw is None else f"--draw {options.draw} --seed {options.seed}"
    REPORT.write_text(as_markdown(fates, len(possible), how, len(vectors), seconds), "utf-8")
    wrong = faults(fates, reasons(), is_complete=options.draw is None)
    print(*wrong, f"{len(fates)} changes, {len(wrong)} faults, {time.monotonic() - begun:.0f} s", sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
