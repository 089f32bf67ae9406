"""Writes a NumPy archive (.npz) with the names of athcodec's HDF5 schema, frame block by frame block.

`numpy.load` opens it without pickles; metadata are JSON text in the array `metadata`. Without gzip the positions lie in
it as they are, so that they can be read in any order. The same clip gives the same bytes.
"""

from __future__ import annotations

import json
import re
import zipfile
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.files.atomic import new_file
from athcodec.files.plain import FilePath
from athcodec.motion.clip import RESERVED_NAMES
from athcodec.motion.hierarchy import branch_orders
from athcodec.motion.joining import clip_metadata
from athcodec.motion.protocol import Motion
from athcodec.sources.npz import METADATA


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> None:
    """Write the archive. Raise ClipError if the name of an attribute is taken or leads to another folder, OSError if
    nothing can be written.
    """
    arrays = _arrays(motion)
    packing = zipfile.ZIP_DEFLATED if options.gzip else zipfile.ZIP_STORED
    with new_file(path) as file, zipfile.ZipFile(file, "w") as archive:
        for name, values in arrays.items():
            with _member(archive, name, packing) as member:
                np.lib.format.write_array(member, values, allow_pickle=False)
        with _member(archive, "positions", packing) as member:
            _write_positions(motion, member, report)


def _member(archive: zipfile.ZipFile, name: str, packing: int) -> Any:
    info = zipfile.ZipInfo(f"{name}.npy")
    info.compress_type, info.external_attr = packing, 0o644 << 16
    return archive.open(info, "w", force_zip64=True)


def _write_positions(motion: Motion, member: Any, report: Progress) -> None:
    """Write the positions (T, N, 3), block by block, as an array in NumPy's format to an open member of the archive."""
    shape, dtype = (motion.frame_count, motion.vertex_count, 3), motion.dtype.newbyteorder("<")
    np.lib.format.write_array_header_1_0(
        member, {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    )
    for start, frames in motion.blocks():
        member.write(np.ascontiguousarray(frames, dtype).data.cast("B"))
        report((start + len(frames)) / motion.frame_count)


def _arrays(motion: Motion) -> dict[str, np.ndarray]:
    """Return all arrays of the archive but the positions, by name. Raise ClipError if the name of an attribute is taken
    or leads to another folder.
    """
    clashing = (RESERVED_NAMES | {METADATA}).intersection(motion.attributes)
    if clashing:
        raise ClipError(f"attributes: got the name {min(clashing)!r}, expected one that the schema does not use")
    for name in motion.attributes:
        if name.startswith(("/", "\\")) or ":" in name or not {"", ".", ".."}.isdisjoint(re.split(r"[/\\]", name)):
            raise ClipError(f"attributes: got the name {name[:80]!r}, expected one that leads to no other folder")
    arrays = {"time": motion.time, "rest": getattr(motion, "source_rest", motion.rest)}
    if motion.branch_parent is not None:
        arrays["branch_order"] = branch_orders(motion.branch_parent)
    for name in ("vertex_branch", "branch_parent", "stem_index", "edges", "faces"):
        arrays[name] = getattr(motion, name)
    arrays |= motion.attributes
    metadata = clip_metadata(motion)
    if metadata:
        arrays[METADATA] = np.array(json.dumps(metadata))
    return {name: np.asarray(values) for name, values in arrays.items() if values is not None}
