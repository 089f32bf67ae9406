"""`python -m athcodec`: the same as the command `athcodec`, see cli/."""

from __future__ import annotations

import sys

from athcodec.cli import main

if __name__ == "__main__":
    sys.exit(main())
