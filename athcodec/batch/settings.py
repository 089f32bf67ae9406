"""Settings of a clip in a batch: what may be said in a TOML file or on the command line, and what encoding and reading
make of it. They are plain JSON, for they are kept in the manifest and compared with those of the next run.

A file is a table of patterns (fnmatch) to settings; of all patterns that a clip's name fits, later ones win:

    ["*"]
    rel_error = 1e-4
    ["oaks/*.abc"]
    max_error = "1mm"
    effort = "best"
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from fractions import Fraction
from pathlib import Path

from athcodec.encoding.options.shape import RestPrecision
from athcodec.errors import ClipError
from athcodec.files.atomic import is_url
from athcodec.files.plain import FilePath
from athcodec.motion.positions import parse_order, written
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import AXES, METRES, parse_length, parse_size
from athcodec.options import EFFORTS, HOST, MAX_SEGMENT, METHODS, MIN_SEGMENT, SMOOTHNESS, ladder_of
from athcodec.sources import format_named, formats
from athcodec.untyped import JsonMapping, JsonObject, JsonValue, Keywords

BOUNDS = ("max_error", "rel_error", "target_size")  # A clip is encoded with exactly one of these.
READING = (
    "source_format",
    "rest",
    "fps",
    "mesh",
    "field",
    "dataset",
    "axes",
    "only",
    "takes",
    "allow_outside",
    "max_memory",
    "unit",
    "up_axis",
)
# These settings change a clip before it is encoded, or say what is expected of it.
SHAPING = ("hierarchy", "loop", "loop_blend", "still", "strength", "heading")

Settings = JsonObject


def load_settings(path: FilePath) -> dict[str, Settings]:
    """Read the settings of a batch from a TOML file.

    Parameters
    ----------
    path : str or path
        A TOML file with a table of settings under each pattern of clip names (as in fnmatch). If a name matches
        several patterns, later ones win. Paths in the file are relative to its folder.

    Returns
    -------
    dict of str to dict
        Checked settings by pattern, in the order of the file.

    Raises
    ------
    ClipError
        If the file is no TOML, or a setting does not exist or has a value that it cannot have.
    OSError
        If the file cannot be opened.
    """
    with open(path, "rb") as file:
        try:
            content = tomllib.load(file)
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ClipError(f"{os.fspath(path)}: got no TOML: {error}") from None
    for pattern, settings in content.items():
        where = f'{os.fspath(path)}: ["{pattern}"]'
        if not isinstance(settings, dict):
            raise ClipError(f"{where}: got {settings!r}, expected a table of settings under a pattern")
        content[pattern] = check_settings(settings, where, Path(path).resolve().parent)
    return content


def check_settings(settings: JsonMapping, where: str = "settings", folder: FilePath = ".") -> Settings:
    """Check the settings of clips, and bring them to the form in which the manifest has them.

    Parameters
    ----------
    settings : dict
        Values by name. Names are keywords of `athcodec.encode` and of `athcodec.read` (whose format is called
        source_format), hierarchy, loop, loop_blend, still, strength and heading. Lengths and sizes may be text with a
        unit, such as "1mm".
    where : str, optional
        Text that error messages begin with.
    folder : str or path, optional
        The folder that relative paths in the settings start from.

    Returns
    -------
    dict
        The settings with absolute paths, and numbers as numbers.

    Raises
    ------
    ClipError
        If a setting does not exist or has a value that it cannot have.
    """
    checked = {}
    for name, value in settings.items():
        if name not in _CHECKS:
            raise ClipError(f"{where}: got the unknown setting {name!r}, expected one of {', '.join(_CHECKS)}")
        try:
            checked[name] = _CHECKS[name](value)
        except (ValueError, TypeError, ArithmeticError) as error:
            raise ClipError(f"{where}: {name}: got {value!r}: {error}") from None
        if name == "mesh" or name == "hierarchy" and value not in ("auto", *METHODS):
            checked[name] = os.path.abspath(os.path.join(folder, checked[name]))
    bounds = [name for name in BOUNDS if name in checked]
    if len(bounds) > 1:
        raise ClipError(f"{where}: got {' and '.join(bounds)}, expected one of them")
    return checked


def settings_of(names: tuple[str, ...], default: Settings, patterns: Mapping[str, Settings]) -> Settings:
    """Return the settings of a clip: `default`, then the settings of each pattern that matches one of `names`, in
    order, so that later ones override earlier ones. If a pattern sets an error bound or file size, it replaces such
    limits of every kind."""
    merged = dict(default)
    for pattern, settings in patterns.items():
        if any(fnmatchcase(name, pattern) for name in names):
            if any(bound in settings for bound in BOUNDS):
                merged = {name: value for name, value in merged.items() if name not in BOUNDS}
            merged |= settings
    return merged


def loop_frames(settings: Settings) -> int | None:
    """Return how many frames of a clip are blended to make a loop of it; None where it is to be none."""
    blend = settings.get("loop_blend", 0)
    return blend if settings.get("loop", blend > 0) else None


def reading_options(settings: Settings) -> Keywords:
    """Return keywords of athcodec.read."""
    options = {name: settings[name] for name in READING if name in settings}
    if options.get("rest") == HOST:  # how it is stored
        del options["rest"]
    if "source_format" in options:
        options["format"] = options.pop("source_format")
    return options


def coding_options(settings: Settings) -> Keywords:
    """Return keywords of athcodec.encode."""
    options = {name: value for name, value in settings.items() if name not in READING + SHAPING}
    if settings.get("rest") == HOST:
        options["host_rest"] = True
    if "tam" in options:
        options["tam"] = Thresholds(*options["tam"])
    return options


def _positive_length(value: JsonValue) -> float | str:
    if isinstance(value, bool) or not parse_length(str(value)).value > 0:
        raise ValueError("expected a length above 0")
    return value


def _rest_error(value: JsonValue) -> float | str:
    if isinstance(value, bool):
        raise ValueError("expected a fraction, a length or 'bound'")
    RestPrecision.of(value)
    return value


def _fraction(value: JsonValue) -> float:
    if isinstance(value, bool) or not 0 < float(value) < 1:
        raise ValueError("expected a number between 0 and 1")
    return float(value)


def _finite(value: JsonValue) -> float:
    if isinstance(value, bool) or not math.isfinite(float(value)):
        raise ValueError("expected a number")
    return float(value)


def _size(value: JsonValue) -> int:
    if isinstance(value, bool):
        raise ValueError("expected a size in bytes")
    return parse_size(str(value))


def _whole(low: int, high: int) -> Callable[[JsonValue], int]:
    """Return a check that a setting is a whole number from `low` to `high`, which raises ValueError."""

    def check(value: JsonValue) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise ValueError(f"expected a whole number, {low} to {high}")
        return value

    return check


def _tam(value: JsonValue) -> list[JsonValue]:
    """Return the four thresholds of the acceptance test, EPS, ETA, XI and LAMBDA, from a list or from text with commas.
    Raises ValueError."""
    parts = value.split(",") if isinstance(value, str) else list(value)
    if len(parts) != 4:
        raise ValueError("expected four values: EPS, ETA, XI, LAMBDA")
    epsilon, eta, xi, lam = parts
    for length in (epsilon, xi):
        parse_length(str(length))
    eta, lam = int(eta), int(lam)
    if min(eta, lam) < 0:
        raise ValueError("expected ETA and LAMBDA to be whole numbers, 0 or more")
    return [epsilon, eta, xi, lam]


def _rate(value: JsonValue) -> float:
    rate = float(Fraction(value)) if isinstance(value, str) else float(value)
    if isinstance(value, bool) or not 0 < rate < math.inf:
        raise ValueError("expected a number above 0 or a fraction such as 24000/1001")
    return rate


def _format(value: JsonValue) -> str:
    return format_named(value, formats()).name


def _of_kind(kind: type, words: str) -> Callable[[JsonValue], JsonValue]:
    """Return a check that a setting has a Python type, which raises ValueError with `words` for what is expected."""

    def check(value: JsonValue) -> JsonValue:
        if not isinstance(value, kind):
            raise ValueError(f"expected {words}")
        return value

    return check


def _one_of(*names: str) -> Callable[[JsonValue], str]:
    """Return a check that a setting is one of these names, which raises ValueError."""

    def check(value: JsonValue) -> str:
        if value not in names:
            raise ValueError(f"expected one of {', '.join(names)}")
        return value

    return check


def _patterns(value: JsonValue) -> list[str]:
    patterns = [value] if isinstance(value, str) else list(value)
    if not all(isinstance(pattern, str) for pattern in patterns):
        raise ValueError("expected a pattern or a list of them")
    return patterns


def _path(value: JsonValue) -> str:
    if not isinstance(value, (str, os.PathLike)) or is_url(value):
        raise ValueError("expected a local file")
    return os.fspath(value)


_BOOL, _TEXT = _of_kind(bool, "true or false"), _of_kind(str, "text")
_CHECKS: dict[str, Callable[[JsonValue], JsonValue]] = {
    "max_error": _positive_length,
    "rel_error": _fraction,
    "target_size": _size,
    "segment_frames": _whole(MIN_SEGMENT, MAX_SEGMENT),
    "tam": _tam,
    "hierarchy": _path,
    "rest_error": _rest_error,
    "exact_rest": _BOOL,
    "lossless": _BOOL,
    "weights": _TEXT,
    "attributes": _one_of("all", "none"),
    "effort": _one_of(*EFFORTS),
    "smoothness": _one_of(*SMOOTHNESS),
    "ladder": lambda value: list(ladder_of(value)),
    "source_format": _format,
    "rest": _one_of("auto", "first", "mean", HOST),
    "fps": _rate,
    "mesh": _path,
    "field": _TEXT,
    "dataset": _TEXT,
    "axes": lambda value: written(parse_order(value)),
    "only": _patterns,
    "takes": _patterns,
    "allow_outside": _BOOL,
    "max_memory": _size,
    "unit": _one_of(*METRES),
    "up_axis": _one_of(*AXES),
    "loop": _BOOL,
    "loop_blend": _whole(0, 1 << 31),
    "still": _BOOL,
    "strength": _finite,
    "heading": _finite,
}
