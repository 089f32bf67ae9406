"""What is printed: nothing of it steers the terminal, and no keys of URLs are in it."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
import zipfile

import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec import cli, errors
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


def _classes(base: type) -> list[type]:
    return [base, *(each for sub in base.__subclasses__() for each in _classes(sub))]


@pytest.mark.parametrize(
    "kind", [*_classes(errors.AthError), *_classes(errors.AthWarning)], ids=lambda kind: kind.__name__
)
def test_every_error_and_warning_is_one_short_line(kind):
    text = str(kind(f"{HOSTILE}\n{'9' * 5000}\r\u2028 {'a name ' * 5000} the end"))
    assert text.isprintable() and len(text) <= 2000
    assert text.startswith(r"\x1b]0;owned\x07\x9b31m\u202ename\n999") and text.endswith("the end")
    assert str(kind(text)) == text and str(kind("Grün 木 é, 1,000 frames")) == "Grün 木 é, 1,000 frames"


def test_an_error_about_a_file_with_a_line_break_in_its_name_is_one_line():
    error = errors.ClipError("no clip", shell="athcodec info shows it").about("a\nb")
    assert str(error) == r"a\nb: no clip" and error.for_shell == r"a\nb: no clip; athcodec info shows it"


def test_a_shortened_url_keeps_nothing_behind_its_keys():
    assert "secret" not in redacted(errors.one_line(f"https://host/{'a' * 500}?sig={'secret' * 99}"))


def _archive(path, name: str, content: bytes) -> None:
    """Write an archive of NumPy with one usable array, and a member of this name."""
    np.savez(path, positions=np.zeros((2, 3, 3)))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, content)


LEGACY = "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS {} float\n0 0 0\n"


@pytest.mark.parametrize("content", [b"x", b""], ids=["broken", "empty"])
def test_a_member_of_an_archive_with_a_line_break_in_its_name_is_named_in_one_line(content, tmp_path, capsys):
    _archive(tmp_path / "a.npz", f"a\nb{HOSTILE}.npy", content)
    with pytest.raises(errors.ClipError) as caught:
        athcodec.read(tmp_path / "a.npz")
    assert str(caught.value).isprintable() and r"a\nb\x1b]0;owned" in str(caught.value)
    assert cli.main(["encode", str(tmp_path / "a.npz"), str(tmp_path / "a.ath")]) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and r"a\nb\x1b]0;owned" in err


def test_what_is_not_read_is_named_in_one_short_line(tmp_path, capsys):
    _archive(tmp_path / "a.npz", f"a\nb{HOSTILE}{'9' * 5000}.txt", b"x")
    assert cli.main(["encode", str(tmp_path / "a.npz"), str(tmp_path / "a.ath"), "--effort", "fast"]) == 0
    [line] = [line for line in capsys.readouterr().err.split("\n") if "not read" in line]
    assert line.isprintable() and r"a\nb\x1b]0;owned" in line and len(line) < 1000


@pytest.mark.parametrize("count", ["9" * 1000, "9" * 4000 + "\x07"], ids=["digits", "controls"])
def test_a_count_of_a_thousand_digits_is_refused_in_one_short_line(count, tmp_path):
    (tmp_path / "a.vtk").write_text(LEGACY.format(count))
    with pytest.raises(errors.ClipError, match="999") as caught:
        athcodec.read(tmp_path / "a.vtk")
    assert str(caught.value).isprintable() and len(str(caught.value)) < 1000


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
