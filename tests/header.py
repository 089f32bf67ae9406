"""ath.h in ctypes: its structures, and its functions in the C library, declared from the header alone.

A program's compiler reads the header in the same way, apart from the package's own binding.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from ctypes import c_char_p, c_int, c_void_p

from fuzz.targets import CORE

from athcodec._library import load_library

TEXT = re.sub(r"/\*.*?\*/", "", (CORE / "include" / "ath.h").read_text("utf-8"), flags=re.S).replace("const ", "")
NUMBERS = dict(re.findall(r"(ATH_\w+) = (\d+)", TEXT))
TYPES = {"void": None} | {name: getattr(ctypes, f"c_{name}") for name in ("int", "size_t", "float", "double")}
TYPES |= {f"{name}_t": getattr(ctypes, f"c_{name}") for name in set(re.findall(r"\b(u?int\d+)_t\b", TEXT))}
TYPES |= dict.fromkeys(re.findall(r"typedef enum (\w+)", TEXT), c_int)


def fields_of(body: str) -> Iterator[tuple[str, type]]:
    for kind, names in re.findall(r"(\w+) ([^;]+);", body):
        for name in names.split(","):
            pointer, field, length = re.fullmatch(r"\s*(\**)(\w+)(?:\[(\w+)\])?", name).groups()
            own = (c_char_p if kind == "char" else c_void_p) if pointer else TYPES[kind]
            yield field, own * int(NUMBERS.get(length, length)) if length else own


for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\}", TEXT.replace("*const *", "**"), re.S):
    TYPES[name] = type(name, (ctypes.Structure,), {"_fields_": list(fields_of(body))})

Info, Clip, Limits, Fault = (TYPES[f"ath_{name}"] for name in ("info", "clip", "limits", "fault_info"))
Range, Part, Chunk = (TYPES[f"ath_{name}"] for name in ("range", "part", "chunk"))


class Fade(TYPES["ath_fade"]):
    @property
    def weights(self) -> dict[int, float]:
        """Of the levels; one may be there twice."""
        found: dict[int, float] = {}
        for level, weight in zip(self.level[: self.count], self.weight):
            found[level] = found.get(level, 0.0) + weight
        return found


def declare(library: ctypes.CDLL) -> ctypes.CDLL:
    """Pointers go in as addresses, bytes or references, and come out as pointers to what the header says."""
    pointers = {name: ctypes.POINTER(kind) for name, kind in TYPES.items() if kind} | {"char": c_char_p}
    for result, pointer, name, arguments in re.findall(r"ATH_API (\w+) (\*?)(\w+)\(([^;]*)\);", TEXT):
        function = getattr(library, name)
        function.restype = pointers[result] if pointer else TYPES[result]
        function.argtypes = [c_void_p if "*" in one else TYPES[one.split()[0]] for one in arguments.split(",")]
    return library


core = declare(load_library())
