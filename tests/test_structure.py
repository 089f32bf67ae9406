"""The package is built as its folders say: decoding stands without what only an encoder needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

DECODING = ("athcodec", "athcodec.decoder", "athcodec.container", "athcodec.truncate", "athcodec.exporters")


@pytest.mark.parametrize("module", DECODING)
def test_decoding_imports_nothing_of_encoding(module):
    program = f"import sys, {module}; print([name for name in sys.modules if name.startswith('athcodec.encoding')])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
