"""The tables of the store; ``migrations`` builds them step by step."""

from __future__ import annotations

from sqlalchemy import (
    JSON,
    Boolean,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

__all__ = ["METADATA", "campaigns", "events", "jobs", "leases", "runs", "tests", "uploads"]

METADATA = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)

campaigns = Table(
    "campaigns",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("id", String(32), nullable=False, unique=True),
    Column("name", Text, nullable=False),
    Column("rig", Text, nullable=False),
    Column("specimen", Text, nullable=False),
    Column("warm_up", JSON(none_as_null=True), nullable=True),
    Column("interlocks", JSON, nullable=False, server_default="[]"),
    Column("state", String(16), nullable=False),
    Column("reason", Text, nullable=False),
    Column("asked", String(16), nullable=False, server_default=""),  # hold, stop or abort, while it runs
    Column("abort_reason", Text, nullable=True),  # of a stop or an abort that was requested while it runs
    Column("created_at_s", Float, nullable=False),
    Column("started_at_s", Float, nullable=True),
    Column("ended_at_s", Float, nullable=True),
    Index(None, "rig", "state"),
)

tests = Table(
    "tests",
    METADATA,
    Column("campaign", ForeignKey("campaigns.number", ondelete="CASCADE"), primary_key=True),
    Column("position", Integer, primary_key=True, autoincrement=False),
    Column("name", Text, nullable=False),
    Column("config", JSON, nullable=False),
    Column("held_out", Boolean, nullable=False),
    Column("duration_s", Float, nullable=False),
    Column("state", String(16), nullable=False),
    Column("phase", String(16), nullable=False),
    Column("samples", Integer, nullable=False),
    Column("total_samples", Integer, nullable=False),
    Column("text", Text, nullable=False),
    UniqueConstraint("campaign", "name"),
)

runs = Table(
    "runs",
    METADATA,
    Column("id", String(64), primary_key=True),
    Column("campaign", ForeignKey("campaigns.number", ondelete="CASCADE"), nullable=False, index=True),
    Column("test", Text, nullable=False),
    Column("held_out", Boolean, nullable=False),
    Column("status", String(16), nullable=False),
    Column("location", Text, nullable=False, unique=True),
    Column("size_bytes", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("samples", Integer, nullable=False),
    Column("sample_rate_hz", Float, nullable=False),
    Column("created", String(40), nullable=False),
)

events = Table(
    "events",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("campaign", ForeignKey("campaigns.number", ondelete="CASCADE"), nullable=False, index=True),
    Column("at_s", Float, nullable=False),
    Column("text", Text, nullable=False),
)

leases = Table(
    "leases",
    METADATA,
    Column("resource", String(512), primary_key=True),  # for example "rig modbus://127.0.0.1:5020", "job 6f…"
    Column("owner", Text, nullable=False),
    Column("token", String(32), nullable=False),  # new with every holder
    Column("expires_at_s", Float, nullable=False),  # if it is not renewed until then, its holder is dead
)

uploads = Table(
    "uploads",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("name", Text, nullable=False),
    Column("location", Text, nullable=False),
    Column("size_bytes", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("specimen", Text, nullable=False),
    Column("status", String(16), nullable=False),
    Column("samples", Integer, nullable=False),
    Column("sample_rate_hz", Float, nullable=False),
    Column("created_at_s", Float, nullable=False),
)

jobs = Table(
    "jobs",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("id", String(32), nullable=False, unique=True),
    Column("kind", String(32), nullable=False),
    Column("name", Text, nullable=False),
    Column("campaign", String(32), nullable=True),  # id of the campaign of the runs, where they are of one campaign
    Column("request", JSON, nullable=False),  # ids of the runs, and the options of the kind
    Column("result", JSON, nullable=False),  # the figures of the result; its files are in the result folder
    Column("state", String(16), nullable=False),
    Column("phase", Text, nullable=False),
    Column("done", Float, nullable=False),
    Column("reason", Text, nullable=False),
    Column("cancel_reason", Text, nullable=True),  # of a cancellation that was requested while it runs
    Column("created_at_s", Float, nullable=False),
    Column("started_at_s", Float, nullable=True),
    Column("ended_at_s", Float, nullable=True),
    Column("removed_at_s", Float, nullable=True),  # when the files of its result were removed
    Index(None, "state"),
)
