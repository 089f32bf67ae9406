"""Tables of documents are those of the results that `python -m bench` has stored."""

from __future__ import annotations

import ast
from pathlib import Path

from athcodec.encoding.options.features import Feature
from bench import codec_registry, compare, constants, features, report
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


def test_a_feature_stays_for_its_bytes_if_it_saves_enough_for_two_makers_left_out_or_alone():
    def rows(feature, **without):
        key = {"bound": 1e-3, "ladder": "", "frames": 64, "feature": feature, "with": 1000}
        return [{"clip": clip, "without": size} | key for clip, size in without.items()]

    left_out = rows("copies", skfem_leaf=1040, skfem_blade=1100) + rows("repeats", helios_bed=1040)
    alone = rows("copies", skfem_leaf=1040, helios_bed=1029) + rows("repeats", helios_bed=1500, skfem_leaf=1030)
    decided = {row["feature"]: row for row in features.decisions({"sizes": left_out, "alone": alone})}
    copies, repeats = (decided[feature.value] for feature in (Feature.COPIES, Feature.REPEATS))
    assert copies["left out"] == "10.0 `skfem_blade` at 0.001" and copies["stays for"] == "nothing"
    assert repeats["alone"] == "50.0 `helios_bed` at 0.001, 3.0 `skfem_leaf` at 0.001"
    assert repeats["stays for"] == "bytes"
    assert decided[Feature.TURN.value]["stays for"] == "the shape of leaves"


def test_a_feature_alone_is_measured_beside_those_that_it_needs(monkeypatch):
    files = object.__new__(features._Files)
    files._polygons = None
    monkeypatch.setattr(files, "_file", lambda options, without: (None, len(without)), raising=False)
    switches = len(Feature) - len(features.OF_OPTIONS)
    assert files.sizes_alone((Feature.COPIES,)) == (switches - 1, switches)
    assert files.sizes_alone((Feature.COMMON_BASIS,)) == (switches - 2, switches - 1)


def test_where_another_codec_is_smaller_is_told_by_kinds_with_shares_of_our_files():
    def point(codec, kind, size, bound, settings=""):
        key = {"clip": "shader_card_tree", "status": "ok", "codec": codec, "kind": kind, "bound": bound}
        return key | {"bytes": size, "settings": settings}

    ours = "motion transformed, chunk_bytes HIERARCHY 100, REST 100, STEMS 700, CORRECTIONS 100"
    points = [point("athcodec", codec_registry.OURS, 1000, bound, ours) for bound in (1e-3, 1e-4)]
    theirs = "step 2, joint 1, pose 0.2"
    points += [
        point("global PCA (Alexa)", "baseline", size, bound, theirs) for bound, size in ((1e-3, 900), (1e-4, 1001))
    ]
    text = compare.lost_text([{"clips": [{"clip": "shader_card_tree"}], "points": points}], (1e-3, 1e-4))
    assert text.startswith("Of 2 foreign and held-out sizes, another codec's file is smaller in 1:")
    row = next(line for line in text.splitlines() if "`shader_card_tree`" in line)
    cells = [cell.strip() for cell in row.split("|")]
    assert cells[3:8] == ["1", "10.0 to 10.0", "global PCA 1", "1", "70, 10"]


def test_no_clip_is_measured_behind_one_that_a_constant_measured_singly_moves():
    some, measured = constants.constants()[:2], []

    class Files:
        clips = {"still": None, "moved": None, "behind": None}

        def moves(self, name, members, factor, clip):
            assert [one.full_name for one in members] == [name]
            measured.append((name, clip, factor))
            return clip == "moved"

    constants._measure_singly(Files(), "group", some)
    expected = [("still", 0.5), ("still", 2.0), ("moved", 0.5)]
    assert measured == [(one.full_name, *each) for one in some for each in expected]


def test_constants_are_told_apart_by_what_moves_a_file_and_by_what_was_measured():
    of_module = {}
    for one in constants.constants():
        of_module.setdefault(one.full_name.rpartition(".")[0], []).append(one)
    (quiet, some), (loud, others) = sorted(of_module.items(), key=lambda item: -len(item[1]))[:2]
    key = {"clip": "helios_bed", "frames": 8, "bound": 1e-4, "work": 100, "commit": "0123abcd"}
    sizes = {"": 1000, quiet: 1004, loud: 1006, others[0].full_name: 994, others[1].full_name: None}
    sizes |= {others[2].full_name: 1005}
    text = constants.left_text({"files": [key | {"constants": name, "bytes": size} for name, size in sizes.items()]})
    count = len(constants.constants())
    assert text.startswith(f"{count} constants are left: 2 move a file ")
    assert f", {len(some) + 1} move neither, {len(others) - 3} are of a module that moves one" in text
    assert f", {count - len(some) - len(others)} have not been measured. Measured: 2 modules, 3 constants" in text
    assert text.endswith("on 1 clip of 8 frames at 0.0001 (commits 0123abcd).")


def test_every_constant_that_rules_the_encoder_has_a_line_of_its_own_and_a_comment():
    for folder in (ROOT / "athcodec" / "encoding", ROOT / "athcodec" / "motion" / "branches"):
        for file in sorted(folder.rglob("*.py")):
            text = file.read_text("utf-8")
            lines = text.splitlines()
            for node in ast.parse(text).body:
                if not isinstance(node, ast.Assign) or not _is_of_numbers(node.value):
                    continue
                (target,) = node.targets
                place = f"{file.relative_to(ROOT)}:{node.lineno}"
                assert isinstance(target, ast.Name), f"{place}: got several constants in a line"
                line, before = lines[node.end_lineno - 1], lines[node.lineno - 2]
                assert "  # " in line or before.startswith("# "), f"{place}: got no unit and reason beside {target.id}"


def _is_of_numbers(value):
    """Return whether an expression has numbers alone."""
    leaves = [part for part in ast.walk(value) if isinstance(part, (ast.Constant, ast.Name, ast.Call, ast.Dict))]
    return bool(leaves) and all(
        isinstance(leaf, ast.Constant) and isinstance(leaf.value, (int, float)) and not isinstance(leaf.value, bool)
        for leaf in leaves
    )
