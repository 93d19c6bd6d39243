"""A backup of a store in use restores whole into an empty store of either database, or not at all."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from threading import Event, Thread
from typing import Any

import httpx
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import JSON, Boolean, Float, Integer, String, Text, func, insert, select

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import CampaignStore
from api.cli.main import main
from api.errors import InputError
from api.jobs.held_job import take_next
from api.jobs.records import JobState
from api.jobs.results import Results
from api.jobs.store import JobStore
from api.store.archive import FORMAT
from api.store.backup import Folders, back_up
from api.store.check import check
from api.store.database import Database
from api.store.restore import restore, verify
from api.store.runs import RunStore
from api.store.tables import METADATA, campaigns, events, leases, runs
from api.store.tables import tests as test_rows
from tests.api.measured import sent
from tests.api.old_store import DONE, load
from tests.starting import Started


def quiet(done: float, text: str = "") -> None:
    """Nobody watches."""


def folders(root: Path) -> Folders:
    return Folders(root / "runs", root / "reports")


def sqlite(root: Path) -> str:
    return f"sqlite:///{root / 'damper-rig.db'}"


@pytest.fixture
def lab(tmp_path: Path, database: Database, store: CampaignStore, body: dict[str, Any]) -> Folders:
    """A store with a campaign, a captured run, and a job that is done with a file of its result."""
    place = folders(tmp_path / "lab")
    campaign = store.create(NewCampaign(**body))
    file = place.runs / campaign.id / "slow.h5"
    file.parent.mkdir(parents=True)
    file.write_bytes(b"samples" * 1000)
    sha256 = hashlib.sha256(b"samples" * 1000).hexdigest()
    with database.writing() as connection:
        record = {"id": "r1", "campaign": campaign.number, "test": "slow", "held_out": False, "status": "complete"}
        record |= {"location": f"{campaign.id}/slow.h5", "size_bytes": 7000, "sha256": sha256, "samples": 10}
        connection.execute(insert(runs).values(**record, sample_rate_hz=1000.0, created="2026-11-21"))
    JobStore(database).create(kind="fit", name="a fit", campaign_id="", request={"runs": ["r1"], "held_out": []})
    held = take_next(database, "worker", 20.0)
    assert held is not None
    (Results(place.results).folder(held.job.id)).mkdir(parents=True)
    (Results(place.results).folder(held.job.id) / "model.json").write_text("{}")
    held.end(JobState.DONE, result={"rms": 0.1 + 0.2})
    return place


@pytest.fixture
def backup(tmp_path: Path, database_url: str, lab: Folders) -> Path:
    assert back_up(database_url, lab, tmp_path / "lab.zip", tell=quiet).trouble == ()
    return tmp_path / "lab.zip"


def test_a_restored_store_has_the_same_records_and_files(backup: Path, tmp_path: Path, store: CampaignStore) -> None:
    to = tmp_path / "new"
    restore(backup, sqlite(to), folders(to), tell=quiet)
    with Database(sqlite(to)) as database:
        assert CampaignStore(database).campaigns() == store.campaigns()
        [job] = JobStore(database).newest()
        assert job.result == {"rms": 0.1 + 0.2}
        assert Results(to / "reports").file(job, "model.json").read_text() == "{}"
        assert RunStore(database, to / "runs").paths(["r1"])[0].read_bytes() == b"samples" * 1000
    assert check(sqlite(to), folders(to), tell=quiet).trouble == ()
    assert {path.name for path in to.iterdir()} >= {"runs", "reports", "damper-rig.db"}
    assert not list(to.glob(".*"))


@pytest.mark.postgresql
def test_a_backup_of_sqlite_restores_into_postgresql_and_goes_on_there(
    tmp_path: Path, postgresql_url: str, body: dict[str, Any]
) -> None:
    with Database(sqlite(tmp_path / "small")) as small:
        first = CampaignStore(small).create(NewCampaign(**body))
    back_up(sqlite(tmp_path / "small"), folders(tmp_path / "small"), tmp_path / "b.zip", tell=quiet)
    restore(tmp_path / "b.zip", postgresql_url, folders(tmp_path / "large"), tell=quiet)
    with Database(postgresql_url) as large:
        assert CampaignStore(large).campaigns() == (first,)
        assert CampaignStore(large).create(NewCampaign(**body)).number == first.number + 1


def test_a_backup_of_an_earlier_version_restores_as_this_one(tmp_path: Path, database_url: str) -> None:
    load(database_url)
    made = back_up(database_url, folders(tmp_path / "lab"), tmp_path / "old.zip", tell=quiet)
    assert made.schema == "0005"
    assert any("run-slow" in text or "slow.h5: is missing" in text for text in made.trouble)
    restore(tmp_path / "old.zip", sqlite(tmp_path / "new"), folders(tmp_path / "new"), tell=quiet)
    with Database(sqlite(tmp_path / "new"), migrates=False) as database:
        assert CampaignStore(database).campaign(DONE).tests[0].name == "slow"
        with database.engine.connect() as connection:
            assert compare_metadata(MigrationContext.configure(connection), METADATA) == []
            assert connection.scalar(select(func.count()).select_from(leases)) == 0


def test_only_an_empty_store_is_restored_into(backup: Path, tmp_path: Path, database_url: str, lab: Folders) -> None:
    with pytest.raises(InputError, match="is not empty"):
        restore(backup, database_url, folders(tmp_path / "new"), tell=quiet)
    with pytest.raises(InputError, match="is not empty"):
        restore(backup, sqlite(tmp_path / "new"), lab, tell=quiet)
    with Database(sqlite(tmp_path / "new"), migrates=False) as untouched, untouched.snapshot() as connection:
        assert connection.exec_driver_sql("SELECT count(*) FROM sqlite_master").scalar() == 0


def test_a_backup_cut_anywhere_is_refused_and_nothing_is_restored(backup: Path, tmp_path: Path) -> None:
    whole = backup.read_bytes()
    for part in range(1, 20):
        cut = tmp_path / "cut.zip"
        cut.write_bytes(whole[: len(whole) * part // 20])
        with pytest.raises(InputError, match="whole backup"):
            restore(cut, sqlite(tmp_path / "new"), folders(tmp_path / "new"), tell=quiet)
    assert not (tmp_path / "new").exists()


def test_a_backup_with_a_changed_byte_in_its_content_is_refused(backup: Path, tmp_path: Path) -> None:
    whole = backup.read_bytes()
    with zipfile.ZipFile(backup) as archive:
        places = [
            info.header_offset + 30 + len(info.filename) + 40 for info in archive.infolist() if info.file_size > 60
        ]
    assert len(places) > 4
    for place in places:
        spoilt = tmp_path / "spoilt.zip"
        spoilt.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(InputError):
            verify(spoilt, tell=quiet)


@pytest.mark.parametrize("path", ["runs/../../x", "/etc/x", "reports", "elsewhere/x", "runs/a\\..\\x"])
def test_a_backup_cannot_name_a_file_outside_of_the_data_folder(tmp_path: Path, path: str) -> None:
    manifest: dict[str, Any] = {"format": FORMAT, "version": "0", "schema": "0005", "database": "sqlite"}
    manifest |= {"created": "", "tables": {}, "trouble": []}
    manifest["files"] = [{"path": path, "size_bytes": 1, "sha256": "0", "included": True}]
    with zipfile.ZipFile(tmp_path / "made.zip", "w") as target:
        target.writestr("manifest.json", json.dumps(manifest))
        target.writestr(path, "x")
    with pytest.raises(InputError, match=r"runs/ or reports/"):
        restore(tmp_path / "made.zip", sqlite(tmp_path / "new"), folders(tmp_path / "new"), tell=quiet)


def test_a_backup_that_fails_leaves_no_file(tmp_path: Path, database_url: str, lab: Folders) -> None:
    def fail(done: float, text: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        back_up(database_url, lab, tmp_path / "lab.zip", tell=fail)
    assert not list(tmp_path.glob("*lab.zip*"))
    with pytest.raises(InputError, match="there is no store"):
        back_up(sqlite(tmp_path / "nowhere"), lab, tmp_path / "lab.zip", tell=quiet)
    assert not (tmp_path / "nowhere").exists()


def test_a_missing_or_changed_run_file_is_told_by_backup_and_check(
    tmp_path: Path, database_url: str, lab: Folders, capsys: pytest.CaptureFixture[str]
) -> None:
    [file] = lab.runs.rglob("*.h5")
    arguments = ["--data", str(lab.runs.parent), "--database", database_url]
    assert main(["store", "check", *arguments]) == 0
    file.write_bytes(b"other")
    assert main(["store", "check", *arguments, "--json"]) == 1
    assert "slow.h5: its content is not what the store recorded" in capsys.readouterr().out
    file.unlink()
    assert main(["store", "backup", str(tmp_path / "b.zip"), *arguments]) == 1
    assert "slow.h5: is missing" in capsys.readouterr().out
    assert main(["store", "check", str(tmp_path / "b.zip")]) == 1


def test_files_may_be_listed_only(tmp_path: Path, database_url: str, lab: Folders) -> None:
    made = back_up(database_url, lab, tmp_path / "b.zip", with_files=False, tell=quiet)
    assert len(made.files) == 2
    assert all(len(file.sha256) == 64 and not file.included for file in made.files)
    restore(tmp_path / "b.zip", sqlite(tmp_path / "new"), lab, tell=quiet)  # the files are there already
    assert check(sqlite(tmp_path / "new"), lab, tell=quiet).trouble == ()


def test_a_backup_is_only_for_its_owner(backup: Path) -> None:
    assert backup.stat().st_mode & 0o777 == 0o600


def test_every_column_has_a_type_that_a_backup_keeps() -> None:
    for table in METADATA.sorted_tables:
        for column in table.columns:
            assert isinstance(column.type, JSON | Boolean | Float | Integer | String | Text), (table.name, column.name)


@pytest.fixture
def busy(tmp_path: Path, database_url: str, body: dict[str, Any], folder: Path) -> Iterator[tuple[Started, list[str]]]:
    """A service as a process, to which a thread sends campaigns, and the ids of those that it has accepted."""
    arguments = ["serve", "--data", str(tmp_path / "busy"), "--database", database_url, "--port", "0"]
    accepted: list[str] = []
    enough = Event()
    with Started(arguments, tmp_path / "serve.log") as service:
        base = service.wait_until_ready()
        sent(base, folder / "slow.h5")
        rig = {**body, "rig": "modbus://127.0.0.1:9"}  # nobody listens: they wait

        def send() -> None:
            with httpx.Client(base_url=base, timeout=60) as client:
                while not enough.wait(0.01):
                    answer = client.post("/v1/campaigns", json=rig)
                    assert answer.status_code == 201, answer.text
                    accepted.append(answer.json()["id"])

        thread = Thread(target=send)
        thread.start()
        try:
            while len(accepted) < 20:
                thread.join(0.02)
                assert thread.is_alive()
            yield service, accepted
        finally:
            enough.set()
            thread.join(60)


@pytest.mark.slow
def test_a_backup_of_a_store_in_use_is_the_store_at_one_moment(
    busy: tuple[Started, list[str]], tmp_path: Path, database_url: str
) -> None:
    _, accepted = busy
    before = list(accepted)
    command = [sys.executable, "-m", "api.cli", "store"]
    where = ["--data", str(tmp_path / "busy"), "--database", database_url]
    subprocess.run([*command, "backup", str(tmp_path / "b.zip"), *where], check=True, timeout=120, capture_output=True)
    assert len(accepted) > len(before)  # the service went on
    new = tmp_path / "new"
    restored = [*command, "restore", str(tmp_path / "b.zip"), "--data", str(new), "--database", sqlite(new)]
    subprocess.run(restored, check=True, timeout=120, capture_output=True)
    with Database(sqlite(new)) as database, database.reading() as connection:
        numbers = list(connection.scalars(select(campaigns.c.number).order_by(campaigns.c.number)))
        kept = set(connection.scalars(select(campaigns.c.id)))
        for table, each in ((test_rows, 2), (events, 1)):
            counts = connection.execute(select(func.count()).select_from(table).group_by(table.c.campaign)).scalars()
            assert set(counts) >= {each}
            assert connection.scalar(select(func.count(table.c.campaign.distinct()))) == len(numbers)
    assert numbers == list(range(1, len(numbers) + 1))
    assert set(before) <= kept
    assert check(sqlite(new), folders(new), tell=quiet).trouble == ()
    assert check(database_url, folders(tmp_path / "busy"), tell=quiet).trouble == ()
