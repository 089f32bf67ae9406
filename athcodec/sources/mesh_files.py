"""Reads a mesh file, OBJ or PLY, as its first bytes and its name say. A file is read whole."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, read_plain
from athcodec.sources.mesh import Mesh, kind_of
from athcodec.sources.obj import parse_obj
from athcodec.sources.ply import parse_ply

WORD_ENDS = b" \t\n\r\f\v/"  # What ends a word of text.
WORD_BYTES = 128  # Bytes of memory that a word and the value made of it take.
MESSAGE = 300  # characters of what Python says of a number


def read_mesh(path: FilePath, budget: Budget) -> Mesh:
    """Return the mesh in an OBJ or PLY file. Raises ClipError, OSError."""
    return parse_mesh(read_plain(path, budget), path, budget)


def parse_mesh(data: bytes, path: FilePath, budget: Budget) -> Mesh:
    """Return the mesh in `data`, the content of a PLY or OBJ file. `path` gives the suffix and begins messages. Raises
    ClipError if the content is broken."""
    try:
        budget.need_for(data, WORD_ENDS, WORD_BYTES, "words")
        if data.startswith((b"ply\n", b"ply\r")):
            mesh = parse_ply(data)
        elif Path(path).suffix.lower() == ".ply":
            raise ClipError("got something else, expected a PLY file")
        else:
            mesh = parse_obj(data)
    except (ClipError, ValueError, OverflowError, IndexError, MemoryError) as error:
        raise ClipError(f"{os.fspath(path)}: {str(error)[:MESSAGE]}") from None
    mesh.metadata.setdefault("part_names", [Path(path).stem])
    mesh.metadata.setdefault("part_kinds", [kind_of(mesh.polygons, mesh.edges)])
    mesh.attributes.setdefault("part_vertex_counts", np.array([len(mesh.points)], np.int32))
    mesh.metadata["domains"] = mesh.metadata.get("domains", {}) | {"part_vertex_counts": "constant"}
    return mesh
