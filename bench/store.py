"""Results that are saved as they are measured: a JSON file that a long run extends, and that the next run resumes.

A result is identified by a few keys and carries what it depends on (versions, digests); it is up to date as long as
these are the same. It names the command and the commit that made it; of results of the days when they named none, the
commit that stored them is known. The file holds a table for each kind of result: its columns, and one line per row
(null: no such value). Values of text, lists and objects repeat: a row has an index into the distinct values of such a
column.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

Results = list[dict[str, Any]]
STORED_IN = "stored in "  # Before the commit of a result that was measured when results did not name theirs.
IN_BRACKETS = "in brackets those that stored rows which name none"


class Store:
    """Lists of results by name, each result a dictionary; `file` None keeps them in memory alone."""

    def __init__(self, file: Path | None, environment: dict[str, Any], keys: dict[str, Sequence[str]]) -> None:
        self.file, self._environment, self._keys = file, environment, keys
        saved = read(file) if file is not None and file.exists() else {}
        self._results = {name: {self._key(name, result): result for result in saved.get(name, [])} for name in keys}

    def _key(self, name: str, result: dict[str, Any]) -> tuple:
        return tuple(result[key] for key in self._keys[name])

    def find(self, name: str, wanted: dict[str, Any], depends: dict[str, Any] | None = None) -> dict[str, Any] | None:
        """Return the result with these keys, if it depends on exactly `depends` (None: on anything)."""
        result = self._results[name].get(self._key(name, wanted))
        is_right = result is not None and (depends is None or depends == result["depends"])
        return result if is_right else None

    def add(self, name: str, result: dict[str, Any]) -> dict[str, Any]:
        """Add a result to the table `name`, or replace the one with the same key, together with the commit that
        measured it. The file is rewritten in one step. Return the stored result.
        """
        result = result | {name: self._environment[name] for name in ("command", "commit")}
        self._results[name][self._key(name, result)] = result
        if self.file is not None:
            part = self.file.with_name(self.file.name + ".part")
            part.write_text(
                _layout(self._environment | {name: _table_of(results) for name, results in self.contents().items()})
                + "\n"
            )
            os.replace(part, self.file)
        return result

    def contents(self) -> dict[str, Results]:
        return {name: list(results.values()) for name, results in self._results.items()}


def read(file: Path) -> dict[str, Any]:
    """Return the JSON file of any verb; tables of a Store as lists of dictionaries."""
    return {
        name: _results_of(value) if isinstance(value, dict) and "columns" in value else value
        for name, value in json.loads(file.read_text()).items()
    }


def commits(results: Iterable[Mapping[str, Any]]) -> str:
    """Return the commits that made some results; in brackets those that stored a result which does not name its own."""
    names = sorted({result["commit"] for result in results if "commit" in result})
    return " ".join(f"({name.removeprefix(STORED_IN)})" if name.startswith(STORED_IN) else name for name in names)


def _table_of(results: Results) -> dict[str, Any]:
    """Return results as columns and rows, which are shorter as JSON: texts, lists and mappings stand in "distinct", and
    the rows have their numbers.
    """
    columns = list(dict.fromkeys(column for result in results for column in result))
    distinct: dict[str, dict[str, int]] = {
        column: {} for column in columns if any(isinstance(result.get(column), (str, list, dict)) for result in results)
    }

    def cell(column: str, value: Any) -> Any:
        if value is None or column not in distinct:
            return value
        return distinct[column].setdefault(json.dumps(value), len(distinct[column]))

    rows = [[cell(column, result.get(column)) for column in columns] for result in results]
    values = {column: [json.loads(text) for text in texts] for column, texts in distinct.items()}
    return {"columns": columns, "distinct": values, "rows": rows}


def _results_of(table: dict[str, Any]) -> Results:
    """Return the results that `_table_of` has turned into columns and rows."""
    distinct = table["distinct"]
    return [
        {
            column: distinct[column][cell] if column in distinct else cell
            for column, cell in zip(table["columns"], row, strict=True)
            if cell is not None
        }
        for row in table["rows"]
    ]


def _layout(value: Any, newline: str = "\n") -> str:
    """Return a value as JSON text with a line for each value of an object and each item of a list. `newline` is the
    line break with the indentation so far.
    """
    if isinstance(value, dict):
        items = [f"{json.dumps(name)}: {_layout(item, newline + ' ')}" for name, item in value.items()]
    elif isinstance(value, list):
        items = [json.dumps(item, separators=(",", ":")) for item in value]
    else:
        return json.dumps(value)
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return opening + f"{newline} " + f",{newline} ".join(items) + newline + closing
