"""The characteristic sheet of the runs that are explained, as its report keeps it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.report.sheet_data import SheetAtRest, SheetCurve, SheetData, SheetLoop, SheetTests
from identification.sheet import AtCurrent, Sheet, row, sheet_of
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_POINTS = 120  # of a curve or a loop: a picture half as wide as a page


def sheet_figures(runs: Sequence[Run]) -> SheetData | None:
    """The sheet of these runs; None where no run is a steady sine."""
    try:
        sheet = sheet_of(runs, findings=())  # they are among the notes of the report
    except DataError:
        return None
    return SheetData(
        tests=_tests(sheet),
        at_rest=_at_rest(sheet.currents),
        curves=tuple(_curve(k, group) for k, group in enumerate(sheet.currents) if group.curve is not None),
        loops=tuple(_loop(group) for group in sheet.currents),
    )


def _tests(sheet: Sheet) -> SheetTests:
    rows = [row(test) for test in sheet.tests]

    def column(name: str) -> Floats:
        values: list[Any] = [one[name] for one in rows]  # Any: numbers; other columns hold text
        return np.array(values, dtype=np.float64)

    return SheetTests(
        runs=tuple(str(one["run"]) for one in rows),
        amplitude=column("amplitude_asked"),
        frequency=column("frequency_asked"),
        current=np.array([_number(test.current_asked) for test in sheet.tests]),
        speed_rebound=column("speed_rebound"),
        force_rebound=column("force_rebound"),
        speed_compression=column("speed_compression"),
        force_compression=column("force_compression"),
        width=column("hysteresis_width"),
        energy=column("energy_per_cycle"),
        stiffness=column("dynamic_stiffness"),
    )


def _at_rest(groups: Sequence[AtCurrent]) -> SheetAtRest:
    rest = [group.at_rest for group in groups]
    return SheetAtRest(
        current=np.array([_number(group.current) for group in groups]),
        force=np.array([one.force.value for one in rest]),
        force_std=np.array([one.force.std for one in rest]),
        stiffness=np.array([one.stiffness.value for one in rest]),
        stiffness_std=np.array([one.stiffness.std for one in rest]),
        friction=np.array([one.friction.value for one in rest]),
        friction_std=np.array([one.friction.std for one in rest]),
        slowest=np.array([one.slowest_m_s for one in rest]),
    )


def _curve(at: int, group: AtCurrent) -> SheetCurve:
    assert group.curve is not None  # by the caller
    speed = np.linspace(1e-6, 1.05 * max(test.cycles.peak_velocity_m_s for test in group.tests), _POINTS)
    sides = [group.curve(side).astype(np.float32) for side in (speed, -speed)]
    return SheetCurve(at=at, speed=speed.astype(np.float32), rebound=sides[0], compression=sides[1])


def _loop(group: AtCurrent) -> SheetLoop:
    fastest = group.tests[-1]
    x, v, force = (np.append(s, s[0]).astype(np.float32) for s in fastest.cycles.loop(_POINTS))
    return SheetLoop(label=fastest.label, displacement=x, velocity=v, force=force)


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
