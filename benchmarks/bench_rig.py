"""Streaming to a rig in a process of its own: in real time over every wire with all cores busy, and at full speed.

For each wire and sample rate: the share of samples that arrived, the underruns, gaps and damaged blocks that the rig
counted, and the share of one core that the driver used. ``python -m benchmarks.bench_rig 10`` plays ten seconds each.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

from benchmarks.machine import a_rig, a_sine, busy_cores
from rigctl.player import PlayerSettings, connect, play
from rigctl.priority import real_time_priority
from rigctl.runfile import read_run

NAME = f"bench-{os.getpid()}"
REAL_TIME = (
    (f"can://loopback/{NAME}", 1000.0),
    (f"can://loopback/{NAME}?fd=true", 5000.0),
    ("modbus://127.0.0.1:0", 2000.0),
)
FAST = (("modbus://127.0.0.1:0", 1000.0), (f"can://loopback/{NAME}?fd=true", 1000.0))


def measure(url: str, rate_hz: float, seconds: float, speed: float) -> bool:
    """Play one sine, print one line; False where anything was lost."""
    with a_rig(url, speed) as (real, _), tempfile.TemporaryDirectory() as folder, closing(connect(real)) as wire:
        began, cpu = time.perf_counter(), time.process_time()
        path = play(wire, a_sine(seconds, rate_hz), Path(folder), settings=PlayerSettings(ramp_s=0.5))
        took, cpu = time.perf_counter() - began, time.process_time() - cpu
        run, status = read_run(path), wire.status(2.0)
    print(
        f"  {url.replace(NAME, 'NAME'):28s} {rate_hz:5.0f} Hz  {run.status}  "
        f"{run.samples / (seconds * rate_hz):8.3%} of samples  underruns {status.underruns}  gaps {status.gaps}  "
        f"damaged {status.crc_errors}  driver {100 * cpu / took:3.0f} % of a core  "
        f"{(seconds + 1) / took:5.2f} × real time",
        flush=True,
    )
    whole = run.status == "complete" and run.samples == round(seconds * rate_hz)
    return whole and not (status.underruns or status.gaps or status.crc_errors)


def main(seconds: float = 60.0) -> None:
    """Raises SystemExit where a sample was lost."""
    with busy_cores() as cores:
        with real_time_priority() as permitted:
            priority = "real-time" if permitted else "ordinary, the system permits no real-time priority"
        print(f"streaming, {seconds:g} s in real time, {cores} cores busy with other work, priority {priority}")
        whole = [measure(url, rate_hz, seconds, 1.0) for url, rate_hz in REAL_TIME]
    print("streaming, at full speed")
    whole += [measure(url, rate_hz, 20.0, 100.0) for url, rate_hz in FAST]
    if not all(whole):
        raise SystemExit("samples were lost")


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
