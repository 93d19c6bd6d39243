"""One table of jobs of every kind, where there was one of explanations; one table of leases on rigs and on jobs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"

_LEASES = sa.table("leases", *map(sa.column, ("resource", "owner", "token", "expires_at_s")))


def upgrade() -> None:
    connection = op.get_bind()
    on_rigs = connection.execute(sa.text("SELECT rig, owner, token, expires_at_s FROM leases")).all()
    op.drop_table("leases")
    op.create_table(
        "leases",
        sa.Column("resource", sa.String(512), nullable=False),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("token", sa.String(32), nullable=False),
        sa.Column("expires_at_s", sa.Float, nullable=False),
        sa.PrimaryKeyConstraint("resource", name="pk_leases"),
    )
    rows = [
        {"resource": f"rig {row.rig}", "owner": row.owner, "token": str(row.token), "expires_at_s": row.expires_at_s}
        for row in on_rigs
    ]
    if rows:
        connection.execute(_LEASES.insert(), rows)
    _create_jobs()
    _copy_explanations(connection)
    op.drop_table("explanations")


def _create_jobs() -> None:
    op.create_table(
        "jobs",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("campaign", sa.String(32), nullable=True),
        sa.Column("request", sa.JSON, nullable=False),
        sa.Column("result", sa.JSON, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("phase", sa.Text, nullable=False),
        sa.Column("done", sa.Float, nullable=False),
        sa.Column("reason", sa.Text, nullable=False),
        sa.Column("cancel_reason", sa.Text, nullable=True),
        sa.Column("created_at_s", sa.Float, nullable=False),
        sa.Column("started_at_s", sa.Float, nullable=True),
        sa.Column("ended_at_s", sa.Float, nullable=True),
        sa.Column("removed_at_s", sa.Float, nullable=True),
        sa.PrimaryKeyConstraint("number", name="pk_jobs"),
        sa.UniqueConstraint("id", name="uq_jobs_id"),
    )
    op.create_index("ix_jobs_state", "jobs", ["state"])


def _copy_explanations(connection: sa.Connection) -> None:
    """Each explanation becomes a job of its number and id; one that runs stays under the lease of its service."""
    explanations = sa.Table("explanations", sa.MetaData(), autoload_with=connection)
    jobs = sa.Table("jobs", sa.MetaData(), autoload_with=connection)
    same = [column.name for column in jobs.columns if column.name in explanations.columns]
    for old in connection.execute(sa.select(explanations).order_by(explanations.c.number)).all():
        connection.execute(
            jobs.insert().values(
                **{name: getattr(old, name) for name in same},
                kind="explain",
                request={"model": old.model, "runs": old.runs, "held_out": old.held_out},
                result={"verdict": old.verdict, "effects": old.effects} if old.state == "done" else {},
            )
        )
        if old.state == "running":
            values = {"owner": old.owner, "token": old.owner[-32:], "expires_at_s": old.expires_at_s}
            connection.execute(_LEASES.insert().values(resource=f"job {old.id}", **values))
    if connection.dialect.name == "postgresql":  # its counter knows nothing of numbers that were given
        connection.execute(
            sa.text("SELECT setval(pg_get_serial_sequence('jobs', 'number'), (SELECT max(number) FROM jobs))")
        )
