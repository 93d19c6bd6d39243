"""Polynomial NARX models: terms by orthogonal least squares, each by the share of the force that it explains."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import Band
from identification.blackbox.memory import remembered
from identification.blackbox.model import check_rate
from identification.blackbox.outside import half_width_along
from identification.blackbox.samples import Course, Samples, course_along, samples_of
from identification.blackbox.scaling import LARGEST, Scales
from identification.blackbox.structure import FORCE, Structure
from identification.errors import ModelError
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.models.visited import Visited

if TYPE_CHECKING:
    from identification.blackbox.stepping import BlackBoxStepper

Floats = NDArray[np.float64]
Term = tuple[int, ...]
"""Numbers of the regressors that are multiplied; none: the constant."""

HIGHEST_DEGREE = 4
_DEPENDENT = 1e-10  # share of a term that is left beside those chosen: less is rounding


@dataclass(frozen=True, slots=True)
class Ranked:
    """A term with its error reduction ratio: the share of Σy² that it explains beside those before it."""

    term: Term
    ratio: float


def terms_of(count: int, degree: int) -> list[Term]:
    """All products of up to `degree` of `count` regressors, the constant first."""
    return [term for d in range(degree + 1) for term in combinations_with_replacement(range(count), d)]


def products(regressors: Floats, terms: Sequence[Term]) -> Floats:
    """The value of every term at every sample, (N, T), from regressors (N, R)."""
    out = np.ones((regressors.shape[0], len(terms)))
    for k, term in enumerate(terms):
        for index in term:
            out[:, k] *= regressors[:, index]
    return out


def ranked(columns: Floats, y: Floats, terms: Sequence[Term], count: int) -> list[Ranked]:
    """The `count` terms of the highest error reduction ratio, one after the other, each beside those before it.

    Columns (N, T) are made orthogonal to the one that was chosen as soon as it is (Billings, Chen and Korenberg 1989,
    by modified Gram–Schmidt). Fewer, where nothing but dependent columns is left.
    """
    left, energy, chosen = columns.copy(), float(y @ y), list[Ranked]()
    sizes = np.einsum("ij,ij->j", columns, columns)
    rest = y.copy()
    for _ in range(min(count, len(terms))):
        power = np.einsum("ij,ij->j", left, left)
        usable = power > _DEPENDENT * sizes
        if not usable.any():
            break
        slopes = left.T @ rest
        ratios = np.where(usable, slopes**2 / np.where(usable, power, 1.0), 0.0) / energy
        best = int(np.argmax(ratios))
        chosen.append(Ranked(terms[best], float(ratios[best])))
        direction = left[:, best] / np.sqrt(power[best])
        rest -= direction * (direction @ rest)
        left -= np.outer(direction, direction @ left)
    return chosen


@dataclass(frozen=True, slots=True, kw_only=True)
class PolynomialNarx:
    """F(t) = Σ_k c_k·Π φ over the regressors of each term, all scaled, fed back in free run and cut at its edges.

    With `steps`, the lowest and the highest change of the force in training from a sample to the next, N, a past force
    is seen no lower and no higher than any of the training, and not farther from the one after it than they allow.
    Beyond, its powers grow and nothing was fitted to them: a free run that is there for a moment could stay at an edge
    for ever, or go to and fro between both. None: seen as it is.
    """

    name: str
    dt: float
    scales: Scales
    structure: Structure
    terms: tuple[Term, ...]
    coefficients: Floats = field(compare=False)
    facts: Mapping[str, float] = field(default_factory=dict)
    band: Band | None = None
    visited: Visited | None = None
    steps: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        count = len(self.structure.regressors)
        if self.structure.nodes:
            raise ModelError(f"nodes is {self.structure.nodes}: a polynomial has none")
        if not self.terms or len(self.terms) != self.coefficients.size:
            raise ModelError(f"{len(self.terms)} terms and {self.coefficients.size} coefficients: give as many of each")
        for term in self.terms:
            if len(term) > HIGHEST_DEGREE or not all(0 <= index < count for index in term):
                raise ModelError(f"term {list(term)}: it must be up to {HIGHEST_DEGREE} numbers within 0 … {count - 1}")
        if not np.all(np.isfinite(self.coefficients)):
            raise ModelError("coefficients must be finite numbers")
        if self.steps is not None and not -LARGEST <= self.steps[0] < self.steps[1] <= LARGEST:
            raise ModelError(f"steps is {list(self.steps)}: two changes of the force, N, the lower first")

    @property
    def kind(self) -> str:
        """The word in its file."""
        return "polynomial"

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        needed = [name for name in self.structure.signals if name in ("current", "temperature")]
        return {"displacement": "the model"} | dict.fromkeys(needed, f"the polynomial '{self.name}'")

    @property
    def training_range(self) -> TrainingRange | None:
        """The range of each signal that it sees, and where they went together."""
        limits = {name: (self.scales[name].low, self.scales[name].high) for name in self.structure.signals}
        return TrainingRange(limits, self.visited)

    def names(self) -> Sequence[str]:
        """The terms, such as `F1·v0²` written as `F1·v0·v0`."""
        every = self.structure.regressors
        return ["·".join(str(every[index]) for index in term) or "1" for term in self.terms]

    def values(self) -> Floats:
        """The coefficients, of scaled signals."""
        return self.coefficients

    def free(self) -> NDArray[np.bool_]:
        """All are free."""
        return np.ones(self.coefficients.size, dtype=np.bool_)

    def bounds(self) -> tuple[Floats, Floats]:
        """None has a bound."""
        return np.full(self.coefficients.size, -np.inf), np.full(self.coefficients.size, np.inf)

    def force(self, motion: Motion) -> Floats:
        """Force along a motion from its inputs alone, (N,), N: finite and bounded; raises SimulationError."""
        return self.along(course_along(motion))

    def stepper(self, dt: float) -> BlackBoxStepper:
        """The damper from sample to sample; raises SimulationError where `dt` is not the interval of its training."""
        from identification.blackbox.stepping import polynomial_stepper  # which is built on this module

        return polynomial_stepper(self, dt)

    def half_width(self, motion: Motion, level: float) -> Floats | None:
        """Half of the width of its band, (N,), N; None where it was not calibrated; raises SimulationError."""
        if self.band is None:
            return None
        return half_width_along(self, self.band, motion, level, self.force(motion))

    def memory(self, course: Course) -> float:
        """How long it remembers its start along a course, s, from the lowest to the highest force; may be infinite."""
        return remembered(lambda before: self._from_lead(course, before), self.scales[FORCE]) * self.dt

    def along(self, course: Course) -> Floats:
        """The same along a course, of which the force is not used."""
        return self._from_lead(course)[-course.motion.x.size :]

    def prepared(self, samples: Samples) -> Callable[[Floats], None]:
        """The loop on some samples: it fills the scaled force (N,) from what the samples hold when it is called."""
        from identification.blackbox.loops import polynomial  # compiled where it is used

        degree = max(max((len(term) for term in self.terms), default=1), 1)
        # A term of fewer regressors than the degree is filled with the number of a regressor that is always 1.
        table = np.full((len(self.terms), degree), len(self.structure.regressors), dtype=np.int64)
        for k, term in enumerate(self.terms):
            table[k, : len(term)] = term
        phi = np.ones(len(self.structure.regressors) + 1)
        scale = self.scales[FORCE]
        seen = (-np.inf, np.inf, -np.inf, np.inf)
        if self.steps is not None:
            seen = (*scale.trained, self.steps[0] / scale.size, self.steps[1] / scale.size)
        delays, limits = np.array(self.structure.fed_back, dtype=np.int64), np.array([*scale.edges, *seen])

        def run(force: Floats) -> None:
            polynomial(
                self.coefficients, table, delays, samples.inputs, samples.begin, samples.force, limits, phi, force
            )

        return run

    def _from_lead(self, course: Course, before: float = 0.0) -> Floats:
        """Force of its lead and of the course, N, from a scaled force `before`."""
        check_rate(self.name, self.dt, course.motion.dt)
        samples = samples_of([course.whole()], self.structure, self.scales)
        samples.force[: self.structure.longest] = before
        force, scaled = self.scales[FORCE], np.empty(samples.force.size)
        self.prepared(samples)(scaled)
        return np.asarray(scaled[self.structure.longest :] * force.size + force.centre)


def regressors_of(samples: Samples, delays: Sequence[int]) -> Floats:
    """The regressors of the samples that count with the measured force in the past, (N, R)."""
    rows = np.flatnonzero(samples.counted)
    past = [samples.force[rows - delay] for delay in delays]
    return np.column_stack([*past, samples.inputs[rows]])
