"""``damper-rig rig …``: what an operator does at a rig."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli import laboratory, rig_queue
from api.cli.campaign import ServiceUrl, connected
from api.cli.options import Url, Yes
from api.cli.rig_check import check

if TYPE_CHECKING:
    from rigctl.transport import Identity, Status, Transport

__all__ = ["rig"]

rig = typer.Typer(name="rig", help="Look at a rig, stop it, reset it, prepare it for a test.", no_args_is_help=True)

AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")]


@rig.command("status")
def status(url: Url, as_json: AsJson = False) -> None:
    """Print what the rig says of itself. Nothing is commanded, and no watchdog is fed.

    Example: damper-rig rig status modbus://127.0.0.1:5020
    """
    from rigctl.operator_acts import look

    with _connected(url) as transport:
        identity, found = look(transport)
    _print(url, identity, found, as_json)


@rig.command("stop")
def stop(url: Url, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """Stop the rig, whoever commands it, and switch its power off.

    With --service, or for a rig by its name, the service does it; else this command itself, over the rig's wire.

    This is no emergency stop: where somebody is in danger, press the button.

    Example: damper-rig rig stop modbus://127.0.0.1:5020
    """
    if service is not None or "://" not in url:
        with connected(service) as client:
            rig_queue.print_stop(client.stop_rig(url), as_json)
        return
    from rigctl.operator_acts import look
    from rigctl.operator_acts import stop as stop_rig

    with _connected(url) as transport:
        stop_rig(transport)  # first of all
        identity, found = look(transport)
    _print(url, identity, found, as_json)


@rig.command("reset")
def reset(
    url: Url,
    yes: Yes = False,
    as_json: AsJson = False,
) -> None:
    """Reset a latched fault. The rig is without power afterwards, and nothing moves.

    Look at the rig first: the cause must be gone. No other command resets a fault without a person's word.

    Example: damper-rig rig reset modbus://127.0.0.1:5020
    """
    from api.cli.person import Terminal
    from api.cli.start import check_yes
    from rigctl.operator_acts import in_words, latched, look
    from rigctl.operator_acts import reset as reset_rig

    with _connected(url) as transport:
        identity, found = look(transport)
        check_yes(identity, yes)
        if latched(url, found) is not None:
            if not yes:
                Terminal().confirm(f"{url}: {in_words(found)}. Is the cause gone, and may the rig be reset?")
            reset_rig(transport)
            identity, found = look(transport)
    _print(url, identity, found, as_json)


@contextmanager
def _connected(url: str) -> Iterator[Transport]:
    from rigctl.address import connect

    transport = connect(url)
    try:
        yield transport
    finally:
        transport.close()


def _print(url: str, identity: Identity, status: Status, as_json: bool) -> None:
    from api.cli.terminal import answer
    from rigctl.device import describe
    from rigctl.operator_acts import in_words

    value: dict[str, Any] = {  # Any: JSON
        "rig": url,
        "model": identity.model,
        "serial": identity.serial,
        "state": status.state.name,
        "faults": describe(status.faults, status.detector),
        "commanded": bool(status.session),
        "at_rest": status.arrived,
        "force": status.force_n,
        "displacement": status.displacement_m,
        "current": status.current_a,
        "temperature": status.temperature_degc,
        "pressure": status.pressure_pa,
    }
    readings = (
        f"{status.force_n:.1f} N, {1e3 * status.displacement_m:.3f} mm, {status.current_a:.3f} A, "
        f"{status.temperature_degc:.1f} °C, {status.pressure_pa / 1e6:.2f} MPa"
    )
    text = f"{url}: {identity.model} {identity.serial}: {in_words(status)}\n{readings}"
    answer(text, value, as_json=as_json)


rig.command("check")(check)
rig_queue.add_to(rig)
laboratory.add_to(rig)
