"""What `python -m bench` prints can be relied on: sizes come with a bound that was seen to hold."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import athcodec
from athcodec._native import crc32c
from athcodec.container import KIND_NAMES

KINDS = {*KIND_NAMES.values(), "HEADER"}
MEMORY_PARTS = ("file", "opened", "bases", "work", "segments")
ROOT = Path(__file__).resolve().parent.parent

def run_bench(tmp_path, *words):
    """(printed text, contents of the JSON file) of one run on the sample."""
    file = tmp_path / "result.json"
    done = subprocess.run([sys.executable, "-m", "bench", *words, "--json", str(file)], cwd=ROOT, text=True,
                          capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout, json.loads(file.read_text())


def tables_of(result):
    return [table["rows"] for table in result["tables"]]


def cells_of(text, title):
    """Cells by column of the first row of a printed table."""
    lines = text[text.index(f"### {title}"):].splitlines()
    header, row = ([cell.strip() for cell in lines[i].strip("|").split("|")] for i in (2, 4))
    return dict(zip(header, row, strict=True))


def test_sizes_come_with_a_bound_that_was_measured_and_kept(tmp_path):
    text, result = run_bench(tmp_path, "sizes", "--rel-error", "1e-3", "--effort", "fast")
    [size], [chunks], [choices] = tables_of(result)
    assert 0 < size["max/bound"] <= 1 and size["kept"] and result["broken"] == []
    assert cells_of(text, "Sizes")["kept"] == "yes"
    assert cells_of(text, "Sizes")["bytes"] == f"{size['bytes']:,}"
    kinds = {name: value for name, value in chunks.items() if name in KINDS}
    assert sum(kinds.values()) == size["bytes"]
    assert chunks["AFFINES %"] == pytest.approx(100 * chunks["AFFINES"] / size["bytes"])
    assert {"rotations", "learned"} <= choices.keys()


def test_levels_end_within_the_bound_and_stay_closed_where_the_papers_gape(tmp_path):
    text, result = run_bench(tmp_path, "levels", "--rel-error", "1e-3")
    levels, gaps = tables_of(result)
    assert levels[-1]["max"] <= 1e-3 and result["broken"] == []
    assert [row["level"] for row in levels] == list(range(len(levels)))
    assert cells_of(text, "Levels")["nodes"] == "1"
    gaping = [row for row in gaps if row["joints"]]
    assert gaping and all(row["max"] < 1e-6 < 1e-3 < row["paper max"] for row in gaping)


def test_figures_come_with_command_versions_and_machine(tmp_path):
    _, result = run_bench(tmp_path, "sizes", "--rel-error", "1e-2", "--effort", "fast")
    assert result["command"].startswith("python -m bench sizes --rel-error 1e-2")
    assert {"python", "numpy", "athcodec"} <= result["versions"].keys()
    assert {"cpu", "cores"} <= result["machine"].keys()


def test_the_picture_has_a_panel_for_every_level(tmp_path):
    drawing = tmp_path / "levels.svg"
    run_bench(tmp_path, "picture", "--out", str(drawing), "--frame", "0")
    captions = ["".join(text.itertext()) for text in ElementTree.parse(drawing).iter("{http://www.w3.org/2000/svg}text")]
    with athcodec.read_hdf5(athcodec.sample_path()) as clip:
        levels = athcodec.build_ath(clip, max_error=1e-4 * 10.657).height + 2
    assert [caption.split()[1] for caption in captions[::2]] == [str(level) for level in range(levels)]


def test_the_timed_decoder_decodes_what_athcodec_decodes_and_coarse_levels_cost_less(tmp_path, sample_ath):
    quick = ("--rounds", "1", "--seeks", "2", "--instances", "3")
    text, result = run_bench(tmp_path, "decode", str(sample_ath), *quick)
    targets, whole, levels, memory, instances = tables_of(result)
    with athcodec.open(sample_ath) as decoder:
        crc = crc32c(np.ascontiguousarray(decoder.positions(), np.float32))
        assert [row["level"] for row in levels] == [depth.depth for depth in decoder.depths]
    assert levels[-1]["CRC-32C"] == f"{crc:08x}" and result["broken"] == []
    assert len({row["CRC-32C"] for row in levels}) == len(levels)
    size = sample_ath.stat().st_size
    assert 0 < levels[0]["bytes"] < levels[1]["bytes"] < levels[-1]["bytes"] <= size == memory[0]["file"]
    assert memory[0]["sum"] < memory[-1]["sum"] == sum(memory[-1][part] for part in MEMORY_PARTS)
    assert [row["level"] for row in instances] == ["0", "1", "2", "3", "even mix"]
    assert cells_of(text, "Decoding")["target"] == "<= 100"
    assert {"athcodec", "HDF5 gzip 4"} <= {row["reader"] for row in whole}
    assert all(row["error/bound"] <= 1 for row in whole if "ms" in row)
