"""Error figures of a simulated force against a measured one."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from identification.eearth import eearth
from identification.errors import DataError
from identification.steady import loop_shape, steady_cycles
from rigctl.runfile import Run

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Figures of one comparison.

    rms in N; rrmsse in %, rms error over the rms of the measured force about its mean; fit in %, 100 is perfect;
    eearth, its three parts and iso_18571 from 0 to 1.
    """

    rms: float
    rrmsse: float
    fit: float
    eearth: float
    eearth_phase: float
    eearth_magnitude: float
    eearth_slope: float
    iso_18571: float


def score(run: Run) -> dict[str, float]:
    """Figures of `force_simulated` against `force` of a run, by name.

    Added to those of `Score`: the energy that each force took from the motion, J over the whole run, and, where the
    motion is a steady sine, the shape of each loop.

    Raises
    ------
    DataError
        when one of the two channels is missing, or the measured force is constant.
    """
    name = run.path.name if run.path is not None else run.run_id
    for channel in ("force", "force_simulated"):
        if channel not in run.channels:
            cure = "run `damper-rig simulate` first" if channel == "force_simulated" else "it must be measured"
            raise DataError(f"{name}: no channel '{channel}': {cure}")
    figures = asdict(score_signals(run.channels["force"], run.channels["force_simulated"]))
    if "displacement" in run.channels:
        for label, channel in (("measured", "force"), ("simulated", "force_simulated")):
            figures[f"energy_{label}"] = dissipated(run.channels[channel], run.channels["displacement"])
            cycles = steady_cycles(run, channel)
            if cycles is not None:
                figures[f"loop_shape_{label}"] = loop_shape(cycles)
    return figures


def score_signals(measured: Floats, simulated: Floats) -> Score:
    """Figures of a simulated signal (N,) against a measured one (N,), same unit.

    rms = √mean e²; rrmsse = 100·√(Σe²/Σ(F − mean F)²); fit = 100·(1 − ‖e‖/‖F − mean F‖); the others: see `eearth.py`.
    """
    centred = measured - measured.mean()
    size = float(np.linalg.norm(centred))
    if size == 0.0:
        raise DataError("the measured force is constant: there is nothing to compare with")
    error = measured - simulated
    ratio = float(np.linalg.norm(error)) / size
    parts = eearth(measured, simulated)
    return Score(
        rms=float(np.sqrt(np.mean(error**2))),
        rrmsse=100.0 * ratio,
        fit=100.0 * (1.0 - ratio),
        eearth=parts.score,
        eearth_phase=parts.phase,
        eearth_magnitude=parts.magnitude,
        eearth_slope=parts.slope,
        iso_18571=parts.iso_18571,
    )


def dissipated(force: Floats, displacement: Floats) -> float:
    """Energy ∫F dx that a damper took from the motion, J, by the trapezoidal rule; both (N,), N and m."""
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))
