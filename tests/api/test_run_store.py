"""Runs are found by campaign, by rig and by id, whether they were captured or uploaded."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from api.campaigns.held_rig import hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.records import Campaign
from api.campaigns.store import CampaignStore
from api.errors import NotFound, StoreError
from api.store.database import Database
from api.store.runs import RunRecord, RunStore
from rigctl.runfile import Run, write_run


@pytest.fixture
def runs(database: Database, tmp_path: Path) -> RunStore:
    return RunStore(database, tmp_path / "runs")


@pytest.fixture
def campaign(store: CampaignStore, body: dict[str, Any]) -> Campaign:
    return store.create(NewCampaign(**body))


def capture(
    database: Database, runs: RunStore, campaign: Campaign, test: str, *, status: str = "complete"
) -> RunRecord:
    """A run file as a worker leaves it, told to the store."""
    path = runs.work_dir(campaign.id) / f"{test}.h5"
    path.parent.mkdir(parents=True, exist_ok=True)
    t = np.arange(100) / 1000.0
    write_run(
        path,
        Run(
            run_id=f"{campaign.number}-{test}",
            created=f"2026-11-21T00:00:0{campaign.number}+00:00",
            specimen=campaign.specimen,
            sample_rate_hz=1000.0,
            period_samples=0,
            excitation_kind="sine",
            status=status,
            channels={"displacement": t, "force": t},
            units={"displacement": "m", "force": "N"},
            test_id=test,
        ),
    )
    record = runs.describe(path, campaign_id=campaign.id, held_out=test == "fast")
    held = hold_rig(database, campaign.rig, "worker", 20.0)
    assert held is not None
    held.add_run(campaign, record)
    held.release()
    return record


def test_runs_are_found_by_campaign_and_by_name(database: Database, runs: RunStore, campaign: Campaign) -> None:
    record = capture(database, runs, campaign, "slow")
    assert runs.of_campaign(campaign.id) == (record,)
    assert runs.one(campaign.id, record.id) == record
    assert runs.path(record).is_file()
    assert runs.paths([record.id]) == (runs.path(record),)
    with pytest.raises(NotFound, match="r2"):
        runs.one(campaign.id, "r2")
    for look in (runs.of_campaign, lambda name: runs.complete(campaign_id=name), lambda name: runs.paths([name])):
        with pytest.raises(NotFound, match="nobody"):
            look("nobody")


def test_complete_runs_are_found_by_rig_and_specimen(
    database: Database, runs: RunStore, campaign: Campaign, store: CampaignStore, body: dict[str, Any]
) -> None:
    other = store.create(NewCampaign(**{**body, "specimen": "damper 8"}))
    first, second = (capture(database, runs, one, "slow") for one in (campaign, other))
    capture(database, runs, campaign, "fast", status="aborted")
    assert runs.complete(rig=body["rig"]) == (first, second)
    assert runs.complete(rig=body["rig"], specimen="damper 8") == (second,)
    assert runs.complete(campaign_id=campaign.id) == (first,)
    assert runs.complete(rig="modbus://127.0.0.1:9") == ()


def test_a_run_file_that_is_gone_is_named(database: Database, runs: RunStore, campaign: Campaign) -> None:
    record = capture(database, runs, campaign, "slow")
    runs.path(record).unlink()
    with pytest.raises(NotFound, match=f"restore {campaign.id}/slow.h5"):
        runs.path(record)


def receive(runs: RunStore, content: bytes) -> Any:
    async def parts() -> AsyncIterator[bytes]:
        for k in range(0, len(content), 1000):
            yield content[k : k + 1000]

    return asyncio.run(runs.receive("front.h5", parts()))


def test_an_uploaded_run_is_found_by_its_id_like_a_captured_one(
    database: Database, runs: RunStore, campaign: Campaign
) -> None:
    content = runs.path(capture(database, runs, campaign, "slow")).read_bytes()
    kept = receive(runs, content)
    assert (kept.name, kept.size_bytes, kept.specimen) == ("front.h5", len(content), campaign.specimen)
    assert runs.upload(kept.id) == kept
    assert [path.read_bytes() for path in runs.paths([kept.id])] == [content]
    assert receive(runs, content).id != kept.id


def test_an_upload_that_the_store_cannot_note_leaves_no_file(
    runs: RunStore, database: Database, campaign: Campaign, tmp_path: Path
) -> None:
    content = runs.path(capture(database, runs, campaign, "slow")).read_bytes()
    before = sorted(tmp_path.rglob("*.h5"))
    with Database(f"sqlite:///{tmp_path / 'other.db'}") as other:
        with other.writing() as connection:
            connection.exec_driver_sql("DROP TABLE uploads")
        with pytest.raises(StoreError, match="uploads"):
            receive(RunStore(other, tmp_path / "runs"), content)
    assert sorted(tmp_path.rglob("*.h5")) == before
