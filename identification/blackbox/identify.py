"""Identifies a black box from runs: structure and weight decay by cross-validation, then a committee on all runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.choose import Candidate, Judged, beyond, committee, in_order, judge
from identification.blackbox.hybrid import Hybrid
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.polynomial import PolynomialNarx
from identification.blackbox.preparation import at_one_rate, course_of, measured_signals
from identification.blackbox.recipes import RECIPES, Recipe
from identification.blackbox.samples import Course
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, Structure
from identification.blackbox.terms import default_structures, judge_polynomials, polynomial_of, ranking
from identification.blackbox.training import scales_of
from identification.errors import DataError
from identification.models.measures import score_signals
from identification.models.modelfile import Json
from identification.models.protocol import SIGNALS, SimulationModel
from identification.models.simulation import check_inputs, name_of, simulate_run
from rigctl.runfile import Run

Floats = NDArray[np.float64]
Told = Callable[[float, str], None]

# Samples for each weight, at least. Weight decay holds what few samples leave open, so half works on a rich motion;
# below, the force of the training is drawn rather than learned.
LEAST_FOR_EACH_WEIGHT = 3.0
KINDS = (*RECIPES, "polynomial")
MOST_DECADES = 2  # of weight decay beyond those that a kind begins with
_VARIES = 1e-9  # of the highest value: rounding is no variation


@dataclass(frozen=True, slots=True)
class Base:
    """The model that a hybrid builds on, and the content of its file."""

    model: SimulationModel
    file: Mapping[str, Json]


@dataclass(frozen=True, slots=True, kw_only=True)
class Identified:
    """A black box and what was seen on the way.

    `predicted` is the fit, %, that cross-validation inside the training expects on unseen runs of the same kind;
    `trained` that on the training; `shown` that on each held-out run, over all its samples. `memory_s` is how long two
    starts from the lowest and the highest force stay apart, infinite where they never meet.
    """

    model: BlackBox | Hybrid | PolynomialNarx
    judged: tuple[Judged, ...]
    predicted: float
    trained: float
    shown: Mapping[str, float]
    memory_s: float

    @property
    def stable(self) -> bool:
        """Whether every free run forgets where it started."""
        return math.isfinite(self.memory_s)


def identify(
    kind: str,
    runs: Sequence[Run],
    *,
    held_out: Sequence[Run] = (),
    name: str = "",
    structures: Sequence[Structure] = (),
    rate_hz: float | None = None,
    base: Base | None = None,
    tell: Told | None = None,
) -> Identified:
    """Identify a black box of a kind from `runs`; `held_out` are only simulated and compared, never learned from.

    `structures` take the place of those that the kind tries by default. With `rate_hz` all runs are resampled first.
    A hybrid needs a `base`, and learns what that leaves.

    Raises
    ------
    DataError
        one line, where the kind is none, there is no run or two are of different rates, a signal is constant, a run
        lacks one that others have, or the samples are too few.
    """
    if kind not in KINDS:
        raise DataError(f"kind is {kind!r}: a black box is {', '.join(KINDS)}")
    if (kind == "hybrid") != (base is not None):
        raise DataError("a hybrid, and no other kind, needs a base: give a model with named elements")
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    say = tell or (lambda done, text: None)
    every = at_one_rate([*runs, *held_out], rate_hz)
    runs, held_out = every[: len(runs)], every[len(runs) :]
    measured = measured_signals(every) if kind in RECIPES and base is None else ()
    courses = [course_of(one, measured, base.model if base else None) for one in runs]
    if kind == "polynomial":
        polynomial, judged = _polynomial(runs, courses, structures, say)
        return _shown(_figures(replace(polynomial, name=name or kind), judged, courses), held_out)
    network, judged = _networks(RECIPES[kind], _candidates(RECIPES[kind], runs, courses, structures), courses, say)
    kept = tuple(one for one in measured if one in network.signals)
    network = replace(network, name=name or kind, kind=kind if base is None else "nnoe", measured=kept)
    figures = _figures(network, judged, courses)
    if base is None:
        return _shown(figures, held_out)
    rest = figures.model
    assert isinstance(rest, BlackBox)  # the network alone
    hybrid = Hybrid(name=rest.name, base=base.model, base_file=base.file, rest=rest)
    return _shown(replace(figures, model=hybrid), held_out)


def _networks(
    recipe: Recipe, candidates: Sequence[Candidate], courses: Sequence[Course], say: Told
) -> tuple[BlackBox, list[Judged]]:
    """The committee of the best candidates, and how all were judged."""
    scales, dt = _scales(courses, [one.structure for one in candidates]), courses[0].motion.dt
    judged = judge(
        candidates, courses, scales, dt, stages=recipe.quick,
        tell=lambda done, of: say(0.4 * done / of, "cross-validation"),
    )  # fmt: skip
    for _ in range(MOST_DECADES):
        further = beyond(judged, recipe.best)
        judged = in_order([*judged, *judge(further, courses, scales, dt, stages=recipe.quick)])
    best = [one.candidate for one in judged[: recipe.best] if isinstance(one.candidate, Candidate)]
    trained = committee(
        best * recipe.starts, courses, scales, stages=recipe.full,
        tell=lambda done, of: say(0.5 + 0.5 * done / of, "training"),
    )  # fmt: skip
    seen = dict.fromkeys([FORCE, *(signal for one in best for signal in one.structure.signals)])
    members = _forgetting([member for member, _ in trained], courses, scales)
    return BlackBox(name="", kind="", dt=dt, scales={name: scales[name] for name in seen}, members=members), judged


def _polynomial(
    runs: Sequence[Run], courses: Sequence[Course], structures: Sequence[Structure], say: Told
) -> tuple[PolynomialNarx, list[Judged]]:
    """The polynomial that was judged best, on all courses, and how all were judged."""
    absent = _absent(runs, courses)
    tried = [Structure(one.regressors, 0) for one in structures] or default_structures(absent)
    _check_present(tried, absent)
    scales, dt = _scales(courses, tried), courses[0].motion.dt
    judged = judge_polynomials(
        tried, courses, scales, dt, tell=lambda done, of: say(0.9 * done / of, "cross-validation")
    )
    best = judged[0][0]
    terms = ranking(best.structure, best.degree, courses, scales)[: best.terms]
    kept = {name: scales[name] for name in (FORCE, *best.structure.signals)}
    model = polynomial_of(best.structure, terms, courses, kept, dt)
    return model, [Judged(one, error) for one, error in judged]


def _scales(courses: Sequence[Course], structures: Sequence[Structure]) -> Scales:
    return scales_of(courses, list(dict.fromkeys(name for one in structures for name in one.signals)))


def _absent(runs: Sequence[Run], courses: Sequence[Course]) -> list[str]:
    return [channel for channel in ("current", "temperature") if not _varies(channel, runs, courses)]


def _check_present(structures: Sequence[Structure], absent: Sequence[str]) -> None:
    missing = next((name for one in structures for name in one.signals if name in absent), None)
    if missing is not None:
        raise DataError(f"{missing} does not vary in these runs: leave it out of the regressors")


def _candidates(
    recipe: Recipe, runs: Sequence[Run], courses: Sequence[Course], structures: Sequence[Structure]
) -> list[Candidate]:
    absent = _absent(runs, courses)
    _check_present(structures, absent)
    recipe_of = [Candidate(one, decay) for one in structures for decay in recipe.decays] or recipe.candidates(absent)
    samples = sum(int(one.counted.sum()) for one in courses)
    fitting = [one for one in recipe_of if samples >= LEAST_FOR_EACH_WEIGHT * one.structure.weights]
    if not fitting:
        least = min(one.structure.weights for one in recipe_of)
        raise DataError(
            f"{samples} samples for {least} weights: at least {LEAST_FOR_EACH_WEIGHT:g} for each are needed; "
            "record more, or use fewer nodes or regressors"
        )
    return fitting


def _varies(channel: str, runs: Sequence[Run], courses: Sequence[Course]) -> bool:
    """Whether a channel varies over the runs; raises DataError where some have it and others do not."""
    having = [one for one in runs if channel in one.channels]
    if not having:
        return False
    low, high = (f([f(getattr(one.motion, SIGNALS[channel])) for one in courses]) for f in (np.min, np.max))
    if high - low <= _VARIES * max(abs(low), abs(high)):
        return False
    if len(having) < len(runs):
        lacking = next(one for one in runs if channel not in one.channels)
        raise DataError(f"{name_of(lacking)} has no {channel}, {name_of(having[0])} has: give runs that all have it")
    return True


def _forgetting(members: Sequence[Member], courses: Sequence[Course], scales: Scales) -> tuple[Member, ...]:
    """The members that forget where a free run began, on every course; all of them where none does."""
    alone = [
        BlackBox(name="", kind="", dt=courses[0].motion.dt, scales=scales, members=(member,)) for member in members
    ]
    stable = [one.members[0] for one in alone if all(math.isfinite(one.memory(c)) for c in courses)]
    return tuple(stable or members)


def _figures(model: BlackBox | PolynomialNarx, judged: Sequence[Judged], courses: Sequence[Course]) -> Identified:
    """The model with its figures on the training, and how long it remembers a start.

    A fit is that of the whole force: what a base explains counts.
    """
    force = np.concatenate([_whole(one)[one.counted] for one in courses])
    rest = np.concatenate([one.force[one.counted] for one in courses])
    left = np.concatenate([(one.force - model.along(one))[one.counted] for one in courses])
    size = float(np.linalg.norm(force - force.mean()))
    predicted = 100.0 * (1.0 - math.sqrt(judged[0].error * rest.size) * model.scales[FORCE].size / size)
    trained = 100.0 * (1.0 - float(np.linalg.norm(left)) / size)
    memory = max(model.memory(one) for one in courses)
    facts = {"fit_predicted": predicted, "fit_trained": trained, "memory_s": memory}
    if courses[0].model is not None:
        facts["share_of_base"] = 1.0 - float(np.linalg.norm(rest - rest.mean()) / size) ** 2
    return Identified(
        model=replace(model, facts=facts),
        judged=tuple(judged),
        predicted=predicted,
        trained=trained,
        shown={},
        memory_s=memory,
    )


def _whole(course: Course) -> Floats:
    return course.force if course.model is None else course.force + course.model


def _shown(found: Identified, held_out: Sequence[Run]) -> Identified:
    """The same with the fit on every held-out run, over all its samples."""
    for one in held_out:
        check_inputs(found.model, one)
    shown = {name_of(one): score_signals(one.channels["force"], simulate_run(found.model, one)).fit for one in held_out}
    if not shown:
        return found
    facts = {**found.model.facts, "fit_held_out": float(np.mean(list(shown.values())))}
    return replace(found, model=_with_facts(found.model, facts), shown=shown)


def _with_facts(
    model: BlackBox | Hybrid | PolynomialNarx, facts: Mapping[str, float]
) -> BlackBox | Hybrid | PolynomialNarx:
    return (
        replace(model, rest=replace(model.rest, facts=facts))
        if isinstance(model, Hybrid)
        else replace(model, facts=facts)
    )
