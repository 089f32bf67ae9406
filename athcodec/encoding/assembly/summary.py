"""The report of encoding about the file that it has written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from athcodec.decoding.file_tables import Level
from athcodec.files.shown import Report, Table, counted
from athcodec.untyped import JsonObject


@dataclass(frozen=True)
class Seam:
    """Where a loop begins again; lengths in scene units.

    Attributes
    ----------
    clip : str
        Name of the loop.
    step : float
        Largest distance that a vertex of the source moves from the last frame to the first.
    step_beside : float
        The same for the frames next to the seam; in a seamless loop both are alike.
    error : float
        Largest error of that step at the last level of the file.
    """

    clip: str
    step: float
    step_beside: float
    error: float


@dataclass(frozen=True, repr=False)
class Summary:
    """The result of `encode`.

    Attributes
    ----------
    path : Path or None
        The file; None for a file object.
    bytes, raw_bytes : int
        Its size, and that of the positions as float32.
    max_error_bound : float
        Largest distance of any vertex in any frame from the source that the file promises, scene units.
    relative_bound : float
        The bound over the diagonal of the bounding box of all frames; 0 where that is a point.
    table1 : dict
        Nodes, height and mean subtree sizes of the ATH (Song, Yang and Peng 2011, table 1).
    levels : list of Level
        Coarse to fine.
    chunk_bytes : dict of str to int
        Bytes per kind of chunk (FORMAT.md), "HEADER" for header and tables.
    choices : dict
        The settings that the search chose.
    seams : tuple of Seam
        One for each loop.
    found_branches : str or None
        The branches that were found for a clip without, in words; None for a clip that has branches.
    not_read : dict of str to sequence of str
        What the source holds besides, by its kind, named: MotionClip.not_read.
    untried : tuple of str
        Choices that were left out, all or in part, because the clip is too small for so much work; effort "best" has
        room for more.
    converted : str
        How the numbers of an array were converted: "positions: int16 became float32"; empty if they were not.

    Examples
    --------
    >>> import io
    >>> stem = np.zeros((9, 20, 3), np.int16)
    >>> stem[..., 1] = np.arange(20)
    >>> summary = athcodec.encode(stem, io.BytesIO(), max_error=0.01, vertex_branch=[0] * 20, branch_parent=[-1])
    >>> summary.raw_bytes, summary.converted
    (2160, 'positions: int16 became float32')
    """

    path: Path | None
    bytes: int
    raw_bytes: int
    max_error_bound: float
    relative_bound: float
    table1: dict[str, float]
    levels: list[Level]
    chunk_bytes: dict[str, int]
    choices: JsonObject
    seams: tuple[Seam, ...] = ()
    found_branches: str | None = None
    not_read: Mapping[str, Sequence[str]] = field(default_factory=dict)
    untried: tuple[str, ...] = ()
    converted: str = ""

    @property
    def ratio(self) -> float:
        """Bytes of the raw positions over those of the whole file."""
        return self.raw_bytes / self.bytes

    def __repr__(self) -> str:
        return f"<Summary: {self}; {counted(len(self.levels), 'level')}>"

    def _repr_html_(self) -> str:
        """Return the summary as HTML, which notebooks show."""
        rows = [
            [f"{level.level}", level.name, f"{level.nodes:,}", f"{level.bytes:,}"]
            + [f"{error:.3g}" for error in (level.max_error, level.p99_error, level.rms_error)]
            for level in self.levels
        ]
        columns = ["level", "", "nodes", "bytes so far", "max error", "99 % error", "RMS error"]
        return Report([str(self), Table(columns, rows)])._repr_html_()

    def __str__(self) -> str:
        words = f"{self.path or 'file'}: {self.bytes:,} bytes, {self.ratio:.1f} to 1, error at most "
        return words + f"{self.max_error_bound:.3g}" + (f"; {self.converted}" if self.converted else "")
