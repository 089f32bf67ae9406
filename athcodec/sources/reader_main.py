"""The process that reads a file for reader_process.py, which see; nothing else imports it.

`python -m athcodec.sources.reader_main MODULE` takes ReadOptions and a path as one line of JSON, answers with the clip
that `open_clip(path, options)` of the module gives, but for its motion, and then with the frames that it is asked for,
until there is nothing more to read. Each answer is a line of JSON, {"size": bytes} and these bytes or {"error":
message}. Where this process crashes the answers end.
"""

from __future__ import annotations

import importlib
import io
import json
import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.reading import FileWatch, no_room
from athcodec.motion.clip import MotionClip
from athcodec.sources import ReadOptions
from athcodec.sources.reader_process import ARRAYS
from athcodec.untyped import JsonObject

if sys.platform != "win32":
    import resource

THREADS = 256 << 20
"""What the stacks of the threads that libraries start may take besides."""


def main() -> None:
    """Answer questions on standard input until it ends: send the clip that the first line describes in JSON, without
    its positions, then for each line "START STOP" the positions of these frames."""
    module = importlib.import_module(sys.argv[1])
    asked = sys.stdin.buffer
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # a library may print
        wanted = json.loads(asked.readline())
        path, limit = wanted.pop("path"), wanted["max_memory"]
        limit_memory(limit)
        with _answering(answers, limit):
            with warnings.catch_warnings(record=True, action="always", category=GuessWarning) as guesses:
                clip = module.open_clip(path, ReadOptions(**wanted))
            _send(answers, _described(clip, [str(guess.message) for guess in guesses]))
        for line in asked:
            start, stop = map(int, line.split())
            with _answering(answers, limit):
                _send(answers, np.ascontiguousarray(clip.positions[start:stop], clip.dtype).tobytes())


def limit_memory(size: int) -> None:
    """Limit the memory that this process can still take to `size` bytes, if the system allows it."""
    status = Path("/proc/self/status")
    if sys.platform == "win32" or not status.exists():
        return
    stated = re.search(r"VmData:\s+(\d+)", status.read_text())
    if stated is None:
        return
    used = int(stated[1]) * 1024
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    wanted = used + size + THREADS
    resource.setrlimit(resource.RLIMIT_DATA, (wanted if hard < 0 else min(wanted, hard), hard))


@contextmanager
def _answering(answers: BinaryIO, limit: int) -> Iterator[None]:
    """Send an error of the block to the process that asked, as the answer. `limit` is the memory limit in bytes, for
    the message."""
    try:
        yield
    except MemoryError:
        _refuse(answers, no_room(limit))
    except (RuntimeError, ValueError, TypeError, LookupError, ArithmeticError, OSError) as error:
        text = " ".join(str(error).split()) or type(error).__name__
        _refuse(answers, text if isinstance(error, ClipError) else f"cannot be read: {text[:200]}")


def _refuse(answers: BinaryIO, message: str) -> None:
    answers.write(json.dumps({"error": message}).encode() + b"\n")
    answers.flush()


def _send(answers: BinaryIO, data: bytes) -> None:
    """Send bytes as an answer, after a line with their number."""
    answers.write(json.dumps({"size": len(data)}).encode() + b"\n" + data)
    answers.flush()


def _described(clip: MotionClip, guesses: list[str]) -> bytes:
    """Return a clip without its positions as the bytes of an .npz archive. `guesses` are the texts of warnings that
    reading gave."""
    arrays = {f"attributes/{name}": values for name, values in clip.attributes.items()}
    arrays |= {name: getattr(clip, name) for name in ("time", *ARRAYS) if getattr(clip, name) is not None}
    arrays["rest"] = clip.source_rest
    facts: JsonObject = {
        "shape": (clip.frame_count, clip.vertex_count, 3),
        "dtype": clip.dtype.str,
        "rest_given": clip.rest_given,
        "metadata": clip.metadata,
        "not_read": {kind: list(names) for kind, names in clip.not_read.items()},
        "files": clip.unchanged.stamps if isinstance(clip.unchanged, FileWatch) else {},
        "guesses": guesses,
    }
    if clip.skin is not None:
        arrays |= {"joint_parent": clip.skin.joint_parent, "vertex_joint": clip.skin.vertex_joint}
        facts["joint_names"] = list(clip.skin.names)
    arrays["said"] = np.frombuffer(json.dumps(facts).encode(), np.uint8)
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **arrays)
    return out.getvalue()


if __name__ == "__main__":
    main()
