"""``damper-rig worker``: the process that drives one rig of a service."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["worker"]


def worker(
    rig: Annotated[str, typer.Argument(metavar="RIG", help="Id, serial number, name or address of the rig.")],
    data: Annotated[Path | None, typer.Option(help="Folder of the campaign store and the run files.")] = None,
    database: Annotated[str | None, typer.Option(help="sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME.")] = None,
    config: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Settings; see docs/service.md.")] = None,
    with_parent: Annotated[
        bool, typer.Option(help="End when standard input closes, as it does when the parent process ends.")
    ] = False,
) -> None:
    """Play the campaigns of one rig until Ctrl-C or SIGTERM; prints 'ready RIG' when it holds the rig.

    'damper-rig serve' starts one for every rig; start it yourself where a service manager should do that. Started by
    itself, it pauses the rig's queue until somebody resumes it.

    Example: damper-rig worker modbus://127.0.0.1:5020 --data lab
    """
    import os

    from api.campaigns.worker_process import run_worker
    from api.settings import read_settings

    settings = read_settings(os.environ, config, data_dir=data, database_url=database)
    if with_parent:
        from api.processes.parent import end_with_parent

        end_with_parent()
    told = run_worker(
        settings, rig, supervised=with_parent, on_ready=lambda rig_id: print(f"ready {rig_id}", flush=True)
    )
    raise typer.Exit(told)
