"""The service whole: real processes, a real wire, real files."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.processes.child import Child
from rigctl.player import connect
from rigctl.runfile import read_run
from tests.api.browser import browser
from tests.api.following import ended, get, playing, post, resume, rig_of, states, until, until_rig, worker_of
from tests.starting import Started

SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8}
SHORT = {**SINE, "cycles": 3}
LONG = {**SINE, "cycles": 400}


VISIBLE = "[...document.querySelectorAll('.orders button')].filter(b => b.offsetParent).map(b => b.id)"


def campaign(rig: str, *tests: dict[str, Any]) -> dict[str, Any]:
    named = [{"name": f"test {k}", **test} for k, test in enumerate(tests)]
    return {"name": "check", "rig": rig, "specimen": "damper 7", "tests": named}


def rig_state(rig: str) -> str:
    transport = connect(rig)
    try:
        return transport.status(2.0).state.name
    finally:
        transport.close()


def test_a_campaign_is_played_in_order_and_its_runs_can_be_fetched(service: Started, rig: str, tmp_path: Path) -> None:
    asked = post(service.url, campaign(rig, SHORT, {**SHORT, "frequency": 4.0, "held_out": True}))
    assert asked["state"] == "accepted"
    done = until(service.url, asked["id"], ended)
    assert (done["state"], states(done)) == ("done", ["done", "done"])
    assert [(test["samples"], test["total_samples"]) for test in done["tests"]] == [(1500, 1500), (750, 750)]
    runs = get(service.url, f"/v1/campaigns/{done['id']}/runs")["runs"]
    assert [(run["test"], run["held_out"], run["status"]) for run in runs] == [
        ("test 0", False, "complete"),
        ("test 1", True, "complete"),
    ]
    content = httpx.get(service.url + runs[0]["file"], timeout=60).content
    assert hashlib.sha256(content).hexdigest() == runs[0]["sha256"]
    (tmp_path / "fetched.h5").write_bytes(content)
    run = read_run(tmp_path / "fetched.h5")
    assert (run.samples, run.specimen, run.campaign_id) == (1500, "damper 7", done["id"])
    assert (run.test_id, run.run_id) == ("test 0", runs[0]["id"])
    drawn = get(service.url, runs[0]["loops"] + "?points=100")
    assert (
        len(drawn["displacement_m"]) == len(drawn["velocity_m_s"]) == len(drawn["force_n"]) == 85
    )  # every sixth of 500, and the first again
    assert drawn["force_n"][0] == drawn["force_n"][-1]  # a closed loop
    assert max(drawn["velocity_m_s"]) == pytest.approx(0.01 * 2 * 3.14159 * 2.0, rel=0.1)
    assert rig_state(rig) == "DISABLED"


def test_an_abort_stops_the_rig_soon_and_keeps_what_was_captured(service: Started, rig: str) -> None:
    asked = post(service.url, campaign(rig, LONG, SHORT))
    before = until(service.url, asked["id"], playing)["tests"][0]["samples"]
    assert httpx.post(f"{service.url}/v1/campaigns/{asked['id']}/abort", timeout=60).status_code == 202
    aborted = until(service.url, asked["id"], ended)
    assert (aborted["state"], states(aborted)) == ("aborted", ["aborted", "skipped"])
    assert "over HTTP" in aborted["reason"]
    assert rig_state(rig) == "DISABLED"
    [run] = get(service.url, f"/v1/campaigns/{asked['id']}/runs")["runs"]
    assert (run["status"], run["samples"] > 0) == ("aborted", True)
    assert run["samples"] - before < 100_000  # 10 s at ten times real time; where the host is late, so is the rig


def order(base: str, asked: dict[str, Any], what: str) -> int:
    return httpx.post(f"{base}/v1/campaigns/{asked['id']}/{what}", timeout=30).status_code


@pytest.mark.slow
def test_a_campaign_holds_resumes_and_stops_over_http(service: Started, rig: str) -> None:
    asked = post(service.url, campaign(rig, {**LONG, "cycles": 80}, LONG))  # 4 s, in which the hold must come
    waiting = post(service.url, campaign(rig, SHORT))
    until(service.url, asked["id"], playing)
    assert order(service.url, asked, "hold") == 202
    held = until(service.url, asked["id"], lambda c: c["tests"][0]["phase"] == "hold")
    assert (held["asked"], held["state"]) == ("hold", "running")
    before = held["tests"][0]["samples"]
    assert 0 < before < 40_000
    assert get(service.url, f"/v1/campaigns/{asked['id']}")["tests"][0]["samples"] == before
    assert order(service.url, asked, "resume") == 202
    until(service.url, asked["id"], lambda c: states(c) == ["done", "running"])
    until(service.url, asked["id"], playing)
    assert order(service.url, asked, "stop") == 202
    stopped = until(service.url, asked["id"], ended)
    assert (stopped["state"], states(stopped), stopped["asked"]) == ("aborted", ["done", "aborted"], "")
    assert stopped["reason"] == "a stop was requested over HTTP"
    assert [order(service.url, asked, what) for what in ("hold", "resume", "stop")] == [409, 409, 202]
    whole, part = get(service.url, f"/v1/campaigns/{asked['id']}/runs")["runs"]
    assert (whole["status"], whole["samples"], part["status"]) == ("complete", 40_000, "aborted")
    transport = connect(rig)
    status = transport.status(2.0)
    transport.close()
    assert (status.state.name, abs(status.displacement_m) < 2e-4) == ("DISABLED", True)
    assert rig_of(service.url, rig)["paused"] == "campaign 'check': a stop was requested over HTTP"
    assert get(service.url, f"/v1/campaigns/{waiting['id']}")["state"] == "accepted"
    resume(service.url, rig)
    assert until(service.url, waiting["id"], ended)["state"] == "done"


def test_an_interlock_of_a_campaign_ends_it_and_says_why(service: Started, rig: str) -> None:
    asked = post(service.url, {**campaign(rig, LONG, SHORT), "interlocks": ["force:-1:1:stop"]})
    failed = until(service.url, asked["id"], ended)
    assert (failed["state"], states(failed), failed["interlocks"]) == (
        "failed",
        ["failed", "skipped"],
        ["force:-1:1:stop"],
    )
    assert "interlock: force outside -1 … 1: stop" in failed["reason"]
    assert rig_state(rig) == "DISABLED"


@pytest.mark.slow
def test_a_campaign_that_is_refused_before_anything_moves_does_not_hold_up_the_next_one(
    service: Started, rig: str
) -> None:
    beyond = post(service.url, campaign(rig, {**SHORT, "amplitude": 5.0}, SHORT))
    after = post(service.url, campaign(rig, SHORT))
    refused = until(service.url, beyond["id"], ended)
    assert (refused["state"], states(refused)) == ("failed", ["failed", "skipped"])
    assert "test 0" in refused["reason"]
    assert until(service.url, after["id"], ended)["state"] == "done"


@pytest.mark.slow
def test_a_service_that_is_told_to_end_stops_the_rig_and_loses_no_accepted_campaign(
    service: Started, rig: str, tmp_path: Path
) -> None:
    running = post(service.url, campaign(rig, LONG))
    waiting = post(service.url, campaign(rig, SHORT))
    until(service.url, running["id"], playing)
    assert service.stop() == 0
    assert rig_state(rig) == "DISABLED"
    with Child(["serve", "--data", str(tmp_path / "lab"), "--port", "0"], tmp_path / "again.log") as again:
        base = again.wait_until_ready()
        stopped = get(base, f"/v1/campaigns/{running['id']}")
        assert (stopped["state"], stopped["reason"]) == ("aborted", "the service was stopped")
        restarted = "campaign 'check': the service was stopped; the service was restarted"
        assert (rig_of(base, rig)["paused"], rig_of(base, rig)["accepted"]) == (restarted, 1)
        resume(base, rig)
        assert until(base, waiting["id"], ended)["state"] == "done"


def test_after_kill_9_of_a_worker_its_campaign_is_closed_truthfully_and_its_samples_are_kept(
    service: Started, rig: str
) -> None:
    base = service.url
    running = post(base, campaign(rig, LONG))
    waiting = post(base, campaign(rig, SHORT))
    before = until(base, running["id"], lambda c: c["tests"][0]["samples"] > 2000)
    os.kill(worker_of(base, rig), signal.SIGKILL)
    until_rig(base, rig, lambda r: r["state"] == "unknown")
    closed = until(base, running["id"], ended, within_s=30.0)  # 5 s on a computer that has the time
    assert closed["state"] == "failed"
    assert "the worker that ran it died" in closed["reason"]
    [run] = get(base, f"/v1/campaigns/{running['id']}/runs")["runs"]
    assert run["status"] == "truncated"
    # The file reaches the disk every 0.2 s, at ten times real time: 2 000 samples or a little more
    assert run["samples"] > before["tests"][0]["samples"] - 3000
    assert "what its rig has done since is unknown" in rig_of(base, rig)["paused"]
    assert get(base, f"/v1/campaigns/{waiting['id']}")["state"] == "accepted"
    until_rig(base, rig, lambda r: r["state"] in ("latched fault", "powered, unattended"))
    resume(base, rig)
    asking = until(base, waiting["id"], lambda c: c["question"])
    assert "the host's heartbeat was lost" in asking["question"]
    assert rig_state(rig) in ("FAULT_HOLD", "FAULT_DISABLED"), "nothing is reset before an operator says so"
    httpx.post(f"{base}/v1/campaigns/{waiting['id']}/confirm", json={"answer": "yes"}, timeout=60).raise_for_status()
    assert until(base, waiting["id"], ended)["state"] == "done"
    assert rig_state(rig) == "DISABLED"


@pytest.mark.slow
def test_after_kill_9_of_the_service_its_worker_brings_the_rig_to_rest_and_the_next_campaign_waits(
    service: Started, rig: str, tmp_path: Path
) -> None:
    running = post(service.url, campaign(rig, LONG))
    waiting = post(service.url, campaign(rig, SHORT))
    until(service.url, running["id"], playing)
    worker = worker_of(service.url, rig)
    service.kill()
    ends = time.monotonic() + 60
    while _alive(worker):
        assert time.monotonic() < ends
        time.sleep(0.05)
    assert rig_state(rig) == "DISABLED"
    with Child(["serve", "--data", str(tmp_path / "lab"), "--port", "0"], tmp_path / "again.log") as again:
        base = again.wait_until_ready()
        restarted = "campaign 'check': the service was stopped; the service was restarted"
        assert rig_of(base, rig)["paused"] == restarted
        stopped = get(base, f"/v1/campaigns/{running['id']}")
        assert (stopped["state"], stopped["reason"]) == ("aborted", "the service was stopped")
        until_rig(base, rig, lambda r: r["state"] == "free")
        assert get(base, f"/v1/campaigns/{waiting['id']}")["state"] == "accepted"


@pytest.mark.slow
def test_a_service_ends_when_the_program_that_started_it_is_killed(tmp_path: Path) -> None:
    starts = (
        "import sys, time; from pathlib import Path; from api.processes.child import Child; "
        "child = Child(['serve', '--data', sys.argv[1], '--port', '0'], Path(sys.argv[1] + '.log')); "
        "child.wait_until_ready(); print(child.pid, flush=True); time.sleep(600)"
    )
    with subprocess.Popen([sys.executable, "-c", starts, str(tmp_path / "lab")], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        orphan = int(parent.stdout.readline())
        parent.kill()
    ends = time.monotonic() + 60
    while _alive(orphan):
        assert time.monotonic() < ends
        time.sleep(0.05)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")  # ended, but nobody has asked for its exit status yet
    return not stat.is_file() or ") Z" not in stat.read_text()


@pytest.mark.slow
@pytest.mark.browser
def test_the_live_page_draws_a_campaign_while_it_runs_and_when_it_has_ended(
    service: Started, rig: str, chromium: Path, tmp_path: Path
) -> None:
    name = '<img src=x onerror="document.title=1">'
    with browser(chromium, tmp_path / "profile") as page:
        page.open(service.url + "/")
        page.wait_for("document.querySelector('#link').textContent === 'live'")
        # Sent when the browser is there, which may take as long as a test of 20 s; this one lasts 100 s
        asked = post(service.url, {**campaign(rig, SHORT, {**LONG, "cycles": 2000}), "name": name})
        waiting = post(service.url, campaign(rig, SHORT))
        page.wait_for("document.querySelectorAll('#campaigns li').length === 2")
        page.wait_for("document.querySelector('#nowphase').textContent === 'running'", 60)
        page.wait_for("document.querySelector('#fx').data?.some(trace => trace.name === 'test 1 (live)')", 60)
        page.evaluate("document.querySelector('#hold').click()")
        page.wait_for("document.querySelector('#nowphase').textContent === 'hold'", 60)
        assert page.evaluate("document.querySelector('#state').textContent") == "on hold"
        assert page.evaluate(VISIBLE) == ["resume", "stop", "abort", "safe"]
        page.evaluate("document.querySelector('#resume').click()")
        page.wait_for("document.querySelector('#nowphase').textContent === 'running'", 60)
        assert page.evaluate(VISIBLE) == ["hold", "stop", "abort", "safe"]
        page.evaluate("document.querySelector('#abort').click()")
        page.wait_for("document.querySelector('#state').textContent === 'aborted'", 60)
        page.wait_for("document.querySelectorAll('#fv .scatterlayer .trace').length === 2", 60)
        page.wait_for("document.querySelectorAll('#tests a').length === 2")
        page.evaluate("document.querySelector('#tests input').click()")
        page.wait_for("document.querySelectorAll('#fv .scatterlayer .trace').length === 1")
        assert page.evaluate("document.querySelector('#name').textContent") == name
        assert page.evaluate("document.title") == "damper-rig"
        assert page.evaluate("document.querySelector('#reason').textContent").startswith("an abort")
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        page.wait_for("document.querySelector('#rigs .reason').textContent.includes('an abort was requested')")
        assert "queue paused" in page.evaluate("document.querySelector('#rigs').textContent")
        assert len(page.picture(tmp_path / "page.png")) > 20_000
        page.evaluate("document.querySelector('#rigs button.go').click()")
        page.wait_for("document.querySelector('#rigs button.go').hidden", 60)
        assert page.complaints == []
    assert until(service.url, asked["id"], ended)["state"] == "aborted"
    assert until(service.url, waiting["id"], ended)["state"] == "done"


def test_a_service_with_the_page_open_still_ends_at_once(service: Started) -> None:
    with httpx.stream("GET", f"{service.url}/v1/live", timeout=60) as stream:
        lines = stream.iter_lines()
        assert "event: campaigns" in lines
        os.kill(service.pid, signal.SIGTERM)
        with suppress(httpx.TransportError):
            list(lines)  # until the service hangs up; nobody else ends the stream
        assert service.stop(20.0) == 0
