"""Results that are kept as they come: a JSON file that a long run adds to, and that the next run takes up.

A result is known by a few keys and carries what it depends on (versions, digests); it counts as measured as
long as that is what it would depend on now.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any


class Store:
    """Lists of results by name, each result a dictionary; `file` None keeps them in memory alone."""

    def __init__(self, file: Path | None, environment: dict[str, Any],
                 keys: dict[str, Sequence[str]]) -> None:
        self.file, self._environment, self._keys = file, environment, keys
        there = json.loads(file.read_text()) if file is not None and file.exists() else {}
        self._results = {name: {self._key(name, result): result for result in there.get(name, [])}
                         for name in keys}

    def _key(self, name: str, result: dict[str, Any]) -> tuple:
        return tuple(result[key] for key in self._keys[name])

    def find(self, name: str, wanted: dict[str, Any],
             depends: dict[str, Any] | None = None) -> dict[str, Any] | None:
        """The result with these keys, where it depends on the very same (None: on whatever)."""
        result = self._results[name].get(self._key(name, wanted))
        return result if result is not None and depends in (None, result["depends"]) else None

    def add(self, name: str, result: dict[str, Any]) -> dict[str, Any]:
        """Adds or replaces a result, made by this command, and writes the file, whole or not at all."""
        result = result | {"command": self._environment["command"]}
        self._results[name][self._key(name, result)] = result
        if self.file is not None:
            part = self.file.with_name(self.file.name + ".part")
            part.write_text(json.dumps(self._environment | self.contents(), indent=1) + "\n")
            os.replace(part, self.file)
        return result

    def contents(self) -> dict[str, list[dict[str, Any]]]:
        return {name: list(results.values()) for name, results in self._results.items()}
