"""Explanations of gaps, and run files that came from elsewhere."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    op.create_table(
        "uploads",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("location", sa.Text, nullable=False),
        sa.Column("size_bytes", sa.Integer, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("specimen", sa.Text, nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("samples", sa.Integer, nullable=False),
        sa.Column("sample_rate_hz", sa.Float, nullable=False),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_uploads"),
    )
    op.create_table(
        "explanations",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("campaign", sa.String(32), nullable=True),
        sa.Column("model", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("runs", sa.JSON, nullable=False),
        sa.Column("held_out", sa.JSON, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("phase", sa.Text, nullable=False),
        sa.Column("done", sa.Float, nullable=False),
        sa.Column("reason", sa.Text, nullable=False),
        sa.Column("verdict", sa.String(32), nullable=False),
        sa.Column("effects", sa.JSON, nullable=False),
        sa.Column("cancel_reason", sa.Text, nullable=True),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("expires_at_s", sa.Float, nullable=False),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.Column("started_at_s", sa.Float, nullable=True),
        sa.Column("ended_at_s", sa.Float, nullable=True),
        sa.PrimaryKeyConstraint("number", name="pk_explanations"),
        sa.UniqueConstraint("id", name="uq_explanations_id"),
    )
    op.create_index("ix_explanations_state", "explanations", ["state"])
