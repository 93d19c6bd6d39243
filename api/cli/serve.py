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
    envelope: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RIG.toml", help="What the rig can do: every campaign is checked against it, also while it moves."
        ),
    ] = None,
    config: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Settings; see docs/service.md.")] = None,
    print_config: Annotated[
        bool, typer.Option("--print-config", help="Print the settings that would be used, and end.")
    ] = False,
    with_parent: Annotated[
        bool, typer.Option(help="End when standard input closes, as it does when the parent process ends.")
    ] = False,
) -> None:
    """Run the service until Ctrl-C or SIGTERM; prints 'ready URL' when it accepts connections.

    A setting is taken from the command line, else from the environment (DAMPER_RIG_PORT, …), else from FILE.toml
    (port = …; also named by DAMPER_RIG_CONFIG), else it has its default. Jobs use DAMPER_RIG_WORKERS and
    DAMPER_RIG_EXECUTOR.

    Example: damper-rig serve --data lab --port 8420
    """
    import os

    from api.settings import as_toml, read_settings

    given = os.pathsep.join(str(file) for file in envelope) if envelope else None
    settings = read_settings(
        os.environ, config, data_dir=data, host=host, port=port, database_url=database, envelopes=given
    )
    if print_config:
        print(as_toml(settings), end="")
        return
    from api.serving import serve_until_stopped

    if with_parent:
        from api.processes.parent import end_with_parent

        end_with_parent()
    raise typer.Exit(serve_until_stopped(settings, on_ready=lambda url: print(f"ready {url}", flush=True)))
