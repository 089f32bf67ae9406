"""`python -m tests.fuzz`, from the repository's root."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from fuzz.cli import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
