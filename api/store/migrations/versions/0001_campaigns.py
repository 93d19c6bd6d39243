"""Campaigns, their tests, runs and events, and the leases on rigs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    op.create_table(
        "campaigns",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("rig", sa.Text, nullable=False),
        sa.Column("specimen", sa.Text, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("reason", sa.Text, nullable=False),
        sa.Column("abort_reason", sa.Text),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.Column("started_at_s", sa.Float),
        sa.Column("ended_at_s", sa.Float),
        sa.PrimaryKeyConstraint("number", name="pk_campaigns"),
        sa.UniqueConstraint("id", name="uq_campaigns_id"),
    )
    op.create_index("ix_campaigns_rig_state", "campaigns", ["rig", "state"])
    op.create_table(
        "tests",
        _campaign("tests"),
        sa.Column("position", sa.Integer, nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("config", sa.JSON, nullable=False),
        sa.Column("held_out", sa.Boolean, nullable=False),
        sa.Column("duration_s", sa.Float, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("phase", sa.String(16), nullable=False),
        sa.Column("samples", sa.Integer, nullable=False),
        sa.Column("total_samples", sa.Integer, nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("campaign", "position", name="pk_tests"),
        sa.UniqueConstraint("campaign", "name", name="uq_tests_campaign_name"),
    )
    op.create_table(
        "runs",
        sa.Column("id", sa.String(64), nullable=False),
        _campaign("runs"),
        sa.Column("test", sa.Text, nullable=False),
        sa.Column("held_out", sa.Boolean, nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("location", sa.Text, nullable=False),
        sa.Column("size_bytes", sa.Integer, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("samples", sa.Integer, nullable=False),
        sa.Column("sample_rate_hz", sa.Float, nullable=False),
        sa.Column("created", sa.String(40), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_runs"),
        sa.UniqueConstraint("location", name="uq_runs_location"),
    )
    op.create_index("ix_runs_campaign", "runs", ["campaign"])
    op.create_table(
        "events",
        sa.Column("number", sa.Integer, nullable=False),
        _campaign("events"),
        sa.Column("at_s", sa.Float, nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_events"),
    )
    op.create_index("ix_events_campaign", "events", ["campaign"])
    op.create_table(
        "leases",
        sa.Column("rig", sa.String(512), nullable=False),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("token", sa.Integer, nullable=False),
        sa.Column("expires_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("rig", name="pk_leases"),
    )


def _campaign(table: str) -> sa.Column[int]:
    return sa.Column(
        "campaign",
        sa.Integer,
        sa.ForeignKey("campaigns.number", name=f"fk_{table}_campaign", ondelete="CASCADE"),
        nullable=False,
    )


def downgrade() -> None:
    for table in ("leases", "events", "runs", "tests", "campaigns"):
        op.drop_table(table)
