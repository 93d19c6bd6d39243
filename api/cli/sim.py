"""``damper-rig sim``: the simulated rig in a process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["sim"]


def sim(
    listen: Annotated[
        str,
        typer.Option(
            help="Where to listen: modbus://HOST:PORT (port 0 chooses a free port) or can://loopback/NAME?fd=true."
        ),
    ],
    specimen: Annotated[str, typer.Option(help="Specimen in the rig.")] = "semi-active",
    hide: Annotated[
        list[str] | None, typer.Option(help="An effect to hide in the specimen; 'random': one chosen by the seed.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the noise and of the random effects.")] = 1,
    speed: Annotated[float, typer.Option(help="Speed of the rig's clock, relative to real time.")] = 1.0,
    reveal: Annotated[Path | None, typer.Option(metavar="FILE.json", help="Write what is hidden to this file.")] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[@SECONDS][:VALUE]",
            help="A fault, for example emergency_stop@3 or lost:0.01; seconds count from the first sample of the first "
            "run.",
        ),
    ] = None,
    skew: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL=SECONDS", help="Delay of a channel in seconds, for example force=0.0005."),
    ] = None,
    with_parent: Annotated[
        bool, typer.Option(help="End when standard input closes, as it does when the parent process ends.")
    ] = False,
) -> None:
    """Run a simulated rig until Ctrl-C or SIGTERM; prints 'ready URL' when it accepts connections.

    Example: damper-rig sim --listen modbus://127.0.0.1:5020 --hide coulomb_friction --speed 20
    """
    from sim_rig.server import serve

    if with_parent:
        from api.processes.parent import end_with_parent

        end_with_parent()
    serve(
        listen,
        specimen=specimen,
        hide=tuple(hide or ()),
        seed=seed,
        speed=speed,
        reveal=reveal,
        faults=tuple(fault or ()),
        skew=tuple(skew or ()),
        on_ready=_ready,
    )


def _ready(url: str) -> None:
    print(f"ready {url}", flush=True)
