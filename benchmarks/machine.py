"""What the rig's benchmarks need around them: a simulated rig as a process, cores that are busy, memory in use."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation

SERVE = """
import sys
from sim_rig.server import serve
url, speed, specimen = sys.argv[1:]
ready = lambda url: print("ready", url, flush=True)
serve(url, speed=float(speed), specimen=specimen, seed=1, on_ready=ready)
"""


@contextmanager
def a_rig(url: str, speed: float = 1.0, specimen: str = "semi-active") -> Iterator[tuple[str, int]]:
    """Start a simulated rig; give its address and process."""
    command = [sys.executable, "-c", SERVE, url, str(speed), specimen]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[1], process.pid
        finally:
            process.terminate()


@contextmanager
def busy_cores() -> Iterator[int]:
    """Keep every core busy with other work, at the same priority."""
    cores = os.cpu_count() or 1
    with ExitStack() as stack:
        for _ in range(cores):
            process = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(process.kill)
        yield cores


def memory_mb(pid: int) -> float:
    """Resident memory of a process; NaN where the system does not tell."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return float("nan")
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def a_sine(seconds: float, rate_hz: float, *, amplitude_m: float = 0.01, frequency_hz: float = 2.0) -> Test:
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    return Test(
        name="sine",
        excitation=Excitation(
            kind=Kind.SINE,
            sample_rate_hz=rate_hz,
            period_samples=round(rate_hz),
            displacement_m=amplitude_m * np.sin(2 * np.pi * frequency_hz * time_s),
            current_a=0.9 + 0.5 * np.sin(2 * np.pi * time_s),
        ),
    )
