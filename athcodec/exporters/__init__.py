"""Writers: one module per file format, mirroring sources/. Nothing here knows .ath files."""

from __future__ import annotations

from athcodec.exporters.hdf5 import Hdf5Writer, write_hdf5

__all__ = ["Hdf5Writer", "write_hdf5"]
