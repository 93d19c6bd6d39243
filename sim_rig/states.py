"""Transitions of the device's states, after CiA 408."""

from __future__ import annotations

from rigctl.device import Control, RigState

S = RigState


def after_command(state: RigState, control: Control, at_rest: bool) -> RigState:
    """Return the state that a control word leads to now; called again with `at_rest`, the next one.

    Nothing skips a state: DISABLED → HOLD → ACTIVE, and power is switched off only at rest.
    """
    wants_hold = Control.H in control and Control.D in control
    wants_motion = wants_hold and Control.M in control
    match state:
        case S.INIT if Control.D in control:
            return S.DISABLED
        case S.DISABLED if wants_hold:
            return S.HOLD
        case S.HOLD if wants_motion and at_rest:
            return S.ACTIVE
        case S.HOLD if not wants_hold and at_rest:
            return S.DISABLED
        case S.ACTIVE if not wants_motion:
            return S.HOLD
        case S.FAULT_HOLD if not wants_hold:
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
    """Return the state after a reset whose cause is gone; only an inactive device resets."""
    return {S.FAULT_DISABLED: S.DISABLED, S.FAULT_HOLD: S.HOLD}.get(state, state)
