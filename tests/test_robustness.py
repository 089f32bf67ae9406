"""`python -m spec.robustness` reports what it has counted, and hostile files do no harm."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from programs import printed

from spec import robustness
from spec.robust import Row

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.tools


def test_the_report_has_every_row_and_keeps_what_a_run_leaves_out(tmp_path, monkeypatch):
    rows = [Row("files", 1234, wrong=2, note="two of them"), Row("others", 5)]
    old = {"about": "Kept.", "rows": [], "figures": {"hours": "3"}, "seconds": 1.0, "commit": "1a", "machine": "m"}
    (tmp_path / "robustness.json").write_text(json.dumps({"older": old}))
    monkeypatch.setattr("spec.robust.hostile.run", lambda budget: rows)
    monkeypatch.setattr("spec.robust.hostile.figures", lambda: {"slowest": "1 s"})
    assert robustness.main(["--only", "hostile", "--seconds", "1", "--out", str(tmp_path)]) == 1
    text = (tmp_path / "robustness.md").read_text()
    assert "| files | 1,234 | 0 | 0 | 0 | 2 | two of them |" in text and "| others | 5 |" in text
    assert "* slowest: 1 s" in text and "* hours: 3" in text
    head = printed("git", "rev-parse", "--short=8", "HEAD", cwd=ROOT).strip()
    assert f"commit {head}" in text and "commit 1a, m." in text
    assert set(json.loads((tmp_path / "robustness.json").read_text())) == {"older", "hostile"}


@pytest.mark.slow
def test_hostile_files_cause_no_crash_hang_or_flood_of_memory(tmp_path):
    words = "-m spec.robustness --only hostile --seconds 90 --out".split()
    printed(sys.executable, *words, tmp_path, cwd=ROOT)
