"""Times of formats that number their frames and say nothing of seconds, and of those that say only seconds.

Where a file has no rate and none is given, frames come DEFAULT_FPS a second, and the clip states no rate.
"""

from __future__ import annotations

import warnings

import numpy as np

from athcodec.errors import GuessWarning
from athcodec.motion.clip import DEFAULT_FPS
from athcodec.untyped import JsonObject

SAME_TIME = 1e-5  # Largest difference of equal times, in seconds.
MOST_FPS = 1000.0  # Highest rate that is advised.
MOST_FRAMES = 100_000  # Most frames of a rate that is advised.


def numbered_times(numbers: np.ndarray, fps: float | None) -> tuple[np.ndarray, JsonObject]:
    """Return (T,) seconds from 0 of frames with these numbers in the tool that made them, and the metadata that says
    so.

    Without a given rate the metadata has one only where the numbers do not follow one another: they could not be found
    again from the times.
    """
    numbers = np.asarray(numbers, np.float64)
    rate = fps or DEFAULT_FPS
    metadata: JsonObject = {"start_frame": whole(numbers[0])}
    if fps is not None or (np.diff(numbers) != 1).any():
        metadata["fps"] = float(rate)
    return (numbers - numbers[0]) / rate, metadata


def times_in_seconds(stored: np.ndarray, fps: float | None) -> tuple[np.ndarray, JsonObject]:
    """Return (time, metadata): the times (T,) in seconds from 0, and "fps" and "start_frame" as far as they are known.
    `stored` (T,) has the times in a file's own type, float32 or float64; `fps` is a stated rate.

    If all stored times are multiples of the frame time of a usual rate, rounded to their type, the clip gets that rate
    and times without the rounding. If there is a rate and the first time is not 0, "start_frame" says at which frame
    the clip starts.
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
    """Give a GuessWarning if no frame lies at some of a file's animation keys. `keys` (K,) are their times in seconds,
    ascending, and `missed` (K,) marks those between frames at `fps`. One frame lies at `start`, in seconds; by default
    at the first key that is not missed, or at 0."""
    if not missed.any():
        return
    met = keys[~missed]
    if start is None:
        start = float(met[0]) if len(met) else 0.0
    rate = _rate_of_all(keys - start, fps)
    advice = (
        f"--fps {plain_number(rate)} has a frame at each of them"
        if rate
        else f"they lie on no rate up to {MOST_FPS:g} per second, so resample them in the program that wrote them"
    )
    warnings.warn(
        f"{name}: {missed.sum()} of {len(keys)} key times lie between frames at {fps:g} per second, and what moves "
        f"there alone is missed; {advice}",
        GuessWarning,
        stacklevel=2,
    )


def _rate_of_all(places: np.ndarray, fps: float) -> float | None:
    """Return the lowest rate, a whole number or a multiple of fps, with frames at all of these seconds, one of them at
    0; None where that takes more frames than anybody wants."""
    highest = min(MOST_FPS, MOST_FRAMES / max(float(np.ptp(places)), SAME_TIME))
    multiples = fps * np.arange(2, int(highest / fps) + 1)
    for rate in sorted({*multiples.tolist(), *map(float, range(int(fps) + 1, int(highest) + 1))}):
        if (np.abs(places * rate - np.round(places * rate)) <= min(SAME_TIME * rate, 0.01)).all():
            return rate
    return None


def plain_number(number: float) -> str:
    """Return the number as an option takes it and a person writes it: without an exponent."""
    return np.format_float_positional(round(float(number), 6), trim="-")


def whole(number: float) -> int | float:
    """Return the number as an int if it is whole, as a float otherwise."""
    return int(number) if number == int(number) else float(number)


def _start(number: float) -> JsonObject:
    """Return the metadata of a first frame with this number; empty for 0, which is the default."""
    return {"start_frame": whole(number)} if np.isfinite(number) and number else {}


def _usual_rates(times: np.ndarray) -> list[float]:
    """Return usual frame rates close to that of the times (T,) in seconds, the likeliest first."""
    if len(times) < 2 or not np.isfinite(times).all() or not times[1] > times[0]:
        return []
    step = np.median(np.diff(times))
    if step <= 0:
        return []
    nearest, drop, short = np.round(1 / step), np.round(1.001 / step), np.round(1 / step, 3)
    rates = (nearest, drop * 1000 / 1001 if drop in (24, 30, 60, 120) else 0, short)
    return [float(rate) for rate in rates if rate > 0]
