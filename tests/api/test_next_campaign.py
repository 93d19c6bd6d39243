"""The test that an explanation proposes becomes a campaign by one request."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from api.app import create_app
from api.cli.main import main
from api.jobs.held_job import take_next
from api.jobs.records import Job, JobState
from api.service import Service
from api.settings import Settings
from rigctl.runfile import write_run
from tests.api.measured import MODEL, a_run
from tests.api.serving import serving

WHERE = {"rig": "modbus://127.0.0.1:5020", "specimen": "damper 7"}


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    return create_app(Settings(data_dir=tmp_path_factory.mktemp("lab")), with_workers=False)


@pytest.fixture(scope="module")
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as client:
        client.timeout = httpx.Timeout(90.0)
        yield client


def an_explanation(service: Service) -> Job:
    return service.explanations.create(kind="explain", name="x", campaign_id="", request={"runs": [], "held_out": []})


def ended(service: Service, job: Job) -> Job:
    """The job, done; it is the only one that waits."""
    held = take_next(service.database, "test", 60.0)
    assert held is not None
    assert held.job.id == job.id
    held.end(JobState.DONE)
    return service.explanations.one(job.id)


@pytest.fixture(scope="module")
def explained(client: httpx.Client, app: FastAPI, tmp_path_factory: pytest.TempPathFactory) -> Job:
    """An explanation of two sines that its model meets: a further test is worth its time."""
    place, service = tmp_path_factory.mktemp("runs"), app.state.service
    for k, frequency_hz in enumerate((1.0, 2.5)):
        run = a_run(k, frequency_hz)
        v = 0.04 * np.pi * frequency_hz * np.cos(2 * np.pi * frequency_hz * np.arange(4000) / 1000.0)
        force = 700.0 * v + np.random.default_rng(k).normal(0, 1, v.size)
        write_run(place / f"run{k}.h5", replace(run, channels={**run.channels, "force": force}))
    (place / "model.json").write_text(json.dumps(MODEL))
    job = an_explanation(service)
    runs = [str(place / "run0.h5"), "--held-out", str(place / "run1.h5")]
    assert main(["explain", str(place / "model.json"), *runs, "-o", str(service.results.folder(job.id))]) == 0
    return ended(service, job)


def test_the_proposed_test_is_accepted_as_a_campaign_once_for_each_key(
    client: httpx.Client, app: FastAPI, explained: Job
) -> None:
    route = f"/v1/explanations/{explained.id}"
    design = client.get(f"{route}/report.json").json()["next_test"]["design"]
    key = {"Idempotency-Key": "next"}
    made = client.post(f"{route}/campaign", json={**WHERE, "operator": "Anna"}, headers=key)
    assert made.status_code == 201, made.text
    stored = client.get(made.headers["location"]).json()
    assert (stored["state"], stored["name"]) == ("accepted", f"next test after {explained.id[:8]}")
    assert (stored["rig"], stored["specimen"]) == (WHERE["rig"], WHERE["specimen"])
    assert app.state.service.campaigns.campaign(stored["id"]).setup["operator"] == "Anna"
    assert [test["name"] for test in stored["tests"]] == [design["name"]]
    again = client.post(f"{route}/campaign", json={**WHERE, "operator": "Anna"}, headers=key)
    assert (again.status_code, again.json()["id"]) == (201, stored["id"])
    named = client.post(f"{route}/campaign", json={**WHERE, "name": "sure"})
    assert (named.status_code, named.json()["name"]) == (201, "sure")


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ({"specimen": "damper 7"}, "rig is missing"),
        ({**WHERE, "specimen": ""}, "specimen"),
        ({**WHERE, "rig": "modbus://10.9.9.9:502"}, "10.9.9.9"),
        ({**WHERE, "tests": []}, "not a known key"),
    ],
    ids=["no rig", "no specimen", "a rig that is not allowed", "a key that is not read"],
)
def test_what_no_campaign_may_have_is_refused_and_none_is_made(
    client: httpx.Client, explained: Job, given: dict[str, Any], word: str
) -> None:
    before = client.get("/v1/campaigns").json()["campaigns"]
    answer = client.post(f"/v1/explanations/{explained.id}/campaign", json=given)
    assert answer.status_code == 422, answer.text
    assert word in answer.json()["detail"]
    assert client.get("/v1/campaigns").json()["campaigns"] == before


def test_an_explanation_that_proposes_none_or_has_not_ended_gives_no_campaign(
    client: httpx.Client, app: FastAPI, explained: Job
) -> None:
    service: Service = app.state.service
    job = an_explanation(service)
    early = client.post(f"/v1/explanations/{job.id}/campaign", json=WHERE)
    assert early.status_code == 409
    assert f"explanation {job.id} is accepted" in early.json()["detail"]
    report = client.get(f"/v1/explanations/{explained.id}/report.json").json()
    report["next_test"] = {"text": "repeat the run that showed it", "design": {}}
    folder: Path = service.results.folder(job.id)
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(json.dumps(report))
    ended(service, job)
    none = client.post(f"/v1/explanations/{job.id}/campaign", json=WHERE)
    assert none.status_code == 409
    assert none.json()["detail"] == f"explanation {job.id} proposes no test: repeat the run that showed it"
    assert client.post("/v1/explanations/unknown/campaign", json=WHERE).status_code == 404
