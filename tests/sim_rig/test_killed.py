"""A host that is killed: its rig stops by itself, and its run file is closed later, with every flushed sample."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from rigctl.address import connect
from rigctl.device import Fault, RigState
from rigctl.recover import recover_directory
from rigctl.runfile import read_run

HOST = """
import sys
from pathlib import Path
from contextlib import closing
import numpy as np
from excitation.plan import Test
from excitation.kinds import Kind
from excitation.signal import Excitation
from rigctl.player import PlayerSettings, connect, play
time = np.arange(60_000) / 1000
excitation = Excitation(kind=Kind.SINE, sample_rate_hz=1000.0, period_samples=500,
    displacement_m=0.02 * np.sin(2 * np.pi * 2 * time))
with closing(connect(sys.argv[1])) as wire:
    play(wire, Test(name="killed", excitation=excitation), Path(sys.argv[2]),
         settings=PlayerSettings(ramp_s=0.2), on_progress=lambda p: print(p.samples, flush=True))
"""


@pytest.mark.parametrize(
    "url",
    [
        "modbus://127.0.0.1:0",
        *(pytest.param(f"can://loopback/killed-{{}}{fd}", marks=pytest.mark.slow) for fd in ("", "?fd=true")),
    ],
)
def test_a_killed_host_leaves_a_safe_rig_and_a_file_with_every_sample_that_was_flushed(
    start_rig: Callable[..., Any], tmp_path: Path, url: str
) -> None:
    with start_rig(url.format(os.getpid()), 1.0) as (rig, real):
        command = [sys.executable, "-c", HOST, real, str(tmp_path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as host:
            assert host.stdout is not None
            seen: list[tuple[float, int]] = []
            for line in host.stdout:
                seen.append((time.monotonic(), int(line)))
                if seen[-1][1] > 1500:
                    break
            host.send_signal(signal.SIGKILL)
        killed_at = seen[-1][0]
        with pytest.raises(subprocess.TimeoutExpired):
            rig.wait(2.0)  # nobody says a word: the rig's watchdog acts, and the rig lives on
        with closing(connect(real)) as wire:
            status = wire.status(2.0)
        assert (status.state, status.first_fault) == (RigState.FAULT_HOLD, Fault.HEARTBEAT)
    (found,) = recover_directory(tmp_path)
    assert found.path is not None
    run = read_run(found.path)
    assert run.status == "truncated"
    assert run.samples >= max((n for at, n in seen if at < killed_at - 1.0), default=0)
    assert run.samples > 500
    assert recover_directory(tmp_path) == ()
