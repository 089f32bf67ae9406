"""A file whose chunks are all made is written, and decoded as a check before it gets its name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from athcodec.decoding import container as ct
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.decoder import Decoder
from athcodec.encoding.assembly.summary import Seam, Summary
from athcodec.encoding.model.motion import release_memory
from athcodec.encoding.streams import writing
from athcodec.errors import FormatError
from athcodec.motion.clip import ClipRange


@dataclass(frozen=True)
class LoopSteps:
    """How a loop of the source moves where it begins again."""

    seam: np.ndarray  # (N, 3) float64: way of each vertex from the last frame to the first.
    beside: float  # Largest way of a vertex between two frames beside the seam, in scene units.


@dataclass(frozen=True)
class Clips:
    """What the chunk CLIPS states about the clips of a file beside the errors at the seams of loops."""

    ranges: Sequence[ClipRange]  # Empty: the file holds one clip without a name, and has no such chunk.
    segment_counts: Sequence[int]
    periodic: bool
    loops: Sequence[LoopSteps | None]  # For each range that is a loop how the source moves there, else None.

    def packed(self, seam_errors: Sequence[Sequence[float] | None]) -> bytes:
        """Return the chunk. `seam_errors`: for each loop the error at its seam at each level."""
        return writing.pack_clips(self.ranges, self.segment_counts, seam_errors, self.periodic)

    def seam_errors(self, decoder: Decoder) -> list[list[float] | None]:
        """Return for each loop how far off its step from the last frame to the first is, per level. `decoder`: the
        file."""
        return [
            None if loop is None else _seam_errors(decoder.play(clip_range.name), loop.seam)
            for clip_range, loop in zip(self.ranges, self.loops)
        ]

    def seams(self, file: AthFile) -> tuple[Seam, ...]:
        """Return for each loop its seam. `file`: with the errors at the seams."""
        return tuple(
            Seam(clip.name, float(np.linalg.norm(loop.seam, axis=1).max()), loop.beside, clip.seam_errors[-1])
            for clip, loop in zip(file.clips, self.loops)
            if loop is not None
        )


def _seam_errors(loop: Decoder, step: np.ndarray) -> list[float]:
    errors = []
    for level in range(loop.file.level_count):
        last, first = (loop.positions(frame, level, np.float64) for frame in (-1, 0))
        errors.append(np.linalg.norm(first - last - step, axis=1).max())
    return errors


@dataclass
class FilledFile:
    """All chunks of a file, which is not yet written.

    It holds nothing else of what the encoder knows, so that the memory of the encoder is free when the file is decoded.
    """

    store: writing.ChunkStore
    header: ct.Header
    errors: np.ndarray
    clips: Clips
    host_mesh: np.ndarray | None  # The rest pose that the file leaves to its host, (N, 3); None: it has its own.
    summary: Summary  # Without what the written file tells: path, bytes, levels and seams.

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return self.store.size(self.header, self.errors)

    def write(self, path: Path | None, out: BinaryIO) -> Summary:
        """Write the whole file to the stream `out`, decode every level once as a check, and return its summary.
        `path`: the name that the file is to have afterwards, for the summary.
        """
        release_memory()
        chunks = self.store.write(out, self.header, self.errors)
        if any(loop is not None for loop in self.clips.loops):
            with AthFile(out, strict=True, host_mesh=self.host_mesh) as file, Decoder(file) as decoder:
                self.store.replace(ct.CLIPS, self.clips.packed(self.clips.seam_errors(decoder)))
            out.seek(0)
            chunks = self.store.write(out, self.header, self.errors)
        with AthFile(out, strict=True, host_mesh=self.host_mesh) as file:
            try:  # The file gets its name after this check.
                file.check()
            except FormatError as error:
                raise AssertionError(
                    f"the encoder made a file that cannot be decoded, and did not keep it: {error}"
                ) from error
            return replace(
                self.summary,
                path=path,
                bytes=self.header.file_length,
                table1=file.table1(),
                levels=file.levels,
                chunk_bytes=self._chunk_bytes(chunks),
                seams=self.clips.seams(file),
            )

    def _chunk_bytes(self, chunks: Sequence[ct.Chunk]) -> dict[str, int]:
        """Return the bytes of each kind of chunk of the file, and of all else as "HEADER"."""
        sizes: dict[str, int] = {}
        for chunk in chunks:
            name = ct.KIND_NAMES[chunk.kind]
            sizes[name] = sizes.get(name, 0) + chunk.length
        sizes["HEADER"] = self.header.file_length - sum(sizes.values())
        return sizes
