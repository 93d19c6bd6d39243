"""``damper-rig store …``: backups of the store, their restoration, and its check."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.places import to_file

if TYPE_CHECKING:
    from api.store.archive import Manifest
    from api.store.backup import Folders

__all__ = ["store"]

store = typer.Typer(name="store", help="Back up, restore and check the store of a service.", no_args_is_help=True)

Data = Annotated[Path | None, typer.Option(help="Folder of the campaign store and the run files.")]
Address = Annotated[str | None, typer.Option(help="sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME.")]
Config = Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Settings of the service.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")]


@store.command("backup")
def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", callback=to_file, help="The backup, a new file.")],
    data: Data = None,
    database: Address = None,
    config: Config = None,
    without_files: Annotated[
        bool, typer.Option("--without-files", help="List run and result files with their SHA-256; do not copy them.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Back up a store, also while a service uses it: the database at one moment, run files and results.

    The file restores into SQLite and PostgreSQL. It contains what the store does, hashed keys too: keep it safe.

    Example: damper-rig store backup lab-2026-11-21.zip --data lab
    """
    from api.cli.terminal import progress_bar
    from api.store.backup import back_up

    url, folders = _settings(data, database, config)
    with progress_bar("backing up") as bar:
        made = back_up(url, folders, file, with_files=not without_files, tell=bar)
    _print(file, made, as_json)


@store.command("restore")
def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A backup.")],
    data: Data = None,
    database: Address = None,
    config: Config = None,
    as_json: AsJson = False,
) -> None:
    """Fill an empty store from a backup: all of it, checked, or nothing. Queues are paused when a service starts on it.

    Example: damper-rig store restore lab-2026-11-21.zip --data restored
    """
    from api.cli.terminal import progress_bar
    from api.store.restore import restore as restore_backup

    url, folders = _settings(data, database, config)
    with progress_bar("restoring") as bar:
        made = restore_backup(file, url, folders, tell=bar)
    _print(file, made, as_json)


@store.command("check")
def check(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]", help="A backup; default: the store itself.")] = None,
    data: Data = None,
    database: Address = None,
    config: Config = None,
    as_json: AsJson = False,
) -> None:
    """Check a store, or a backup: the database, and every run and result file against its SHA-256. Changes nothing.

    Example: damper-rig store check --data lab
    """
    from dataclasses import asdict

    from api.cli.terminal import answer, progress_bar
    from api.store.check import check as check_store
    from api.store.restore import verify

    with progress_bar("checking") as bar:
        if file is not None:
            _print(file, verify(file, tell=bar), as_json)
            return
        url, folders = _settings(data, database, config)
        found = check_store(url, folders, tell=bar)
    lines = (f"schema {found.schema}, {found.rows} rows, {found.files} files", *found.trouble)
    answer("\n".join(lines), asdict(found), as_json=as_json)
    if found.trouble:
        raise typer.Exit(1)


def _settings(data: Path | None, database: str | None, config: Path | None) -> tuple[str, Folders]:
    import os

    from api.settings import read_settings
    from api.store.backup import Folders

    settings = read_settings(os.environ, config, data_dir=data, database_url=database)
    return settings.store_url, Folders(settings.runs_dir.absolute(), settings.results_dir.absolute())


def _print(file: Path, made: Manifest, as_json: bool) -> None:
    import json

    from api.cli.terminal import answer

    size = sum(one.size_bytes for one in made.files)
    rows = sum(table.rows for table in made.tables.values())
    listed = "" if all(one.included for one in made.files) else ", listed only"
    text = (
        f"{file}: schema {made.schema} of {made.database}, {rows} rows, {len(made.files)} files of {size} bytes{listed}"
    )
    answer("\n".join((text, *made.trouble)), json.loads(made.to_json()), as_json=as_json)
    if made.trouble:
        raise typer.Exit(1)
