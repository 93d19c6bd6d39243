"""A start is an act of an operator: what is asked at the terminal before a rig may move (ISO 12100)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigctl.operator_acts import Person
    from rigctl.transport import Identity, Transport

__all__ = ["ask_to_start", "check_yes"]


def ask_to_start(transport: Transport, person: Person, what: str, *, yes: bool = False) -> Identity:
    """Return who the rig is, once the operator has said that it may move.

    Raises what :func:`rigctl.operator_acts.ask_to_start` raises, and InputError where --yes was given for a rig that is
    not simulated.
    """
    from rigctl import operator_acts

    if yes:
        check_yes(operator_acts.look(transport)[0], yes)
    return operator_acts.ask_to_start(transport, person, what)


def check_yes(identity: Identity, yes: bool) -> bool:
    """Whether the rig is simulated; InputError where --yes was given for one that is not."""
    from api.errors import InputError
    from rigctl.transport import Capability

    simulated = Capability.SIMULATED in identity.capabilities
    if yes and not simulated:
        raise InputError("--yes: this rig is not simulated, so a person has to say yes: leave the option out")
    return simulated
