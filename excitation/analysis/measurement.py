"""What an analysis is given: whole periods of inputs and of the force, of one or several realisations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.errors import AnalysisError

__all__ = ["Measurement", "Realisation"]

Floats = NDArray[np.float64]

_HIGHEST = 1e30  # of a sample, whatever its unit: squares and sums of squares stay numbers
_SHORTEST = 8  # samples of a period: fewer have no line between the first and the Nyquist line


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Realisation:
    """One played signal with its repetitions.

    Raises AnalysisError where shapes do not match, a sample is no number of a machine, or the force does not vary.
    """

    name: str
    inputs: Floats  # (I, P, N): P periods of N samples of each input, in the units of the measurement
    force: Floats  # (P, N), N

    def __post_init__(self) -> None:
        if self.force.ndim != 2 or self.inputs.ndim != 3 or self.inputs.shape[1:] != self.force.shape:
            raise AnalysisError(
                f"{self.name}: inputs have the shape {self.inputs.shape} and the force {self.force.shape}: "
                "they must be (inputs, periods, samples) and (periods, samples)"
            )
        if self.force.shape[0] < 1 or self.force.shape[1] < _SHORTEST:
            raise AnalysisError(
                f"{self.name}: {self.force.shape[0]} periods of {self.force.shape[1]} samples: at least one of "
                f"{_SHORTEST} is needed"
            )
        if not (np.isfinite(self.inputs).all() and np.isfinite(self.force).all()):
            raise AnalysisError(f"{self.name}: a sample is not a finite number")
        highest = max(float(np.max(np.abs(self.inputs))), float(np.max(np.abs(self.force))))
        if highest > _HIGHEST:
            raise AnalysisError(f"{self.name}: a sample is {highest:.3g}: no machine goes beyond {_HIGHEST:g}")
        if float(np.ptp(self.force)) == 0.0:
            raise AnalysisError(f"{self.name}: force is {self.force[0, 0]:g} in every sample: check its sensor")

    @property
    def periods(self) -> int:
        return int(self.force.shape[0])

    @property
    def samples(self) -> int:
        """Samples of a period."""
        return int(self.force.shape[1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measurement:
    """Realisations of one design: the same rate, period and inputs. The first input is the displacement, m.

    ``excited`` are the lines that the design states, one array for each input; they are believed only where the
    measured spectrum agrees. Raises AnalysisError.
    """

    sample_rate_hz: float
    inputs: tuple[str, ...]  # "displacement", or "displacement" and "current"
    realisations: tuple[Realisation, ...]
    excited: tuple[NDArray[np.int64], ...] | None = None

    def __post_init__(self) -> None:
        if not self.realisations:
            raise AnalysisError("no run is given: give at least one with two periods")
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0.0):
            raise AnalysisError(f"sample_rate is {self.sample_rate_hz} Hz: it must be a positive number")
        first = self.realisations[0]
        for one in self.realisations:
            if one.samples != first.samples:
                raise AnalysisError(
                    f"{one.name} has periods of {one.samples} samples and {first.name} of {first.samples}: "
                    "realisations of one design have the same; analyse each design by itself"
                )
            if one.inputs.shape[0] != len(self.inputs):
                raise AnalysisError(
                    f"{one.name} has {one.inputs.shape[0]} inputs: {len(self.inputs)} are named "
                    f"({', '.join(self.inputs)})"
                )

    @property
    def samples(self) -> int:
        """Samples of a period."""
        return self.realisations[0].samples
