"""athcodec: a codec and file format for the motion of plants, with levels of detail over the branch hierarchy."""

from typing import TYPE_CHECKING

from athcodec import errors
from athcodec.ath import Ath, Thresholds, build_ath
from athcodec.ath_file import AthFile
from athcodec.clip import MotionClip
from athcodec.clip_view import ClipView
from athcodec.decoder import Decoder, open
from athcodec.joining import join, looped, split
from athcodec.truncate import truncate

if TYPE_CHECKING:  # what __getattr__ finds, for type checkers and the reference
    from athcodec.discovery import Found, find_branches
    from athcodec.encoding import Summary, encode
    from athcodec.exporters import write, write_hdf5
    from athcodec.sources import read, read_hdf5, sample_path

__version__ = "0.1.0"
__all__ = ["Ath", "AthFile", "ClipView", "Decoder", "Found", "MotionClip", "Summary", "Thresholds", "build_ath", "encode",
           "errors", "find_branches", "join", "looped", "open", "read", "read_hdf5", "sample_path", "split", "truncate",
           "write", "write_hdf5"]


def __getattr__(name: str):
    # modules that decoding does not need
    if name in ("Summary", "encode"):
        from athcodec import encoding as module
    elif name in ("Found", "find_branches"):
        from athcodec import discovery as module
    elif name in ("read", "read_hdf5", "sample_path"):
        from athcodec import sources as module
    elif name in ("write", "write_hdf5"):
        from athcodec import exporters as module
    else:
        raise AttributeError(f"module 'athcodec' has no attribute {name!r}")
    return getattr(module, name)
