"""Idempotency keys, stored designs and models, and runs of which only the record is left."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"


def upgrade() -> None:
    op.create_table(
        "idempotency_keys",
        sa.Column("key", sa.String(255), nullable=False),
        sa.Column("address", sa.String(200), nullable=False),
        sa.Column("fingerprint", sa.String(64), nullable=False),
        sa.Column("status", sa.Integer, nullable=False),
        sa.Column("location", sa.Text, nullable=False),
        sa.Column("answer", sa.Text, nullable=False),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("key", "address", name="pk_idempotency_keys"),
    )
    op.create_index("ix_idempotency_keys_created_at_s", "idempotency_keys", ["created_at_s"])
    op.create_table(
        "designs",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("tests", sa.JSON, nullable=False),
        sa.Column("warm_up", sa.JSON, nullable=True),
        sa.Column("duration_s", sa.Float, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_designs"),
        sa.UniqueConstraint("id", name="uq_designs_id"),
        sa.UniqueConstraint("name", name="uq_designs_name"),
    )
    op.create_table(
        "models",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("kind", sa.Text, nullable=False),
        sa.Column("content", sa.Text, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_models"),
        sa.UniqueConstraint("id", name="uq_models_id"),
    )
    op.add_column("runs", sa.Column("removed_at_s", sa.Float, nullable=True))
    op.add_column("uploads", sa.Column("test", sa.Text, nullable=False, server_default=""))
    op.add_column("uploads", sa.Column("removed_at_s", sa.Float, nullable=True))
