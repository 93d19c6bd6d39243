"""The search from several starts, because one may add a wrong name or use a badly fitted base."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from identification.criteria import FORM
from identification.discrepancy.choice import choose
from identification.discrepancy.excess import excess_of, is_seen
from identification.discrepancy.naming import (
    Search,
    add_name,
    explains,
    gap_remains,
    improve_once,
    is_beyond_form,
    search_from,
    steps,
)
from identification.discrepancy.needless import drop_needless
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import follows_current, refine_curves, with_shapes_of
from identification.physical.model import Model, Parameter
from identification.record import Record


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """What a search begins beside, and what it asks of a name."""

    earlier: tuple[str, ...] = ()  # ids of elements of the base that a search before has named
    refused: frozenset[str] = frozenset()  # names of elements that it found beside these and that were not stated
    helps: float = FORM.helps  # share of what is left that a further name must close
    most: int = FORM.most_effects  # names that it may add


NOTHING: Final = Beside()


def search(
    given: Model,
    base: Fit,
    records: Sequence[Record],
    *,
    beside: Beside = NOTHING,
    on_progress: Callable[[str], None] | None = None,
    is_enough: Callable[[Model], bool] = lambda model: False,
) -> Search:
    """Name what `base` is missing on `records` (compact); from other starts too where a gap remains after the first,
    unless the model found until then `is_enough`.
    """
    report = on_progress or (lambda text: None)
    start = start_state(given, base, records)
    start = replace(start, earlier=beside.earlier, refused=beside.refused, helps=beside.helps, most=beside.most)
    last = search_from(start, records, report)
    found = drop_needless(last, records)
    searched, others = [last], list[Search]()
    beyond_form = gap_remains(last, records)
    starts = (other_starts if beyond_form else near_given)(last, given, base, records)
    while is_seen(found.excess, records) and not is_enough(found.fit.model):
        another = next(starts, None)
        if another is None:
            break
        text, start = another
        report(f"a gap remains: searching again {text}")
        searched.append(search_from(start, records, report, searched))
        other = drop_needless(searched[-1], records)
        if is_better(other, found, records):
            found, other = other, found
        others.append(restore_limits(other, given))
    return replace(restore_limits(found, given), others=tuple(others)) if others else found


def is_better(other: Search, found: Search, records: Sequence[Record]) -> bool:
    """Whether other names explain much more; where those found explain most of the gap, also all that matters of it."""
    whole = not explains(found) or not gap_remains(other, records)
    return whole and explains(other) and other.excess < (1.0 - FORM.closes) * found.excess


def start_state(given: Model, base: Fit, records: Sequence[Record]) -> Search:
    """The state without a name, with the finer shapes that the base's own curves need."""
    if is_beyond_form(Search(fit=base, names=(), excess=excess_of(base), given=given), records):
        base = refine_curves(base, records, gains=follows_current(given))
    start = excess_of(base)
    return Search(fit=base, names=(), excess=start, given=with_shapes_of(given, base.model), base_excess=start)


def other_starts(last: Search, given: Model, base: Fit, records: Sequence[Record]) -> Iterator[tuple[str, Search]]:
    """Where the names explain the gap, the second choice at the last and at the first of them; then `near_given`."""
    added = steps(last) if explains(last) else []
    for before, after in (*added[:1], *added[1:][-1:]):
        second = _second_choice(before, after, last.names, records)
        if second is not None and frozenset(second.names) != last.dead_end:
            yield f"with {second.fit.model.element(second.names[-1]).spec.title}", second
    yield from near_given(last, given, base, records)


def near_given(last: Search, given: Model, base: Fit, records: Sequence[Record]) -> Iterator[tuple[str, Search]]:
    """The base limited to near its given values, where its refit has left them and one name then closes much: a refit
    that imitates an effect hides it."""
    held = limit_base(given)
    if _is_outside(base.model, held):
        near = start_state(held, fit_records(held, records), records)
        near = replace(
            near, base_excess=last.base_excess, earlier=last.earlier, refused=last.refused, helps=last.helps,
            most=last.most,
        )  # fmt: skip
        first = improve_once(near, records)
        if first is not None and first.excess < (1.0 - FORM.closes) * near.excess:
            yield "with the base near its given values", first


def _second_choice(before: Search, after: Search, tried: Sequence[str], records: Sequence[Record]) -> Search | None:
    """Add the best of the rivals of that step instead, except the names in `tried`; None where none closes enough.

    The name of that step is none of them, also where another one has taken its place since.
    """
    move = after.moves[len(before.moves)]
    out = {*before.refused, move.name}
    chosen = choose([t for t in move.rivals if t.id not in tried and t.name not in out])
    if chosen is None or chosen.closed < FORM.helps * before.excess:
        return None
    return add_name(before, chosen, move.rivals, records)


def limit_base(given: Model) -> Model:
    """Limit every free parameter of the base to near its given value, where that is not zero."""
    elements = [replace(e, parameters=tuple(_limit(p) for p in e.parameters)) for e in given.elements]
    return replace(given, elements=tuple(elements))


def _limit(p: Parameter) -> Parameter:
    if p.fixed or p.value == 0.0:
        return p
    low, high = sorted((p.value / FORM.disproportionate, p.value * FORM.disproportionate))
    return replace(p, low=low if p.low is None else max(low, p.low), high=high if p.high is None else min(high, p.high))


def _is_outside(model: Model, held: Model) -> bool:
    low, high = held.bounds()
    values = model.values()
    return bool(np.any((values < low) | (values > high)))


def restore_limits(found: Search, given: Model) -> Search:
    """Give the base the limits back that it came with."""
    model = found.fit.model
    for own in given.elements:
        pairs = zip(model.element(own.id).parameters, own.parameters, strict=True)
        freed = tuple(p if q.fixed else replace(p, low=q.low, high=q.high) for p, q in pairs)
        model = model.replacing(own.id, replace(own, parameters=freed))
    return replace(found, fit=replace(found.fit, model=model))
