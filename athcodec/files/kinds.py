"""The kind of a file by its first bytes: an output replaces a file of its kind and no other."""

from __future__ import annotations

import os
import re
import struct

from athcodec.files.plain import FilePath, open_plain

HEAD_BYTES = 4096
TEXT, UNKNOWN = "text", "something else"

# Words of a message, with suffixes and a pattern of the first bytes; the first pattern that fits is the kind.
_KINDS = {
    ".ath": ((".ath",), rb"\x89ATH\r\n\x1a\n"),
    "HDF5": ((".h5", ".hdf5", ".hdf", ".vtkhdf"), rb"\x89HDF\r\n\x1a\n"),
    "NumPy archive": ((".npz",), rb"PK\x03\x04.{26}[^\0]{1,200}?\.npy"),
    "NumPy array": ((".npy",), rb"\x93NUMPY"),
    "MATLAB": ((".mat",), rb"MATLAB 5\.0 MAT-file"),
    "USD": ((".usd", ".usdc", ".usda", ".usdz"), rb"PXR-USDC|#usda|PK\x03\x04.{26}[^\0]{1,200}?\.usd"),
    "ZIP": ((".zip",), rb"PK\x03\x04"),
    "glTF": ((".glb", ".gltf"), rb'glTF|\s*\{[^\0]*"asset"\s*:'),
    "Alembic": ((".abc",), rb"Ogawa"),
    "PC2": ((".pc2",), rb"POINTCACHE2\0"),
    "XDMF": ((".xdmf", ".xmf"), rb"[^\0]*<Xdmf"),
    "VTK": (
        (".vtu", ".vtp", ".vtk", ".vts", ".pvtu", ".pvtp", ".pvts", ".vtm", ".vtpd", ".vtpc", ".pvd"),
        rb"[^\0]*<VTKFile|# vtk DataFile",
    ),
    "HTML": ((".html", ".htm"), rb"(\xef\xbb\xbf)?\s*<(?i:!doctype html|html)"),
    "PNG": ((".png",), rb"\x89PNG\r\n\x1a\n"),
    "GIF": ((".gif",), rb"GIF8"),
    "WebP": ((".webp",), rb"RIFF.{4}WEBP"),
    "JSON": ((".json",), rb"\s*[{\[]"),
    "OBJ or PLY": ((".obj", ".ply"), rb"ply\r?\n|[^\0]*?(?m:^v[ \t]+[-+.\d])"),
    "MDD": ((".mdd",), rb"(?!)"),  # The length of the file tells this kind.
    "MTG": ((".mtg",), rb"(?!)"),  # Its text is that of any table.
}
SOURCES = (
    "HDF5",
    "NumPy archive",
    "NumPy array",
    "MATLAB",
    "USD",
    "glTF",
    "Alembic",
    "PC2",
    "XDMF",
    "VTK",
    "OBJ or PLY",
    "MDD",
)
"""Kinds of files that `athcodec.encode` reads."""

_PATTERNS = {kind: re.compile(pattern, re.DOTALL) for kind, (_, pattern) in _KINDS.items()}
_MDD_HEADER = struct.Struct(">ii")


def add_kind(kind: str, suffixes: tuple[str, ...], magic: tuple[bytes, ...]) -> None:
    """Let files of a further kind, which begin with one of `magic`, replace each other."""
    if magic and kind not in _KINDS:
        pattern = b"|".join(map(re.escape, magic))
        _KINDS[kind], _PATTERNS[kind] = (suffixes, pattern), re.compile(pattern, re.DOTALL)


def kind_by_suffix(suffix: str) -> str | None:
    """Return the kind of file that a suffix promises; None if it promises none."""
    suffix = suffix.lower()
    return next((kind for kind, (suffixes, _) in _KINDS.items() if suffix in suffixes), None)


def kind_of(path: FilePath) -> str:
    """Return the kind of a file by its content; TEXT for other text, UNKNOWN for anything else. Raises ClipError,
    OSError."""
    try:
        with open_plain(path) as file:
            return kind_of_bytes(file.read(HEAD_BYTES), os.fstat(file.fileno()).st_size)
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None


def kind_of_bytes(head: bytes, length: int) -> str:
    """Return the kind of a file, as `kind_of`, by its first HEAD_BYTES and its length."""
    match = next((kind for kind, pattern in _PATTERNS.items() if pattern.match(head)), None)
    if match is None and len(head) >= _MDD_HEADER.size:
        frames, vertices = _MDD_HEADER.unpack_from(head)
        if min(frames, vertices) > 0 and length == _MDD_HEADER.size + 4 * frames + 12 * frames * vertices:
            return "MDD"
    return match or (UNKNOWN if b"\0" in head else TEXT)
