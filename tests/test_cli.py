"""What a user of the command line relies on: exit codes, one-line errors, whole files, true figures."""

from __future__ import annotations

import base64
import json
import re
import shutil
import signal
import subprocess
import sys
import warnings
from contextlib import nullcontext
from pathlib import Path

import h5py
import numpy as np
import pytest

import athcodec
from athcodec import batch, cli
from athcodec.cli.arguments import make_parser
from athcodec.cli.clips import tick_ratios
from athcodec.sources import read_hdf5, sample_path

SAMPLE = str(sample_path())


def run(*args) -> int:
    return cli.main([str(arg) for arg in args])


def spawn(*args, **options) -> subprocess.Popen:
    command = [sys.executable, "-m", "athcodec", *map(str, args)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, **(pipes | options))


@pytest.fixture(scope="module")
def encoded(tmp_path_factory):
    """The sample in four segments, within 1 mm."""
    path = tmp_path_factory.mktemp("cli") / "tree.ath"
    assert run("encode", SAMPLE, path, "--max-error", "1mm", "--segment-frames", 32, "--effort", "fast") == 0
    return path


@pytest.fixture
def facts(encoded, capsys):
    capsys.readouterr()
    assert run("info", encoded, "--json") == 0
    return json.loads(capsys.readouterr().out)


def cut(encoded: Path, path: Path, size: int) -> Path:
    path.write_bytes(encoded.read_bytes()[:size])
    return path


def with_flipped_byte(encoded: Path, path: Path, at: int) -> Path:
    data = bytearray(encoded.read_bytes())
    data[at] ^= 0x10
    path.write_bytes(data)
    return path


# ---- figures ----


def test_what_was_encoded_within_1_mm_decodes_within_1_mm(encoded, tmp_path, capsys):
    assert run("decode", encoded, tmp_path / "back.h5") == 0
    with read_hdf5(SAMPLE) as source, read_hdf5(tmp_path / "back.h5") as back:
        assert 0 < np.linalg.norm(source.block(0, 120) - back.block(0, 120), axis=2).max() <= 0.001
        assert np.array_equal(source.time, back.time)
        for name in ("vertex_branch", "branch_parent", "edges"):
            assert np.array_equal(getattr(source, name), getattr(back, name))
        assert source.metadata == back.metadata
        assert source.attributes.keys() == back.attributes.keys()
        assert np.array_equal(source.attributes["radius"], back.attributes["radius"])
    assert capsys.readouterr().err == ""


def test_info_says_as_json_what_programs_need(facts, encoded):
    assert (facts["vertices"], facts["frames"], facts["segments"]) == (1001, 120, 4)
    assert facts["fps"] == pytest.approx(30) and facts["nodes"] == 99
    assert facts["bytes"] == encoded.stat().st_size and facts["complete"] is True
    assert facts["max_error_bound"] == 0.001
    names = [*(f"depth {depth}" for depth in range(2)), *(f"layer {layer} of 3" for layer in (1, 2, 3))]
    assert [level["name"] for level in facts["levels"]] == names
    for level in facts["levels"]:
        assert {"level", "nodes", "bytes", "max_error", "rms_error"} <= level.keys()
    assert facts["levels"][-1]["max_error"] <= 0.001


def test_the_shares_of_the_levels_are_those_of_the_files_bytes(facts, encoded):
    sizes = [level["bytes"] for level in facts["levels"]]
    assert [level["added_bytes"] for level in facts["levels"]][1:] == np.diff(sizes).tolist()
    assert all(level["share"] == level["added_bytes"] / facts["bytes"] for level in facts["levels"])
    assert facts["ratio"] == 1001 * 120 * 12 / facts["bytes"]


def test_encode_reports_what_info_reports(tmp_path, capsys):
    options = ["--effort", "fast", "--rel-error", "1e-3"]
    assert run("encode", SAMPLE, tmp_path / "a.ath", *options, "--json") == 0
    of_encode = capsys.readouterr()
    assert run("info", tmp_path / "a.ath", "--json") == 0
    said = json.loads(of_encode.out)
    assert said.pop("untried") == []
    assert said == json.loads(capsys.readouterr().out)
    assert of_encode.err == ""


def test_info_prints_the_papers_table_and_one_row_per_level(encoded, facts, capsys):
    assert run("info", encoded) == 0
    out = capsys.readouterr().out
    assert "ATH: depth 3, 99 nodes, " in out
    for level in facts["levels"]:
        cells = (level["level"], level["name"], level["nodes"], f"{level['added_bytes']:,}", f"{level['share']:.1%}")
        assert re.search(r"^ *" + r" +".join(map(re.escape, map(str, cells))), out, re.MULTILINE)


def test_without_attributes_only_the_unit_is_kept(tmp_path):
    how = "--attributes none --effort fast --rel-error 1e-2".split()
    assert run("encode", SAMPLE, tmp_path / "a.ath", *how) == 0
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert decoder.metadata == {"unit": "m", "up_axis": "y"}
        assert decoder.file.edges is None and decoder.file.attributes == {}


def test_thresholds_of_the_paper_are_taken_in_the_units_given(tmp_path, capsys):
    tam = ["--tam", "5cm,15,0.057,6"]
    assert run("encode", SAMPLE, tmp_path / "a.ath", *tam, "--effort", "fast", "--rel-error", "1e-2") == 0
    assert "epsilon 0.05, eta 15, xi 0.057, lambda 6" in capsys.readouterr().out


def test_a_level_and_a_range_of_frames_are_those_of_the_whole(encoded, tmp_path):
    assert run("decode", encoded, tmp_path / "a.h5", "--level", 1, "--frames", "20:70", "--gzip") == 0
    with athcodec.open(encoded) as decoder, read_hdf5(tmp_path / "a.h5") as part:
        assert np.array_equal(part.block(0, 50), decoder.positions(level=1)[20:70])
        assert np.array_equal(part.time, decoder.time[20:70])


@pytest.mark.parametrize("name, files", [("a-1.obj", ["a-1_0003.obj", "a-1_0005.obj"]), ("a.vtu", ["a.pvd"])])
def test_decode_names_the_files_that_are_there_then(encoded, tmp_path, capsys, name, files):
    assert run("decode", encoded, tmp_path / name, "--frames", "3:6") == 0
    said = capsys.readouterr().out.split(": ")[0].split(" to ")
    assert said == [str(tmp_path / file) for file in files] and all(Path(path).exists() for path in said)


def test_decode_takes_the_coarsest_level_within_a_length(encoded, facts, tmp_path, capsys):
    error = facts["levels"][2]["max_error"]
    assert run("decode", encoded, tmp_path / "a.h5", "--max-error", f"{100.1 * error}cm") == 0
    assert f"level 2 ({facts['levels'][2]['name']})" in capsys.readouterr().out
    with athcodec.open(encoded) as decoder, read_hdf5(tmp_path / "a.h5") as part:
        assert np.array_equal(part.block(0, 120), decoder.positions(level=2))
    assert run("decode", encoded, tmp_path / "b.h5", "--max-error", "1e-12") == 1
    with pytest.raises(SystemExit):
        run("decode", encoded, tmp_path / "b.h5", "--max-error", "1m", "--level", 1)
    assert not (tmp_path / "b.h5").exists()


def test_depth_is_another_word_for_level(encoded, tmp_path):
    for word in ("level", "depth"):
        assert run("truncate", encoded, tmp_path / f"{word}.ath", f"--{word}", 1) == 0
        assert run("decode", encoded, tmp_path / f"{word}.mdd", f"--{word}", 0) == 0
    for suffix in ("ath", "mdd"):
        assert (tmp_path / f"level.{suffix}").read_bytes() == (tmp_path / f"depth.{suffix}").read_bytes()


def test_a_truncated_file_is_a_whole_one_of_fewer_levels(encoded, tmp_path, capsys):
    shorter = tmp_path / "a.ath"
    assert run("truncate", encoded, shorter, "--level", 1) == 0
    assert shorter.stat().st_size < encoded.stat().st_size
    assert run("verify", shorter, "--against", SAMPLE) == 0
    with athcodec.open(encoded) as whole, athcodec.open(shorter, strict=True) as decoder:
        assert decoder.file.level_count == 2
        assert np.array_equal(decoder.positions(30), whole.positions(30, level=1))


def test_the_demo_shows_every_depth_of_the_sample_keeps_files_on_demand_and_has_the_plant_on_its_page(tmp_path, capsys):
    assert run("demo", "--keep", tmp_path / "new") == 0
    out, err = capsys.readouterr()
    assert err == ""
    rows = [line.split() for line in out.splitlines() if re.match(r"\d ", line)]
    data = (tmp_path / "new" / "tree_1k_120f.ath").read_bytes()
    with athcodec.open(data) as decoder:
        count = decoder.file.level_count
    assert count > 2 and [row[0] for row in rows] == [str(level) for level in range(count)]
    assert float(rows[-1][-3]) <= 1e-4 < float(rows[0][-3])
    names = sorted(path.name for path in (tmp_path / "new").iterdir())
    levels = [f"tree_1k_120f_level_{level}.h5" for level in range(count)]
    assert names == ["athcodec_demo.html", "tree_1k_120f.ath", *levels]
    assert f"{len(data):,} bytes; the positions" in out and "It moves in " in out
    assert f"`athcodec view {sample_path('leafed')}` shows one with leaves" in out
    [shown] = re.findall(r'id="ath-file"[^>]*>([^<]*)<', (tmp_path / "new" / "athcodec_demo.html").read_text("utf-8"))
    assert base64.b64decode(shown) == data


@pytest.fixture
def short_growth(tmp_path, monkeypatch):
    """The last frames of the sample of growth, which stand for all of it."""
    short = tmp_path / "short" / "growth_1k_120f.h5"
    short.parent.mkdir()
    with read_hdf5(sample_path("growth")) as clip:
        athcodec.write(clip.replace(positions=clip.block(108, 120), time=clip.time[108:]), short)
    monkeypatch.setattr(athcodec, "sample_path", {"growth": short, "leafed": sample_path("leafed")}.__getitem__)
    return short


def test_the_demo_shows_growth_too_and_other_samples_are_refused(short_growth, tmp_path, capsys):
    """Here of its last frames; the examples of docs/viewer.md run it on all."""
    assert run("demo", "--sample", "growth", "--keep", tmp_path) == 0
    assert "Encoded the sample growth_1k_120f within 0.0001 of its diagonal" in capsys.readouterr().out
    assert run("verify", tmp_path / "growth_1k_120f.ath", "--against", short_growth) == 0
    with pytest.raises(ValueError, match="sample: got 'oak', expected one of tree, growth, leafed, fern, grass"):
        sample_path("oak")


def test_the_leafed_sample_is_whole_and_holds_two_loops():
    with athcodec.open(sample_path("leafed"), strict=True) as decoder:
        clips = [(clip.name, clip.loop, clip.frame_count) for clip in decoder.file.clips]
        assert clips == [("calm", True, 150), ("gale", True, 150)]
        assert decoder.file.complete and decoder.file.faces is not None


def test_a_skeleton_that_is_far_off_is_warned_of_with_what_to_do(encoded, tmp_path, capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert run("decode", encoded, tmp_path / "a.glb", "--rig", 2, "--level", 2) == 0
    assert re.fullmatch(
        r"athcodec: warning: .*a.glb: the skeleton is off by [\d.]+ m, [\d.]+ % of the diagonal of the rest pose; "
        r"expected at most 1 %: more joints come closer, such as --rig 8 \(rig=8\); without a skeleton the .*\n",
        capsys.readouterr().err,
    )
    assert run("decode", encoded, tmp_path / "a.glb", "--rig", "--level", 2) == 0 and capsys.readouterr().err == ""


def test_packing_the_extension_for_blender_without_a_wheel_says_how_to_make_one(tmp_path, capsys):
    from athcodec.blender.build import main

    with pytest.raises(SystemExit):
        main([str(tmp_path / "a.zip")])
    assert (
        "wheels: got none, expected one of athcodec for each platform; in a clone `pip wheel" in capsys.readouterr().err
    )


# ---- damaged files ----


def test_a_cut_off_file_decodes_to_its_deepest_level_with_one_warning(encoded, facts, tmp_path, capsys):
    part = cut(encoded, tmp_path / "cut.ath", facts["levels"][3]["bytes"] + 3000)
    assert run("decode", part, tmp_path / "a.h5") == 0
    warning = r"athcodec: warning: .*cut\.ath: decoded to level 3; cut off .* missing .*level 4.*\n"
    assert re.fullmatch(warning, capsys.readouterr().err)
    with athcodec.open(encoded) as decoder, read_hdf5(tmp_path / "a.h5") as clip:
        assert np.array_equal(clip.block(0, 120), decoder.positions(level=3))


def test_info_of_a_cut_off_file_says_what_is_missing(encoded, facts, tmp_path, capsys):
    part = cut(encoded, tmp_path / "cut.ath", facts["levels"][2]["bytes"])
    assert run("info", part, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["complete"] is False and "level 4" in found["missing"]
    assert [level["available"] for level in found["levels"]] == [True, True, True, False, False]


def test_verify_accepts_a_whole_file_and_measures_it(encoded, capsys):
    assert run("verify", encoded) == 0
    assert run("verify", encoded, "--against", SAMPLE) == 0
    capsys.readouterr()
    assert run("verify", encoded, "--against", SAMPLE, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] is True and all(level["kept"] for level in found["clips"][0]["levels"])
    with athcodec.open(encoded) as decoder, read_hdf5(SAMPLE) as clip:
        distance = np.linalg.norm(decoder.positions(level=2) - clip.block(0, 120).astype(float), axis=2)
    assert found["clips"][0]["levels"][2]["max_error"] == pytest.approx(distance.max())
    assert found["clips"][0]["levels"][2]["rms_error"] == pytest.approx(np.sqrt((distance**2).mean()))


def test_verify_measures_smoothness_and_shape_of_every_level(sample_ath, capsys):
    assert run("verify", sample_ath, "--against", SAMPLE, "--json") == 0
    levels = json.loads(capsys.readouterr().out)["clips"][0]["levels"]
    with athcodec.open(sample_ath) as decoder, read_hdf5(SAMPLE) as clip:
        source, bound = clip.block(0, 120).astype(float), decoder.file.max_error_bound
        decoded = [decoder.positions(level=number).astype(float) for number in range(decoder.file.level_count)]
        edges = clip.edges
    jerk = np.linalg.norm(np.diff(decoded[-1] - source, 2, axis=0), axis=2) / bound
    looks = levels[-1]["smoothness"]
    assert looks["max_second_difference"] == pytest.approx(jerk.max())
    assert looks["rms_second_difference"] == pytest.approx(np.sqrt((jerk**2).mean()))
    assert looks["worst_share_above_bound"] == pytest.approx((jerk > 1).mean(axis=1).max())
    assert looks["median_share_above_bound"] == pytest.approx(np.median((jerk > 1).mean(axis=1)))
    near = np.array([38, 39, 40, 41, 78, 79, 80, 81]) - 1  # of segments of 40 frames
    for level, positions in zip(levels, decoded, strict=True):
        rms = np.sqrt((np.diff(positions, 2, axis=0) ** 2).sum(axis=2).mean(axis=1))
        assert level["smoothness"]["tick_ratio"] == pytest.approx(rms[near].max() / np.median(rms))
        one, other = (np.linalg.norm(np.diff(x[:, edges], axis=2)[:, :, 0], axis=2) for x in (source, positions))
        assert level["shape"]["rms_stretch"] == pytest.approx(np.sqrt(((other / one - 1) ** 2).mean()), rel=1e-4)
        assert level["shape"]["tail_stretch"] == pytest.approx(np.quantile(np.abs(other / one - 1), 0.999), rel=0.01)

    assert run("verify", sample_ath, "--against", SAMPLE) == 0
    out = capsys.readouterr().out
    assert "Smoothness: " in out and "Shape: 1,000 edges" in out
    assert "normals" not in out, "the sample has no faces"


def test_info_tells_ticks_at_seams_without_the_source(sample_ath, medley_ath, capsys):
    assert run("verify", sample_ath, "--against", SAMPLE, "--json") == 0
    measured = json.loads(capsys.readouterr().out)["clips"][0]["levels"]
    assert run("info", sample_ath, "--motion", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    expected = [level["smoothness"]["tick_ratio"] for level in measured]
    assert [level["tick_ratio"] for level in found["levels"]] == found["clips"][0]["tick_ratios"] == expected
    assert run("info", sample_ath, "--motion") == 0
    assert f"{expected[0]:.3g}" in capsys.readouterr().out
    with athcodec.open(medley_ath) as decoder:
        for clip, ratios in zip(decoder.file.clips, tick_ratios(decoder), strict=True):
            has_seams = clip.segment_count > 1 or clip.loop
            assert [ratio is not None for ratio in ratios] == [has_seams] * decoder.file.level_count


def test_info_decodes_nothing_unless_asked(encoded, facts, tmp_path, capsys):
    assert "tick_ratio" not in facts["levels"][0]
    part = cut(encoded, tmp_path / "cut.ath", facts["levels"][2]["bytes"])
    assert run("info", part, "--motion", "--json") == 0
    ratios = [level["tick_ratio"] for level in json.loads(capsys.readouterr().out)["levels"]]
    assert [ratio is None for ratio in ratios] == [False] * 3 + [True] * 2


@pytest.mark.parametrize("place", [0.0, 0.01, 0.1, 0.5, 0.9, 0.9999])
def test_verify_fails_on_a_flipped_byte(encoded, facts, tmp_path, capsys, place):
    damaged = with_flipped_byte(encoded, tmp_path / "bad.ath", int(place * facts["bytes"]))
    assert run("verify", damaged) == 1
    assert re.fullmatch(r"athcodec: error: .*bad\.ath: .*\n", capsys.readouterr().err)


@pytest.mark.parametrize("missing", [1, 1000, 20_000])
def test_verify_fails_on_a_file_that_is_cut_off(encoded, facts, tmp_path, capsys, missing):
    part = cut(encoded, tmp_path / "cut.ath", facts["bytes"] - missing)
    assert run("verify", part, "--json") == 1
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert found["ok"] is False and found["error"] in err


def test_verify_fails_where_the_source_is_further_off_than_promised(encoded, tmp_path, capsys):
    moved = tmp_path / "moved.h5"
    shutil.copy(SAMPLE, moved)
    with h5py.File(moved, "a") as file:
        file["positions"][60, 500] += 0.002
    assert run("verify", encoded, "--against", moved) == 1
    out, err = capsys.readouterr()
    assert "NO" in out and "expected at most" in err


def test_a_damaged_level_is_an_error_unless_less_is_allowed(encoded, facts, tmp_path, capsys):
    damaged = with_flipped_byte(encoded, tmp_path / "bad.ath", facts["levels"][2]["bytes"] - 10)
    assert run("decode", damaged, tmp_path / "a.h5") == 1
    assert not (tmp_path / "a.h5").exists() and "checksum" in capsys.readouterr().err
    assert run("decode", damaged, tmp_path / "a.h5", "--allow-partial") == 0
    assert "decoded to level 1; damaged from level 2" in capsys.readouterr().err


# ---- errors ----

USAGE = {
    "no verb": "",
    "unknown verb": "compress a.h5 b.ath",
    "no output": "encode a.h5",
    "two bounds": "encode a.h5 b.ath --max-error 1mm --rel-error 1e-4",
    "no length": "encode a.h5 b.ath --max-error 1yd",
    "length 0": "encode a.h5 b.ath --max-error 0mm",
    "no fraction": "encode a.h5 b.ath --rel-error 2",
    "no size": "encode a.h5 b.ath --target-size 5parsec",
    "segment too long": "encode a.h5 b.ath --segment-frames 300",
    "three thresholds": "encode a.h5 b.ath --tam 1,2,3",
    "negative threshold": "encode a.h5 b.ath --tam 1,-2,3,4",
    "no range": "decode a.ath b.h5 --frames 5",
    "negative level": "decode a.ath b.h5 --level -1",
    "no level": "truncate a.ath b.ath",
}


@pytest.mark.parametrize("line", USAGE.values(), ids=USAGE)
def test_wrong_usage_exits_with_2_and_says_how(line, capsys):
    with pytest.raises(SystemExit) as caught:
        run(*line.split())
    assert caught.value.code == 2
    assert "usage: athcodec" in capsys.readouterr().err


def test_an_option_that_a_verb_does_not_know_shows_the_usage_of_the_verb(capsys):
    with pytest.raises(SystemExit):
        run("encode", "a.h5", "b.ath", "--max-eror", "1mm")
    assert capsys.readouterr().err.startswith("usage: athcodec encode IN")


@pytest.mark.parametrize("verb", ["info", "decode", "view", "verify", "picture"])
def test_the_help_of_a_verb_names_standard_input_where_it_is_read(verb, tmp_path, monkeypatch, capsys):
    with pytest.raises(SystemExit):
        run(verb, "--help")
    assert ("for standard input" in " ".join(capsys.readouterr().out.split())) == (verb in ("info", "decode"))


def test_branch_plans_are_no_clips_and_say_what_they_are_for(tmp_path, capsys):
    (tmp_path / "a.mtg").write_text("CODE: FORM-A\n")
    assert run("encode", tmp_path / "a.mtg", tmp_path / "a.ath") == 1
    assert "holds branches and no motion" in capsys.readouterr().err


FAILURES = {
    "missing source": ("encode nowhere.h5 OUT", "nowhere.h5: No such file"),
    "missing file": ("decode nowhere.ath out.h5", "nowhere.ath: No such file"),
    "nothing to look at": ("info nowhere.ath", "nowhere.ath: No such file"),
    "nothing to verify": ("verify nowhere.ath", "nowhere.ath: No such file"),
    "nothing to compare": ("verify FILE --against nowhere.h5", "nowhere.h5: No such file"),
    "nothing to truncate": ("truncate nowhere.ath OUT --level 0", "nowhere.ath: No such file"),
    "an .ath file to encode": ("encode FILE OUT", "FILE: is an .ath file already; `athcodec decode`"),
    "a folder to encode": (f"encode {Path(SAMPLE).parent} OUT", "is a folder, expected a file: .*`athcodec batch`"),
    "a source to show": ("info SOURCE", r"SOURCE: is not an .ath file .it looks like HDF5.; use `athcodec encode`"),
    "a source to truncate": ("truncate SOURCE OUT --level 0", "SOURCE: is not an .ath file .it looks like HDF5."),
    "a source to decode": ("decode SOURCE out.usda", "SOURCE: is not an .ath file .it looks like HDF5.; use `athcodec"),
    "a source to view": (
        "view SOURCE --export a.html",
        "this is not an .ath file .it looks like HDF5.; use `athcodec enc",
    ),
    "a source to verify": ("verify SOURCE", "SOURCE: is not an .ath file .it looks like HDF5.; use `athcodec encode`"),
    "an .ath file to compare with": ("verify FILE --against FILE", "FILE: is an .ath file already; `athcodec decode`"),
    "an .ath file to decode to": (
        "decode FILE OUT",
        "OUT: is the name of an .ath file, .* `athcodec truncate` shortens",
    ),
    "another format to encode to": (
        "encode SOURCE a.h5",
        "a.h5: is a name for HDF5, expected .* .ath; `athcodec decode`",
    ),
    "textures to encode to": (
        "encode SOURCE a.vat",
        "a.vat: is a name for vertex animation .* .ath; `athcodec decode`",
    ),
    "another format to truncate to": (
        "truncate FILE a.USDC --level 0",
        "a.USDC: is a name for USD, expected .* .ath; ",
    ),
    "HDF5 to put a motion into": (
        "encode SOURCE --into x.glb",
        "SOURCE: is no GLB .it looks like HDF5., expected an animated one for --into; `athcodec encode SOURCE .*f.ath` "
        "makes an .ath file of it, and `athcodec decode .* x.glb` a GLB of that",
    ),
    "an .ath file to put a motion into": (
        "encode FILE --into x.glb",
        "FILE: is no GLB .it looks like .ath., expected an animated one for --into; `athcodec decode FILE x.glb` write",
    ),
    "HDF5 as glTF": ("encode SOURCE OUT --source-format gltf", "SOURCE: got HDF5, expected glTF: a GLB or JSON"),
    "no page": ("view FILE --export a.txt", "--export: got a.txt, expected PAGE.html"),
    "no folder": ("encode SOURCE none/a.ath", "none/a.ath: the directory none does not exist"),
    "a folder": ("decode FILE .", "got a directory, expected a file name"),
    "onto itself": ("truncate FILE FILE --level 0", "FILE: is the input"),
    "beyond the frames": ("decode FILE out.h5 --frames 100:121", r"FILE: .*100:121.*120"),
    "no frames": ("decode FILE out.h5 --frames 7:7", "FILE: .*7:7"),
    "beyond the levels": ("decode FILE out.h5 --level 6", "FILE: .*got 6.*0 to 4"),
    "truncate beyond the levels": ("truncate FILE OUT --level 6", "FILE: .*got 6.*0 to 4"),
    "too close": ("encode SOURCE OUT --max-error 1e-12", "SOURCE: .*1e-12"),
    "too small": ("encode SOURCE OUT --target-size 100 --effort fast", "SOURCE: .*100"),
}


@pytest.mark.parametrize("line, message", FAILURES.values(), ids=FAILURES)
def test_a_failure_is_one_line_and_leaves_no_file(encoded, tmp_path, capsys, monkeypatch, line, message):
    monkeypatch.chdir(tmp_path)
    before = encoded.read_bytes()
    words = {"FILE": str(encoded), "SOURCE": SAMPLE, "OUT": "out.ath"}
    assert run(*(words.get(word, word) for word in line.split())) == 1
    err = capsys.readouterr().err
    for word, path in words.items():
        message = message.replace(word, re.escape(path))
    assert re.fullmatch(f"athcodec: error: .*{message}.*\n", err)
    assert list(tmp_path.iterdir()) == [] and encoded.read_bytes() == before


OTHERS = {  # by the verb that would replace what is there already
    "encode": "encode SOURCE OUT.ath --effort fast",
    "decode": "decode FILE OUT.usda",
    "decode to a format that is named": "decode FILE OUT.dat --format npz",
    "decode to numbered files": "decode FILE OUT.obj --frames 0:1",
    "truncate": "truncate FILE OUT.ath --level 0",
    "hierarchy": "hierarchy SOURCE --save OUT.json",
    "view": "view FILE --export OUT.html",
    "picture": "picture FILE --png OUT.png",
}


def with_files(line: str, encoded: Path, folder: Path) -> tuple[list[str], Path]:
    """The words of a line with its files, and the output among them, in a folder."""
    out = folder / next(word for word in line.split() if word.startswith("OUT"))
    files = {"FILE": str(encoded), "SOURCE": SAMPLE, out.name: str(out)}
    return [files.get(word, word) for word in line.split()], out


@pytest.mark.parametrize("line", OTHERS.values(), ids=OTHERS)
def test_a_file_of_another_kind_is_never_replaced(encoded, tmp_path, capsys, line):
    words, out = with_files(line, encoded, tmp_path)
    shutil.copy(SAMPLE, out)
    assert run(*words) == 1
    message = f"athcodec: error: {re.escape(str(out))}: is there already and holds HDF5, expected .*another output"
    assert re.match(message, capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == [out] and out.read_bytes() == Path(SAMPLE).read_bytes()


@pytest.mark.parametrize(
    "line",
    [
        "encode SOURCE OUT.ath --effort fast --rel-error 1e-2",
        *(f"decode FILE OUT.{suffix} --frames 0:2" for suffix in "h5 npz usda glb mdd xdmf pvd".split()),
        "decode FILE OUT.ply --frames 0:1",
        "truncate FILE OUT.ath --level 0",
        "hierarchy SOURCE --save OUT.json",
        "view FILE --export OUT.html",
    ],
)
def test_a_file_of_the_same_kind_and_an_empty_one_are_replaced(encoded, tmp_path, line):
    words, out = with_files(line, encoded, tmp_path)
    out.touch()
    for _ in range(2):
        assert run(*words) == 0


def test_two_sources_without_an_output_are_an_error_that_shows_what_may_have_been_meant(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ("calm.h5", "gale wind.h5"):
        shutil.copy(SAMPLE, name)
    assert run("encode", "calm.h5", "gale wind.h5") == 1
    error = capsys.readouterr().err
    assert "athcodec encode calm.h5 'gale wind.h5' -o OUT.ath" in error
    assert "athcodec batch calm.h5 'gale wind.h5' --out DIR" in error
    assert run("encode", "calm.h5", "x.foo") == 1
    assert "x.foo: got this name for the output, expected one that ends in .ath" in capsys.readouterr().err
    assert Path("gale wind.h5").read_bytes() == Path(SAMPLE).read_bytes() and not Path("x.foo").exists()


def test_the_files_of_a_shell_pattern_are_one_sequence(encoded, tmp_path, capsys):
    for name in ("calm", "gale"):
        (tmp_path / name).mkdir()
        assert run("decode", encoded, tmp_path / name / f"{name}.obj", "--frames", "9:12") == 0
    calm, gale = (sorted((tmp_path / name).iterdir()) for name in ("calm", "gale"))
    before = [path.read_bytes() for path in (*calm, *gale)]
    capsys.readouterr()
    assert run("encode", *calm) == 1
    assert f"athcodec encode {calm[0]} -o OUT.ath" in capsys.readouterr().err
    assert run("encode", *calm[:2], tmp_path / "part.ath") == 1
    assert "got 2 names of a sequence of 3 files" in capsys.readouterr().err
    out, how = tmp_path / "out.ath", ("--effort", "fast", "--rel-error", "1e-2")
    for words in ([*calm, out], ["-o", out, *calm]):
        assert run("encode", *words, *how) == 0
        with athcodec.open(out) as decoder:
            assert [(clip.name, clip.frame_count) for clip in decoder.file.clips] == [("", 3)]
    assert run("encode", *calm, *gale, out, *how) == 0
    with athcodec.open(out) as decoder:
        assert [(clip.name, clip.frame_count) for clip in decoder.file.clips] == [("calm", 3), ("gale", 3)]
    items = batch.find([*calm, str(tmp_path / "gale" / "*.obj")], tmp_path / "many")
    found = [(Path(item.input), Path(item.output).name) for item in items]
    assert found == [(calm[0], "calm.ath"), (gale[0], "gale.ath")]
    assert [path.read_bytes() for path in (*calm, *gale)] == before


def test_a_unit_without_one_in_the_clip_is_an_error(tmp_path, capsys):
    source = tmp_path / "plain.h5"
    shutil.copy(SAMPLE, source)
    with h5py.File(source, "a") as file:
        del file.attrs["unit"]
    assert run("encode", source, tmp_path / "a.ath", "--max-error", "1mm") == 1
    refused = capsys.readouterr().err
    assert "got 1mm for a clip without a unit" in refused and "--unit m" in refused
    assert run("encode", source, tmp_path / "a.ath", "--max-error", "1mm", "--unit", "m", "--effort", "fast") == 0
    assert run("encode", source, tmp_path / "a.ath", "--max-error", "0.1", "--effort", "fast") == 0


def test_a_failure_on_the_way_leaves_the_older_file_alone(encoded, tmp_path, capsys):
    source, out = tmp_path / "bad.h5", tmp_path / "a.ath"
    shutil.copy(SAMPLE, source)
    out.write_bytes(encoded.read_bytes())
    with h5py.File(source, "a") as file:
        file["positions"][119, 7, 1] = np.nan
    assert run("encode", source, out) == 1
    assert re.search(r"bad\.h5: positions: frame 119, vertex 7 is \(", capsys.readouterr().err)
    assert out.read_bytes() == encoded.read_bytes() and set(tmp_path.iterdir()) == {source, out}


@pytest.mark.parametrize("line", ["--debug info none.ath", "info --debug none.ath", "info none.ath --debug"])
def test_debug_shows_the_traceback_before_or_behind_the_verb(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(*line.split()) == 1
    err = capsys.readouterr().err
    assert err.startswith("Traceback")
    assert err.endswith("\nathcodec: error: none.ath: No such file or directory\n")


def test_an_error_that_nobody_foresaw_is_one_line_too(encoded, monkeypatch, capsys):
    monkeypatch.setattr(athcodec, "open", lambda *args, **options: 1 / 0)
    assert run("info", encoded) == 1
    message = "ZeroDivisionError: division by zero (--debug shows where)"
    assert capsys.readouterr().err == f"athcodec: error: {message}\n"


# ---- the process ----


def test_the_module_runs_as_the_command(encoded, tmp_path):
    process = spawn("info", encoded, "--json", cwd=tmp_path)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0 and err == "" and json.loads(out)["vertices"] == 1001


def test_the_version_is_the_packages(capsys):
    with pytest.raises(SystemExit) as caught:
        run("--version")
    assert caught.value.code == 0 and capsys.readouterr().out == f"athcodec {athcodec.__version__}\n"


def test_a_reader_that_leaves_early_is_no_error(encoded, tmp_path):
    process = spawn("info", encoded, cwd=tmp_path)
    process.stdout.close()
    assert process.wait(timeout=60) == 141
    assert process.stderr.read() == ""
    process.stderr.close()


@pytest.mark.parametrize("kind, code", [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_what_is_interrupted_leaves_nothing_behind(tmp_path, monkeypatch, capsys, kind, code):
    def interrupt(stage, fraction):
        if stage == "motion":
            signal.raise_signal(kind)

    monkeypatch.setattr("athcodec.cli.verbs.progress", lambda: nullcontext(interrupt))
    try:
        result = run("encode", SAMPLE, tmp_path / "a.ath", "--effort", "fast")
    except SystemExit as end:
        result = end.code
    assert result == code and list(tmp_path.iterdir()) == []
    assert capsys.readouterr().err == ("athcodec: interrupted, nothing written\n" if kind == signal.SIGINT else "")


def test_an_interrupted_decode_leaves_nothing_behind(encoded, tmp_path, monkeypatch):
    def interrupt(stage, fraction):
        raise KeyboardInterrupt

    monkeypatch.setattr("athcodec.cli.verbs.progress", lambda: nullcontext(interrupt))
    assert run("decode", encoded, tmp_path / "a.h5") == 130
    assert list(tmp_path.iterdir()) == []


def test_formats_are_listed_with_what_they_need(capsys):
    assert run("formats", "--json") == 0
    rows = {row["format"]: row for row in json.loads(capsys.readouterr().out)["formats"]}
    assert rows["usd"]["extra"] == "usd" and ".usdc" in rows["usd"]["reads"] and ".usdc" in rows["usd"]["writes"]
    assert rows["vat"]["reads"] == [] and rows["vat"]["writes"] == [".vat"]
    assert rows["hdf5"]["extra"] == "" and rows["hdf5"]["installed"]
    assert run("formats") == 0
    assert "athcodec[usd]" in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["encode", "decode"])
def test_a_missing_package_is_named_with_the_command_that_installs_it(encoded, tmp_path, capsys, monkeypatch, verb):
    monkeypatch.setattr("athcodec.sources.find_spec", lambda name: None)  # as where the package is not installed
    scene = tmp_path / "a.usda"
    scene.write_text("#usda 1.0\n")
    files = [str(scene), str(tmp_path / "b.ath")] if verb == "encode" else [str(encoded), str(tmp_path / "b.usdc")]
    assert run(verb, *files) == 1
    assert capsys.readouterr().err.endswith('needs pxr: pip install "athcodec[usd]"\n')


def test_no_control_characters_of_a_file_reach_the_terminal(tmp_path, capsys, any_unit):
    unit = "m\x1b[2J\x9b1A\u202e\x7f\a\r"
    with read_hdf5(SAMPLE) as clip:
        odd = clip.replace(metadata=clip.metadata | {"unit": unit})
        athcodec.encode(odd, tmp_path / "a.ath", rel_error=1e-2, effort="fast")
    assert run("info", tmp_path / "a.ath") == 0
    assert run("verify", tmp_path / "a.ath", "--against", SAMPLE) == 0
    run("info", tmp_path / "\x1b[31m\u2066.ath")
    shown = "".join(capsys.readouterr())
    assert not set(shown) & set(unit[1:] + "\u2066") - set("[2J1A")
    assert "m\\x1b[2J\\x9b1A\\u202e" in shown
    assert run("info", tmp_path / "a.ath", "--json") == 0
    text = capsys.readouterr().out
    assert json.loads(text)["unit"] == unit
    assert "\x7f" not in text


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero")
def test_steps_that_are_no_plain_files_are_refused(tmp_path, capsys):
    index = tmp_path / "a.pvd"
    index.write_text('<VTKFile><Collection><DataSet timestep="0" file="/dev/zero"/></Collection></VTKFile>')
    assert run("encode", index, tmp_path / "a.ath", "--allow-outside") == 1
    assert "/dev/zero: got a device, pipe or socket" in capsys.readouterr().err


JSON = {
    "encode": ("encode SAMPLE a.ath --effort fast --max-error 1cm", "bytes"),
    "batch": ("batch SAMPLE --out . --effort fast --max-error 1cm", "done"),
    "decode": ("decode IN a.h5 --level 1", "files"),
    "info": ("info IN", "levels"),
    "verify": ("verify IN", "ok"),
    "truncate": ("truncate IN a.ath --level 0", "bytes_before"),
    "hierarchy": ("hierarchy SAMPLE --method edges", "branches"),
    "formats": ("formats", "formats"),
    "view": ("view IN --export a.html", "bytes"),
    "demo": ("demo --sample growth --keep .", "page"),
}


@pytest.mark.parametrize("verb", JSON)
def test_a_verb_answers_in_json_and_in_nothing_else(verb, encoded, short_growth, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    line, key = JSON[verb]
    words = [{"SAMPLE": SAMPLE, "IN": encoded}.get(word, word) for word in line.split()]
    capsys.readouterr()
    assert run(*words, "--json") == 0
    assert key in json.loads(capsys.readouterr().out)


def test_all_verbs_but_that_which_needs_a_browser_are_asked_for_json():
    verbs = re.search(r"VERB\n(.*?)\n\n", make_parser().format_help(), re.DOTALL)[1]
    assert {*re.findall(r"^    (\w+)", verbs, re.MULTILINE)} == {*JSON, "picture"}


def test_bash_completes_verbs_options_and_files(encoded, tmp_path, capsys, monkeypatch):
    with pytest.raises(SystemExit) as left:
        run("--print-completion", "bash")
    assert left.value.code == 0
    script = capsys.readouterr().out
    for words, wanted in {
        "trunc": "truncate",
        "decode --all": "--allow-partial",
        f"info {encoded.parent}/tr": "tree.ath",
    }.items():
        line = ["athcodec", *words.split()]
        asked = f"COMP_WORDS=({' '.join(line)}); COMP_CWORD={len(line) - 1}; _shtab_athcodec; echo ${{COMPREPLY[@]}}"
        shown = subprocess.run(["bash", "-c", f"{script}\n{asked}"], capture_output=True, text=True, check=True)
        assert wanted in shown.stdout
    monkeypatch.setitem(sys.modules, "shtab", None)  # Importing it fails as where it is not installed.
    with pytest.raises(SystemExit) as refused:
        run("--print-completion", "zsh")
    assert refused.value.code == 2 and "athcodec[completion]" in capsys.readouterr().err


# ---- what a newcomer types ----


def test_a_completion_script_ends_quietly_when_its_reader_has_left():
    """As in `athcodec --print-completion bash | head`, where Python would show a traceback."""
    process = spawn("--print-completion", "bash")
    process.stdout.close()
    assert process.wait(timeout=60) == 141 and process.stderr.read() == ""
    process.stderr.close()


def test_a_misspelt_option_is_named_with_the_one_that_looks_like_it(capsys):
    with pytest.raises(SystemExit) as stopped:
        run("encode", SAMPLE, "tree.ath", "--max-eror", "1mm")
    assert stopped.value.code == 2
    assert "unrecognized arguments: --max-eror 1mm; did you mean --max-error?" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "expected"), [("a.gltf", "expected one of .glb\n"), ("a.npy", " .npz ")])
def test_decoding_to_a_format_that_is_only_read_says_so(encoded, tmp_path, capsys, name, expected):
    assert run("decode", encoded, tmp_path / name) == 1
    said = capsys.readouterr().err
    assert f"{name}: got {Path(name).suffix}, which is read and not written" in said and expected in said


def test_a_missing_package_for_the_output_names_the_output(encoded, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("athcodec.sources.find_spec", lambda name: None)  # as where the package is not installed
    assert run("decode", encoded, tmp_path / "b.usdc") == 1
    assert capsys.readouterr().err.startswith(f"athcodec: error: {tmp_path / 'b.usdc'}: USD: needs pxr")


def test_a_loop_that_jumps_is_named_with_lengths_in_its_unit_and_the_option_that_smooths_it(tmp_path, capsys):
    words = ("--loop", "all", "--names", "sway", "--effort", "fast", "--rel-error", "1e-2")
    assert run("encode", SAMPLE, tmp_path / "a.ath", *words) == 0
    said = capsys.readouterr().err
    assert re.search(r"loop: sway: vertices move by up to [\d.]+ m from .*by up to [\d.]+ m .*up to [\d.]+ m;", said)
    assert "the loop jumps: --loop-blend FRAMES smooths it" in said


def test_an_array_that_is_a_second_motion_is_named_because_it_is_not_compressed_as_one(tmp_path, capsys):
    positions = np.zeros((4, 3, 3)) + np.arange(3)[:, None] + np.arange(4)[:, None, None]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["positions"], file["velocities"], file["mass"] = positions, positions, np.arange(3.0)
    words = ("encode", tmp_path / "a.h5", tmp_path / "a.ath", "--effort", "fast")
    assert run(*words) == 0
    assert f"arrays: {tmp_path / 'a.h5'}: velocities: a value for each frame" in capsys.readouterr().err
    assert run(*words, "--attributes", "none") == 0
    assert "arrays: " not in capsys.readouterr().err


def test_a_single_branch_is_not_described_as_several(tmp_path, capsys):
    np.save(tmp_path / "a.npy", np.stack([np.eye(3), np.eye(3) + 1]))
    assert run("encode", tmp_path / "a.npy", tmp_path / "a.ath", "--hierarchy", "motion", "--effort", "fast") == 0
    assert re.search(r"hierarchy: 1 branch by \w+: all 3 vertices\n", capsys.readouterr().err)


def test_what_is_no_clip_is_refused_by_what_it_is(tmp_path):
    with pytest.raises(TypeError, match="write: got ndarray, expected a MotionClip, a decoder or a ClipView"):
        athcodec.write(np.zeros((2, 3, 3)), tmp_path / "a.npz")
    with pytest.raises(TypeError, match="onto: got str, expected a decoder of the plant"):
        athcodec.onto("tree.ath", "lod1.glb")
