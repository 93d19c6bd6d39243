"""Fit a model to runs: the door to the least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from identification.errors import DataError
from identification.fitting.leastsquares import Fit, fit_records, free_parameters
from identification.physical.model import Model
from identification.record import record_from_run
from rigctl.runfile import Run


def fit(model: Model, runs: Sequence[Run], *, on_step: Callable[[int, float], None] | None = None) -> Fit:
    """Fit the free parameters of `model` to all `runs` at once, each weighted by its own noise.

    `on_step` is told the iteration and the whitened cost.

    Raises
    ------
    DataError
        when there is no run, a run lacks a current that the model needs, or nothing is free.
    """
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    records = [record_from_run(r) for r in runs]
    for r in records:
        needs = [e.name for e in model.elements if e.spec.needs_current]
        if needs and not r.has_current:
            raise DataError(f"{r.name} has no control current, which '{needs[0]}' needs: record it or leave it out")
    if not free_parameters(model, records).any():
        raise DataError(f"'{model.name}' has no free parameter: set \"fixed\" to false where the fit may move")
    return fit_records(model, records, on_step=on_step)
