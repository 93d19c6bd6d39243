"""What was asked of a running campaign: hold, stop, abort."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    op.add_column("campaigns", sa.Column("asked", sa.String(16), nullable=False, server_default=""))
