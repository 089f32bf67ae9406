"""Where a change of an expression makes a difference at once: while vectors are decoded, it is evaluated both ways.

A change that gives the same value each time cannot be caught by a vector, and need not be tried with it. That holds for
expressions without side effects; of others nothing is said.
"""

from __future__ import annotations

import ast
import copy
import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

PURE_NAMES = frozenset(
    "abs all any bool bytes divmod enumerate float frozenset int isinstance len list map max min range reversed round "
    "set sorted str sum tuple zip".split()
)
PURE_METHODS = frozenset(
    "all any argmax argmin argsort astype bit_length copy count cumsum dot endswith from_bytes get index "
    "is_integer items keys max mean min nonzero ravel repeat reshape startswith sum swapaxes to_bytes tobytes tolist "
    "transpose values view".split()
)
PURE_MODULES = frozenset(["math", "np"])
WITH_SIDE_EFFECTS = ast.AugAssign, ast.Delete, ast.Global, ast.Nonlocal, ast.With, ast.Try
LAZY = frozenset(["enumerate", "map", "reversed", "zip"])  # calls whose values cannot be compared
WITHOUT_VALUE = (ast.GeneratorExp, ast.Slice, ast.Starred, ast.Lambda)


def parent_of(node: ast.AST) -> ast.AST:
    return node.up  # type: ignore[attr-defined]


def in_function(node: ast.AST) -> bool:
    """Whether it runs when a function is called; what stands elsewhere does once, before any vector is decoded."""
    while not isinstance(node, ast.Module):
        node, before = parent_of(node), node
        if isinstance(node, ast.FunctionDef) and before in node.body:
            return True
    return False


def parts(node: ast.AST) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, (ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop)):
            yield child


class Purity:
    """Which expressions have no side effects."""

    def __init__(self, tree: ast.Module):
        self.functions: set[str] = set()
        all_functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
        while True:  # until no function follows from those that are known
            more = {node.name for node in all_functions if self._is_pure_function(node)}
            if more == self.functions:
                return
            self.functions = more

    def _is_pure_function(self, function: ast.FunctionDef) -> bool:
        for node in ast.walk(function):
            if isinstance(node, WITH_SIDE_EFFECTS) or (isinstance(node, ast.FunctionDef) and node is not function):
                return False
            if isinstance(node, (ast.Attribute, ast.Subscript)) and not isinstance(node.ctx, ast.Load):
                return False
        return all(self(statement) for statement in function.body)

    def __call__(self, node: ast.AST) -> bool:
        return all(self.alone(each) for each in ast.walk(node))

    def alone(self, node: ast.AST) -> bool:
        """Whether a node has no side effects but those of its parts."""
        if isinstance(node, (ast.NamedExpr, ast.Yield, ast.YieldFrom, ast.Await, ast.Lambda)):
            return False
        return not isinstance(node, ast.Call) or self.is_pure_call(node)

    def is_pure_call(self, node: ast.Call) -> bool:
        function = node.func
        if any(word.arg == "out" for word in node.keywords):
            return False
        if isinstance(function, ast.Name):
            return function.id in PURE_NAMES or function.id in self.functions
        if not isinstance(function, ast.Attribute):
            return False
        of = function.value
        return function.attr in PURE_METHODS or isinstance(of, ast.Name) and of.id in PURE_MODULES


def place_of_effect(node: ast.AST, changed: ast.AST, is_pure: Purity) -> ast.AST | None:
    """The largest expression about a changed node that has no side effects beside it; None: there is none."""
    if not isinstance(node, ast.expr) or not isinstance(changed, ast.expr) or not is_pure(changed):
        return None
    found = node if has_value(node) and has_value(changed) else None
    while True:
        node, before = parent_of(node), node
        if isinstance(node, (ast.comprehension, ast.keyword)):
            continue
        if not isinstance(node, ast.expr) or not is_pure.alone(node):
            return found
        if not all(is_pure(part) for part in parts(node) if part is not before and not is_about(part, before)):
            return found
        if has_value(node):
            found = node


def is_about(node: ast.AST, inner: ast.AST) -> bool:
    return isinstance(node, (ast.comprehension, ast.keyword)) and any(each is inner for each in ast.walk(node))


def has_value(node: ast.AST) -> bool:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in LAZY:
        return False
    return not isinstance(node, WITHOUT_VALUE) and isinstance(getattr(node, "ctx", ast.Load()), ast.Load)


class BothWays(ast.NodeTransformer):
    """Has expressions evaluated as they are and as their changes have them."""

    def __init__(self, ways: dict[int, list[ast.AST]]):
        self.ways = ways  # by the number of the expression

    def generic_visit(self, node: ast.AST) -> ast.AST:
        super().generic_visit(node)
        ways = self.ways.get(getattr(node, "number", -1))
        if not ways or not isinstance(node, ast.expr):
            return node
        changed = ast.Tuple([later(way) for way in ways], ast.Load())
        arguments = [ast.Constant(node.number), later(node), later(changed)]  # type: ignore[attr-defined]
        return ast.Call(ast.Name("_effect", ast.Load()), arguments, [])  # type: ignore[arg-type]


def later(node: ast.AST) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), node)  # type: ignore[arg-type]


class Effects:
    """Which changes make a difference; `mutants`: changes, each with a place and the node that comes there."""

    def __init__(self, tree: ast.Module, mutants: list[Any]):
        is_pure = Purity(tree)
        ways: dict[int, list[ast.AST]] = defaultdict(list)
        named: dict[int, list[str]] = defaultdict(list)
        for mutant in mutants:
            there = mutant.place.put(mutant.node)
            mutant.place.put(there)
            at = place_of_effect(there, mutant.node, is_pure) if in_function(there) else None
            if at is None:
                continue
            mutant.place.put(mutant.node)
            number = at.number  # type: ignore[attr-defined]
            ways[number].append(without_ups(mutant.node if at is there else at))
            mutant.place.put(there)
            named[number].append(mutant.name)
        self.names = {name for names in named.values() for name in names}
        self._named = named
        self.tree = BothWays(ways).visit(without_ups(tree))

        self.begin()

    def begin(self) -> None:
        """From here on, `found` has the names of the changes that make a difference."""
        self.found: set[str] = set()
        self._left = {number: list(enumerate(names)) for number, names in self._named.items()}

    def watch(self, number: int, value: Callable[[], Any], ways: Callable[[], tuple]) -> Any:
        """What the tree calls as `_effect`."""
        left = self._left[number]
        if not left:
            return value()
        functions, got = ways(), []
        for i, _ in left:
            try:
                got.append(functions[i]())
            except Exception:
                got.append(NotImplemented)
        usual = value()
        kept = [each for each, other in zip(left, got) if same(usual, other)]
        if len(kept) < len(left):
            self.found.update(name for _, name in set(left) - set(kept))
            self._left[number] = kept
        return usual


def without_ups(node: ast.AST) -> Any:
    """A copy of a node alone, not of what it hangs on."""
    if isinstance(node, list):
        return [without_ups(each) for each in node]
    if not isinstance(node, ast.AST):
        return node
    made = copy.copy(node)
    for name, value in ast.iter_fields(node):
        setattr(made, name, without_ups(value))
    return made


def same(a: Any, b: Any) -> bool:
    """Whether no decoder could tell two values apart."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return (a == b and math.copysign(1.0, a) == math.copysign(1.0, b)) or (a != a and b != b)
    if isinstance(a, (int, str, bytes, range)):
        return a == b
    if isinstance(a, (np.ndarray, np.generic)):
        return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    return False
