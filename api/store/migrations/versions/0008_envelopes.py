"""What the rig and the specimen of a campaign can do."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    op.add_column("campaigns", sa.Column("envelopes", sa.JSON(), nullable=False, server_default="[]"))
