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

__all__ = [
    "METADATA",
    "audit",
    "campaigns",
    "designs",
    "events",
    "idempotency_keys",
    "jobs",
    "keys",
    "leases",
    "models",
    "rig_events",
    "rigs",
    "runs",
    "samples",
    "sessions",
    "tests",
    "uploads",
]

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
    Column("rig", Text, nullable=False),  # the address that it had when the campaign was accepted
    Column("rig_id", String(32), nullable=False, server_default=""),
    Column("place", Integer, nullable=True),  # in the queue, instead of the number, once somebody has moved it
    Column("created_by", Text, nullable=False, server_default=""),
    Column("specimen", Text, nullable=False),
    Column("warm_up", JSON(none_as_null=True), nullable=True),
    Column("interlocks", JSON, nullable=False, server_default="[]"),
    Column("envelopes", JSON, nullable=False, server_default="[]"),
    Column("setup", JSON, nullable=False, server_default="{}"),
    Column("question", Text, nullable=False, server_default=""),  # to the operator, while it waits for an answer
    Column("answer", Text, nullable=True),
    Column("state", String(16), nullable=False),
    Column("reason", Text, nullable=False),
    Column("asked", String(16), nullable=False, server_default=""),  # hold, stop or abort, while it runs
    Column("abort_reason", Text, nullable=True),  # of a stop or an abort that was requested while it runs
    Column("created_at_s", Float, nullable=False),
    Column("started_at_s", Float, nullable=True),
    Column("ended_at_s", Float, nullable=True),
    Index(None, "rig", "state"),
    Index(None, "rig_id", "state"),
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
    Column("removed_at_s", Float, nullable=True),  # when its file was removed
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
    Column("renewals", Integer, nullable=False),  # who sees no change of it for length_s takes its holder for dead
    Column("length_s", Float, nullable=False),
)

rigs = Table(
    "rigs",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("key", String(500), nullable=False, unique=True),  # which rig it is: see api.campaigns.rigs.rig_key
    Column("address", String(500), nullable=False, unique=True),  # in its one spelling
    Column("name", Text, nullable=False),
    Column("model", Text, nullable=False),
    Column("serial", Text, nullable=False),  # empty: the rig has not answered yet
    Column("envelope", JSON(none_as_null=True), nullable=True),
    Column("interlocks", JSON, nullable=False),
    Column("out_of_service", Text, nullable=True),  # the reason
    Column("reserved_by", Text, nullable=True),
    Column("reserved_until_s", Float, nullable=True),
    Column("paused_reason", Text, nullable=True),  # no campaign starts until somebody resumes the queue
    Column("paused_at_s", Float, nullable=True),
    Column("state", String(32), nullable=False),  # as its worker saw it last
    Column("state_text", Text, nullable=False),
    Column("state_at_s", Float, nullable=True),
    Column("created_at_s", Float, nullable=False),
)

rig_events = Table(
    "rig_events",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("rig", ForeignKey("rigs.id", ondelete="CASCADE"), nullable=False, index=True),
    Column("at_s", Float, nullable=False),
    Column("who", Text, nullable=False),  # empty: the service
    Column("text", Text, nullable=False),
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
    Column("test", Text, nullable=False, server_default=""),
    Column("removed_at_s", Float, nullable=True),  # when its file was removed
)

idempotency_keys = Table(
    "idempotency_keys",
    METADATA,
    Column("key", String(255), primary_key=True),  # as the client gave it
    Column("address", String(200), primary_key=True),  # method and path
    Column("fingerprint", String(64), nullable=False),  # SHA-256 of person, query and body
    Column("status", Integer, nullable=False),
    Column("location", Text, nullable=False),
    Column("answer", Text, nullable=False),
    Column("created_at_s", Float, nullable=False, index=True),
)

designs = Table(
    "designs",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("id", String(32), nullable=False, unique=True),
    Column("name", String(200), nullable=False, unique=True),
    Column("tests", JSON, nullable=False),  # configurations of tests
    Column("warm_up", JSON(none_as_null=True), nullable=True),
    Column("duration_s", Float, nullable=False),
    Column("sha256", String(64), nullable=False),  # of tests and warm_up
    Column("created_at_s", Float, nullable=False),
)

samples = Table(
    "samples",
    METADATA,
    Column("sha256", String(64), primary_key=True),  # of the excitation file
    Column("location", Text, nullable=False, unique=True),
    Column("size_bytes", Integer, nullable=False),
    Column("created_at_s", Float, nullable=False),
)

models = Table(
    "models",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("id", String(32), nullable=False, unique=True),
    Column("name", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("content", Text, nullable=False),  # the model file
    Column("sha256", String(64), nullable=False),
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

keys = Table(
    "keys",
    METADATA,
    Column("id", String(16), primary_key=True),
    Column("name", Text, nullable=False),
    Column("scope", String(16), nullable=False),
    Column("digest", String(64), nullable=False),  # of its secret, which is nowhere
    Column("created_at_s", Float, nullable=False),
    Column("created_by", Text, nullable=False),
    Column("expires_at_s", Float, nullable=True),
    Column("used_at_s", Float, nullable=True),  # to about a minute
    Column("revoked_at_s", Float, nullable=True),
)

sessions = Table(
    "sessions",
    METADATA,
    Column("digest", String(64), primary_key=True),
    Column("key_id", ForeignKey("keys.id", ondelete="CASCADE"), nullable=False, index=True),
    Column("created_at_s", Float, nullable=False),
    Column("seen_at_s", Float, nullable=False),  # to about a minute
)

audit = Table(  # append only: triggers refuse to change or delete a row
    "audit",
    METADATA,
    Column("number", Integer, primary_key=True),
    Column("at_s", Float, nullable=False),
    Column("who", Text, nullable=False),
    Column("key_id", String(16), nullable=False),  # empty: local, or the command line
    Column("address", Text, nullable=False),
    Column("action", String(64), nullable=False),
    Column("target", Text, nullable=False),
    Column("status", Integer, nullable=False),  # of HTTP
    Column("outcome", Text, nullable=False),
)
