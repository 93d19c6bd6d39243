"""Confidence in one name: a probability, from what speaks for the name itself and a table fitted to hidden cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, inf, isfinite, log, log1p

from identification.criteria import CHANCE, FORM, TEXT
from identification.errors import ConfidenceTableError

_NO_HELP = 1.5  # share left with a name that is worse than none: no larger one says more
_LARGE = 500.0  # log odds whose exponential can still be taken
_NEARLY_SURE = TEXT.sure - 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Features:
    """What speaks for and against one name, as the search left it: numbers without a unit."""

    spread: float  # of its strengths from run to run, beyond noise; 1 is the common strength
    runs: int  # that know something of its strength
    left_beside: float  # share of what was missing without this name that is left with it
    left_held_out: float  # the same on runs that were held out; that of the others where these do not show it
    margin: float  # to the best rival, in units of the form tolerance; a parameter more is one; inf without a rival
    own_share: float  # of its signature: what no refit of the base could imitate
    beside_curve: bool  # it is a curve over velocity, and the base has one of its own
    beside_loop: bool  # it shows just after the motion turns, and so does one of the base or one that closes more


def _beyond(amplitude: float, width: float) -> float:
    """Minus the logarithm of a heavy-tailed density of an amplitude: real effects have some, and no sharp limit."""
    return log1p((amplitude / width) ** 2)


DOUBTS: Mapping[str, Callable[[Features], float]] = {
    # The standard error of the common strength, by its scatter; half the tolerance is that of four runs within it.
    "scatter": lambda f: _beyond(f.spread / max(f.runs, 1) ** 0.5, 0.5 * FORM.tolerance),
    "few_runs": lambda f: 1.0 / max(f.runs, 1),
    "left_held_out": lambda f: min(f.left_held_out, _NO_HELP) ** 0.5,  # the root of an energy is an amplitude
    "rivalry": lambda f: (
        1.0 / (2.0 + f.margin)
    ),  # a margin is -1 at least: 1 for the closest rival, 1/2 for an even one
    "imitated": lambda f: -log(min(max(f.own_share, CHANCE.visible), 1.0)),
    "beside_curve": lambda f: float(f.beside_curve),
    "beside_loop": lambda f: float(f.beside_loop),
}
"""What speaks against a name, each ≥ 0 and larger the more it does.

What stays on the fitted runs is none of them: what else is missing decides the verdict and not a name. Nor is how far
the base's own curves moved to make room: a viscous base of a digressive damper has to move far.
"""


def doubts(features: Features) -> dict[str, float]:
    """Every doubt about a name, by what it is about."""
    return {name: of(features) for name, of in DOUBTS.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Log odds of a name without a doubt, and what each doubt takes off them."""

    without_doubt: float
    weights: Mapping[str, float]  # of each doubt, ≥ 0
    most: tuple[float, float]  # that one run, and two, can bear out: steadiness from run to run is hardly seen there
    sure_from: float  # probability from which names are nearly all right: below it none is called sure
    names: int  # judged names that it was fitted to

    def __post_init__(self) -> None:
        if sorted(self.weights) != sorted(DOUBTS):
            raise ConfidenceTableError(f"weights of {', '.join(self.weights)}: they must be of {', '.join(DOUBTS)}")
        for name, weight in self.weights.items():
            if not (isfinite(weight) and weight >= 0.0):
                raise ConfidenceTableError(f"weight of {name} is {weight}: it must be finite and not negative")
        if not 0.0 <= self.most[0] <= self.most[1] <= 1.0:
            raise ConfidenceTableError(f"most is {self.most}: it must be two probabilities, the larger one last")
        if not TEXT.sure <= self.sure_from <= 1.0:
            raise ConfidenceTableError(f"sure_from is {self.sure_from}: it must be from {TEXT.sure} to 1")
        if not isfinite(self.without_doubt):
            raise ConfidenceTableError(f"without_doubt is {self.without_doubt}: it must be finite")


def confidence(features: Features, table: Table) -> float:
    """Probability that a name is true: 1/(1 + e^-z), z = z₀ - Σ wₖ dₖ over its doubts d; no more than its runs bear.

    A probability of 0.9 or more is taken for certainty: below `sure_from`, 0.89 is stated instead.
    """
    against = sum(table.weights[name] * d for name, d in doubts(features).items())
    z = max(min(table.without_doubt - against, _LARGE), -_LARGE)
    return min(_stated(1.0 / (1.0 + exp(-z)), table), most_from(features.runs, table))


def most_from(runs: int, table: Table) -> float:
    """The most that is stated of a name that so many runs show."""
    return _stated((*table.most, 1.0)[min(max(runs, 1), 3) - 1], table)


def _stated(probability: float, table: Table) -> float:
    return probability if probability >= table.sure_from else min(probability, _NEARLY_SURE)


def confidence_without_rival(runs: int, table: Table) -> float:
    """Probability of what nothing else could be and all runs show alike, such as a tone out of the noise."""
    clear = Features(
        spread=0.0,
        runs=runs,
        left_beside=0.0,
        left_held_out=0.0,
        margin=inf,
        own_share=1.0,
        beside_curve=False,
        beside_loop=False,
    )
    return confidence(clear, table)
