"""Queues of rigs that are paused until somebody resumes them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"


def upgrade() -> None:
    op.create_table(
        "paused_queues",
        sa.Column("rig", sa.Text, nullable=False),
        sa.Column("reason", sa.Text, nullable=False),
        sa.Column("paused_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("rig", name="pk_paused_queues"),
    )
