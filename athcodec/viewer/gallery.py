"""A gallery: a folder with a page of several plants, each alive on its card as long as it is in view.

The folder goes onto any web host: the page, the viewer, the files, and a still picture of each.
"""

from __future__ import annotations

import html
import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from athcodec.errors import AthError
from athcodec.files.atomic import check_target, file_ids, is_url, keeping, new_file
from athcodec.files.plain import FilePath
from athcodec.opening import open as open_ath
from athcodec.viewer import picture
from athcodec.viewer.view import WEB, file_name, refuse_glb

PAGE = WEB / "gallery.html"
VIEWER = (
    "ATHLoader.js",
    "LICENSES.txt",
    "OrbitControls.js",
    "ath-viewer.js",
    "ath_worker.js",
    "gallery.css",
    "index.html",
    "model.js",
    "three.js",
    "viewer.css",
    "viewer.js",
)
_FLOAT3 = 12  # bytes of a position as float32


def export_gallery(paths: Sequence[FilePath], folder: FilePath, stills: bool = True) -> int:
    """Writes a folder with a page that shows several .ath files.

    Parameters
    ----------
    paths : sequence of str or path-like
        The .ath files, whose names differ.
    folder : str or path-like
        Made where it is not there; files in it are replaced by files of their kind.
    stills : bool
        Whether to draw a still picture of each plant, which is seen until the plant moves. Takes athcodec[picture] and
        Chromium.

    Returns
    -------
    int
        Size of what was written, bytes.

    Raises
    ------
    AthError
        Where a path is no .ath file, is a URL, or has the name of another.
    MissingExtra
        Where `stills` needs what is not there.
    OSError
        Where a file cannot be read or written.
    """
    names = [file_name(path) for path in paths]
    for path, name in zip(paths, names, strict=True):
        if names.count(name) > 1:
            raise AthError(f"{path}: got two files named {name}, expected names that differ")
    cards = [_card(name, facts_of(path), stills) for path, name in zip(paths, names, strict=True)]
    out = Path(folder)
    for part in ("viewer", "plants", *(["stills"] if stills else [])):
        (out / part).mkdir(parents=True, exist_ok=True)
    with keeping(file_ids(*paths)):
        for target in (out / "index.html", *(out / "plants" / name for name in names)):
            check_target(target, target.suffix)
        for name in VIEWER:
            _write(out / "viewer" / name, (WEB / name).read_bytes())
        for path, name in zip(paths, names, strict=True):
            _write(out / "plants" / name, Path(path).read_bytes())
            if stills:
                _write(out / _still(name), picture.still(path))
        _write(out / "index.html", PAGE.read_text("utf-8").replace("CARDS", "\n".join(cards)).encode())
    return sum(file.stat().st_size for file in out.rglob("*") if file.is_file())


def _write(path: Path, data: bytes) -> None:
    with new_file(path) as out:
        out.write(data)


def facts_of(path: FilePath) -> str:
    """How large a plant's motion is, in words and figures. Raises AthError for what a gallery cannot hold, OSError."""
    if is_url(path):
        raise AthError(f"{path}: got a URL, expected a file that can be copied into the gallery")
    with open(path, "rb") as file:
        refuse_glb(file.read(4))
    with open_ath(path) as decoder:
        vertices = decoder.file.vertex_count
        frames = [clip.frame_count for clip in decoder.file.clips]
    size = os.path.getsize(path)
    clips = f"{len(frames)} clips, " if len(frames) > 1 else ""
    times = _FLOAT3 * vertices * sum(frames) / size
    counts = f"{vertices:,} points, {clips}{sum(frames)} frame{'s' * (sum(frames) != 1)}"
    return f"{counts} · {size / 1000:,.0f} kB, {times:,.0f} times smaller than float32"


def _still(name: str) -> str:
    return f"stills/{Path(name).stem}.webp"


def _card(name: str, facts: str, stills: bool) -> str:
    title, file = html.escape(Path(name).stem.replace("_", " ")), f"plants/{quote(name)}"
    picture = f'<img src="{quote(_still(name))}" alt="" width="640" height="480" loading="lazy">' if stills else ""
    return (
        f'<li><ath-viewer src="{file}" scenery loading="lazy" camera-controls="turn" alt="{title}, moving">{picture}'
        f"</ath-viewer>\n<h2>{title}</h2>\n<p>{facts}</p>\n"
        f'<p><a href="viewer/index.html?file={quote("../" + file, safe="/")}">Open in the viewer</a></p></li>'
    )
