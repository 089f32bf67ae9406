"""Builds and runs the C targets: with libFuzzer where there is a clang that has it, else each input once.

Everything is built under a folder that is named after what went into it, so that nothing is built twice. Which
compiler: FUZZ_CLANG, else the first clang that can link -fsanitize=fuzzer.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzz import seeds

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CORE = ROOT / "athcodec" / "core"
BUILD = ROOT / "build" / "fuzz"
TARGETS = ("container", "prelude", "motion", "decode", "gpu", "player")
NO_FUZZER = (
    "no clang with -fsanitize=fuzzer was found (install clang, or name one in FUZZ_CLANG): inputs are tried "
    "once, not mutated"
)

COMMON = "-g -O2 -std=c11 -ffp-contract=off -fno-math-errno -fno-omit-frame-pointer -DATH_STATIC -Wall -Wextra".split()
COMMON.append(f"-I{HERE}")
ADDRESS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
SANITIZERS = {
    "address": [*ADDRESS, "-fsanitize=float-cast-overflow"],
    "memory": ["-fsanitize=memory", "-fsanitize-memory-track-origins", "-fno-sanitize-recover=all"],
    "coverage": ["-fprofile-instr-generate", "-fcoverage-mapping"],
    "none": [],
}
RSS_MB, MALLOC_MB, TIMEOUT = 1024, 64, 10


class BuildError(Exception):
    """A target does not compile; the message is the compiler's."""


@dataclass(frozen=True)
class Compiler:
    path: str
    fuzzer: bool


@dataclass(frozen=True)
class Outcome:
    """What a run of a target came to."""

    target: str
    tried: int
    kind: str = ""  # "": nothing went wrong; else crash, hang, over_limit or wrong
    log: str = ""
    artifact: Path | None = None
    edges: int = 0
    seconds: float = 0.0


def _links_fuzzer(compiler: str) -> bool:
    with TemporaryDirectory() as folder:
        source = Path(folder, "probe.c")
        source.write_text(
            "int LLVMFuzzerTestOneInput(const char *data, unsigned long size) { return !data && size; }\n"
        )
        done = subprocess.run(
            [compiler, "-fsanitize=fuzzer,address", source, "-o", Path(folder, "probe")], capture_output=True
        )
    return done.returncode == 0


def compiler() -> Compiler:
    """A clang that has libFuzzer, else any C compiler. Raises BuildError."""
    named = os.environ.get("FUZZ_CLANG")
    for name in [named] if named else ["clang", *(f"clang-{version}" for version in range(30, 10, -1))]:
        if shutil.which(name) and _links_fuzzer(name):
            return Compiler(name, True)
    for name in ("clang", "gcc", "cc"):
        if shutil.which(name):
            return Compiler(name, False)
    raise BuildError("no C compiler: got none of clang, gcc, cc; expected one on the path")


def decoder_sources(core: Path = CORE) -> list[Path]:
    """With the GPU form."""
    lists = re.findall(r"set\(ATH_(?:DECODER|GPU)_SOURCES\s([^)]*)\)", (core / "CMakeLists.txt").read_text())
    return [core / name for names in lists for name in names.split()]


def _run(command: list) -> None:
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise BuildError(f"{' '.join(map(str, command))}\n{done.stdout}")


def _digest(words: list[str], core: Path) -> str:
    digest = hashlib.sha256("\0".join(words).encode())
    for path in sorted([*core.rglob("*.c"), *core.rglob("*.h"), *core.rglob("*.inl"), *HERE.glob("*.[ch]")]):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def build(target: str, used: Compiler, sanitizer: str = "address", folder: Path = BUILD, core: Path = CORE) -> Path:
    """The program of a target, with the decoder in `core`. Raises BuildError."""
    flags = [*COMMON, f"-I{core}", f"-I{core / 'include'}"] + (
        ADDRESS if sanitizer == "address" and not used.fuzzer else SANITIZERS[sanitizer]
    )
    parts = folder / f"{sanitizer}-{_digest([used.path, *flags], core)}"
    parts.mkdir(parents=True, exist_ok=True)
    engine = "-fsanitize=fuzzer" if used.fuzzer else str(HERE / "replay.c")
    mutator = ["mutator"] if used.fuzzer and target != "prelude" else []
    mine = [HERE / f"{name}.c" for name in (target, "harness", *mutator)]
    objects = []
    for source in [*decoder_sources(core), *mine]:
        objects.append(parts / f"{source.parent.name}-{source.stem}.o")
        if not objects[-1].exists():
            instrument = ["-fsanitize=fuzzer-no-link"] if used.fuzzer else []
            unfinished = objects[-1].with_suffix(f".{os.getpid()}")
            _run([used.path, *flags, *instrument, "-c", source, "-o", unfinished])
            unfinished.rename(objects[-1])
    program = parts / target
    if not program.exists():
        unfinished = program.with_suffix(f".{os.getpid()}")
        _run([used.path, *flags, *objects, engine, "-o", unfinished])
        unfinished.rename(program)
    return program


# ---- running ----


_FAULTS = (("wrong", "broken promise"), ("hang", "timeout"), ("over_limit", "out-of-memory"), ("crash", ""))


def _kind(log: str) -> str:
    return next(kind for kind, words in _FAULTS if words in log)


def _number(pattern: str, log: str) -> int:
    found = re.findall(pattern, log)
    return int(found[-1]) if found else 0


def fuzz(
    target: str, program: Path, seconds: float, corpus: Path, finds: Path, *, seed: int = 0, runs: int = -1
) -> Outcome:
    """Mutates for some time, or so many inputs, from the seeds and what the corpus has, which grows."""
    start = BUILD / "seeds" / target
    seeds.write_inputs(target, start)
    for folder in (corpus, finds):
        folder.mkdir(parents=True, exist_ok=True)
    before = set(finds.iterdir())
    how = f"-max_total_time={max(1, round(seconds))} -runs={runs} -seed={seed} -max_len={seeds.LARGEST}"
    how += f" -timeout={TIMEOUT} -rss_limit_mb={RSS_MB} -malloc_limit_mb={MALLOC_MB} -print_final_stats=1 -reload=0"
    places = f"-dict={HERE / 'ath.dict'}", f"-artifact_prefix={finds}/{target}-"
    command = [program, corpus, start, *how.split(), *places]
    done = subprocess.run(
        [str(word) for word in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=os.environ | {"ASAN_OPTIONS": "detect_leaks=1"},
    )
    log = done.stdout.decode(errors="replace")
    found = sorted(set(finds.iterdir()) - before)
    return Outcome(
        target,
        _number(r"stat::number_of_executed_units:\s+(\d+)", log) or _number(r"#(\d+)", log),
        _kind(log) if done.returncode else "",
        log,
        found[0] if found else None,
        _number(r"cov: (\d+)", log),
        seconds,
    )


def replay(target: str, program: Path, files: list[Path], env: dict | None = None) -> Outcome:
    """Tries each file once."""
    command = [program, *(["-timeout=60"] if env is None else []), *files]
    done = subprocess.run(
        [str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ | (env or {})
    )
    log = done.stdout.decode(errors="replace")
    return Outcome(target, len(files), _kind(log) if done.returncode else "", log)
