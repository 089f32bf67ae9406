"""Results in a Python prompt and in a notebook: a line for each object, text to keep, tables that are escaped."""

from __future__ import annotations

import io
import pickle
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec import cli
from athcodec.files.shown import Report, Table

GRASS = athcodec.sample_path("grass")


class Cells(HTMLParser):
    """The rows of all tables, and the tags that occur."""

    def __init__(self, text: str):
        super().__init__()
        self.rows, self.tags = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        assert not attrs or tag == "iframe"  # in which a decoder plays
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.rows and self.lasttag in ("td", "th"):
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """One of each public object of a plant with many frames, vertices and branches."""
    clip = plant(seed=3, branches=30, longest=9, frames=40)
    clip.metadata = {"unit": "m"}
    folder = tmp_path_factory.mktemp("shown")
    joined = athcodec.join({"calm": clip, "gale": clip.replace(positions=clip.positions * np.float32(1.1))})
    summary = athcodec.encode(joined, folder / "plant.ath", rel_error=1e-3, effort="fast")
    decoder = athcodec.open(folder / "plant.ath")
    view = athcodec.ClipView(decoder, 1)
    objects = [clip, joined, summary, decoder, decoder.file, view, view.positions, decoder.clip, decoder.levels[0]]
    objects += [athcodec.find_branches(clip, "motion"), athcodec.build_ath(clip, max_error=0.1), decoder.affines(3, 1)]
    objects += [athcodec.compare(clip, decoder), athcodec.write(view, folder / "a.obj"), decoder.file.tables.header]
    objects += [athcodec.Thresholds(0.1, 2, "1mm", 3), decoder.file.hierarchy, decoder.file.limits]
    with decoder:
        yield {type(shown).__name__: shown for shown in objects}


def test_every_public_object_is_shown_in_a_line(shown):
    names = {"MotionClip", "Summary", "Decoder", "AthFile", "ClipView", "Found", "Ath", "Comparison", "Affines"}
    assert names | {"Written", "Thresholds", "Clip", "Level", "Header"} <= shown.keys()
    for name, value in shown.items():
        text = repr(value)
        assert "\n" not in text and len(text) <= 400 and re.match(rf"<?{name}\b", text) and " object at 0x" not in text
    assert re.search(r"40 files, '.*a_0000.obj' to '.*a_0039.obj'", repr(shown["Written"]))
    assert re.fullmatch(
        r"<Comparison: \d levels in 40 frames, largest error 0[\d.e-]+ at level \d, [\d.e-]+ at level 0>",
        repr(shown["Comparison"]),
    )
    assert repr(shown["MotionClip"]).startswith("MotionClip(80 frames, ")
    one = athcodec.MotionClip(np.zeros((1, 1, 3), np.float32), [0.0], vertex_branch=[0], branch_parent=[-1])
    assert repr(one) == "MotionClip(1 frame, 1 vertex, 1 branch, float32)"


def test_a_summary_is_the_text_that_info_prints(capsys):
    with athcodec.open(GRASS) as grass:
        text = grass.summary()
    assert capsys.readouterr().out == "" and isinstance(text, str) and repr(text) == str(text)
    assert cli.main(["info", str(GRASS)]) == 0
    assert text.splitlines() == [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    again = pickle.loads(pickle.dumps(text))
    assert again == text and again._repr_html_() == text._repr_html_()


def test_nodes_without_children_are_called_that(stepwise_ath):
    with athcodec.open(stepwise_ath) as bare:
        assert "ATH: depth 3, 99 nodes, 84 without children\n" in bare.summary() and "leaves" not in bare.summary()


def test_notebooks_show_tables_of_the_levels(shown):
    with athcodec.open(GRASS) as grass:
        cells = Cells(grass._repr_html_())
        *_, before, last = grass.file.levels
        numbers = [str(level.level) for level in grass.file.levels]
        assert [row[0] for row in cells.rows] == ["clip", "calm", "gale", "level", "prelude", *numbers, "arrays"]
        share = (last.bytes - before.bytes) / GRASS.stat().st_size
        assert cells.rows[-2][4] == f"{share:.1%}" and cells.rows[-2][6] == f"{last.max_error:.3g}"
        assert grass._repr_html_() == grass.show()._repr_html_() + grass.summary()._repr_html_()
    comparison, summary = shown["Comparison"], shown["Summary"]
    head, *rows = Cells(comparison._repr_html_()).rows
    assert head == ["level", "promised", "max", "RMS", "in frame", "at seconds", "vertex"]
    for level, row in enumerate(rows):
        frame = int(comparison.max_error[level].argmax())
        errors = comparison.promised[level], comparison.max_error[level, frame]
        assert row[:3] == [f"{level}", *(f"{error:.4g}" for error in errors)]
        assert row[4] == f"{frame}" and row[6] == f"{comparison.worst_vertex[level, frame]:,}"
        assert float(row[3]) == pytest.approx(np.sqrt(np.mean(comparison.rms_error[level] ** 2)), rel=1e-3)
    assert str(comparison).count("\n") == len(rows) + 1
    assert [row[0] for row in Cells(summary._repr_html_()).rows[1:]] == [f"{level.level}" for level in summary.levels]
    assert str(summary) in summary._repr_html_()


def test_what_a_file_names_is_escaped_in_html_and_in_text(any_unit):
    hostile = "<script>alert('x')</script>&\x1b[2J\u202e"
    clip = plant(seed=1, branches=2, frames=4)
    clip.metadata = {"unit": hostile}
    joined = athcodec.join({"<b>calm</b>": clip, "gale": clip})
    with athcodec.open(athcodec.encode(joined, effort="fast")) as decoder:
        page, text = decoder._repr_html_(), decoder.summary()
        assert Cells(page).tags == {"iframe", "div", "table", "tr", "th", "td"}
        assert "&lt;script&gt;" in page and "&lt;b&gt;calm" in page
        assert not set("\x1b\u202e") & set(page + text) and "\\x1b[2J" in text
    page = Report(["<i>", Table(["<b>"], [["<u>"]])])._repr_html_()
    assert page == "<div>&lt;i&gt;</div><table><tr><th>&lt;b&gt;</th></tr><tr><td>&lt;u&gt;</td></tr></table>"


def test_a_file_without_a_name_is_shown_too():
    with athcodec.open(GRASS.read_bytes()) as of_bytes, athcodec.open(io.BytesIO(GRASS.read_bytes())) as of_file:
        for decoder in (of_bytes, of_file):
            assert decoder.summary().startswith("file: 1,400 vertices") and repr(decoder.file).startswith(
                "<AthFile 'file':"
            )
