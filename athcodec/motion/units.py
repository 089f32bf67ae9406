"""Units and axes of clips, and lengths and file sizes as people write them: "1mm", "0.5 cm", "2e-3", "50kB", "1.5MiB".
Based on the exact definitions of the inch (25.4 mm) and the foot (12 inches), and on IEC 80000-13 for sizes."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, TypeAlias

from athcodec.errors import BoundError, ClipError
from athcodec.options import real, set_numbers
from athcodec.untyped import JsonMapping, JsonValue

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
AXES = ("x", "y", "z")
METRES_PER_UNIT = "meters_per_unit"  # Key of metadata: the unit of a clip that no symbol of METRES names.
BYTES = {
    "": 1,
    "B": 1,
    "kB": 1000,
    "KB": 1000,
    "MB": 1000**2,
    "GB": 1000**3,
    "KiB": 1024,
    "MiB": 1024**2,
    "GiB": 1024**3,
}

_LONG_NAMES = {
    "metre": "m",
    "meter": "m",
    "centimetre": "cm",
    "centimeter": "cm",
    "millimetre": "mm",
    "millimeter": "mm",
    "kilometre": "km",
    "kilometer": "km",
    "inch": "in",
    "inche": "in",
    "foot": "ft",
    "feet": "ft",
}
_QUANTITY = re.compile(r"\s*((?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)\s*")


@dataclass(frozen=True)
class Length:
    """A length that a person wrote.

    Parameters
    ----------
    value : float
        At least 0.
    unit : str, optional
        "m", "cm", "mm", "km", "in" or "ft"; "" for the units of the clip.
    """

    value: float
    unit: str = ""

    def __post_init__(self) -> None:
        set_numbers(self, reals=("value",))

    def __str__(self) -> str:
        return f"{self.value:g}{self.unit}"

    def in_scene_units(self, scene_unit: object) -> float:
        """Return the length in the units of a clip.

        Parameters
        ----------
        scene_unit : str, float or None
            The clip's unit: its name, or its length in metres (`scene_unit` of the clip's metadata).

        Returns
        -------
        float
            The length in the clip's unit. A length without a unit is taken to be in that unit already.

        Raises
        ------
        BoundError
            If the length has a unit, and the clip has none or an unknown one.
        """
        if not self.unit:
            return self.value
        if scene_unit in (None, ""):
            raise BoundError(
                f"length: got {self} for a clip without a unit, expected a plain number, or a clip that states its "
                'unit; --unit m (unit="m") states metres'
            )
        metres = scene_unit if isinstance(scene_unit, float) else METRES.get(unit_symbol(scene_unit))
        if metres is None:
            raise BoundError(
                f"length: got {self} for a clip in {str(scene_unit)!r}, expected a clip in one of "
                f"{', '.join(METRES)}, or a plain number"
            )
        # The quotient first: it is exactly 1 for the scene's own unit.
        return self.value * (METRES[self.unit] / metres)


LengthLike: TypeAlias = float | str | Length
"""A length as a caller passes it: a number in scene units, or text with or without a unit, such as "1mm"."""


def parse_length(text: str, name: str = "length") -> Length:
    """Read a length.

    Parameters
    ----------
    text : str
        A number, with or without a unit: "2e-3", "1mm", "0.5 cm".
    name : str, optional
        The name that an error message begins with.

    Returns
    -------
    Length

    Raises
    ------
    BoundError
        If it is none.
    """
    match = _QUANTITY.fullmatch(text)
    if not match or match[2] not in ("", *METRES) or float(match[1]) == math.inf:
        raise BoundError(
            f"{name}: got {text!r}, expected a number in scene units or one followed by {', '.join(METRES)}"
        )
    return Length(float(match[1]), match[2])


def length_of(length: Any, name: str = "length") -> Length:
    """Return a length that a caller passes as LengthLike; numbers may be NaN, infinite or negative.

    Parameters
    ----------
    length : float, str or Length
        A number in scene units, or text as `parse_length` takes it.
    name : str, optional
        The name that an error message begins with.

    Returns
    -------
    Length

    Raises
    ------
    BoundError
        If it is text that is no length.
    TypeError
        If it is neither text nor a number.
    """
    if isinstance(length, Length):
        return length
    if isinstance(length, str):
        return parse_length(length, name)
    return Length(real(name, length, 'such as 0.01, or text such as "1cm"'))


def parse_size(text: str, name: str = "size") -> int:
    """Read a size in bytes.

    Parameters
    ----------
    text : str
        A number, with or without a unit: "50000", "50kB", "1.5MiB".
    name : str, optional
        The name that an error message begins with.

    Returns
    -------
    int
        Bytes, at least 1.

    Raises
    ------
    BoundError
        If it is none.
    """
    match = _QUANTITY.fullmatch(text)
    size = float(match[1]) * BYTES[match[2]] if match and match[2] in BYTES else 0.0
    if not 1 <= size < 2**63:
        raise BoundError(f"{name}: got {text!r}, expected bytes, at least one: 50000, 50kB, 1.5MB or 48KiB")
    return int(size)


def size_of(size: Any, name: str = "size") -> int:
    """Return a size in bytes that a caller passes: a number, or text as `parse_size` takes it.

    Parameters
    ----------
    size : int, float or str
        Bytes.
    name : str, optional
        The name that an error message begins with.

    Returns
    -------
    int
        Bytes; a number is returned whatever it is.

    Raises
    ------
    BoundError
        If it is text that is no size, or not finite.
    TypeError
        If it is neither text nor a number.
    """
    if isinstance(size, str):
        return parse_size(size, name)
    number = real(name, size, 'of bytes, or text such as "50kB"')
    if not math.isfinite(number):
        raise BoundError(f"{name}: got {number}; expected a finite number of bytes")
    return int(number)


def unit_symbol(unit: object) -> str:
    """Return the symbol in METRES of a unit that metadata names in full ("Meters"), or the unit unchanged."""
    name = str(unit).strip()
    return _LONG_NAMES.get(name.lower().removesuffix("s"), name if name in METRES else name.lower())


def scene_unit(metadata: JsonMapping) -> JsonValue:
    """Return the unit of a clip for `Length.in_scene_units`: its name, its length in metres, or None."""
    return metadata.get("unit") or metres_of(metadata)


def metres_of(metadata: JsonMapping) -> float | None:
    """Return the length of a clip's unit in metres; None if its metadata state none that is known."""
    metres = METRES.get(unit_symbol(metadata.get("unit") or ""), metadata.get(METRES_PER_UNIT))
    if isinstance(metres, (int, float)) and not isinstance(metres, bool) and 0 < metres < math.inf:
        return float(metres)
    return None


def checked_unit(unit: JsonValue, name: str = "unit") -> str:
    """Return a unit that an option names, a symbol of METRES.

    Parameters
    ----------
    unit : str
        "m", "cm", "mm", "km", "in" or "ft".
    name : str, optional
        The name that an error message begins with.

    Returns
    -------
    str

    Raises
    ------
    ClipError
        For anything else; the message lists the units, and names the one that was probably meant.
    """
    if isinstance(unit, str) and unit in METRES:
        return str(unit)
    near = unit_symbol(unit.decode("utf-8", "replace") if isinstance(unit, bytes) else unit)
    hint = f"; did you mean {near!r}?" if near in METRES else ""
    raise ClipError(f"{name}: got {unit!r:.80}, expected one of {', '.join(METRES)}{hint}")


def checked_axis(axis: JsonValue, name: str = "up_axis") -> str:
    """Return an axis that an option names.

    Parameters
    ----------
    axis : str
        "x", "y" or "z".
    name : str, optional
        The name that an error message begins with.

    Returns
    -------
    str

    Raises
    ------
    ClipError
        For anything else; the message lists the axes, and names the one that was probably meant.
    """
    if isinstance(axis, str) and axis in AXES:
        return str(axis)
    near = re.fullmatch(r"\s*\+?([xyz])(?:[ _-]?(?:up|axis))?\s*", str(axis).lower())
    hint = f"; did you mean {near[1]!r}?" if near else ""
    raise ClipError(f"{name}: got {axis!r:.80}, expected one of {', '.join(AXES)}{hint}")


def stated_scene(metadata: JsonMapping) -> dict[str, str]:
    """Return the unit and the up axis that metadata state, as the options name them: "Meters" is "m", "Z" is "z".

    Parameters
    ----------
    metadata : mapping
        Metadata of a clip. An axis that points down is written with a minus sign ("-z"), which stays.

    Returns
    -------
    dict of str to str
        "unit" and "up_axis", where they are stated.

    Raises
    ------
    ClipError
        If the stated unit or axis is none that athcodec knows.
    """
    stated = {name: metadata[name] for name in ("unit", "up_axis") if metadata.get(name) not in (None, "")}
    if "unit" in stated:
        stated["unit"] = checked_unit(symbol if (symbol := unit_symbol(stated["unit"])) in METRES else stated["unit"])
    if "up_axis" in stated:
        name = str(stated["up_axis"]).strip().lower()
        stated["up_axis"] = name if name.removeprefix("-") in AXES else checked_axis(stated["up_axis"])
    return stated
