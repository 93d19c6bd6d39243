"""Transitions of the device's states, after CiA 408."""

from __future__ import annotations

from rigctl.device import Control, RigState

S = RigState
COMMANDS = (Control.DISABLE, Control.HOLD, Control.ACTIVATE)


def after_command(state: RigState, control: Control, at_rest: bool) -> RigState:
    """Return the state that a command leads to now; after DISABLE it is asked again once the axis is at rest.

    Nothing skips a state: DISABLED → HOLD → ACTIVE, and power is switched off only at rest. A control word that is no
    command changes nothing.
    """
    match state, control:
        case S.INIT, Control.DISABLE:
            return S.DISABLED
        case S.DISABLED, Control.HOLD:
            return S.HOLD
        case S.HOLD, Control.ACTIVATE if at_rest:
            return S.ACTIVE
        case S.HOLD, Control.DISABLE if at_rest:
            return S.DISABLED
        case S.ACTIVE, Control.HOLD | Control.DISABLE:
            return S.HOLD
        case S.FAULT_HOLD, Control.DISABLE:
            return S.FAULT_DISABLED
    return state


def after_fault(state: RigState, hydraulic: bool) -> RigState:
    """Return the state that a fault leads to: pressure off at once, or a controlled stop."""
    if hydraulic or state in (S.INIT, S.DISABLED, S.FAULT_DISABLED):
        return S.FAULT_DISABLED
    if state is S.FAULT_HOLD:
        return S.FAULT_HOLD
    return S.FAULT_REACTION


def after_reset(state: RigState) -> RigState:
    """Return the state after a reset whose cause is gone; only an inactive device resets, and it has no power then."""
    return {S.FAULT_DISABLED: S.DISABLED, S.FAULT_HOLD: S.DISABLED}.get(state, state)
