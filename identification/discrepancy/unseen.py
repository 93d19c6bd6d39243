"""A gap that only the held-out runs show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.criteria import CHANCE
from identification.discrepancy.excess import material_excess, significant_excess
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, evaluate, free_parameters
from identification.record import Record


def gap_on(held_out: Sequence[Record], fit: Fit, seen: Sequence[Record]) -> bool:
    """Whether a model fitted to `seen` misses other records by more than noise and its own uncertainty explain.

    The excess Σ (e² − σ²)/σ² is compared with what noise exceeds in less than one case of a million, plus
    s²·Σ gᵀCg/σ²: g (M, K) is the gradient of the force by the fitted parameters, C (K, K) their covariance, and s
    `CHANCE.sigmas`. Of runs in which the model can't run nothing is known. One sample of a run alone is no gap: a
    friction jumps at a turn that no displacement tells to the sample.
    """
    try:
        at = evaluate(fit.model, held_out, free_parameters(fit.model, seen))
    except SimulationError:
        return False
    excess, uncertain = 0.0, 0.0
    for residual, gradient, r in zip(at.residuals, at.gradients, held_out, strict=True):
        spread = (residual / r.sigma) ** 2
        excess += float(np.sum(spread) - np.max(spread)) - residual.size
        uncertain += float(np.sum((gradient @ fit.covariance) * gradient)) / r.sigma**2
    known = max(material_excess(held_out), significant_excess(held_out))
    return excess > known + CHANCE.sigmas**2 * uncertain
