"""The chunk table of an .ath file, and the contents of its chunks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import overload

import numpy as np

from athcodec.decoding import container as ct
from athcodec.decoding import core_file
from athcodec.decoding.container import Chunk
from athcodec.decoding.file_bytes import FileBytes
from athcodec.errors import BadChecksum

KNOWN_KINDS = np.isin(np.arange(1 << 16), list(ct.KIND_NAMES))
CHUNK_FIELDS = ("kind", "level", "segment", "length", "checksum", "offset")


class Chunks(Sequence[Chunk]):
    """The chunk table without unknown kinds, in file order."""

    def __init__(self, file_bytes: FileBytes) -> None:
        self._bytes = file_bytes

    @cached_property
    def _index(self) -> np.ndarray:
        return np.flatnonzero(KNOWN_KINDS[self._bytes.core.chunks()["kind"]])  # Chunks of unknown kinds are left out.

    @cached_property
    def table(self) -> np.ndarray:
        """The records of these chunks, (C,) of _native.CHUNK."""
        return self._bytes.core.chunks()[self._index]

    @cached_property
    def _known(self) -> list[Chunk]:
        return self._chunks_at(self._index)

    def __len__(self) -> int:
        return len(self._known)

    @overload
    def __getitem__(self, index: int) -> Chunk: ...
    @overload
    def __getitem__(self, index: slice) -> list[Chunk]: ...
    def __getitem__(self, index: int | slice) -> Chunk | list[Chunk]:
        return self._known[index]

    def __iter__(self) -> Iterator[Chunk]:
        return iter(self._known)

    @property
    def all(self) -> list[Chunk]:
        """The chunk table, those of unknown optional kinds among it, in file order."""
        return self._chunks_at(np.arange(len(self._bytes.core.chunks())))

    def of_kind(self, kind: int) -> list[Chunk]:
        """Return the chunks of a kind, in file order."""
        return self._chunks_at(self._index[self.table["kind"] == kind])

    def _chunks_at(self, indices: np.ndarray) -> list[Chunk]:
        table = self._bytes.core.chunks()[indices]
        columns = (table[name].tolist() for name in CHUNK_FIELDS)
        return list(map(Chunk, *columns, indices.tolist(), table["stage"].tolist()))

    def find(self, kind: int) -> Chunk | None:
        """Return the first chunk of a kind (FORMAT.md, "Chunk table"), or None if the file has none."""
        return next(iter(self.of_kind(kind)), None)

    def is_available(self, chunk: Chunk) -> bool:
        """Return whether the bytes of a chunk, one of the table, are there."""
        return chunk.offset + chunk.length <= self._bytes.available_length

    def lacks(self, kind: int) -> bool:
        """Return whether the file was cut off before a chunk of this kind."""
        return not all(map(self.is_available, self.of_kind(kind)))

    def stored(self, chunk: Chunk) -> bytes:
        """Return the bytes of a chunk as they stand, for one that is written to another file. Raises Truncated and, if
        the kind is known, BadChecksum."""
        if chunk.kind in ct.KIND_NAMES:
            return self.payload(chunk)
        with self._bytes.lock:
            return self._bytes.read(chunk.offset, chunk.length, str(chunk))

    def payload(self, chunk: Chunk) -> bytes:
        """Return the bytes stored in a chunk of the file. Raises Truncated if the file ends before, BadChecksum if they
        are damaged."""
        with self._bytes.lock:
            data = self._bytes.read(chunk.offset, chunk.length, str(chunk))
            try:
                self._bytes.core.check_chunk(chunk.index, chunk.offset, data)
            except core_file.CoreError as error:
                raise self._bytes.refusal(error) from None
        return data

    def first_damaged_level(self) -> int | None:
        """Read all chunks of motion that are in the file, and return the level of the first damaged one, or None if all
        are intact."""
        with self._bytes.lock:
            self._bytes.announce([(0, self._bytes.file_length)])
        for chunk in self:
            if chunk.is_motion and self.is_available(chunk):
                try:
                    self.payload(chunk)
                except BadChecksum:
                    return chunk.level
        return None
