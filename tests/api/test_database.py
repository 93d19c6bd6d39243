"""The database of the store: opened, migrated, refused; SQLite and PostgreSQL alike."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import Connection, MetaData, create_engine, select, text

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import CampaignStore
from api.cli.main import main
from api.errors import NewerStore, SettingsError, StoreError
from api.store.clock import now
from api.store.database import Database
from api.store.tables import METADATA


def test_the_migrations_build_exactly_the_tables_that_the_store_uses(database: Database) -> None:
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), METADATA) == []


def test_a_connection_that_is_in_use_while_a_store_is_closed_is_closed_when_it_is_given_back(database_url: str) -> None:
    with Database(database_url) as database, database.reading() as connection:
        driven = connection.connection.dbapi_connection
        assert driven is not None
        database.close()
        assert connection.execute(text("SELECT 1")).scalar() == 1
    with pytest.raises(Exception, match="clos"):
        driven.cursor()


def test_opening_a_store_again_keeps_what_it_holds(database_url: str, body: dict[str, Any]) -> None:
    with Database(database_url) as database:
        campaign = CampaignStore(database).create(NewCampaign(**body))
    with Database(database_url) as database:
        assert CampaignStore(database).campaign(campaign.id) == campaign


def test_a_store_of_a_later_program_is_refused_in_one_line_and_stays_as_it_is(
    database_url: str, body: dict[str, Any]
) -> None:
    with Database(database_url) as database:
        CampaignStore(database).create(NewCampaign(**body))
        with database.writing() as connection:
            connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
            before = _content(connection)
    with pytest.raises(NewerStore, match="later version") as caught:
        Database(database_url)
    assert "\n" not in str(caught.value)
    engine = create_engine(database_url)
    with engine.connect() as connection:
        assert _content(connection) == before
    engine.dispose()


def test_the_service_does_not_start_on_a_store_of_a_later_program(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Database(f"sqlite:///{tmp_path / 'damper-rig.db'}") as database, database.writing() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    assert main(["serve", "--data", str(tmp_path), "--port", "0"]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "later version of damper-rig" in said.err


def _content(connection: Connection) -> dict[str, list[Any]]:
    """Every row of every table that is there."""
    found = MetaData()
    found.reflect(connection)
    return {name: sorted(map(str, connection.execute(select(table)))) for name, table in found.tables.items()}


@pytest.mark.parametrize("url", ["sqlite://", "sqlite:///:memory:", "mysql://x", "nonsense"])
def test_a_database_that_cannot_keep_campaigns_is_refused(url: str) -> None:
    with pytest.raises(SettingsError):
        Database(url)


def test_a_server_that_does_not_answer_is_a_store_error_in_one_line() -> None:
    with pytest.raises(StoreError) as caught:
        Database("postgresql+psycopg://someone:secret@127.0.0.1:1/none")
    assert "\n" not in str(caught.value)
    assert "secret" not in str(caught.value)


def test_times_are_those_of_the_database_whatever_the_clock_of_the_host_says(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = time.time()
    monkeypatch.setattr(time, "time", lambda: real + 1e6)
    with database.reading() as connection:
        found = connection.scalar(select(now()))
    assert found == pytest.approx(real, abs=60.0)
    assert isinstance(found, float)
