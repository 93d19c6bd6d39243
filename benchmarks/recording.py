"""Runs of a simulated specimen: an excitation played in the simulated rig, or a motion that is prescribed exactly."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from excitation.kernel_cache import keyed
from excitation.signal import Excitation
from rigctl.runfile import Run
from sim_rig import damper
from sim_rig.parameters import Damper
from sim_rig.plant import SimulatedPlant
from sim_rig.specimens import SPECIMENS, Specimen

_UNITS = {"force": "N", "displacement": "m", "current": "A"}
_RAMP_S = 1.0  # to the first set-point, before the record begins


def recorded(specimen: str | Specimen, excitation: Excitation, *, seed: int, name: str, noise: float = 1.0) -> Run:
    """The run that a rig records of an excitation; `noise` is the factor on the noise of every sensor.

    What the actuator makes of the set-points is measured, not the set-points: its lag is in the displacement.
    """
    one = SPECIMENS[specimen] if isinstance(specimen, str) else specimen
    sensors = type(one.noise)(
        force_n=noise * one.noise.force_n,
        displacement_m=noise * one.noise.displacement_m,
        current_a=noise * one.noise.current_a,
    )
    plant = SimulatedPlant(one.damper, sensors, seed=seed, start_degc=25.0)
    plant.set_rate(excitation.sample_rate_hz)
    x = excitation.displacement_m
    current = np.zeros(x.size) if excitation.current_a is None else excitation.current_a
    ramp = np.linspace(0.0, 1.0, round(_RAMP_S * excitation.sample_rate_hz))
    plant.play(np.column_stack([x[0] * (3.0 - 2.0 * ramp) * ramp**2, np.full(ramp.size, current[0])]))
    plant.begin_run()
    read = plant.play(np.column_stack([x, current]))
    channels = {"force": read[:, 0].copy(), "displacement": read[:, 1].copy()}
    if excitation.current_a is not None:
        channels["current"] = read[:, 2].copy()
    return Run(
        run_id=name, created="2026-01-01T00:00:00+00:00", specimen=one.name, sample_rate_hz=excitation.sample_rate_hz,
        period_samples=excitation.period_samples, excitation_kind=str(excitation.kind), status="complete",
        channels=channels, units={key: _UNITS[key] for key in channels},
    )  # fmt: skip


def sine_force(
    specimen: Specimen, amplitude_m: float, frequency_hz: float, points: int, *, settling: int = 1, fine: int = 8
) -> NDArray[np.float64]:
    """Force over one period of a sine after `settling` others, (points,), N, without noise."""
    omega, h = 2.0 * np.pi * frequency_hz, 1.0 / (frequency_hz * points * fine)
    turn = 2.0 * np.pi * np.arange((settling + 1) * points * fine) / (points * fine)
    motion = amplitude_m * np.column_stack([np.sin(turn), omega * np.cos(turn), -(omega**2) * np.sin(turn)])
    body = np.zeros(damper.STATE)
    body[damper.BODY], body[damper.SIGN], body[damper.TRAVEL] = 25.0, 1.0, 1.0
    cold = specimen.damper._replace(heat_capacity=1e12)  # a test at a stated temperature
    return np.asarray(_along(cold, body, motion, h)[settling * points * fine :: fine])


def _loop(function: Callable[..., Any]) -> Any:
    """Compiled, and kept as long as this file and the kernel of the rig, which it calls, stay."""
    return keyed(njit(cache=True)(function), Path(__file__), Path(damper.__file__).parent)


@_loop
def _along(p: Damper, body: NDArray[np.float64], motion: NDArray[np.float64], h: float) -> NDArray[np.float64]:
    force, scratch = np.empty(motion.shape[0]), np.zeros(damper.RINGS)
    for k in range(motion.shape[0]):
        force[k] = damper.step(p, body, scratch, motion[k, 0], motion[k, 1], motion[k, 2], 0.0, h)
    return force
