"""Memory of exporting and of reading: that of a few segments, however many frames there are. Each format in a process
of its own."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from plants import clip_of
from programs import peak_of

import athcodec
from athcodec.exporters import FORMATS

pytestmark = pytest.mark.formats

VERTICES, FRAMES, TIMES = 12_000, 96, 5
EXPORT = """
import sys
import athcodec
from athcodec.decoding.clip_view import ClipView

with athcodec.open(sys.argv[1]) as decoder:
    athcodec.write(ClipView(decoder), sys.argv[2], sys.argv[3], animation="morphs")
"""
READ = """
import sys
import athcodec

with athcodec.read(sys.argv[1]) as clip:
    for _ in clip.blocks(max_frames=32):
        pass
"""
STREAMING = [
    kind
    for kind in FORMATS
    if kind.name in ("hdf5", "npz", "pc2", "mdd", "xdmf", "vtk", "sequence", "usd", "alembic", "gltf")
]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same motion once, and TIMES times over."""
    rest = np.cumsum(np.random.default_rng(0).uniform(0, 0.01, (VERTICES, 3)), axis=0).astype(np.float32)
    paths = []
    for frames in (FRAMES, TIMES * FRAMES):
        sway = np.sin(np.arange(frames) / 7)[:, None, None] * np.linspace(0, 1, VERTICES)[None, :, None] ** 2
        clip = clip_of(rest + sway * [1.0, 0.0, 0.2], rest, np.zeros(VERTICES, int), np.array([-1]))
        path = tmp_path_factory.mktemp("long") / f"{frames}.ath"
        athcodec.encode(clip, path, rel_error=1e-3, segment_frames=32, effort="fast")
        paths.append(path)
    return paths


@pytest.mark.skipif(sys.platform == "win32", reason="no resource module")
@pytest.mark.parametrize("kind", STREAMING, ids=lambda kind: kind.name)
def test_exporting_more_frames_takes_no_more_memory_nor_does_reading_them(kind, files, tmp_path):
    targets = [tmp_path / f"{path.stem}{kind.suffixes[0]}" for path in files]
    written = [peak_of(EXPORT, path, target, kind.name) for path, target in zip(files, targets)]
    read = [peak_of(READ, target) for target in targets] if kind.name == "usd" else [0, 0]
    added = 12 * VERTICES * FRAMES * (TIMES - 1)  # bytes of the further frames
    for few, many in (written, read):
        assert many - few < 0.5 * added
