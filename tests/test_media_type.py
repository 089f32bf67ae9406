"""What desktops and servers know a file by: spec/media-type.

Run with -m programs; it needs file and update-mime-database (Debian: file, shared-mime-info)."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import athcodec

pytestmark = pytest.mark.programs
FOLDER = Path(__file__).resolve().parent.parent / "spec" / "media-type"


def said(*command: object) -> str:
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def nameless(tmp_path) -> Path:
    """A file without a suffix."""
    return Path(shutil.copy(athcodec.sample_path("fern"), tmp_path / "fern"))


def test_file_names_type_and_version(nameless):
    magic = "file", "-b", "-m", FOLDER / "ath.magic"
    version = ".".join(str(byte) for byte in nameless.read_bytes()[8:10])
    assert said(*magic, nameless) == f"ATH plant motion, format version {version}"
    assert said(*magic, "--mime-type", nameless) == "model/vnd.ath"
    assert "ATH" not in said(*magic, __file__)


def test_desktops_know_the_type_by_suffix_and_by_content(tmp_path):
    (tmp_path / "packages").mkdir()
    shutil.copy(FOLDER / "athcodec.xml", tmp_path / "packages")
    said("update-mime-database", tmp_path)
    assert "model/vnd.ath:*.ath" in (tmp_path / "globs").read_text().splitlines()
    assert b":model/vnd.ath]\n>0=\x00\x08\x89ATH\r\n\x1a\n" in (tmp_path / "magic").read_bytes()
