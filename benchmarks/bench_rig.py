"""Streaming to a rig in a process of its own: in real time over every wire, and as fast as it goes.

Prints, for each wire and sample rate, the share of samples that arrived, the underruns and gaps that the rig counted,
and the share of one core that the driver used. ``python -m benchmarks.bench_rig 60`` plays a minute each.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np

from excitation.plan import Test
from excitation.signal import Excitation, Kind
from rigctl.player import PlayerSettings, connect, play
from rigctl.runfile import read_run

SERVE = """
import sys
from sim_rig.server import serve
serve(sys.argv[1], speed=float(sys.argv[2]), seed=1, on_ready=lambda url: print("ready", url, flush=True))
"""
NAME = f"bench-{os.getpid()}"
REAL_TIME = (
    (f"can://loopback/{NAME}", 1000.0),
    (f"can://loopback/{NAME}?fd=true", 5000.0),
    ("modbus://127.0.0.1:0", 2000.0),
)
FAST = (("modbus://127.0.0.1:0", 1000.0), (f"can://loopback/{NAME}?fd=true", 1000.0))


def a_sine(seconds: float, rate_hz: float) -> Test:
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    return Test(
        name="sine",
        excitation=Excitation(
            kind=Kind.SINE,
            sample_rate_hz=rate_hz,
            period_samples=round(rate_hz),
            displacement_m=0.02 * np.sin(2 * np.pi * 2 * time_s),
            current_a=0.9 + 0.5 * np.sin(2 * np.pi * time_s),
        ),
    )


def measure(url: str, rate_hz: float, seconds: float, speed: float) -> None:
    """Play one sine and print one line."""
    command = [sys.executable, "-c", SERVE, url, str(speed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        real = process.stdout.readline().split()[1]
        with tempfile.TemporaryDirectory() as folder, closing(connect(real)) as wire:
            began, cpu = time.perf_counter(), time.process_time()
            path = play(wire, a_sine(seconds, rate_hz), Path(folder), settings=PlayerSettings(ramp_s=0.5))
            took, cpu = time.perf_counter() - began, time.process_time() - cpu
            run, status = read_run(path), wire.status(2.0)
        process.terminate()
    print(
        f"  {url.replace(NAME, 'NAME'):34s} {rate_hz:6.0f} Hz  {run.status}  "
        f"{run.samples / (seconds * rate_hz):8.3%} of samples  underruns {status.underruns}  gaps {status.gaps}  "
        f"driver {100 * cpu / took:3.0f} % of a core  {(seconds + 1) / took:5.2f} × real time"
    )


def main(seconds: float = 10.0) -> None:
    print(f"streaming, {seconds:g} s in real time")
    for url, rate_hz in REAL_TIME:
        measure(url, rate_hz, seconds, 1.0)
    print("streaming, as fast as it goes")
    for url, rate_hz in FAST:
        measure(url, rate_hz, 2 * seconds, 100.0)


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
