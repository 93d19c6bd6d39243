"""What a campaign warms its damper up with."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    op.add_column("campaigns", sa.Column("warm_up", sa.JSON(none_as_null=True), nullable=True))
