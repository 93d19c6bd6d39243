"""What is inserted with one statement reads back as it was, whatever it is and on every database."""

from __future__ import annotations

from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import delete, event, select

from api.store.clock import now
from api.store.database import Database
from api.store.many_rows import ManyRows
from api.store.tables import designs

ROWS = ManyRows(
    designs,
    ("id", "name", "tests", "warm_up", "duration_s", "sha256"),
    computed={"created_at_s": now()},
    returning=("id", "number"),
)
TEXTS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**53), 2**53)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=10,
)
OBJECTS = st.dictionaries(TEXTS, VALUES, max_size=3)


@st.composite
def rows(draw: st.DrawFn) -> list[dict[str, Any]]:
    return [
        {
            "id": f"{k}",
            "name": f"{k}{draw(TEXTS)}",
            "tests": draw(st.lists(OBJECTS, max_size=3)),
            "warm_up": draw(st.none() | OBJECTS),
            "duration_s": draw(st.floats(0.0, 1e300)),
            "sha256": draw(st.sampled_from(["", "a", "'; --", "\\", "{}"])),
        }
        for k in range(draw(st.integers(1, 4)))
    ]


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(rows())
def test_every_value_reads_back(database: Database, written: list[dict[str, Any]]) -> None:
    with database.writing() as connection:
        connection.execute(delete(designs))
        numbers = {row.id: row.number for row in ROWS.insert(connection, written)}
        read = {row.id: row._asdict() for row in connection.execute(select(designs))}
    assert [{key: read[one["id"]][key] for key in one} for one in written] == written
    assert {key: one["number"] for key, one in read.items()} == numbers
    assert all(one["created_at_s"] > 1e9 for one in read.values())


def test_no_warm_up_is_null_and_not_the_text_null(database: Database) -> None:
    row = {"id": "a", "name": "a", "tests": [], "warm_up": None, "duration_s": 1.0, "sha256": ""}
    with database.writing() as connection:
        ROWS.insert(connection, [row])
        assert connection.scalar(select(designs.c.id).where(designs.c.warm_up.is_(None))) == "a"


def test_many_rows_are_one_statement_of_the_database(database: Database) -> None:
    sent: list[str] = []
    event.listen(database.engine, "before_cursor_execute", lambda *given: sent.append(given[2]))
    row = {"tests": [], "warm_up": None, "duration_s": 1.0, "sha256": ""}
    with database.writing() as connection:
        sent.clear()
        ROWS.insert(connection, [{**row, "id": str(k), "name": str(k)} for k in range(300)])
    assert len(sent) == 1
