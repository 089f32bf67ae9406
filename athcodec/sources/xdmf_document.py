"""The XML of an XDMF file: elements with their references followed and their includes in place.

An element with Reference="XML" stands for the one that its text names; xi:include stands for the elements of this file,
or of another one in the source's folder, that its xpointer names, as does xi:fallback for one that cannot be found. The
trees themselves are not changed, and an include is looked up when it is met, so that what includes itself ends.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

from athcodec.errors import ClipError
from athcodec.files.reading import Budget, FileWatch, file_beside, read_plain
from athcodec.sources.xml_tree import parse_xml
from athcodec.sources.xpointer import Pointers, local_name

Element = ElementTree.Element
TAG = "Xdmf"
INCLUDE, FALLBACK = "include", "fallback"
MOST_FOLLOWED = 32  # References, or includes, that lead to each other.
SHOWN = 120  # Characters of a name in messages.


class Documents:
    """An XDMF file, and those that it includes."""

    def __init__(self, path: Path, allow_outside: bool, budget: Budget, unchanged: FileWatch):
        self._path, self._allow_outside, self._budget, self._unchanged = path, allow_outside, budget, unchanged
        self._pointers: dict[Path, Pointers] = {}
        self._home: dict[Element, Path] = {}  # Of elements of other documents: theirs.
        self.size = 0  # Number of elements of all documents.
        self.root = self._load(path)

    def children(self, element: Element, *tags: str) -> list[Element]:
        """Return the children of these tags, or all of them, as the file means them. Raises ClipError."""
        elements = self._included(list(element), MOST_FOLLOWED)
        return [self._followed(each) for each in elements if not tags or local_name(each) in tags]

    def child(self, element: Element, *tags: str) -> Element | None:
        """Return the first child of one of these tags; None without any."""
        return next(iter(self.children(element, *tags)), None)

    def folder(self, element: Element) -> Path:
        """Return the folder of the file that an element is in, from which files that it names are looked for."""
        return self._home.get(element, self._path).parent

    def source(self, element: Element | None) -> bytes:
        """Return what is the same for two elements that say the same in the same place."""
        if element is None:
            return b""
        return f"{self.folder(element)}\n".encode("utf-8", "surrogateescape") + ElementTree.tostring(element).strip()

    def _load(self, path: Path) -> Element:
        """Parse the XML file `path`, count its elements, note it as a file that the clip depends on, and return its
        root element. Raises ClipError, OSError."""
        root = parse_xml(read_plain(path, self._budget), TAG, self._budget)
        self._pointers[path] = Pointers(root)
        self.size += sum(1 for _ in root.iter())
        if path != self._path:
            self._unchanged.add(path)
            self._home |= dict.fromkeys(root.iter(), path)
        return root

    def _included(self, elements: Sequence[Element], left: int) -> list[Element]:
        """Return the elements, with every xi:include replaced by the elements that it stands for. `left` is how many
        more nested includes are allowed. Raises ClipError if it reaches 0."""
        if left <= 0:
            raise ClipError(f"xi:include: got more than {MOST_FOLLOWED} that lead to each other, expected an end")
        included: list[Element] = []
        for element in elements:
            if local_name(element) == INCLUDE:
                included += self._included(self._targets(element), left - 1)
            else:
                included.append(element)
        return included

    def _targets(self, include: Element) -> list[Element]:
        """Return the elements that an xi:include stands for, or its fallback if they cannot be found. Raises ClipError
        if it has no fallback either."""
        href, pointer = unquote(include.get("href", "")), include.get("xpointer")
        fallback = next((child for child in include if local_name(child) == FALLBACK), None)
        try:
            name, _, fragment = href.partition("#")
            document = self._document(name, include)
            pointer = fragment if pointer is None and fragment else pointer
            if include.get("parse", "xml") != "xml":
                raise ClipError(f"xi:include: got parse={include.get('parse', '')[:SHOWN]!r}, expected xml")
            elements = [document.root] if pointer is None else document.of_xpointer(pointer)
            if not elements:
                raise ClipError(f"xi:include: {(pointer or '')[:SHOWN]!r} names nothing in {name or 'the file'}")
        except ClipError:
            if fallback is None:
                raise
            return list(fallback)
        return elements

    def _document(self, name: str, element: Element) -> Pointers:
        """Return the document in the file that `element` calls `name`, relative to the element's own file; "" names
        that file itself. Raises ClipError if it does not exist."""
        home = self._home.get(element, self._path)
        if not name:
            return self._pointers[home]
        path = file_beside(self._path.parent, str(Path(home.parent, name)), self._allow_outside)
        if not path.is_file():
            raise ClipError(f"xi:include: got the file {name[:SHOWN]!r}, which does not exist")
        path = Path(os.path.abspath(path))
        if path not in self._pointers:
            self._load(path)
        return self._pointers[path]

    def _followed(self, element: Element) -> Element:
        """Return the element that `element` refers to by its attribute Reference, or the element itself if it has none.
        Raises ClipError if references form a cycle or lead to another kind of element."""
        for _ in range(MOST_FOLLOWED):
            reference = element.get("Reference")
            if not reference:
                return element
            path = (element.text or "").strip() if reference.upper() == "XML" else reference
            elements = self._pointers[self._home.get(element, self._path)].find(path, element)
            if len(elements) != 1 or local_name(elements[0]) != local_name(element):
                got = f"{len(elements)} elements" if len(elements) != 1 else f"a {local_name(elements[0])}"
                raise ClipError(
                    f"{local_name(element)}: got a reference to {path[:SHOWN]!r}, which is {got}; expected one "
                    f"{local_name(element)}"
                )
            element = elements[0]
        raise ClipError(f"{local_name(element)}: got references that lead to each other, expected an end")
