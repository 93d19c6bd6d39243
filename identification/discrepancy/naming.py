"""The search for names: moves that add, swap and drop elements, each judged after everything has been fitted again."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from identification.criteria import BUDGET, CHANCE, FORM
from identification.discrepancy.choice import Trial, choose, complexity, own_form, tolerance
from identification.discrepancy.excess import (
    excess_of,
    form_energy,
    form_error,
    material_excess,
    significant_excess,
    solver_error,
    zero_wanders,
)
from identification.discrepancy.trials import trial_of, trials
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import follows_current, refine_curves, with_shapes_of
from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, Model, name_of
from identification.record import Record

Revise = Callable[["Search", Sequence[Record]], "Search"]


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
    earlier: tuple[str, ...] = ()  # ids of elements of the base that an earlier search has named
    base_excess: float = 0.0  # before any name, the base's own curves refined
    moves: tuple[Move, ...] = field(default=())
    compared: Mapping[str, Compared] = field(default_factory=dict)  # each of them, as it was last tried
    before: Search | None = None  # as it was before the latest name
    dead_end: frozenset[str] | None = None  # ids of names that were tried instead without success
    refused: frozenset[str] = frozenset()  # names of elements that an earlier search found from here and did not state
    helps: float = FORM.helps  # share of what is left that a further name must close
    most: int = FORM.most_effects  # names that this search may add
    others: tuple[Search, ...] = ()  # where the search from other starts ended

    @property
    def gone(self) -> frozenset[str]:
        """Names that are not added again: those refused, and those dropped, which would come and go at every step."""
        return self.refused.union(m.name for m in self.moves if m.kind == "drop")

    @property
    def full(self) -> bool:
        """Whether there are as many names as there may be, those of earlier searches among them."""
        return len(self.names) >= min(self.most, FORM.most_effects - len(self.earlier))


def search_from(
    state: Search, records: Sequence[Record], report: Callable[[str], None], others: Sequence[Search] = ()
) -> Search:
    """Add names to `state` while one closes enough of the gap, and revise the earlier ones after each.

    The records are compact. Where no name can be added, one earlier name is exchanged, once, for one that fits better.
    The search ends where one of `others` or it has been, as it would go the same way, and where it is behind one.
    """
    swapped, own = False, list[Search]()
    been = [s for other in others for s in (other, *(before for before, _ in steps(other)))]
    while not state.full and gap_remains(state, records):
        if any(_is_at(state, b) for b in (*been, *own)) or any(_is_behind(state, b) for b in been):
            break
        if _leads_nowhere(state):
            break
        own.append(state)
        report(f"{len(state.names)} named so far, the gap is {_ratio_to_noise(state):.1f} × the noise of a mean period")
        improved = improve_once(state, records)
        if improved is None and not swapped and (otherwise := _swap_in_better_fit(state)) is not None:
            improved, swapped = improve_once(otherwise, records), True
            if improved is None:
                state = replace(state, dead_end=frozenset(otherwise.names))
        if improved is None or len(improved.moves) > BUDGET.most_moves:
            break
        state = improved
    return _beside_form(state, records) if state.names and not gap_remains(state, records) else state


def _leads_nowhere(state: Search) -> bool:
    """Whether the two latest names each closed a minor part of what was left: such names are not believed either."""
    closed = [1.0 - m.excess_after / max(m.excess_before, 1e-300) for m in state.moves if m.kind == "add"][-2:]
    return len(closed) > 1 and max(closed) < FORM.minor


def _beside_form(state: Search, records: Sequence[Record]) -> Search:
    """Add a name that closes nearly all that is missing without it, though that is within the tolerance of form.

    A departure of form is no element of its own, and where the finer shapes of those that are there close as much, it
    is theirs; only a curve over velocity may look like that of another one, and a friction, or what acts in series
    with one, like that of another friction.
    """
    known = max(material_excess(records), significant_excess(records))
    if state.excess <= known or state.full:
        return state
    finer = _with_finer_shapes(state, records)
    state = finer if finer.excess < FORM.minor * state.excess else state
    if state.excess <= known:
        return state
    curves = [name for name, spec in CATALOGUE.items() if spec.bent or spec.dry_friction]
    rubs = any(e.spec.friction for e in _named(state))
    slides = any(e.spec.dry_friction for e in state.fit.model.elements)
    behind = [name for name, spec in CATALOGUE.items() if spec.path == "mount"] if slides else []
    # What it does not close at first, others that are revised beside it may: half of what is asked.
    helps = BUDGET.half_as_good * (1.0 - FORM.minor)
    improved = _add_best(state, records, excluded=[*curves, *behind, *(_frictions() if rubs else [])], helps=helps)
    return state if improved is None or not _closes_nearly_all(improved, state, records) else improved


def _closes_nearly_all(improved: Search, state: Search, records: Sequence[Record]) -> bool:
    """Whether the latest name leaves a minor part of what is missing without it.

    What the finer shapes close that the other names have got beside it is not its own.
    """
    latest = improved.names[-1]
    if latest in state.names:
        return False
    now = fit_without(improved.fit, latest, records)
    missing = min(excess_of(f) for f in (improved.compared[latest].without, now) if f is not None)
    return improved.excess < min(state.excess, FORM.minor * missing)


def steps(last: Search) -> list[tuple[Search, Search]]:
    """The states before and after each name that was added, the latest first."""
    found = []
    while last.before is not None:
        found.append((last.before, last))
        last = last.before
    return found


def _is_at(state: Search, other: Search) -> bool:
    """Whether a search has come to the names of another one, and fits no better with them."""
    same = bool(state.names) and set(state.names) == set(other.names)
    return same and state.excess > (1.0 - BUDGET.same_force) * other.excess


def _is_behind(state: Search, other: Search) -> bool:
    """Whether a search has two names or more, and another one closed more with as many."""
    return len(state.names) == len(other.names) > 1 and state.excess > other.excess + CHANCE.slack


def explains(state: Search) -> bool:
    """Whether the names together leave little of the gap."""
    return state.excess < FORM.explained * state.base_excess


def improve_once(state: Search, records: Sequence[Record], revise: Revise | None = None) -> Search | None:
    """Add the best further name; None where none closes enough.

    Two frictions in one machine, a hysteresis among them, are one of another form: where a second would be added, the
    step is repeated without them. None is tried beside one that an earlier search has named, which stays.
    `revise` checks the names so far when one has been added; by default `revise_names`.
    """
    add = partial(_add_best, state, records, revise=revise, helps=state.helps)
    if any(state.fit.model.element(n).spec.friction for n in state.earlier):
        return add(excluded=_frictions())
    improved = add()
    twice = improved is not None and sum(e.spec.friction for e in _named(improved)) > 1
    return add(excluded=_frictions()) if twice else improved


def _frictions() -> list[str]:
    return [name for name, spec in CATALOGUE.items() if spec.friction]


def _named(state: Search) -> list[Element]:
    return [state.fit.model.element(n) for n in (*state.earlier, *state.names)]


def _swap_in_better_fit(state: Search) -> Search | None:
    """Exchange a name that was chosen for its simplicity for the one that fits best; None where there is none."""
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
    return _swap(state, name, better, state.compared[name])


def _add_best(
    state: Search,
    records: Sequence[Record],
    *,
    excluded: Collection[str] = (),
    revise: Revise | None = None,
    helps: float = FORM.helps,
) -> Search | None:
    """Add the best of all names; None where it, or the search with it, does not close the share `helps`, and where it
    is far behind a refused one, whose place it would only take: the next revision brings that back."""
    least = BUDGET.half_as_good * helps
    found = trials(state.fit, given_with_names(state), records, least=least, excluded=excluded)
    chosen = choose([t for t in found if t.name not in state.gone])
    if chosen is None or state.excess - chosen.excess < helps * state.excess:
        return None
    refused = choose([t for t in found if t.name in state.refused])
    if refused is not None and _is_far_behind(chosen, refused):
        return None
    improved = add_name(state, chosen, found, records, revise)
    more = len(improved.names) > len(state.names)  # where simpler names then took the place of others, still one more?
    return None if more and state.excess - improved.excess < helps * state.excess else improved


def add_name(
    state: Search, chosen: Trial, found: Sequence[Trial], records: Sequence[Record], revise: Revise | None = None
) -> Search:
    """Add the name that was chosen among the trials, and revise the earlier ones beside it; see `improve_once`."""
    improved = _refine_curves(append_name(state, chosen, found), records)
    if len(improved.names) == 1:
        return improved
    return _refine_curves((revise or revise_names)(improved, records), records)


def _refine_curves(state: Search, records: Sequence[Record]) -> Search:
    """Free the finer shapes that the data show once the largest gap has closed."""
    return _with_finer_shapes(state, records) if is_beyond_form(state, records) else state


def _with_finer_shapes(state: Search, records: Sequence[Record]) -> Search:
    fit = refine_curves(state.fit, records, gains=follows_current(given_with_names(state)))
    return replace(state, fit=fit, excess=excess_of(fit), given=with_shapes_of(state.given, fit.model))


def _ratio_to_noise(state: Search) -> float:
    return float(np.sqrt(1.0 + max(state.excess, 0.0) / max(state.fit.samples, 1)))


def gap_remains(state: Search, records: Sequence[Record]) -> bool:
    """Whether the excess is beyond the form of the names, and larger than what the solver's steps leave beside that."""
    known = _known(state, records)
    return state.excess > known and state.excess > known + solver_error(state.fit.model, records)


def is_beyond_form(state: Search, records: Sequence[Record]) -> bool:
    """Whether the excess is significant, matters, and is larger than the form error of the names and of a zero."""
    return state.excess > _known(state, records)


def _known(state: Search, records: Sequence[Record]) -> float:
    form = form_error(state.fit.model, state.names, records, state.base_excess - state.excess)
    form += zero_wanders(state.fit, records)
    return max(material_excess(records), significant_excess(records)) + form


def append_name(state: Search, chosen: Trial, found: Sequence[Trial]) -> Search:
    """Append the name that was chosen among the trials."""
    before, after = state.excess, chosen.excess
    move = Move(kind="add", name=chosen.name, excess_before=before, excess_after=after, rivals=tuple(found))
    return replace(
        state,
        fit=chosen.fit,
        names=(*state.names, chosen.id),
        excess=chosen.excess,
        moves=(*state.moves, move),
        compared={**state.compared, chosen.id: _comparison(state.fit, state.names, found)},
        before=state,
    )


def given_with_names(state: Search) -> Model:
    """The base as given, with the named elements as they were fitted."""
    model = state.given
    for name in state.names:
        model = model.with_element(state.fit.model.element(name))
    return model


def revise_names(state: Search, records: Sequence[Record]) -> Search:
    """Swap each earlier name for a better one, given the latest, and drop those that have become needless.

    The latest was chosen beside the earlier ones: where one of these was swapped, its trials are repeated too.
    """
    *earlier, latest = state.names
    moves = len(state.moves)
    for name in earlier:
        state = repeat_trials(state, name, records)
    swapped = any(m.kind == "swap" for m in state.moves[moves:])
    return repeat_trials(state, latest, records) if swapped else state


def repeat_trials(
    state: Search, name: str, records: Sequence[Record], *, trials: Callable[..., list[Trial]] = trials
) -> Search:
    """Try a name again beside the others: drop it, keep it, or put a better one in its place.

    `trials` are made as by the function of this name. Beside a friction no other one is put in its place.
    """
    rest = fit_others(state, name, records)
    if rest is None:
        return state
    form = FORM.tolerance**2 * form_energy(state.fit.model, name, records)
    if is_preload_of(state.fit.model, name):  # which then only makes up for what the form of the other leaves
        form = max(form, FORM.helps * state.base_excess)
    if excess_of(rest) <= state.excess + form + CHANCE.slack:
        return drop_name(state, name, rest)
    beside_friction = any(e.spec.friction for e in _named(state) if e.id != name)
    tried = trials(
        rest, given_with_names(state).in_its_absence(name), records, incumbent=name, beside=state.fit.model,
        excluded=[n for n in _frictions() if n != name_of(name)] if beside_friction else (),
    )  # fmt: skip
    found = [_replace_stuck(t, state, rest, records) if t.id == name else t for t in tried]
    own = choose([t for t in found if t.id == name])
    if own is not None and own.excess < state.excess - CHANCE.slack:  # it was in a worse local minimum
        state = replace(state, fit=own.fit, excess=own.excess)
    others = tuple(n for n in state.names if n != name)
    now = _comparison(rest, others, found) if own is not None else state.compared[name]
    now = replace(now, without=_least_without(state, name, rest))
    state = replace(state, compared={**state.compared, name: now})
    best = choose(found)
    if best is None or best.id == name or _is_far_behind(best, state) or not _is_better(best, name, found, state):
        return state
    return _swap(state, name, best, _comparison(rest, others, found))


def is_preload_of(model: Model, name: str) -> bool:
    """Whether an element, by its id, is a constant force beside another that has one as its preload."""
    others = [p for e in model.elements if e.id != name for p in e.spec.parameters]
    return model.element(name).spec.constant_force and any(p.preload for p in others)


def _replace_stuck(own: Trial, state: Search, rest: Fit, records: Sequence[Record]) -> Trial:
    """The trial of a name or, where that ended in a worse local minimum, the fit that the name has."""
    stuck = own.excess > state.excess + CHANCE.slack
    return trial_of(state.fit, own.id, rest, records, own.screened) if stuck else own


def _swap(state: Search, name: str, better: Trial, compared: Compared) -> Search:
    said, before, after = f"{name_of(name)} → {better.name}", state.excess, better.excess
    move = Move(kind="swap", name=said, excess_before=before, excess_after=after, rivals=compared.rivals)
    return replace(
        state,
        fit=better.fit,
        names=(*(n for n in state.names if n != name), better.id),
        excess=better.excess,
        moves=(*state.moves, move),
        compared={**state.compared, better.id: compared},
    )


def _comparison(start: Fit, beside: Sequence[str], found: Sequence[Trial]) -> Compared:
    return Compared(without=start, start=start, beside=tuple(beside), rivals=tuple(found))


def drop_name(state: Search, name: str, rest: Fit) -> Search:
    """The state without a name; `rest` is the fit of the others."""
    after = excess_of(rest)
    move = Move(kind="drop", name=name_of(name), excess_before=state.excess, excess_after=after, rivals=())
    names = tuple(n for n in state.names if n != name)
    return replace(state, fit=rest, names=names, excess=after, moves=(*state.moves, move))


def _is_better(best: Trial, name: str, found: Sequence[Trial], state: Search) -> bool:
    """Whether another name fits clearly better than the one in place, or as well and is simpler."""
    simpler = any(complexity(best) < complexity(t) for t in found if t.id == name)
    return simpler or best.excess < state.excess - tolerance(best) - CHANCE.slack


def _is_far_behind(best: Trial, refused: Search | Trial) -> bool:
    """Whether the best of those that may take the place of a refused name leaves several times as much as that does."""
    return best.excess > BUDGET.far_behind * max(refused.excess, own_form(best) + CHANCE.slack)


def fit_without(fit: Fit, name: str, records: Sequence[Record]) -> Fit | None:
    """The model fitted again without one of its elements; None where it can't run so."""
    return _quick_fit(fit.model.in_its_absence(name), records)


def fit_others(state: Search, name: str, records: Sequence[Record]) -> Fit | None:
    """The best fit with every name but one; None where the model can't run so.

    Where the dropped name has left the others, a fit may end in another minimum. One that is worse than the search was
    with fewer of these names is made again from there.
    """
    rest = fit_without(state.fit, name, records)
    others = [n for n in state.names if n != name]
    best = _best_with_fewer(state, name)
    if rest is None or best is None or excess_of(rest) <= best.excess + CHANCE.slack:
        return rest
    model = best.fit.model
    for more in (n for n in others if n not in best.names):
        model = model.with_element(state.fit.model.element(more))
    again = best.fit if model is best.fit.model else _quick_fit(model, records)
    return min((f for f in (rest, again) if f is not None), key=excess_of)


def _best_with_fewer(state: Search, name: str) -> Search | None:
    """The step of the search that fits best with no name but others of those of `state`; None where it has none."""
    others = {n for n in state.names if n != name}
    fewer = [b for b, _ in steps(state) if b.earlier == state.earlier and set(b.names) <= others]
    return min(fewer, key=lambda b: b.excess, default=None)


def _least_without(state: Search, name: str, rest: Fit) -> Fit:
    """What is missing without a name is no more than the search left with fewer names, whatever these were: the others
    may have no effect, though no fit finds that, as of a play that alone would meet rigid contact; or they fit only
    beside this one and have taken the place of one that fitted without it."""
    fewer = [b for b, _ in steps(state) if b.earlier == state.earlier and name not in b.names]
    best = min((b for b in fewer if len(b.names) < len(state.names)), key=lambda b: b.excess, default=None)
    return rest if best is None or excess_of(rest) <= best.excess else best.fit


def _quick_fit(model: Model, records: Sequence[Record]) -> Fit | None:
    with suppress(SimulationError):
        return fit_records(model, records, max_iterations=BUDGET.fit_iterations, tolerance=BUDGET.flat)
    return None
