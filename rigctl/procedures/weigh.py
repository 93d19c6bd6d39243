"""The mass between load cell and specimen, from a small fast motion."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import JSON
from excitation.synthesis import excitation_from_config
from rigctl.errors import ProcedureError
from rigctl.preparation import Mass
from rigctl.procedures.criteria import DISTINCT_STIFFNESS, MASS_MISFIT, SKEW_SAMPLES
from rigctl.runfile import Run

__all__ = ["WeighSettings", "mass_of", "weigh_test"]

PERIOD_SAMPLES = 1000
LINE_SHARE = 1e-3  # of the strongest line's amplitude: lines below it are not excited


@dataclass(frozen=True, slots=True, kw_only=True)
class WeighSettings:
    """A random-phase multisine within this band and these peaks; periods after the first one are used."""

    from_hz: float = 8.0
    to_hz: float = 30.0
    displacement_m: float = 0.002
    velocity_m_s: float = 0.2
    acceleration_m_s2: float = 30.0
    periods: int = 8
    seed: int = 1
    current_a: float | None = None
    sample_rate_hz: float = 1000.0

    def __post_init__(self) -> None:
        if self.periods < 4:
            raise ProcedureError(f"weigh: periods is {self.periods}: the scatter needs 4 or more")


def weigh_test(settings: WeighSettings | None = None, name: str = "weigh") -> Test:
    """The test to play, without a specimen, or with one that is linear for small motion."""
    s = settings or WeighSettings()
    config: dict[str, JSON] = {
        "kind": str(Kind.MULTISINE),
        "sample_rate": s.sample_rate_hz,
        "period_samples": PERIOD_SAMPLES,
        "periods": s.periods,
        "seed": s.seed,
        "displacement": {
            "f_min": s.from_hz,
            "f_max": s.to_hz,
            "max_displacement": s.displacement_m,
            "max_velocity": s.velocity_m_s,
            "max_acceleration": s.acceleration_m_s2,
        },
    }
    return Test(name=name, excitation=excitation_from_config(config))


def mass_of(run: Run, *, with_specimen: bool = False) -> Mass:
    """Evaluate the run of a weighing.

    At every excited line ω: F = (k + iωc − ω²m) X, with real k, c, m by weighted least squares; the weights are the
    scatter of F from period to period. Where the lines scatter more than the periods, the covariance grows by χ²/ν.
    A possible delay between the two channels adds c · u(τ) to the uncertainty of m.

    Raises
    ------
    ProcedureError
        When the run is no periodic motion, when something with a stiffness is attached although `with_specimen` is
        not set, or when the lines do not follow the equation: then the force contains more than an inertia.
    """
    force, displacement = _spectra(run, "force"), _spectra(run, "displacement")
    frequency = np.arange(force.shape[1]) * run.sample_rate_hz / run.period_samples
    command = np.abs(_spectra(run, "displacement_command")[0])
    lines = command > LINE_SHARE * np.max(command[1:])
    lines[0] = False
    x, omega = displacement.mean(axis=0)[lines], 2 * np.pi * frequency[lines]
    scatter = np.std(force[:, lines], axis=0, ddof=1) / np.sqrt(force.shape[0])
    columns = np.stack([x, 1j * omega * x, -(omega**2) * x], axis=1)
    f = force.mean(axis=0)[lines]
    (k, c, m), covariance = _weighted(columns, f, np.sqrt(np.mean(scatter**2)))
    misfit = float(np.linalg.norm(f - columns @ np.array([k, c, m])) / np.linalg.norm(f))
    u_k = float(np.sqrt(covariance[0, 0]))
    u_m = float(np.hypot(np.sqrt(covariance[2, 2]), c * SKEW_SAMPLES / run.sample_rate_hz))
    noise = float(np.sqrt(np.sum(scatter**2)) / np.linalg.norm(f))
    if misfit > MASS_MISFIT + 3 * noise:
        raise ProcedureError(
            f"run {run.run_id}: {100 * misfit:.0f} % of the force follow neither a mass nor a spring "
            "nor a viscous damper: weigh without the specimen"
        )
    if not with_specimen and abs(k) > DISTINCT_STIFFNESS * u_k:
        raise ProcedureError(
            f"run {run.run_id}: the force contains a stiffness of {k:.3g} N/m ± {2 * u_k:.2g} N/m: "
            "something is attached: detach it, or say that a specimen is in"
        )
    return Mass(
        rig=run.rig.partition(" at ")[0],
        measured_at=datetime.now(UTC).isoformat(timespec="seconds"),
        mass_kg=m,
        uncertainty_kg=u_m,
        stiffness_n_m=k,
        stiffness_uncertainty_n_m=u_k,
        from_hz=float(omega[0] / (2 * np.pi)),
        to_hz=float(omega[-1] / (2 * np.pi)),
        run=run.run_id,
    )


def _spectra(run: Run, name: str) -> NDArray[np.complex128]:
    """The DFT of each period after the first one, (periods, lines)."""
    period = run.period_samples
    if not period or run.samples < 4 * period or name not in run.channels:
        raise ProcedureError(f"run {run.run_id}: a weighing needs force, displacement and four periods or more")
    values = run.channels[name][period : run.samples // period * period].reshape(-1, period)
    spectra: NDArray[np.complex128] = np.fft.rfft(values, axis=1) * 2 / period
    return spectra


def _weighted(
    columns: NDArray[np.complex128], values: NDArray[np.complex128], noise: float
) -> tuple[tuple[float, float, float], NDArray[np.float64]]:
    """Real parameters of a complex least-squares problem, noise of each complex value given."""
    stacked = np.concatenate([columns.real, columns.imag])
    right = np.concatenate([values.real, values.imag])
    scale = np.linalg.norm(stacked, axis=0)
    solution = np.linalg.lstsq(stacked / scale, right, rcond=None)[0] / scale
    residual = right - stacked @ solution
    variance = max(noise**2 / 2, float(residual @ residual) / (right.size - 3))
    inverse = np.linalg.inv((stacked / scale).T @ (stacked / scale)) / np.outer(scale, scale)
    k, c, m = (float(value) for value in solution)
    covariance: NDArray[np.float64] = inverse * variance
    return (k, c, m), covariance
