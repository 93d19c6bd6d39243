"""A model of several axes: a feed-forward network for each load, of the axes that are correlated with it.

No load is fed back: the network sees each of its axes over some samples, and a bad input is forgotten as soon as it has
passed (Umehara et al.: a recurrent network may diverge on a momentary one). What oil behind a bush remembers for longer
is given by a physical model of the main axis, whose force the networks of its loads see too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.given import Base
from identification.blackbox.layers import Layers, Predictor, Rows, first_layer_weights, span_of
from identification.blackbox.levenberg import train
from identification.blackbox.scaling import Scale, scale_of, seen
from identification.compute import run
from identification.errors import DataError, ModelError, SimulationError
from identification.models.inputs import motion_from
from identification.models.motion import Motion, held
from identification.models.protocol import leaving
from identification.models.simulation import force_along, name_of
from identification.multiaxis.axes import MOTIONS, check_axes, check_moved, unit_of
from identification.multiaxis.choice import chosen, correlations
from rigctl.runfile import Run

Floats = NDArray[np.float64]

LAYERS = Layers((12,))
DELAYS_S = (
    0.0,
    0.01,
    0.02,
    0.04,
    0.08,
    0.16,
    0.32,
)  # ages of the travel that a network sees: a bush relaxes within them
DECAY = 0.05  # as for networks of one axis; half and double change the error by less than a tenth of it
_LEAST_FOR_EACH_WEIGHT = 3.0
BASE = "force of the base"
_LARGEST = 1e3  # m or rad: what is larger is no travel of a damper
_MOST_ROWS, _STEPS, _TOLERANCE = 8000, 60, 1e-4


@dataclass(frozen=True, slots=True)
class Load:
    """The network of one load: the axes that it sees, and its weights."""

    axes: tuple[str, ...]
    scale: Scale
    weights: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiAxis:
    """Loads from the motion of several axes at one sample rate; `scales` holds those of the axes and their speeds."""

    name: str
    rate_hz: float
    scales: Mapping[str, Scale]
    loads: Mapping[str, Load]
    correlations: Mapping[str, Mapping[str, float]]
    base: Base | None = None
    facts: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise ModelError(f"sample rate is {self.rate_hz:g} Hz: it must be above 0")
        if not self.loads:
            raise ModelError("loads is empty: a model gives at least one")
        for name, load in self.loads.items():
            if not np.all(np.isfinite(load.weights)):
                raise ModelError(f"loads.{name}.weights must be finite numbers")
            missing = set(scales_needed(load.axes, self.base)) - set(self.scales)
            if missing:
                raise ModelError(f"signals.{min(missing)} is missing: {name} sees it")
            width = width_of(load.axes, self.base)
            if load.weights.shape != (LAYERS.size(width),):
                raise ModelError(
                    f"loads.{name}.weights: {load.weights.size} numbers; a network of {width} inputs has "
                    f"{LAYERS.size(width)}"
                )

    @property
    def kind(self) -> str:
        """The word in its file."""
        return "multiaxis"

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that drive it."""
        return tuple(axis for axis in MOTIONS if any(axis in one.axes for one in self.loads.values()))

    def simulate(self, run: Run) -> dict[str, Floats]:
        """Every load along the motion of a run, (N,), N or N·m, finite and bounded whatever the motion.

        Raises DataError where the run lacks an axis, SimulationError where its rate is not that of the training.
        """
        if abs(run.sample_rate_hz / self.rate_hz - 1.0) > 1e-6:
            raise SimulationError(
                f"'{self.name}' was identified at {self.rate_hz:.6g} Hz and {name_of(run)} has "
                f"{run.sample_rate_hz:.6g} Hz: record it at the rate of the model, or resample it with --rate"
            )
        lacking = next((axis for axis in self.axes if axis not in run.channels), None)
        if lacking is not None:
            raise DataError(f"{name_of(run)} has no {lacking}, which the model needs: record it")
        return self.along(run.channels)

    def along(self, travels: Mapping[str, Floats]) -> dict[str, Floats]:
        """The same along travels by their channels, each (N,), m or rad, which may hold what is no number."""
        out = {}
        for name, load in self.loads.items():
            phi = regressors(travels, self.rate_hz, load.axes, self.scales, self.base)
            predictor = Predictor(LAYERS, phi.shape[1], span_of(load.scale))
            low, high = load.scale.edges
            scaled = np.clip(predictor.simulate(load.weights, Rows(phi, np.zeros(phi.shape[0]))), low, high)
            out[name] = scaled * load.scale.size + load.scale.centre
        return out

    def outside(self, run: Run) -> dict[str, float]:
        """Share of the samples of each axis beyond its training, only of axes that leave it."""
        shares = {}
        for axis in self.axes:
            series = run.channels[axis]
            share = float(np.mean((series < self.scales[axis].low) | (series > self.scales[axis].high)))
            if share > 0.0:
                shares[axis] = share
        return shares

    def described(self, run: Run) -> list[str]:
        """A sentence for each axis, and for its speed, that leaves the training: how often, where first, how far."""
        sentences = []
        for axis in self.axes:
            travel, unit = run.channels[axis], unit_of(axis)
            speed = np.gradient(travel) * run.sample_rate_hz
            for name, series, of in ((axis, travel, unit), (speed_of(axis), speed, f"{unit}/s")):
                limits = self.scales[name].low, self.scales[name].high
                sentences += leaving(name, of, series, limits, 1.0 / run.sample_rate_hz)
        return sentences


def identify_axes(
    runs: Sequence[Run],
    *,
    name: str = "multi-axis",
    axes: Mapping[str, Sequence[str]] | None = None,
    base: Base | None = None,
) -> MultiAxis:
    """A model of every load in runs that move all axes, such as superposed ones; `axes` takes the place of the choice.

    `base` is a model of the force of the main axis from its displacement alone.

    Raises DataError, one line, where the runs' channels or rates differ, a load or an axis of it is constant, or the
    samples are too few; SimulationError where the base gives a force that no machine has.
    """
    check_moved(runs)
    motions, loads = check_axes(runs)
    rate, found = runs[0].sample_rate_hz, correlations(runs)
    wanted = {load: tuple(one) for load, one in (axes or chosen(found)).items()}
    scales = {}
    for axis in motions:
        if any(axis in one for one in wanted.values()):
            scales[axis] = _scale(axis, [one.channels[axis] for one in runs])
            scales[speed_of(axis)] = _scale(axis, [np.gradient(one.channels[axis]) * rate for one in runs])
    if base is not None:
        scales[BASE] = _scale(BASE, [force_along(base.model, _of_base(one.channels[MOTIONS[0]], rate)) for one in runs])
    # As tasks: on every processor, with one thread of linear algebra each. Products of such narrow matrices on many
    # threads take several times as long, and far more where others work on the machine.
    learn = partial(_learned, runs=runs, scales=scales, base=base)
    models = dict(zip(loads, run(learn, [(load, wanted[load]) for load in loads]), strict=True))
    return MultiAxis(name=name, rate_hz=rate, scales=scales, loads=models, correlations=found, base=base)


def speed_of(axis: str) -> str:
    """The name of the speed of an axis among the scales."""
    return f"speed of {axis}"


def scales_needed(axes: Sequence[str], base: Base | None) -> list[str]:
    """The scales that a network of some axes takes."""
    own = [name for axis in axes for name in (axis, speed_of(axis))]
    return [*own, BASE] if base is not None and MOTIONS[0] in axes else own


def width_of(axes: Sequence[str], base: Base | None) -> int:
    """The number of inputs of a network of some axes."""
    return len(axes) * (len(DELAYS_S) + 1) + (2 if base is not None and MOTIONS[0] in axes else 0)


def regressors(
    travels: Mapping[str, Floats],
    rate_hz: float,
    axes: Sequence[str],
    scales: Mapping[str, Scale],
    base: Base | None = None,
) -> Floats:
    """Scaled travels of several ages and the speed of each axis, and the force of a base of the main axis, (N, R).

    Before the first sample its value is held.
    """
    columns = []
    for axis in axes:
        series = held(travels[axis], largest=_LARGEST)
        travel = seen(scales[axis], series)
        for age in DELAYS_S:
            delay = min(round(age * rate_hz), travel.size)
            columns.append(np.concatenate([np.full(delay, travel[0]), travel])[: travel.size])
        columns.append(seen(scales[speed_of(axis)], np.gradient(series) * rate_hz))
    if base is not None and MOTIONS[0] in axes:
        force = seen(scales[BASE], _force_of(base, travels[MOTIONS[0]], rate_hz))
        columns += [force, np.concatenate([force[:1], force[:-1]])]
    return np.column_stack(columns)


def _learned(
    task: tuple[str, Sequence[str]], runs: Sequence[Run], scales: Mapping[str, Scale], base: Base | None
) -> Load:
    load, axes = task
    measured = np.concatenate([one.channels[load] for one in runs])
    scale = _scale(load, [measured])
    phi = np.concatenate([regressors(one.channels, one.sample_rate_hz, axes, scales, base) for one in runs])
    width, step = phi.shape[1], -(-phi.shape[0] // _MOST_ROWS)
    if phi.shape[0] < _LEAST_FOR_EACH_WEIGHT * LAYERS.size(width):
        raise DataError(
            f"{phi.shape[0]} samples for {LAYERS.size(width)} weights of {load}: at least "
            f"{_LEAST_FOR_EACH_WEIGHT:g} for each are needed; record more"
        )
    rows = Rows(np.ascontiguousarray(phi[::step]), ((measured - scale.centre) / scale.size)[::step])
    trained = train(
        Predictor(LAYERS, width, span_of(scale)), first_layer_weights(LAYERS, width, 1), rows, decay=DECAY,
        most_steps=_STEPS, tolerance=_TOLERANCE,
    )  # fmt: skip
    return Load(tuple(axes), scale, trained.weights)


def _force_of(base: Base, travel: Floats, rate_hz: float) -> Floats:
    """The force of a base along the main axis, held where the travel is no number."""
    return base.model.force(_of_base(travel, rate_hz))


def _of_base(travel: Floats, rate_hz: float) -> Motion:
    return motion_from(held(travel, largest=_LARGEST), rate_hz)


def _scale(name: str, parts: Sequence[Floats]) -> Scale:
    try:
        return scale_of(np.concatenate(parts))
    except ModelError as error:
        raise DataError(f"{name}: {error} in all runs: leave it out") from error
