"""A rig in full motion is stopped at a random moment, many times on every wire, with all cores busy.

The time is that from the order to stop until the driver knows that the rig is at rest and without power. On Modbus
every second stop comes from another client. ``python -m benchmarks.bench_rig_stops 20`` stops twenty times a wire.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from benchmarks.machine import a_rig, a_sine, busy_cores
from rigctl.errors import SessionLost
from rigctl.operator_acts import stop
from rigctl.player import PlayerSettings, connect, play
from rigctl.progress import Phase, Progress

NAME = f"stops-{os.getpid()}"
WIRES = ("modbus://127.0.0.1:0", f"can://loopback/{NAME}", f"can://loopback/{NAME}-fd?fd=true")
WITHIN_S = 1.4
AMPLITUDE_M, FREQUENCY_HZ = 0.03, 3.0  # 0.57 m/s, 10.7 m/s²


def stop_once(url: str, after_s: float, *, by_another: bool) -> float:
    """Play, stop after a time in motion, and return how long it took until the rig was at rest without power."""
    asked: list[float] = []
    rested: list[float] = []
    moving = threading.Event()

    def should_stop() -> str | None:
        if not by_another and moving.is_set() and time.monotonic() - began[0] > after_s:
            asked.append(time.monotonic())
            return "enough"
        return None

    began: list[float] = []

    def tell(progress: Progress) -> None:
        if progress.phase is Phase.RUNNING and not moving.is_set():
            began.append(time.monotonic())
            moving.set()

    def another() -> None:
        moving.wait(30.0)
        time.sleep(after_s)
        with closing(connect(url)) as wire:
            asked.append(time.monotonic())
            stop(wire)
            rested.append(time.monotonic())

    other = threading.Thread(target=another) if by_another else None
    if other is not None:
        other.start()
    with tempfile.TemporaryDirectory() as folder, closing(connect(url)) as wire:
        try:
            play(
                wire,
                a_sine(30.0, 1000.0, amplitude_m=AMPLITUDE_M, frequency_hz=FREQUENCY_HZ),
                Path(folder),
                settings=PlayerSettings(ramp_s=0.3, report_s=0.0),
                on_progress=tell,
                should_stop=should_stop,
            )
        except SessionLost:
            assert by_another
        rested = rested or [time.monotonic()]
    if other is not None:
        other.join()
    return rested[0] - asked[0]


def measure(url: str, stops: int, seed: int) -> tuple[str, list[float]]:
    """Stop a rig of its own so many times."""
    random = np.random.default_rng(seed)
    with a_rig(url) as (real, _):
        return url, [
            stop_once(real, float(random.uniform(0.05, 0.8)), by_another=url.startswith("modbus") and k % 2 == 1)
            for k in range(stops)
        ]


def main(stops: float = 200) -> None:
    """Raises SystemExit where a stop took longer than WITHIN_S."""
    late = 0
    with busy_cores() as cores, ProcessPoolExecutor(len(WIRES), mp_context=get_context("spawn")) as pool:
        print(f"stop to rest, {int(stops)} times on each of {len(WIRES)} wires at once, {cores} cores busy")
        for url, times in pool.map(measure, WIRES, [int(stops)] * len(WIRES), range(len(WIRES))):
            late += sum(one > WITHIN_S for one in times)
            print(
                f"  {url.replace(NAME, 'NAME'):28s} {sum(one <= WITHIN_S for one in times)} of {len(times)} within "
                f"{WITHIN_S:g} s; median {np.median(times):.2f} s, longest {max(times):.2f} s",
                flush=True,
            )
    if late:
        raise SystemExit(f"{late} stops took longer than {WITHIN_S:g} s")


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
