"""Measurements of athcodec's file sizes and speed: `python -m bench VERB` in the repository's root.

Needs athcodec installed; other codecs and the physics engine are used where they are installed (the extra
`bench`). One module per verb, each with `add_arguments(parser)` and `run(args) -> dict`; tables.py describes the
dictionary. The package athcodec never imports this one.
"""

import sys
from pathlib import Path

# `python -m` puts the root first on the path. The athcodec to measure is the installed one, not the sources there.
_ROOT = str(Path(__file__).resolve().parent.parent)
sys.path[:] = [entry for entry in sys.path if entry != _ROOT] + [_ROOT]
