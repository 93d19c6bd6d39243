"""A disk without room: nothing is accepted, nothing begins, what waits goes on waiting, and every answer says why."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import httpx
import numpy as np
import pytest

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import CampaignStore
from api.processes.child import Child
from api.settings import Settings
from api.store.database import Database
from excitation import Excitation, write_excitation
from excitation.kinds import Kind
from rigctl.runfile import write_run
from tests.api.following import ended, get, resume, until, until_rig
from tests.api.measured import a_run
from tests.full_disk import cannot_mount

MORE_THAN_ANY_DISK = str(1 << 60)


@pytest.mark.slow
def test_below_the_watermark_what_waits_goes_on_waiting_and_nothing_new_is_accepted(
    rig: str, body: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["serve", "--data", str(tmp_path / "lab"), "--port", "0"]
    (tmp_path / "lab").mkdir()
    with Database(Settings(data_dir=tmp_path / "lab").store_url) as database:
        store = CampaignStore(database)
        waiting, known = (store.create(NewCampaign(**{**body, "rig": rig})).id for _ in range(2))
        store.abort(known, "for the test")
    monkeypatch.setenv("DAMPER_RIG_LEAST_FREE_BYTES", MORE_THAN_ANY_DISK)
    with Child(command, tmp_path / "second.log") as service:
        service.wait_until_ready()
        for path in ("", "?dry_run=true", "/check", f"/{known}/retry"):
            refused = call(service, f"/v1/campaigns{path}", {**body, "rig": rig} if "retry" not in path else None, 507)
            assert "must stay free" in refused["detail"]
            assert "\n" not in refused["detail"]
        resume(service.url, rig)
        paused = until_rig(service.url, rig, lambda found: found["paused"] is not None)
        assert "must stay free" in paused["paused"]
        after = get(service.url, f"/v1/campaigns/{waiting}")
        assert (after["state"], [test["state"] for test in after["tests"]]) == ("accepted", ["waiting", "waiting"])
        assert len(get(service.url, "/v1/campaigns")["campaigns"]) == 2
    monkeypatch.delenv("DAMPER_RIG_LEAST_FREE_BYTES")
    with Child(command, tmp_path / "third.log") as service:
        service.wait_until_ready()
        resume(service.url, rig)
        assert until(service.url, waiting, ended)["state"] == "done"


def call(service: Child, path: str, body: dict[str, Any] | None, status: int) -> dict[str, Any]:
    answer = httpx.post(service.url + path, json=body, timeout=60)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def packed(place: Path) -> Path:
    """An excitation of 4 MB in a file of a few kilobytes."""
    samples = 1 << 19
    still = Excitation(kind=Kind.CUSTOM, sample_rate_hz=1e3, period_samples=0, displacement_m=np.zeros(samples))
    write_excitation(place / "packed.h5", still)
    with h5py.File(place / "packed.h5", "r+") as file:
        kept = dict(file["channels/displacement_command"].attrs)
        del file["channels/displacement_command"]
        values = file.create_dataset("channels/displacement_command", data=np.zeros(samples), compression="gzip")
        values.attrs.update(kept)
    return place / "packed.h5"


IN_A_SMALL_DISK = """
import os, signal, sys, time
from contextlib import suppress
from pathlib import Path
import httpx
from api.processes.child import Child
from tests.api.following import ended, get, post, rig_of, until

disk, rig, good, packed = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), Path(sys.argv[4])
SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "current": 0.5, "cycles": 8}
os.environ["DAMPER_RIG_LEAST_FREE_BYTES"] = "0"


class Ballast:
    def __init__(self):
        self.file = open(disk / "ballast", "ab")
        self.fill()

    def fill(self):
        with suppress(OSError):
            while True:
                os.write(self.file.fileno(), bytes(4096))

    def leave(self, size):
        os.ftruncate(self.file.fileno(), os.fstat(self.file.fileno()).st_size - size)

    def go(self):
        self.file.close()
        os.unlink(self.file.name)


with Child(["serve", "--data", str(disk / "lab"), "--port", "0"], disk.parent / "serve.log") as service:
    base = service.wait_until_ready()
    first = post(base, {"name": "a", "rig": rig, "specimen": "7", "tests": [{"name": "one", **SINE}]})
    assert until(base, first["id"], ended)["state"] == "done"
    full = Ballast()
    answer = httpx.post(base + "/v1/runs", params={"name": "a.h5"}, content=good.read_bytes(), timeout=60)
    assert answer.status_code in (503, 507), answer.text
    full.leave((1 << 22) + 4096)  # room for the samples, but not for what a file has beside them
    answer = httpx.post(base + "/v1/designs/file", params={"file": "a.h5"}, content=packed.read_bytes(), timeout=60)
    assert answer.status_code == 507 and "the disk of the run files" in answer.text, answer.text
    assert not list((disk / "lab" / "runs" / "samples").rglob("*"))
    full.fill()
    answer = httpx.post(base + "/v1/campaigns", timeout=60, json={
        "name": "b", "rig": rig, "specimen": "7", "tests": [{"name": "one", **SINE}]})
    assert answer.status_code in (201, 503, 507), answer.text
    full.go()
    later = post(base, {"name": "c", "rig": rig, "specimen": "7", "tests": [{"name": "one", **SINE}]})
    seen = rig_of(base, rig)
    if seen["paused"]:
        httpx.post(base + "/v1/rigs/resume", json={"rig": rig}, timeout=30).raise_for_status()
    assert until(base, later["id"], ended)["state"] == "done"
    assert not list((disk / "lab").rglob("*.part"))
    full = Ballast()
    status = service.stop(60.0)
    print("ended with", status)
    assert status >= 0, status
"""


@pytest.mark.slow
def test_on_a_real_full_disk_uploads_and_campaigns_are_refused_and_sigterm_ends_the_service(
    rig: str, tmp_path: Path
) -> None:
    if reason := cannot_mount():
        pytest.skip(reason)
    (tmp_path / "disk").mkdir()
    write_run(tmp_path / "good.h5", a_run(1, 2.0))
    (tmp_path / "script.py").write_text(IN_A_SMALL_DISK)
    mounted = 'mount -t tmpfs -o size=24m tmpfs "$2" && exec "$0" "$@"'
    command = ["unshare", "-rm", "sh", "-c", mounted, sys.executable]
    place = tmp_path
    given = [str(place / "script.py"), str(place / "disk"), rig, str(place / "good.h5"), str(packed(place))]
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [*command, *given], capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(root)}
    )
    assert done.returncode == 0, done.stderr[-3000:]
