"""The benchmark that kills the parts of a laboratory ends all of them when it is told to end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks.service_kills.database_server import installed
from tests.conftest import missing

ROOT = Path(__file__).parents[2]


def processes_of(folder: Path) -> list[str]:
    """The command lines that name a folder."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = entry.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if str(folder) in line:
            found.append(line)
    return found


def eventually(is_there: Callable[[], object], within_s: float) -> bool:
    ends = time.monotonic() + within_s
    while not is_there():
        if time.monotonic() > ends:
            return False
        time.sleep(0.1)
    return True


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder that another user may look into: PostgreSQL does not run as root."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks for its processes in /proc")
@pytest.mark.parametrize(("store", "number"), [("sqlite", signal.SIGINT), ("postgresql", signal.SIGTERM)])
def test_a_benchmark_that_is_told_to_end_leaves_no_process_and_no_folder(
    store: str, number: signal.Signals, folder: Path
) -> None:
    if store == "postgresql" and installed() is None:
        missing("no programs of a PostgreSQL server")
    command = [sys.executable, "-m", "benchmarks.bench_service_kills", store, "2"]
    environ = {**os.environ, "TMPDIR": str(folder), "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, cwd=ROOT, env=environ, stdout=subprocess.PIPE, text=True) as process:
        assert eventually(lambda: list(folder.glob("*/looks")), 120.0)
        assert any("watcher" in line for line in processes_of(folder))
        process.send_signal(number)
        out, _ = process.communicate(timeout=90)
    assert process.returncode == 128 + number, out
    assert eventually(lambda: not processes_of(folder), 60.0), processes_of(folder)
    assert list(folder.iterdir()) == []
