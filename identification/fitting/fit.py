"""Fits a model to runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from identification.errors import DataError
from identification.fitting.admission import admit
from identification.fitting.discretisation import with_solver_error
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.multistart import fit_from_many
from identification.fitting.refine import refine_curves
from identification.models.simulation import check_inputs
from identification.physical.model import Model
from identification.record import record_from_run
from rigctl.runfile import Run


def fit(
    model: Model,
    runs: Sequence[Run],
    *,
    starts: int = 1,
    robust: float | None = None,
    refine: bool = False,
    on_step: Callable[[int, float], None] | None = None,
) -> Fit:
    """Fit the free parameters of `model` to all `runs` at once, each weighted by its own noise.

    With `starts` above 1 the search runs from as many starts within a factor of 3 of the model's values and keeps the
    best. `robust` is the number of noise deviations beyond which a sample counts by its size rather than its square.
    With `refine`, curves that jump in their canonical form (dry friction, the branches of a hysteresis) may build up
    over a velocity `w_r` or a displacement `z_r`, where the runs show it: a real one does. `on_step` is told the
    iteration and the whitened cost.

    Raises
    ------
    DataError
        when there is no run, a run lacks a current that the model needs, nothing is free, or the runs are sines too few
        for the number of free parameters.
    """
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    if starts < 1:
        raise DataError(f"starts is {starts}: it must be 1 or more")
    if robust is not None and not robust > 0.0:
        raise DataError(f"robust is {robust:g}: it must be above 0 noise standard deviations")
    for run in runs:
        check_inputs(model, run)
    records = [record_from_run(r) for r in runs]
    admit(model, records)
    if starts > 1:
        found = fit_from_many(model, records, starts, robust=robust).best
    else:
        found = fit_records(model, records, robust=robust, on_step=on_step)
    return with_solver_error(refine_curves(found, records) if refine else found, records)
