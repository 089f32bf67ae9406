"""Reads PC2 point caches (3ds Max, Blender ...): 32 bytes of header, then the frames as float32, little endian.

PC2 says at which frame the cache starts and how many frames there are from sample to sample, but no rate: that is
options.fps. Without it frames come DEFAULT_FPS (30) a second, and the clip states a rate only where samples are not one
frame apart. The faces come from a mesh beside it (see _mesh_beside). Coordinates are taken as they are: Blender's own
OBJ export turns its axes unless an option says otherwise, its point caches have the axes of the object.
"""

from __future__ import annotations

import math
import os
import struct
import warnings
from glob import escape
from os import fspath
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, naming
from athcodec.motion.clip import MotionClip
from athcodec.sources import FORMATS, ReadOptions, read
from athcodec.sources.mesh import Mesh
from athcodec.sources.mesh_files import read_mesh
from athcodec.sources.raw import raw_frames, read_exactly
from athcodec.sources.timing import numbered_times
from athcodec.untyped import JsonObject

MAGIC = b"POINTCACHE2\0"
HEADER = struct.Struct("<12siiffi")
MESH_SUFFIXES, CACHE_SUFFIXES = (".obj", ".ply"), (".pc2", ".mdd")


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the point cache `path`. Raises ClipError where it is none, or where the mesh has another number
    of vertices; OSError where a file cannot be opened."""
    return open_cache(path, options, _read_header)


def _read_header(file: BinaryIO, options: ReadOptions) -> JsonObject:
    """Return the fields of a MotionClip that a PC2 point cache holds: "positions", "time" and "metadata". Raises
    ClipError if its header is broken."""
    fields = HEADER.unpack(read_exactly(file, HEADER.size, "header"))
    magic, version, vertex_count, first, step, frame_count = fields
    if magic != MAGIC:
        raise ClipError(f"got {magic[:4]!r} ..., expected a PC2 point cache")
    if version != 1:
        raise ClipError(f"version: got {version}, expected 1")
    if not (math.isfinite(first) and math.isfinite(step) and (step > 0 or frame_count == 1)):
        raise ClipError(f"header: got the start {first} and {step} frames per sample, expected a step above 0")
    check_size(file, frame_count, vertex_count, HEADER.size)
    time, metadata = numbered_times(float(first) + float(step) * np.arange(frame_count), options.fps)
    return {
        "positions": raw_frames(file, HEADER.size, frame_count, vertex_count, "<f4"),
        "time": time,
        "metadata": metadata,
    }


def check_size(file: BinaryIO, frame_count: int, vertex_count: int, header_bytes: int) -> None:
    """Raise ClipError unless a cache has frames and vertices, and as many bytes as they take."""
    if frame_count < 1 or vertex_count < 1:
        raise ClipError(f"header: got {frame_count} frames of {vertex_count} vertices, expected at least one of one")
    size, expected = os.fstat(file.fileno()).st_size, header_bytes + 12 * frame_count * vertex_count
    if size != expected:
        raise ClipError(f"got {size} bytes, expected {expected} for {frame_count} frames of {vertex_count} vertices")


def open_cache(path: FilePath, options: ReadOptions, read_header: Any) -> MotionClip:
    """Return the clip in the point cache `path`, with faces and attributes of the mesh file that belongs to it.
    `read_header(file, options)` has to return the clip's "positions", "time" and "metadata" in a dictionary."""
    file = open_plain(path)
    with naming(path), closing_on_failure(file):
        fields = read_header(file, options)
        mesh_path = options.mesh or _mesh_beside(Path(path))
        if mesh_path is None:
            _say_other_meshes(Path(path))
        mesh = cached_mesh(mesh_path, path, options, fields["positions"].shape[1])
        metadata = mesh.metadata | fields.pop("metadata")
        return MotionClip(
            **fields,
            metadata=metadata,
            not_read=mesh.not_read,
            faces=mesh.faces,
            edges=mesh.edges,
            attributes=mesh.attributes,
            **options.rest_fields(None),
            resource=file,
            unchanged=FileWatch(file.fileno(), *([] if mesh_path is None else [mesh_path])),
        )


def cached_mesh(mesh_path: FilePath | None, path: FilePath, options: ReadOptions, vertex_count: int) -> Mesh:
    """Return the mesh in `mesh_path` whose vertices the point cache `path` moves, or a mesh of points alone if
    `mesh_path` is None.

    The mesh's own positions are not used, because they may have other units or axes. Raises ClipError if the mesh does
    not have `vertex_count` vertices.
    """
    if mesh_path is None:
        metadata = {
            "part_names": [Path(path).stem],
            "part_kinds": ["points"],
            "domains": {"part_vertex_counts": "constant"},
        }
        attributes = {"part_vertex_counts": np.array([vertex_count], np.int32)}
        return Mesh(np.empty((vertex_count, 3)), attributes=attributes, metadata=metadata)
    if Path(mesh_path).suffix.lower() in MESH_SUFFIXES:
        mesh = read_mesh(mesh_path, Budget(options.max_memory))
    else:
        with read(mesh_path, only=options.only, max_memory=options.max_memory) as clip:
            metadata = {name: value for name, value in clip.metadata.items() if name not in ("fps", "start_frame")}
            not_read = {kind: list(names) for kind, names in clip.not_read.items()}
            mesh = Mesh(clip.rest, clip.faces, clip.edges, clip.attributes, metadata, not_read)
    if len(mesh.points) != vertex_count:
        raise ClipError(
            f"mesh {fspath(mesh_path)}: got {len(mesh.points)} vertices, expected {vertex_count} as in the cache"
        )
    mesh.attributes = {
        name: values for name, values in mesh.attributes.items() if name not in options.skip and name != "normals"
    }
    return mesh


def _say_other_meshes(path: Path) -> None:
    """Give a GuessWarning that names files beside the point cache `path` that have its name and may hold its mesh, but
    are not read."""
    known = {suffix for kind in FORMATS for suffix in kind.suffixes} - set(CACHE_SUFFIXES)
    beside = sorted(
        file.name
        for file in path.parent.glob(f"{escape(path.stem)}.*")
        if file.stem == path.stem and file.suffix.lower() in known and file.is_file()
    )
    if beside:
        warnings.warn(
            f"{path}: points alone were read; {', '.join(beside)} beside it may have the mesh: --mesh (mesh=) names it",
            GuessWarning,
            stacklevel=2,
        )


def _mesh_beside(path: Path) -> Path | None:
    """Return the OBJ or PLY file of the cache's name beside it."""
    for suffix in (*MESH_SUFFIXES, *(suffix.upper() for suffix in MESH_SUFFIXES)):
        if path.with_suffix(suffix).is_file():
            return path.with_suffix(suffix)
    return None
