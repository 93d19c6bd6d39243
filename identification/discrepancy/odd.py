"""The odd run of a set, which a model of the others does not describe: not tared, not centred, or warm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.criteria import BUDGET, FORM, TEXT
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import gap_remains
from identification.discrepancy.verdict import SearchResult
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record
from identification.scales import rms

Floats = NDArray[np.float64]


def odd_run(result: SearchResult) -> int | None:
    """Number of the training run that may be the odd one of a set that a search has not explained; None without one.

    It holds most of what is left, or its zero is far from that of all others.
    """
    if len(result.quiet) <= TEXT.few_runs + 1 or not gap_remains(result.found, result.quiet):
        return None
    left = _left(result)
    worst = int(np.argmax(left))
    return worst if left[worst] > BUDGET.odd_share * float(np.sum(left)) else _apart(result)


def _apart(result: SearchResult) -> int | None:
    """The run whose mean is farthest from the median of all, where that is far and much of the gap."""
    means = np.array([float(np.mean(e)) for e in result.base.residuals])
    away = np.abs(means - np.median(means))
    run = int(np.argmax(away))
    energy = result.quiet[run].measured.size * (away[run] / result.quiet[run].sigma) ** 2
    far = away[run] > FORM.disproportionate * float(np.median(away))
    return run if far and energy > FORM.helps * excess_of(result.base) else None


def is_odd(run: int, result: SearchResult, without: SearchResult) -> bool:
    """Whether a search without a run explains the others, and leaves less of them than the search with it."""
    others = float(np.sum(np.delete(_left(result), run)))
    explained = not gap_remains(without.found, without.quiet)
    return explained and excess_of(without.found.fit) < (1.0 - FORM.closes) * others


def _left(result: SearchResult) -> Floats:
    """Whitened energy that a search leaves of each training run beyond the noise, (R,)."""
    pairs = zip(result.found.fit.residuals, result.quiet, strict=True)
    return np.array([max(float(np.dot(e, e)) / r.sigma**2 - e.size, 0.0) for e, r in pairs])


def words_for(record: Record, model: Model, others: Sequence[Record]) -> str:
    """How an odd run departs from the model of the others, or that its sign is reversed where that is all."""
    simulated = predict(model, record)[0]
    rest, turned = record.measured - simulated, rms(-record.measured - simulated)
    said = f"{record.name} does not go with the other runs and was left out: their model leaves {rms(rest):.3g} N rms"
    if turned < FORM.minor * rms(rest):
        turned_over = f"{turned:.3g} N with the force upside down"
        return f"{said} there, and {turned_over}: the polarity of its force or motion is reversed"
    centre = float(np.mean(record.motion.x[record.window]))
    usual = float(np.median([np.mean(r.motion.x[r.window]) for r in others]))
    return (
        f"{said} there, a mean of {np.mean(rest):.3g} N; its motion is centred at {1e3 * centre:.3g} mm, theirs at "
        f"{1e3 * usual:.3g} mm. Was it tared, centred and as warm as they?"
    )
