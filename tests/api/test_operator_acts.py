"""What an operator does at a rig: look, stop, reset; and what no program does without a word of theirs."""

from __future__ import annotations

import json
import time
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from api.cli.main import main
from api.cli.rig_check import _in_motion
from api.cli.start import ask_to_start
from api.errors import InputError
from excitation.files import write_excitation
from excitation.kinds import Kind
from excitation.signal import Excitation
from rigctl.address import connect
from rigctl.device import Control, Fault, RigState
from rigctl.errors import Declined, NeedsReset
from rigctl.limits import Configuration
from rigctl.operator_acts import in_words, reset
from rigctl.rig_check import check_at_rest
from rigctl.transport import Capability, Identity, Transport
from sim_rig.direct import DirectTransport
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.specimens import SPECIMENS

S = 2.0
SINE = Excitation(
    kind=Kind.SINE,
    sample_rate_hz=1000.0,
    period_samples=500,
    displacement_m=0.005 * np.sin(np.arange(1000) * 2 * np.pi / 500),
)


def said(capsys: pytest.CaptureFixture[str]) -> tuple[dict[str, Any], str]:
    out, err = capsys.readouterr()
    return (json.loads(out) if out else {}), err


def latch(url: str) -> None:
    """Leave a rig under power and silent: its watchdog latches a fault."""
    with closing(connect(url)) as wire:
        wire.identify(S)
        wire.claim(S)
        wire.command(Control.HOLD, wire.status(S).run_id + 1, S)
    with closing(connect(url)) as reader:
        ends = time.monotonic() + 30
        while not reader.status(S).faults:
            assert time.monotonic() < ends
            time.sleep(0.02)


def test_a_rig_is_looked_at_stopped_and_reset_from_the_command_line(
    rig: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["rig", "status", rig, "--json"]) == 0
    found, _ = said(capsys)
    assert (found["state"], found["faults"], found["commanded"], found["at_rest"]) == ("DISABLED", "", False, True)
    latch(rig)
    excitation = tmp_path / "sine.h5"
    write_excitation(excitation, SINE)
    assert main(["run", str(excitation), "--rig", rig, "-o", str(tmp_path / "runs")]) == 1
    _, refusal = said(capsys)
    assert f"damper-rig rig reset {rig}" in refusal
    assert not (tmp_path / "runs").exists()
    assert main(["rig", "stop", rig, "--json"]) == 0
    stopped, _ = said(capsys)
    assert (stopped["state"], stopped["faults"]) == ("FAULT_DISABLED", "the host's heartbeat was lost")
    assert main(["rig", "reset", rig]) != 0
    _, refusal = said(capsys)
    assert "nobody can be asked" in refusal
    assert main(["rig", "reset", rig, "--yes", "--json"]) == 0
    clear, _ = said(capsys)
    assert (clear["state"], clear["faults"]) == ("DISABLED", "")


class RealRig(SimulatedRig):
    """A rig that does not say of itself that it is simulated."""

    def identity(self) -> Identity:
        return replace(super().identity(), capabilities=Capability.CURRENT)


class Clock:
    rig: SimulatedRig
    time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds


class Person:
    """Answers every question alike, and remembers them."""

    def __init__(self, *, there: bool = True, says_yes: bool = True) -> None:
        self.is_there, self._says_yes, self.asked = there, says_yes, list[str]()

    def confirm(self, text: str) -> None:
        self.asked.append(text)
        if not (self.is_there and self._says_yes):
            raise Declined(f"not confirmed: {text}")


def a_rig(kind: type[SimulatedRig], clock: Clock) -> tuple[SimulatedRig, Transport]:
    found = SPECIMENS["semi-active"]
    rig = kind(SimulatedPlant(found.damper, found.noise, seed=1, start_degc=25.0), speed=1.0, now=clock.now)
    return rig, DirectTransport(rig, clock)


def test_a_real_rig_starts_after_a_persons_yes_and_a_simulated_one_at_once() -> None:
    for kind, questions in ((RealRig, 1), (SimulatedRig, 0)):
        _, wire = a_rig(kind, Clock())
        person = Person()
        ask_to_start(wire, person, "2 tests")
        assert len(person.asked) == questions
    _, wire = a_rig(RealRig, Clock())
    for nobody in (Person(there=False), Person(says_yes=False)):
        with pytest.raises(Declined):
            ask_to_start(wire, nobody, "2 tests")
    with pytest.raises(InputError, match="not simulated"):
        ask_to_start(wire, Person(), "2 tests", yes=True)


def test_a_latched_fault_is_reset_by_a_persons_word_and_by_nothing_else() -> None:
    clock = Clock()
    rig, wire = a_rig(SimulatedRig, clock)
    rig.controller.fail(Fault.SENSOR)
    for nobody in (Person(there=False), Person(says_yes=False)):
        with pytest.raises((NeedsReset, Declined)):
            ask_to_start(wire, nobody, "a test", yes=True)
        assert rig.status().state is RigState.FAULT_DISABLED
    person = Person()
    ask_to_start(wire, person, "a test")
    assert rig.status().state is RigState.DISABLED
    assert "a sensor is stuck" in person.asked[0]
    assert reset(wire, clock).state is RigState.DISABLED, "a reset without a fault changes nothing"


class PressedInTheSilence(Clock):
    """Somebody presses the emergency stop, and releases it, while the host is silent for the watchdog."""

    def sleep(self, seconds: float) -> None:
        super().sleep(seconds)
        if seconds >= 2 * Configuration().heartbeat_s:
            for pressed in (True, False):
                self.rig.controller.set_cause(Fault.EMERGENCY_STOP, pressed)


def test_a_check_of_a_rig_resets_its_own_watchdogs_fault_and_no_other() -> None:
    for clock, faults in ((Clock(), Fault.NONE), (PressedInTheSilence(), Fault.EMERGENCY_STOP)):
        clock.rig, wire = a_rig(SimulatedRig, clock)
        another = partial(DirectTransport, clock.rig, clock)
        protocol = check_at_rest(wire, another, clock)
        _in_motion(wire, clock, protocol, another, yes=True)
        assert clock.rig.controller.faults is faults


def test_every_state_of_a_rig_has_its_words_beside_its_name() -> None:
    status = a_rig(SimulatedRig, Clock())[0].status()
    said = {state: in_words(replace(status, state=state)) for state in RigState}
    assert said[RigState.DISABLED] == "without power (DISABLED), commanded by nobody"
    assert all(f" ({state.name})" in words for state, words in said.items())


def test_a_rig_with_a_latched_fault_is_not_said_to_be_commanded() -> None:
    status = replace(a_rig(SimulatedRig, Clock())[0].status(), session=7)
    for state in RigState:
        assert ("commanded" in in_words(replace(status, state=state))) is not state.faulted
