"""The model at the end of a search: all names fitted to the whole records, held against the held-out runs."""

from __future__ import annotations

import math
from dataclasses import replace

from identification.criteria import BUDGET, CHANCE
from identification.discrepancy.candidates import at_limit, remove_limits
from identification.discrepancy.evidence import excess_on
from identification.discrepancy.verdict import SearchResult, without_least_confident
from identification.errors import SimulationError
from identification.fitting.discretisation import with_solver_error
from identification.fitting.leastsquares import fit_records
from identification.physical.beside import within
from identification.physical.model import Element, Model


def fit_final(result: SearchResult) -> tuple[SearchResult, Model]:
    """The result, and the model with all names, fitted to the whole records.

    Limits that only the search needed go where a value lies on one and the fit without them is better, with no value on
    a bound of its own: else it would have lost the element. A model that can't run along the whole records, or whose
    sensitivity to a parameter grows without end there, stays as the search has fitted it; the result then says so.
    """
    base, found, hum = result.base.model, result.found, result.hum
    if not found.names and hum is None and found.fit.model == base:
        return result, base
    grown = found.fit.model if hum is None else found.fit.model.with_element(hum.element())
    try:
        return replace(result, as_searched=False), _lasting(_fitted_to_all(grown, result), result)
    except SimulationError:
        return replace(result, as_searched=True), _lasting(grown, result)


def _fitted_to_all(grown: Model, result: SearchResult) -> Model:
    final = fit_records(grown, result.train, max_iterations=BUDGET.fit_iterations)
    new = [e for e in final.model.elements if _is_new(e, result)]
    if any(at_limit(e) for e in new):
        elements = tuple(remove_limits(e) if e in new else e for e in final.model.elements)
        free = fit_records(replace(final.model, elements=elements), result.train, max_iterations=BUDGET.fit_iterations)
        lost = any(at_limit(free.model.element(e.id)) for e in new)
        final = final if lost or free.chi2 > final.chi2 - CHANCE.slack else free
    return with_solver_error(final, result.train).model


def without_harm(result: SearchResult, final: Model, base: Model) -> tuple[SearchResult, Model]:
    """The result and its model, which runs along all records, and with which held-out ones are no worse than with the
    base.

    Fitted to the whole records a shape may run away beyond their stroke: then the model is as the search has fitted it,
    where that is no worse than the base. Else the least likely names go, one after the other; the base itself is left
    where no name is, and its own curves were bent in vain.
    """
    limit = excess_on(result.held, base) + CHANCE.slack
    while result.found.names and _harms(final, result, limit):
        if result.hum is None and not _harms(result.found.fit.model, result, limit):
            searched = with_solver_error(result.found.fit, result.quiet).model
            return replace(result, as_searched=True), _lasting(searched, result)
        result = without_least_confident(result)
        result, final = fit_final(result) if result.names else (replace(result, as_searched=False), base)
    in_vain = not result.names and excess_on(result.held, final) > limit
    return result, base if in_vain else final


def _harms(model: Model, result: SearchResult, limit: float) -> bool:
    """Whether a model leaves more than the limit of the held-out records, or can't run along the others."""
    return excess_on(result.held, model) > limit or math.isinf(excess_on(result.train, model))


def _is_new(e: Element, result: SearchResult) -> bool:
    return e.id in result.found.names or e.id not in result.base.model.ids


def _lasting(model: Model, result: SearchResult) -> Model:
    """The model without the limits of what a search has added; none of that is beside a mount that was taken back."""
    lasts = [remove_limits(e) if _is_new(e, result) else e for e in model.elements]
    if not model.on("mount"):
        lasts = [within(e) if _is_new(e, result) else e for e in lasts]
    return replace(model, elements=tuple(lasts))
