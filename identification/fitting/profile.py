"""Profile likelihood: how far one parameter can vary while all others are fitted again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError, SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.physical.model import Model
from identification.record import Record, record_from_run
from rigctl.runfile import Run

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Values of the parameter (N,), the rise of the cost over its least in units of the misfit's own scatter (N,), and
    the interval in which that rise stays below 1 (68 %); an end is infinite where the rise never got there.
    """

    name: str
    values: Floats
    rise: Floats
    interval: tuple[float, float]


def profile(
    fit: Fit, records: Sequence[Record], name: str, *, points: int = 5, reach: float = 3.0, robust: float | None = None
) -> Profile:
    """Profile of a fitted parameter, `element.parameter`, at `points` values on either side, up to `reach` deviations.

    At each value the other parameters are fitted again, from where the neighbour left them, with
    the loss (`robust`) that the fit had. Raises DataError where the
    name is not that of a parameter with a standard deviation.
    """
    names = fit.model.names()
    stds = [e.parameters[k].std for e, k in fit.model.slots()]
    free = [n for n, s in zip(names, stds, strict=True) if s is not None]
    if name not in free:
        raise DataError(f"'{name}' was not fitted: it must be one of {', '.join(free)}")
    index = names.index(name)
    std, best = stds[index] or 0.0, float(fit.model.values()[index])
    low, high = (float(b[index]) for b in fit.model.bounds())
    scatter = max(fit.chi2 / max(fit.samples - len(free), 1), 1.0)
    values, rises = [best], [0.0]
    for side in (-1.0, 1.0):
        model = fit.model
        for step in range(1, points + 1):
            value = float(np.clip(best + side * reach * std * step / points, low, high))
            try:
                found = fit_records(_held(model, index, value), records, max_iterations=12, robust=robust)
            except SimulationError:
                break
            model = _held(found.model, index, value)
            values.append(value)
            rises.append(max((found.chi2 - fit.chi2) / scatter, 0.0))
    order = np.argsort(values)
    at, rise = np.array(values)[order], np.array(rises)[order]
    return Profile(name=name, values=at, rise=rise, interval=(_edge(at, rise, best, -1), _edge(at, rise, best, 1)))


def intervals_of(
    fit: Fit, runs: Sequence[Run], names: Iterable[str], *, robust: float | None = None
) -> dict[str, tuple[float, float]]:
    """The interval of 68 % of each of these parameters, from its profile on the runs of the fit; raises DataError."""
    wanted = list(names)
    records = [record_from_run(run) for run in runs] if wanted else []
    return {name: profile(fit, records, name, robust=robust).interval for name in wanted}


def _held(model: Model, index: int, value: float) -> Model:
    """The model with one parameter of the vector fixed at a value."""
    elements, at = [], 0
    for e in model.elements:
        parameters = list(e.parameters)
        if at <= index < at + len(parameters):
            parameters[index - at] = replace(parameters[index - at], value=value, fixed=True)
        elements.append(replace(e, parameters=tuple(parameters)))
        at += len(parameters)
    return replace(model, elements=tuple(elements))


def _edge(values: Floats, rise: Floats, best: float, side: int) -> float:
    """Where the rise first reaches 1 on one side, by the root of the rise, which is nearly straight."""
    on_side = values * side >= best * side
    distance, root = np.abs(values[on_side] - best), np.sqrt(rise[on_side])
    order = np.argsort(distance)
    distance, root = distance[order], root[order]
    beyond = np.flatnonzero(root >= 1.0)
    if beyond.size == 0:
        return side * np.inf
    k = int(beyond[0])
    share = (1.0 - root[k - 1]) / (root[k] - root[k - 1])
    return float(best + side * (distance[k - 1] + share * (distance[k] - distance[k - 1])))
