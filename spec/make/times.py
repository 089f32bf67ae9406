"""TIME."""

from spec.make.base import *
from spec.make.clips import two_clips


def steady(first: float, step: float) -> Callable[[], bytes]:
    return lambda: steady_time(first, step)


def clip_times(title: str, make: Callable[[], bytes]) -> None:
    """Add TIME of the two clips."""
    invalid(f"time-{title}", lambda: two_clips().change(TIME, content=make()))


STEADY = (0.0, 0.25)


valid("time-whole-rate: times by a whole rate", lambda: lone(frames=7, time=whole_rates(3)))
valid("time-largest-rate: Rate 65535", lambda: lone(frames=7, time=whole_rates(65535)))
valid("time-step: times by their step, First below 0", lambda: lone(frames=4, time=steady_time(-2.0, 1 / 24)))
valid("time-wide: times far from 0, with a Step that just counts", lone, frames=3, time=steady_time(2.0**52, 1.0))
valid(
    "time-uneven: times one by one, -0.0 and subnormal ones among them",
    lambda: lone(frames=6, time=uneven_time(-1e300, -1.0, -0.0, TINY, 1 / 3, HIGHEST)),
)
valid("time-one-uneven: a single time by Method 2", lambda: lone(time=uneven_time(1.5)))
prelude(TIME, "empty: no bytes", b"")
prelude(TIME, "method-3: Method 3", lambda: whole_rates(1, method=3))
prelude(TIME, "whole-0: Rate 0", lambda: whole_rates(0))
prelude(TIME, "whole-short: half of Rate", lambda: whole_rates(2)[:2])
prelude(TIME, "whole-long: two Rates of one clip", lambda: whole_rates(2, 2))
prelude(TIME, "short: First and half of Step", lambda: steady_time()[:13])
prelude(TIME, "long: a byte behind Step", lambda: steady_time() + b"\0")
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    prelude(TIME, f"step-{word}: Step is {value}", steady(0.0, value))
prelude(TIME, "first-nan: First is NaN", steady(NAN, 1.0))
prelude(TIME, "first-infinite: First is infinite", steady(-INFINITY, 1.0))
prelude(TIME, "stands-still: Step vanishes beside First", steady(1e30, 1.0))
prelude(TIME, "overflows: times beyond binary64", steady(0.0, HIGHEST))
prelude(TIME, "equal: a time twice", lambda: uneven_time(0.0, 1.0, 1.0, 2.0))
prelude(TIME, "descends: a time before the one before", lambda: uneven_time(0.0, 1.0, 2.0, 1.5))
prelude(TIME, "zeros: -0.0 is not before 0.0", lambda: uneven_time(-0.0, 0.0, 1.0, 2.0))
prelude(
    TIME,
    "infinite: an infinite time at the end",
    lambda: uneven_time(
        0.0, 1.0, 2.0, (rules.ordered(0x7FF << 52, 64) - rules.ordered(rules.to_bits(3.0, 64), 64), False)
    ),
)
prelude(TIME, "zero-behind: a zero byte behind the stream", lambda: uneven_time(0.0, 1.0, 2.5, 3.0) + b"\0")
prelude(TIME, "bytes-behind: bytes behind the stream", lambda: uneven_time(0.0, 1.0, 2.5, 3.0) + b"\1" * 12)
invalid(
    "time-code-outside: a stream whose code is outside the final interval",
    lambda: lone().change(TIME, content=b"\2" + b"\xff" * 8),
)
invalid(
    "time-of-one-infinite: First of a single frame is infinite",
    lambda: lone().change(TIME, content=steady_time(INFINITY)),
)
clip_times("second-rate-0: Rate of the second clip is 0", lambda: whole_rates(24, 0))
clip_times("of-one-clip: First and Step of one clip of two", lambda: steady_times(STEADY))
clip_times("of-three-clips: First and Step of three clips where two are", lambda: steady_times(STEADY, STEADY, STEADY))
clip_times("without-last-step: First of the second clip without its Step", lambda: steady_times(STEADY, STEADY)[:-8])
invalid(
    "time-of-two-clips: First and Step of two clips where one is",
    lambda: lone().change(TIME, content=steady_times(STEADY, STEADY)),
)
for word, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    clip_times(
        f"second-step-{word}: Step of the second clip is {value}",
        lambda value=value: steady_times(STEADY, (0.0, value)),
    )
for title, make in {
    "second-first-nan: First of the second clip is NaN": lambda: steady_times(STEADY, (NAN, 1.0)),
    "second-stands-still: Step of the second clip vanishes beside its First": lambda: steady_times(STEADY, (1e30, 1.0)),
    "first-stands-still: Step of the first clip vanishes beside its First": lambda: steady_times((1e30, 1.0), STEADY),
    "second-overflows: times of the second clip beyond binary64": lambda: steady_times(STEADY, (0.0, HIGHEST)),
    "uneven-second-equal: a time twice in the second clip": lambda: uneven_time(0.0, 1.0, 2.0, 0.0, 1.0, 1.0, 2.0),
    "uneven-first-descends: a time of the first clip before the one before": lambda: uneven_time(
        0.0, 2.0, 1.0, 3.0, 4.0, 5.0, 6.0
    ),
    "uneven-more: a time more than there are frames": lambda: uneven_time(0.0, 1.5, 2.0, 0.0, 1.0, 2.0, 3.0, 1e-9),
}.items():
    clip_times(title, make)

valid(
    "time-uneven-empty: TIME of Method 2 without a stream: its bits are ones, and the only time is the least that "
    "there is",
    lambda: lone(time=b"\2"),
)
for word, value in (("zero", 0.0), ("negative", -1.0)):
    invalid(
        f"time-of-one-step-{word}: Step of a single frame, which needs none, is {value}",
        lambda value=value: lone().change(TIME, content=steady_time(0.0, value)),
    )
