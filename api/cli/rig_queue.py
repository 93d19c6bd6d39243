"""``damper-rig rig list|pause-queue|resume-queue|make-safe``: the rigs of a service, over HTTP."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.campaign import AsJson, ServiceUrl, connected

if TYPE_CHECKING:
    from api.client import Rig, RigStop

__all__ = ["add_to", "print_stop"]

Name = Annotated[str, typer.Argument(metavar="RIG", help="Its id, serial number, name or address.")]


def list_rigs(service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """List the rigs of a service: what is known of them, their campaigns, and why a queue is paused.

    Example: damper-rig rig list
    """
    from dataclasses import asdict

    from api.cli.terminal import answer

    with connected(service) as client:
        found = client.rigs()
    answer("\n".join(map(_line, found)) or "no rigs", [asdict(one) for one in found], as_json=as_json)


def resume_queue(
    name: Name,
    service: ServiceUrl = None,
    as_json: AsJson = False,
) -> None:
    """Let the campaigns that wait for a rig start again. Look at the rig first: it may move at once.

    Example: damper-rig rig resume-queue modbus://127.0.0.1:5020
    """
    from dataclasses import asdict

    from api.cli.terminal import answer

    with connected(service) as client:
        found = client.resume_queue(name)
    answer(_line(found), asdict(found), as_json=as_json)


def pause_queue(
    name: Name,
    reason: Annotated[str, typer.Option(help="Why; shown to everybody.")] = "",
    service: ServiceUrl = None,
    as_json: AsJson = False,
) -> None:
    """Let no further campaign of a rig start; the one that runs goes on.

    Example: damper-rig rig pause-queue "bench 3" --reason "oil change"
    """
    from dataclasses import asdict

    from api.cli.terminal import answer

    with connected(service) as client:
        found = client.pause_queue(name, reason)
    answer(_line(found), asdict(found), as_json=as_json)


def make_safe(name: Name, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """Stop a rig and switch it off, also where its worker has died. Exit status 0: at rest without current.

    This is no emergency stop: where somebody is in danger, press the button.

    Example: damper-rig rig make-safe "bench 3"
    """
    with connected(service) as client:
        print_stop(client.make_safe(name), as_json)


def print_stop(stopped: RigStop, as_json: bool) -> None:
    """Print what came of a stop."""
    from dataclasses import asdict

    from api.cli.terminal import answer

    known = stopped.text or "the worker brings it to rest and ends its test"
    answer(f"{stopped.address}: acknowledged by the {stopped.by}: {known}", asdict(stopped), as_json=as_json)


def _line(one: Rig) -> str:
    named = f" ({', '.join(filter(None, (one.name, one.serial)))})" if one.name or one.serial else ""
    running = f"plays {one.running}" if one.running else "plays nothing"
    paused = f"; queue paused: {one.paused}" if one.paused is not None else ""
    return f"{one.url}{named}: {one.state}: {one.state_text}; {running}, {one.accepted} waiting{paused}"


def add_to(rig: typer.Typer) -> None:
    """Add these commands to ``damper-rig rig``."""
    rig.command("list")(list_rigs)
    rig.command("pause-queue")(pause_queue)
    rig.command("resume-queue")(resume_queue)
    rig.command("make-safe")(make_safe)
