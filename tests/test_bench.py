"""What `python -m bench` prints: sizes with a bound that was checked, figures with command, versions and machine."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from programs import printed

import athcodec
from athcodec import encoding
from athcodec._native import crc32c
from athcodec.decoding.container import KIND_NAMES
from athcodec.encoding.features import Feature

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT))  # for bench, which is not installed; athcodec stays the installed one

from bench import codec_registry, compare, features, rd_worker, report  # noqa: E402
from bench.codecs.sz3 import Sz3  # noqa: E402
from bench.curves import Curve  # noqa: E402
from bench.store import Store, read  # noqa: E402

pytestmark = pytest.mark.tools

KINDS = {*KIND_NAMES.values(), "HEADER"}
MEMORY_PARTS = ("file", "opened", "bases", "work", "segments")


def run_bench(tmp_path, *words, code=0, **environment):
    """(printed text, contents of the JSON file) of one run, on the sample where no clip is named."""
    file = tmp_path / "result.json"
    path = {"PYTHONPATH": str(ROOT / "tests")}
    command = [sys.executable, "-m", "bench", *words, "--json", file]
    return printed(*command, code=code, cwd=ROOT, env=os.environ | path | environment), read(file)


def tables_of(result):
    return [table["rows"] for table in result["tables"]]


def cells_of(text, title):
    """Cells by column of the first row of a printed table."""
    lines = text[text.index(f"### {title}") :].splitlines()
    header, row = ([cell.strip() for cell in lines[i].strip("|").split("|")] for i in (2, 4))
    return dict(zip(header, row, strict=True))


@pytest.fixture(scope="module")
def sizes(tmp_path_factory):
    """What the verb `sizes` prints, and its JSON."""
    return run_bench(tmp_path_factory.mktemp("sizes"), "sizes", "--rel-error", "1e-3", "--effort", "fast")


def test_sizes_come_with_a_bound_that_was_measured_and_kept(sizes):
    text, result = sizes
    sizes, (chunks, _), (choices, _) = tables_of(result)
    size = sizes[0]
    assert [row["ladder"] for row in sizes] == ["none", "decades"]
    assert 0 < size["max/bound"] <= 1 and size["kept"] and result["broken"] == []
    assert cells_of(text, "Sizes")["kept"] == "yes"
    assert cells_of(text, "Sizes")["bytes"] == f"{size['bytes']:,}"
    kinds = {name: value for name, value in chunks.items() if name in KINDS}
    assert sum(kinds.values()) == size["bytes"]
    assert chunks["AFFINES %"] == pytest.approx(100 * chunks["AFFINES"] / size["bytes"])
    assert {"rotations", "learned"} <= choices.keys()


def test_what_a_feature_saves_is_what_a_file_without_it_takes_more(tmp_path, sample_clip):
    store = tmp_path / "features.json"
    words = ["features", "sample", "--bounds", "1e-4", "--features", "shapes", "loose"]
    text, result = run_bench(tmp_path, *words, "--results", store)
    rows = {row["without"]: row for row in result["tables"][0]["rows"]}
    assert rows["loose branches"]["use it"] == 0  # nothing of this tree leaves its place
    sizes = []
    for without in (frozenset(), frozenset({Feature.SHAPES})):
        options = {"attributes": "none", "rest_error": "bound", "ladder": "none", "without": without}
        plan = encoding.draft(sample_clip, rel_error=1e-4, **options)
        coded = encoding.code_segments(sample_clip, plan, range(plan.segment_count))
        sizes.append(encoding.write(sample_clip, plan, coded, tmp_path / "a.ath").bytes)
    growth = float(rows["learned shapes"]["mean %"])
    assert growth == pytest.approx(100 * (sizes[1] / sizes[0] - 1), abs=0.005) and growth > 1
    assert "learned shapes" in text and f"| {growth:.2f} |" in features.table_text(read(store))
    saved = read(store)["sizes"]
    assert {(own["feature"], own["with"], own["without"]) for own in saved} >= {("shapes", *sizes)}
    store.write_text(store.read_text().replace(f",{sizes[1]},", f",{2 * sizes[0]},"))
    _, result = run_bench(tmp_path, *words, "--results", store)
    again = {row["without"]: row["mean %"] for row in result["tables"][0]["rows"]}
    assert again["learned shapes"] == "100.00", "what is saved is not measured again"


def test_levels_end_within_the_bound_and_have_no_gaps_where_the_papers_have(tmp_path):
    text, result = run_bench(tmp_path, "levels", "--rel-error", "1e-3")
    levels, gaps = tables_of(result)
    assert levels[-1]["max"] <= 1e-3 and result["broken"] == []
    assert [row["level"] for row in levels] == list(range(len(levels)))
    assert cells_of(text, "Levels")["nodes"] == "1"
    open_joints = [row for row in gaps if row["joints"]]
    assert open_joints and all(row["max"] < 1e-6 < 1e-3 < row["paper max"] for row in open_joints)


def test_wrappings_hold_the_same_motion_and_ours_keep_the_bound(tmp_path):
    _, result = run_bench(tmp_path, "wrappings", "--rel-error", "1e-3", "--joints", "64")
    rows = {row["file"]: row for row in tables_of(result)[0]}
    ours = [row for name, row in rows.items() if name.startswith("ours")]
    assert len(ours) == 3 and all(0 < row["max error"] <= 1e-3 for row in ours)
    assert all(rows[name]["max error"] < 1e-6 for name in ("USD crate", "Alembic", "GLB, morph targets"))
    assert max(row["bytes"] for row in ours) < min(row["bytes"] for name, row in rows.items() if "ours" not in name)
    assert result["broken"] == []


def test_figures_come_with_command_versions_and_machine(sizes):
    _, result = sizes
    assert result["command"].startswith("python -m bench sizes --rel-error 1e-3")
    assert {"python", "numpy", "athcodec"} <= result["versions"].keys()
    assert {"cpu", "cores"} <= result["machine"].keys()


def test_the_picture_has_a_panel_for_every_level(tmp_path):
    drawing = tmp_path / "levels.svg"
    run_bench(tmp_path, "picture", "--out", str(drawing), "--frame", "0")
    captions = [
        "".join(text.itertext()) for text in ElementTree.parse(drawing).iter("{http://www.w3.org/2000/svg}text")
    ]
    with athcodec.read_hdf5(athcodec.sample_path()) as clip:
        levels = athcodec.build_ath(clip, max_error=1e-4 * 10.657).height + 2
    assert [caption.split()[1] for caption in captions[::2]] == [str(level) for level in range(levels)]


def test_the_timed_decoder_decodes_what_athcodec_decodes_and_coarse_levels_cost_less(tmp_path, sample_ath):
    text, result = run_bench(tmp_path, "decode", str(sample_ath), "--rounds", "1", "--seeks", "2")
    _, levels, _, memory = tables_of(result)
    with athcodec.open(sample_ath) as decoder:
        crc = crc32c(np.ascontiguousarray(decoder.positions(), np.float32))
        assert [row["level"] for row in levels] == [level.level for level in decoder.levels]
    assert levels[-1]["CRC-32C"] == f"{crc:08x}" and result["broken"] == []
    assert len({row["CRC-32C"] for row in levels}) == len(levels)
    size = sample_ath.stat().st_size
    assert 0 < levels[0]["bytes"] < levels[1]["bytes"] < levels[-1]["bytes"] <= size == memory[0]["file"]
    assert memory[0]["sum"] < memory[-1]["sum"] == sum(memory[-1][part] for part in MEMORY_PARTS)
    assert cells_of(text, "Decoding")["unit"] == "ms"


def test_the_timed_decoder_goes_on_from_each_level_of_all_vertices_to_each_deeper_one(tmp_path, layered_ath):
    text, result = run_bench(tmp_path, "decode", str(layered_ath), "--rounds", "1", "--seeks", "1")
    onward = tables_of(result)[2]
    with athcodec.open(layered_ath) as decoder:
        last = decoder.file.level_count - 1
    assert [(row["from"], row["to"]) for row in onward] == [(last - 2, last - 1), (last - 2, last), (last - 1, last)]
    assert all(min(row["kept"], row["onward"], row["anew"]) > 0 for row in onward)
    assert "kept" in cells_of(text, "Going on")


def test_decoding_of_a_clip_is_timed_beside_sz3_in_one_run(tmp_path, bushy_file):
    _, result = run_bench(tmp_path, "decode", bushy_file, "--rounds", "1", "--seeks", "1")
    (row,) = tables_of(result)[-1]
    assert row["layers/single"] == row["layers"] / row["single"] > 0 < row["level 0"]
    assert ("SZ3" in row) == (Sz3().missing() is None)


# ---- rate and distortion ----


@pytest.fixture(scope="session")
def bushy_file(bushy_clip, tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "bushy.h5"
    athcodec.write_hdf5(bushy_clip, path)
    return str(path)


def test_the_size_at_an_error_is_interpolated_between_points_that_nothing_beats():
    curve = Curve.of([1e-5, 1e-3, 1e-4], [1000.0, 10.0, 5000.0])  # the last: more bytes and a larger error
    assert len(curve) == 2
    assert curve.size_at(1e-4) == pytest.approx(100)
    assert curve.size_at(1e-5) == pytest.approx(1000)
    assert curve.size_at(0.9e-5) is None and curve.size_at(1.1e-3) is None


def point(codec, kind, bound, size, clip="tree", **more):
    return {"clip": clip, "codec": codec, "kind": kind, "bound": bound, "status": "ok", "bytes": size} | more


TREE = {"clip": "tree", "what": "", "program": "Blender", "frames": 9, "vertices": 1200, "source_bytes": 5000}
POINTS = [
    point("athcodec", "athcodec", 1e-3, 100),
    point("athcodec", "athcodec", 1e-4, 400),
    point("athcodec, layers", "athcodec", 1e-4, 410, level_max_ratio=1.5, level_rms_ratio=1.25, tick_ratio=2.0),
    point("athcodec, all arrays", "athcodec", 1e-4, 6000, encode_cpu_s=12.4),
    point("simple (differences, zstd)", "baseline", 1e-3, 250),
    point("global PCA", "baseline", 1e-3, 150),
    point("global PCA", "baseline", 1e-4, 300, encode_cpu_s=3.25),
    point("SZ3", "program", 1e-3, 10, status="bound broken"),
    point("SZ3", "program", 1e-4, 1, clip="cube"),
    point("SZ3", "program", 1e-4, 1, status="too slow"),
]


def test_a_clip_is_compared_with_the_smallest_file_of_another_codec_that_kept_the_bound():
    [row] = compare.rows([TREE], POINTS, (1e-3, 1e-4))
    assert (row["source"], row["all arrays"], row["ours 1e-3"], row["ours 1e-4"]) == (5000, 6000, 100, 400)
    assert (row["best other 1e-3"], row["best other 1e-4"]) == ("150 global PCA x1.50", "**300 global PCA x0.75**")
    assert (row["ours/simple"], row["processor s"]) == ("0.40 -", "12 / 3.25")
    assert (row["levels"], row["ticks"], row["frames x vertices"]) == ("1.50 / 1.25", "2.00 / -", "9 x 1,200")
    table = {row["bytes of"]: row for row in compare.by_codec(POINTS, "tree", (1e-3, 1e-4))}
    assert table["SZ3"] == {"bytes of": "SZ3", "1e-3": "bound broken", "1e-4": "too slow", "commit": ""}


def test_sentences_say_where_others_are_smaller_and_what_has_no_file():
    assert compare.losses([TREE], POINTS, (1e-3, 1e-4)) == (
        "Of 2 sizes of athcodec another codec's is smaller in 1: `tree` at 1e-4 (global PCA by 25.0 %). "
        "With all arrays the file is larger than its source: `tree` (by 20.0 %). "
        "The largest error of a level exceeds that of the level before: `tree` (1.50 times). "
        "Without a file: SZ3 bound broken 1 times, SZ3 too slow 1 times."
    )


def test_the_tables_of_documents_are_those_of_the_stored_results():
    for document, name, text in report.sections():
        assert report.parted(document.read_text("utf-8"), name)[1] == f"\n{text}\n", name


def test_a_text_replaces_what_stands_between_the_markers_of_its_name_alone(tmp_path):
    document = tmp_path / "a.md"
    marks = "above\n<!-- {0}: written by python -m bench report -->\nold\n<!-- end of {0} -->\nbelow\n"
    document.write_text(marks.format("rd") + marks.format("odd"))
    report.put(document, "odd", "new")
    assert document.read_text() == marks.format("rd") + marks.format("odd").replace("old", "\nnew")
    with pytest.raises(SystemExit, match="foreign"):
        report.put(document, "foreign", "new")


def test_a_failure_of_a_codec_is_reported_in_its_row(tmp_path, bushy_file):
    names = ("Rounded", "TooCoarse", "Aborting", "Raising", "Remembering", "Absent")
    text, result = run_bench(
        tmp_path, "rd", bushy_file, "--bounds", "1e-3", "--codecs", *(f"bench_codecs:{name}" for name in names)
    )
    points = {point["codec"]: point for point in result["points"]}
    assert {name: point["status"] for name, point in points.items()} == {
        "rounded": "ok",
        "too coarse": "bound broken",
        "aborting": "failed",
        "raising": "failed",
        "remembering": "failed",
        "absent": "missing",
    }
    assert 0 < points["rounded"]["max"] <= 1e-3 < points["too coarse"]["max"]
    assert points["rounded"]["encode_cpu_s"] > 0
    assert "sizes: got 3, expected 4" in points["raising"]["why"]
    assert all(
        f"{point['status'].upper()}: {point['why']}" in text for name, point in points.items() if name != "rounded"
    )
    assert "\nBROKEN" not in text  # of programs; a baseline that breaks its bound is our own mistake


def test_where_a_source_names_no_branches_other_codecs_are_given_those_that_athcodec_finds(bushy_clip):
    bare = bushy_clip.replace(vertex_branch=None, branch_parent=None, stem_index=None)
    codecs = codec_registry.chosen(["athcodec", "global PCA"]).values()
    assert [rd_worker._with_branches(bare, codec, 1e-3).has_branches for codec in codecs] == [False, True]


def test_levels_are_measured_on_the_file_in_layers_by_the_process_that_decodes(tmp_path, bushy_file):
    words = ("rd", bushy_file, "--bounds", "1e-3", "--codecs", "athcodec, layers", "athcodec")
    layers, single = run_bench(tmp_path, *words)[1]["points"]
    assert 0 < layers["level_max_ratio"] <= 1.1 and 0 < layers["level_rms_ratio"] < 1
    assert "level_max_ratio" not in single and min(layers["encode_cpu_s"], single["encode_cpu_s"]) > 0


def test_a_baseline_that_breaks_its_bound_fails_the_run(tmp_path, bushy_file):
    codec = "bench_codecs:TooCoarseBaseline"
    text, _ = run_bench(tmp_path, "rd", bushy_file, "--bounds", "1e-3", "--codecs", codec, code=1)
    assert text.count("\nBROKEN") == 1 and "\nBROKEN: bushy, too coarse here at 0.001: bound broken" in text


def test_a_codec_that_takes_too_long_is_stopped(tmp_path, bushy_file):
    _, result = run_bench(
        tmp_path, "rd", bushy_file, "--bounds", "1e-3", "--codecs", "bench_codecs:Endless", "--timeout", "1"
    )
    [point] = result["points"]
    assert (point["status"], point["why"]) == ("too slow", "encode: longer than 1 s")


def test_a_run_measures_only_missing_results(tmp_path, bushy_file):
    def run(*bounds):
        return run_bench(
            tmp_path, "rd", bushy_file, "--codecs", "bench_codecs:Rounded", "--bounds", *bounds, COUNT=str(count)
        )[1]["points"]

    count = tmp_path / "count"
    first = run("1e-3")
    encodes = count.read_text()
    again = run("1e-3")
    assert again == first and count.read_text() == encodes
    more = run("1e-3", "1e-2")
    assert [point["bound"] for point in more] == [1e-3, 1e-2]
    assert more[0] == first[0] and count.read_text().startswith(encodes) and count.read_text() != encodes


def test_results_of_a_codec_stay_when_it_is_no_longer_installed(tmp_path, bushy_file):
    words = ("rd", bushy_file, "--bounds", "1e-3", "--codecs", "bench_codecs:Uninstallable")
    [point] = run_bench(tmp_path, *words)[1]["points"]
    assert point["status"] == "ok"
    assert run_bench(tmp_path, *words, UNINSTALLED="1")[1]["points"] == [point]


def test_results_are_saved_at_once_and_are_invalid_when_code_has_changed(tmp_path):
    file = tmp_path / "results.json"
    store = Store(file, {"command": "rd", "commit": "1a"}, {"points": ("clip",)})
    store.add("points", {"clip": "tree", "bytes": 3, "depends": {"zip": "1.0"}})
    later = Store(file, {"command": "rd", "commit": "1a"}, {"points": ("clip",)})
    assert later.find("points", {"clip": "tree"}, {"zip": "1.0"})["bytes"] == 3
    assert later.find("points", {"clip": "tree"}, {"zip": "1.1"}) is None
    assert later.find("points", {"clip": "bush"}, {"zip": "1.0"}) is None


def test_results_read_back_as_they_were_saved_one_row_each(tmp_path):
    file = tmp_path / "results.json"
    store = Store(file, {"command": "rd", "commit": "1a"}, {"points": ("clip", "bound")})
    depends = {"zip": "1.0"}
    points = [
        store.add("points", {"clip": clip, "bound": bound, "settings": "coarse " * 9, "depends": depends} | more)
        for clip in ("tree", "bush")
        for bound, more in ((0.5, {"bytes": 3, "max": 0.1}), (1, {"why": "1"}))
    ]
    assert read(file) == {"command": "rd", "commit": "1a", "points": points}
    assert [point["commit"] for point in points] == ["1a"] * 4
    text = file.read_text()
    assert text.count("coarse " * 9) == text.count('"zip"') == 1 and text.count("[0,0.5,") == 1


def test_results_of_baselines_depend_on_the_entropy_coder_and_not_on_the_encoder():
    files = codec_registry._bench_files("bench.codecs.pca")
    assert {"pca.py", "coder.c", "range_coder.inl"} <= {file.name for file in files}
    assert not any({"encoding", "encode"} & set(file.parts) for file in files)


def test_fingerprints_of_code_ignore_comments_and_layout_alone(tmp_path):
    def code(name, text):
        file = tmp_path / name
        file.write_text(text)
        return codec_registry._code(file)

    plain = code("a.py", "def f(x):\n    return (x + 1)\n")
    assert plain == code("b.py", '"""Adds."""\nimport os\n\ndef f( x ):  # one\n    return x + 1')
    assert plain != code("c.py", "def f(x):\n    return x + 2\n")
    assert code("a.c", "int f;") == code("b.c", "/* one */ int  f;\n// two\n") != code("c.c", "int g;")


@pytest.mark.slow
def test_prefixes_are_compared_with_files_of_their_own_at_levels_and_between_them(tmp_path, bushy_file):
    _, result = run_bench(tmp_path, "progressive", bushy_file, "--rel-error", "1e-3")
    prefixes, at_errors, _ = tables_of(result)
    errors = {(row["ladder"], row["level"]): row for row in prefixes}
    assert {row["error"] for row in at_errors} >= {1e-2, 3e-3, 1e-3}
    for row in at_errors:
        for measure in ("max", "RMS"):
            if (level := row.get(f"level at {measure}")) is None:
                continue
            assert errors[row["ladder"], level][measure] <= row["error"]
            assert row[f"/own at {measure}"] == pytest.approx(
                row[f"bytes at {measure}"] / row[f"own at {measure}"], rel=1 / row[f"own at {measure}"]
            )
    [whole] = [row for row in at_errors if row["error"] == 1e-3 and row["ladder"] == "none"]
    assert whole["/own at max"] == pytest.approx(1, abs=0.02)


def test_smoothness_of_clips_is_a_table(sample_positions, tmp_path):
    words = ["--rel-error", "1e-3", "--segment-frames", "40", "--ladder", "none", "--effort", "fast"]
    text, result = run_bench(tmp_path, "smoothness", *words)
    [rows] = tables_of(result)
    assert [row["level"] for row in rows] == [0, 1, 2, 3]
    bends = np.diff(sample_positions.astype(float), 2, axis=0)
    motion = np.sqrt((bends**2).sum(axis=2).mean(axis=1))
    usual = max(motion[seam - 3 : seam + 1].max() for seam in (40, 80)) / np.median(motion)
    assert [row["source's"] for row in rows] == pytest.approx([usual] * 4, rel=1e-3)
    assert all(row["tick ratio"] < 2 * usual for row in rows), "segments go on from the one before"
    assert "tick ratio" in text


def test_a_sheet_shows_level_1_of_all_loops_of_a_file_over_their_wraps(tmp_path):
    pytest.importorskip("matplotlib")
    fern, sheet = athcodec.sample_path("fern"), tmp_path / "a.png"
    for name in ("calm", "gale"):
        with athcodec.open(fern, clip=name) as decoder:
            clip = athcodec.MotionClip(decoder.positions(level=1), decoder.time)
        athcodec.write_hdf5(clip, tmp_path / f"fern.{name}.h5")
    text, result = run_bench(tmp_path, "smoothness", str(fern), "--sheet", str(sheet), "--before", str(tmp_path))
    assert sheet.read_bytes().startswith(b"\x89PNG")
    assert [row["level"] for rows in tables_of(result) for row in rows] == [0, 1, 2, 3, 4] * 2
    assert "fern gale" in text and all(row["over source"] <= 2 for rows in tables_of(result) for row in rows)
