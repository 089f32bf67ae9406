"""The package is built as its folders say: decoding stands without what only an encoder needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

DECODING = ("athcodec", "athcodec.decoder", "athcodec.container", "athcodec.truncation", "athcodec.exporters")


@pytest.mark.parametrize("module", DECODING)
def test_decoding_imports_nothing_of_encoding(module):
    program = f"import sys, {module}; print([name for name in sys.modules if name.startswith('athcodec.encoding')])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("words", [["--version"], ["--help"], ["encode", "--help"]])
def test_the_command_line_explains_itself_without_what_its_verbs_work_with(words):
    """NumPy alone takes longer to import than all of that."""
    program = f"""
import sys
from athcodec.cli import main
try:
    main({words})
except SystemExit:
    heavy = {{"numpy", "h5py", "scipy", "rich", "zstandard"}}
    print("imported:", sorted(heavy & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "imported: []"


def test_the_package_names_all_that_it_gives_before_any_of_it_is_imported():
    program = """
import sys, athcodec
assert set(athcodec.__all__) <= set(dir(athcodec)) and "numpy" not in sys.modules
assert athcodec.truncate is athcodec.truncate and callable(athcodec.truncate)
print([name for name in athcodec.__all__ if getattr(athcodec, name, None) is None])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
