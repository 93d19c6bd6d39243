"""The autopilot on the simulated rig: it asks for the tests that it needs, and no more than it may."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from api.campaigns.autopilot import SURE
from api.cli.main import main
from rigctl.runfile import read_run
from tests.api.rigs import a_sim

MODEL = Path(__file__).parents[2] / "examples" / "models" / "semi-active.json"
FIRST = """
[[tests]]
name = "first sine"
kind = "sine"
sample_rate = 1000.0
amplitude = 0.02
frequency = 1.5
cycles = 8
current = 0.6
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "first.toml").write_text(FIRST, encoding="utf-8")
    return tmp_path


def run_autopilot(url: str, budget: str) -> int:
    assert main(["run", "first.toml", "--rig", url, "-o", "runs"]) == 0
    words = ["autopilot", str(MODEL), "runs/first_sine.h5", "--rig", url, "-o", "found", "--budget", budget, "--json"]
    return main(words)


@pytest.mark.slow
def test_from_one_sine_it_finds_the_tests_that_make_the_name_sure(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with a_sim("modbus://127.0.0.1:0", "--hide", "stribeck_friction", "--seed", "3", "--speed", "20") as url:
        assert run_autopilot(url, "90") == 0
    report = json.loads((folder / "found" / "report.json").read_text(encoding="utf-8"))
    assert [e["element"] for e in report["effects"]] == ["stribeck_friction"]
    assert report["effects"][0]["confidence"] >= SURE
    asked = [read_run(path) for path in (folder / "found" / "runs").glob("*.h5")]
    assert len(asked) >= 1
    assert sum(run.samples / run.sample_rate_hz for run in asked) <= 90.0
    assert "every name is sure" in capsys.readouterr().err


@pytest.mark.slow
def test_it_spends_no_rig_time_that_it_does_not_have(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with a_sim("modbus://127.0.0.1:0", "--hide", "stribeck_friction", "--seed", "3", "--speed", "20") as url:
        assert run_autopilot(url, "1") == 0
    assert not (folder / "found" / "runs").exists()
    said = capsys.readouterr().err
    assert "1 s of rig time are left" in said
    report = json.loads((folder / "found" / "report.json").read_text(encoding="utf-8"))
    assert all(e["confidence"] < 0.9 for e in report["effects"])  # one run alone bears nothing out
