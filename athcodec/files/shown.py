"""Text as people are shown it: what files and servers say can neither steer a terminal nor give away keys. Nothing
heavy is imported, because the command line needs it to explain itself."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from typing import TextIO
from urllib.parse import urlsplit

_TABLE_WIDTH = 250  # Characters, more than any table takes: a narrow terminal wraps lines, and nothing is left out.
_UNSAFE = re.compile("[\\x00-\\x09\\x0b-\\x1f\\x7f-\\x9f\\u061c\\u200e\\u200f\\u2028-\\u202e\\u2066-\\u2069]")
_USER = re.compile(r"(?<=://)[^\s/?#'\"<>]*@")
_QUERY = re.compile(r"(://[^\s?#'\"<>]*)([?#][^\s'\"<>]*)")
_VALUE = re.compile(r"(?<==)[^&;#\s'\"<>]+")


def shown(text: str) -> str:
    """Return lines of `text` without controls, and with the URLs in it as `redacted`."""
    return escaped(redacted(text))


def escaped(text: str) -> str:
    """Return lines of `text` without what moves a cursor, sets colours or turns the direction of writing."""
    return _UNSAFE.sub(lambda match: ascii(match[0])[1:-1], text)


def redacted(text: str) -> str:
    """Return `text` without users, passwords and the values of queries in URLs, which may be keys."""
    if "://" not in text:
        return text
    return _QUERY.sub(lambda match: match[1] + _VALUE.sub("...", match[2]), _USER.sub("", text))


def without_secrets(url: str) -> str:
    """Return a URL as messages show it, without user, password and query."""
    parts = urlsplit(url)
    return f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"


def echo(text: str, *, file: TextIO | None = None, flush: bool = False) -> None:
    """Print lines of text, as `shown`."""
    print(shown(text), file=file, flush=flush)


def counted(number: int, one: str, many: str = "") -> str:
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], justify: str = "right") -> None:
    from rich.box import SIMPLE_HEAD  # The package takes long to import.
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, collapse_padding=True)
    for index, name in enumerate(columns):
        table.add_column(Text(shown(name)), justify=justify if index else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(shown(cell)) for cell in row))
    Console(file=sys.stdout, width=_TABLE_WIDTH).print(table)
