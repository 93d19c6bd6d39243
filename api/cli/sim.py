"""``damper-rig sim``: the simulated rig in a process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import to_file

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
    reveal: Annotated[
        Path | None, typer.Option(metavar="FILE.json", callback=to_file, help="Write what is hidden to this file.")
    ] = None,
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
    held: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CHANNEL=VALUE",
            help="Specimen anti-yaw: the place of a further axis in m or rad, for example displacement_y=0.004.",
        ),
    ] = None,
    controller: Annotated[
        str,
        typer.Option(
            help="'damper-rig': this project's own; or one of another make, in real time, driven by a rig.toml of "
            "examples/rigs: plc, motion, ds402 or console.",
        ),
    ] = "damper-rig",
    amplifier: Annotated[
        str,
        typer.Option(
            help="Address of a measuring amplifier with a clock of its own beside --controller plc or motion, for "
            "example modbus://127.0.0.1:5023."
        ),
    ] = "",
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
    if controller != "damper-rig":
        _serve_foreign(controller, listen, specimen, tuple(hide or ()), seed, tuple(fault or ()), amplifier)
        return
    serve(
        listen,
        specimen=specimen,
        hide=tuple(hide or ()),
        seed=seed,
        speed=speed,
        reveal=reveal,
        faults=tuple(fault or ()),
        skew=tuple(skew or ()),
        held=tuple(held or ()),
        on_ready=_ready,
    )


def _serve_foreign(
    controller: str,
    listen: str,
    specimen: str,
    hide: tuple[str, ...],
    seed: int,
    fault: tuple[str, ...],
    amplifier: str,
) -> None:
    from sim_rig.errors import SimRigError
    from sim_rig.foreign.serving import ControllerKind, serve_controller

    if controller not in tuple(ControllerKind):
        raise SimRigError(f"--controller is {controller!r}: it must be damper-rig, {', '.join(ControllerKind)}")
    serve_controller(
        ControllerKind(controller),
        listen,
        specimen=specimen,
        hide=hide,
        seed=seed,
        faults=fault,
        amplifier=amplifier,
        on_ready=_ready,
    )


def _ready(url: str) -> None:
    print(f"ready {url}", flush=True)
