"""Plays a plan's warm-up: until the damper is warm enough for a test, or has taken up the energy that was asked for."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from excitation.plan import Test
from rigctl.errors import GateError, RigError, TooCold
from rigctl.preparation import WarmUp
from rigctl.runfile import Run, read_run

__all__ = ["conditioned", "together", "warmed_up"]

GATE_S = 3600.0


def warmed_up(
    play: Callable[[Test, Path], Path],
    test: Test,
    out_dir: Path,
    warm_up: Test | None,
    *,
    gate_s: float = GATE_S,
    on_warm_up: Callable[[WarmUp], None] = lambda done: None,
) -> Path:
    """Play a test, and the warm-up before it as often as needed; return the test's run file.

    `play` plays a test into a folder (:func:`rigctl.player.play` with everything else filled in); `on_warm_up` is given
    each warm-up that was played.

    Raises
    ------
    GateError
        When the damper is still too cold after `gate_s` of warm-up; TooCold where there is no warm-up.
    RigError
        As `play` does.
    """
    spent_s = 0.0
    while True:
        try:
            return play(test, out_dir)
        except TooCold as cold:
            if warm_up is None:
                raise
            if spent_s >= gate_s:
                raise GateError(f"test {test.name!r}: {gate_s:g} s of warm-up were not enough: {cold}") from cold
        on_warm_up(_as_warm_up(_played(play, warm_up)))
        spent_s += warm_up.excitation.duration_s


def conditioned(play: Callable[[Test, Path], Path], warm_up: Test, *, gate_s: float = GATE_S) -> WarmUp:
    """Play a warm-up until the damper has taken up its energy and is as warm as it says; return what was done.

    It ends early where a play was stopped on request.

    Raises
    ------
    GateError
        When `gate_s` of warm-up were not enough.
    RigError
        As `play` does.
    """
    done: WarmUp | None = None
    while True:
        run = _played(play, warm_up)
        done = together(done, _as_warm_up(run))
        short = short_of(warm_up, done)
        if not short or run.status != "complete":
            return done
        if done.duration_s >= gate_s:
            raise GateError(f"warm-up {warm_up.name!r}: {done.duration_s:.0f} s were not enough: {short}")


def together(first: WarmUp | None, second: WarmUp) -> WarmUp:
    """Two warm-ups in a row as one."""
    if first is None:
        return second
    return WarmUp(
        finished_at=second.finished_at,
        energy_j=first.energy_j + second.energy_j,
        duration_s=first.duration_s + second.duration_s,
        plays=first.plays + second.plays,
        start_degc=first.start_degc,
        end_degc=second.end_degc,
    )


def short_of(warm_up: Test, done: WarmUp) -> str:
    """What is still missing; empty where nothing is."""
    if warm_up.energy_j is not None and not done.energy_j >= warm_up.energy_j:  # the negation catches NaN too
        return f"{done.energy_j:.0f} J of {warm_up.energy_j:g} J"
    if warm_up.to_temperature_degc is not None and not done.end_degc >= warm_up.to_temperature_degc:
        return f"{done.end_degc:.1f} °C of {warm_up.to_temperature_degc:g} °C"
    return ""


def _played(play: Callable[[Test, Path], Path], warm_up: Test) -> Run:
    """Play the warm-up into a folder that is deleted."""
    with TemporaryDirectory(prefix="warm-up-") as folder:
        try:
            return read_run(play(warm_up, Path(folder)))
        except RigError as error:
            error.run_path = None  # it is deleted with the folder
            raise


def _as_warm_up(run: Run) -> WarmUp:
    force, displacement, temperature = (run.channels[name] for name in ("force", "displacement", "temperature"))
    tenth = max(run.samples // 10, 1)
    return WarmUp(
        finished_at=datetime.now(UTC).isoformat(timespec="seconds"),
        energy_j=float(np.trapezoid(force, displacement)),
        duration_s=run.samples / run.sample_rate_hz,
        plays=1,
        start_degc=float(np.mean(temperature[:tenth])),
        end_degc=float(np.mean(temperature[-tenth:])),
    )
