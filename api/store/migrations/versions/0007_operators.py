"""What is in the rig for a campaign, and what a campaign asks its operator."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    op.add_column("campaigns", sa.Column("setup", sa.JSON(), nullable=False, server_default="{}"))
    op.add_column("campaigns", sa.Column("question", sa.Text(), nullable=False, server_default=""))
    op.add_column("campaigns", sa.Column("answer", sa.Text(), nullable=True))
