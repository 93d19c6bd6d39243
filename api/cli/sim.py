"""``damper-rig sim``: the simulated rig as a process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["sim"]


def sim(
    listen: Annotated[
        str,
        typer.Option(
            help="Where to listen: modbus://HOST:PORT (port 0 takes a free one) or can://loopback/NAME?fd=true."
        ),
    ],
    specimen: Annotated[str, typer.Option(help="The damper in the rig.")] = "semi-active",
    hide: Annotated[
        list[str] | None, typer.Option(help="An effect that the damper has; 'random' draws one by the seed.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the noise and of what is drawn.")] = 1,
    speed: Annotated[float, typer.Option(help="How many times faster than real time the rig's clock runs.")] = 1.0,
    reveal: Annotated[
        Path | None, typer.Option(metavar="FILE.json", help="Write there what is hidden; nobody is told otherwise.")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[@SECONDS][:VALUE]",
            help="What goes wrong, and when on the rig's clock after the first run began: emergency_stop@3, lost:0.01.",
        ),
    ] = None,
    skew: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL=SECONDS", help="A channel whose reading is late, such as force=0.0005."),
    ] = None,
    with_parent: Annotated[
        bool, typer.Option(help="End when standard input closes: when the program that started it has ended.")
    ] = False,
) -> None:
    """Run a simulated rig until it is told to stop; prints 'ready URL' when it accepts a connection.

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
