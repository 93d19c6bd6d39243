"""What a campaign's runs are watched for."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    op.add_column("campaigns", sa.Column("interlocks", sa.JSON(), nullable=False, server_default="[]"))
