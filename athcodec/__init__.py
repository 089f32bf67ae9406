"""athcodec: a codec and file format for the motion of plants, with levels of detail over the branch hierarchy."""

from athcodec import errors
from athcodec.ath import Ath, Thresholds, build_ath
from athcodec.clip import MotionClip
from athcodec.decoder import Decoder, open
from athcodec.encoder import Summary, encode
from athcodec.truncate import truncate

__version__ = "0.1.0"
__all__ = ["Ath", "Decoder", "MotionClip", "Summary", "Thresholds", "build_ath", "encode", "errors", "open",
           "read_hdf5", "sample_path", "truncate", "write_hdf5"]


def __getattr__(name: str):
    # HDF5 takes as long to import as a small file to decode, so it waits until it is needed
    if name in ("read_hdf5", "sample_path"):
        from athcodec import sources as module
    elif name == "write_hdf5":
        from athcodec import exporters as module
    else:
        raise AttributeError(f"module 'athcodec' has no attribute {name!r}")
    return getattr(module, name)
