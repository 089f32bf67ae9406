"""Numbers of XDMF: DataItems in text, HDF5 and raw binary, hyperslabs and functions of others.

Functions are + - * /, the usual ones of one array, and JOIN: with commas it puts arrays side by side, as x, y and z of
a vector, with semicolons one after the other. HDF5 files stay open; what they hold is read when it is asked for.
"""

from __future__ import annotations

import ast
import bz2
import math
import re
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import h5py
import numpy as np

from athcodec.errors import ClipError
from athcodec.files.reading import Budget, FileWatch, file_beside, no_room
from athcodec.sources.hdf5 import check_own, chunk_bytes, unpacks_to_more
from athcodec.sources.xdmf_document import Documents
from athcodec.sources.xml_tree import TEXT_BYTES

Element = ElementTree.Element
_KINDS = {"float": "f", "int": "i", "uint": "u", "char": "i", "uchar": "u", "short": "i", "ushort": "u"}
_SIZES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2}
_ORDERS: dict[str, Literal["<", ">"]] = {"big": ">", "little": "<"}
_UNPACKERS: dict[str, Callable[[], Any]] = {"zlib": zlib.decompressobj, "bzip2": bz2.BZ2Decompressor}
_FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "abs": np.abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
}
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
}
LONGEST_FUNCTION, MOST_NESTED = 1000, 16  # Characters; items inside items.
AFTER = "_after"  # Stands for the semicolon of JOIN.


class Items:
    """The numbers that an XDMF file names, and the HDF5 files that they lie in, open until close()."""

    def __init__(self, path: Path, allow_outside: bool, budget: Budget):
        self.budget, self.unchanged = budget, FileWatch(path.resolve())
        self._folder, self._allow_outside = path.resolve().parent, allow_outside
        self._files: dict[Path, h5py.File] = {}
        self.documents = Documents(path.resolve(), allow_outside, budget, self.unchanged)

    def close(self) -> None:
        for file in self._files.values():
            file.close()

    def read(self, item: Element | None, depth: int = 0) -> np.ndarray:
        """Return the array of a DataItem element. `depth` counts the DataItems around it. Raises ClipError if it is
        broken or None."""
        if item is None:
            raise ClipError("got no DataItem, expected one")
        if depth > MOST_NESTED:
            raise ClipError(f"DataItem: got more than {MOST_NESTED} inside each other, expected fewer")
        kind = item.get("ItemType", "Uniform")
        if kind == "HyperSlab":
            return self._slab(item, depth)
        if kind == "Function":
            return self._function(item, depth)
        if kind != "Uniform":
            raise ClipError(f"DataItem: got the type {kind[:40]!r}, expected Uniform, HyperSlab or Function")
        form, shape = item.get("Format", "XML").upper(), _shape(item)
        if form == "HDF":
            values = self._hdf(item)
        elif form == "XML":
            values = self._text(item)
        elif form == "BINARY":
            values = self._binary(item, shape or ())
        else:
            raise ClipError(f"DataItem: got the format {form[:40]!r}, expected HDF, Binary or XML")
        return _shaped(values, shape)

    def first(self, element: Element) -> np.ndarray:
        """Return the array of the first DataItem of an element. Raises ClipError."""
        return self.read(self.documents.child(element, "DataItem"))

    def _text(self, item: Element) -> np.ndarray:
        text = item.text or ""
        self.budget.need(TEXT_BYTES * len(text), "DataItem")
        with np.errstate(over="ignore", invalid="ignore"):  # Values that do not fit are refused where they are used.
            return np.array(text.split(), np.float64).astype(_dtype(item))

    def _binary(self, item: Element, shape: tuple[int, ...]) -> np.ndarray:
        """Return the numbers of `shape` in the binary file that a DataItem names, as a flat array, decompressed if
        needed. Raises ClipError if the file is too short."""
        path = self._file_named((item.text or "").strip(), item)
        dtype, count = _dtype(item).newbyteorder(_ORDERS.get(item.get("Endian", "").lower(), "=")), math.prod(shape)
        seek, size = int(item.get("Seek", 0)), path.stat().st_size
        packing = item.get("Compression", "Raw").lower()
        if packing not in ("raw", *_UNPACKERS):
            raise ClipError(f"{path.name}: got data packed by {packing[:40]!r}, expected Raw, Zlib or BZip2")
        is_raw = packing == "raw"
        if not 0 <= seek <= size - (count * dtype.itemsize if is_raw else 0) or min(shape, default=0) < 0:
            raise ClipError(f"{path.name}: got {size} bytes, expected {shape} of {dtype} at {seek}")
        self.budget.need(2 * count * dtype.itemsize + (0 if is_raw else size), path.name)
        if is_raw:
            values = np.fromfile(path, dtype, count, offset=seek)
        else:
            with open(path, "rb") as file:
                file.seek(seek)
                data = _UNPACKERS[packing]().decompress(file.read(), max(count * dtype.itemsize, 1))
            values = np.frombuffer(data[: len(data) - len(data) % dtype.itemsize], dtype)
        return values.astype(dtype.newbyteorder("="))

    def _hdf(self, item: Element, selection: Any = ()) -> np.ndarray:
        """Return the array in the HDF5 dataset that a DataItem names. `selection` has a slice for each axis, () for
        all. Raises ClipError if it is no array of numbers, or too large."""
        text, _, part = (item.text or "").strip().partition("|")
        name, inside = _split(text)
        path = self._file_named(name, item)
        if path not in self._files:
            self._files[path] = _open_hdf(path)
        try:
            check_own(self._files[path], inside, self._allow_outside)
            dataset = self._files[path][inside]
            if not isinstance(dataset, h5py.Dataset) or dataset.shape is None or dataset.dtype.kind not in "fiu":
                raise ClipError(f"{path.name}: {inside[:80]!r}: got no array of numbers")
            if part:
                selection = _selection(
                    *np.array(part.replace(":", " ").split(), np.int64).reshape(-1, len(dataset.shape))[:3]
                )
            size = (
                dataset.nbytes
                if selection == ()
                else dataset.dtype.itemsize
                * math.prod(len(range(*part.indices(length))) for part, length in zip(selection, dataset.shape))
            )
            self.budget.need(2 * size + chunk_bytes(dataset), f"{path.name}: {inside[:80]!r}")
            if unpacks_to_more(dataset, self.budget.left):
                raise ClipError(
                    f"{path.name}: {inside[:80]!r}: got chunks that may unpack to any size, but "
                    + no_room(self.budget.limit)
                )
            return np.asarray(dataset[selection]).astype(dataset.dtype.newbyteorder("="), copy=False)
        except (KeyError, OSError, RuntimeError, TypeError, ValueError) as error:
            if isinstance(error, ClipError):
                raise
            raise ClipError(f"{path.name}: {inside[:80]!r}: cannot be read: {error}") from None

    def _slab(self, item: Element, depth: int) -> np.ndarray:
        """Return the part of an array that a HyperSlab item selects by the start, stride and count of each axis.
        `depth` counts the DataItems around it."""
        children = self.documents.children(item, "DataItem")
        if len(children) != 2:
            raise ClipError(f"HyperSlab: got {len(children)} DataItems, expected two")
        start, stride, count = self.read(children[0], depth + 1).reshape(3, -1).astype(np.int64)
        selection, source = _selection(start, stride, count), children[1]
        is_hdf = source.get("Format", "").upper() == "HDF" and source.get("ItemType", "Uniform") == "Uniform"
        values = self._hdf(source, selection) if is_hdf else self.read(source, depth + 1)[selection]
        return _shaped(values, _shape(item) or tuple(count.tolist()))

    def _function(self, item: Element, depth: int) -> np.ndarray:
        """Return the array that a Function item computes from its operands. `depth` counts the DataItems around it."""
        text = item.get("Function", "")
        operands = [self.read(child, depth + 1) for child in self.documents.children(item, "DataItem")]
        self.budget.need(
            8 * sum(operand.size for operand in operands) * (1 + len(text) // 4), f"Function {text[:40]!r}"
        )
        with np.errstate(all="ignore"):  # Values that are none are refused where they are used.
            return _shaped(np.asarray(_Function(text, operands).value()), _shape(item))

    def _file_named(self, name: str, item: Element) -> Path:
        path = file_beside(self._folder, str(self.documents.folder(item) / name) if name else "", self._allow_outside)
        if not path.is_file():
            raise ClipError(f"DataItem: got the file {name[:80]!r}, which does not exist")
        self.unchanged.add(path)
        return path


class _Function:
    """A function of DataItems, which it calls $0, $1 ..."""

    def __init__(self, text: str, operands: Sequence[np.ndarray]):
        self._text, self._operands = text, operands

    def value(self) -> Any:
        """Return the value of the function's expression. Raises ClipError if it is longer or uses other operations than
        are known."""
        if len(self._text) > LONGEST_FUNCTION:
            raise self._unknown()
        named = re.sub(r"\$(\d+)", r"_\1", self._text).replace(";", f",{AFTER},")
        try:
            return self._of(ast.parse(named.strip(), mode="eval").body)
        except (SyntaxError, RecursionError, MemoryError):
            raise self._unknown() from None

    def _unknown(self) -> ClipError:
        return ClipError(
            f"Function: got {self._text[:80]!r} of {len(self._operands)} DataItems, expected + - * /, JOIN or one of "
            f"{', '.join(name.upper() for name in _FUNCTIONS)} of $0, $1 ..."
        )

    def _of(self, node: ast.expr) -> Any:
        """Return the value of one node of the parsed expression: a number or an array. Raises ClipError for an unknown
        operation."""
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return node.value
        if isinstance(node, ast.Name) and re.fullmatch(r"_\d{1,4}", node.id):
            number = int(node.id[1:])
            if number < len(self._operands):
                return self._operands[number]
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](*self._alike(self._of(node.left), self._of(node.right)))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            return np.multiply(self._of(node.operand), -1 if isinstance(node.op, ast.USub) else 1)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords and node.args:
            if node.func.id.lower() == "join":
                return self._joined(node.args)
            if node.func.id.lower() in _FUNCTIONS and len(node.args) == 1:
                return _FUNCTIONS[node.func.id.lower()](self._of(node.args[0]))
        raise self._unknown()

    def _alike(self, *values: Any) -> tuple[Any, ...]:
        """Return the operands, with arrays reshaped to the shape of the largest one; single numbers stay as they are.
        Raises ClipError if arrays differ in how many numbers they have."""
        shape = max((np.shape(value) for value in values), key=math.prod)
        if any(np.size(value) not in (1, math.prod(shape)) for value in values):
            shapes = " and ".join(str(np.shape(value)) for value in values)
            raise ClipError(
                f"Function: got arrays of {shapes} in {self._text[:80]!r}, expected as many numbers in each"
            )
        return tuple(value if np.size(value) == 1 else np.reshape(value, shape) for value in values)

    def _joined(self, arguments: Sequence[ast.expr]) -> np.ndarray:
        """Return the arrays of JOIN as columns of one array or, if semicolons separate them, one after the other."""
        is_after = [isinstance(each, ast.Name) and each.id == AFTER for each in arguments]
        values = [np.atleast_1d(self._of(each)) for each, after in zip(arguments, is_after) if not after]
        if any(is_after):
            if sum(is_after) != len(values) - 1:
                raise self._unknown()
            return np.concatenate(values)
        return np.stack(self._alike(*(value.reshape(-1) for value in values)), axis=-1)


def _split(text: str) -> tuple[str, str]:
    """Return the file and the place inside of what names a dataset: "a.h5:/mesh/0"."""
    at = text.find(":/", 2)  # Not the colon of a drive.
    name, inside = (text[:at], text[at + 1 :]) if at > 0 else text.rpartition(":")[::2]
    return name.strip(), inside.strip()


def _open_hdf(path: Path) -> h5py.File:
    try:
        return h5py.File(path, "r")
    except OSError as error:
        raise ClipError(f"{path.name}: the HDF5 file cannot be opened: {error}") from None


def _shape(item: Element) -> tuple[int, ...] | None:
    """Return the shape that an item states; None where it states none."""
    return tuple(int(size) for size in item.get("Dimensions", "").split()) or None


def _shaped(values: np.ndarray, shape: tuple[int, ...] | None) -> np.ndarray:
    if shape is None:
        return values
    if min(shape) < 0 or values.size != math.prod(shape):
        raise ClipError(f"DataItem: got {values.size} numbers, expected {shape}")
    return values.reshape(shape)


def _selection(start: np.ndarray, stride: np.ndarray, count: np.ndarray) -> tuple[slice, ...]:
    """Return the slice along each axis that start, stride and count of a HyperSlab mean. Raises ClipError."""
    if (start < 0).any() or (stride < 1).any() or (count < 0).any():
        raise ClipError("HyperSlab: got a negative start or count, expected some of the data")
    return tuple(
        slice(first, first + (n - 1) * step + 1 if n else first, step)
        for first, step, n in zip(start.tolist(), stride.tolist(), count.tolist())
    )


def _dtype(item: Element) -> np.dtype:
    kind = (item.get("NumberType") or item.get("DataType") or "Float").lower()
    size = int(item.get("Precision") or _SIZES.get(kind, 4))
    if kind not in _KINDS or size not in (1, 2, 4, 8) or (_KINDS[kind] == "f" and size < 4):
        raise ClipError(f"DataItem: got numbers of {kind[:40]!r} with {size} bytes")
    return np.dtype(f"{_KINDS[kind]}{size}")
