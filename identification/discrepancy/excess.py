"""How much of a gap is left, and how much of one matters: whitened energies."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE, FORM
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit
from identification.physical.accuracy import numerical_error
from identification.physical.model import Element, Model
from identification.physical.predict import predict
from identification.record import Record

Floats = NDArray[np.float64]


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


def is_beyond_steps(excess: float, model: Model, records: Sequence[Record]) -> bool:
    """Whether an excess is seen, and larger than what the steps of the solver leave of it."""
    return is_seen(excess, records) and is_seen(excess - solver_error(model, records), records)


def contribution(model: Model, name: str, records: Sequence[Record]) -> float:
    """Whitened energy of what an element (by its id) adds to the force of the model, all else unchanged.

    Of a model that can't run without it, the whole force.
    """
    return contribution_and_form(model, name, records)[0]


def form_energy(model: Model, name: str, records: Sequence[Record]) -> float:
    """The part of an element's contribution that has a form, which that of a real effect departs from.

    A constant force is a constant in every machine: of an element that makes one only what varies counts. A gas spring
    of 3 kN that varies by 100 N over the stroke is known to 6 N and not to 180 N.
    """
    return contribution_and_form(model, name, records)[1]


def contribution_and_form(model: Model, name: str, records: Sequence[Record]) -> tuple[float, float]:
    """Both `contribution` and `form_energy`."""
    forces = _forces_of(model, name, records)
    middle = float(np.mean(np.concatenate(forces))) if name in model.ids and _has_constant(model.element(name)) else 0.0
    pairs = list(zip(forces, records, strict=True))
    return sum(_energy(f, r) for f, r in pairs), sum(_energy(f - middle, r) for f, r in pairs)


def _has_constant(element: Element) -> bool:
    return element.spec.constant_force or any(p.preload for p in element.spec.parameters)


def _forces_of(model: Model, name: str, records: Sequence[Record]) -> list[Floats]:
    """What an element (by its id) adds to the force along each record, (N,), N."""
    if name not in model.ids:
        return [np.zeros(r.measured.size) for r in records]
    forces = []
    for r in records:
        force = predict(model, r)[0]
        with suppress(SimulationError):
            force = force - predict(model.without(name), r)[0]
        forces.append(force)
    return forces


def means_left(fit: Fit, records: Sequence[Record]) -> float:
    """Whitened energy of the mean forces that a fit leaves in the runs."""
    return sum(_energy(np.full(e.size, np.mean(e)), r) for e, r in zip(fit.residuals, records, strict=True))


def zero_wanders(fit: Fit, records: Sequence[Record]) -> float:
    """Whitened energy that the constant forces of the model may leave because they differ from run to run."""
    constants = [e.id for e in fit.model.elements if e.spec.constant_force]
    return may_wander(means_left(fit, records), sum(contribution(fit.model, own, records) for own in constants))


def may_wander(left: float, constant: float) -> float:
    """Of the energy that the runs' mean forces leave, what may be a constant force that differs from run to run.

    The zero of a load cell does: by FORM.minor of itself at most, FORM.minor² of its energy.
    """
    return min(left, FORM.minor**2 * constant)


def solver_error(model: Model, records: Sequence[Record]) -> float:
    """Whitened energy of what one step a sample carries the simulated force from the exact answer.

    Of each record no more than FORM.tolerance² of the energy with which its force varies, as of a form: a model that
    its steps carry farther does not meet the data. None where half a step fails, or runs away.
    """
    energy = 0.0
    for r in records:
        with suppress(SimulationError), np.errstate(over="ignore", invalid="ignore"):
            error = _energy(numerical_error(model, r.motion).force[r.window], r)
            most = FORM.tolerance**2 * r.measured.size * float(np.var(r.measured)) / r.sigma**2
            energy += min(error, most) if np.isfinite(error) else 0.0
    return energy


def _energy(force: Floats, record: Record) -> float:
    with np.errstate(over="ignore"):  # without an element that holds it a model may run away: that energy is infinite
        return float(np.dot(force, force)) / record.sigma**2


def form_error(model: Model, names: Sequence[str], records: Sequence[Record], closed: float) -> float:
    """Whitened energy that the names may leave because a real effect's curve departs from its canonical form.

    FORM.tolerance² times the energy of what has a form of each element's force. Of that no more counts than
    FORM.imitated² times `closed`, the energy by which the names lower the excess: the rest only replaces force of the
    base.
    """
    most = FORM.imitated**2 * max(closed, 0.0)
    return sum(FORM.tolerance**2 * min(form_energy(model, name, records), most) for name in names)
