"""Rigs with their identity, their queue and their events; campaigns refer to them and can be moved in the queue."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import sqlalchemy as sa
from alembic import op

from rigctl.canonical import canonical_address
from rigctl.errors import RigError

revision = "0010"
down_revision = "0009"


def upgrade() -> None:
    _make_tables()
    op.add_column("campaigns", sa.Column("rig_id", sa.String(32), nullable=False, server_default=""))
    op.add_column("campaigns", sa.Column("place", sa.Integer, nullable=True))
    op.add_column("campaigns", sa.Column("created_by", sa.Text, nullable=False, server_default=""))
    op.create_index("ix_campaigns_rig_id_state", "campaigns", ["rig_id", "state"])
    _register_rigs(op.get_bind())
    op.drop_table("paused_queues")


def _make_tables() -> None:
    op.create_table(
        "rigs",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("key", sa.String(500), nullable=False),
        sa.Column("address", sa.String(500), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("model", sa.Text, nullable=False),
        sa.Column("serial", sa.Text, nullable=False),
        sa.Column("envelope", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("interlocks", sa.JSON, nullable=False),
        sa.Column("out_of_service", sa.Text, nullable=True),
        sa.Column("reserved_by", sa.Text, nullable=True),
        sa.Column("reserved_until_s", sa.Float, nullable=True),
        sa.Column("paused_reason", sa.Text, nullable=True),
        sa.Column("paused_at_s", sa.Float, nullable=True),
        sa.Column("state", sa.String(32), nullable=False),
        sa.Column("state_text", sa.Text, nullable=False),
        sa.Column("state_at_s", sa.Float, nullable=True),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_rigs"),
        sa.UniqueConstraint("key", name="uq_rigs_key"),
        sa.UniqueConstraint("address", name="uq_rigs_address"),
    )
    op.create_table(
        "rig_events",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("rig", sa.String(32), nullable=False),
        sa.Column("at_s", sa.Float, nullable=False),
        sa.Column("who", sa.Text, nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_rig_events"),
        sa.ForeignKeyConstraint(["rig"], ["rigs.id"], name="fk_rig_events_rig", ondelete="CASCADE"),
    )
    op.create_index("ix_rig_events_rig", "rig_events", ["rig"])


def _register_rigs(connection: sa.Connection) -> None:
    """One rig for all spellings of an address that campaigns name; what was paused stays paused."""
    rigs = sa.table("rigs", *(sa.column(name) for name in _columns()))
    rigs.c.interlocks.type = sa.JSON()
    known: dict[str, str] = {}
    for spelling, first_s in connection.execute(
        sa.text("SELECT rig, min(created_at_s) FROM campaigns GROUP BY rig ORDER BY min(number)")
    ).all():
        address = _one_spelling(spelling)
        if address not in known:
            known[address] = uuid4().hex
            connection.execute(rigs.insert().values(**_row(known[address], address, first_s)))
        named = {"id": known[address], "rig": spelling, "address": address}
        connection.execute(sa.text("UPDATE campaigns SET rig_id = :id, rig = :address WHERE rig = :rig"), named)
    for spelling, reason, at_s in connection.execute(
        sa.text("SELECT rig, reason, paused_at_s FROM paused_queues ORDER BY paused_at_s")
    ).all():
        paused = {"reason": reason, "at_s": at_s, "address": _one_spelling(spelling)}
        connection.execute(
            sa.text("UPDATE rigs SET paused_reason = :reason, paused_at_s = :at_s WHERE address = :address"), paused
        )


def _columns() -> tuple[str, ...]:
    return ("id", "key", "address", "name", "model", "serial", "interlocks", "state", "state_text", "created_at_s")


def _row(rig_id: str, address: str, created_at_s: float) -> dict[str, Any]:
    texts = dict.fromkeys(("name", "model", "serial", "state_text"), "")
    at = {"key": address, "address": address, "created_at_s": created_at_s}
    return {"id": rig_id, **at, **texts, "interlocks": [], "state": "unknown"}


def _one_spelling(text: str) -> str:
    try:
        return canonical_address(text)
    except RigError:  # an address that an earlier version accepted: its campaigns stay readable
        return text
