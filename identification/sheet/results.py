"""What the sheet says: each test in numbers, and the damper at each current."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from identification.datachecks import findings_in
from identification.errors import DataError
from identification.force_velocity import SidedCurve, at_peak_speed, hysteresis_widths, sided_fit
from identification.models.protocol import SimulationModel
from identification.models.simulation import SIMULATED, with_simulation
from identification.sheet.asked import asked
from identification.static_force import StaticForce, Strokes, static_force, strokes_of_sine, strokes_of_triangle
from identification.steady import Cycles, dynamic_stiffness, energy_per_cycle, loop_shape, loss_factor, steady_cycles
from rigctl.runfile import Run

Floats = NDArray[np.float64]

FORMAT = "damper-rig/sheet"
FORMAT_VERSION = 1
_ONE_CURRENT = 0.02  # A: tests within it are at one current
_LEAST_SPEEDS = 4  # of a curve for each side
_END = 0.05  # share of a run whose mean is the temperature at its start, or at its end


@dataclass(frozen=True, slots=True, kw_only=True)
class SineTest:
    """One steady sine: its cycles, what it was asked to be, SI, and its simulation if there is a model."""

    cycles: Cycles
    amplitude_asked: float
    frequency_asked: float
    current_asked: float | None
    temperature: tuple[float, float] | None  # °C, at start and end
    simulated: Cycles | None = None

    @property
    def label(self) -> str:
        """The test in the words of a legend."""
        current = "" if self.current_asked is None else f", {self.current_asked:g} A"
        return f"{1e3 * self.amplitude_asked:g} mm, {self.frequency_asked:g} Hz{current}"


@dataclass(frozen=True, slots=True, kw_only=True)
class AtCurrent:
    """The damper at one current, None where it has none: its tests by speed, at rest, and the curve of each side."""

    current: float | None
    tests: tuple[SineTest, ...]
    at_rest: StaticForce
    curve: SidedCurve | None  # None where there are fewer than four speeds


@dataclass(frozen=True, slots=True, kw_only=True)
class Temperature:
    """The temperature of one run: times since the first run or the number of the run, and °C, (N,) each."""

    run: str
    at: Floats
    degc: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """All that is on the sheet."""

    specimen: str
    currents: tuple[AtCurrent, ...]
    temperatures: tuple[Temperature, ...]
    by_time: bool  # temperatures over minutes, else over the number of the run
    left_out: tuple[str, ...]
    findings: tuple[str, ...]
    with_model: bool

    @property
    def tests(self) -> list[SineTest]:
        """All tests, by current, then by speed."""
        return [test for group in self.currents for test in group.tests]


def sheet_of(
    runs: Sequence[Run], model: SimulationModel | None = None, *, findings: Sequence[str] | None = None
) -> Sheet:
    """The sheet of these runs; with a `model` each test has its simulation beside it.

    `findings` are those of the data checks, for whoever has them: None where these are still to be made.

    Raises
    ------
    DataError
        when no run is a steady sine, or one lacks what the model needs.
    SimulationError
        when the model fails on a run.
    """
    triangles = [run for run in runs if run.excitation_kind == Kind.TRIANGLE and "displacement" in run.channels]
    found = [(run, steady_cycles(run)) for run in runs if not any(run is one for one in triangles)]
    sines = [(run, cycles) for run, cycles in found if cycles is not None]
    strokes = {_name(run): strokes_of_triangle(run) for run in triangles}
    left_out = [_name(run) for run, cycles in found if cycles is None] + [
        n for n, one in strokes.items() if one is None
    ]
    if not sines:
        raise DataError(
            f"{', '.join(left_out) or 'no run'}: no steady sine: the sheet needs whole cycles of a sine "
            "and a force that varies"
        )
    tests = _tests(sines, [None] * len(sines) if model is None else _simulated(model, [run for run, _ in sines]))
    slow = [one for one in strokes.values() if one is not None]
    temperatures, by_time = _temperatures(runs)
    seen = findings_in(runs) if findings is None else findings
    return Sheet(
        specimen=", ".join(dict.fromkeys(run.specimen for run in runs if run.specimen)),
        currents=tuple(_at_current(group, slow) for group in _by_current(tests)),
        temperatures=temperatures, by_time=by_time, left_out=tuple(left_out), findings=tuple(seen),
        with_model=model is not None,
    )  # fmt: skip


def _simulated(model: SimulationModel, runs: Sequence[Run]) -> list[Cycles | None]:
    """The tests as the model simulates them; None where its force is constant."""
    return [steady_cycles(run, SIMULATED) for run in with_simulation(model, runs)]


def _tests(sines: Sequence[tuple[Run, Cycles]], simulated: Sequence[Cycles | None]) -> list[SineTest]:
    designs = [run.design or {} for run, _ in sines]
    amplitudes = asked([c.amplitude_m for _, c in sines], [_designed(d, "amplitude") for d in designs])
    frequencies = asked(
        [c.frequency_hz for _, c in sines], [_designed(d, "frequency_asked", "frequency") for d in designs]
    )
    currents = asked(
        [c.current or 0.0 for _, c in sines], [_designed(d, "current") for d in designs], least_step=_ONE_CURRENT
    )
    each = zip(sines, amplitudes, frequencies, currents, simulated, strict=True)
    return [
        SineTest(
            cycles=cycles, amplitude_asked=a, frequency_asked=f, current_asked=None if cycles.current is None else i,
            temperature=_ends(run), simulated=beside,
        )
        for (run, cycles), a, f, i, beside in each
    ]  # fmt: skip


def _designed(design: Mapping[str, Any], *keys: str) -> float | None:  # Any: JSON
    """What the design of a sine asked for under the first of these keys that it has."""
    if design.get("kind") != Kind.SINE:
        return None
    values = [design[key] for key in keys if isinstance(design.get(key), int | float)]
    return float(values[0]) if values and math.isfinite(values[0]) else None


def _at_current(tests: Sequence[SineTest], slow: Sequence[Strokes]) -> AtCurrent:
    ordered = sorted(tests, key=lambda test: test.cycles.peak_velocity_m_s)
    current = ordered[0].current_asked
    own = [one for one in slow if current is None or abs((one.current or 0.0) - current) < 2 * _ONE_CURRENT]
    rest = static_force([*own, *(strokes_of_sine(test.cycles) for test in ordered)])
    curve = None
    if len({round(math.log(test.cycles.peak_velocity_m_s) / 0.05) for test in ordered}) >= _LEAST_SPEEDS:
        v, force = at_peak_speed([test.cycles for test in ordered])
        curve = sided_fit(v, force, at_rest=rest.force.value, friction=rest.friction.value)
    return AtCurrent(current=current, tests=tuple(ordered), at_rest=rest, curve=curve)


def _by_current(tests: Sequence[SineTest]) -> list[list[SineTest]]:
    groups: dict[float, list[SineTest]] = {}
    for test in sorted(tests, key=lambda test: test.current_asked or 0.0):
        groups.setdefault(test.current_asked or 0.0, []).append(test)
    return list(groups.values())


def _ends(run: Run) -> tuple[float, float] | None:
    degc = run.channels.get("temperature")
    if degc is None:
        return None
    few = max(1, round(_END * degc.size))
    return float(np.mean(degc[:few])), float(np.mean(degc[-few:]))


def _temperatures(runs: Sequence[Run]) -> tuple[tuple[Temperature, ...], bool]:
    """The course over all runs that have a temperature: over minutes where their files say when each began."""
    warm = [run for run in runs if "temperature" in run.channels]
    began = [datetime.fromisoformat(run.created).timestamp() for run in warm]
    by_time = len(set(began)) == len(began) > 1
    found = []
    for number, (run, start) in enumerate(zip(warm, began, strict=True), 1):
        degc = run.channels["temperature"]
        at = np.linspace(0, degc.size - 1, min(degc.size, 60)).round().astype(np.int64)
        minutes = (start - min(began) + at / run.sample_rate_hz) / 60.0
        found.append(
            Temperature(run=_name(run), at=minutes if by_time else number - 0.4 + 0.8 * at / degc.size, degc=degc[at])
        )
    return tuple(sorted(found, key=lambda one: float(one.at[0]))), by_time


def _name(run: Run) -> str:
    return run.path.name if run.path is not None else run.run_id


def row(test: SineTest, *, with_model: bool = False) -> dict[str, float | str | None]:
    """The figures of one test, SI; ``force_rebound`` and ``force_compression`` are those at the peak speeds."""
    cycles = test.cycles
    speeds, forces = at_peak_speed([cycles])
    force, widths = cycles.loop()[2], hysteresis_widths(cycles)
    start, end = test.temperature or (None, None)
    figures: dict[str, float | str | None] = {
        "run": cycles.name,
        "frequency_asked": test.frequency_asked,
        "amplitude_asked": test.amplitude_asked,
        "frequency": cycles.frequency_hz,
        "amplitude": cycles.amplitude_m,
        "peak_velocity": cycles.peak_velocity_m_s,
        "current": cycles.current,
        "force_max": float(force.max()),
        "force_min": float(force.min()),
        "speed_rebound": float(speeds[0]),
        "speed_compression": float(speeds[1]),
        "force_rebound": float(forces[0]),
        "force_compression": float(forces[1]),
        "hysteresis_width": max(widths),
        "hysteresis_width_rebound": widths[0],
        "hysteresis_width_compression": widths[1],
        "dynamic_stiffness": dynamic_stiffness(cycles),
        "loss_factor": loss_factor(cycles),
        "energy_per_cycle": energy_per_cycle(cycles),
        "loop_shape": loop_shape(cycles),
        "temperature_start": start,
        "temperature_end": end,
    }
    if not with_model:
        return figures
    beside = None if test.simulated is None else test.simulated.loop()[2]
    return figures | {
        "force_max_simulated": None if beside is None else float(beside.max()),
        "force_min_simulated": None if beside is None else float(beside.min()),
        "energy_per_cycle_simulated": None if test.simulated is None else energy_per_cycle(test.simulated),
    }


def sheet_to_json(sheet: Sheet) -> dict[str, Any]:  # Any: JSON
    """All figures of the sheet, SI."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "specimen": sheet.specimen,
        "tests": [row(test, with_model=sheet.with_model) for test in sheet.tests],
        "currents": [_group_to_json(group) for group in sheet.currents],
    }


def _group_to_json(group: AtCurrent) -> dict[str, Any]:
    rest = group.at_rest
    return {
        "current": group.current,
        "force_at_rest": asdict(rest.force),
        "stiffness": asdict(rest.stiffness),
        "friction": asdict(rest.friction),
        "slowest_speed": rest.slowest_m_s,
        "from_tests": list(rest.tests),
        "curve": None if group.curve is None else _curve_to_json(group.curve),
    }


def _curve_to_json(curve: SidedCurve) -> dict[str, Any]:
    sides = {"rebound": curve.rebound, "compression": curve.compression}
    return {
        name: {
            key: {"value": value, "std": float(std)}
            for key, value, std in zip(("c", "w_knee", "c_far"), (s.c, s.w_knee, s.c_far), s.std, strict=True)
        }
        for name, s in sides.items()
    } | {"rms": curve.rms}
