"""Sine tests of an enriched Maxwell model, simulated by the general solver: for the tests of the studies."""

from __future__ import annotations

import numpy as np

from identification.models.motion import Motion
from identification.physical.literature import literature
from identification.physical.model import Model
from identification.physical.simulate import simulate
from rigctl.runfile import Run

VALUES = {
    "relaxing_compliance.k1": 6e6,
    "relaxing_compliance.k2": 9e6,
    "relaxing_compliance.c2": 3e5,
    "arctan_damping.F1": 8000.0,
    "arctan_damping.S": 60.0,
    "arctan_damping.d": 9000.0,
    "arctan_damping.F2": 0.0,
}
VARIED = ("relaxing_compliance.k1", "relaxing_compliance.k2", "relaxing_compliance.c2")
SINES = ((0.002, 0.5), (0.002, 4.0), (0.01, 1.0))  # amplitude in m, frequency in Hz


def maxwell(**changed: float) -> Model:
    values = {name: changed.get(name.partition(".")[2], value) for name, value in VALUES.items()}
    return literature("enriched Maxwell", values)


def sine_motion(amplitude: float, frequency: float, points: int, cycles: int) -> Motion:
    t = np.arange(points * cycles) / (points * frequency)
    omega = 2.0 * np.pi * frequency
    x = amplitude * np.sin(omega * t)
    return Motion(
        dt=1.0 / (points * frequency), x=x, v=amplitude * omega * np.cos(omega * t), a=-(omega**2) * x,
        i=np.zeros(t.size), temperature=np.full(t.size, 25.0), t=t, period=points, settle=2,
    )  # fmt: skip


def sine_runs(model: Model) -> list[Run]:
    return [_run(model, amplitude, frequency) for amplitude, frequency in SINES]


def _run(model: Model, amplitude: float, frequency: float) -> Run:
    motion = sine_motion(amplitude, frequency, 500, 6)
    channels = {"displacement": motion.x, "force": simulate(model, motion).force}
    return Run(
        run_id=f"{1e3 * amplitude:g} mm {frequency:g} Hz", created="2026-01-01T00:00:00+00:00", specimen="yaw",
        sample_rate_hz=1.0 / motion.dt, period_samples=500, excitation_kind="sine", status="complete",
        channels=channels, units={"displacement": "m", "force": "N"}, design=None, events=(), path=None,
    )  # fmt: skip
