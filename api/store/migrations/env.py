"""What Alembic runs for every step: on the connection that the store gives it, in its transaction."""

from __future__ import annotations

from alembic import context

from api.store.tables import METADATA

context.configure(connection=context.config.attributes["connection"], target_metadata=METADATA, render_as_batch=True)
with context.begin_transaction():
    context.run_migrations()
