"""A campaign honours its plan: dwell, temperature gates, warm-up."""

from __future__ import annotations

from pathlib import Path

import httpx
import numpy as np

from rigctl.runfile import read_run
from tests.api.following import ended, get, post, states, until
from tests.starting import Started

SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "current": 0.5, "cycles": 2}
WARM_UP = {**SINE, "name": "warm-up", "amplitude": 0.02, "cycles": 20}


def test_a_campaign_warms_its_damper_up_and_records_its_tests_only(service: Started, rig: str, tmp_path: Path) -> None:
    body = {"name": "warm", "rig": rig, "specimen": "damper 7", "warm_up": WARM_UP}
    tests = [{**SINE, "name": "warm", "min_temperature": 31.0, "dwell": 2.0}, {**SINE, "name": "cool"}]
    done = until(service.url, post(service.url, {**body, "tests": tests})["id"], ended)
    assert (done["state"], states(done)) == ("done", ["done", "done"]), done["reason"]
    assert done["warm_up"] == WARM_UP
    runs = get(service.url, f"/v1/campaigns/{done['id']}/runs")["runs"]
    assert [run["test"] for run in runs] == ["warm", "cool"]
    path = tmp_path / "warm.h5"
    path.write_bytes(httpx.get(service.url + runs[0]["file"], timeout=60).content)
    assert np.mean(read_run(path).channels["temperature"]) > 30.8


def test_a_gate_that_cannot_open_fails_the_campaign_in_words(service: Started, rig: str) -> None:
    body = {"name": "cold", "rig": rig, "specimen": "damper 7"}
    tests = [{**SINE, "name": "cold", "min_temperature": 150.0}]
    done = until(service.url, post(service.url, {**body, "tests": tests})["id"], ended)
    assert done["state"] == "failed"
    assert "play a warm-up first" in done["reason"]


def test_a_warm_up_that_cannot_be_is_refused_before_it_is_accepted(service: Started, rig: str) -> None:
    body = {"name": "bad", "rig": rig, "specimen": "d", "tests": [{**SINE, "name": "t"}]}
    wrong = {**body, "warm_up": {**WARM_UP, "frequency": -1}}
    answer = httpx.post(f"{service.url}/v1/campaigns", json=wrong, timeout=60)
    assert answer.status_code == 422
    assert "warm-up" in answer.text or "warm_up" in answer.text
