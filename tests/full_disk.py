"""What the tests of a full disk share: a run whose samples are known, and whether a small disk can be mounted."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run, read_run

NAMES = {"force": "N", "displacement": "m", "temperature": "degC"}


def a_template() -> Run:
    return Run(
        run_id="full",
        created="2026-01-01T00:00:00+00:00",
        specimen="",
        sample_rate_hz=1000.0,
        period_samples=0,
        excitation_kind="sine",
        status="truncated",
        channels={name: np.empty(0) for name in NAMES},
        units=NAMES,
    )


def a_block(number: int, samples: int = 700) -> dict[str, NDArray[np.float64]]:
    return {name: np.arange(samples * number, samples * (number + 1), dtype=np.float64) for name in NAMES}


def check_whole(path: Path, samples: int, status: str = "aborted") -> None:
    run = read_run(path)
    assert (run.samples, run.status) == (samples, status)
    assert all((values == np.arange(samples)).all() for values in run.channels.values())
    assert [name.name for name in path.parent.iterdir()] == [path.name]


def cannot_mount() -> str:
    if shutil.which("unshare") is None or shutil.which("mount") is None:
        return "this system has no unshare or no mount"
    tried = subprocess.run(
        ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", "/tmp"], capture_output=True, text=True, check=False
    )
    return f"no file system can be mounted here: {tried.stderr.strip()}" if tried.returncode else ""
