"""A job that needs more memory than it may take is refused in one line; a test that moves is not disturbed by it."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from api.jobs.process import JobProcess
from api.processes.child import Child
from api.processes.limits import JOB_DIES_FIRST, computer_memory
from rigctl.player import connect
from rigctl.runfile import Run, write_run
from tests.api.following import ended, post, until
from tests.api.measured import MODEL, sent

SAMPLES = 8_000_000  # in 2 channels of float64: 128 MB, and more while they are prepared
MOST_BYTES = 400_000_000  # the libraries take some 200 MB
REQUEST = {"model": MODEL, "runs": ["x"], "held_out": []}
SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8, "cycles": 120}


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("large") / "large.h5"
    displacement = 0.02 * np.sin(2 * np.pi * np.arange(SAMPLES) / 500.0)
    write_run(
        path,
        Run(
            run_id="large",
            created="2026-11-21T00:00:00+00:00",
            specimen="damper 7",
            sample_rate_hz=1000.0,
            period_samples=500,
            excitation_kind="sine",
            status="complete",
            channels={"displacement": displacement, "force": 3e4 * displacement},
            units={"displacement": "m", "force": "N"},
        ),
    )
    return path


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits what a process writes to")
def test_a_job_beyond_its_memory_says_so_in_one_line(large: Path) -> None:
    with JobProcess("fit", REQUEST, [large], [], folder=None, memory_bytes=MOST_BYTES) as process:
        assert process.ended(300.0)
        answer = process.answer()
    assert answer.refused
    assert answer.failure.startswith("it needs more than 0.4 GB of memory: give fewer or shorter runs")
    assert "\n" not in answer.failure


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has such a score")
def test_where_memory_runs_out_a_job_ends_before_the_service(large: Path, tmp_path: Path) -> None:
    own = int(Path("/proc/self/oom_score_adj").read_text())
    with JobProcess("fit", REQUEST, [large], [], folder=tmp_path / "fit") as process:
        score = Path(f"/proc/{process.pid}/oom_score_adj")
        while int(score.read_text()) == own:
            assert not process.ended(0.05)
        assert int(score.read_text()) == JOB_DIES_FIRST


def test_the_memory_of_the_computer_is_known_here() -> None:
    found = computer_memory()
    assert found is not None
    assert 1 << 28 < found <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits what a process writes to")
def test_a_job_that_takes_all_that_it_may_does_not_disturb_a_test_that_moves(
    rig: str, large: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAMPER_RIG_JOB_MEMORY_BYTES", str(MOST_BYTES))
    with Child(["serve", "--data", str(tmp_path / "lab"), "--port", "0"], tmp_path / "serve.log") as service:
        base = service.wait_until_ready()
        run = sent(base, large)
        body: dict[str, Any] = {"name": "moves", "rig": rig, "specimen": "7", "tests": [{"name": "long", **SINE}]}
        campaign = post(base, body)
        until(base, campaign["id"], lambda one: one["tests"][0]["samples"] > 0)
        refused = httpx.post(f"{base}/v1/jobs", json={"kind": "fit", "runs": [run], "model": MODEL}, timeout=300)
        assert refused.status_code == 422, refused.text
        assert "GB of memory" in refused.json()["detail"]
        assert until(base, campaign["id"], ended)["state"] == "done"
    wire = connect(rig)
    try:
        assert wire.status(2.0).underruns == 0
    finally:
        wire.close()
