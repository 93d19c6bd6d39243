"""The stroke–velocity chart: what the service asks for, where a model was trained, and what a rig can do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from excitation.rig import Envelope
from identification.errors import DataError
from identification.models.inputs import motion_of
from identification.models.protocol import SimulationModel
from identification.models.simulation import name_of
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_MOST_POINTS = 4000  # of one motion in the chart


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Covered:
    """Stroke (m, about the middle) and velocity (m/s) of some motion, (N,) each, with the hull of both, (H, 2)."""

    name: str
    x: Floats
    v: Floats
    hull: Floats

    @property
    def extremes(self) -> tuple[float, float]:
        """The longest stroke either way, m, and the highest speed, m/s."""
        return float(np.max(np.abs(self.x))), float(np.max(np.abs(self.v)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """A rectangle of stroke and velocity: of a training range or of a rig; infinite where nothing limits it."""

    name: str
    stroke: tuple[float, float]
    velocity: tuple[float, float]

    def outside(self, motion: Covered) -> float:
        """Share of the samples of a motion that lie outside."""
        (low, high), (slow, fast) = self.stroke, self.velocity
        beyond = (motion.x < low) | (motion.x > high) | (motion.v < slow) | (motion.v > fast)
        return float(np.mean(beyond))


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """The service, what the model was trained on (motions, a stated range, both or none), and the rig."""

    service: Covered
    trained: tuple[Covered, ...]
    limits: tuple[Limits, ...]

    @property
    def outside_hull(self) -> float:
        """Share of the service's samples outside the hull of the training motions; NaN without such."""
        if not self.trained:
            return float("nan")
        points = np.vstack([one.hull for one in self.trained])
        hull = ConvexHull(points)
        service = np.column_stack([self.service.x, self.service.v])
        beyond = service @ hull.equations[:, :2].T + hull.equations[:, 2]
        return float(np.mean(np.max(beyond, axis=1) > 1e-12))


def covered(name: str, x: Floats, v: Floats) -> Covered:
    """A motion for the chart, its stroke about its mean; raises DataError where it does not move."""
    x = x - float(np.mean(x))
    points = np.column_stack([x, v])
    try:
        corners = points[ConvexHull(points / np.maximum(np.ptp(points, axis=0), 1e-12)).vertices]
    except (QhullError, ValueError) as error:
        raise DataError(f"{name}: stroke and velocity lie on a line or a point: it is no motion") from error
    return Covered(name=name, x=x, v=v, hull=corners)


def covered_by_runs(name: str, runs: Sequence[Run]) -> Covered:
    """The motion of several runs, each about its own mean."""
    motions = [motion_of(run) for run in runs]
    if not motions:
        raise DataError(f"{name}: no run is given")
    for run, motion in zip(runs, motions, strict=True):
        if float(np.ptp(motion.x)) == 0.0:
            raise DataError(f"{name_of(run)}: the displacement does not move")
    x = np.concatenate([motion.x - motion.x.mean() for motion in motions])
    return covered(name, x, np.concatenate([motion.v for motion in motions]))


def training_limits(model: SimulationModel) -> Limits | None:
    """The stated training range of a model as a rectangle; None where it states none of stroke or velocity."""
    known = model.training_range
    if known is None or not {"displacement", "velocity"} & set(known.limits):
        return None
    everything = (-np.inf, np.inf)
    return Limits(
        name=f"training range of {model.name}",
        stroke=known.limits.get("displacement", everything),
        velocity=known.limits.get("velocity", everything),
    )


def rig_limits(envelope: Envelope) -> Limits:
    """What a rig can do, as a rectangle."""
    motion = envelope.motion
    stroke = getattr(motion, "max_displacement_m", None) or np.inf
    speed = getattr(motion, "max_velocity_m_s", None) or np.inf
    return Limits(name=envelope.name or "rig", stroke=(-stroke, stroke), velocity=(-speed, speed))


def range_of(service: Covered, trained: Sequence[Covered], limits: Sequence[Limits | None]) -> Range:
    """The chart's content; raises DataError where nothing is given to compare the service with."""
    given = tuple(one for one in limits if one is not None)
    if not trained and not given:
        raise DataError(
            "nothing to compare the service with: the model states no training range of stroke or velocity; "
            "give the runs that it was trained on, or a rig"
        )
    return Range(service=service, trained=tuple(trained), limits=given)


def service_range(
    service: Sequence[Run],
    trained: Sequence[Run] = (),
    *,
    model: SimulationModel | None = None,
    envelope: Envelope | None = None,
    name: str = "",
) -> Range:
    """The chart of runs of the service beside the runs or the stated range of a training, and a rig.

    Raises
    ------
    DataError
        one line: a run that does not move, or nothing to compare with.
    """
    stated = None if model is None else training_limits(model)
    rig = None if envelope is None else rig_limits(envelope)
    learned = [covered_by_runs("the training runs", trained)] if trained else []
    called = name or (name_of(service[0]) if len(service) == 1 else f"{len(service)} runs")
    return range_of(covered_by_runs(called, service), learned, [stated, rig])


def range_data(found: Range) -> dict[str, Any]:
    """The figures as JSON data, SI. Any: what JSON can say."""
    stroke, speed = found.service.extremes
    share = found.outside_hull
    return {
        "service": {"name": found.service.name, "stroke": stroke, "velocity": speed},
        "trained": [
            {"name": one.name, "stroke": one.extremes[0], "velocity": one.extremes[1]} for one in found.trained
        ],
        "share_outside_training": share if np.isfinite(share) else None,
        "limits": [{"name": one.name, "share_outside": one.outside(found.service)} for one in found.limits],
    }


def range_text(found: Range) -> str:
    """What came out, in a few lines."""
    stroke, speed = found.service.extremes
    lines = [f"service {found.service.name}: stroke to ±{1e3 * stroke:.4g} mm, velocity to ±{speed:.4g} m/s"]
    for one in found.trained:
        most, fast = one.extremes
        lines.append(f"trained on {one.name}: stroke to ±{1e3 * most:.4g} mm, velocity to ±{fast:.4g} m/s")
    if found.trained:
        lines.append(f"{100.0 * found.outside_hull:.3g} % of the service lies outside what was trained on")
    lines += [
        f"{100.0 * one.outside(found.service):.3g} % of the service lies outside {one.name}" for one in found.limits
    ]
    return "\n".join(lines)


def thinned(motion: Covered) -> tuple[Floats, Floats]:
    """Points of a motion for a chart."""
    every = max(1, motion.x.size // _MOST_POINTS)
    return motion.x[::every], motion.v[::every]
