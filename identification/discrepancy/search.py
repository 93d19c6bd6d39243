"""The search from more than one start: a climb may take a wrong name up, or stand on a base that has bent too far."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from identification.criteria import FORM
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search, climbed, explains, grown, proven, taken_up, worth_more
from identification.discrepancy.trials import choose
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import refine_curves, shaped_like
from identification.physical.model import Model, Parameter
from identification.record import Record


def search(
    given: Model, base: Fit, records: Sequence[Record], *, on_progress: Callable[[str], None] | None = None
) -> Search:
    """Name what `base` is missing on `records` (compact), from other starts too where the first leaves something."""
    say = on_progress or (lambda text: None)
    bare = _bare(given, base, records)
    last = climbed(bare, records, say)
    found = proven(last, records)
    starts = _elsewhere(last, given, base, records)
    while worth_more(found, records) and (another := next(starts, None)) is not None:
        text, start = another
        say(f"something is left: looking once more, {text}")
        other = proven(climbed(start, records, say), records)
        if _better(other, found, records):
            found = _freed(other, given)
    return found


def _better(other: Search, found: Search, records: Sequence[Record]) -> bool:
    """Whether other names explain much more, and all that matters where those found explain most of it already."""
    whole = not explains(found) or not worth_more(other, records)
    return whole and explains(other) and other.excess < (1.0 - FORM.closes) * found.excess


def _bare(given: Model, base: Fit, records: Sequence[Record]) -> Search:
    """The state without a name, with the finer shapes that the base's own curves need."""
    if worth_more(Search(fit=base, names=(), excess=excess_of(base), given=given), records):
        base = refine_curves(base, records)
    start = excess_of(base)
    return Search(fit=base, names=(), excess=start, given=shaped_like(given, base.model), base_excess=start)


def _elsewhere(last: Search, given: Model, base: Fit, records: Sequence[Record]) -> Iterator[tuple[str, Search]]:
    """Other starts: where the names come near, what was likely beside the last of them, or the first; and the base held
    near its given values, where its refit has left them and one name then closes much."""
    steps = _steps(last) if explains(last) else []
    for before, after in (*steps[:1], *steps[1:][-1:]):
        second = _second(before, after, last.names, records)
        if second is not None and frozenset(second.names) != last.dead_end:
            yield f"with {second.fit.model.element(second.names[-1]).spec.title}", second
    held = _held(given)
    if _leaves(base.model, held):
        near = replace(_bare(held, fit_records(held, records), records), base_excess=last.base_excess)
        first = grown(near, records)
        if first is not None and first.excess < (1.0 - FORM.closes) * near.excess:
            yield "with the base near its given values", first


def _steps(last: Search) -> list[tuple[Search, Search]]:
    """The states before and after each name that was added, the latest first."""
    steps = []
    while last.before is not None:
        steps.append((last.before, last))
        last = last.before
    return steps


def _second(before: Search, after: Search, led: Sequence[str], records: Sequence[Record]) -> Search | None:
    """The state with the likeliest of the other names that were tried there, but for those that `led` nowhere."""
    move = after.moves[len(before.moves)]
    chosen = choose([t for t in move.rivals if t.id not in led])
    if chosen is None or chosen.closed < FORM.helps * before.excess:
        return None
    return taken_up(before, chosen, move.rivals, records)


def _held(given: Model) -> Model:
    """The model with every free parameter that has a value kept near it."""
    elements = [replace(e, parameters=tuple(_near(p) for p in e.parameters)) for e in given.elements]
    return replace(given, elements=tuple(elements))


def _near(p: Parameter) -> Parameter:
    if p.fixed or p.value == 0.0:
        return p
    low, high = sorted((p.value / FORM.disproportionate, p.value * FORM.disproportionate))
    return replace(p, low=low if p.low is None else max(low, p.low), high=high if p.high is None else min(high, p.high))


def _leaves(model: Model, held: Model) -> bool:
    low, high = held.bounds()
    values = model.values()
    return bool(np.any((values < low) | (values > high)))


def _freed(found: Search, given: Model) -> Search:
    """The state with the limits that the base came with."""
    model = found.fit.model
    for own in given.elements:
        pairs = zip(model.element(own.id).parameters, own.parameters, strict=True)
        freed = tuple(p if q.fixed else replace(p, low=q.low, high=q.high) for p, q in pairs)
        model = model.replacing(own.id, replace(own, parameters=freed))
    return replace(found, fit=replace(found.fit, model=model))
