"""Figures on athcodec's files and speed: `python -m bench VERB` from the repository's root.

Needs athcodec installed; other codecs, simulated clips and pictures take part where they are installed too
(the extra `bench`). One module per verb, each with `add_arguments(parser)` and `run(args) -> dict`; see
tables.py for what the dictionary holds. The package athcodec never imports this one.
"""

import sys
from pathlib import Path

# `python -m` puts the root in front of everything. The athcodec to measure is the installed one, not the
# sources there.
_ROOT = str(Path(__file__).resolve().parent.parent)
sys.path[:] = [entry for entry in sys.path if entry != _ROOT] + [_ROOT]
