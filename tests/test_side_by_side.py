"""What is shown of smoothness: the verb `smoothness` with its picture, and the page that plays motions beside each
other, which tests with the marker `browser` open in Chromium.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from pathlib import Path

import numpy as np
import pytest

import athcodec
from athcodec.sources import sample_path
from bench.__main__ import main
from bench.browser import chromium

pytestmark = pytest.mark.tools

CLIP = str(sample_path())


def contents(page: Path) -> dict:
    return json.loads(re.search(r'id="data">(.*?)</script>', page.read_text("utf-8"), re.DOTALL)[1])


def unpacked(text: str, dtype: str, *shape: int) -> np.ndarray:
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype).reshape(shape)


def jerks(source: np.ndarray, decoded: np.ndarray, loop: bool = False) -> np.ndarray:
    """(T, N) second differences of the error, 0 where there is none."""
    error = decoded.astype(float) - source
    around = np.concatenate([error[-1:], error, error[:1]])
    found = np.linalg.norm(around[:-2] - 2 * around[1:-1] + around[2:], axis=2)
    if not loop:
        found[[0, -1]] = 0
    return found


@pytest.fixture(scope="module")
def page(sample_ath, tmp_path_factory):
    """The sample beside a file of three segments, at two of its levels."""
    out = tmp_path_factory.mktemp("page") / "page.html"
    assert main(["compare", CLIP, str(sample_ath), "--rel-error", "--level", "0", "3", "-o", str(out)]) == 0
    return out


def test_the_page_holds_the_motions_and_what_trembles(page, sample_ath, sample_positions):
    data = contents(page)
    source, coarse, fine = data["panels"]
    assert (data["frames"], data["vertices"]) == sample_positions.shape[:2]
    assert fine["seams"] == coarse["seams"] == [40, 80] and source["seams"] == []
    assert "level 3" in fine["name"] and "tick ratio" in fine["about"][1]
    with athcodec.open(sample_ath) as decoder:
        decoded = [sample_positions, decoder.positions(level=0), decoder.positions(level=3)]
        bounds = [None] + [max(decoder.levels[level].max_error, decoder.file.max_error_bound) for level in (0, 3)]
    low, high = (edge([edge(shown, axis=(0, 1)) for shown in decoded], axis=0) for edge in (np.min, np.max))
    cell = (high - low).max() / 2 / data["grid"]
    for panel, expected, bound in zip(data["panels"], decoded, bounds, strict=True):
        steps = unpacked(panel["positions"], "<i2", *expected.shape)
        shown = np.cumsum(steps, axis=0, dtype=np.int16) * cell + (low + high) / 2
        assert np.abs(shown - expected).max() <= 0.51 * cell
        if bound is not None:
            heat = unpacked(panel["heat"], "u1", *expected.shape[:2])
            sizes = jerks(sample_positions.astype(float), expected) / bound * data["heat"]
            assert np.abs(heat - np.minimum(sizes, 255)).max() <= 0.51


def test_the_page_needs_nothing_else(page):
    text = page.read_text("utf-8")
    outside = re.sub(r'<script type="application/json".*?</script>', "", text, flags=re.DOTALL)
    assert not re.search(r"https?://|\bimport\b|fetch\(", outside)
    assert "default-src 'none'" in text


def test_motion_of_another_codec_is_a_panel_too_and_a_loop_ends_where_it_begins(sample_clip, tmp_path):
    loop = athcodec.looped(sample_clip, 20)
    athcodec.write(loop, tmp_path / "loop.h5")
    rough = np.round(loop.block(0, 100), 2).astype(np.float32)
    other = loop.replace(positions=rough)
    athcodec.write(other, tmp_path / "rough.npz")
    athcodec.encode(loop, tmp_path / "loop.ath", rel_error=1e-2, effort="fast", ladder="none")
    files = [tmp_path / name for name in ("loop.h5", "rough.npz", "loop.ath")]
    words = [*files, "--rel-error", "-o", tmp_path / "a.html"]
    assert main(["compare", *map(str, words)]) == 0
    _, foreign, ours = contents(tmp_path / "a.html")["panels"]
    assert foreign["name"] == "rough.npz" and foreign["seams"] == []
    assert ours["seams"] == [0]
    with athcodec.open(tmp_path / "loop.ath") as decoder:
        bound, decoded = decoder.file.max_error_bound, decoder.positions()
    heat = unpacked(ours["heat"], "u1", 100, 1001)
    expected = jerks(loop.block(0, 100).astype(float), decoded, loop=True) / bound * 64
    assert np.abs(heat - np.minimum(expected, 255)).max() <= 0.51 and heat[[0, -1]].any()


def test_another_clip_is_refused(sample_ath, bushy_ath, tmp_path):
    with pytest.raises(SystemExit, match="expected"):
        main(["compare", CLIP, str(bushy_ath), "--rel-error", "-o", str(tmp_path / "a.html")])
    assert not (tmp_path / "a.html").exists()


def test_smoothness_is_a_table_and_a_picture(sample_positions, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    words = ["--rel-error", "1e-3", "--segment-frames", "40", "--ladder", "none", "--effort", "fast"]
    picture, results = tmp_path / "a.png", tmp_path / "a.json"
    assert main(["smoothness", CLIP, *words, "--picture", str(picture), "--json", str(results)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    [table] = json.loads(results.read_text())["tables"]
    assert [row["level"] for row in table["rows"]] == [0, 1, 2, 3]
    bends = np.diff(sample_positions.astype(float), 2, axis=0)
    motion = np.sqrt((bends**2).sum(axis=2).mean(axis=1))
    usual = max(motion[seam - 3 : seam + 1].max() for seam in (40, 80)) / np.median(motion)
    assert [row["source's"] for row in table["rows"]] == pytest.approx([usual] * 4, rel=1e-3)
    assert all(row["tick ratio"] < 2 * usual for row in table["rows"]), "segments go on from the one before"
    assert "tick ratio" in capsys.readouterr().out


@pytest.mark.browser
def test_the_page_plays_and_lights_what_trembles(page, sample_ath, sample_positions):
    with athcodec.open(sample_ath) as decoder:
        bound = decoder.file.max_error_bound
        jerk = jerks(sample_positions.astype(float), decoder.positions()) / bound
    frame, errors = int((jerk > 1).sum(axis=1).argmax()), []
    with chromium() as browser:
        shown = browser.new_page(viewport={"width": 1200, "height": 700})
        shown.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        shown.on("pageerror", lambda error: errors.append(str(error)))
        shown.goto(page.as_uri())
        shown.wait_for_function("() => globalThis.comparison?.state.frame > 3", timeout=60_000)
        shown.evaluate(f"comparison.play(false); comparison.show({frame})")
        lit = shown.evaluate("comparison.lit(2)")
        assert lit == pytest.approx((jerk[frame] > 1).sum(), abs=8), "but for rounding at the threshold"
        assert f"{lit:,} of 1,001 vertices lit" in shown.locator(".cell output").nth(2).text_content()
        box = shown.locator(".cell").nth(2).bounding_box()
        lights = shown.screenshot(clip=box)
        shown.locator("#lights").uncheck()
        assert shown.screenshot(clip=box) != lights
        shown.keyboard.press("ArrowRight")
        assert shown.evaluate("comparison.state.frame") == (frame + 1) % 120
        shown.locator("#part").select_option("seam at 40")
        assert shown.evaluate("comparison.state.part") == [28, 51]
        shown.evaluate("comparison.show(52)")
        assert shown.evaluate("comparison.state.frame") == 28, "a part is played in a loop"
    assert errors == []
