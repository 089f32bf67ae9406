"""Formats of all packages, found by their entry points in the groups `athcodec.sources` and `athcodec.exporters`.

An entry point names a Format, or several of them, in a module that is quick to import; `Format.module` is the module
that reads or writes. athcodec's own formats are such an entry point, too. It is known without metadata, so that they
are there in a folder of sources, a ZIP file and Pyodide, and it is asked first, so that nobody waits for a search who
needs no other format.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from athcodec.errors import SourceWarning

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from athcodec.sources import Format

OURS = "athcodec"
SUFFIX = re.compile(r"\.[^A-Z/\\]+")


@cache
def registered(group: str) -> tuple[Format, ...]:
    """Return the formats of an entry point group, such as "athcodec.sources": athcodec's own, then those of other
    packages in the order of their entry points' names.

    A format that cannot be loaded, or whose name is taken, is left out with a SourceWarning.
    """
    from importlib.metadata import EntryPoint, entry_points  # This import takes longer than that of athcodec.

    bundled = EntryPoint(OURS, f"{group}:FORMATS", group)
    others = sorted(entry_points(group=group), key=lambda point: (point.name, point.value))
    formats = {form.name: form for form in bundled.load()}
    for point in others:
        for form in _formats_of(point) if point.value != bundled.value else ():
            if form.name in formats:
                owner = formats[form.name].package or OURS
                _warn(point, f"its format {form.name!r} is left out, because {owner} has one of that name")
            else:
                formats[form.name] = form
    return tuple(formats.values())


def _formats_of(point: EntryPoint) -> Iterator[Format]:
    """Yield the formats that the entry point of another package names. What cannot be loaded, or is no usable format,
    is left out with a SourceWarning."""
    from athcodec.sources import Format

    try:
        loaded = point.load()
    except Exception as error:  # Nobody knows what another package raises.
        _warn(point, f"cannot be loaded: {type(error).__name__}: {error}; update or uninstall it")
        return
    for form in loaded if isinstance(loaded, (tuple, list)) else (loaded,):
        if isinstance(form, Format) and form.module and form.suffixes and all(map(SUFFIX.fullmatch, form.suffixes)):
            yield replace(form, package=_package(point))
        else:
            _warn(point, f"got {form!r:.200}, expected an athcodec.sources.Format with suffixes (.name) and a module")


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist else point.module.partition(".")[0]


def _warn(point: EntryPoint, text: str) -> None:
    warnings.warn(
        f"{_package(point)}, entry point {point.name!r} of {point.group}: {text}", SourceWarning, stacklevel=2
    )
