"""Thirty sine tests of a simulated yaw damper, as a study of 2024 measured them, and its model with guessed springs."""

from __future__ import annotations

import numpy as np

from benchmarks.recording import sine_force
from identification.physical.literature import literature
from identification.physical.model import Model
from rigctl.runfile import Run
from sim_rig.specimens import YAW

VARIED = ("relaxing_compliance.k1", "relaxing_compliance.k2", "relaxing_compliance.c2")
_SERIES = ((0.002, 8.117), (0.005, 8.117), (0.010, 4.058), (0.015, 2.705), (0.025, 1.623))  # m, highest Hz at 255 mm/s
_SLOWEST_HZ = 0.0068
_POINTS, _CYCLES = 1000, 5


def thirty_tests(noise: float = 0.002) -> list[Run]:
    """2 … 25 mm, 0.0068 … 8.117 Hz, up to 255 mm/s: six frequencies an amplitude; `noise`: share of rms force."""
    rng = np.random.default_rng(7)
    return [
        _run(amplitude, float(frequency), noise, rng)
        for amplitude, top in _SERIES
        for frequency in np.geomspace(_SLOWEST_HZ, top, 6)
    ]


def guessed() -> Model:
    """The enriched Maxwell model: its dashpot from the force–velocity diagram, its springs and c2 a guess."""
    dashpot = {"F1": YAW.damper.f1, "S": YAW.damper.slope, "d": YAW.damper.c}
    values = {f"arctan_damping.{name}": value for name, value in dashpot.items()}
    springs = {VARIED[0]: 6.0e6, VARIED[1]: 2.0e7, VARIED[2]: 1.0e4}
    return literature("enriched Maxwell", values | springs)


def _run(amplitude: float, frequency: float, noise: float, rng: np.random.Generator) -> Run:
    force = np.tile(sine_force(YAW, amplitude, frequency, _POINTS, settling=3), _CYCLES)
    force += noise * float(np.std(force)) * rng.standard_normal(force.size)
    turn = 2.0 * np.pi * np.arange(force.size) / _POINTS
    return Run(
        run_id=f"{1e3 * amplitude:g} mm, {frequency:.4g} Hz", created="2026-01-01T00:00:00+00:00", specimen="yaw",
        sample_rate_hz=frequency * _POINTS, period_samples=_POINTS, excitation_kind="sine", status="complete",
        channels={"force": force, "displacement": amplitude * np.sin(turn)}, units={"force": "N", "displacement": "m"},
    )  # fmt: skip
