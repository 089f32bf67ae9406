"""Text as people are shown it: what files and servers say can neither steer a terminal nor give away keys. Nothing
heavy is imported, because the command line needs it to explain itself."""

from __future__ import annotations

import html
import io
import re
import sys
from collections.abc import Iterable, Sequence
from typing import Any, Literal, NamedTuple, TextIO
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


class Table(NamedTuple):
    """Names of columns and rows of cells; justify: "right" or "left", of all columns but the first, which is left."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    justify: Literal["right", "left"] = "right"

    def print(self, file: TextIO) -> None:
        """Print the table to an open text file, with columns aligned."""
        from rich import box, console, table, text  # The package takes long to import.

        drawn = table.Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, collapse_padding=True)
        for index, name in enumerate(self.columns):
            drawn.add_column(text.Text(shown(name)), justify=self.justify if index else "left", no_wrap=True)
        for row in self.rows:
            drawn.add_row(*(text.Text(shown(cell)) for cell in row))
        console.Console(file=file, width=_TABLE_WIDTH).print(drawn)

    def text(self) -> str:
        """Return the lines of the table, as `shown`."""
        out = io.StringIO()
        self.print(out)
        return "\n".join(line.rstrip() for line in out.getvalue().splitlines())

    def html(self) -> str:
        """Return the table as HTML, with text that is escaped."""

        def row(cells: Sequence[str], tag: str) -> str:
            return f"<tr>{''.join(f'<{tag}>{html.escape(shown(cell))}</{tag}>' for cell in cells)}</tr>"

        return f"<table>{row(self.columns, 'th')}{''.join(row(cells, 'td') for cells in self.rows)}</table>"


class Report(str):
    """Text of lines and tables; a Python prompt shows it as it is printed, a notebook as HTML."""

    parts: tuple[str | Table, ...]

    def __new__(cls, parts: Iterable[str | Table]) -> Report:
        parts = tuple(parts)
        report = super().__new__(
            cls, "\n".join(part.text() if isinstance(part, Table) else shown(part) for part in parts)
        )
        report.parts = parts
        return report

    def __reduce__(self) -> tuple[Any, ...]:
        return Report, (self.parts,)

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return "".join(
            part.html() if isinstance(part, Table) else f"<div>{html.escape(shown(part))}</div>" for part in self.parts
        )


def print_parts(parts: Iterable[str | Table]) -> None:
    """Print lines of text and tables on standard output, as `shown`."""
    for part in parts:
        if isinstance(part, Table):
            part.print(sys.stdout)
        else:
            echo(part)


def print_table(
    columns: Sequence[str], rows: Sequence[Sequence[str]], justify: Literal["right", "left"] = "right"
) -> None:
    print_parts([Table(columns, rows, justify)])
