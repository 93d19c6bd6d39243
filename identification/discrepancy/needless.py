"""Names that others make needless: departures of a form, constant forces beside a preload, parts of one cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from identification.criteria import CHANCE, FORM
from identification.discrepancy.choice import choose, tolerance
from identification.discrepancy.excess import contribution, excess_of
from identification.discrepancy.naming import (
    Search,
    append_name,
    drop_name,
    fit_others,
    given_with_names,
    is_preload_of,
)
from identification.discrepancy.trials import trials
from identification.errors import SimulationError
from identification.fitting.leastsquares import fit_records
from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, name_of
from identification.record import Record


def drop_departures(state: Search, records: Sequence[Record]) -> Search:
    """Remove the names of elements that are only how another element of the model departs from its ideal."""
    others = {e.name: e for e in state.fit.model.elements}
    only = {n for n in state.names if _is_departure(state.fit.model.element(n), others, state, records)}
    return replace(state, names=tuple(n for n in state.names if n not in only))


def _is_departure(own: Element, others: Mapping[str, Element], state: Search, records: Sequence[Record]) -> bool:
    """Whether an element only describes how another one departs from its ideal: by its values, or because it
    closes little beside the other."""
    departure = own.spec.departure
    ideal = None if departure is None else next((others[name] for name in departure.of if name in others), None)
    if departure is None or ideal is None:
        return False
    if departure.is_only(own.values(), ideal.values()):
        return True
    share = departure.of[ideal.name]
    rest = fit_others(state, own.id, records) if share > 0.0 else None
    closed = np.inf if rest is None else excess_of(rest) - state.excess
    return closed < share * contribution(state.fit.model, ideal.id, records)


def drop_needless(state: Search, records: Sequence[Record]) -> Search:
    """Remove every name without which the others fit as well."""
    for name in state.names if len(state.names) > 1 else ():
        rest = fit_others(state, name, records)
        if rest is not None and excess_of(rest) <= state.excess + CHANCE.slack:
            state = drop_name(state, name, rest)
    return state


def drop_preloads(state: Search, records: Sequence[Record]) -> Search:
    """Remove the name of a constant force beside a preload, where the others close as much to within a small share."""
    for name in state.names:
        rest = fit_others(state, name, records) if is_preload_of(state.fit.model, name) else None
        if rest is not None and excess_of(rest) <= state.excess + FORM.helps * state.base_excess:
            state = drop_name(state, name, rest)
    return state


def merge_names(state: Search, records: Sequence[Record]) -> Search:
    """Put one element in the place of those whose work it does alone, where it fits as well: one cause, not several."""
    for name, spec in CATALOGUE.items():
        parts = [n for n in state.names if name_of(n) in spec.does_both]
        if spec.does_both and len(parts) == len(spec.does_both):
            with suppress(SimulationError):
                state = _merged(state, name, parts, records)
    return state


def _merged(state: Search, name: str, parts: Sequence[str], records: Sequence[Record]) -> Search:
    """The state with one element in the place of `parts`, by id; as it is where that fits worse than its form may."""
    model = state.fit.model
    for part in parts:
        model = model.in_its_absence(part)
    rest = fit_records(model, records)
    alone = replace(
        state, fit=rest, names=tuple(n for n in state.names if n not in parts), excess=excess_of(rest),
    )  # fmt: skip
    tried = trials(rest, given_with_names(alone), records)
    one = next((t for t in tried if t.name == name and choose([t]) is not None), None)
    if one is None or one.excess > state.excess + tolerance(one) + CHANCE.slack:
        return state
    return replace(append_name(alone, one, tried), before=state.before)
