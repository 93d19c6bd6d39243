"""Leases without a clock: they count their renewals. Earlier ones end: their holders work with an earlier schema."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"


def upgrade() -> None:
    op.drop_table("leases")
    op.create_table(
        "leases",
        sa.Column("resource", sa.String(512), nullable=False),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("token", sa.String(32), nullable=False),
        sa.Column("renewals", sa.Integer, nullable=False),
        sa.Column("length_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("resource", name="pk_leases"),
    )
