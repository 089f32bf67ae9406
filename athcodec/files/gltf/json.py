"""Members of the JSON objects of a glTF file, checked: each function takes one by its key, or raises ClipError."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar, cast

import numpy as np

from athcodec.errors import ClipError
from athcodec.untyped import JsonMapping, JsonObject, JsonValue

Key = TypeVar("Key", bound=int | str)
Entry = TypeVar("Entry")

BROKEN = (LookupError, AttributeError, MemoryError, OverflowError, RecursionError, TypeError, ValueError)
"""What a reader may stumble on in a file that keeps to no rule."""


def entry(holder: JsonMapping, key: str) -> JsonObject:
    """Return the object `key` of another. Raises ClipError."""
    value = holder.get(key)
    if not isinstance(value, dict):
        raise ClipError(f"{key}: got {brief(value)}, expected an object")
    return value


def extension(holder: JsonMapping, name: str) -> JsonObject | None:
    """Return the object of an extension of a part of the file, or None. Raises ClipError."""
    extensions = holder.get("extensions")
    return entry(extensions, name) if isinstance(extensions, dict) and name in extensions else None


def entries(holder: JsonMapping, key: str) -> list[JsonObject]:
    """Return the array of objects `key`, empty if there is none. Raises ClipError."""
    return _array(holder, key, lambda value: isinstance(value, dict), "objects")


def integer(holder: JsonMapping, key: str, default: int | None = None, low: int = 0, stop: int = 1 << 53) -> int:
    """Return the whole number `key`, from `low` to `stop` - 1. Raises ClipError."""
    value = holder.get(key, default)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value < stop:
        raise ClipError(f"{key}: got {brief(value)}, expected a whole number from {low} to {stop - 1}")
    return value


def indices(holder: JsonMapping, key: str) -> list[int]:
    """Return the array of whole numbers `key`, empty if there is none. Raises ClipError."""
    return _array(holder, key, lambda value: type(value) is int and value >= 0, "indices")


def _array(holder: JsonMapping, key: str, is_valid: Callable[[JsonValue], bool], expected: str) -> list[JsonValue]:
    value = holder.get(key)
    if value is None:
        return []
    if not isinstance(value, list) or not all(map(is_valid, value)):
        raise ClipError(f"{key}: got {brief(value)}, expected an array of {expected}")
    return value


def vector(holder: JsonMapping, key: str, default: list[float]) -> np.ndarray:
    """Return the array of as many finite numbers as `default` has, float64. Raises ClipError."""
    value = holder.get(key, default)
    if not isinstance(value, list) or len(value) != len(default) or any(type(n) not in (int, float) for n in value):
        raise ClipError(f"{key}: got {brief(value)}, expected {len(default)} numbers")
    return np.array([float(number) for number in value])


def brief(value: JsonValue) -> str:
    """Return a value for a message, cut off if it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def looked_up(table: Mapping[Key, Entry], key: JsonValue, subject: str) -> Entry:
    """Return the entry `key` of a table of what glTF allows. Raises ClipError."""
    if not isinstance(key, (int, str)) or key not in table:
        raise ClipError(f"{subject}: got {brief(key)}, expected one of {', '.join(map(str, table))}")
    return table[cast(Key, key)]
