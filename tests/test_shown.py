"""What is printed: nothing of it steers the terminal, and no keys of URLs are in it."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings

import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec import cli
from athcodec.files.shown import redacted, shown

HOSTILE = "\x1b]0;owned\x07\x9b31m\u202ename"
URL = "https://ann:pass%40word@host.example/a/tree.ath?X-Amz-Signature=abcdef&n=2#t=abcdef"


def is_plain(text: str) -> bool:
    return all(character == "\n" or character.isprintable() or character == " " for character in text)


def test_control_and_turning_characters_are_shown_by_their_numbers():
    assert shown("a\x1b[2J\u202eb\x9bc\nd\x7f") == r"a\x1b[2J\u202eb\x9bc" + "\n" + r"d\x7f"
    assert shown("Grün 木 é") == "Grün 木 é"


def test_urls_are_shown_without_users_passwords_and_values():
    plain = "https://host.example/a/tree.ath?X-Amz-Signature=...&n=...#t=..."
    assert redacted(f"got {URL} and {URL}") == f"got {plain} and {plain}"
    assert redacted("s3://bucket/trees/a?.h5 and C:/a?b=c") == "s3://bucket/trees/a?.h5 and C:/a?b=c"
    assert redacted("filecache::https://ann:secret@h/x") == "filecache::https://h/x"


@pytest.fixture
def hostile_ath(tmp_path, any_unit):
    """A file whose unit is such text."""
    clip = plant(seed=1, branches=2, frames=4)
    clip.metadata = {"unit": HOSTILE}
    return athcodec.encode(clip, tmp_path / "a.ath", effort="fast").path


@pytest.mark.parametrize(
    "words", [["info"], ["info", "--json"], ["verify"], ["--debug", "verify", "--clip", HOSTILE + "2"]]
)
def test_names_and_units_of_files_cannot_steer_the_terminal(words, hostile_ath, capsys):
    cli.main([*words, str(hostile_ath)])
    out, err = capsys.readouterr()
    assert is_plain(out) and is_plain(err) and "owned" in out + err or words == ["verify"]


def test_arguments_warnings_and_logs_cannot_either(tmp_path, capsys, monkeypatch):
    with pytest.raises(SystemExit):
        cli.main(["info", "a.ath", f"--{HOSTILE}"])
    assert is_plain(capsys.readouterr().err)

    def info(args) -> int:
        import logging

        warnings.warn(f"{HOSTILE} {URL}", UserWarning, stacklevel=1)
        logging.getLogger("aiohttp.server").error("%s %s", HOSTILE, URL)
        return 0

    monkeypatch.setattr("athcodec.cli.verbs.info", info)
    monkeypatch.setattr("logging.root.handlers", [])  # as outside of the tests
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert cli.main(["info", "a.ath"]) == 0
    err = capsys.readouterr().err
    assert is_plain(err) and err.count("owned") == 2 and "abcdef" not in err and "pass" not in err


@pytest.mark.tools
def test_a_batch_shows_and_keeps_neither(tmp_path):
    names = [f"{HOSTILE}.h5", f"{HOSTILE}2.h5"]
    athcodec.write_hdf5(plant(seed=1, branches=2, frames=4), tmp_path / names[0])
    (tmp_path / names[1]).write_bytes(b"x")
    url = "http://ann:secretword@127.0.0.1:9/b.h5?sig=secretvalue"
    words = ["batch", *(str(tmp_path / name) for name in names), url, "--out", str(tmp_path), "--workers", "1"]
    done = subprocess.run([sys.executable, "-m", "athcodec", *words], capture_output=True, text=True)
    assert done.returncode == 1 and is_plain(done.stdout) and is_plain(done.stderr) and "owned" in done.stderr
    said = done.stdout + done.stderr + (tmp_path / "athcodec-batch.jsonl").read_text()
    assert "127.0.0.1:9/b.h5" in said and "secret" not in said


@pytest.mark.parametrize("more", [[], ["--debug"]])
def test_keys_of_a_url_are_in_no_message(more, capsys):
    assert cli.main([*more, "info", "http://ann:secretword@127.0.0.1:9/a.ath?sig=secretvalue"]) == 1
    err = capsys.readouterr().err
    assert "127.0.0.1:9/a.ath" in err and "secret" not in err


def test_json_of_a_file_behind_a_url_does_not_name_its_key(tmp_path, capsys):
    from athcodec.cli.printing import print_json

    print_json({"file": URL, "levels": [{"name": URL}], "size": np.inf})
    out = capsys.readouterr().out
    assert "abcdef" not in out and "pass" not in out and json.loads(out)["size"] is None
