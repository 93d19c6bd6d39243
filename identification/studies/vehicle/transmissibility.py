"""How much of the ground's motion reaches an output: by stepped sine, and by multisine at all lines at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.models.protocol import SimulationModel
from identification.studies.pace import silent
from identification.studies.vehicle import grounds
from identification.studies.vehicle.parts import Part, rides
from identification.studies.vehicle.protocol import Ground, Vehicle
from identification.studies.vehicle.ride import Control, Ride

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

SETTLE_S = 2.5  # of a stepped sine after its rise: e^−5 of a mode of 1 Hz with 0.3 of critical damping is left
_CYCLES = 4  # that are measured


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Transmissibility:
    """The output's first harmonic over the ground's displacement at each frequency, (K,), complex; and by rms, (K,).

    A nonlinear damper also answers beside the line that excites it: `rms` of a stepped sine counts that too. Of a
    multisine it is the ratio of the powers at the lines, which differs from |ratio| where periods differ.
    """

    output: str
    frequency_hz: Floats
    ratio: Complex
    rms: Floats

    @property
    def peak(self) -> tuple[float, float]:
        """Frequency, Hz, and height of the highest ratio."""
        k = int(np.argmax(np.abs(self.ratio)))
        return float(self.frequency_hz[k]), float(np.abs(self.ratio[k]))


def sine_parts(
    vehicle: Vehicle,
    dampers: Mapping[str, SimulationModel],
    frequencies_hz: Sequence[float],
    amplitude_m: float,
    dt: float,
    control: Control | None = None,
) -> list[Part]:
    """The ride over each frequency of a stepped sine, from rest, at one amplitude of the ground.

    Raises DataError where a frequency or the amplitude cannot be.
    """
    return [
        Part(
            vehicle=vehicle, dampers=dampers, control=control,
            ground=grounds.sine(f, amplitude_m, 1.0 + SETTLE_S + _measured_s(f), dt),
        )
        for f in frequencies_hz
    ]  # fmt: skip


def by_sines(
    found: Sequence[Ride], parts: Sequence[Part], output: str, frequencies_hz: Sequence[float]
) -> Transmissibility:
    """The ratio at each frequency, from the rides of `sine_parts`."""
    ratios, rms = [], []
    for one, part, frequency in zip(found, parts, frequencies_hz, strict=True):
        ground = part.ground
        late = slice(-round(_measured_s(frequency) / ground.dt), None)
        turn = np.exp(-2j * np.pi * frequency * one.time[late])
        series = one.outputs[output][late]
        ratios.append(np.mean((series - series.mean()) * turn) / np.mean(ground.x[late, 0] * turn))
        rms.append(float(np.std(series) / np.std(ground.x[late, 0])))
    return Transmissibility(
        output=output, frequency_hz=np.array(frequencies_hz), ratio=np.array(ratios), rms=np.array(rms)
    )


def stepped_sine(
    vehicle: Vehicle,
    dampers: Mapping[str, SimulationModel],
    output: str,
    frequencies_hz: Sequence[float],
    amplitude_m: float,
    dt: float,
    *,
    control: Control | None = None,
    on_progress: Callable[[float, str], None] | None = None,
) -> Transmissibility:
    """The ratio at each frequency in turn, from rest, at one amplitude of the ground.

    Raises DataError and SimulationError as `ride` does.
    """
    parts = sine_parts(vehicle, dampers, frequencies_hz, amplitude_m, dt, control)
    found = rides(parts, on_progress or silent, f"{vehicle.name}, stepped sine")
    return by_sines(found, parts, output, frequencies_hz)


def _measured_s(frequency_hz: float) -> float:
    """Whole cycles, of a second at least."""
    return round(max(_CYCLES / frequency_hz, 1.0) * frequency_hz) / frequency_hz


def by_multisine(found: Ride, ground: Ground, output: str, lines: NDArray[np.int64], period: int) -> Transmissibility:
    """The best linear ratio at the excited lines from a ride over a multisine, from the periods after the first.

    What a nonlinear damper adds is scatter from line to line.
    """
    series, moved = found.outputs[output], ground.x[:, 0]
    rows = [np.fft.rfft(one[period:].reshape(-1, period), axis=1)[:, lines] for one in (series, moved)]
    ratio = np.mean(rows[0], axis=0) / np.mean(rows[1], axis=0)
    power = np.mean(np.abs(rows[0]) ** 2, axis=0) / np.mean(np.abs(rows[1]) ** 2, axis=0)
    return Transmissibility(
        output=output,
        frequency_hz=lines / (period * ground.dt),
        ratio=np.asarray(ratio, dtype=np.complex128),
        rms=np.asarray(np.sqrt(power), dtype=np.float64),
    )
