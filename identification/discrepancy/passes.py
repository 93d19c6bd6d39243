"""The search in passes: with the names of one pass in the base, until a pass finds none."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from identification.criteria import FORM, TEXT
from identification.discrepancy.evidence import Evidence, excess_on
from identification.discrepancy.excess import excess_of, is_seen
from identification.discrepancy.naming import (
    Compared,
    Search,
    fit_without,
    gap_remains,
    steps,
)
from identification.discrepancy.needless import drop_departures, drop_preloads, merge_names
from identification.discrepancy.search import NOTHING, Beside, search
from identification.discrepancy.verdict import drop_doubtful
from identification.errors import ModelError, SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.physical.model import Model, name_of
from identification.physical.predict import predict
from identification.record import Record
from identification.share import fair_shares

Found = tuple[Search, list[Evidence], list[Evidence]]
Report = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Passes:
    """What all passes have found, and where the last one has looked."""

    found: Search
    evidence: list[Evidence]
    withheld: list[Evidence]  # the evidence for names that are not stated
    within: Search | None  # what a last pass found within the tolerance of form
    before: Search | None  # what an earlier search had named in the base
    base: Fit  # without a name, on `records`
    records: Sequence[Record]


def search_in_passes(
    given: Model,
    base: Fit,
    records: Sequence[Record],
    held_out: Sequence[Record],
    report: Report,
    *,
    is_enough: Callable[[Model], bool] = lambda model: False,
    whole: Sequence[Record] | None = None,
) -> Passes:
    """Names that `base` is missing on `records` (compact), and the evidence for them. Nothing more is sought beside a
    model that `is_enough`.

    A doubtful name that is taken back leaves room for another, and a small effect hides in the error of form that a
    large one may have: the search is repeated with the names that stand as part of the base, until a pass finds none.
    What it finds within the tolerance of form counts where it closes nearly all that was left, or is sure: a departure
    of form is no other element. Each pass looks at the fair shares of the `whole` records in which the model it starts
    from fails most: an effect may act elsewhere than where the first one failed. How far a form departs is judged on
    the whole. Names that an earlier search has left in the base count as those of a pass before.
    """
    whole = records if whole is None else whole
    before, without = _named_before(base, records)
    gap = before is None or _gap_remains_on(whole, before, without)
    beside = NOTHING if before is None else _beside(before, (), gap)
    found, evidence, withheld = one_pass(given, base, beside, records, held_out, report, is_enough)
    grown, within, refused = bool(found.names), None, _refused(found, withheld)
    if before is not None and grown and not (gap or _are_effects(found, evidence, before, held_out)):
        within = None if _look_like_form(found) else found
        found, evidence = replace(before, names=(), earlier=beside.earlier, base_excess=before.excess), []
        grown = False
    while grown and len(found.names) < FORM.most_effects and not is_enough(found.fit.model):
        found, base, records = _elsewhere(found, base, records, _share_again(whole, found.fit.model))
        if not is_seen(found.excess, records):
            break
        report(f"searching for more beside {len(found.names)}")
        gap = _gap_remains_on(whole, found, base)
        beside = _beside(found, refused, gap)
        more, new, doubtful = one_pass(found.fit.model, found.fit, beside, records, held_out, report)
        # Where no name is new, an element may be: how one named earlier departs from its ideal.
        grown, refused = more.fit.model.ids != found.fit.model.ids, _refused(more, doubtful)
        if more.names and not (gap or _are_effects(more, new, found, held_out)):
            within = None if _look_like_form(more) else more
            break
        withheld = list({e.name: e for e in (*withheld, *doubtful)}.values())
        if grown:
            found = _together(found, more, records)
            evidence = [e for e in (*evidence, *new) if e.name in found.names]
            if (merged := merge_names(found, records)).names != found.names:
                found, evidence, doubtful = _judged(merged, records, held_out)
                withheld = [*withheld, *doubtful]
    withheld = [e for e in withheld if e.name not in found.names]
    return Passes(
        found=found, evidence=evidence, withheld=withheld, within=within, before=before, base=base, records=records
    )  # fmt: skip


def _named_before(base: Fit, records: Sequence[Record]) -> tuple[Search | None, Fit]:
    """What an earlier search had named in the base, as the state in which it ended, and the fit without these names;
    None and the base where it had named nothing, or the model can't run without."""
    names = tuple(e.id for e in base.model.elements if e.named)
    if not names:
        return None, base
    model = base.model
    with suppress(SimulationError, ModelError):
        for name in names:
            model = model.in_its_absence(name)
        without = fit_records(model, records)
        left = excess_of(without)
        return Search(fit=base, names=names, excess=excess_of(base), given=base.model, base_excess=left), without
    return None, base


def _beside(found: Search, refused: Sequence[str], gap: bool) -> Beside:
    """What is asked of a name beside those found. Within the tolerance of their forms, where no gap remains, a name
    that closes a minor part of the rest leads to none that count, and each must count alone: nearly all that is left
    is closed by it, or it is sure. The next is sought in the next pass."""
    beside = Beside(earlier=found.names, refused=frozenset(refused))
    return beside if gap else replace(beside, helps=FORM.minor, most=1)


def _are_effects(more: Search, new: Sequence[Evidence], found: Search, held: Sequence[Record]) -> bool:
    """Whether names within the tolerance of the forms of those found are effects of their own, and not how these
    forms depart."""
    return _closes_the_rest(more, found, held) or _are_sure(new)


def _share_again(whole: Sequence[Record], model: Model) -> list[Record]:
    """The fair shares of the records in which a model fails most."""
    return fair_shares(whole, [r.measured - predict(model, r)[0] for r in whole])


def _gap_remains_on(whole: Sequence[Record], found: Search, base: Fit) -> bool:
    """Whether a gap remains beyond the form of the names on the whole records: on pieces that were chosen for what is
    left there, a departure of form is larger than it is."""
    left, without = (excess_on(whole, model) for model in (found.fit.model, base.model))
    return math.isinf(left) or gap_remains(replace(found, excess=left, base_excess=without), whole)


def _elsewhere(
    found: Search, base: Fit, records: Sequence[Record], others: Sequence[Record]
) -> tuple[Search, Fit, Sequence[Record]]:
    """The search and its base fitted to other records, and these; as they are where no record is another one, or the
    model can't run along them."""
    if all(r is q for r, q in zip(records, others, strict=True)):
        return found, base, records
    try:
        fit, base = fit_records(found.fit.model, others), fit_records(base.model, others)
    except SimulationError:
        return found, base, records
    compared = {n: _compared_beside(found.compared[n], fit, n, others) for n in found.names}
    moved = replace(found, fit=fit, excess=excess_of(fit), base_excess=excess_of(base), compared=compared, before=None)
    return moved, base, others  # without the steps of the search, which were of other records


def _closes_the_rest(more: Search, found: Search, held_out: Sequence[Record]) -> bool:
    """Whether names within the tolerance of the forms of others are effects of their own: they close nearly all that
    is left, on records that were held out too, and none looks like how the form of another one departs."""
    before, after = (excess_on(held_out, s.fit.model) for s in (found, more))
    return more.excess < FORM.minor * found.excess and after < before and not _look_like_form(more)


def _are_sure(new: Sequence[Evidence]) -> bool:
    """Whether names within the tolerance of the forms of others are sure: a departure of form is not that steady."""
    return all(e.confidence >= TEXT.sure for e in new)


def _look_like_form(more: Search) -> bool:
    """Whether a name is a curve over velocity, a dry friction among them, or acts in series with a friction: that of
    another one may be off by as much, and builds up as if it did."""
    new = [more.fit.model.element(n).spec for n in more.names]
    rubs = any(e.spec.dry_friction for e in more.fit.model.elements if e.id not in more.names)
    return any(spec.curve is not None or spec.dry_friction or (rubs and spec.path == "mount") for spec in new)


def one_pass(
    given: Model,
    base: Fit,
    beside: Beside,
    records: Sequence[Record],
    held_out: Sequence[Record],
    report: Report,
    is_enough: Callable[[Model], bool] = lambda model: False,
) -> Found:
    """One search `beside` names of the base: what stands of it, and the evidence for what does and what does not."""
    found = search(given, base, records, beside=beside, on_progress=report, is_enough=is_enough)
    stands, evidence, withheld = _standing(found, records, held_out)
    return stands, [e for e in evidence if e.name in stands.names], withheld


def _refused(stands: Search, withheld: Sequence[Evidence]) -> list[str]:
    """Names that are not stated and that the next pass would only find again: the search came to them from the names
    that stand."""
    again = any(set(before.names) == set(stands.names) for before, _ in steps(stands))
    return [name_of(e.name) for e in withheld] if again else []


def _standing(found: Search, records: Sequence[Record], held_out: Sequence[Record]) -> Found:
    """The names of a search that stand; where none of the last step stands, those of the latest one of which one does;
    and those of an earlier step, or of a search from another start, where one stands beside all these, or which leave
    much less.

    A name that stood alone may have been exchanged for one that fits only beside a name that does not stand, or share
    its effect with one that came after it.
    """
    best = stands, _, withheld = _judged(found, records, held_out)
    if stands.names and not withheld:
        return best
    for other in (*(before for before, _ in steps(found)), *found.others):
        if _says_more(other, best[0]):
            judged = _judged(other, records, held_out)
            best = judged if _says_more(judged[0], best[0]) else best
    return best


def _says_more(other: Search, stands: Search) -> bool:
    """Whether a step of a search has more names than those that stand, all of these among them, or leaves much less."""
    leaves_less = bool(other.names) and other.excess < (1.0 - FORM.closes) * stands.excess
    return leaves_less or set(other.names) > set(stands.names)


def _judged(found: Search, records: Sequence[Record], held_out: Sequence[Record]) -> Found:
    found, evidence, withheld = drop_doubtful(merge_names(found, records), records, held_out)
    return drop_departures(found, records), evidence, withheld


def _together(found: Search, more: Search, records: Sequence[Record]) -> Search:
    """One search that has found the names of two, of which the second had the first ones in its base."""
    earlier = {
        n: min(own, _compared_beside(own, more.fit, n, records), key=lambda c: excess_of(c.without))
        for n, own in ((n, found.compared[n]) for n in found.names)
    }
    both = replace(
        more,
        names=(*found.names, *more.names),
        given=found.given,
        earlier=(),
        base_excess=found.base_excess,
        moves=(*found.moves, *more.moves),
        compared={**more.compared, **earlier},
    )
    return drop_preloads(both, records)


def _compared_beside(compared: Compared, fit: Fit, name: str, records: Sequence[Record]) -> Compared:
    """The comparison of an earlier name, with the fit that lacks only that."""
    without = fit_without(fit, name, records)
    return compared if without is None else replace(compared, without=without)
