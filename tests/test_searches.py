"""Text of a file is searched in a time that grows as the text does, however it repeats itself."""

from __future__ import annotations

import pytest
from fuzz import sources

from athcodec.errors import ClipError
from athcodec.sources import mtg, xml_tree
from athcodec.sources.file_series import time_in_text
from athcodec.sources.vtk_xml import _without_raw

LONG = 200_000  # Times that a part is repeated: a search that starts anew at each of them takes an hour.


@pytest.fixture(autouse=True)
def ends():
    """Let a test fail that takes as long as no search may."""
    with sources._timed():
        yield


@pytest.mark.parametrize(
    "text",
    ["time " + "9" * LONG + "x", "time" + " " * LONG + "x", "\n" * LONG, "t" + " " * LONG, "time 1e" + "5" * LONG + "x"]
    + ["time 1" + ".-" * LONG + "x", "time " + "9" * LONG + "\xff" + "9" * LONG],
    ids=["digits", "spaces", "lines", "t", "exponent", "marks", "two numbers"],
)
def test_a_comment_is_searched_once_for_a_time(text):
    assert time_in_text("the title", text) is None


@pytest.mark.parametrize(
    "text, seconds",
    [
        ("time = 0.25 s", 0.25),
        ("a\n\n  Time: .5", 0.5),
        ("at t=1e-3", 1e-3),
        ("at time 1e-3,", 1e-3),
        ("x; t = -2.", -2.0),
    ]
    + [("TimeValue 7", 7.0), ("simulation time 3.5e1 s", 35.0), ("time 12:30", None), ("time 1.2.3", None)]
    + [("time 2024-05-01", None), ("time 5s", None), ("sometime 5", None), ("time 4...", 4.0)],
)
def test_a_time_is_found_where_a_comment_states_it(text, seconds):
    stated = time_in_text("the title", text)
    assert (stated and stated.seconds) == seconds


@pytest.mark.parametrize(
    "text", [b"<AppendedData encoding='raw' " * LONG, b'<AppendedData encoding="raw"' + b" " * LONG]
)
def test_appended_data_of_vtk_are_searched_once(text):
    assert _without_raw(text) == (text, None)


def test_a_doctype_is_searched_once():
    with pytest.raises(ClipError, match="DOCTYPE"):
        xml_tree.parse_xml(b"<!DOCTYPE a" + b" " * LONG + b"<a/>", "a", None)


def test_comments_of_mtg_that_do_not_end_are_searched_once(tmp_path):
    (tmp_path / "a.mtg").write_text("(#" * LONG)
    with pytest.raises(ClipError):
        mtg.read_mtg(tmp_path / "a.mtg")
