"""``damper-rig serve``: the REST service and its live page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["serve"]


def serve(
    data: Annotated[Path | None, typer.Option(help="Folder of the campaign store and the run files.")] = None,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; 0 chooses a free port.")] = None,
    database: Annotated[str | None, typer.Option(help="sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME.")] = None,
    with_parent: Annotated[
        bool, typer.Option(help="End when standard input closes, as it does when the parent process ends.")
    ] = False,
) -> None:
    """Run the service until Ctrl-C or SIGTERM; prints 'ready URL' when it accepts connections.

    Every option can also be given in the environment: DAMPER_RIG_DATA_DIR, _HOST, _PORT, _DATABASE_URL, and
    DAMPER_RIG_LEASE_S, _POLL_S, _STOP_S, _KEEP_RESULTS_DAYS. Jobs use DAMPER_RIG_WORKERS and DAMPER_RIG_EXECUTOR.

    Example: damper-rig serve --data lab --port 8420
    """
    import os

    from api.serving import serve_until_stopped
    from api.settings import read_settings

    settings = read_settings(os.environ, data_dir=data, host=host, port=port, database_url=database)
    if with_parent:
        from api.processes.parent import end_with_parent

        end_with_parent()
    raise typer.Exit(serve_until_stopped(settings, on_ready=lambda url: print(f"ready {url}", flush=True)))
