"""Reads a file in a process of its own, for libraries that crash on damaged files or take all the memory that these ask
for. The process (reader_main.py) may take options.max_memory bytes; it gives frames when it is asked for them, and its
end becomes a ClipError.
"""

from __future__ import annotations

import dataclasses
import io
import json
import os
import subprocess
import sys
import threading
import warnings
import weakref
from os import fspath

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import FileWatch, closing_on_failure, naming
from athcodec.motion.clip import MotionClip, Skin
from athcodec.motion.frames import Frames
from athcodec.sources import ReadOptions
from athcodec.untyped import JsonObject

ARRAYS = ("vertex_branch", "branch_parent", "stem_index", "edges", "faces")
MAIN = "athcodec.sources.reader_main"


def read_apart(path: FilePath, options: ReadOptions, module: str, crashed: str) -> MotionClip:
    """Return the clip that the function `open_clip` of `module` reads in a process of its own, so that a library that
    crashes on a damaged file ends only that process. `crashed` begins the message if it does. Raises ClipError,
    OSError."""
    path = fspath(path)
    open_plain(path).close()
    process = _Process(path, options, module, crashed)
    with naming(path), closing_on_failure(process), np.load(io.BytesIO(process.described)) as archive:
        arrays = {name: archive[name] for name in archive.files}
        attributes = {name.split("/", 1)[1]: values for name, values in arrays.items() if "/" in name}
        facts = json.loads(arrays["said"].tobytes())
        for guess in facts["guesses"]:
            warnings.warn(guess, GuessWarning, stacklevel=2)
        shape, dtype = tuple(facts["shape"]), np.dtype(facts["dtype"])

        def frames(start: int, stop: int) -> np.ndarray:
            return np.frombuffer(process.ask(f"{start} {stop}"), dtype).reshape(stop - start, *shape[1:])

        skin = None
        if "joint_parent" in arrays:
            skin = Skin(arrays["joint_parent"], arrays["vertex_joint"], tuple(facts["joint_names"]))
        clip = MotionClip(
            Frames(frames, shape[0], shape[1], dtype, keeps=True),
            arrays["time"],
            rest=arrays["rest"],
            attributes=attributes,
            metadata=facts["metadata"],
            resource=process,
            unchanged=FileWatch.of({file: tuple(stamp) for file, stamp in facts["files"].items()}),
            not_read=facts["not_read"],
            skin=skin,
            **{name: arrays[name] for name in ARRAYS if name in arrays},
        )
        clip.rest_given = facts["rest_given"]
        return clip


class _Process:
    """The process that reads."""

    def __init__(self, path: str, options: ReadOptions, module: str, crashed: str):
        """Start the process and let it open `path` by the function `open_clip` of `module`. `crashed` begins the
        message if it crashes. Raises ClipError."""
        self._lock = threading.Lock()
        self._crashed = (
            f"{crashed} has crashed on it, or found no room in {options.max_memory:,} bytes (--max-memory, max_memory=)"
        )
        env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self._process = subprocess.Popen(
            [sys.executable, "-m", MAIN, module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=env,
        )
        self._end = weakref.finalize(self, _stop, self._process)
        wanted: JsonObject = dataclasses.asdict(options)
        wanted |= {"path": os.path.abspath(path), "mesh": None, "root": None}
        wanted |= {name: list(wanted[name]) for name in ("only", "takes", "skip")}
        with naming(path), closing_on_failure(self):
            self.described = self.ask(json.dumps(wanted))

    def ask(self, line: str) -> bytes:
        """Send a line to the process and return the bytes of its answer. Raises ClipError if the process reports an
        error or has ended."""
        if not self._end.alive:
            raise ClipError("positions: the clip is closed")
        questions, answers = self._process.stdin, self._process.stdout
        assert questions is not None and answers is not None  # Both are pipes.
        with self._lock:
            try:
                questions.write(line.encode() + b"\n")
                questions.flush()
                answer = json.loads(answers.readline() or b"{}")
                data = answers.read(answer.get("size", 0))
            except (BrokenPipeError, ValueError):
                answer, data = {}, b""
        if "error" in answer:
            raise ClipError(answer["error"])
        if len(data) != answer.get("size"):
            raise ClipError(self._crashed)
        return data

    def close(self) -> None:
        self._end()


def _stop(process: subprocess.Popen[bytes]) -> None:
    """End the process and wait for that."""
    process.kill()
    process.communicate()
