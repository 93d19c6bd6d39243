"""Plays the tests of a plan: the steps before each test, the warm-up before the first, and what follows a refusal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from excitation.plan import Test
from excitation.plan_steps import Gate, Prompt, Step, Tare
from rigctl.clock import Clock
from rigctl.errors import Declined, GateError, InterlockTripped, ProcedureError
from rigctl.preparation import WarmUp
from rigctl.procedures.operator import Operator
from rigctl.procedures.station import commanded
from rigctl.procedures.tare import TareSettings, tare
from rigctl.setup import Setup
from rigctl.transport import Transport
from rigctl.warm_up import GATE_S, conditioned, together, warmed_up

__all__ = ["Played", "Sequence"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """How a test of a plan ended; `skipped` is why it was not played, or not to its end."""

    test: Test
    path: Path | None
    skipped: str = ""


@dataclass(slots=True, kw_only=True)
class Sequence:
    """One specimen on one rig, test after test; the setup grows with every tare, gate and warm-up.

    `play` plays a test into a folder with a setup (:func:`rigctl.player.play` with everything else filled in).
    """

    transport: Transport
    play: Callable[[Test, Path, Setup], Path]
    out_dir: Path
    operator: Operator
    clock: Clock
    warm_up: Test | None = None
    setup: Setup = field(default_factory=Setup)
    gate_s: float = GATE_S
    tell: Callable[[str], None] = lambda text: None
    on_retry: Callable[[Path], None] = lambda path: None  # given the run file of an attempt that is not the last one
    _notes: tuple[str, ...] = ()  # of the test that is being prepared
    _conditioned: bool = False

    def run(self, test: Test) -> Played:
        """Prepare and play one test; its ``on_failure`` says what follows where a step or a gate refuses.

        Raises
        ------
        Declined
            When the operator did not confirm, whatever ``on_failure`` says.
        RigError
            As the steps and `play` do, unless the test is skipped.
        """
        self._notes = ()
        for retry in range(1 + (test.retries if test.on_failure == "retry" else 0)):
            try:
                return Played(test=test, path=self._attempt(test))
            except Declined:
                raise
            except (GateError, ProcedureError, InterlockTripped) as error:
                if test.on_failure == "skip":
                    return Played(test=test, path=error.run_path, skipped=str(error))
                if test.on_failure == "stop" or retry == test.retries:
                    raise
                if error.run_path is not None:
                    self.on_retry(error.run_path)
                self._notes = (f"attempt {retry + 2}, after: {error}",)
                self.tell(f"{test.name}: {self._notes[0]}")
        raise AssertionError("unreachable")

    def _attempt(self, test: Test) -> Path:
        for step in test.before:
            self._do(step)
        if self.warm_up is not None and self.warm_up.conditions_the_damper and not self._conditioned:
            self.tell(f"warm-up {self.warm_up.name}")
            self._keep(conditioned(self._play, self.warm_up, gate_s=self.gate_s))
            self._conditioned = True
        return warmed_up(self._play, test, self.out_dir, self.warm_up, gate_s=self.gate_s, on_warm_up=self._keep)

    def _play(self, test: Test, out_dir: Path) -> Path:
        return self.play(test, out_dir, replace(self.setup, notes=(*self.setup.notes, *self._notes)))

    def _keep(self, done: WarmUp) -> None:
        self.setup = replace(self.setup, warm_up=together(self.setup.warm_up, done))

    def _do(self, step: Step) -> None:
        match step:
            case Prompt():
                self.operator.confirm(step.text)
                self._notes += (f"the operator confirmed: {step.text}",)
            case Tare():
                self.tell("tare")
                self._tare(TareSettings(limit_n=step.limit_n, readings=step.readings))
            case Gate(of="ambient"):
                self._ambient(step)
            case Gate():
                self._oil(step)

    def _tare(self, settings: TareSettings) -> None:
        with commanded(self.transport, self.clock) as station:
            self.setup = replace(self.setup, tare=tare(station.axis, self.clock, station.identity, settings))

    def _ambient(self, gate: Gate) -> None:
        degc = self.operator.number(f"Temperature of the room ({gate})", "°C")
        self.setup = replace(self.setup, ambient_degc=degc)
        if not gate.passes(degc):
            raise GateError(f"the room is at {degc:g} °C: the test needs {gate}")

    def _oil(self, gate: Gate) -> None:
        with commanded(self.transport, self.clock) as station:
            station.axis.await_temperature(
                gate.min_degc, gate.max_degc, station.rate_hz, gate.wait_s, partial(_tell, self.tell, str(gate))
            )


def _tell(tell: Callable[[str], None], what: str, text: str) -> None:
    tell(f"{what}: {text}")
