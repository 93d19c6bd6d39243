"""A host that streams is killed with SIGKILL at a random moment, many times, with all cores busy.

Every run file must be recovered, with every sample that the host had acknowledged a second before its end; the rig
must have come to rest by itself; an operator resets it. ``python -m benchmarks.bench_rig_killed 10`` kills ten.
"""

from __future__ import annotations

import os
import signal
import struct
import sys
import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np

from benchmarks.machine import a_rig, a_sine, busy_cores
from rigctl.device import SAFE_STATES
from rigctl.operator_acts import reset
from rigctl.player import PlayerSettings, connect, play
from rigctl.recover import recover_directory
from rigctl.runfile import read_run

NAME = f"kill-{os.getpid()}"
WIRES = ("modbus://127.0.0.1:0", f"can://loopback/{NAME}", f"can://loopback/{NAME}-fd?fd=true")
TOLD = struct.Struct("dI")
WATCHDOG_S = PlayerSettings().watchdog_s


def host(url: str, folder: Path, told: int) -> None:
    """Stream for a minute, in a process of its own, and report the number of samples that have arrived."""
    settings = PlayerSettings(ramp_s=0.2, report_s=0.0)
    with closing(connect(url)) as wire:
        play(
            wire,
            a_sine(60.0, 1000.0),
            folder,
            settings=settings,
            on_progress=lambda p: os.write(told, TOLD.pack(time.monotonic(), p.samples)) and None,
        )


def kill_one(url: str, folder: Path, after_s: float) -> tuple[int, int, bool]:
    """Kill a host some time after its first sample: samples acknowledged a second before, recovered, rig safe."""
    ours, theirs = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(ours)
        try:
            host(url, folder, theirs)
        finally:
            os._exit(1)
    os.close(theirs)
    killed_at, told = None, list[tuple[float, int]]()
    with os.fdopen(ours, "rb", buffering=0) as pipe:
        while data := pipe.read(TOLD.size):
            told.append(TOLD.unpack(data))
            first = next((at for at, samples in told if samples), None)
            if killed_at is None and first is not None and time.monotonic() - first > after_s:
                killed_at = time.monotonic()
                os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    assert killed_at is not None, "the host ended before it was killed"
    [found] = recover_directory(folder)
    samples = 0 if found.path is None else read_run(found.path).samples
    time.sleep(WATCHDOG_S + 0.3)  # no host: the rig has to stop by itself
    with closing(connect(url)) as wire:
        safe = wire.status(2.0).state in SAFE_STATES
        reset(wire)  # as an operator does it, who has looked at the rig
    return max((n for at, n in told if at < killed_at - 1.0), default=0), samples, safe


def main(kills: float = 100) -> None:
    """Raises SystemExit where a sample was lost or a rig did not stop."""
    random, lost, unsafe, tail = np.random.default_rng(1), 0, 0, []
    with ExitStack() as stack:
        rigs = [stack.enter_context(a_rig(url))[0] for url in WIRES]
        stack.enter_context(busy_cores())
        for number in range(int(kills)):
            with tempfile.TemporaryDirectory() as folder:
                due, got, safe = kill_one(rigs[number % len(rigs)], Path(folder), float(random.uniform(0.3, 3.0)))
            lost, unsafe = lost + (got < due), unsafe + (not safe)
            tail.append(got - due)
    print(
        f"kill -9, {int(kills)} times over {len(WIRES)} wires with all cores busy: {int(kills) - lost} recovered with "
        f"every sample acknowledged a second before, {int(kills) - unsafe} rigs at rest by themselves; "
        f"{min(tail)} … {max(tail)} samples more than due"
    )
    if lost or unsafe:
        raise SystemExit("samples were lost, or a rig did not stop")


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
