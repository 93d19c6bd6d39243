"""A run with the inertia between load cell and specimen removed from its force, offline."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from rigctl.errors import ProcedureError
from rigctl.preparation import Mass
from rigctl.runfile import Run, with_channel

__all__ = ["Compensated", "compensate"]

ORDER = 4  # of the local polynomial; even, so that the second derivative is exact to the fifth order
FLAT_TO = 0.01  # share by which the acceleration may be too small at the end of its band
LONGEST = 401


@dataclass(frozen=True, slots=True, kw_only=True)
class Compensated:
    """The new run, and how well its force is known, N."""

    run: Run
    bandwidth_hz: float  # to which the acceleration is right to 1 %
    from_mass_n: float  # rms of u(m) · a
    from_acceleration_n: float  # m · u(a): noise of the displacement, differentiated twice

    @property
    def uncertainty_n(self) -> float:
        """Standard uncertainty that the compensation adds, rms over the run."""
        return float(np.hypot(self.from_mass_n, self.from_acceleration_n))

    def __str__(self) -> str:
        return (
            f"force of the specimen ± {2 * self.uncertainty_n:.2g} N (k = 2, rms) up to {self.bandwidth_hz:.3g} Hz: "
            f"mass {2 * self.from_mass_n:.2g} N, acceleration {2 * self.from_acceleration_n:.2g} N"
        )


def compensate(run: Run, mass: Mass, *, bandwidth_hz: float = 80.0) -> Compensated:
    """Remove mass · acceleration from the force: the original is kept as channel ``force_measured``.

    The acceleration is the measured one where the run has it, else the second derivative of a local polynomial of
    fourth order through the displacement (Savitzky and Golay 1964), over the longest window that keeps it right to 1 %
    up to the bandwidth. The standard uncertainty of each sample is channel ``force_uncertainty``:
    u² = (a · u(m))² + (m · u(a))².

    Raises
    ------
    ProcedureError
        When the run has no force or displacement, is too short, was compensated before, or comes from another rig.
    """
    if run.setup.compensated is not None:
        raise ProcedureError(f"run {run.run_id} was compensated before, with a {run.setup.compensated}")
    if not {"force", "displacement"} <= set(run.channels):
        raise ProcedureError(f"run {run.run_id} needs the channels force and displacement")
    own = run.rig.partition(" at ")[0]
    if mass.rig and own and mass.rig != own:
        raise ProcedureError(f"run {run.run_id} is of the rig {own!r}, the mass was weighed on {mass.rig!r}")
    acceleration, noise, reached = _acceleration(run, bandwidth_hz)
    uncertainty = np.hypot(acceleration * mass.uncertainty_kg, mass.mass_kg * noise)
    force = run.channels["force"] - mass.mass_kg * acceleration
    made = with_channel(run, "force_measured", run.channels["force"], "N")
    made = with_channel(with_channel(made, "force", force, "N"), "force_uncertainty", uncertainty, "N")
    return Compensated(
        run=replace(made, setup=replace(run.setup, compensated=mass), path=None),
        bandwidth_hz=reached,
        from_mass_n=float(np.sqrt(np.mean(acceleration**2))) * mass.uncertainty_kg,
        from_acceleration_n=abs(mass.mass_kg) * noise,
    )


def _acceleration(run: Run, bandwidth_hz: float) -> tuple[NDArray[np.float64], float, float]:
    """Acceleration (n,), its standard uncertainty from noise, and its bandwidth."""
    rate = run.sample_rate_hz
    if "acceleration" in run.channels:
        return run.channels["acceleration"], 0.0, rate / 2
    if not 0 < bandwidth_hz < rate / 4:
        raise ProcedureError(f"bandwidth is {bandwidth_hz:g} Hz: it must lie above 0 and below {rate / 4:g} Hz")
    window, reached = _window(rate, bandwidth_hz)
    x = run.channels["displacement"]
    if x.size < 2 * window:
        raise ProcedureError(f"run {run.run_id}: {x.size} samples are too few for a window of {window}")
    acceleration: NDArray[np.float64] = savgol_filter(x, window, ORDER, deriv=2, delta=1 / rate)
    gain = float(np.linalg.norm(savgol_coeffs(window, ORDER, deriv=2, delta=1 / rate)))
    return acceleration, gain * white_noise(x), reached


def _window(rate_hz: float, bandwidth_hz: float) -> tuple[int, float]:
    """The longest window whose second derivative is right to 1 % up to the bandwidth, and where it ceases to be."""
    best, reached = ORDER + 1, rate_hz / 4
    for window in range(ORDER + 1, LONGEST, 2):
        limit = _flat_to(window) * rate_hz
        if limit < bandwidth_hz:
            break
        best, reached = window, limit
    return best, reached


def _flat_to(window: int) -> float:
    """The lowest frequency, in cycles per sample, at which the second derivative is wrong by 1 %."""
    taps = savgol_coeffs(window, ORDER, deriv=2, use="dot")
    frequency = np.linspace(0.5 / window, 0.5, 200)
    lags = np.arange(window) - window // 2
    response = np.cos(2 * np.pi * np.outer(frequency, lags)) @ taps / -((2 * np.pi * frequency) ** 2)
    wrong = np.flatnonzero(np.abs(response - 1) > FLAT_TO)
    return float(frequency[wrong[0]]) if wrong.size else 0.5


def white_noise(x: NDArray[np.float64]) -> float:
    """Standard deviation of white noise on a smooth signal: its fourth differences, whose noise gain is √70."""
    differences = np.diff(x, 4)
    return float(1.4826 * np.median(np.abs(differences - np.median(differences))) / np.sqrt(70))
