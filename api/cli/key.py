"""``damper-rig key``: make, list and revoke keys, directly in the store of a service."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.access.scopes import Scope

if TYPE_CHECKING:
    from api.store.database import Database

__all__ = ["key"]

key = typer.Typer(name="key", help="Make, list and revoke the keys of a service.", no_args_is_help=True)

DataOption = Annotated[Path | None, typer.Option(help="Data folder of the service.")]
DatabaseOption = Annotated[
    str | None, typer.Option(help="sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME, as for serve.")
]
ConfigOption = Annotated[Path | None, typer.Option("--config", metavar="FILE.toml", help="Settings of the service.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@key.command()
def create(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Whose key it is, or what for.")],
    scope: Annotated[Scope, typer.Option(help="What it allows; each allows also what stands before it.")],
    days: Annotated[float, typer.Option(help="Days until it expires; 0: never.")] = 365.0,
    data: DataOption = None,
    database: DatabaseOption = None,
    config: ConfigOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a key and print it, this once: only a digest of it is stored.

    As soon as a service has a key, every request needs one. A running service knows the key after a second.

    Example: damper-rig key create "Anna Berg" --scope admin --data lab
    """
    import sys

    from api.access.keys import KeyStore
    from api.cli.terminal import answer

    with _opened(data, database, config) as store:
        made, text = KeyStore(store).create(
            name, scope, expires_days=days or None, created_by=f"command line ({_user()})"
        )
        _note(store, "key.create", made.id)
    print(f"key {made.id}, {made.scope}: keep it, it is not shown again", file=sys.stderr)
    answer(text, {"id": made.id, "name": made.name, "scope": str(made.scope), "key": text}, as_json=as_json)


@key.command("list")
def list_keys(
    data: DataOption = None, database: DatabaseOption = None, config: ConfigOption = None, as_json: JsonOption = False
) -> None:
    """List all keys, also revoked and expired ones.

    Example: damper-rig key list --data lab
    """
    from dataclasses import asdict
    from datetime import UTC, datetime

    from api.access.keys import KeyStore
    from api.cli.terminal import answer

    def day(seconds: float | None) -> str:
        return "never" if seconds is None else datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d")

    with _opened(data, database, config) as store:
        found = KeyStore(store).every()
    lines = [
        f"{one.id}  {one.scope:<8}  {one.name}: expires {day(one.expires_at_s)}, used {day(one.used_at_s)}"
        + (f", revoked {day(one.revoked_at_s)}" if one.revoked_at_s is not None else "")
        for one in found
    ]
    answer("\n".join(lines) or "there is no key yet", [asdict(one) for one in found], as_json=as_json)


@key.command()
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="As 'damper-rig key list' shows it.")],
    data: DataOption = None,
    database: DatabaseOption = None,
    config: ConfigOption = None,
    as_json: JsonOption = False,
) -> None:
    """Revoke a key and the sessions that were opened with it; a running service refuses them within 5 s.

    Example: damper-rig key revoke 0123456789ab --data lab
    """
    from api.access.keys import KeyStore
    from api.cli.terminal import answer

    with _opened(data, database, config) as store:
        revoked = KeyStore(store).revoke(key_id)
        _note(store, "key.revoke", revoked.id)
    text = f"key {revoked.id} ({revoked.name}) is revoked"
    answer(text, {"id": revoked.id, "name": revoked.name, "revoked": True}, as_json=as_json)


def _opened(data: Path | None, database: str | None, config: Path | None) -> Database:
    import os

    from api.settings import read_settings
    from api.store.database import Database

    return Database(read_settings(os.environ, config, data_dir=data, database_url=database).store_url)


def _note(store: Database, action: str, key_id: str) -> None:
    from api.access.audit import AuditEntry, write_entry

    write_entry(
        store, AuditEntry(who=f"command line ({_user()})", address="local", action=action, target=f"key {key_id}")
    )


def _user() -> str:
    """The account of this machine that runs the command."""
    import getpass

    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "unknown account"
