"""A clock that is set by an hour, the host's or the database's: no lease changes hands, nothing is valid again."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from typing import Any

import pytest
from sqlalchemy import event, select, text
from sqlalchemy.pool import ConnectionPoolEntry

from api.access.identity import Identity, Refused
from api.access.keyring import Keyring
from api.access.keys import KeyStore
from api.access.scopes import Scope
from api.access.snapshot import ABSOLUTE_S, IDLE_S
from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import CampaignStore
from api.jobs.held_job import close_left_open, take_next
from api.jobs.records import JobState
from api.jobs.store import JobStore
from api.store.clock import now
from api.store.database import Database
from api.store.runs import RunRecord, RunStore
from tests.api.following import ended, get, playing, post, reached, resume, until, worker_of
from tests.starting import Started

RIG = "modbus://127.0.0.1:5020"
HOUR_S = 3600.0
LEASE_S = 20.0
Set = Callable[[float], None]

SHIFTED_SERVER = """
CREATE TABLE clock_shift AS SELECT interval '0 s' AS shift;
CREATE FUNCTION clock_timestamp() RETURNS timestamptz LANGUAGE sql VOLATILE
    AS 'SELECT pg_catalog.clock_timestamp() + shift FROM public.clock_shift';
"""


def shift_server(database: Database, name: str) -> Set:
    """A PostgreSQL database that has a clock of its own, for every connection that is made from now on."""
    with database.engine.begin() as connection:
        connection.exec_driver_sql(SHIFTED_SERVER)
        connection.exec_driver_sql(f'ALTER DATABASE "{name}" SET search_path = public, pg_catalog')
    database.engine.dispose()

    def set_to(ahead_s: float) -> None:
        with database.engine.begin() as connection:
            connection.execute(text("UPDATE clock_shift SET shift = :s * interval '1 s'"), {"s": ahead_s})

    return set_to


def shift_file(database: Database) -> Set:
    """An SQLite database whose clock is this process's, shifted."""
    shift = [0.0]

    def julian_day(when: str) -> float:
        assert when == "now"
        return (datetime.now(UTC).timestamp() + shift[0]) / 86400.0 + 2440587.5

    @event.listens_for(database.engine, "connect")
    def connected(connection: SqliteConnection, record: ConnectionPoolEntry) -> None:
        connection.create_function("julianday", 1, julian_day)

    database.engine.dispose()
    return lambda ahead_s: shift.__setitem__(0, ahead_s)


@pytest.fixture
def set_clock(database: Database) -> Set:
    """Set the database's clock ahead of the true time, or behind it."""
    name = database.engine.url.database or ""
    on_server = database.engine.dialect.name == "postgresql"
    return shift_server(database, name) if on_server else shift_file(database)


def time_of(database: Database) -> float:
    with database.reading() as connection:
        return float(connection.scalar(select(now())) or 0.0)


def test_the_clocks_of_these_tests_can_be_set(database: Database, set_clock: Set) -> None:
    before = time_of(database)
    set_clock(HOUR_S)
    assert time_of(database) - before == pytest.approx(HOUR_S, abs=60.0)
    set_clock(-HOUR_S)
    assert time_of(database) - before == pytest.approx(-HOUR_S, abs=60.0)


@pytest.mark.parametrize("ahead_s", [HOUR_S, -HOUR_S])
def test_a_rig_stays_with_its_worker_and_that_of_a_dead_one_is_free_as_soon_as_ever(
    database: Database, set_clock: Set, pass_time: Callable[[float], None], ahead_s: float
) -> None:
    held = hold_rig(database, RIG, "worker 1", LEASE_S)
    assert held is not None
    pass_time(LEASE_S / 2)
    set_clock(ahead_s)
    assert hold_rig(database, RIG, "worker 2", LEASE_S) is None
    held.keep()
    pass_time(LEASE_S - 1.0)
    assert hold_rig(database, RIG, "worker 2", LEASE_S) is None
    pass_time(1.0)
    assert hold_rig(database, RIG, "worker 2", LEASE_S) is not None


@pytest.mark.parametrize("ahead_s", [HOUR_S, -HOUR_S])
def test_a_job_stays_with_its_worker_and_that_of_a_dead_one_is_closed_as_soon_as_ever(
    database: Database, set_clock: Set, pass_time: Callable[[float], None], ahead_s: float
) -> None:
    jobs = JobStore(database)
    job = jobs.create(kind="fit", name="x", campaign_id="", request={"runs": ["r1"], "held_out": []})
    assert take_next(database, "one", LEASE_S) is not None
    set_clock(ahead_s)
    close_left_open(database, "two")
    assert jobs.one(job.id).state is JobState.RUNNING
    pass_time(LEASE_S)
    close_left_open(database, "two")
    assert jobs.one(job.id).state is JobState.FAILED


class Clock:
    """The steady clock of a keyring."""

    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def keyring(database: Database, clock: Clock, set_clock: Set) -> Keyring:
    """One that reads the store when the test says so."""
    keyring = Keyring(clock)
    keyring._database = database
    keyring.refresh()
    return keyring


def key_for(database: Database, keyring: Keyring, days: float | None = None) -> tuple[str, Identity]:
    key = KeyStore(database).create("Anna", Scope.OPERATE, expires_days=days, created_by="test")[1]
    keyring.refresh()
    identity = keyring.of_key(key)
    assert isinstance(identity, Identity)
    return key, identity


def test_a_key_that_has_ended_is_not_valid_again_when_the_clock_is_set_back(
    database: Database, keyring: Keyring, clock: Clock, set_clock: Set
) -> None:
    key, _ = key_for(database, keyring, days=0.5 * HOUR_S / 86400.0)
    set_clock(-HOUR_S)
    keyring.refresh()
    clock.now_s += 0.5 * HOUR_S - 60.0
    assert isinstance(keyring.of_key(key), Identity)
    clock.now_s += 120.0
    keyring.refresh()
    assert isinstance(keyring.of_key(key), Refused)


def test_a_key_ends_with_the_clock_that_was_set_ahead(
    database: Database, keyring: Keyring, clock: Clock, set_clock: Set
) -> None:
    key, _ = key_for(database, keyring, days=0.5 * HOUR_S / 86400.0)
    set_clock(HOUR_S)
    keyring.refresh()
    assert isinstance(keyring.of_key(key), Refused)


@pytest.mark.parametrize("ahead_s", [HOUR_S, -HOUR_S])
def test_a_session_goes_on_while_it_is_used_and_ends_when_it_idles_whatever_the_clock_says(
    database: Database, keyring: Keyring, clock: Clock, set_clock: Set, ahead_s: float
) -> None:
    _, identity = key_for(database, keyring)
    used, idle = keyring.sign_in(identity), keyring.sign_in(identity)
    assert isinstance(keyring.of_session(used), Identity)
    set_clock(ahead_s)
    for _ in range(9):
        keyring.refresh()
        clock.now_s += IDLE_S / 10
        assert isinstance(keyring.of_session(used), Identity)
    assert isinstance(keyring.of_session(idle, touch=False), Identity)
    clock.now_s += IDLE_S / 5
    keyring.refresh()
    assert isinstance(keyring.of_session(idle, touch=False), Refused)
    assert isinstance(keyring.of_session(used), Identity)


def test_a_session_lasts_no_longer_than_a_shift_also_for_a_service_that_was_started_after_the_clock_was_set_back(
    database: Database, keyring: Keyring, clock: Clock, set_clock: Set
) -> None:
    _, identity = key_for(database, keyring)
    token = keyring.sign_in(identity)
    set_clock(-HOUR_S)
    started = Keyring(clock)
    started._database = database
    for one in (keyring, started):
        one.refresh()
    for _ in range(int(ABSOLUTE_S / IDLE_S * 2) - 1):
        clock.now_s += IDLE_S / 2
        for one in (keyring, started):
            one.refresh()
            assert isinstance(one.of_session(token), Identity)
    clock.now_s += IDLE_S
    for one in (keyring, started):
        assert isinstance(one.of_session(token), Refused)


def test_events_queues_and_runs_keep_their_order(
    database: Database, store: CampaignStore, body: dict[str, Any], set_clock: Set, tmp_path: Path
) -> None:
    made = []
    for ahead_s in (0.0, -HOUR_S, HOUR_S, 0.0):
        set_clock(ahead_s)
        made.append(store.create(NewCampaign(**body)).id)
    held = hold_rig(database, RIG, "worker 1", LEASE_S)
    assert held is not None
    first = held.take_next()
    assert first is not None
    for position, (test, ahead_s) in enumerate((("slow", 0.0), ("fast", -HOUR_S))):
        set_clock(ahead_s)
        held.progress(first, position, "running", 1, "")
        held.add_run(first, a_run(first.id, test, ahead_s))
    assert [first.id, *(one.id for one in rest_of(held))] == made
    texts = [one.text for one in store.events(first.id)]
    assert texts[0] == "accepted"
    assert [words.split()[4] for words in texts if words.startswith("run ")] == ["slow:", "fast:"]
    assert [run.test for run in RunStore(database, tmp_path).of_campaign(first.id)] == ["slow", "fast"]


def rest_of(held: HeldRig) -> list[Any]:
    return list(iter(held.take_next, None))


def a_run(campaign_id: str, test: str, ahead_s: float) -> RunRecord:
    """A run as a worker notes it whose clock is ahead."""
    created = datetime.fromtimestamp(datetime.now(UTC).timestamp() + ahead_s, UTC).isoformat()
    run = RunRecord(
        id=test,
        campaign_id=campaign_id,
        test=test,
        held_out=False,
        status="complete",
        location=f"{campaign_id}/{test}.h5",
        size_bytes=1,
        sha256="0" * 64,
        samples=1,
        sample_rate_hz=1000.0,
        created="",
    )
    return replace(run, created=created)


@pytest.mark.slow
@pytest.mark.postgresql
def test_a_test_runs_on_while_the_clock_of_its_store_jumps_and_a_second_service_waits_for_its_rig(
    postgresql_url: str, rig: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAMPER_RIG_LEASE_S", "3")
    monkeypatch.setenv("DAMPER_RIG_DATABASE_URL", postgresql_url)
    monkeypatch.setenv("DAMPER_RIG_DATA_DIR", str(tmp_path / "lab"))
    with Database(postgresql_url) as database:
        set_clock = shift_server(database, database.engine.url.database or "")
        sine = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "current": 0.5}
        body = {"name": "x", "rig": rig, "specimen": "7", "tests": [{"name": "long", **sine, "cycles": 450}]}
        with Started(["serve", "--port", "0"], tmp_path / "serve.log") as service:
            base = service.wait_until_ready()
            begun = post(base, body)["id"]
            resume(base, rig)
            until(base, begun, playing)
            worker = worker_of(base, rig)
            with Started(["worker", rig], tmp_path / "worker.log"):
                for ahead_s in (HOUR_S, -HOUR_S, HOUR_S):
                    before = samples_of(base, begun)
                    set_clock(ahead_s)
                    # longer than it takes a worker to see the jump, and to take what it believes to be free
                    reached(base, f"/v1/campaigns/{begun}", lambda c, n=before: c["tests"][0]["samples"] > n + 10_000)
                after = until(base, begun, ended)
                assert (after["state"], after["reason"]) == ("done", "")
                assert worker_of(base, rig) == worker


def samples_of(base: str, campaign: str) -> int:
    return int(get(base, f"/v1/campaigns/{campaign}")["tests"][0]["samples"])


READERS_OF_THE_WALL_CLOCK = {
    "api/campaigns/desk.py": "when the state of a rig was seen, to show it",
    "api/campaigns/new_campaign.py": "the date on which a calibration expires",
    "api/campaigns/restarts.py": "when a worker is asked again, to show it",
    "api/campaigns/play.py": "the date on which a calibration expires",
    "api/cli/laboratory.py": "the date on which a calibration expires",
    "api/cli/preparation.py": "the date on which a calibration expires, and the age of a tare",
    "api/jobs/results.py": "the age in days of what an interrupted study has kept: after a jump it begins anew",
    "api/line/service_end.py": "when a worker was lost, to show it",
    "api/store/backup.py": "when a backup was made, to show it",
    "rigctl/foreign_files/imported.py": "when a table of a notebook became a run, to show it",
    "rigctl/procedures/tare.py": "when a tare was measured",
    "rigctl/procedures/weigh.py": "when a mass was measured, to show it",
    "rigctl/recording.py": "when a run was made, to show it",
    "rigctl/rig_check/at_rest.py": "when a protocol was made, to show it",
    "rigctl/runwriter.py": "when an event happened, to show it",
    "rigctl/warm_up.py": "when a warm-up ended, to show it",
}


def test_whoever_reads_the_wall_clock_of_a_host_is_known_and_none_of_them_waits_or_decides_by_it() -> None:
    root = Path(__file__).parents[2]
    found = set()
    for path in (path for package in ("api", "rigctl", "excitation") for path in (root / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and ast.unparse(node) in ("time.time", "datetime.now", "date.today"):
                found.add(path.relative_to(root).as_posix())
    assert found == set(READERS_OF_THE_WALL_CLOCK)
