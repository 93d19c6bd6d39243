"""Identifies a black box from runs: structure and weight decay by cross-validation, then a committee on all runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import LeftOut, band_of, coverage_of
from identification.blackbox.choose import Judged
from identification.blackbox.given import Base, Given, given
from identification.blackbox.hybrid import Hybrid
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layered_training import Layered, layered
from identification.blackbox.layers import Layers
from identification.blackbox.model import BlackBox
from identification.blackbox.networks import Told, networks, scales_for
from identification.blackbox.polynomial import PolynomialNarx
from identification.blackbox.recipes import NODES, RECIPES
from identification.blackbox.samples import Course
from identification.blackbox.structure import Structure
from identification.blackbox.terms import best_on_all, judge_polynomials, left_out, on_all, within
from identification.compute.blas import one_blas_thread
from identification.models.band import covered, half_width_of
from identification.models.measures import score_signals
from identification.models.simulation import checked_motion, for_every_sample, name_of, outside_training, simulate_run
from identification.models.visited import TOGETHER, visited_in
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_PASSED_OVER = (
    20  # polynomials that are tried on everything, half of all: beyond, the error has doubled on most records
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Identified:
    """A black box and what was seen on the way.

    `predicted` is the fit, %, of the networks together in cross-validation inside the training, which is to be expected
    on unseen runs of the same kind, of the samples in motion;
    `trained` that on the training; `shown` that on each held-out run, over all its samples. `memory_s` is how long two
    starts from the lowest and the highest force stay apart, infinite where they never meet. `coverage` is the share of
    the samples that the band of 90 % holds in cross-validation, `reached` that on each held-out run. `beyond` are
    sentences on the held-out runs that go where the training never went: their fit says nothing about runs that do not.
    `notes` are sentences on faults of the measured motions that were not learned from.
    """

    model: BlackBox | Hybrid | PolynomialNarx | LayeredNarx
    judged: tuple[Judged, ...]
    predicted: float
    trained: float
    shown: Mapping[str, float]
    memory_s: float
    coverage: float
    reached: Mapping[str, float]
    beyond: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def stable(self) -> bool:
        """Whether every free run forgets where it started."""
        return math.isfinite(self.memory_s)


@one_blas_thread()
def identify(
    kind: str,
    runs: Sequence[Run],
    *,
    held_out: Sequence[Run] = (),
    name: str = "",
    structures: Sequence[Structure] = (),
    rate_hz: float | None = None,
    base: Base | None = None,
    layers: Layers | None = None,
    evolved: bool = False,
    tell: Told | None = None,
) -> Identified:
    """Identify a black box of a kind from `runs`; `held_out` are only simulated and compared, never learned from.

    `structures` take the place of those that the kind tries by default. With `rate_hz` all runs are resampled first.
    A hybrid needs a `base`, and learns what that leaves. With `layers`, or `evolved`, a narx or mlp is one network of
    such layers that predicts; an evolution chooses its activations and first weights.

    Raises
    ------
    DataError
        one line, where the kind is none, there is no run or two are of different rates, a signal is constant, a run
        lacks one that others have, or the samples are too few.
    """
    say = tell or (lambda done, text: None)
    layers = Layers((NODES,)) if layers is None and evolved else layers
    taken = given(
        kind, runs, held_out, structures=structures, rate_hz=rate_hz, base=None if base is None else base.model,
        layers=layers,
    )  # fmt: skip
    courses = taken.courses
    if kind == "polynomial":
        polynomial, judged, parts = _polynomial(courses, taken.tried, say)
        return _shown(_figures(replace(polynomial, name=name or kind), judged, courses, parts), taken)
    if layers is not None:
        tried = [Layered(one.structure, layers, one.decay, evolved) for one in taken.candidates]
        found, judged, parts = layered(tried, courses, say)
        kept = tuple(one for one in taken.measured if one in found.structure.signals)
        found = replace(found, name=name or kind, measured=kept)
        return _shown(_figures(found, judged, courses, parts), taken)
    network, judged, parts = networks(RECIPES[kind], taken.candidates, courses, say)
    kept = tuple(one for one in taken.measured if one in network.signals)
    network = replace(network, name=name or kind, kind=kind if base is None else "nnoe", measured=kept)
    figures = _figures(network, judged, courses, parts)
    if base is None:
        return _shown(figures, taken)
    rest = figures.model
    assert isinstance(rest, BlackBox)  # the network alone
    hybrid = Hybrid(name=rest.name, base=base.model, base_file=base.file, rest=rest)
    return _shown(replace(figures, model=hybrid), taken)


def _polynomial(
    courses: Sequence[Course], tried: Sequence[Structure], say: Told
) -> tuple[PolynomialNarx, list[Judged], list[LeftOut]]:
    """The polynomial that was judged best, on all courses, how all were judged, and what was left out shows of it.

    One whose free run on all courses does not forget its start, or is farther off than that of another in
    cross-validation, is passed over.
    """
    scales, dt = scales_for(courses, tried), courses[0].motion.dt
    judged = judge_polynomials(
        tried, courses, scales, dt, tell=lambda done, of: say(0.9 * done / of, "cross-validation")
    )
    whole = ((error, on_all(one, courses, scales, dt)) for one, error in judged[:_PASSED_OVER])
    best = judged.pop(best_on_all(whole, courses) or 0)
    model = within(on_all(best[0], courses, scales, dt), courses)
    parts = left_out(best[0], courses, scales, dt)
    ordered = [Judged(one, error) for one, error in (best, *judged)]
    return model, ordered, parts


def _figures(
    model: BlackBox | PolynomialNarx | LayeredNarx,
    judged: Sequence[Judged],
    courses: Sequence[Course],
    parts: Sequence[LeftOut],
) -> Identified:
    """The model with its band and its figures on the training, and how long it remembers a start.

    A fit is that of the whole force: what a base explains counts.
    """
    force = np.concatenate([_whole(one)[one.counted] for one in courses])
    rest = np.concatenate([one.force[one.counted] for one in courses])
    left = np.concatenate([(one.force - model.along(one))[one.counted] for one in courses])
    moving = np.concatenate([_whole(one)[one.counted] for one in map(Course.judged, courses)])
    size = float(np.linalg.norm(force - force.mean()))
    errors = np.concatenate([one.errors for one in parts])
    predicted = 100.0 * (1.0 - float(np.sqrt(np.mean(errors**2)) / np.std(moving)))
    trained = 100.0 * (1.0 - float(np.linalg.norm(left)) / size)
    coverage = coverage_of(parts)
    memory = max(model.memory(one) for one in courses)
    seen = [name for name in TOGETHER if name in model.scales]
    facts = {
        **model.facts,
        "fit_predicted": predicted,
        "fit_trained": trained,
        "memory_s": memory,
        "coverage_predicted": coverage,
    }
    if courses[0].model is not None:
        facts["share_of_base"] = 1.0 - float(np.linalg.norm(rest - rest.mean()) / size) ** 2
    return Identified(
        model=replace(
            model,
            facts=facts,
            band=band_of(parts),
            visited=visited_in([(one.motion, one.counted) for one in courses], seen),
        ),
        judged=tuple(judged),
        predicted=predicted,
        trained=trained,
        shown={},
        memory_s=memory,
        coverage=coverage,
        reached={},
    )


def _whole(course: Course) -> Floats:
    return course.force if course.model is None else course.force + course.model


def _shown(found: Identified, taken: Given) -> Identified:
    """The same with the fit on every held-out run, over all its samples, and what the band holds of it."""
    found = replace(found, notes=taken.notes)
    if not taken.held_out:
        return found
    shown, reached, beyond = {}, {}, list[str]()
    for one in taken.held_out:
        motion, force = checked_motion(found.model, one), simulate_run(found.model, one)
        half = half_width_of(found.model, motion)
        assert half is not None  # every kind was calibrated
        shown[name_of(one)] = score_signals(one.channels["force"], force).fit
        reached[name_of(one)] = covered(one.channels["force"], force, for_every_sample(half, motion, one))
        beyond += outside_training(found.model, one)
    facts = {
        **found.model.facts,
        "fit_held_out": float(np.mean(list(shown.values()))),
        "coverage_held_out": float(np.mean(list(reached.values()))),
    }
    model = _with_facts(found.model, facts)
    return replace(found, model=model, shown=shown, reached=reached, beyond=tuple(beyond))


def _with_facts(
    model: BlackBox | Hybrid | PolynomialNarx | LayeredNarx, facts: Mapping[str, float]
) -> BlackBox | Hybrid | PolynomialNarx | LayeredNarx:
    return (
        replace(model, rest=replace(model.rest, facts=facts))
        if isinstance(model, Hybrid)
        else replace(model, facts=facts)
    )
