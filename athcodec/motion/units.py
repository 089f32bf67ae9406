"""Lengths and file sizes as people write them: "1mm", "0.5 cm", "2e-3", "50kB", "1.5MiB". Based on the exact
definitions of the inch (25.4 mm) and the foot (12 inches), and on IEC 80000-13 for sizes."""

from __future__ import annotations

import re
from dataclasses import dataclass

from athcodec.errors import BoundError
from athcodec.options import set_numbers

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
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
_QUANTITY = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)\s*")


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
        scene_unit : str or None
            ``metadata["unit"]`` of the clip.

        Returns
        -------
        float
            A length without a unit is taken to be in the clip's.

        Raises
        ------
        BoundError
            If the length has a unit, and the clip has none or an unknown one.
        """
        if not self.unit:
            return self.value
        if scene_unit in (None, ""):
            raise BoundError(f"length: got {self} for a clip without a unit, expected a plain number")
        metres = METRES.get(unit_symbol(scene_unit))
        if metres is None:
            raise BoundError(
                f"length: got {self} for a clip in {str(scene_unit)!r}, expected a clip in one of "
                f"{', '.join(METRES)}, or a plain number"
            )
        # The quotient first: it is exactly 1 for the scene's own unit.
        return self.value * (METRES[self.unit] / metres)


def parse_length(text: str) -> Length:
    """Read a length.

    Parameters
    ----------
    text : str
        A number, with or without a unit: "2e-3", "1mm", "0.5 cm".

    Returns
    -------
    Length

    Raises
    ------
    BoundError
        If it is none.
    """
    match = _QUANTITY.fullmatch(text)
    if not match or match[2] not in ("", *METRES) or float(match[1]) == float("inf"):
        raise BoundError(
            f"length: got {text!r}, expected a number in scene units or one followed by {', '.join(METRES)}"
        )
    return Length(float(match[1]), match[2])


def parse_size(text: str) -> int:
    """Read a size in bytes.

    Parameters
    ----------
    text : str
        A number, with or without a unit: "50000", "50kB", "1.5MiB".

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
        raise BoundError(f"size: got {text!r}, expected bytes, at least one: 50000, 50kB, 1.5MB or 48KiB")
    return int(size)


def unit_symbol(unit: object) -> str:
    """Return the symbol in METRES of a unit that metadata names in full ("Meters"), or the unit unchanged."""
    name = str(unit).strip()
    return _LONG_NAMES.get(name.lower().removesuffix("s"), name if name in METRES else name.lower())
