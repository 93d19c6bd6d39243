"""Gas force, spring rate and friction from a triangle at crawl speed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.harmonic import TriangleSpec, triangle
from excitation.plan import Test
from rigctl.errors import ProcedureError
from rigctl.procedures.averages import correlation_samples
from rigctl.procedures.criteria import CRAWL_MARGIN
from rigctl.runfile import Run

__all__ = ["Crawl", "CrawlSettings", "Estimate", "crawl_of", "crawl_test"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A value and its standard uncertainty, in one unit."""

    value: float
    uncertainty: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CrawlSettings:
    """The triangle: amplitude, speed, cycles; a first cycle more is played and not used."""

    amplitude_m: float = 0.01
    speed_m_s: float = 0.005
    cycles: int = 3
    current_a: float | None = None
    sample_rate_hz: float = 1000.0

    def __post_init__(self) -> None:
        if not 0 < self.speed_m_s <= 0.05:
            raise ProcedureError(f"crawl: speed is {self.speed_m_s} m/s: a crawl lies above 0 and up to 0.05 m/s")
        if not 0 < self.amplitude_m < 1 or self.cycles < 1:
            raise ProcedureError(
                f"crawl: amplitude is {self.amplitude_m} m and cycles {self.cycles}: both must be positive"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Crawl:
    """What a crawl tells, at mid-stroke of the run and at its speed and temperature.

    The friction is half the difference between the two directions: at this speed it contains the viscous force, and
    friction that has not broken away is not in it.
    """

    gas_n: Estimate  # mean of the two directions, tension positive: negative where the specimen pushes
    spring_n_m: Estimate
    friction_n: Estimate
    speed_m_s: float
    amplitude_m: float
    temperature_degc: float | None
    samples: int
    run: str

    def as_json(self) -> dict[str, Any]:
        """The result as a JSON object. Any: numbers and texts."""
        return asdict(self)

    def __str__(self) -> str:
        return (
            f"gas force {_text(self.gas_n, 'N')}, spring rate {_text(self.spring_n_m, 'N/m')}, "
            f"friction {_text(self.friction_n, 'N')} at {1e3 * self.speed_m_s:g} mm/s"
        )


def _text(one: Estimate, unit: str) -> str:
    return f"{one.value:.4g} {unit} ± {2 * one.uncertainty:.2g} (k = 2)"


def crawl_test(settings: CrawlSettings | None = None, name: str = "crawl") -> Test:
    """The test to play: a slow triangle around mid-stroke."""
    settings = settings or CrawlSettings()
    frequency = settings.speed_m_s / (4 * settings.amplitude_m)
    spec = TriangleSpec(
        sample_rate_hz=settings.sample_rate_hz,
        amplitude_m=settings.amplitude_m,
        frequency_hz=frequency,
        cycles=settings.cycles,
        settling_cycles=1,
        current_a=settings.current_a,
        corner_time_s=0.02 / frequency,
    )
    return Test(name=name, excitation=triangle(spec))


def crawl_of(run: Run) -> Crawl:
    """Evaluate the run of a crawl.

    F = F₀ + k x + q x² + (R + r x) sign v, by least squares over the parts of constant speed; F₀ is the gas force at
    x = 0, k the spring rate there, R the friction. The covariance of the least squares is multiplied by the
    correlation time of the residual. The uncertainties of tare and calibration, where the run has them, are added to
    that of the gas force; a tare and an offset do not change the other two.

    Raises
    ------
    ProcedureError
        When the run is no slow triangle.
    """
    x, force, command = (_channel(run, name) for name in ("displacement", "force", "displacement_command"))
    side, used = _strokes(command, run)
    x, force, side = x[used], force[used], side[used]
    if min(np.count_nonzero(side > 0), np.count_nonzero(side < 0)) < 100:
        raise ProcedureError(f"run {run.run_id}: too few samples of constant speed in both directions: no crawl")
    scale = float(np.max(np.abs(x)))
    columns = np.column_stack([np.ones_like(x), x / scale, (x / scale) ** 2, side, side * x / scale])
    solution, covariance = _least_squares(columns, force)
    deviation = np.sqrt(np.diag(covariance))
    constant = 0.0 if run.setup.tare is None else run.setup.tare.uncertainty_n
    constant = float(
        np.hypot(constant, max((c.uncertainty for c in run.setup.calibrations if c.channel == "force"), default=0))
    )
    temperature = run.channels.get("temperature")
    return Crawl(
        gas_n=Estimate(value=float(solution[0]), uncertainty=float(np.hypot(deviation[0], constant))),
        spring_n_m=Estimate(value=float(solution[1] / scale), uncertainty=float(deviation[1] / scale)),
        friction_n=Estimate(value=float(solution[3]), uncertainty=float(deviation[3])),
        speed_m_s=float(np.median(np.abs(np.diff(command)))) * run.sample_rate_hz,
        amplitude_m=float(np.max(np.abs(command))),
        temperature_degc=None if temperature is None else float(np.mean(temperature)),
        samples=x.size,
        run=run.run_id,
    )


def _channel(run: Run, name: str) -> NDArray[np.float64]:
    if name not in run.channels:
        raise ProcedureError(f"run {run.run_id} has no channel {name}")
    return run.channels[name]


def _strokes(command: NDArray[np.float64], run: Run) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Direction of each sample, and whether it lies in the part of constant speed of a stroke after the first cycle."""
    amplitude = float(np.max(np.abs(command)))
    speed = np.gradient(command)
    usual = float(np.median(np.abs(speed)))
    if run.excitation_kind != "triangle" or usual == 0:
        raise ProcedureError(f"run {run.run_id} is a {run.excitation_kind}: a crawl is a slow triangle")
    side = np.sign(speed)
    constant = np.abs(np.abs(speed) - usual) < 0.01 * usual
    travelled = 1.0 + side * command / amplitude  # 0 at the turning point before, 2 at the next one
    used = constant & (travelled > 2 * CRAWL_MARGIN) & (travelled < 2.0 - 0.1 * CRAWL_MARGIN)
    used[: run.period_samples] = False
    return side, used


def _least_squares(
    columns: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    solution: NDArray[np.float64] = np.linalg.lstsq(columns, values, rcond=None)[0].astype(np.float64)
    residual = values - columns @ solution
    variance = float(residual @ residual) / (values.size - columns.shape[1])
    inverse = np.linalg.inv(columns.T @ columns)
    covariance: NDArray[np.float64] = inverse * variance * correlation_samples(residual)
    return solution, covariance
