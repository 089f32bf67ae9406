"""Operators, functions and methods of NumPy for an array that is decoded when it is used."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin


class _Method:
    """A method of numpy.ndarray, called on the decoded array."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name
        self.__doc__ = getattr(np.ndarray, name).__doc__

    def __get__(self, instance: Any, owner: type) -> Any:
        """Return a function that decodes the array `instance` and calls this method of numpy.ndarray on it."""

        def method(*arguments: Any, **options: Any) -> Any:
            return getattr(np.asarray(instance), self._name)(*arguments, **options)

        if instance is None:
            return self
        method.__name__, method.__qualname__ = self._name, f"{owner.__name__}.{self._name}"
        method.__doc__ = self.__doc__
        return method


class ArrayLike(NDArrayOperatorsMixin):
    """An array that can be read and not written. A subclass has `shape`, `dtype` and `__array__`.

    Every operator, function and method decodes the whole array and returns what NumPy makes of it, an array of its own.
    """

    if TYPE_CHECKING:

        @property
        def shape(self) -> tuple[int, ...]: ...
        @property
        def dtype(self) -> np.dtype: ...

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of items."""
        return math.prod(self.shape)

    @property
    def itemsize(self) -> int:
        """Bytes of an item."""
        return self.dtype.itemsize

    @property
    def nbytes(self) -> int:
        """Bytes of the whole array once it is decoded."""
        return self.size * self.itemsize

    @property
    def T(self) -> np.ndarray:
        """The decoded array with its axes reversed."""
        return np.asarray(self).T

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if any(isinstance(out, ArrayLike) for out in options.get("out", ())):
            raise TypeError(f"out: got a {type(self).__name__}, which is read-only; expected an array")
        return getattr(ufunc, method)(*map(_decoded, inputs), **options)

    # The ufuncs behind == refuse what has no numbers, such as text; arrays do not.
    def __eq__(self, other: Any) -> Any:
        return np.asarray(self) == _decoded(other)

    def __ne__(self, other: Any) -> Any:
        return np.asarray(self) != _decoded(other)

    __hash__ = None  # type: ignore[assignment]  # Arrays have none, because == compares their items.

    def __contains__(self, item: Any) -> bool:
        return item in np.asarray(self)

    all = _Method()
    any = _Method()
    argmax = _Method()
    argmin = _Method()
    argpartition = _Method()
    argsort = _Method()
    astype = _Method()
    choose = _Method()
    compress = _Method()
    conj = _Method()
    conjugate = _Method()
    copy = _Method()
    cumprod = _Method()
    cumsum = _Method()
    diagonal = _Method()
    dot = _Method()
    flatten = _Method()
    item = _Method()
    max = _Method()
    mean = _Method()
    min = _Method()
    nonzero = _Method()
    prod = _Method()
    ravel = _Method()
    repeat = _Method()
    reshape = _Method()
    round = _Method()
    searchsorted = _Method()
    squeeze = _Method()
    std = _Method()
    sum = _Method()
    swapaxes = _Method()
    take = _Method()
    tobytes = _Method()
    tofile = _Method()
    tolist = _Method()
    trace = _Method()
    transpose = _Method()
    var = _Method()
    view = _Method()

    if not TYPE_CHECKING:  # Type checkers take other names for mistakes.

        def __getattr__(self, name: str) -> Any:
            """Raise AttributeError, which names the way to what only a whole array has: `sort`, `strides` ..."""
            hint = "; np.asarray of it has" if not name.startswith("_") and hasattr(np.ndarray, name) else ""
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}", name=name, obj=self)


def _decoded(value: Any) -> Any:
    """Return the array of an ArrayLike; anything else as it is."""
    return np.asarray(value) if isinstance(value, ArrayLike) else value
