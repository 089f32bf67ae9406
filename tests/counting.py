"""Work that is counted in the place of time, so that a busy machine changes nothing: bytecodes of Python, and basic
blocks of a C core that was compiled to count them."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from fuzz.targets import COMMON, CORE, compiler, decoder_sources
from programs import install_once

from athcodec import _native

CALL = 0  # PyTrace_CALL of Python's C API
OPCODE = 7  # PyTrace_OPCODE of Python's C API

# Hidden, because functions that choose among clones call it while the library is still being loaded. Python calls
# `trace` for every event: one in Python would take most of the time of what it counts.
COUNTER = f"""
typedef int setter(void *object, const char *name, void *value);
static unsigned long long counted;
static setter *set;
static void *yes;
__attribute__((visibility("hidden"))) void __sanitizer_cov_trace_pc(void) {{ counted++; }}
unsigned long long counted_work(void) {{ return counted; }}
void trace_with(setter *set_attribute, void *true_object) {{ set = set_attribute, yes = true_object; }}
int trace(void *self, void *frame, int what, void *argument) {{
    counted += what == {OPCODE};
    return what == {CALL} ? set(frame, "f_trace_opcodes", yes) : 0;
}}
"""


def build(library: Path) -> None:
    """Compile the decoder of the C core so that it counts."""
    used, source, counter = compiler().path, library.with_name("counter.c"), library.with_name("counter.o")
    source.write_text(COUNTER)
    subprocess.run([used, "-fPIC", "-c", source, "-o", counter], check=True)
    flags = [*COMMON, "-O0", "-g0", f"-I{CORE}", f"-I{CORE / 'include'}", "-fPIC", "-shared"]
    flags.append("-fsanitize-coverage=trace-pc")
    subprocess.run([used, *flags, *decoder_sources(), counter, "-o", library], check=True)


class CountedCore:
    """The decoder of the C core; a function has the signature that the package gives it."""

    def __init__(self, folder: Path):
        """Load it from a folder, where the first process that asks for it compiles it."""
        library = folder / "libath_counted.so"
        install_once(folder, library.name, lambda: build(library))
        self._library = ctypes.CDLL(str(library))
        self._library.counted_work.restype = ctypes.c_ulonglong
        self._library.trace_with(ctypes.pythonapi.PyObject_SetAttrString, ctypes.py_object(True))

    def __getattr__(self, name: str):
        function, known = getattr(self._library, name), getattr(_native.lib, name)
        function.restype, function.argtypes = known.restype, known.argtypes
        return function

    def work_of(self, action: Callable[[], object]) -> int:
        """Bytecodes and basic blocks that an action executes, in this thread."""
        previous, before = sys.gettrace(), self._library.counted_work()
        ctypes.pythonapi.PyEval_SetTrace(self._library.trace, None)
        try:
            action()
        finally:
            sys.settrace(previous)
        return self._library.counted_work() - before
