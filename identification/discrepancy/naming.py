"""The search for names: moves that add, swap and drop elements, each judged after everything has been fitted again."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from identification.criteria import BUDGET, CHANCE, FORM
from identification.discrepancy.excess import (
    contribution,
    excess_of,
    material_excess,
    misshapen,
    significant_excess,
)
from identification.discrepancy.trials import (
    Trial,
    choose,
    complexity,
    tolerance,
    trial_of,
    trials,
)
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import refine_curves, shaped_like
from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, Model, name_of
from identification.record import Record


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """What was decided at one step and against which rivals."""

    kind: str  # "add" | "swap" | "drop"
    name: str
    excess_before: float
    excess_after: float
    rivals: tuple[Trial, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """A name beside its rivals: its own trial is among them."""

    without: Fit  # the best with every other name but it
    start: Fit  # what the rivals were added to: not `without` where nothing has come near the name since
    beside: tuple[str, ...]  # ids of the names in `start`
    rivals: tuple[Trial, ...]

    @property
    def latest(self) -> bool:
        """Whether the rivals were tried with every other name there."""
        return self.start is self.without


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """State of the search: the fitted model, the elements named in it, and the moves that led there."""

    fit: Fit
    names: tuple[str, ...]  # their ids
    excess: float
    given: Model  # the base with the values it came with
    base_excess: float = 0.0  # before any name, the base's own curves refined
    moves: tuple[Move, ...] = field(default=())
    compared: Mapping[str, Compared] = field(default_factory=dict)  # each of them, as it was last tried
    before: Search | None = None  # as it was before the latest name
    dead_end: frozenset[str] | None = None  # ids of names that were tried instead, and led no further


def climbed(state: Search, records: Sequence[Record], say: Callable[[str], None]) -> Search:
    """The state with every name that pays, on `records` (compact): add while it does, then swap and drop."""
    turned = False
    while len(state.names) < FORM.most_effects and worth_more(state, records):
        say(f"{len(state.names)} named so far, the gap is {_over_noise(state):.1f} × the noise of a mean period")
        larger = grown(state, records)
        if larger is None and not turned and (otherwise := _otherwise(state)) is not None:
            larger, turned = grown(otherwise, records), True
            if larger is None:
                state = replace(state, dead_end=frozenset(otherwise.names))
        if larger is None or len(larger.moves) > BUDGET.most_moves:
            break
        state = larger
    return state


def explains(state: Search) -> bool:
    """Whether the names together leave little of the gap."""
    return state.excess < FORM.explained * state.base_excess


def proven(state: Search, records: Sequence[Record]) -> Search:
    """What stands of the names: those that are needed, where together they explain the gap; else the first, where it
    closes much by itself; else none."""
    if explains(state):
        return _needed(state, records)
    while state.before is not None and state.before.before is not None:
        state = state.before
    if state.before is None or state.excess < (1.0 - FORM.closes) * state.before.excess:
        return state
    return state.before


def without_departures(state: Search, records: Sequence[Record]) -> Search:
    """The state without the names of elements that are only how another named one departs from its ideal."""
    named = {e.name: e for e in (state.fit.model.element(n) for n in state.names)}
    only = {e.id for e in named.values() if _departs(e, named, state, records)}
    return replace(state, names=tuple(n for n in state.names if n not in only))


def _departs(own: Element, named: Mapping[str, Element], state: Search, records: Sequence[Record]) -> bool:
    """Whether an element only tells how another of those named departs from its ideal: by its values, or since it is
    of little account beside the other."""
    departure = own.spec.departure
    ideal = None if departure is None else named.get(departure.of)
    if departure is None or ideal is None:
        return False
    if departure.is_only(own.values(), ideal.values()):
        return True
    rest = _without(state.fit, own.id, records) if departure.share > 0.0 else None
    closed = np.inf if rest is None else excess_of(rest) - state.excess
    return closed < departure.share * contribution(state.fit.model, ideal.id, records)


def _needed(state: Search, records: Sequence[Record]) -> Search:
    """The state less every name without which the others fit as well."""
    for name in state.names if len(state.names) > 1 else ():
        rest = _without(state.fit, name, records)
        if rest is not None and excess_of(rest) <= state.excess + CHANCE.slack:
            state = _dropped(state, name, rest)
    return state


def grown(state: Search, records: Sequence[Record]) -> Search | None:
    """The state with one more name, where one pays; two dry frictions in one machine are one, of another form."""
    larger = _added(state, records)
    twice = larger is not None and sum(larger.fit.model.element(n).spec.dry_friction for n in larger.names) > 1
    dry = [name for name, spec in CATALOGUE.items() if spec.dry_friction]
    return _added(state, records, but=dry) if twice else larger


def _otherwise(state: Search) -> Search | None:
    """The state with another name in the place of one that was only simpler and leads no further, if there is one."""
    passed = [
        (t, name)
        for name, c in state.compared.items()
        if c.latest and {name, *c.beside} == set(state.names)
        for t in c.rivals
        if t.id not in state.names and t.excess < state.excess - CHANCE.slack and choose([t]) is not None
    ]
    if not passed:
        return None
    better, name = min(passed, key=lambda p: p[0].excess)
    return _swapped(state, name, better, state.compared[name])


def _added(state: Search, records: Sequence[Record], but: Collection[str] = ()) -> Search | None:
    alone = state.excess < FORM.explained * state.base_excess  # of a gap that is all but closed no part is worth little
    at_least = FORM.closes if alone else FORM.helps
    if (
        len(state.names) == FORM.most_effects - 1
    ):  # the last name must explain the gap, or none of those beside it is kept
        at_least = max(at_least, 1.0 - FORM.explained * state.base_excess / state.excess)
    found = trials(state.fit, _given(state), records, least=BUDGET.half_as_good * at_least, but=but)
    chosen = choose(found)
    if chosen is None or state.excess - chosen.excess < at_least * state.excess:
        return None
    return taken_up(state, chosen, found, records)


def taken_up(state: Search, chosen: Trial, found: Sequence[Trial], records: Sequence[Record]) -> Search:
    """The state with the name that was chosen among the trials, and the earlier ones tried again beside it."""
    larger = _refined(_with(state, chosen, found), records)
    return _settle(larger, records) if len(larger.names) > 1 else larger


def _refined(state: Search, records: Sequence[Record]) -> Search:
    """The state with the finer shapes that show once the largest gap has closed."""
    if not worth_more(state, records):
        return state
    fit = refine_curves(state.fit, records)
    return replace(state, fit=fit, excess=excess_of(fit), given=shaped_like(state.given, fit.model))


def _over_noise(state: Search) -> float:
    return float(np.sqrt(1.0 + max(state.excess, 0.0) / max(state.fit.samples, 1)))


def worth_more(state: Search, records: Sequence[Record]) -> bool:
    """Whether what is left is real, matters, and is more than the form of what was named can answer for."""
    form = misshapen(state.fit.model, state.names, records, state.base_excess - state.excess)
    floor = max(material_excess(records), significant_excess(records))
    return state.excess > floor + form


def _with(state: Search, chosen: Trial, found: Sequence[Trial]) -> Search:
    """The state with the name that was chosen among the trials."""
    move = Move(
        kind="add",
        name=chosen.name,
        excess_before=state.excess,
        excess_after=chosen.excess,
        rivals=tuple(found),
    )
    return replace(
        state,
        fit=chosen.fit,
        names=(*state.names, chosen.id),
        excess=chosen.excess,
        moves=(*state.moves, move),
        compared={**state.compared, chosen.id: _compared(state.fit, state.names, found)},
        before=state,
    )


def _given(state: Search) -> Model:
    """The base as it came, with the elements named since as they were fitted."""
    model = state.given
    for name in state.names:
        model = model.with_element(state.fit.model.element(name))
    return model


def _settle(state: Search, records: Sequence[Record]) -> Search:
    """Swap each earlier name for a better one, given the latest, and drop those that it has made needless.

    The latest was chosen beside the earlier ones: where one of them is another now, it is tried again too.
    """
    *earlier, latest = state.names
    moves = len(state.moves)
    for name in earlier:
        state = _tried_again(state, name, records)
    swapped = any(m.kind == "swap" for m in state.moves[moves:])
    return _tried_again(state, latest, records) if swapped else state


def _tried_again(state: Search, name: str, records: Sequence[Record]) -> Search:
    """The state without a name, with it, or with a better one in its place."""
    rest = _without(state.fit, name, records)
    if rest is None:
        return state
    form = FORM.tolerance**2 * contribution(state.fit.model, name, records)
    if excess_of(rest) <= state.excess + form + CHANCE.slack:
        return _dropped(state, name, rest)
    tried = trials(rest, _given(state).without(name), records, incumbent=name, beside=state.fit.model)
    found = [_unstuck(t, state, rest, records) if t.id == name else t for t in tried]
    own = choose([t for t in found if t.id == name])
    if own is not None and own.excess < state.excess - CHANCE.slack:  # the fit had stuck
        state = replace(state, fit=own.fit, excess=own.excess)
    others = tuple(n for n in state.names if n != name)
    now = _compared(rest, others, found) if own is not None else replace(state.compared[name], without=rest)
    state = replace(state, compared={**state.compared, name: now})
    best = choose(found)
    if best is None or best.id == name or not _replaces(best, name, found, state):
        return state
    return _swapped(state, name, best, _compared(rest, others, found))


def _unstuck(own: Trial, state: Search, rest: Fit, records: Sequence[Record]) -> Trial:
    """The trial of a name that is in place or, where that has stuck, the fit that the name has.

    A trial that sticks says nothing against a name that fits.
    """
    stuck = own.excess > state.excess + CHANCE.slack
    return trial_of(state.fit, own.id, rest, records, own.screened) if stuck else own


def _swapped(state: Search, name: str, better: Trial, compared: Compared) -> Search:
    move = Move(
        kind="swap",
        name=f"{name_of(name)} → {better.name}",
        excess_before=state.excess,
        excess_after=better.excess,
        rivals=compared.rivals,
    )
    return replace(
        state,
        fit=better.fit,
        names=(*(n for n in state.names if n != name), better.id),
        excess=better.excess,
        moves=(*state.moves, move),
        compared={**state.compared, better.id: compared},
    )


def _compared(start: Fit, beside: Sequence[str], found: Sequence[Trial]) -> Compared:
    return Compared(without=start, start=start, beside=tuple(beside), rivals=tuple(found))


def _dropped(state: Search, name: str, rest: Fit) -> Search:
    after = excess_of(rest)
    move = Move(kind="drop", name=name_of(name), excess_before=state.excess, excess_after=after, rivals=())
    names = tuple(n for n in state.names if n != name)
    return replace(state, fit=rest, names=names, excess=after, moves=(*state.moves, move))


def _replaces(best: Trial, name: str, found: Sequence[Trial], state: Search) -> bool:
    """Whether another name fits clearly better than the one in place, or as well and is simpler."""
    simpler = any(complexity(best) < complexity(t) for t in found if t.id == name)
    return simpler or best.excess < state.excess - tolerance(best) - CHANCE.slack


def _without(fit: Fit, name: str, records: Sequence[Record]) -> Fit | None:
    """The model fitted again without one of its elements; None where it can't run so."""
    with suppress(SimulationError):
        return fit_records(
            fit.model.without(name), records, max_iterations=BUDGET.fit_iterations, tolerance=BUDGET.flat
        )
    return None
