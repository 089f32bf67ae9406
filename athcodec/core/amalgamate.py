"""Writes the decoder as one C file, for projects that add a file to their own build.

    python athcodec/core/amalgamate.py ath.c

The file needs ath.h beside it, and nothing else: ``cc -O2 -c ath.c``. What a compiler must not do to its arithmetic it
says itself.
"""

import re
import sys
from pathlib import Path

CORE = Path(__file__).parent
INCLUDE = re.compile(r'^#include "(\w+\.h)".*\n', re.MULTILINE)
PUBLIC = "ath.h"


def decoder_sources() -> list[str]:
    """Names of the decoder's C files, as the build lists them."""
    listed = re.search(r"set\(ATH_DECODER_SOURCES([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    assert listed is not None
    return listed.group(1).split()


def amalgamation() -> str:
    """The decoder's C files, one after the other, each header in front of the first that includes it."""
    seen: set[str] = set()

    def whole(name: str) -> str:
        if name == PUBLIC:
            return f'#include "{PUBLIC}"\n'
        if name.endswith(".h") and name in seen:
            return ""
        seen.add(name)
        return f"/* ---- {name} ---- */\n\n" + INCLUDE.sub(
            lambda found: whole(found.group(1)), (CORE / name).read_text()
        )

    return "\n".join(whole(name) for name in decoder_sources())


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: amalgamate.py OUT.c")
    Path(sys.argv[1]).write_text(amalgamation())
