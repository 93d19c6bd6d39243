"""A host that is late, a rig that holds little: the stream survives both, and says so where it cannot."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.plan import Test
from excitation.signal import Excitation, Kind
from rigctl.player import PlayerSettings, play
from rigctl.priority import ahead, behind
from rigctl.progress import Phase, Progress
from rigctl.runfile import read_run
from tests.sim_rig.virtual import WIRES, wire_to


def at_5_khz(seconds: float) -> Test:
    t = np.arange(round(5000 * seconds)) / 5000
    excitation = Excitation(
        kind=Kind.SINE,
        sample_rate_hz=5000.0,
        period_samples=1000,
        displacement_m=0.01 * np.sin(2 * np.pi * 5 * t),
        current_a=np.full(t.size, 0.8),
    )
    return Test(name="fast", excitation=excitation)


def test_a_host_that_is_late_again_and_again_loses_nothing_at_5_khz(bench: Callable[..., Any], tmp_path: Path) -> None:
    b, late = bench(speed=1.0), list[float]()

    def sleep(progress: Progress) -> None:
        if progress.phase is Phase.RUNNING:
            late.append(b.clock.now())
            b.wait(0.9)  # the watchdog waits 1 s

    test = at_5_khz(2.0)
    settings = PlayerSettings(ramp_s=0.2, report_s=0.3)
    wire = wire_to("can_fd", b.rig, b.clock)
    run = read_run(play(wire, test, tmp_path, clock=b.clock, settings=settings, on_progress=sleep))
    assert (run.status, run.samples) == ("complete", test.excitation.samples)
    assert len(late) > 2
    status = b.rig.status()
    assert (status.underruns, status.gaps) == (0, 0)


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("fifo_samples", [64, 700])
def test_a_rig_with_a_small_fifo_gets_blocks_that_fit_it(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, wire: str, fifo_samples: int
) -> None:
    b = bench(speed=20.0, fifo_samples=fifo_samples)
    transport = wire_to(wire, b.rig, b.clock)
    assert transport.identify(1.0).fifo_samples == fifo_samples
    test = replace(a_sine(600), name="small")
    run = read_run(play(transport, test, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.1)))
    assert (run.status, run.samples) == ("complete", 600)
    assert np.max(np.abs(run.channels["displacement"] - test.excitation.displacement_m)) < 2e-3
    assert b.rig.status().gaps == 0


def test_a_thread_that_is_ahead_is_ordinary_again_afterwards_and_so_are_those_it_began() -> None:
    before, inside = _policy(), list[int]()
    with ahead() as permitted:
        during = _policy()
        thread = threading.Thread(target=lambda: (behind(), inside.append(_policy())))
        thread.start()
        thread.join()
    assert inside == [before]
    assert _policy() == before
    assert (during != before) is permitted


def _policy() -> int:
    return os.sched_getscheduler(0) if hasattr(os, "sched_getscheduler") else 0
