"""The state machine, with every state, every control word, at rest and not at rest."""

from __future__ import annotations

import itertools

import pytest

from rigctl.device import SAFE_STATES, Control, RigState
from sim_rig.states import after_command, after_fault, after_reset

S = RigState
EVERY = list(itertools.product(RigState, (Control(bits) for bits in range(16)), (False, True)))


def test_only_the_documented_transitions_exist() -> None:
    seen = {(state, after_command(state, control, rest)) for state, control, rest in EVERY}
    assert {(a, b) for a, b in seen if a is not b} == {
        (S.INIT, S.DISABLED),
        (S.DISABLED, S.HOLD),
        (S.HOLD, S.ACTIVE),
        (S.HOLD, S.DISABLED),
        (S.ACTIVE, S.HOLD),
        (S.FAULT_HOLD, S.FAULT_DISABLED),
    }


def test_motion_needs_an_activation_and_an_axis_at_rest() -> None:
    for state, control, rest in EVERY:
        if after_command(state, control, rest) is S.ACTIVE and state is not S.ACTIVE:
            assert control == Control.ACTIVATE
            assert rest


def test_power_is_never_switched_off_while_the_axis_moves() -> None:
    for state, control in itertools.product(RigState, (Control(bits) for bits in range(16))):
        if state in (S.HOLD, S.ACTIVE):
            assert after_command(state, control, False) is not S.DISABLED


def test_a_command_never_leaves_a_fault_state_for_one_without_fault() -> None:
    for state, control, rest in EVERY:
        if state.faulted:
            assert after_command(state, control, rest).faulted


def test_repeating_a_command_at_rest_ends_in_a_state_that_it_no_longer_changes() -> None:
    for state, control, _ in EVERY:
        for _ in range(4):
            state = after_command(state, control, True)
        assert after_command(state, control, True) is state


@pytest.mark.parametrize("hydraulic", [False, True])
@pytest.mark.parametrize("state", list(RigState))
def test_a_fault_always_ends_in_a_fault_state(state: RigState, hydraulic: bool) -> None:
    after = after_fault(state, hydraulic)
    assert after.faulted
    if hydraulic:
        assert after is S.FAULT_DISABLED
    assert after in SAFE_STATES or after is S.FAULT_REACTION


def test_only_an_inactive_device_resets_and_it_has_no_power_then() -> None:
    assert {state: after_reset(state) for state in RigState if after_reset(state) is not state} == {
        S.FAULT_DISABLED: S.DISABLED,
        S.FAULT_HOLD: S.DISABLED,
    }


def test_every_state_has_its_own_status_word() -> None:
    assert len({state.value for state in RigState}) == len(RigState)
    assert all(bool(state.value & 8) != state.faulted for state in RigState)
