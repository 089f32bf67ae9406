"""Which files are the frames of one motion, in what order, and at what times.

Files are listed by an index (index_files.py) or numbered by their names (numbering.py). An index counts that is named,
or that lists a named file. Times are those of the index; else what every file states of its own time, which the reader
of the format passes to `Series.clock`; else the numbers in the names: decimals as seconds, whole numbers as frames,
options.fps a second or DEFAULT_FPS. A GuessWarning says where two of these contradict each other, and where numbers in
names had to be taken for times.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from athcodec.errors import GuessWarning
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget
from athcodec.motion.clip import DEFAULT_FPS
from athcodec.sources import SERIES, ReadOptions, is_pattern
from athcodec.sources.index_files import Index, index_of, is_index, list_of, read_index
from athcodec.sources.numbering import NumberedFiles, files_to_read, numbered_files
from athcodec.sources.timing import numbered_times, plain_number, times_in_seconds
from athcodec.untyped import JsonObject

SAME = 1e-5  # Largest relative difference of times that two places state alike.
SHOWN = 3  # Times or numbers in a message.
HEAD_BYTES = 4096  # Where a text states a time, it does so at its beginning.
# A time in a comment is what the comment, or a part of it, begins with: "export time: 3 s" is none.
_IN_TEXT = re.compile(  # Nothing is tried twice: a comment may be as long as a file.
    r"(?:^|[,;|(\[]|\b(?:simulation|at)\b)[^\S\n]*+(?:(?:time|timevalue)\s*+[:=]?+|t\s*+=)\s*+"
    r"([-+]?(?>\d+(?:\.\d*)?|\.\d+)(?>e[-+]?\d+)?+)(?![.-]*+[\w:/])",
    re.IGNORECASE | re.MULTILINE,
)


class Kind(Enum):
    """How sure it is that a value is a time in seconds."""

    TIME = "a field or property for the time"
    TEXT = "a comment, for which there is no rule"
    COUNT = "a field that may count steps"


@dataclass(frozen=True)
class StatedTime:
    """What a file says of its own time, and where; in float32 where it was rounded to that."""

    place: str
    seconds: float | np.float32
    kind: Kind = Kind.TIME


def time_in_text(place: str, text: str) -> StatedTime | None:
    """Return the time that a comment states, as in "time = 0.25 s"; None where it states none."""
    match = _IN_TEXT.search(text)
    return StatedTime(f"{place} {match[0].strip(' ,;|([')!r}", float(match[1]), Kind.TEXT) if match else None


@dataclass(frozen=True, eq=False)
class Series:
    """Frames in the order of time.

    frames       the files of each frame, one for each of `parts`
    parts        what the objects in those files are called, "" for no name
    name         what the motion is called by its files
    index        the index, and times (T,), which it states; None without one
    numbers      (T,) in the names of the files; None without any
    missing      files that the index lists and that are not there
    """

    frames: tuple[tuple[Path, ...], ...]
    name: str
    parts: tuple[str, ...] = ("",)
    index: Path | None = None
    times: np.ndarray | None = None
    numbers: np.ndarray | None = None
    has_decimals: bool = False
    is_doubtful: bool = False
    missing: tuple[Path, ...] = ()

    @property
    def first(self) -> Path:
        """The file, or the first of the files, of the first frame."""
        return self.frames[0][0]

    @property
    def _advice(self) -> str:
        """How to state other times: ParaView's index in JSON."""
        index = f"{self.name}{self.first.suffix}{SERIES}"
        return f'{index} beside them, with {{"files": [{{"name": FILE, "time": SECONDS}}, ...]}}, states others'

    @property
    def not_read(self) -> dict[str, list[str]]:
        """As in MotionClip."""
        return {"file that is not there": [path.name for path in self.missing]} if self.missing else {}

    def in_time(self, stated: Sequence[StatedTime | None]) -> Series:
        """Return the series with its frames in ascending order of the times that their files state. The order stays as
        it is if an index has times already, or if the files' times are missing or not distinct."""
        seconds = _usable(stated)
        if self.times is not None or seconds is None or (np.diff(seconds) > 0).all():
            return self
        self._warn(f"frames are in the order of {_place(stated)}, which is not that of the numbers in their names")
        order = np.argsort(seconds)
        numbers = None if self.numbers is None else self.numbers[order]
        return replace(self, frames=tuple(self.frames[place] for place in order), numbers=numbers)

    def hears(self, stated: Sequence[StatedTime | None]) -> bool:
        """Return whether the times that files state are taken, or compared with those of the index."""
        if self.times is not None:
            return any(time is not None and time.kind is Kind.TIME for time in stated)
        return len(self.frames) > 1 and _usable(stated) is not None

    def clock(
        self, stated: Sequence[StatedTime | None], options: ReadOptions, fps: float | None = None
    ) -> tuple[np.ndarray, JsonObject]:
        """Return the time of each frame (T,), in seconds from 0, and the metadata "fps" and "start_frame" as far as
        they are known.

        `stated` has the time that each file states of itself, None for a file without one. `fps` is the frame rate that
        the files state; a rate in `options` overrides it.
        """
        rate = options.fps or fps
        if self.times is not None:
            self._compare(self.times, stated, "the index has", "and is taken")
            return self._in_seconds(self.times, rate)
        seconds = _usable(stated) if len(self.frames) > 1 else None
        if seconds is not None:
            if self.has_decimals and self.numbers is not None:
                self._compare(self.numbers, stated, "the name has", "and is not taken")
            kind = next(time.kind for time in stated if time is not None)
            if kind is not Kind.TIME:
                shown = _shown(seconds.tolist())
                self._warn(f"{_place(stated)}, {kind.value}, is taken for the time: {shown} s; {self._advice}")
            return self._in_seconds(seconds, rate)
        if self.numbers is None:
            return np.zeros(1), {}
        if len(self.frames) > 1:
            self._warn_of_numbers(rate, stated)
        if self.has_decimals and rate is None:
            return self._in_seconds(self.numbers, None)
        return numbered_times(self.numbers, rate)

    def _in_seconds(self, seconds: np.ndarray, rate: float | None) -> tuple[np.ndarray, JsonObject]:
        """Return the frames' times (T,) in seconds from 0, and the metadata of their rate. The metadata get
        "start_frame", the number in the first file's name, if the numbers in all names fit the times."""
        time, metadata = times_in_seconds(seconds, rate)
        digits = [re.search(r"(\d+)$", frame[0].stem) for frame in self.frames]
        if "fps" in metadata and not self.has_decimals and all(digits):
            numbers = np.array([float(number[1]) for number in digits if number is not None])
            if np.allclose(numbers - numbers[0], time * metadata["fps"], rtol=0, atol=1e-6):
                metadata["start_frame"] = int(numbers[0])
        return time, metadata

    def _compare(self, times: np.ndarray, stated: Sequence[StatedTime | None], subject: str, then: str) -> None:
        """Give a GuessWarning for the first file that states another time than `times` (T,) has for its frame. The
        warning says that `subject` has the value of `times`, and `then`, which of the two is used."""
        for time, statement, frame in zip(times.tolist(), stated, self.frames):
            if statement is None or statement.kind is not Kind.TIME:
                continue
            if abs(statement.seconds - time) > SAME * max(abs(time), abs(statement.seconds)):
                self._warn(
                    f"{subject} {time:.10g} for {frame[0].name}, {then}; the file has {statement.seconds:.10g} in "
                    f"{statement.place}"
                )
                return

    def _warn_of_numbers(self, rate: float | None, stated: Sequence[StatedTime | None]) -> None:
        """Give a GuessWarning if it is uncertain how the numbers in the files' names become times: as seconds, or as
        frames at `rate` frames per second."""
        assert self.numbers is not None
        if any(stated):
            values = [None if time is None else time.seconds for time in stated]
            self._warn(
                f"{_place(stated)} ({_shown(values)}) states no time for each of the {len(values)} files, and the "
                f"numbers in their names are taken; {self._advice}"
            )
        steps, numbers = np.diff(self.numbers), _shown(self.numbers.tolist())
        if self.has_decimals and rate is None:
            self._warn(
                f"the numbers in the names, {numbers}, have decimals and are taken for seconds; if they are frames, "
                "--fps RATE says how many are a second"
            )
        elif self.is_doubtful:
            self._warn(
                f"the digits behind the point in the names are taken for the frames {numbers}; if the numbers are "
                f"decimals, {self._advice}"
            )
        elif rate is None and (steps != 1).any():
            even = f", {steps[0] / DEFAULT_FPS:.4g} s apart" if (steps == steps[0]).all() else ""
            whole = plain_number(steps[0] * DEFAULT_FPS)
            advice = f", and --fps {whole} gives {DEFAULT_FPS:g} files a second" if even else ""
            self._warn(
                f"the numbers in the names, {numbers}, do not follow one another and are taken for frames, of which "
                f"{DEFAULT_FPS:g} are a second{even}; --fps RATE says how many are a second{advice}"
            )

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self.index or self.first}: {text}", GuessWarning, stacklevel=2)


def series_of(path: FilePath, options: ReadOptions) -> Series:
    """Return the frames of the series that `path` stands for: an index file (.pvd or .series), a pattern, or any one of
    its numbered files. Raises ClipError, and OSError if a file is not there."""
    path = Path(path)
    index: Index | None
    if is_index(path):
        index = read_index(path, path.parent, options.allow_outside, Budget(options.max_memory))
    elif options.alone and not is_pattern(path):
        return Series(((path,),), path.stem, ("",), None, None, None)
    else:
        files = numbered_files(path)
        index = index_of(path, files.paths, options.allow_outside, options.max_memory)
        if index is None:
            files = files_to_read(path)
            _warn_of_list(files)
            frames = tuple((file,) for file in files.paths)
            name = files.name or files.paths[0].stem
            return Series(frames, name, ("",), None, None, files.numbers, files.has_decimals, files.is_doubtful)
    stem = index.frames[0][0].stem
    name = re.sub(r"[_.\-]*\d+$", "", stem) or stem
    return Series(index.frames, name, index.parts, index.path, index.times, missing=index.missing)


def _warn_of_list(files: NumberedFiles) -> None:
    """Give a GuessWarning if another file lists the numbered files as the pieces of one frame, although they are read
    as frames."""
    whole = list_of(files.paths[0])
    if whole is not None:
        warnings.warn(
            f"{files.paths[0]}: read as one of {len(files.paths)} frames, though {whole} lists it as a piece of one; "
            f"name {whole} to read its pieces together",
            GuessWarning,
            stacklevel=2,
        )


def _usable(stated: Sequence[StatedTime | None]) -> np.ndarray | None:
    """Return the times (T,) in seconds that the files state, or None unless all files state one of the same kind and
    the times tell the files apart."""
    times = [time for time in stated if time is not None]
    if len(times) < len(stated) or len({time.kind for time in times}) > 1:
        return None
    seconds = np.array([time.seconds for time in times])
    if times[0].kind is Kind.TIME:
        return seconds if len(set(seconds.tolist())) == len(seconds) else None
    counts = times[0].kind is Kind.COUNT and (seconds == np.round(seconds)).all()
    return seconds if (np.diff(seconds) > 0).all() and not counts else None


def _place(stated: Sequence[StatedTime | None]) -> str:
    return next(time.place for time in stated if time is not None)


def _shown(values: Sequence[float | np.float32 | None]) -> str:
    words = ["none" if value is None else f"{value:.10g}" for value in values[:SHOWN]]
    return ", ".join(words) + (" ..." if len(values) > SHOWN else "")
