"""Many clips into .ath files, by several processes, with a manifest that an interrupted run resumes from.

`find` lists clips and where their files go, `run` encodes them with workers of Dask (pip install "athcodec[batch]"),
`preview` lists what that would do. Long clips are coded by several workers at once, some segments each; every file has
the bytes that `athcodec.encode` gives. Workers read local inputs, and write, under the same paths as the process that
calls `run`: on other machines they take a file system that all share. See manifest.py for what is kept.
"""

from athcodec.batch.inputs import Item, find
from athcodec.batch.runs import Outcome, preview, run
from athcodec.batch.settings import check_settings, load_settings

__all__ = ["Item", "Outcome", "check_settings", "find", "load_settings", "preview", "run"]
