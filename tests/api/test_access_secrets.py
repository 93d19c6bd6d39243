"""A key goes into one header and comes back once: no log, answer, error, representation or row of the store has it."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from sqlalchemy import MetaData, insert, select, update
from sqlalchemy.exc import DBAPIError

from api.access.audit import AuditEntry, AuditTrail, audit_page, write_entry
from api.access.identity import Identity
from api.access.keyring import Keyring
from api.access.keys import KeyStore
from api.access.log_limit import LogLimit, Redaction
from api.access.requests import sender
from api.access.rules import RULES
from api.access.scopes import Scope
from api.access.tokens import redacted
from api.app import create_app
from api.errors import StoreError
from api.settings import Settings
from api.store.database import Database
from api.store.tables import audit, sessions
from tests.api.route_paths import path_of
from tests.api.serving import serving

SHOWN_IN_HEADERS = ("/", "/v1/campaigns", "/v1/keys", "/v1/session", "/v1/runs")  # they are read before any route is


@pytest.fixture
def logged() -> Iterator[io.StringIO]:
    """Everything that the process logs, as the service writes it."""
    text = io.StringIO()
    handler = logging.StreamHandler(text)
    handler.setFormatter(Redaction(logging.Formatter("%(levelname)s %(name)s: %(message)s")))
    logging.getLogger().addHandler(handler)
    before = logging.getLogger().level
    logging.getLogger().setLevel(logging.INFO)
    yield text
    logging.getLogger().setLevel(before)
    logging.getLogger().removeHandler(handler)


def test_a_key_on_every_path_into_the_service_comes_out_nowhere(tmp_path: Path, logged: io.StringIO) -> None:
    settings = Settings(data_dir=tmp_path / "lab")
    with Database(settings.store_url) as database:
        admin = KeyStore(database).create("admin", Scope.ADMIN, expires_days=None, created_by="test")[1]
        canary = KeyStore(database).create("canary", Scope.READ, expires_days=None, created_by="test")[1]
    secret = canary.split("_", 2)[2]
    seen = []
    with serving(create_app(settings, with_workers=False)) as client:
        for method, path in RULES:
            if path == "/v1/live":
                continue
            there = path_of(path)
            known = {"authorization": f"Bearer {admin}"}
            attempts: list[dict[str, Any]] = [
                {"url": f"{there}?{canary}={canary}", "headers": known},
                {"url": there.replace("0" * 32, quote(canary)), "headers": known},
                {"url": there, "headers": known, "json": {canary: canary, "name": canary}},
            ]
            if path in SHOWN_IN_HEADERS:
                attempts += [
                    {"url": there, "headers": {"authorization": f"Bearer {canary}"}, "content": b"{"},
                    {"url": there, "headers": {"authorization": f"Bearer {canary}x"}},
                    {"url": there, "headers": {"authorization": f"Basic {canary}"}},
                    {"url": there, "headers": {"cookie": f"damper-rig-session={canary}", "origin": canary}},
                    {"url": there, "headers": {**known, "content-type": canary}, "content": b"x"},
                    {"url": there, "headers": {"host": canary}},
                ]
            for attempt in attempts:
                answer = client.request(method, **attempt)
                client.cookies.clear()
                seen.append((method, attempt["url"], answer.status_code, answer.text + str(answer.headers)))
        assert client.post("/v1/session", headers={"authorization": f"Bearer {canary}"}).status_code in (201, 429)
    for method, url, status, text in seen:
        if status >= 400:
            assert secret not in text, (method, url, status)
            assert secret[:12] not in text, (method, url, status)  # cut off, it is still most of a key
    assert secret[:12] not in logged.getvalue()
    assert logged.getvalue()
    with Database(settings.store_url) as database, database.reading() as connection:
        found = MetaData()
        found.reflect(connection)
        for table in found.tables.values():
            assert secret not in str(connection.execute(select(table)).all())


def test_what_holds_a_secret_does_not_show_it(tmp_path: Path) -> None:
    with Database(f"sqlite:///{tmp_path / 'x.db'}") as database:
        record, text = KeyStore(database).create("x", Scope.READ, expires_days=1.0, created_by="test")
        keyring = Keyring()
        keyring.open(database)
        identity = keyring.of_key(text)
        assert isinstance(identity, Identity)
        token = keyring.sign_in(identity)
        keyring.close()
        scope = {"headers": [(b"authorization", f"Bearer {text}".encode()), (b"cookie", token.encode())]}
        shown = f"{record!r} {identity!r} {keyring._snapshot!r} {sender(scope)!r} {KeyStore(database)!r}"
        assert "dr_" not in shown
        assert token not in shown
        assert text.split("_", 2)[2] not in shown
        with database.reading() as connection:
            for digest in [row.digest for row in connection.execute(select(sessions))]:
                assert digest not in shown


def test_a_traceback_is_logged_without_keys() -> None:
    text = io.StringIO()
    handler = logging.StreamHandler(text)
    handler.setFormatter(Redaction(logging.Formatter("%(message)s")))
    logger = logging.Logger("canary")
    logger.addHandler(handler)
    canary = f"dr_{'0' * 12}_{'S' * 43}"
    try:
        raise ValueError(canary)
    except ValueError:
        logger.exception("failed with %s", canary)
    assert "ValueError" in text.getvalue()
    assert "SSSS" not in text.getvalue()
    assert redacted("rig dr_7 stays") == "rig dr_7 stays"


def test_a_flood_of_one_kind_is_a_few_lines_and_a_count() -> None:
    now = [0.0]
    limit = LogLimit(interval_s=10.0, most=3, clock=lambda: now[0])

    def passes(message: str, *values: object, name: str = "x") -> logging.LogRecord | None:
        record = logging.LogRecord(name, logging.WARNING, "", 0, message, values, None)
        return record if limit.filter(record) else None

    assert sum(passes("peer %s failed", k) is not None for k in range(1000)) == 3
    assert passes("something else") is not None
    assert all(passes("by %s", k, name="damper_rig.audit") for k in range(10))
    now[0] = 11.0
    later = passes("peer %s failed", 7)
    assert later is not None
    assert later.getMessage() == "peer 7 failed (and 997 more like it before)"


ENTRY = AuditEntry(who="Anna", address="127.0.0.1", action="campaign.stop", target="/v1/campaigns/1/stop", status=202)


def test_the_audit_log_cannot_be_rewritten(database: Database) -> None:
    write_entry(database, ENTRY)
    for change in (update(audit).values(who="nobody"), audit.delete()):
        with pytest.raises((StoreError, DBAPIError), match="append only"), database.writing() as connection:
            connection.execute(change)
    [kept] = audit_page(database, limit=10)
    assert (kept.who, kept.action, kept.status) == ("Anna", "campaign.stop", 202)
    with database.writing() as connection:
        connection.execute(insert(audit).values(**{**{c.name: getattr(kept, c.name) for c in audit.c}, "number": 7}))
    assert [one.number for one in audit_page(database, limit=10)] == [7, kept.number]


def test_entries_wait_while_the_store_is_away_and_are_dated_when_they_happened(tmp_path: Path) -> None:
    now = [100.0]
    trail = AuditTrail(clock=lambda: now[0])
    trail.note(ENTRY)  # no store yet: nothing is lost, nothing waits
    now[0] = 160.0
    with Database(f"sqlite:///{tmp_path / 'x.db'}") as database:
        trail._database = database
        trail.write()
        write_entry(database, ENTRY)
        after, before = audit_page(database, limit=10)
        assert after.at_s - before.at_s == pytest.approx(60.0, abs=30.0)


def test_an_entry_is_one_line_without_keys() -> None:
    entry = AuditEntry(who="a\nb", address="x" * 500, action="a", target=f"dr_{'0' * 12}_{'S' * 43}")
    assert (entry.who, len(entry.address)) == ("a\\nb", 200)
    assert "SSSS" not in entry.target
