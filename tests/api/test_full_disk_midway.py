"""The disk fills while a test runs through the service: the rig rests, what was captured stays, the record is true."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from rigctl.address import connect
from rigctl.device import RigState
from rigctl.runfile import read_run
from tests.api.following import ended, get, playing, post, reached, resume, rig_of, until, worker_of
from tests.full_disk import cannot_mount

LONG = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8, "cycles": 400}
SHORT = {**LONG, "cycles": 3}

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the files of another process")


def campaign_of(rig: str, test: dict[str, Any]) -> dict[str, Any]:
    return {"name": "check", "rig": rig, "specimen": "damper 7", "tests": [{"name": "one", **test}]}


def limit_files(pid: int, size: int) -> None:
    """Let no file of a process grow beyond a size: for it the disk is full (EFBIG instead of ENOSPC)."""
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


@pytest.fixture
def cut_short(base: str, lab: Path, rig: str) -> Iterator[tuple[str, str]]:
    """A campaign whose run file cannot grow any more, and one that waits behind it."""
    begun, waits = (post(base, campaign_of(rig, test))["id"] for test in (LONG, SHORT))
    resume(base, rig)
    until(base, begun, playing)
    part = lab / "data" / "runs" / begun / "one.h5.part"
    reached(base, "/v1/rigs", lambda _: part.stat().st_size > 2_000_000)
    worker = worker_of(base, rig)
    limit_files(worker, part.stat().st_size)
    yield begun, waits
    limit_files(worker, resource.RLIM_INFINITY)


@pytest.mark.slow
def test_a_run_file_that_cannot_grow_ends_the_run_and_becomes_a_run_when_there_is_room(
    base: str, lab: Path, rig: str, cut_short: tuple[str, str]
) -> None:
    begun, waits = cut_short
    worker, folder = worker_of(base, rig), lab / "data" / "runs" / begun
    after = until(base, begun, ended)
    with closing(connect(rig)) as wire:
        assert wire.status(2.0).state is RigState.DISABLED
    assert (after["state"], after["tests"][0]["state"]) == ("failed", "failed")
    told = re.search(r"the disk does not take sample (\d+) and later", after["reason"])
    assert told
    first_lost = int(told[1])
    assert "the disk does not take sample" in rig_of(base, rig)["paused"]
    assert get(base, f"/v1/campaigns/{waits}")["state"] == "accepted"
    for path in (f"/v1/campaigns/{begun}", "/v1/rigs"):
        assert str(lab) not in httpx.get(base + path, timeout=60).text
    limit_files(worker, resource.RLIM_INFINITY)
    [run] = reached(base, f"/v1/campaigns/{begun}/runs", lambda answer: bool(answer["runs"]))["runs"]
    assert run["status"] == "truncated"
    assert first_lost <= run["samples"]  # what was flushed is never lost; some of what came later may be kept
    assert get(base, f"/v1/campaigns/{begun}")["tests"][0]["samples"] == run["samples"]
    assert [path.name for path in folder.iterdir()] == ["one.h5"]
    assert read_run(folder / "one.h5").samples == run["samples"]
    resume(base, rig)
    assert until(base, waits, ended)["state"] == "done"
    assert worker_of(base, rig) == worker


IN_A_SMALL_DISK = """
import os, sys
from contextlib import closing, suppress
from pathlib import Path
import httpx
from api.processes.child import Child
from rigctl.address import connect
from rigctl.device import RigState
from rigctl.runfile import read_run
from tests.api.following import ended, get, playing, post, reached, rig_of, until, worker_of

disk, rig, reserved = Path(sys.argv[1]), sys.argv[2], sys.argv[3] == "reserved"
LONG = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.5, "cycles": 400}
os.environ["DAMPER_RIG_LEAST_FREE_BYTES"] = "0"
os.environ["DAMPER_RIG_LEASE_S"] = "4"


def fill():
    ballast = open(disk / "ballast", "wb")
    with suppress(OSError):
        while True:
            os.write(ballast.fileno(), bytes(4096))
    return ballast


def take_reserves(pid):
    "A file system that does not keep what it promised: the space that the run had taken is gone."
    for handle in Path(f"/proc/{pid}/fd").iterdir():
        if ".damper-rig-reserve-" in os.readlink(handle) and handle.stat().st_size > 65536:
            os.truncate(handle, 0)


def state():
    with closing(connect(rig)) as wire:
        return wire.status(2.0).state


with Child(["serve", "--data", str(disk / "lab"), "--port", "0"], disk.parent / "serve.log") as service:
    base = service.wait_until_ready()
    common = {"name": "check", "rig": rig, "specimen": "7"}
    begun, waits = (post(base, {**common, "tests": [{"name": "one", **LONG, "cycles": n}]})["id"] for n in (400, 3))
    httpx.post(base + "/v1/rigs/resume", json={"rig": rig}, timeout=30).raise_for_status()
    until(base, begun, playing)
    worker = worker_of(base, rig)
    if not reserved:
        take_reserves(worker)
    ballast = fill()
    reached(base, "/v1/health/live", lambda _: state() is RigState.DISABLED)
    ballast.close()
    os.unlink(ballast.name)
    after = until(base, begun, ended)
    print(after["state"], after["reason"])
    assert after["state"] == "failed", after
    [run] = reached(base, f"/v1/campaigns/{begun}/runs", lambda answer: bool(answer["runs"]))["runs"]
    assert run["status"] == "aborted", run
    folder = disk / "lab" / "runs" / begun
    assert [path.name for path in folder.iterdir()] == ["one.h5"], list(folder.iterdir())
    assert read_run(folder / "one.h5").samples == run["samples"] > 0
    paused = rig_of(base, rig)["paused"]
    print(paused)
    assert after["reason"] in paused, paused
    assert get(base, f"/v1/campaigns/{waits}")["state"] == "accepted"
    httpx.post(base + "/v1/rigs/resume", json={"rig": rig}, timeout=30).raise_for_status()
    assert until(base, waits, ended)["state"] == "done"
    assert service.stop(60.0) == 0
"""


@pytest.mark.slow
@pytest.mark.parametrize("space", ["reserved", "not reserved"])
def test_on_a_real_disk_that_fills_midway_the_run_is_aborted_with_what_was_captured(
    rig: str, tmp_path: Path, space: str
) -> None:
    if reason := cannot_mount():
        pytest.skip(reason)
    (tmp_path / "disk").mkdir()
    (tmp_path / "script.py").write_text(IN_A_SMALL_DISK)
    mounted = 'mount -t tmpfs -o size=40m tmpfs "$2" && exec "$0" "$@"'
    command = ["unshare", "-rm", "sh", "-c", mounted, sys.executable]
    given = [str(tmp_path / "script.py"), str(tmp_path / "disk"), rig, space]
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [*command, *given], capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(root)}
    )
    assert done.returncode == 0, done.stdout + done.stderr[-3000:]
