"""Work that is counted in the place of time, so that a busy machine changes nothing: bytecodes of Python, and basic
blocks of a C core that was compiled to count them."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from fuzz.targets import COMMON, CORE, compiler, decoder_sources

from athcodec import _native

# Hidden, because functions that choose among clones call it while the library is still being loaded.
COUNTER = """
static unsigned long long blocks;
__attribute__((visibility("hidden"))) void __sanitizer_cov_trace_pc(void) { blocks++; }
unsigned long long counted_blocks(void) { return blocks; }
"""


class CountedCore:
    """The decoder of the C core; a function has the signature that the package gives it."""

    def __init__(self, folder: Path):
        (folder / "counter.c").write_text(COUNTER)
        used, library, counter = compiler().path, folder / "libath_counted.so", folder / "counter.o"
        subprocess.run([used, "-fPIC", "-c", folder / "counter.c", "-o", counter], check=True)
        flags = [*COMMON, "-O0", "-g0", f"-I{CORE}", f"-I{CORE / 'include'}", "-fPIC", "-shared"]
        flags.append("-fsanitize-coverage=trace-pc")
        subprocess.run([used, *flags, *decoder_sources(), counter, "-o", library], check=True)
        self._library = ctypes.CDLL(str(library))
        self._library.counted_blocks.restype = ctypes.c_ulonglong

    def __getattr__(self, name: str):
        function, known = getattr(self._library, name), getattr(_native.lib, name)
        function.restype, function.argtypes = known.restype, known.argtypes
        return function

    def work_of(self, action: Callable[[], object]) -> int:
        """Bytecodes and basic blocks that an action executes, in this thread."""
        bytecodes, before = 0, self._library.counted_blocks()

        def trace(frame, event, _):
            nonlocal bytecodes
            frame.f_trace_lines, frame.f_trace_opcodes = False, True
            bytecodes += event == "opcode"
            return trace

        previous = sys.gettrace()
        sys.settrace(trace)
        try:
            action()
        finally:
            sys.settrace(previous)
        return bytecodes + self._library.counted_blocks() - before
