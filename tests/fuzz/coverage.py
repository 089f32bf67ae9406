"""Which lines of the decoder the seeds, the corpus and the finds reach, by clang's own counters."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzz import seeds, targets

AT_ONCE = 400
NO_CLANG = "line coverage needs clang with llvm-profdata and llvm-cov of its version: none was found"


@dataclass(frozen=True)
class Covered:
    """Lines of one file."""

    name: str
    lines: int
    missed: tuple[int, ...]

    @property
    def share(self) -> float:
        return 1 - len(self.missed) / self.lines if self.lines else 1.0


def _tool(name: str, clang: str) -> str | None:
    version = subprocess.run([clang, "--version"], capture_output=True, text=True).stdout
    major = re.search(r"version (\d+)", version)
    folder = Path(os.path.realpath(shutil.which(clang) or clang)).parent
    for program in (f"{folder}/{name}", f"{name}-{major[1]}" if major else name, name):
        if shutil.which(program):
            return program
    return None


def tools() -> tuple[targets.Compiler, str, str] | None:
    """Clang and its two tools; None where they are missing."""
    for name in (os.environ.get("FUZZ_CLANG"), "clang", *(f"clang-{version}" for version in range(30, 10, -1))):
        if name and shutil.which(name):
            merge, show = _tool("llvm-profdata", name), _tool("llvm-cov", name)
            if merge and show:
                return targets.Compiler(name, False), merge, show
    return None


def _files(target: str, corpus: Path) -> list[Path]:
    start = targets.BUILD / "seeds" / target
    seeds.write_inputs(target, start)
    return sorted([*start.iterdir(), *(corpus / target).glob("*")])


def measure(corpus: Path = targets.BUILD / "corpus") -> list[Covered] | None:
    """Every source and header of the decoder; None where the tools are missing. Raises BuildError."""
    found = tools()
    if found is None:
        return None
    used, merge, show = found
    with TemporaryDirectory() as name:
        programs = [targets.build(target, used, "coverage") for target in targets.TARGETS]
        for target, program in zip(targets.TARGETS, programs):
            files = _files(target, corpus)
            for i in range(0, len(files), AT_ONCE):
                profile = {"LLVM_PROFILE_FILE": f"{name}/{target}-{i}.profraw"}
                outcome = targets.replay(target, program, files[i : i + AT_ONCE], profile)
                if outcome.kind:
                    raise targets.BuildError(f"{target}: {outcome.log}")
        profile = f"{name}/all.profdata"
        subprocess.run([merge, "merge", "-sparse", *map(str, Path(name).glob("*.profraw")), "-o", profile], check=True)
        objects = [word for program in programs[1:] for word in ("-object", str(program))]
        done = subprocess.run(
            [show, "export", "-format=lcov", f"-instr-profile={profile}", str(programs[0]), *objects],
            check=True,
            capture_output=True,
            text=True,
        )
    return sorted(_parse(done.stdout), key=lambda covered: covered.name)


def _parse(lcov: str) -> list[Covered]:
    files = []
    for record in lcov.split("end_of_record"):
        path = re.search(r"^SF:(.*)$", record, re.M)
        if path is None or not Path(path[1]).resolve().is_relative_to(targets.CORE):
            continue
        lines = [(int(line), int(count)) for line, count in re.findall(r"^DA:(\d+),(\d+)", record, re.M)]
        files.append(
            Covered(
                Path(path[1]).resolve().relative_to(targets.CORE).as_posix(),
                len(lines),
                tuple(line for line, count in lines if count == 0),
            )
        )
    return files


def as_text(files: list[Covered]) -> str:
    lines = [f"{'file':<22} {'lines':>6} {'missed':>6} {'%':>6}"]
    for file in files:
        lines.append(f"{file.name:<22} {file.lines:>6} {len(file.missed):>6} {100 * file.share:>6.1f}")
        source = (targets.CORE / file.name).read_text().splitlines()
        lines += [f"    {line}: {source[line - 1].strip()}" for line in file.missed]
    whole = total(files)
    lines.append(f"{'all':<22} {whole.lines:>6} {len(whole.missed):>6} {100 * whole.share:>6.1f}")
    return "\n".join(lines)


def total(files: list[Covered]) -> Covered:
    return Covered("all", sum(file.lines for file in files), tuple(line for file in files for line in file.missed))
