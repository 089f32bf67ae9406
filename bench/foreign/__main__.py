"""The process of one maker: python -m bench.foreign MODULE MAKER FILE OPTIONS."""

import json
import sys
from importlib import import_module
from pathlib import Path

module, maker, file, options = sys.argv[1:]
getattr(import_module(f"bench.foreign.{module}"), maker)(Path(file), **json.loads(options))
