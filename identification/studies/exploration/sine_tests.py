"""The tests of an exploration: steady sines, their cycle to simulate, and their three figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.motion import Motion
from identification.steady import Cycles, shape_of, steady_cycles
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_SETTLING = 2  # cycles before the one that counts, where a model knows no better


@dataclass(frozen=True, slots=True, kw_only=True)
class SineTest:
    """One steady sine test: a cycle of its measured displacement, (N,) each, and its figures, (3,)."""

    name: str
    frequency_hz: float
    amplitude_m: float
    x: Floats
    v: Floats
    x_line: complex  # of the first harmonic
    order: int  # harmonics of the force that the measured loop has
    current: float
    measured: Floats

    @property
    def dt(self) -> float:
        """Interval of the points, s."""
        return 1.0 / (self.frequency_hz * self.x.size)

    def motion(self) -> Motion:
        """Periods of the test to simulate any model along; the last is settled."""
        n = (_SETTLING + 1) * self.x.size
        x, v = np.resize(self.x, n), np.resize(self.v, n)
        a = -((2.0 * np.pi * self.frequency_hz) ** 2) * (x - float(np.mean(self.x)))
        return Motion(
            dt=self.dt, x=x, v=v, a=a, i=np.full(n, self.current), temperature=np.full(n, 25.0),
            t=np.arange(n, dtype=np.float64) * self.dt, period=self.x.size, settle=_SETTLING,
        )  # fmt: skip

    def figures(self, force: Floats) -> Floats:
        """The figures of forces (N, L) along the cycle, (L, 3)."""
        lines = 2.0 * np.fft.rfft(force, axis=0)[: self.order + 1].T / force.shape[0]
        lines[:, 0] *= 0.5
        return figures_of(lines, self.x_line)


def figures_of(f_lines: NDArray[np.complex128], x_line: complex) -> Floats:
    """Dynamic stiffness |H|, N/m, loss angle arg H, rad, and loop shape of forces (L, K + 1), H = F/X, as (L, 3)."""
    h = f_lines[:, 1] / x_line
    return np.stack([np.abs(h), np.angle(h), shape_of(f_lines)], axis=1)


def sine_tests(runs: Sequence[Run], points: int) -> tuple[list[SineTest], list[str]]:
    """The tests of the runs that are steady sines, and the names of the others.

    Raises
    ------
    DataError
        Where no run is a steady sine, or where a measured force does not brake: a loss angle has then no share.
    """
    tests, others = [], []
    for run in runs:
        cycles = steady_cycles(run)
        if cycles is None:
            others.append(run.path.name if run.path is not None else run.run_id)
        else:
            tests.append(_test(cycles, points))
    if not tests:
        raise DataError("no run is a steady sine with a force that varies: an exploration compares whole cycles")
    return tests, others


def _test(cycles: Cycles, points: int) -> SineTest:
    t = np.arange(points) / (points * cycles.frequency_hz)
    x, v = cycles.motion(t)
    measured = figures_of(cycles.f_lines[None, :], complex(cycles.x_lines[1]))[0]
    if measured[1] <= 0.0:
        raise DataError(
            f"{cycles.name}: its loss angle is {np.degrees(measured[1]):.3g}°: force and displacement must have the "
            "same sign convention, extension and tension positive"
        )
    return SineTest(
        name=cycles.name, frequency_hz=cycles.frequency_hz, amplitude_m=cycles.amplitude_m, x=x, v=v,
        x_line=complex(cycles.x_lines[1]), order=cycles.f_lines.size - 1, current=cycles.current or 0.0,
        measured=measured,
    )  # fmt: skip
