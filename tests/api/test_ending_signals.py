"""Signals that end a process: each stops a test on the rig in the same way, also where the terminal is gone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from api.campaigns.records import CampaignState
from api.campaigns.store import CampaignStore
from api.processes.child import Child
from api.store.database import Database
from excitation.files import write_excitation
from excitation.kinds import Kind
from excitation.signal import Excitation
from rigctl.address import connect
from rigctl.device import RigState
from rigctl.runfile import read_run
from rigctl.transport import Status
from tests.api.following import playing, post, until
from tests.api.rigs import a_sim

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no SIGHUP")


@pytest.fixture(scope="module")
def real_time_rig() -> Iterator[str]:
    with a_sim("modbus://127.0.0.1:0") as url:
        yield url


@pytest.fixture
def minute(tmp_path: Path) -> Path:
    """A sine of a minute."""
    time_s = np.arange(60_000) / 1000
    sine = Excitation(
        kind=Kind.SINE,
        sample_rate_hz=1000.0,
        period_samples=500,
        displacement_m=0.01 * np.sin(2 * np.pi * 2 * time_s),
    )
    write_excitation(tmp_path / "minute.h5", sine)
    return tmp_path / "minute.h5"


def _status(url: str) -> Status:
    with closing(connect(url)) as wire:
        return wire.status(2.0)


def _await(url: str, there: Callable[[Status], bool], within_s: float = 90.0) -> None:
    ends = time.monotonic() + within_s
    while not there(_status(url)):
        assert time.monotonic() < ends
        time.sleep(0.05)


def _is_in_motion(status: Status) -> bool:
    return status.state is RigState.ACTIVE and status.consumed > 1500


def _command(minute: Path, url: str) -> list[str]:
    return [sys.executable, "-m", "api.cli", "run", str(minute), "--rig", url, "-o", str(minute.parent / "runs")]


def _check_stopped(minute: Path, url: str) -> None:
    assert _status(url).state is RigState.DISABLED
    assert [path.name for path in (minute.parent / "runs").iterdir()] == ["minute.h5"]
    run = read_run(minute.parent / "runs" / "minute.h5")
    assert (run.status, run.samples > 400) == ("aborted", True)


def test_a_signal_that_ends_a_process_stops_its_test_and_closes_the_file(real_time_rig: str, minute: Path) -> None:
    with subprocess.Popen(_command(minute, real_time_rig), stderr=subprocess.PIPE, text=True) as process:
        _await(real_time_rig, _is_in_motion)
        process.send_signal(signal.SIGQUIT)
        said = process.communicate(timeout=60)[1]
    assert (process.returncode, said) == (1, "damper-rig: interrupted\n")
    _check_stopped(minute, real_time_rig)


@pytest.mark.slow
def test_a_terminal_that_is_closed_stops_the_test_that_runs_in_it(real_time_rig: str, minute: Path) -> None:
    script = (
        "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); os.execv(sys.executable, sys.argv[1:])"
    )
    ours, its = os.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", script, *_command(minute, real_time_rig)],
        stdin=its,
        stdout=its,
        stderr=its,
        start_new_session=True,
    ) as process:
        os.close(its)
        try:
            _await(real_time_rig, _is_in_motion)
        finally:
            os.close(ours)
        assert process.wait(60) == 1
    _check_stopped(minute, real_time_rig)


@pytest.mark.slow
def test_under_nohup_a_test_goes_on_without_its_terminal(real_time_rig: str, minute: Path) -> None:
    script = (
        "import os, signal, sys; signal.signal(signal.SIGHUP, signal.SIG_IGN); os.execv(sys.executable, sys.argv[1:])"
    )
    command = [sys.executable, "-c", script, *_command(minute, real_time_rig)]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process:
        _await(real_time_rig, _is_in_motion)
        process.send_signal(signal.SIGHUP)
        reached = _status(real_time_rig).consumed
        _await(real_time_rig, lambda status: status.state is RigState.ACTIVE and status.consumed > reached + 500)
        process.terminate()
        process.communicate(timeout=60)
    assert process.returncode == 1


@pytest.mark.parametrize("number", [pytest.param(signal.SIGHUP, marks=pytest.mark.slow), signal.SIGTERM])
def test_a_signal_that_ends_the_service_stops_the_campaign_that_it_plays(
    real_time_rig: str, tmp_path: Path, number: signal.Signals
) -> None:
    sine = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 100, "current": 0.5}
    arguments = ["serve", "--data", str(tmp_path / "lab"), "--port", "0"]
    with Child(arguments, tmp_path / "serve.log") as service:
        base = service.wait_until_ready()
        body = {"name": "long", "rig": real_time_rig, "specimen": "7", "tests": [{"name": "sine", **sine}]}
        campaign = post(base, body)["id"]
        until(base, campaign, playing)
        os.kill(service.pid, number)
        ends = time.monotonic() + 60
        while service.running():
            assert time.monotonic() < ends
            time.sleep(0.05)
        assert service.stop() == 0
    at_rest = _status(real_time_rig)
    assert (at_rest.state, at_rest.arrived) == (RigState.DISABLED, True)
    assert abs(at_rest.current_a) < 0.005  # ten standard deviations of the sensor
    with Database(f"sqlite:///{tmp_path / 'lab' / 'damper-rig.db'}") as database:
        stopped = CampaignStore(database).campaign(campaign)
    assert (stopped.state, stopped.reason) == (CampaignState.ABORTED, "the service was stopped")
