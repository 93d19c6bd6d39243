"""A model fitted to a run whose force is known by another equation, and whether it found what made the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.fitting.leastsquares import fit_records
from identification.physical.model import Element, Model
from identification.record import record_from_run
from tests.identification.made_runs import Law, made_run

OFF = (1.25, 0.8, 1.15, 0.85, 1.2)  # first values over the true ones


def fitted(law: Law, elements: Sequence[Element], *, warms_by: float = 0.0) -> tuple[Model, list[str]]:
    """The model fitted to a run of that law, begun away from its values, and the names of the free parameters."""
    model = Model(name="truth", elements=tuple(elements))
    free = model.free()
    off = np.where(free, np.resize(OFF, free.size), 1.0)
    fit = fit_records(model.with_values(model.values() * off), [record_from_run(made_run(law, warms_by=warms_by))])
    assert fit.converged, fit.reason
    return fit.model, [name for name, is_free in zip(model.names(), free, strict=True) if is_free]


def assert_found(model: Model, names: Sequence[str], truth: Mapping[str, float]) -> None:
    """Each value lies within four of its stated deviations of the truth, and those are small."""
    for id_, parameter in (name.rsplit(".", 1) for name in names):
        found = model.element(id_)
        p = found.parameters[found.spec.index(parameter)]
        assert p.std is not None, parameter
        assert abs(p.value - truth[parameter]) < 4.0 * p.std, f"{parameter}: {p.value:.5g} ± {p.std:.2g}"
        assert p.std < 0.05 * abs(truth[parameter]), parameter
