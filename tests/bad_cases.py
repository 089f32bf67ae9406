"""Cases that crash, hang, flood the memory or are wrong, for the tests of what counts them (spec/robust/_cases.py)."""

from __future__ import annotations

import ctypes
import time

import numpy as np

from spec.robust._cases import Wrong


def behave(data: bytes, how: str) -> int:
    """Memory that it may take: 1 MiB."""
    if how == "crash":
        ctypes.string_at(0)
    if how == "hang":
        time.sleep(60)
    if how == "nap":
        time.sleep(0.05)
    if how == "flood":
        np.ones(200 << 20, np.uint8)
    if how == "be wrong":
        raise Wrong(f"got {data!r}")
    return 1 << 20
