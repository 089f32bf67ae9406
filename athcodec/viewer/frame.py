"""A plant in a notebook: the page of an .ath file in a frame that may run its scripts and nothing else."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

from athcodec.viewer.view import file_name, page_of

if TYPE_CHECKING:
    from athcodec.decoding.decoder import Decoder


class Frame:
    """What `Decoder.show` returns: the viewer with the file inside, as notebooks show it.

    Parameters
    ----------
    decoder : Decoder
        Of the file, and of the clip to begin with. The file is read when the frame is shown.
    height : int
        Height in pixels.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("fern")) as fern:
    ...     fern.show(height=360)
    <Frame: fern.ath, 360 pixels high; a notebook shows it as the last value of a cell>
    """

    def __init__(self, decoder: Decoder, height: int = 480):
        self.decoder, self.height = decoder, height

    def __repr__(self) -> str:
        name = file_name(self.decoder.file.name)
        return f"<Frame: {name}, {self.height} pixels high; a notebook shows it as the last value of a cell>"

    def _repr_html_(self) -> str:
        page, title = html.escape(page_of(self.decoder)), html.escape(file_name(self.decoder.file.name))
        return (
            f'<iframe sandbox="allow-scripts" srcdoc="{page}" title="{title}" loading="lazy" width="100%" '
            f'height="{self.height}" style="border: 0"></iframe>'
        )
