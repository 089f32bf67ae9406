"""Tests the vectors: changes the reference decoder in one place at a time, and looks whether a vector tells.

    python -m spec.mutants                    all changes; writes spec/mutants.md
    python -m spec.mutants --only GLOB        those whose name matches; prints what no vector tells
    python -m spec.mutants --list [GLOB]      their names

A change is one that the author of a decoder could make: another constant, operator, comparison or order of operations,
a condition that is always true or never, a limit, a call or a statement that is missing, arguments that are swapped.
It is caught if a vector has another result than expected.txt says, or the changed decoder stops with an exception that
is none of its errors, or does not stop at all. It is tried with vectors whose decoding comes by the place and, of an
expression, has another value there (effects.py), the fastest ones first, up to some seconds. What no vector can catch
is in spec/mutants.toml, with reasons. The exit status is 1 if something else is not caught, or a reason is not needed.
"""

from __future__ import annotations
import __future__

import argparse
import ast
import copy
import gc
import hashlib
import io
import math
import os
import pickle
import re
import resource
import signal
import sys
import tempfile
import time
import tomllib
import types
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from spec import conformance
from spec.effects import Effects, in_function, parent_of

HERE = Path(__file__).resolve().parent
DECODER = HERE / "reference_decoder.py"
REASONS, REPORT = HERE / "mutants.toml", HERE / "mutants.md"
CACHES = [HERE.parent / "build" / f"mutants{part}.pickle" for part in ("", "_effects")]
LEFT_OUT = {"main", "show", "mesh_in", "Chunk.__str__", "KINDS", "AthError.__init__"}  # of no effect on results
LONGEST_NAME = 72
TOGETHER = 1.0  # seconds of vectors that a process watches
FIRST_SECONDS, MOST_SECONDS = 0.3, 2.0  # of vectors that all changes are tried with first; and those that are left
LARGEST = 14_000  # bytes of a vector that is tried: those of real size take too long
SLOWER = 30.0  # times, of a decoder that is watched
SECONDS, TIMES_AS_LONG = 0.5, 10.0  # of the processor, for a vector; and how many times what the decoder takes
MEMORY = 3 << 30
NOT_CHANGED = (
    ast.Import,
    ast.ImportFrom,
    ast.JoinedStr,
    ast.operator,
    ast.unaryop,
    ast.boolop,
    ast.cmpop,
    ast.expr_context,
)
FLAGS = __future__.annotations.compiler_flag


# ---- changes -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """Where a node hangs in the tree."""

    holder: ast.AST
    name: str
    index: int | None

    def put(self, node: ast.AST) -> ast.AST:
        """The node that was there."""
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
    statements: frozenset[int]  # of which one has to run; empty: any may do
    function: str
    of_floats: int = -1  # the expression that has to be of floats; -1: any


class Changes:
    """All changes of the decoder's source."""

    def __init__(self, source: str):
        self.tree = ast.parse(source)
        self.mutants: list[Mutant] = []
        self._names: Counter[str] = Counter()
        self._number()
        self._uses = uses(self.tree)
        for top, node in enumerate(self.tree.body):
            self.top, self.statements, self.function = top, frozenset[int](), ""
            self._visit(node, Place(self.tree, "body", top))

    def _number(self) -> None:
        """Every node knows its number, and what it hangs on."""
        for number, node in enumerate(ast.walk(self.tree)):
            node.number = number  # type: ignore[attr-defined]
            for child in ast.iter_child_nodes(node):
                child.up = node  # type: ignore[attr-defined]

    def _visit(self, node: ast.AST, place: Place) -> None:
        if isinstance(node, NOT_CHANGED) or is_docstring(node):
            return
        before = self.function, self.statements
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            self.function = ".".join(filter(None, [self.function, node.name]))
        elif self.top == place.index and place.holder is self.tree and isinstance(node, (ast.Assign, ast.If)):
            self.function = ast.unparse(node.targets[0]) if isinstance(node, ast.Assign) else "main"
        if self.function in LEFT_OUT:
            self.function, self.statements = before
            return
        if isinstance(node, ast.stmt):
            self.statements = self._of_statement(node)
        for replacement, of_floats in replacements(node):
            self._add(node, place, replacement, of_floats)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list") or is_message(node, name):
                continue
            for index, child in enumerate(value) if isinstance(value, list) else [(None, value)]:
                if isinstance(child, ast.AST) and not is_message(node, name, index):
                    self._visit(child, Place(node, name, index))
        self.function, self.statements = before

    def _of_statement(self, node: ast.stmt) -> frozenset[int]:
        """What has to run for a change of it to tell: itself; of a function's head, its body; else what uses it."""
        if isinstance(node, ast.FunctionDef):
            node = node.body[0]
        if in_function(node):
            return frozenset([node.number])  # type: ignore[attr-defined]
        return frozenset().union(*(self._uses[name] for name in assigned(node)))

    def _add(self, node: ast.AST, place: Place, replacement: ast.AST, of_floats: bool) -> None:
        shown = shown_with(node)
        old = as_line(shown)
        if shown is node:
            new_text = as_line(replacement)
        else:
            place.put(replacement)
            new_text = as_line(shown)
            place.put(node)
        name = f"{self.function}: {old} -> {new_text}"
        if old == new_text:
            return
        self._names[name] += 1
        if self._names[name] > 1:
            name += f" ({self._names[name]})"
        number = node.number if of_floats else -1  # type: ignore[attr-defined]
        self.mutants.append(Mutant(name, place, replacement, self.top, self.statements, self.function, number))


def statement_of(node: ast.AST) -> ast.stmt:
    while not isinstance(node, ast.stmt):
        node = parent_of(node)
    return node


def assigned(node: ast.stmt) -> list[str]:
    """Names that a statement gives a value to."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)]


def uses(tree: ast.Module) -> dict[str, frozenset[int]]:
    """Statements of functions that use each name of the module or of a class, or what it is part of there."""
    found: dict[str, set[int]] = defaultdict(set)
    made_of: dict[str, set[str]] = defaultdict(set)
    for node in ast.walk(tree):
        name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
        if not name or not isinstance(node.ctx, ast.Load):  # type: ignore[attr-defined]
            continue
        statement = statement_of(node)
        if isinstance(statement, ast.FunctionDef):
            statement = statement.body[0]
        if in_function(statement):
            found[name].add(statement.number)  # type: ignore[attr-defined]
        else:
            made_of[name] |= set(assigned(statement)) - {name}
    while True:
        more = {name: found[name].union(*(found[other] for other in made_of[name])) for name in {*found, *made_of}}
        if all(more[name] == found[name] for name in more):
            return defaultdict(frozenset, {name: frozenset(them) for name, them in more.items()})
        found.update(more)


def is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def is_message(node: ast.AST, name: str, index: int | None = None) -> bool:
    """Whether it is the reason of an error: the second argument."""
    named = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("require", "AthError")
    return named and name == "args" and index == 1


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

OPERATORS: dict[type, list[type]] = {
    ast.Add: [ast.Sub],
    ast.Sub: [ast.Add],
    ast.Mult: [ast.Add],
    ast.Div: [ast.Mult],
    ast.Mod: [ast.FloorDiv],
    ast.LShift: [ast.RShift],
    ast.RShift: [ast.LShift],
    ast.BitAnd: [ast.BitOr],
    ast.BitOr: [ast.BitAnd],
    ast.BitXor: [ast.BitOr],
    ast.Pow: [ast.Mult],
    ast.Lt: [ast.LtE],
    ast.LtE: [ast.Lt],
    ast.Gt: [ast.GtE],
    ast.GtE: [ast.Gt],
    ast.Eq: [ast.NotEq],
    ast.NotEq: [ast.Eq],
    ast.In: [ast.NotIn],
    ast.NotIn: [ast.In],
    ast.Is: [ast.IsNot],
    ast.IsNot: [ast.Is],
}
SYMMETRIC = "times", "distances"  # functions of two arguments in any order
SWAPPED = (ast.Sub, ast.Div, ast.FloorDiv, ast.Mod, ast.LShift, ast.RShift)
NEGATED = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}


def replacements(node: ast.AST) -> Iterator[tuple[ast.AST, bool]]:
    """And whether it makes a difference for floats alone."""
    makers = BY_TYPE.get(type(node), ())
    for make in makers:
        for made in make(node):
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
        elif not is_length_left_open(node):
            yield from (ast.Constant(value + 1), ast.Constant(value - 1))[1 if is_allocated(node) else 0 :]
    elif isinstance(value, float):
        yield from (ast.Constant(value * 1.0625), ast.Constant(value * 0.9375)) if value else [ast.Constant(1.0)]
        if len(repr(value)) > 9:
            yield ast.Constant(float(np.float32(value)))
    elif isinstance(value, bytes) and value:
        yield ast.Constant(value[:-1] + bytes([value[-1] ^ 1]))
    elif isinstance(value, str) and value in conformance.ERRORS:
        yield ast.Constant("BAD_CHUNK" if value != "BAD_CHUNK" else "BAD_CHUNK_TABLE")
    elif isinstance(value, str) and re.fullmatch("<.*", value):
        yield ast.Constant(">" + value[1:])


def is_probability(node: ast.AST) -> bool:
    """That a context starts with: one 1/65536 larger tells once in 65536 decisions."""
    while isinstance(node, ast.expr):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Context":
            return True
        node = parent_of(node)
    return False


def is_length_left_open(node: ast.AST) -> bool:
    """The 1 of -1 where NumPy finds a length out: any negative number does."""
    call = parent_of(parent_of(node))
    return isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "reshape"


def is_allocated(node: ast.AST) -> bool:
    """Whether it is how many there are of something, of which one more would not be used."""
    up = parent_of(node)
    if isinstance(up, ast.BinOp) and isinstance(up.op, ast.Mult):
        return isinstance(up.left, ast.List)
    above = parent_of(up)
    return isinstance(above, ast.comprehension) and isinstance(above.target, ast.Name) and above.target.id == "_"


def binary(node: ast.BinOp) -> Iterator[Any]:
    left, op, right = node.left, node.op, node.right
    if isinstance(left, ast.JoinedStr) or isinstance(getattr(left, "value", 0), (str, bytes)):
        return
    yield from (ast.BinOp(left, new(), right) for new in OPERATORS.get(type(op), ()))
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
    if by_reciprocal and is_one(right.left):
        yield ast.BinOp(left, ast.Div(), right.right)


def is_one(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value == 1.0


def is_power_of_two(node: ast.AST) -> bool:
    """A factor that does not round."""
    value = node.value if isinstance(node, ast.Constant) else None
    return isinstance(value, (int, float)) and value != 0 and abs(math.frexp(value)[0]) == 0.5


def augmented(node: ast.AugAssign) -> Iterator[Any]:
    yield from (ast.AugAssign(node.target, new(), node.value) for new in OPERATORS.get(type(node.op), ()))
    yield ast.Pass()


def compared(node: ast.Compare) -> Iterator[Any]:
    if chooses_one_of_them(node):  # which are the same where they are equal
        return
    for i, op in enumerate(node.ops):
        for new in OPERATORS[type(op)]:
            yield ast.Compare(node.left, [*node.ops[:i], new(), *node.ops[i + 1 :]], node.comparators)
    if len(node.ops) > 1:
        yield ast.Compare(node.left, node.ops[:-1], node.comparators[:-1])
        yield ast.Compare(node.comparators[0], node.ops[1:], node.comparators[1:])


def chooses_one_of_them(node: ast.Compare) -> bool:
    """Whether the comparison is that of a minimum or maximum: a if a > b else b, where(a > b, a, b)."""
    up = parent_of(node)
    if isinstance(up, ast.IfExp) and up.test is node:
        choice = [up.body, up.orelse]
    elif isinstance(up, ast.Call) and ast.unparse(up.func) == "np.where" and up.args[0] is node:
        choice = up.args[1:]
    else:
        return False
    return len(node.ops) == 1 and {ast.unparse(x) for x in choice} == {
        ast.unparse(x) for x in (node.left, node.comparators[0])
    }


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
    if name in ("abs", "sorted", "clipped", "divided_up", "single", "divide_to_zero"):
        yield args[0]
    if name == "divide_to_zero":
        yield ast.BinOp(args[0], ast.FloorDiv(), args[1])
    if name == "range" and not isinstance(args[-1], ast.Constant):
        for change in (ast.Add(), ast.Sub()):
            yield ast.Call(node.func, [*args[:-1], ast.BinOp(args[-1], change, ast.Constant(1))], [])
    if name == "reversed":
        yield args[0]
    if name in ("require", "AthError", "range", "min", "max", "isinstance", "print", *SYMMETRIC):
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


BY_TYPE: dict[type, tuple] = {
    ast.Constant: (constants,),
    ast.BinOp: (binary,),
    ast.AugAssign: (augmented,),
    ast.Compare: (compared,),
    ast.BoolOp: (joined,),
    ast.UnaryOp: (unary,),
    ast.Call: (called,),
    ast.Continue: (missing,),
    ast.Break: (missing,),
    ast.Assign: (missing,),
    ast.Raise: (missing,),
    ast.Return: (missing_return,),
    ast.Expr: (missing_expression,),
}


# ---- the decoder, whole or changed -------------------------------------------------------------------------


class Decoder:
    """The module, a statement at a time, so that a change takes to compile one of them."""

    NAME = "spec.changed_decoder"

    def __init__(self, tree: ast.Module):
        self.tree = tree
        self.parts = [compiled(node) for node in tree.body]

    @cached_property
    def usual(self) -> types.ModuleType:
        return self.module()

    @cached_property
    def at_import(self) -> set[str]:
        return used_at_import(self.tree)

    def module(self, top: int | None = None, given: dict[str, Any] | None = None) -> types.ModuleType:
        """Statement `top` is compiled anew."""
        module = types.ModuleType(self.NAME)
        sys.modules[self.NAME] = module
        module.__dict__.update(given or {})
        for i, part in enumerate(self.parts):
            exec(compiled(self.tree.body[i]) if i == top else part, module.__dict__)
        return module

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[types.ModuleType]:
        """The changed module; what only defines a function is changed in the usual module for a while."""
        node, names = self.tree.body[mutant.top], self.usual.__dict__
        in_place = isinstance(node, ast.FunctionDef) and node.name not in self.at_import
        there = mutant.place.put(mutant.node)
        try:
            if in_place:
                exec(compiled(node), names)
            yield self.usual if in_place else self.module(mutant.top)
        finally:
            mutant.place.put(there)
            if in_place:
                exec(self.parts[mutant.top], names)
            sys.modules[self.NAME] = self.usual
            clear_caches(self.usual)


def clear_caches(module: types.ModuleType) -> None:
    for value in module.__dict__.values():
        if hasattr(value, "cache_clear"):
            value.cache_clear()


def used_at_import(tree: ast.Module) -> set[str]:
    """Names that what is not in a function uses."""
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)]
    return {node.id for node in names if not in_function(node)}


def compiled(node: ast.stmt) -> types.CodeType:
    part = ast.fix_missing_locations(ast.Module([node], []))
    return compile(part, str(DECODER), "exec", flags=FLAGS, dont_inherit=True)


# ---- vectors -----------------------------------------------------------------------------------------------


@dataclass
class Known:
    """A vector, what it decodes to, how long that takes, and which statements that runs."""

    name: str
    data: bytes
    mesh: bytes | None
    expected: dict[str, bytes | str] = field(default_factory=dict)  # by item: the answer, or the error's name
    seconds: float = 0.0
    statements: frozenset[int] = frozenset()


def answer(module: types.ModuleType, vector: Known, item: str, opened: dict) -> bytes | str:
    """`opened`: files that other items have opened."""
    mesh = vector.mesh if conformance.needs_rest(item) else None
    way = item == "strict", mesh is not None
    try:
        if way not in opened:
            file = module.AthFile(vector.data, strict=way[0])
            if mesh is not None:
                file.set_host_mesh(mesh)
            opened[way] = file
        got = module.raw(opened[way], item)
    except module.AthError as error:
        return error.name
    return with_quiet_nans(got, opened[way].header.is_float64) if item.isdecimal() else got


def with_quiet_nans(got: bytes, is_float64: bool) -> bytes:
    return conformance.with_quiet_nans(got, "<f8" if is_float64 else "<f4")


def is_as_expected(module: types.ModuleType, vector: Known) -> bool:
    opened: dict = {}
    return all(answer(module, vector, item, opened) == expected for item, expected in vector.expected.items())


@dataclass
class Cache:
    """What earlier runs have found out, while the decoder stays the same: vectors never change."""

    source: str
    known: dict[str, Known] = field(default_factory=dict)  # by the name of the vector
    floats: set[int] = field(default_factory=set)  # numbers of expressions
    fates: dict[str, str] = field(default_factory=dict)  # of changes
    passed: dict[str, set[str]] = field(default_factory=dict)  # of changes: vectors that have not caught them
    bits: dict[str, int] = field(default_factory=dict)  # of changes, in the numbers below
    compared: dict[str, int] = field(default_factory=dict)  # of vectors: changes whose effects are known
    without: dict[str, int] = field(default_factory=dict)  # of vectors: those that make no difference in them

    @staticmethod
    def of(source: str) -> Cache:
        own = hashlib.sha256(source.encode()).hexdigest()
        kept = {
            name: value for path in CACHES if path.exists() for name, value in pickle.loads(path.read_bytes()).items()
        }
        return Cache(**kept) if kept.get("source") == own else Cache(own)

    def keep(self, effects: bool = False) -> None:
        """What changes all the time, or the rest."""
        names = "bits", "compared", "without"
        kept = {name: value for name, value in vars(self).items() if (name in names) == effects}
        path = CACHES[effects]
        path.parent.mkdir(exist_ok=True)
        path.with_suffix(".new").write_bytes(pickle.dumps(kept))
        path.with_suffix(".new").replace(path)

    def mask(self, names: Iterable[str]) -> int:
        return sum(1 << self.bits.setdefault(name, len(self.bits)) for name in names)

    def is_without_effect(self, mutant: Mutant, vector: Known) -> bool:
        bit = self.bits.get(mutant.name)
        return bit is not None and self.without.get(vector.name, 0) >> bit & 1 == 1


class Marked(ast.NodeTransformer):
    """Marks the statements that run, and the expressions that are of floats."""

    def __init__(self, floats: set[int]):
        self.floats = floats

    def generic_visit(self, node: ast.AST) -> ast.AST:
        super().generic_visit(node)
        if isinstance(node, ast.expr) and getattr(node, "number", -1) in self.floats:
            return ast.Call(ast.Name("_typed", ast.Load()), [ast.Constant(node.number), node], [])  # type: ignore
        for name in ("body", "orelse", "finalbody"):
            block = getattr(node, name, None)
            if isinstance(block, list) and not isinstance(node, (ast.Module, ast.ClassDef)):
                setattr(node, name, [each for stmt in block for each in (mark(stmt), stmt)])
        return node


def mark(statement: ast.stmt) -> ast.stmt:
    return ast.parse(f"_ran[{statement.number}] = 1").body[0]  # type: ignore[attr-defined]


def measure(changes: Changes, cache: Cache) -> list[Known]:
    """All vectors; the cache gets those that it lacks, and the expressions that are of floats."""
    candidates = {mutant.of_floats for mutant in changes.mutants} - {-1}
    ran: dict[int, int] = {}
    floats = cache.floats

    def typed(number: int, value: Any) -> Any:
        if getattr(getattr(value, "dtype", None), "kind", "") == "f" or isinstance(value, float):
            floats.add(number)
        return value

    decoder = Decoder(Marked(candidates).visit(copy.deepcopy(changes.tree)))
    for vector in conformance.vectors():
        if vector.name in cache.known or vector.path.stat().st_size > LARGEST:
            continue
        ran.clear()
        one = Known(vector.name, vector.path.read_bytes(), vector.mesh)
        module, opened = decoder.module(given={"_ran": ran, "_typed": typed}), {}
        start = time.process_time()
        one.expected = {item: answer(module, one, item, opened) for item in sorted(vector.results, key=order_of)}
        one.seconds, one.statements = time.process_time() - start, frozenset(ran)
        cache.known[one.name] = one
        for item, result in vector.results.items():
            got = one.expected[item]
            got = got if isinstance(got, str) else conformance.checksum_of(one.data, item, got)
            if got != result:
                raise SystemExit(f"{vector.name}, {item}: got {got}; expected {result}")
    cache.keep()
    return sorted(cache.known.values(), key=lambda vector: vector.seconds)


def order_of(item: str) -> tuple:
    """Opening strictly is the same as opening but for lengths: last."""
    return item == "strict", item


# ---- running -----------------------------------------------------------------------------------------------

MISSED = "missed"


def find_effects(changes: Changes, vectors: list[Known], cache: Cache, mutants: list[Mutant], jobs: int) -> None:
    """Notes in which vectors a change makes no difference where it stands: they cannot catch it."""
    left = [mutant for mutant in mutants if cache.fates.get(mutant.name, MISSED) == MISSED]
    effects = Effects(changes.tree, left)
    decoder, running, every = Decoder(effects.tree), dict[int, list[Known]](), cache.mask(effects.names)
    waiting = batches([each for each in vectors if every & ~cache.compared.get(each.name, 0)], TOGETHER)
    with tempfile.TemporaryDirectory() as folder:
        while waiting or running:
            while waiting and len(running) < jobs:
                batch = waiting.pop()
                running[in_process(partial(write_effects, effects, decoder, batch, Path(folder)))] = batch
            process, _ = os.wait()
            path = Path(folder) / str(process)
            found = dict(unpickled(path.read_bytes())) if path.exists() else {}
            for vector in running.pop(process):
                cache.compared[vector.name] = every
                cache.without[vector.name] = every & ~cache.mask(found.get(vector.name, effects.names))
    cache.keep(effects=True)


def batches(vectors: list[Known], seconds: float) -> list[list[Known]]:
    """Neighbours that together take so long."""
    found: list[list[Known]] = []
    for vector in vectors:
        if not found or sum(each.seconds for each in found[-1]) + vector.seconds > seconds:
            found.append([])
        found[-1].append(vector)
    return found


def write_effects(effects: Effects, decoder: Decoder, batch: list[Known], folder: Path) -> None:
    signal.setitimer(signal.ITIMER_PROF, SLOWER * (1.0 + TIMES_AS_LONG * sum(vector.seconds for vector in batch)))
    module = decoder.module(given={"_effect": effects.watch})
    with (folder / str(os.getpid())).open("wb", buffering=0) as out:
        for vector in batch:
            clear_caches(module)
            effects.begin()
            if not is_as_expected(module, vector):
                raise AssertionError(f"{vector.name}: another result when watched")
            out.write(pickle.dumps((vector.name, effects.found)))


def in_process(job: Callable[[], None]) -> int:
    process = os.fork()
    if process == 0:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        np.seterr(all="ignore")
        try:
            job()
        finally:
            os._exit(0)
    return process


@dataclass
class Found:
    """What became of a change: how it was caught, or MISSED by the vectors tried."""

    number: int
    fate: str = ""  # empty: it is being tried
    tried: list[str] = field(default_factory=list)


class Run:
    """Tries changes, in processes that each try some of them one after the other."""

    def __init__(self, changes: Changes, vectors: list[Known], cache: Cache, jobs: int):
        self.decoder, self.vectors, self.cache, self.jobs = Decoder(changes.tree), vectors, cache, jobs
        self.by_name = {vector.name: vector for vector in vectors}
        self.lately: dict[str, list[str]] = defaultdict(list)  # of a function: vectors that caught changes, last first
        self.mutants: list[Mutant] = []
        self.fates: dict[str, str] = {}

    def all(self, mutants: list[Mutant], folder: Path, quick: bool, most: float) -> dict[str, str]:
        """First with the fastest vectors, then those that they miss with the others."""
        self.mutants, self.folder = mutants, folder
        known, known_reasons = self.cache.fates, reasons()  # what has a reason comes last
        self.fates = {mutant.name: known[mutant.name] for mutant in mutants if known.get(mutant.name, MISSED) != MISSED}
        for seconds, count in [(FIRST_SECONDS, 40), (most, 10)][: 1 if quick else None]:
            left = [i for i, mutant in enumerate(mutants) if self.fates.get(mutant.name, MISSED) == MISSED]
            if seconds == FIRST_SECONDS:
                left = [i for i in left if mutants[i].name not in self.cache.passed]
            left.sort(key=lambda i: any(reason.matches(mutants[i].name) for reason in known_reasons))
            self._round([left[i : i + count] for i in range(0, len(left), count)], seconds)
        return self.fates

    def _round(self, batches: list[list[int]], seconds: float) -> None:
        batches, running = batches[::-1], {}
        while batches or running:
            while batches and len(running) < self.jobs:
                batch = batches.pop()
                running[self._start(batch, seconds)] = batch
            process, _ = os.wait()
            rest = self._note(process, running.pop(process))
            batches += [rest] if rest else []
        self.cache.keep()

    def _start(self, batch: list[int], seconds: float) -> int:
        def job() -> None:
            with (self.folder / str(os.getpid())).open("wb", buffering=0) as out:
                for number in batch:
                    out.write(pickle.dumps(Found(number)))
                    out.write(pickle.dumps(self._try(number, seconds)))

        return in_process(job)

    def _try(self, number: int, seconds: float) -> Found:
        mutant, tried, at = self.mutants[number], [], "the module"
        try:
            with self.decoder.changed(mutant) as module:
                for vector in self._vectors_for(mutant, seconds):
                    at = vector.name
                    signal.setitimer(signal.ITIMER_PROF, SECONDS + TIMES_AS_LONG * vector.seconds)
                    if not is_as_expected(module, vector):
                        self._note_lately(mutant, at)
                        return Found(number, f"result of {at}")
                    tried.append(at)
        except Exception:
            return Found(number, f"exception in {at}")
        return Found(number, MISSED, tried)

    def _vectors_for(self, mutant: Mutant, seconds: float) -> Iterator[Known]:
        """First those that caught others in the same function; the fastest ones first."""
        first, passed = self.lately[mutant.function][:8], self.cache.passed.get(mutant.name, set())
        for vector in [self.by_name[name] for name in first] + self.vectors:
            if mutant.statements and not mutant.statements & vector.statements:
                continue
            if self.cache.is_without_effect(mutant, vector):
                continue
            if vector.name not in passed:
                yield vector
            seconds -= vector.seconds
            if seconds < 0.0:
                break

    def _note_lately(self, mutant: Mutant, name: str) -> None:
        names = self.lately[mutant.function]
        if name in names:
            names.remove(name)
        names.insert(0, name)

    def _note(self, process: int, batch: list[int]) -> list[int]:
        """Notes what a process found; returns what it did not come to."""
        path = self.folder / str(process)
        found = list(unpickled(path.read_bytes()))
        path.unlink()
        if not found[-1].fate:  # the process was ended while it tried this
            found.append(Found(found[-1].number, "no end in a vector"))
        for one in found:
            mutant = self.mutants[one.number]
            if not one.fate:
                continue
            self.fates[mutant.name] = self.cache.fates[mutant.name] = one.fate
            if one.fate.startswith("result of "):
                self._note_lately(mutant, one.fate.removeprefix("result of "))
            if one.fate == MISSED:
                self.cache.passed.setdefault(mutant.name, set()).update(one.tried)
        self._report()
        return batch[batch.index(found[-1].number) + 1 :]

    def _report(self) -> None:
        if time.monotonic() - self.told > 20.0:
            self.told = time.monotonic()
            self.cache.keep()
            missed = sum(fate == MISSED for fate in self.fates.values())
            print(f"{len(self.fates)} of {len(self.mutants)} tried, {missed} not caught so far", flush=True)

    told = 0.0


def unpickled(data: bytes) -> Iterator[Any]:
    stream = io.BytesIO(data)
    while stream.tell() < len(data):
        try:
            yield pickle.load(stream)
        except (pickle.UnpicklingError, EOFError):  # the process was ended while it wrote
            return


# ---- reasons and report ------------------------------------------------------------------------------------


@dataclass
class Reason:
    """Why no vector can catch changes: those of these names, and those whose names one of the patterns matches."""

    why: str
    mutants: list[str] = field(default_factory=list)
    like: list[str] = field(default_factory=list)  # regular expressions

    def matches(self, name: str) -> bool:
        return name in self.mutants or any(re.fullmatch(pattern, name) for pattern in self.like)


def reasons() -> list[Reason]:
    entries = tomllib.loads(REASONS.read_text("utf-8")).get("reason", [])
    return [Reason(**(entry | {"why": " ".join(entry["why"].split())})) for entry in entries]


def faults(fates: dict[str, str], known: list[Reason]) -> list[str]:
    """What is missed without a reason, and reasons that are not needed."""
    missed = [name for name, fate in fates.items() if fate == MISSED]
    lines = [f"not caught: {name}" for name in missed if not any(reason.matches(name) for reason in known)]
    for reason in known:
        for name in reason.mutants:
            if name not in fates:
                lines.append(f"no such change: {name}")
            elif fates[name] != MISSED:
                lines.append(f"caught, {fates[name]}: {name}")
        lines += [
            f"no change that is not caught is like: {pattern}"
            for pattern in reason.like
            if not any(re.fullmatch(pattern, name) for name in missed)
        ]
    return lines


def as_markdown(fates: dict[str, str], known: list[Reason], vectors: int, seconds: float) -> str:
    how = Counter("not caught" if fate == MISSED else fate.split(" of ")[0].split(" in ")[0] for fate in fates.values())
    caught = len(fates) - how["not caught"]
    lines = [
        "# Changes of the reference decoder",
        "",
        f"Written by `python -m spec.mutants`. Each change was tried with those of {vectors} vectors in which it makes",
        f"a difference where it stands, the fastest ones first, up to {seconds:g} s of decoding. Why some are not",
        "caught is said in `mutants.toml`.",
        "",
        "| what becomes of a change | changes |",
        "|---|---:|",
        f"| another result of a vector | {how['result']} |",
        f"| an exception that is no error of the format | {how['exception']} |",
        f"| no end | {how['no end']} |",
        f"| caught in all | {caught} |",
        f"| not caught | {how['not caught']} |",
    ]
    by_reason: dict[str, list[str]] = defaultdict(list)
    for name, fate in fates.items():
        if fate == MISSED:
            by_reason[next((reason.why for reason in known if reason.matches(name)), "No reason yet.")].append(name)
    for why, names in by_reason.items():
        lines += ["", f"## {why}", "", *(f"- `{name}`" for name in names)]
    return "\n".join(lines) + "\n"


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m spec.mutants", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", metavar="GLOB", help="changes whose name matches; writes no report")
    parser.add_argument("--list", nargs="?", const="*", metavar="GLOB", help="print the names of changes")
    parser.add_argument("--anew", action="store_true", help="do without what earlier runs have found out")
    parser.add_argument("--quick", action="store_true", help="only with the fastest vectors; writes no report")
    parser.add_argument(
        "--seconds",
        type=float,
        default=MOST_SECONDS,
        help="of vectors that a change is tried with (default: %(default)s)",
    )
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(words)
    source = DECODER.read_text("utf-8")
    changes = Changes(source)
    if options.list:
        names = [mutant.name for mutant in changes.mutants if fnmatchcase(mutant.name, options.list)]
        print(*names, f"{len(names)} changes", sep="\n")
        return 0
    begun = time.monotonic()
    cache = Cache(source) if options.anew else Cache.of(source)
    vectors, floats = measure(changes, cache), cache.floats
    print(f"{len(vectors)} vectors in {sum(v.seconds for v in vectors):.0f} s", flush=True)
    mutants = [mutant for mutant in changes.mutants if mutant.of_floats < 0 or mutant.of_floats in floats]
    if options.only:
        mutants = [mutant for mutant in mutants if fnmatchcase(mutant.name, options.only)]
    gc.freeze()  # pages that all processes share
    find_effects(changes, vectors, cache, mutants, options.jobs)
    with tempfile.TemporaryDirectory() as folder:
        fates = Run(changes, vectors, cache, options.jobs).all(mutants, Path(folder), options.quick, options.seconds)
    if options.only or options.quick:
        missed = [name for name, fate in fates.items() if fate == MISSED]
        print(*missed, f"{len(fates)} changes, {len(missed)} not caught", sep="\n")
        return 0
    known = reasons()
    REPORT.write_text(as_markdown(fates, known, len(vectors), options.seconds), "utf-8")
    wrong = faults(fates, known)
    print(*wrong, f"{len(fates)} changes, {len(wrong)} faults, {time.monotonic() - begun:.0f} s", sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
