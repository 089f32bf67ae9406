"""athcodec: a codec and file format for the motion of plants, with levels of detail over the branch hierarchy."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # Type checkers and the reference look here for what __getattr__ returns.
    from athcodec import errors, metrics
    from athcodec.binding import OntoMesh, OntoReport, onto
    from athcodec.comparison import Comparison, compare
    from athcodec.compression import encode
    from athcodec.decoding.ath_file import AthFile
    from athcodec.decoding.clip_view import ClipView
    from athcodec.decoding.decoder import Decoder
    from athcodec.encoding import Summary
    from athcodec.encoding.clip.survey import Ath, build_ath
    from athcodec.exporters import write, write_hdf5
    from athcodec.finding import find_branches
    from athcodec.motion.branches.result import Found
    from athcodec.motion.clip import MotionClip
    from athcodec.motion.joining import in_wind, join, looped, split
    from athcodec.motion.thresholds import Thresholds
    from athcodec.opening import open
    from athcodec.sources import read, read_hdf5, sample_path
    from athcodec.truncation import truncate
    from athcodec.viewer.frame import Frame

__version__ = "1.0.0"
__all__ = [
    "Ath",
    "AthFile",
    "ClipView",
    "Comparison",
    "Decoder",
    "Found",
    "Frame",
    "MotionClip",
    "OntoMesh",
    "OntoReport",
    "Summary",
    "Thresholds",
    "build_ath",
    "compare",
    "encode",
    "errors",
    "find_branches",
    "in_wind",
    "join",
    "looped",
    "metrics",
    "onto",
    "open",
    "read",
    "read_hdf5",
    "sample_path",
    "split",
    "truncate",
    "write",
    "write_hdf5",
]
# Names by module. Importing the package loads none of them, so that a command or a program pays for what it uses.
_LAZY = {
    "binding": ("OntoMesh", "OntoReport", "onto"),
    "encoding.clip.survey": ("Ath", "build_ath"),
    "motion.thresholds": ("Thresholds",),
    "decoding.ath_file": ("AthFile",),
    "motion.clip": ("MotionClip",),
    "decoding.clip_view": ("ClipView",),
    "decoding.decoder": ("Decoder",),
    "opening": ("open",),
    "finding": ("find_branches",),
    "motion.branches.result": ("Found",),
    "comparison": ("Comparison", "compare"),
    "compression": ("encode",),
    "encoding": ("Summary",),
    "exporters": ("write", "write_hdf5"),
    "motion.joining": ("in_wind", "join", "looped", "split"),
    "sources": ("read", "read_hdf5", "sample_path"),
    "truncation": ("truncate",),
    "viewer.frame": ("Frame",),
}
_MODULES = ("errors", "metrics")


def __getattr__(name: str) -> Any:
    """Import a public name of the package when it is first used, and return it. Raise AttributeError if there is no
    such name.
    """
    if name in _MODULES:
        return import_module(f"athcodec.{name}")
    for module, names in _LAZY.items():
        if name in names:
            # The next look-up finds the name in the package itself.
            return globals().setdefault(name, getattr(import_module(f"athcodec.{module}"), name))
    raise AttributeError(f"module 'athcodec' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
