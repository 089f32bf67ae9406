"""Which elements of an XML tree a pointer names: XPath as XInclude and XDMF use it, and the element scheme.

Of XPath: absolute and relative paths, //, the axes child, self, parent, descendant and descendant-or-self, names, * and
node(), unions, and predicates of numbers, attributes, names of children, self::, =, !=, and, or, not(), last(),
position(), name(), local-name(), contains() and starts-with(). Anything else is a ClipError that names it. Namespaces
are not looked at. A search that visits too many elements is given up.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

from athcodec.errors import ClipError

Element = ElementTree.Element
MOST_VISITED = 20_000_000  # Elements that the pointers of a document may look at.
LONGEST_POINTER = 4096  # Characters.
SHOWN = 200  # Characters of a pointer in messages.
_TOKEN = re.compile(r"""\s*(//|::|\.\.|!=|[/|()\[\]@,=.*]|"[^"]*"|'[^']*'|\d+|[\w-]+(?::(?!:)[\w*-]+)?)""")
_PART = re.compile(r"\s*([\w:.-]+)\(")
AXES = ("child", "self", "parent", "descendant", "descendant-or-self")


class Pointers:
    """The elements of one document that pointers name."""

    def __init__(self, root: Element):
        self.root = root
        self._top = Element("")  # Stands for the document, whose only child is the root.
        self._top.append(root)
        self._parents: dict[Element, Element] | None = None
        self._elements: dict[str, list[Element]] = {}
        self.visited = 0

    def find(self, path: str, start: Element | None = None) -> list[Element]:
        """Return the elements of an XPath, which may be relative to `start`. Raises ClipError for one that is not
        known."""
        key = path if start is None or path.lstrip().startswith("/") else ""
        if key not in self._elements or not key:
            elements = _Parser(path).parsed()(self, self._top if start is None else start)
            self._elements[key] = [element for element in elements if element is not self._top]
        return self._elements[key]

    def of_xpointer(self, pointer: str) -> list[Element]:
        """Return the elements that an XPointer names. If it has several parts, the first part that names any elements
        counts. Raises ClipError for an unknown scheme."""
        elements: list[Element] = []
        for scheme, text in _parts(pointer):
            if scheme in ("xpointer", "xpath1", "xpath"):
                elements = self.find(text)
            elif scheme == "element":
                elements = self._by_numbers(text)
            elif scheme == "":
                elements = self._by_id(text)
            elif scheme != "xmlns":
                raise ClipError(f"xpointer: got the scheme {scheme[:SHOWN]!r}, expected xpointer or element")
            if elements:
                break
        return elements

    def _by_id(self, name: str) -> list[Element]:
        ids = ("id", "ID", "{http://www.w3.org/XML/1998/namespace}id")
        elements = [each for each in self._descendants(self._top) if any(each.get(key) == name for key in ids)]
        return elements[:1]

    def _by_numbers(self, text: str) -> list[Element]:
        """Return the element at a path of child numbers counted from 1, such as "/1/2/3", or "id/2" from the element
        with that id. The list is empty if there is none."""
        name, *numbers = text.strip().split("/")
        elements = self._by_id(name) if name else [self._top]
        for number in numbers:
            if not number.isascii() or not number.isdigit():
                raise ClipError(f"xpointer: got element({text[:SHOWN]}), expected numbers")
            elements = [child for each in elements for place, child in enumerate(each, 1) if place == int(number)]
        return elements

    def _descendants(self, element: Element) -> Iterator[Element]:
        for each in element.iter():
            self.visited += 1
            if self.visited > MOST_VISITED:
                raise ClipError(f"xpointer: got a search of more than {MOST_VISITED} elements, expected a shorter one")
            if each is not element:
                yield each

    def along(self, axis: str, element: Element) -> list[Element]:
        """Return the elements that an XPath axis, such as "child" or "parent", leads to from an element."""
        if axis == "self":
            return [element]
        if axis == "child":
            self.visited += len(element)
            return list(element)
        if axis == "parent":
            if self._parents is None:
                self._parents = {child: parent for parent in self._top.iter() for child in parent}
            return [self._parents[element]] if element in self._parents else []
        return [*([element] if axis == "descendant-or-self" else []), *self._descendants(element)]

    @property
    def top(self) -> Element:
        """The top element, which stands for the document."""
        return self._top


def _parts(pointer: str) -> Iterator[tuple[str, str]]:
    """Yield (scheme, text) for each part of an XPointer, such as ("element", "/1/2") for element(/1/2); a bare name has
    the scheme "". Raises ClipError."""
    if len(pointer) > LONGEST_POINTER:
        raise ClipError(f"xpointer: got {len(pointer)} characters, expected at most {LONGEST_POINTER}")
    at, is_bare = 0, True
    while match := _PART.match(pointer, at):
        is_bare, depth, stop, quote = False, 1, match.end(), ""
        while depth and stop < len(pointer):
            letter = pointer[stop]
            quote = "" if letter == quote else quote or (letter if letter in "'\"" else "")
            depth += 0 if quote else {"(": 1, ")": -1}.get(letter, 0)
            stop += 1
        if depth:
            raise ClipError(f"xpointer: got {pointer[:SHOWN]!r}, expected as many closing brackets as opening ones")
        yield match[1].rpartition(":")[2], pointer[match.end() : stop - 1]
        at = stop
    if is_bare:
        yield "", pointer.strip()


Finder = Callable[[Pointers, Element], list[Element]]
Test = Callable[[Pointers, Element, int, int], Any]  # Of an element, its place, and how many there are.


class _Parser:
    """The expression of a path as a function."""

    def __init__(self, path: str):
        """Split a path into tokens. Raises ClipError if it is too long or has characters that are not known."""
        self._path, self._tokens, at = path, list[str](), 0
        if len(path) > LONGEST_POINTER:
            raise self._unknown()
        while path[at:].strip():
            match = _TOKEN.match(path, at)
            if match is None:
                raise self._unknown(path[at : at + 20])
            self._tokens.append(match[1])
            at = match.end()
        self._at, self._depth = 0, 0

    def parsed(self) -> Finder:
        finder = self._union()
        if self._at < len(self._tokens) or not self._tokens:
            raise self._unknown(self._next)
        return finder

    def _unknown(self, part: str = "") -> ClipError:
        at = f" at {part.strip()!r}" if part.strip() else ""
        return ClipError(f"xpointer: got {self._path[:SHOWN]!r}, expected a path that is known{at}")

    @property
    def _next(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self, *wanted: str) -> bool:
        if self._tokens[self._at : self._at + len(wanted)] != list(wanted):
            return False
        self._at += len(wanted)
        return True

    def _expect(self, token: str) -> None:
        if not self._take(token):
            raise self._unknown(self._next)

    def _union(self) -> Finder:
        finders = [self._steps()]
        while self._take("|"):
            finders.append(self._steps())
        return finders[0] if len(finders) == 1 else lambda document, start: _once(f(document, start) for f in finders)

    def _steps(self) -> Finder:
        """Parse a path, such as "/a/b//c" or "(a | b)/c", and return a function (document, start) that returns its
        elements."""
        steps: list[Finder] = []
        is_absolute = False
        if self._take("("):
            inside = self._nested(self._union)
            self._expect(")")
            tests = self._predicates()
            steps.append(lambda document, start: _filtered(document, inside(document, start), tests))
        else:
            is_absolute = self._next in ("/", "//")
            if not is_absolute:
                steps.append(self._step())
            elif self._next == "/" and self._at + 1 == len(self._tokens):
                self._at += 1
                return lambda document, start: [document.top]
        while self._next in ("/", "//"):
            if self._tokens[self._at] == "//":
                steps.append(lambda document, element: document.along("descendant-or-self", element))
            self._at += 1
            steps.append(self._step())

        def find(document: Pointers, start: Element) -> list[Element]:
            elements = [document.top if is_absolute else start]
            for step in steps:
                elements = _once(step(document, each) for each in elements)
            return elements

        return find

    def _step(self) -> Finder:
        """Parse one step of a path, such as "name[1]", ".." or "child::name", and return a function (document, element)
        that returns the elements one step from `element`."""
        if self._take("."):
            return lambda document, element: [element]
        if self._take(".."):
            return lambda document, element: document.along("parent", element)
        axis, name = "child", self._next
        if self._tokens[self._at + 1 : self._at + 2] == ["::"]:
            axis = name
            if axis not in AXES:
                raise self._unknown(axis)
            self._at += 2
        is_name, tests = self._name_test(), self._predicates()

        def find(document: Pointers, element: Element) -> list[Element]:
            elements = [each for each in document.along(axis, element) if is_name(each)]
            return _filtered(document, elements, tests)

        return find

    def _predicates(self) -> list[Test]:
        tests = []
        while self._take("["):
            tests.append(self._nested(self._either))
            self._expect("]")
        return tests

    def _name_test(self) -> Callable[[Element], bool]:
        """Parse the name in a step, and return a function that tells whether an element has this name; "*" fits all."""
        name = self._next
        self._at += 1
        if name == "*" or (name == "node" and self._take("(", ")")):
            return lambda element: True
        if not re.fullmatch(r"[\w-]+(?::[\w-]+)?", name) or name[0].isdigit():
            raise self._unknown(name)
        local = name.rpartition(":")[2]
        return lambda element: local_name(element) == local

    # ---- predicates ----

    def _nested(self, parse: Callable[[], Any]) -> Any:
        """Call a parser one level deeper in parentheses, and return its result. Raises ClipError beyond 32 levels."""
        self._depth += 1
        if self._depth > 32:
            raise self._unknown()
        parsed = parse()
        self._depth -= 1
        return parsed

    def _either(self) -> Test:
        tests = [self._both()]
        while self._take("or"):
            tests.append(self._both())
        return tests[0] if len(tests) == 1 else lambda *at: any(bool(test(*at)) for test in tests)

    def _both(self) -> Test:
        tests = [self._comparison()]
        while self._take("and"):
            tests.append(self._comparison())
        return tests[0] if len(tests) == 1 else lambda *at: all(bool(test(*at)) for test in tests)

    def _comparison(self) -> Test:
        """Parse a value, or two with = or != between them, and return a function that computes the value or the
        comparison for an element."""
        left = self._value()
        if not self._next or self._next not in ("=", "!="):
            return left
        is_equal = self._next == "="
        self._at += 1
        right = self._value()

        def compare(*at: Any) -> bool:
            one, other = left(*at), right(*at)
            return one is not None and other is not None and (str(one) == str(other)) == is_equal

        return compare

    def _value(self) -> Test:
        """Parse a value in a predicate (text, a number, an attribute, a function or a path), and return a function that
        computes it for an element."""
        token = self._next
        following = self._tokens[self._at + 1 : self._at + 2]
        if token[:1] in ("'", '"'):
            self._at += 1
            return lambda *at: token[1:-1]
        if token.isdigit():
            self._at += 1
            return lambda *at: int(token)
        if self._take("@"):
            name = self._next
            self._at += 1
            return lambda document, element, place, count: element.get(name)
        if self._take("("):
            inside = self._nested(self._either)
            self._expect(")")
            return inside
        if following == ["("] and token != "node":
            return self._function(token)
        path = self._nested(self._steps)
        return lambda document, element, place, count: path(document, element)

    def _function(self, name: str) -> Test:
        """Parse the arguments of the function `name`, and return a function that calls it for an element. Raises
        ClipError if no such function is known."""
        self._at += 2
        values = []
        while not self._take(")"):
            values.append(self._nested(self._either))
            if not self._take(",") and self._next != ")":
                raise self._unknown(self._next)
        if (name, len(values)) not in _FUNCTIONS:
            raise self._unknown(f"{name}()")
        function = _FUNCTIONS[name, len(values)]
        return lambda *at: function(at, *(value(*at) for value in values))


_FUNCTIONS: dict[tuple[str, int], Callable[..., Any]] = {
    ("last", 0): lambda at: at[3],
    ("position", 0): lambda at: at[2],
    ("name", 0): lambda at: local_name(at[1]),
    ("local-name", 0): lambda at: local_name(at[1]),
    ("not", 1): lambda at, value: not value,
    ("contains", 2): lambda at, text, part: part in (text or ""),
    ("starts-with", 2): lambda at, text, part: (text or "").startswith(part),
}


def _filtered(document: Pointers, elements: list[Element], tests: list[Test]) -> list[Element]:
    """Return the elements that pass all predicates of a step. A predicate whose value is an integer passes the element
    at that place, counted from 1."""
    for test in tests:
        values = [test(document, each, place, len(elements)) for place, each in enumerate(elements, 1)]
        elements = [
            each
            for place, (each, value) in enumerate(zip(elements, values), 1)
            if (value == place if type(value) is int else bool(value))
        ]
    return elements


def local_name(element: Element) -> str:
    """Return the tag of an element without its namespace; that of a comment is empty."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _once(lists: Any) -> list[Element]:
    """Return the elements of several lists in their order, each once."""
    return list({id(each): each for element in lists for each in element}.values())
