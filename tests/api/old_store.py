"""A store that commit b0abd5a wrote (schema 0005), on either database."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from sqlalchemy import create_engine

STORES = Path(__file__).parent / "stores"
DONE = f"{1:032x}"  # id of the first campaign


def load(url: str) -> None:
    """Fill an empty database with what b0abd5a wrote."""
    kind = url.split(":")[0].split("+")[0]
    script = (STORES / f"b0abd5a.{kind}.sql").read_text()
    if kind == "sqlite":
        path = Path(url.removeprefix("sqlite:///"))
        path.parent.mkdir(parents=True)
        with sqlite3.connect(path) as connection:
            connection.executescript(script)
        connection.close()
        return
    engine = create_engine(url)
    with engine.begin() as server:
        server.exec_driver_sql(script)
    engine.dispose()
