"""Random clips there and back: the bound, the hierarchy and the times must come back, whatever the plant.

`python -m fuzz.roundtrip SECONDS SEED` prints lines of JSON: clips tried, and what the first failure said. It runs in
a process of its own, so that a crash of the core is one of the findings and no end of the run.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from plants import awkward_plants
from test_roundtrip import assert_comes_back

BATCH = 20
QUIET = settings(
    max_examples=BATCH,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.generate, Phase.shrink],
    print_blob=True,
)
EFFORTS = ["fast", "fast", "default", "best"]


def batch(number: int, folder: Path) -> tuple[int, str]:
    """(clips tried, what the smallest failure said)."""
    tried = 0

    @QUIET
    @seed(number)
    @given(
        awkward_plants(),
        st.sampled_from([1e-1, 1e-2, 1e-3, 1e-4, 1e-5]),
        st.integers(16, 256),
        st.sampled_from(EFFORTS),
        st.booleans(),
    )
    def comes_back(clip, fraction, segment_frames, effort, exact_rest):
        nonlocal tried
        tried += 1
        assert_comes_back(clip, folder, fraction, segment_frames=segment_frames, effort=effort, exact_rest=exact_rest)

    try:
        comes_back()
    except Exception as error:
        return tried, f"{type(error).__name__}: {error}"
    return tried, ""


def main() -> int:
    seconds, number = float(sys.argv[1]), int(sys.argv[2])
    start, tried, failure = time.monotonic(), 0, ""
    with TemporaryDirectory() as folder:
        while not failure and time.monotonic() - start < seconds:
            more, failure = batch(number, Path(folder))
            tried, number = tried + more, number + 1
            print(json.dumps({"tried": tried, "next": number, "failure": failure}), flush=True)
    return 1 if failure else 0


if __name__ == "__main__":
    sys.exit(main())
