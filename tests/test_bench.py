"""Tables of documents are those of the results that `python -m bench` has stored."""

from __future__ import annotations

from pathlib import Path

from bench import compare, features, report
from bench.store import read

ROOT = Path(__file__).resolve().parent.parent


def test_the_tables_of_documents_are_those_of_the_stored_results():
    for document, name, text in report.sections():
        assert report.parted(document.read_text("utf-8"), name)[1] == f"\n{text}\n", name


def test_the_table_of_clips_that_stand_for_others_is_that_of_the_saved_figures():
    saved = [read(ROOT / "bench" / "results" / f"{name}.json") for name in ("not_made", "stand_ins")]
    old, new = (result["tables"][0]["rows"] for result in saved)
    pairs = {(a["clip"], a["bound"], a["ladder"]): (a["bytes"], b["bytes"]) for a, b in zip(old, new, strict=True)}
    text = (ROOT / "docs" / "benchmarks.md").read_text("utf-8")
    for bound in ("0.001", "0.0001", "1e-05"):
        for ladder in ("none", "decades"):
            sizes = [pairs[clip, bound, ladder] for clip in ("tree_8k_200f", "leaves_373x121f")]
            cells = [f"{one:,} | {other:,} | {other / one:.2f}" for one, other in sizes]
            assert f"| {float(bound):.0e}, `{ladder}` | {' | '.join(cells)} |".replace("e-0", "e-") in text
            assert all(0.5 < other / one < 2 for one, other in sizes)


def test_the_table_of_features_counts_the_makers_whose_clips_a_feature_serves():
    saved = {"skfem_leaf": 1040, "skfem_blade": 1100, "mujoco_cable_vine": 1031, "helios_bed": 1029}
    sizes = [
        {"clip": clip, "bound": 1e-3, "ladder": "", "feature": "copies", "with": 1000, "without": without}
        for clip, without in saved.items()
    ]
    (row,) = features.summary(sizes)
    assert row["makers"] == 2 and row["most of"] == "`skfem_blade` at 0.001"


def test_totals_count_sizes_won_and_lost_over_all_clips_and_bounds():
    def point(clip, codec, kind, bound, size):
        return {"clip": clip, "codec": codec, "kind": kind, "bound": bound, "bytes": size, "status": compare.OK}

    ours, others = compare.Athcodec.name, [(1e-3, 300, 400), (1e-4, 250, 200), (1e-5, 80, 90)]
    points = [point("fern", ours, compare.OURS, bound, 100) for bound in compare.BOUNDS]
    points += [point("fern", f"other {i}", "plain", bound, row[i]) for bound, *row in others for i in range(2)]
    suite = {"clips": [{"clip": "fern"}, {"clip": "not measured"}], "points": points}
    text = compare.totals_text([suite])
    assert "3 sizes were compared, of 1 clips" in text and "smallest in 2, " in text
    assert "takes 2.0 times" in text and "smaller in 1, by 20 % in the median and by 20 % at most" in text
