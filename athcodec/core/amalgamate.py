"""Writes the decoder as one C file, for projects that add a file to their own build.

    python athcodec/core/amalgamate.py ath.c

The file needs only ath.h beside it: ``cc -O2 -c ath.c``. With --gpu it also holds the functions of ath_gpu.h, and needs
that header, too. Its pragmas keep compilers from changing its arithmetic.
"""

import re
import sys
from pathlib import Path

CORE = Path(__file__).parent
INCLUDE = re.compile(r'^#include "([\w/]+\.(?:h|inl))".*\n', re.MULTILINE)
PUBLIC = "ath.h", "ath_gpu.h"


def listed(name: str) -> list[str]:
    """Return the C files of a list in CMakeLists.txt."""
    match = re.search(rf"set\({name}([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    assert match is not None
    return match.group(1).split()


def decoder_sources() -> list[str]:
    """Return the names of the decoder's C files."""
    return listed("ATH_DECODER_SOURCES")


def amalgamation(gpu: bool = False) -> str:
    """Return the decoder's C files as one text, each header in front of the first file that includes it.

    With `gpu`, the files of ath_gpu.h follow.
    """
    seen: set[str] = set()

    def whole(name: str) -> str:
        if name in PUBLIC:
            return f'#include "{name}"\n'
        if not name.endswith(".c") and name in seen:
            return ""
        seen.add(name)
        return f"/* ---- {name} ---- */\n\n" + INCLUDE.sub(
            lambda match: whole(match.group(1)), (CORE / name).read_text()
        )

    return "\n".join(whole(name) for name in decoder_sources() + (listed("ATH_GPU_SOURCES") if gpu else []))


if __name__ == "__main__":
    paths = [argument for argument in sys.argv[1:] if argument != "--gpu"]
    if len(paths) != 1:
        sys.exit("usage: amalgamate.py [--gpu] OUT.c")
    Path(paths[0]).write_text(amalgamation(gpu="--gpu" in sys.argv))
