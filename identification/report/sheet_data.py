"""What the page of a report shows of the characteristic sheet: figures of the tests, at rest, and two charts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.errors import ReportFileError

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]  # what is only looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetTests:
    """The steady sines by current, then by speed, (T,) each, SI; `current` is NaN where there is none.

    Force and speed at the peak speeds of a cycle; `width` is the hysteresis width, the wider side.
    """

    runs: tuple[str, ...]
    amplitude: Floats
    frequency: Floats
    current: Floats
    speed_rebound: Floats
    force_rebound: Floats
    speed_compression: Floats
    force_compression: Floats
    width: Floats
    energy: Floats
    stiffness: Floats

    def __post_init__(self) -> None:
        _rows(len(self.runs), amplitude=self.amplitude, frequency=self.frequency, current=self.current,
              speed_rebound=self.speed_rebound, force_rebound=self.force_rebound,
              speed_compression=self.speed_compression, force_compression=self.force_compression,
              width=self.width, energy=self.energy, stiffness=self.stiffness)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetAtRest:
    """Force at rest, its stiffness and friction at each current, (C,) each, SI, with standard deviations."""

    current: Floats
    force: Floats
    force_std: Floats
    stiffness: Floats
    stiffness_std: Floats
    friction: Floats
    friction_std: Floats
    slowest: Floats  # speed of the slowest test

    def __post_init__(self) -> None:
        _rows(self.current.size, current=self.current, force=self.force, force_std=self.force_std,
              stiffness=self.stiffness, stiffness_std=self.stiffness_std, friction=self.friction,
              friction_std=self.friction_std, slowest=self.slowest)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetCurve:
    """The curve of each side at one current, row `at` of `SheetAtRest`, over speed (V,), m/s: forces (V,), N."""

    at: int
    speed: Singles
    rebound: Singles
    compression: Singles

    def __post_init__(self) -> None:
        _rows(self.speed.size, speed=self.speed, rebound=self.rebound, compression=self.compression)


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetLoop:
    """The closed loop of the fastest test at one current, (M,) each: m, m/s and N."""

    label: str
    displacement: Singles
    velocity: Singles
    force: Singles

    def __post_init__(self) -> None:
        _rows(self.force.size, displacement=self.displacement, velocity=self.velocity, force=self.force)


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetData:
    """The sheet of the runs that were explained."""

    tests: SheetTests
    at_rest: SheetAtRest
    curves: tuple[SheetCurve, ...]
    loops: tuple[SheetLoop, ...]

    def __post_init__(self) -> None:
        if not self.tests.runs:
            raise ReportFileError("tests has no run: a sheet has one at least")
        for curve in self.curves:
            if not 0 <= curve.at < self.at_rest.current.size:
                raise ReportFileError(f"a curve is at row {curve.at}: at_rest has {self.at_rest.current.size}")


def _rows(length: int, **columns: NDArray[np.floating]) -> None:
    """Raise unless each is one row of this length."""
    for name, values in columns.items():
        if values.shape != (length,):
            raise ReportFileError(f"{name} has shape {values.shape}: ({length},) is due")
