"""The solver's own error as a part of the uncertainty of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, evaluate, free_parameters, inverse_gram
from identification.physical.accuracy import numerical_error
from identification.physical.model import Model
from identification.record import Record

Floats = NDArray[np.float64]


def with_solver_error(fit: Fit, records: Sequence[Record]) -> Fit:
    """The fit with deviations that hold how far the solver's own error has carried each parameter.

    That error δF is a force that no parameter means; to first order it moves them by δθ = H⁻¹·Σ ∇f·δF/σ², which is
    added to the variance as δθ². δF is estimated from half the step; on a record where the model does not run with half
    the step the fit stays as it is.
    """
    free = free_parameters(fit.model, records)
    pull = np.zeros(int(free.sum()))
    for r in records:
        gradient = evaluate(fit.model, [r], free).gradients[0]
        try:
            error = numerical_error(fit.model, r.motion).force
        except SimulationError:
            return fit
        pull += gradient.T @ r.seen(error) / r.sigma**2
    moved = inverse_gram(fit.jacobian_gram) @ pull
    wider = np.sqrt(1.0 + moved**2 / np.maximum(np.diag(fit.covariance), 1e-300))
    return replace(fit, covariance=fit.covariance * np.outer(wider, wider), model=_widened(fit.model, free, wider))


def _widened(model: Model, free: NDArray[np.bool_], wider: Floats) -> Model:
    std = np.array([np.nan if p.std is None else p.std for e in model.elements for p in e.parameters])
    std[free] *= wider
    return model.with_std(std)
