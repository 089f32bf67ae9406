"""Reads Alembic: meshes, subdivision surfaces, curves and points whose points or transforms move, in world space.

Frames are the times at which anything that is read has a sample; options.fps sets another rate. Between samples points
and transforms go on straight lines. Alembic lists the corners of a face clockwise: they come counter-clockwise, as
everywhere else here. An Alembic file names no unit and no axis; Y is up by custom, which is said of Blender's files
alone. The names of face sets become those of materials: attribute "face_material", metadata "material_names". What has
instances, and a shape that stays as it is, becomes one object, of as many copies. Objects that are hidden throughout,
NURBS patches, materials and others are named in the clip's `not_read`; velocities are not read.

Alembic's library crashes on damaged archives. So it works in a process of its own (alembic_archive.py), which gives
frames when it is asked for them, and whose crash becomes a ClipError.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import threading
import weakref
from os import PathLike, fspath

import numpy as np

from athcodec.clip import MotionClip
from athcodec.errors import ClipError
from athcodec.frames import Frames
from athcodec.sources import ReadOptions
from athcodec.sources.opening import FileWatch, closing_on_failure, naming

ARRAYS = ("vertex_branch", "branch_parent", "stem_index", "edges", "faces")
READER = "athcodec.sources.alembic_archive"


def read_clip(path: str | PathLike[str], options: ReadOptions) -> MotionClip:
    """Open the clip in the Alembic file `path`; close it, or use it in a `with` statement.

    options.only are patterns of names or paths of objects. Raises ClipError, OSError.
    """
    path = fspath(path)
    with open(path, "rb"):
        pass
    unchanged = FileWatch(path)
    archive = _Archive(path, options)
    with naming(path), closing_on_failure(archive), np.load(io.BytesIO(archive.described)) as found:
        arrays = {name: found[name] for name in found.files}
        attributes = {name.split("/", 1)[1]: values for name, values in arrays.items() if "/" in name}
        shape = len(arrays["time"]), len(arrays["rest"])

        def frames(start: int, stop: int) -> np.ndarray:
            data = archive.ask(f"{start} {stop}")
            return np.frombuffer(data, np.float32).reshape(stop - start, shape[1], 3)

        clip = MotionClip(
            Frames(frames, *shape),
            arrays["time"],
            rest=arrays["rest"],
            attributes=attributes,
            metadata=json.loads(arrays["metadata"].tobytes()),
            resource=archive,
            unchanged=unchanged,
            not_read=json.loads(arrays["not_read"].tobytes()),
            **{name: arrays[name] for name in ARRAYS if name in arrays},
        )
        clip.rest_given = bool(arrays["rest_given"])
        return clip


class _Archive:
    """The process that reads an archive."""

    def __init__(self, path: str, options: ReadOptions):
        self._lock = threading.Lock()
        env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self._process = subprocess.Popen(
            [sys.executable, "-m", READER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=env,
        )
        self._end = weakref.finalize(self, _stop, self._process)
        wanted = {
            "path": os.path.abspath(path),
            "rest": options.rest,
            "fps": options.fps,
            "only": list(options.only),
            "skip": list(options.skip),
        }
        with naming(path), closing_on_failure(self):
            self.described = self.ask(json.dumps(wanted))

    def ask(self, line: str) -> bytes:
        """What the process answers. Raises ClipError where it says what is wrong, or has ended."""
        if not self._end.alive:
            raise ClipError("positions: the clip is closed")
        with self._lock:
            try:
                self._process.stdin.write(line.encode() + b"\n")
                self._process.stdin.flush()
                answer = json.loads(self._process.stdout.readline() or b"{}")
                data = self._process.stdout.read(answer.get("size", 0))
            except (BrokenPipeError, ValueError):
                answer, data = {}, b""
        if "error" in answer:
            raise ClipError(answer["error"])
        if len(data) != answer.get("size"):
            raise ClipError("archive: it is damaged, or no Alembic archive: Alembic's library has crashed on it")
        return data

    def close(self) -> None:
        self._end()


def _stop(process: subprocess.Popen) -> None:
    process.kill()
    process.communicate()
