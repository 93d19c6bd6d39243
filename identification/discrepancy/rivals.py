"""Other elements that were tried in the place of a named one, and how far each is behind it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import inf

from identification.discrepancy.choice import Trial, allowance, complexity
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search
from identification.physical.elements import ElementSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """An element that was tried in the place of a named one, compared with most of the other names there."""

    name: str
    behind: float  # how much worse it fits, in units of the form tolerance; down to -1 where it fits better
    finer: float  # parameters that it has more; 0 where it has none more

    @property
    def margin(self) -> float:
        """How far it is behind, in units of the form tolerance; a parameter more counts as one."""
        return self.behind + self.finer


def rivals_of(found: Search, name: str, withheld: Collection[str] = ()) -> list[Rival]:
    """The rivals of a name, by its id, as last compared; what is named too is no rival, but for names that are withheld
    in the end: these are rivals also where they were last tried at the step at which the name was chosen."""
    compared = found.compared[name].rivals
    chosen = next(t for t in compared if t.id == name)
    stated = set(found.names).difference(withheld)
    latest = [_rival(chosen, t) for t in compared if t.id not in stated and t.id != name]
    since = {t.id for t in compared}
    return latest + [r for n in withheld if n not in since for r in _when_chosen(found, name, n)]


def _when_chosen(found: Search, name: str, other: str) -> list[Rival]:
    """Another name as a rival of one at the latest step at which that was chosen and both were tried; none where there
    is no such step."""
    for move in reversed(found.moves):
        chosen = next((t for t in move.rivals if t.id == name and t.excess == move.excess_after), None)
        tried = [t for t in move.rivals if t.id == other]
        if chosen is not None and tried:
            return [_rival(chosen, min(tried, key=lambda t: t.excess))]
    return []


def margin_of(rivals: list[Rival]) -> float:
    """Margin to the best of them; infinite without one."""
    return min((r.margin for r in rivals), default=inf)


def beside_a_curve(found: Search, name: str) -> bool:
    """Whether a name is a curve over velocity beside another one, of the base or of a name that closes more, whose form
    may be what is wrong.

    A straight one has no form to be wrong: a bend beside it is what it lacks.
    """
    if not found.fit.model.element(name).spec.shaped:
        return False
    return any(e.spec.bent for e in found.given.on("core")) or any(s.shaped for s in _larger(found, name))


def beside_a_loop(found: Search, name: str) -> bool:
    """Whether a name shows just after the motion turns, beside another one that does, of the base or of a name that
    closes more: how that one turns may be what is wrong.
    """
    if not found.fit.model.element(name).spec.after_reversal:
        return False
    beside = [*(e.spec for e in found.given.elements), *_larger(found, name)]
    return any(s.after_reversal for s in beside)


def _larger(found: Search, name: str) -> list[ElementSpec]:
    """The named elements that close more than one of them does."""
    missing = {n: excess_of(c.without) for n, c in found.compared.items() if n in found.names}
    return [found.fit.model.element(n).spec for n in found.names if missing[n] > missing[name]]


def _rival(chosen: Trial, other: Trial) -> Rival:
    worse = max(other.excess - chosen.excess, 0.0) / allowance(chosen, other)
    better = min(max(chosen.excess - other.excess, 0.0) / allowance(other, chosen), 1.0)
    return Rival(name=other.name, behind=worse - better, finer=max(complexity(other) - complexity(chosen), 0.0))
