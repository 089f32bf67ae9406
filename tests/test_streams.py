"""Standard input and output, called -, in place of files."""

from __future__ import annotations

import io
import os
import sys
import tempfile

import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec import cli


@pytest.fixture
def run(monkeypatch, capfdbinary, tmp_path):
    """The command line with bytes on its standard input: (exit code, standard output, standard error)."""
    monkeypatch.chdir(tmp_path)

    def run(*words, given: bytes = b"") -> tuple[int, bytes, str]:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BufferedReader(io.BytesIO(given))))
        monkeypatch.setattr("sys.stdout", io.TextIOWrapper(io.BytesIO()))
        code = cli.main([str(word) for word in words])
        sys.stdout.flush()
        return code, sys.stdout.buffer.getvalue(), capfdbinary.readouterr().err.decode()

    return run


@pytest.fixture
def clip():
    return plant(seed=1, branches=3, frames=5)


@pytest.mark.parametrize("source", ["a.h5", "a.npz", "a.usdc"])
def test_a_clip_goes_through_pipes_to_an_ath_file_and_back(source, run, clip, tmp_path):
    athcodec.write(clip, tmp_path / source)
    told = ["--source-format", "npz"] if source == "a.npz" else []
    code, encoded, err = run("encode", "-", "-", "--effort", "fast", *told, given=(tmp_path / source).read_bytes())
    assert code == 0 and encoded, err
    code, said, _ = run("info", "-", "--json", given=encoded)
    assert code == 0 and b'"file": "-"' in said
    code, decoded, err = run("decode", "-", "-", "--format", "hdf5", given=encoded)
    assert code == 0, err
    (tmp_path / "b.h5").write_bytes(decoded)
    with athcodec.read(tmp_path / "b.h5") as again:
        assert np.abs(again.block(0, 5) - clip.block(0, 5)).max() < 1e-2
    assert sorted(os.listdir(tmp_path)) == [source, "b.h5"], "no file is called -"


@pytest.mark.parametrize(
    "words, given, message",
    [
        (["encode", "-", "a.ath"], b"v 0 0 0\n", "expected --source-format"),
        (["encode", "-", "-", "a.ath"], b"\x89HDF\r\n\x1a\n", "standard input twice"),
        (["decode", "-", "-"], b"", "expected --format"),
        (["info", "-"], b"nothing", "standard_input.ath"),
    ],
)
def test_what_cannot_be_streamed_is_said_in_one_line(words, given, message, run):
    code, out, err = run(*words, given=given)
    assert code == 1 and out == b"" and message in err and err.count("\n") == 1


def test_a_temporary_folder_is_made_for_streams_alone_and_removed(run, clip, tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr("tempfile.mkdtemp", lambda *args, make=tempfile.mkdtemp: made.append(make(*args)) or made[-1])
    athcodec.encode(clip, tmp_path / "a.ath", effort="fast")
    assert run("info", "a.ath")[0] == 0
    assert not made, "a process that is killed leaves no folder behind"
    assert run("info", "-", given=(tmp_path / "a.ath").read_bytes())[0] == 0
    assert made and not any(map(os.path.exists, made))


def test_a_format_of_several_files_does_not_go_to_standard_output(run, clip, tmp_path):
    athcodec.encode(clip, tmp_path / "a.ath", effort="fast")
    code, out, err = run("decode", "a.ath", "-", "--format", "xdmf")
    assert code == 1 and out == b"" and "expected one that is a single file" in err
