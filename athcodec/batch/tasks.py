"""Tasks of the workers: encode a clip, or the three steps of a long one, and return the result as plain dictionaries.

`begin` encodes a clip of few segments, and of others makes the draft, `code` some of its segments, `finish` the file.
Draft and coded segments lie as files in the run's scratch folder, beside the outputs, which all workers see under the
same path; only names and figures go between tasks. A task that is run again because its worker died finds what it has
finished. A file that goes to a URL is made in that folder too, and stored when it is whole. Whatever goes wrong with a
clip is its result, in one line: nothing is raised but what ends the worker.
"""

from __future__ import annotations

import os
import pickle
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from typing import Any

import athcodec
from athcodec import encoding
from athcodec.batch.inputs import Item, download, identity, is_telling, sha256, upload
from athcodec.batch.settings import coding_options, loop_frames, reading_options
from athcodec.decoding import container as ct
from athcodec.encoding import CodedSegment, Draft
from athcodec.encoding.segments.segmentation import split_segments
from athcodec.errors import AthError, AthWarning, ClipError, GuessWarning, SourceWarning
from athcodec.files.atomic import check_target, is_url, keeping
from athcodec.files.shown import redacted
from athcodec.motion.branches.result import with_branches
from athcodec.motion.clip import MotionClip
from athcodec.motion.joining import in_wind
from athcodec.sources import listed
from athcodec.sources.branches import find_or_load
from athcodec.sources.one_frame import warn_of_still
from athcodec.untyped import JsonObject, Keywords

Result = JsonObject
"""Of a task: "failed" with a reason, or "done" with figures, "draft" with the number of segments, "kept", "part".
"warnings" holds the category and the text of each warning that the task gave: a worker has no terminal of its own."""


def _task(work: Callable[..., Result]) -> Callable[..., Result]:
    """Return `work` as a function for a worker that makes the clip's folder first and turns an exception into
    {"failed": reason}, without secrets of URLs."""

    @wraps(work)
    def task(item: Item, folder: str, *arguments: Any, **options: Any) -> Result:
        with warnings.catch_warnings(record=True, action="always", category=AthWarning) as caught:
            try:
                with suppress(FileExistsError):
                    os.mkdir(folder)  # the run's own is there as long as the run
                result = work(item, folder, *arguments, **options)
            except Exception as error:
                result = {"failed": _about(one_line(error), item, folder)}
        given = [(each.category, _about(str(each.message), item, folder)) for each in caught]
        of_athcodec = [entry for entry in given if issubclass(entry[0], AthWarning)]
        return result | ({"warnings": of_athcodec} if of_athcodec else {})

    return task


def _about(message: str, item: Item, folder: str) -> str:
    """Return a message with the name of the input as it is shown: its URL may hold keys."""
    return message.replace(_local_path(item, folder), item.shown).replace(item.input, item.shown)


@_task
def begin(
    item: Item, folder: str, *, split: int, verify: bool, version: str, known: JsonObject | None = None
) -> Result:
    """Begin a clip: return {"done": record} if it has at most `split` segments and was encoded as a whole, {"draft":
    number of segments} if it is longer, or {"kept": True ...} if its input has not changed.

    `folder` is the clip's own folder for temporary files. `verify` decodes the file before it counts as done. `version`
    is the version of athcodec that the worker has to have. `known` is the record of an output that is up to date unless
    the content of its input has changed.
    """
    if version != athcodec.__version__:
        raise AthError(f"worker: has athcodec {athcodec.__version__}, expected {version} as where the run was started")
    start = time.perf_counter()
    path = os.path.join(folder, "draft")
    if os.path.exists(path):
        return {"draft": _unpickled(path)[0].segment_count}
    source = _source(item, folder)
    if known is not None and source.get("sha256") == known["source"].get("sha256"):
        return {"kept": True, "source": source}
    with _opened(item, folder, source) as clip, keeping(clip.inputs):
        check_target(_target(item, folder), ".ath")
        options = coding_options(item.settings)
        if _segment_count(clip, options) <= split:
            summary = athcodec.encode(clip, _target(item, folder), jobs=1, **options)
            return _done(item, source, summary, clip if verify else None, start)
        draft = encoding.draft(clip, jobs=1, **options)
    _pickle(path, [(draft, source, time.perf_counter() - start)])
    return {"draft": draft.segment_count}


@_task
def code(item: Item, folder: str, segments: Sequence[int]) -> Result:
    """Code the segments of a long clip with these numbers into a file in `folder`, and return {"part": its path,
    "seconds": the time that it took}."""
    start = time.perf_counter()
    path = os.path.join(folder, f"segments_{segments[0]}")
    if os.path.exists(path):
        return {"part": path, "seconds": 0.0}
    draft, source, _ = _unpickled(os.path.join(folder, "draft"))
    with _opened(item, folder, source) as clip:
        _pickle(path, encoding.code_segments(clip, draft, segments, jobs=1))
    return {"part": path, "seconds": time.perf_counter() - start}


@_task
def finish(item: Item, folder: str, parts: Sequence[Result], *, verify: bool) -> Result:
    """Put the file of a long clip together from the results of `code`, `parts`, and return {"done": record}, or the
    first result that failed. `verify` decodes the file before it counts as done."""
    if failed := [part for part in parts if "failed" in part]:
        return failed[0]
    start = time.perf_counter()
    draft, source, seconds = _unpickled(os.path.join(folder, "draft"))
    with _opened(item, folder, source) as clip:
        summary = encoding.write(clip, draft, _coded(parts), _target(item, folder))
        start -= seconds + sum(part["seconds"] for part in parts)
        return _done(item, source, summary, clip if verify else None, start)


def _done(
    item: Item, source: JsonObject, summary: encoding.Summary, verified: MotionClip | None, start: float
) -> Result:
    """Return {"done": record} of an encoded clip, after uploading its file if the output is a URL. If `verified` is
    passed, the file is decoded first, with this clip as the mesh of the host. `start` is when the work began, by
    `time.perf_counter`."""
    assert summary.path is not None  # It was encoded into a file.
    if verified is not None:
        with athcodec.open(summary.path, strict=True, host_mesh=verified) as decoder:
            decoder.file.check()
    stored = {"stored": upload(str(summary.path), item.output)} if is_url(item.output) else {}
    last = summary.levels[-1]
    return {
        "done": stored
        | {
            "source": source,
            "bytes": summary.bytes,
            "raw_bytes": summary.raw_bytes,
            "max_error_bound": summary.max_error_bound,
            "relative_bound": summary.relative_bound,
            "max_error": last.max_error,
            "rms_error": last.rms_error,
            "levels": len(summary.levels),
            "sha256": sha256(summary.path),
            "verified": verified is not None,
            "seconds": round(time.perf_counter() - start, 3),
        }
        | ({"not_read": listed(summary.not_read)} if summary.not_read else {})
        | ({"untried": list(summary.untried)} if summary.untried else {})
    }


# ---- the clip ----


@contextmanager
def _opened(item: Item, folder: str, source: JsonObject) -> Iterator[MotionClip]:
    """Yield the clip as the settings ask for it: with its wind, as a loop, on branches. `source` is the identity of its
    input; ClipError is raised if the input has changed when the block begins or ends."""
    _check_source(item, source)
    path = _local_path(item, folder)
    if is_url(item.input) and (not os.path.exists(path) or sha256(path) != source["sha256"]):
        raise ClipError(f"{item.shown}: the download is not what it was, expected a scratch folder that all share")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SourceWarning)  # the record says it
        warnings.simplefilter("always", GuessWarning)
        how = reading_options(item.settings)
        opened = athcodec.read(path, **how)
        if not item.settings.get("still"):
            warn_of_still(opened, path, how.get("format"), how.get("axes"))
    with opened as source_clip:
        clip = source_clip
        if "strength" in item.settings:
            clip = in_wind(clip, item.settings["strength"], item.settings.get("heading", 0.0))
        blend = loop_frames(item.settings)
        clip = clip if blend is None else athcodec.looped(clip, blend)
        hierarchy = item.settings.get("hierarchy")
        yield clip if hierarchy is None else with_branches(clip, find_or_load(clip, hierarchy))
    _check_source(item, source)


def _source(item: Item, folder: str) -> JsonObject:
    """Return the record that identifies an input: size and time of a file. A URL is downloaded, and its SHA-256 is
    added."""
    source = identity(item)
    if is_url(item.input):
        source["sha256"] = download(item.input, _local_path(item, folder))
    return source


def _check_source(item: Item, source: JsonObject) -> None:
    if is_url(item.input) and not is_telling(source):
        return
    if identity(item) != {name: value for name, value in source.items() if name != "sha256"}:
        raise ClipError(f"{item.shown}: was changed while it was read, expected it to stay as it is")


def _local_path(item: Item, folder: str) -> str:
    return os.path.join(folder, os.path.basename(item.name)) if is_url(item.input) else item.input


def _target(item: Item, folder: str) -> str:
    """Return the path at which a worker writes the file: the output itself, or one in `folder` if the output is a
    URL."""
    return os.path.join(folder, os.path.basename(item.output)) if is_url(item.output) else item.output


def _segment_count(clip: MotionClip, options: Keywords) -> int:
    longest = options.get("segment_frames")
    return len(split_segments(clip.frame_count, clip.vertex_count, longest, ct.Limits.memory_bytes))


# ---- files in the scratch folder ----


def _pickle(path: str, objects: Sequence[Any] | Iterator[CodedSegment]) -> None:
    """Write one object after the other into a file that appears whole or not at all, even if two workers write it."""
    temporary = f"{path}.{os.getpid()}.{time.monotonic_ns()}"
    with open(temporary, "wb") as file:
        for item in objects:
            pickle.dump(item, file, pickle.HIGHEST_PROTOCOL)
    os.replace(temporary, path)


def _unpickled(path: str) -> tuple[Draft, JsonObject, float]:
    with open(path, "rb") as file:
        return pickle.load(file)


def _coded(parts: Sequence[Result]) -> Iterator[CodedSegment]:
    for part in parts:
        with open(part["part"], "rb") as file, suppress(EOFError):
            while True:
                yield pickle.load(file)


# ---- errors ----


def one_line(error: BaseException) -> str:
    """Return the message of an error; one that is neither athcodec's nor the system's is named by its class too."""
    if isinstance(error, OSError) and error.filename is not None:
        return redacted(f"{error.filename}: {error.strerror}")
    text = " ".join(redacted(error.for_shell if isinstance(error, AthError) else str(error)).split())
    return text if text and isinstance(error, (AthError, OSError)) else f"{type(error).__name__}: {text}"
