"""A still picture of a plant as SVG, in a few kilobytes and without a browser, for pages where scripts are off."""

from __future__ import annotations

import numpy as np

from athcodec.decoding.decoder import Decoder

MOST_DOTS = 2400
SIDE = 400  # Width and height of the picture, in its own units.
_MARGIN = 20
_STEM_ORDERS = 2  # Orders of branches that are drawn as wood.
_TURN = np.radians(20)  # Sideways, so that leaves in one plane do not become a line.


def still_svg(decoder: Decoder) -> str:
    """Return the rest pose of a plant, or its first frame, as dots: wood brown, what hangs on it green.

    Parameters
    ----------
    decoder : Decoder
        Of a file whose rest pose is known.

    Returns
    -------
    str
        An SVG element of about 20 kB, the same in every run.

    Raises
    ------
    FormatError
        If the file cannot be decoded.
    """
    file = decoder.file
    step = -(-file.vertex_count // MOST_DOTS)
    points = np.asarray(decoder.level_rest(0), np.float64)[::step]
    orders = np.asarray(file.hierarchy.branch_depth)[np.asarray(file.vertex_branch)[::step]]
    across, up = _seen(points, decoder.metadata.get("up_axis") == "z")
    size = max(np.ptp(across), np.ptp(up), 1e-30)
    scale = (SIDE - 2 * _MARGIN) / size
    x = SIDE / 2 + (across - (across.min() + across.max()) / 2) * scale
    y = SIDE - _MARGIN - (up - up.min()) * scale
    wood = orders < _STEM_ORDERS
    paths = (_dots(x[wood], y[wood], "#6b5138", 4), _dots(x[~wood], y[~wood], "#5c8a3e", 3))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIDE} {SIDE}" role="img" '
        f'aria-label="The plant at rest" fill="none" stroke-linecap="round">{"".join(paths)}</svg>'
    )


def _seen(points: np.ndarray, z_is_up: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return how far points are to the right and up, seen from the front and a little from the side."""
    points = np.nan_to_num(points)
    x, y, z = points.T if not z_is_up else (points[:, 0], points[:, 2], -points[:, 1])
    return x * np.cos(_TURN) + z * np.sin(_TURN), y


def _dots(x: np.ndarray, y: np.ndarray, colour: str, width: float) -> str:
    places = sorted({(round(float(a)), round(float(b))) for a, b in zip(x, y)})
    return f'<path stroke="{colour}" stroke-width="{width}" d="{"".join(f"M{a} {b}h0" for a, b in places)}"/>'
