"""How much of a gap is left, and how much of one matters: whitened energies."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from identification.criteria import CHANCE, FORM
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record


def excess_of(fit: Fit) -> float:
    """Whitened residual energy beyond what noise alone would leave; near zero when the model meets the data."""
    return fit.chi2 - fit.samples


def material_excess(records: Sequence[Record]) -> float:
    """Whitened energy of the smallest discrepancy that matters: a fixed share of the force's standard deviation.

    A preload is no part of it: beside a gas spring of 3 kN a stop that adds 30 N to a motion of 300 N matters.
    """
    return sum(r.measured.size * float(np.var(r.measured)) * (FORM.material / r.sigma) ** 2 for r in records)


def significant_excess(records: Sequence[Record]) -> float:
    """Excess that noise exceeds in less than one case of a million, the noise floor itself being estimated."""
    spread = sum(2.0 * r.measured.size / r.independent * r.floor_variance for r in records)
    unsure = sum(r.measured.size * r.modelled for r in records)
    return CHANCE.sigmas * float(np.sqrt(spread)) + CHANCE.modelled_noise_error * unsure


def is_seen(excess: float, records: Sequence[Record]) -> bool:
    """Whether an excess is no noise and matters."""
    return excess > max(material_excess(records), significant_excess(records))


def contribution(model: Model, name: str, records: Sequence[Record]) -> float:
    """Whitened energy of what an element (by its id) adds to the force of the model, all else unchanged.

    Of a model that can't run without it, the whole force.
    """
    if name not in model.ids:
        return 0.0
    total = 0.0
    for r in records:
        force = predict(model, r)[0]
        with suppress(SimulationError):
            force = force - predict(model.without(name), r)[0]
        total += float(np.dot(force, force)) / r.sigma**2
    return total


def form_error(model: Model, names: Sequence[str], records: Sequence[Record], closed: float) -> float:
    """Whitened energy that the names may leave because a real effect's curve departs from its canonical form.

    FORM.tolerance² times the energy of each element's force. Of that no more counts than FORM.imitated² times
    `closed`, the energy by which the names lower the excess: the rest only replaces force of the base.
    """
    most = FORM.imitated**2 * max(closed, 0.0)
    return sum(FORM.tolerance**2 * min(contribution(model, name, records), most) for name in names)
