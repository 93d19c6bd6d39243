"""``damper-rig rig check``: walk a rig before its first test, and keep the protocol."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.options import Url, Yes
from api.cli.places import to_file_here

if TYPE_CHECKING:
    from collections.abc import Callable

    from rigctl.clock import Clock
    from rigctl.rig_check import Finding, Protocol
    from rigctl.transport import Transport

__all__ = ["check"]


def check(
    url: Url,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            callback=to_file_here,
            metavar="FILE.html",
            help="The protocol; default: a name made of rig and time.",
        ),
    ] = None,
    operator: Annotated[str, typer.Option(help="Operator, for the protocol.")] = "",
    at_rest: Annotated[bool, typer.Option("--at-rest", help="Do not ask for the part with motion.")] = False,
    yes: Yes = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Walk a rig without motion, then, where you agree, with 1 mm; prints a table and keeps a page.

    Without motion: identity, limits, round trips, clocks, refusal of a second master, of wrong configurations, stop.
    With 1 mm, at low pressure where the rig has it: it moves, comes back, stops on the way, and its watchdog acts.
    Exit status 1: something is bad. Of a controller of another make, what its map does not say is printed as not known.

    Example: damper-rig rig check modbus://127.0.0.1:5020 -o protocol.html
    """
    from contextlib import closing

    from api.cli.terminal import answer
    from rigctl.address import connect
    from rigctl.clock import SystemClock
    from rigctl.rig_check import check_at_rest
    from rigctl.rig_check.page import file_name, write_protocol

    clock = SystemClock()
    with closing(connect(url)) as transport:
        protocol = check_at_rest(transport, lambda: connect(url), clock, operator=operator)
        if protocol.passed and not at_rest:
            protocol = protocol.with_findings(_in_motion(transport, clock, protocol, lambda: connect(url), yes=yes))
    path = output or Path(file_name(protocol))
    write_protocol(path, protocol)
    lines = [*map(_line, protocol.findings), str(path)]
    values = [
        {"part": one.part, "what": one.what, "found": one.found, "wanted": one.wanted, "verdict": str(one.verdict)}
        for one in protocol.findings
    ]
    answer("\n".join(lines), values, as_json=as_json)
    if not protocol.passed:
        raise typer.Exit(1)


def _in_motion(
    transport: Transport, clock: Clock, protocol: Protocol, another: Callable[[], Transport], *, yes: bool
) -> tuple[Finding, ...]:
    """The part with motion, once a person has agreed to it; what was left out is a finding too."""
    from api.cli.person import Terminal
    from api.cli.start import check_yes
    from rigctl.device import Fault
    from rigctl.errors import Declined
    from rigctl.operator_acts import look, reset
    from rigctl.rig_check import check_in_motion, left_out

    check_yes(protocol.identity, yes)
    identity = protocol.identity
    rig = f"{identity.vendor} {identity.model} {identity.serial}".strip()
    pressure = "full" if identity.low_pressure is None else "low"
    if not yes:
        try:
            Terminal().confirm(
                f"{rig} is about to move by 1 mm at {pressure} pressure and to stop by its watchdog: "
                "is everybody out of its reach?"
            )
        except Declined as declined:
            return (left_out(str(declined)),)
    found = check_in_motion(transport, clock, another=another)
    if look(transport, clock)[1].faults != Fault.HEARTBEAT:
        return found  # it stopped for another reason: 'rig reset' says which, and asks
    if not yes:
        try:
            Terminal().confirm("The watchdog's fault is latched, as it must be: may the rig be reset?")
        except Declined:
            return found
    reset(transport, clock)
    return found


def _line(one: Finding) -> str:
    wanted = f" (wanted: {one.wanted})" if one.wanted else ""
    return f"{one.verdict:5} {one.part}: {one.what}: {one.found}{wanted}"
