"""A store that an earlier program wrote is brought to this one's schema with everything that it held.

The dumps in ``stores`` were written by commit b0abd5a (schema 0005): campaigns, runs, a lease, an upload, and an
explanation in each of its five states.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from api.campaigns.held_rig import hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked
from api.campaigns.records import CampaignState, TestState
from api.campaigns.store import CampaignStore
from api.jobs.held_job import LEFT_OPEN, close_left_open, take_next
from api.jobs.kinds import KINDS
from api.jobs.records import JobState
from api.jobs.store import JobStore
from api.routes.answers import explanation_answer
from api.store.database import Database
from api.store.leases import holders
from api.store.runs import RunStore
from api.store.tables import METADATA
from tests.api.old_store import DONE, load

RIG = "modbus://127.0.0.1:5020"


@pytest.fixture
def old(database_url: str) -> Iterator[Database]:
    load(database_url)
    with Database(database_url) as database:
        yield database


def test_its_schema_is_that_of_a_new_store(old: Database) -> None:
    with old.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), METADATA) == []


def test_its_campaigns_and_their_tests_and_events_are_there(old: Database) -> None:
    campaigns = CampaignStore(old)
    found = {campaign.name: campaign for campaign in campaigns.campaigns()}
    assert {name: campaign.state.value for name, campaign in found.items()} == {
        "done": "done",
        "failed": "failed",
        "aborted": "aborted",
        "running": "running",
        "waiting": "accepted",
        "elsewhere": "accepted",
    }
    done = found["done"]
    assert (done.id, done.number, done.interlocks) == (DONE, 1, ("force:-8e3:8e3:stop:0.01",))
    assert done.warm_up is not None
    assert done.warm_up["name"] == "warm-up"
    assert [test.state for test in done.tests] == [TestState.DONE, TestState.DONE]
    assert campaigns.events(DONE)[-1].text == "done"
    assert (found["running"].asked, found["running"].tests[0].samples) == (Asked.HOLD, 123)
    assert found["aborted"].reason == "wrong specimen"


def test_its_runs_and_uploads_are_there_and_found(old: Database, tmp_path: Path) -> None:
    runs = RunStore(old, tmp_path)
    assert [(run.id, run.held_out, run.samples) for run in runs.of_campaign(DONE)] == [
        ("run-slow", False, 500),
        ("run-fast", True, 250),
    ]
    assert len(runs.complete(rig=RIG, specimen="damper 7")) == 2
    assert runs.upload("u" * 32).name == "front-left_3.h5"
    for location in (f"{DONE}/slow.h5", f"uploads/{'u' * 32}/front-left_3.h5"):
        (tmp_path / location).parent.mkdir(parents=True)
        (tmp_path / location).write_bytes(b"x")
    assert [path.name for path in runs.paths(["run-slow", "u" * 32])] == ["slow.h5", "front-left_3.h5"]


def test_its_explanations_are_jobs_and_answer_as_before(old: Database) -> None:
    explanations = JobStore(old, kind="explain", noun="explanation")
    found = [explanation_answer(job) for job in reversed(explanations.newest())]
    assert [(one.number, one.name, one.state.value) for one in found] == [
        (1, "done", "done"),
        (2, "failed", "failed"),
        (3, "cancelled", "cancelled"),
        (4, "running", "running"),
        (5, "waiting", "accepted"),
    ]
    done, failed, cancelled, running, waiting = found
    assert (done.verdict, done.campaign, done.runs, done.held_out) == ("explained", DONE, ["run-slow"], ["run-fast"])
    assert [(e.element, e.confidence) for e in done.effects] == [("coulomb_friction", 0.97), ("gas_spring", 0.86)]
    assert (done.report, done.model) == tuple(f"/v1/explanations/{done.id}/{n}.json" for n in ("report", "model"))
    assert (failed.reason, failed.verdict, failed.effects) == ("run run-slow: the force is reversed", None, [])
    assert (cancelled.reason, cancelled.report) == ("a cancellation was asked for over HTTP", None)
    assert (running.phase, running.done, waiting.started) == ("naming", 0.25, None)
    assert explanations.one(failed.id).request["model"] is None
    assert explanations.one(waiting.id).request["model"]["name"] == "as simulated"
    assert {job.kind for job in JobStore(old).newest()} <= set(KINDS)


def test_its_leases_end_and_what_its_workers_left_running_is_closed(old: Database, body: dict[str, Any]) -> None:
    with old.reading() as connection:
        assert holders(connection, old.sightings) == {}
    held = hold_rig(old, RIG, "new", 20.0)
    assert held is not None
    [left] = held.left_open()
    held.end(left, CampaignState.FAILED, "its worker died", pauses=False)
    close_left_open(old, "new")
    jobs = JobStore(old)
    [failed] = [job for job in jobs.newest() if job.name == "running"]
    assert (failed.state, failed.reason) == (JobState.FAILED, LEFT_OPEN)
    with old.reading() as connection:
        assert holders(connection, old.sightings) == {f"rig {RIG}": "new"}


def test_it_goes_on_with_what_waits_and_takes_what_is_new(old: Database, body: dict[str, Any]) -> None:
    campaigns, jobs = CampaignStore(old), JobStore(old)
    new = campaigns.create(NewCampaign(**body))
    assert new.number == 7
    taken = take_next(old, "new", 20.0)
    assert taken is not None
    assert taken.job.name == "waiting"
    taken.end(JobState.DONE, result={"verdict": "explained", "effects": []})
    job = jobs.create(kind="fit", name="new", campaign_id="", request={"runs": ["run-slow"], "held_out": []})
    assert (job.number, job.state) == (6, JobState.ACCEPTED)
    assert jobs.newest()[0] == job
