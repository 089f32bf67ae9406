"""A disk that is full while a motion is written: an error that names the file, and nothing is left."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from programs import printed

pytestmark = pytest.mark.formats

WRITE = """
import resource, signal, sys
import athcodec
from moving_meshes import quad_clip
clip = quad_clip(frames=60, rings=400)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    athcodec.write(clip, sys.argv[1])
except OSError as error:
    print(error.filename)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limits of file sizes to take the place of a full disk")
@pytest.mark.parametrize("name", ["a.pc2", "a.mdd", "a.obj", "a.ply", "a.npz", "a.xdmf", "a.pvd", "a.abc"])
def test_a_full_disk_is_an_error_and_leaves_no_file(tmp_path, name):
    for limit in (3000, 40000):
        environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}
        found = printed(sys.executable, "-c", WRITE, tmp_path / name, limit, env=environment)
        assert found.strip() == str(tmp_path / name)
        assert os.listdir(tmp_path) == []
