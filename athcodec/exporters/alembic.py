"""Writes Alembic: see alembic_archive.py for how. Alembic's library ends the process where the disk is full, so it
works in one of its own, which gets the frames as they come.
"""

from __future__ import annotations

import errno
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.copies import cost_of, fit_copies
from athcodec.exporters.placing import origin_of
from athcodec.exporters.samples import samples_of
from athcodec.exporters.scene_objects import hidden_copies, objects_of
from athcodec.files.atomic import new_files
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonObject

STATIC = (
    "frame_count vertex_count branch_count time fps metadata rest vertex_branch branch_parent stem_index edges".split()
)
STATIC += ["faces", "attributes", "polygons"]
WRITER = "athcodec.exporters.alembic_archive"


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write a MotionClip or a ClipView as .abc. Return what storing copies as instances costs in error. Raise
    ClipError, OSError.
    """
    path = os.fspath(path)
    objects = objects_of(motion)
    instanced = fit_copies(motion, objects) if options.instances else {}
    for number, obj in enumerate(objects):
        obj.copies = obj.copies if number in instanced else 1
    static = SimpleNamespace(**{name: getattr(motion, name) for name in STATIC})
    static.rest, static.place = getattr(motion, "source_rest", motion.rest), origin_of(motion)
    with new_files(path) as folder:
        process = subprocess.Popen(
            [sys.executable, "-m", WRITER, os.path.join(folder, os.path.basename(path))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        try:
            samples = samples_of(motion, objects, options.velocities)
            answer = _send(
                process, (static, instanced), samples, lambda frame: report((frame + 1) / motion.frame_count)
            )
        finally:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                with suppress(BrokenPipeError):
                    if pipe is not None:
                        pipe.close()
        if answer != b"done":
            reason = answer.decode("utf-8", "replace") or "Alembic's library has ended its process: is the disk full?"
            raise OSError(errno.EIO, f"cannot be written: {reason}", path)
    return cost_of(instanced) | hidden_copies(objects, options.instances)


def _send(process: subprocess.Popen[bytes], head: Any, samples: Iterable[Any], report: Callable[[int], None]) -> bytes:
    """Send the clip and its samples to the writing process and return the process's final answer. `report` is called
    with the number of samples sent.
    """
    assert process.stdin is not None and process.stdout is not None
    try:
        pickle.dump(head, process.stdin, pickle.HIGHEST_PROTOCOL)
        for sample in samples:
            pickle.dump(sample, process.stdin, pickle.HIGHEST_PROTOCOL)
            report(sample[0])
        process.stdin.close()
    except BrokenPipeError:
        pass  # it has said why, or has crashed
    return process.stdout.read()
