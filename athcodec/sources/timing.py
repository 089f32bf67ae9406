"""Times of formats that number their frames and say nothing of seconds, and of those that say only seconds.

Where a file has no rate and none is given, frames come DEFAULT_FPS a second, and the clip states no rate.
"""

from __future__ import annotations

import os
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.errors import GuessWarning
from athcodec.files.plain import FilePath
from athcodec.motion.clip import DEFAULT_FPS

DROP_FRAME = 1000 / 1001
RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0, 240.0, 480.0, 500.0, 1000.0)
MOST_FPS, MOST_FRAMES = 1000.0, 100_000  # Of a rate that is advised.


def numbered_times(numbers: np.ndarray, fps: float | None) -> tuple[np.ndarray, dict[str, Any]]:
    """(T,) seconds from 0 of frames with these numbers in the tool that made them, and the metadata that says so.

    Without a given rate the metadata has one only where the numbers do not follow one another: they could not be found
    again from the times.
    """
    numbers = np.asarray(numbers, np.float64)
    rate = fps or DEFAULT_FPS
    metadata: dict[str, Any] = {"start_frame": whole(numbers[0])}
    if fps is not None or (np.diff(numbers) != 1).any():
        metadata["fps"] = float(rate)
    return (numbers - numbers[0]) / rate, metadata


def times_in_seconds(stored: np.ndarray, fps: float | None) -> tuple[np.ndarray, dict[str, Any]]:
    """(T,) seconds from 0 of frames whose times a file has as float32 or float64, and the metadata of their rate.

    Where all times are whole multiples of a usual rate's step, but for the rounding of their own type, that rate is
    meant: the clip then has it, and the times without the rounding. With a rate,
    a first time that is not 0 gives "start_frame".
    """
    stored = np.asarray(stored)
    times = stored.astype(np.float64)
    for rate in [fps] if fps is not None else _usual_rates(times):
        numbers = np.round(times * rate)
        if np.array_equal((numbers / rate).astype(stored.dtype), stored):
            return (numbers - numbers[0]) / rate, {"fps": float(rate)} | _start(numbers[0])
    metadata = {} if fps is None else {"fps": float(fps)} | _start(round(float(times[0] * fps), 3))
    return times - times[0], metadata


def warn_of_missed(keys: np.ndarray, missed: np.ndarray, fps: float, name: str, start: float | None = None) -> None:
    """A GuessWarning where keys of a file, at ascending seconds (K,), are missed by the frames, which begin at `start`
    seconds (default: with the first key)."""
    if missed.any():
        rate = _closer_rate(keys - (keys[0] if start is None else start), fps)
        advice = (
            f"--fps {plain_number(rate)} has frames closer to them"
            if rate
            else f"they lie on no rate up to {MOST_FPS:g} per second, so resample them in the program that wrote them"
        )
        warnings.warn(
            f"{name}: {missed.sum()} of {len(keys)} key times lie between frames at {fps:g} per second, and what moves "
            f"there alone is missed; {advice}",
            GuessWarning,
            stacklevel=2,
        )


def _closer_rate(places: np.ndarray, fps: float) -> float | None:
    """The lowest sensible rate whose frames hit keys at these seconds after the first frame, else the rate of their
    shortest step; None where that has more frames than anybody wants."""
    shortest = np.diff(places).min(initial=0.25 / fps)
    steps = (fps * factor for factor in range(2, 9))
    for rate in sorted(rate for rate in (*steps, *RATES, 1 / shortest if shortest > 0 else 0.0) if rate > fps):
        off = np.abs(places * rate - np.round(places * rate))
        hits = off.max(initial=0.0) <= 0.01 or rate * shortest >= 1 - 1e-6
        if hits:
            return rate if rate <= MOST_FPS and rate * float(places[-1]) <= MOST_FRAMES else None
    return None


def say_single_frame(path: FilePath) -> None:
    """A GuessWarning for a file of one frame, of a format that holds many, beside which others have its name but for
    the number at its end."""
    name = re.fullmatch(r"(.*?)(\d+)", Path(path).stem, re.DOTALL)
    if name is None:
        return
    form = re.compile(re.escape(name[1]) + r"\d+" + re.escape(Path(path).suffix))
    beside = [other for other in os.listdir(Path(path).parent) if form.fullmatch(other) and other != Path(path).name]
    if beside:
        warnings.warn(
            f"{os.fspath(path)}: holds one frame, and {len(beside)} other{'s' * (len(beside) > 1)} of its name "
            f"({min(beside)} ...) are not read; write all frames into one file if they are one motion",
            GuessWarning,
            stacklevel=2,
        )


def plain_number(number: float) -> str:
    """The number as an option takes it and a person writes it: without an exponent."""
    return np.format_float_positional(round(float(number), 6), trim="-")


def whole(number: float) -> int | float:
    """The number, an int where it is whole."""
    return int(number) if number == int(number) else float(number)


def _start(number: float) -> dict[str, Any]:
    return {"start_frame": whole(number)} if np.isfinite(number) and number else {}


def _usual_rates(times: np.ndarray) -> list[float]:
    if len(times) < 2 or not np.isfinite(times).all() or not times[1] > times[0]:
        return []
    step = np.median(np.diff(times))
    nearest = np.round(1 / step) if step > 0 else 0
    drop = np.round(1 / step / DROP_FRAME) if step > 0 else 0
    return [float(nearest), *([float(drop) * DROP_FRAME] if drop in (24, 30, 60, 120) else [])] if nearest > 0 else []
