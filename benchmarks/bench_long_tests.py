"""Further examples of what `make test` holds to on fewer: the tests marked `bench`, and more draws of Hypothesis.

Ends with the status of pytest: 0 where all of them passed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest


def main() -> None:
    """Run them on two processes; exit status other than 0 where one failed."""
    root = Path(__file__).parents[1]
    arguments = ["-n", "2", "--dist", "loadfile", "--no-loadscope-reorder", "-m", "bench or hypothesis"]
    arguments += ["--hypothesis-profile", "thorough"]
    status = pytest.main([*arguments, "--rootdir", str(root), str(root / "tests")])
    if status != pytest.ExitCode.OK:
        sys.exit(int(status))


if __name__ == "__main__":
    main()
