"""`damper-rig campaign …` and the rig commands of a service, against a real service and a simulated rig."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.cli.main import main
from rigctl.runfile import read_run
from tests.api.following import ended, playing, resume, until, until_rig

Run = Callable[..., tuple[int, Any]]
PLAN = """
[[tests]]
name = "slow"
kind = "sine"
sample_rate = 1000.0
amplitude = 0.005
frequency = 4.0
cycles = {cycles}
current = 0.5
"""


@pytest.fixture
def run(base: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """One command against the shared service: its exit status, and its JSON or its message."""
    monkeypatch.setenv("DAMPER_RIG_SERVICE", base)

    def command(*words: str) -> tuple[int, Any]:
        status = main([*words, "--json"])
        said = capsys.readouterr()
        return status, json.loads(said.out) if said.out else said.err

    return command


def a_plan(folder: Path, cycles: int) -> str:
    path = folder / "plan.toml"
    path.write_text(PLAN.format(cycles=cycles))
    return str(path)


def test_a_campaign_is_submitted_watched_listed_and_fetched(run: Run, rig: str, base: str, tmp_path: Path) -> None:
    plan = a_plan(tmp_path, 4)
    status, done = run("campaign", "submit", plan, "--rig", rig, "--specimen", "damper 7", "--watch")
    assert (status, done["state"], done["name"], done["left_s"]) == (0, "done", "plan", 0.0)
    status, found = run("campaign", "list", "--state", "done", "--limit", "5")
    assert done["id"] in [one["id"] for one in found]
    for _ in range(2):  # a second time nothing is downloaded
        status, files = run("campaign", "fetch", done["id"], "-o", str(tmp_path / "runs"))
        assert status == 0
        [file] = files
        assert (read_run(Path(file["file"])).status, file["test"]) == ("complete", "slow")
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["slow.h5"]
    assert run("campaign", "fetch", done["id"], "--test", "fast")[0] == 2


def test_a_campaign_is_held_resumed_and_stopped_and_its_end_is_the_exit_status(
    run: Run, rig: str, base: str, tmp_path: Path
) -> None:
    plan = a_plan(tmp_path, 4000)
    campaign = run("campaign", "submit", plan, "--rig", rig, "--specimen", "damper 7")[1]["id"]
    until(base, campaign, playing)
    command = [sys.executable, "-m", "api.cli", "campaign", "watch", campaign]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ}) as watching:
        assert watching.stderr is not None
        assert watching.stderr.readline() == f"damper-rig: watching {campaign}; Ctrl-C ends only the watching\n"
        assert run("campaign", "hold", campaign)[1]["asked"] == "hold"
        until(base, campaign, lambda now: now["tests"][0]["phase"] == "hold")
        assert run("campaign", "resume", campaign)[0] == 0
        before = until(base, campaign, lambda now: now["tests"][0]["phase"] == "running")["tests"][0]["samples"]
        watching.send_signal(signal.SIGINT)
        said = watching.communicate(timeout=60)[1]
    assert watching.returncode == 1
    assert f"no longer watching; the campaign goes on. To end it: damper-rig campaign stop {campaign}" in said
    until(base, campaign, lambda now: now["tests"][0]["samples"] > before)
    assert run("campaign", "stop", campaign)[0] == 0
    status, stopped = run("campaign", "watch", campaign)
    assert (status, stopped["state"]) == (1, "aborted")
    status, rigs = run("rig", "list")
    [paused] = [one for one in rigs if one["url"] == rig]
    assert paused["paused"]
    assert run("rig", "resume-queue", rig)[1]["paused"] is None


def test_an_abort_ends_a_campaign(run: Run, rig: str, base: str, tmp_path: Path) -> None:
    plan = a_plan(tmp_path, 4000)
    campaign = run("campaign", "submit", plan, "--rig", rig, "--specimen", "damper 7")[1]["id"]
    until(base, campaign, playing)
    assert run("campaign", "abort", campaign)[0] == 0
    after = until(base, campaign, ended)
    assert after["state"] == "aborted", after["reason"]
    resume(base, rig)


def test_a_rig_of_the_service_is_stopped_made_safe_and_its_queue_paused(
    run: Run, rig: str, base: str, tmp_path: Path
) -> None:
    campaign = run("campaign", "submit", a_plan(tmp_path, 4000), "--rig", rig, "--specimen", "damper 7")[1]["id"]
    until(base, campaign, playing)
    [known] = [one for one in run("rig", "list")[1] if one["url"] == rig]
    status, stopped = run("rig", "stop", known["id"])
    assert (status, stopped["acknowledged"], stopped["address"]) == (0, True, rig)
    assert until(base, campaign, ended)["state"] == "aborted"
    status, safe = run("rig", "make-safe", rig)
    assert (status, safe["safe"]) == (0, True)
    assert run("rig", "pause-queue", rig, "--reason", "oil change")[1]["paused"]
    resume(base, rig)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["campaign", "watch", "nobody"], "there is no campaign 'nobody'"),
        (["campaign", "submit", "nowhere.toml"], "nowhere.toml: cannot be read as a campaign"),
        (["campaign", "list", "--state", "odd"], "odd"),
        (["campaign", "list", "--service", "rig.example"], "it must begin with http://"),
        (["rig", "resume-queue", "modbus://127.0.0.1:7"], "modbus://127.0.0.1:7"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_status_two(run: Run, words: list[str], says: str) -> None:
    status, said = run(*words)
    assert (status, said.count("\n")) == (2, 1)
    assert says in said


def test_a_file_without_rig_or_tests_is_refused_before_it_is_sent(run: Run, tmp_path: Path) -> None:
    assert "rig is missing" in run("campaign", "submit", a_plan(tmp_path, 4))[1]
    (tmp_path / "empty.json").write_text("[]")
    assert "has no tests" in run("campaign", "submit", str(tmp_path / "empty.json"))[1]


def test_what_is_known_of_a_rig_is_listed_in_words(
    base: str, rig: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DAMPER_RIG_SERVICE", base)
    httpx.post(f"{base}/v1/rigs", json={"address": rig}, timeout=30).raise_for_status()
    until_rig(base, rig, lambda known: known["state"] == "free")
    assert main(["rig", "list"]) == 0
    [line] = [line for line in capsys.readouterr().out.splitlines() if line.startswith(rig)]
    assert ": free: without power (DISABLED), commanded by nobody; plays nothing, 0 waiting" in line
