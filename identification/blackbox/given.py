"""What a black box is identified from, checked before any training: runs at one rate, as courses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from identification.blackbox.choose import Candidate
from identification.blackbox.duplicates import check_distinct
from identification.blackbox.folds import FOLDS, SHORTEST, folds_of
from identification.blackbox.layers import Layers
from identification.blackbox.networks import scales_for
from identification.blackbox.preparation import (
    absent_signals,
    at_one_rate,
    course_of,
    learnable,
    measured_signals,
    velocity_notes,
)
from identification.blackbox.recipes import RECIPES, Recipe
from identification.blackbox.samples import Course
from identification.blackbox.structure import MODEL, Structure
from identification.blackbox.terms import check_products, default_structures
from identification.errors import DataError
from identification.models.modelfile import Json
from identification.models.protocol import SimulationModel
from identification.models.simulation import name_of
from identification.record import check_measured
from rigctl.runfile import Run

# Samples for each weight, at least. Weight decay holds what few samples leave open, so half works on a rich motion;
# below, the force of the training is drawn rather than learned.
LEAST_FOR_EACH_WEIGHT = 3.0
KINDS = (*RECIPES, "polynomial")
LAYERED = ("narx", "mlp")
"""Kinds that predict from measured forces, or from none: their layers may be stated."""


@dataclass(frozen=True, slots=True)
class Base:
    """The model that a hybrid builds on, and the content of its file."""

    model: SimulationModel
    file: Mapping[str, Json]


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """Runs at one rate, the training as courses, and what may be learned from them.

    `measured`: velocity and acceleration that every run holds as measured; `absent`: current and temperature that do
    not vary; `tried`: the structures that are stated, or those that a polynomial tries; `notes`: a line for each fault
    of a measured motion that is left out of the learning.
    """

    held_out: Sequence[Run]
    courses: Sequence[Course]
    measured: tuple[str, ...]
    absent: Sequence[str]
    candidates: Sequence[Candidate]
    tried: Sequence[Structure]
    notes: tuple[str, ...] = ()


def given(
    kind: str,
    runs: Sequence[Run],
    held_out: Sequence[Run] = (),
    *,
    structures: Sequence[Structure] = (),
    rate_hz: float | None = None,
    base: SimulationModel | None = None,
    layers: Layers | None = None,
) -> Given:
    """Runs as a black box of a kind learns from them; everything that would refuse them does so here.

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
    for one in [*runs, *held_out]:
        check_measured(one)
    pieces, notes = learnable(runs)
    if kind in RECIPES and base is None:
        notes += velocity_notes([*pieces, *held_out])
    every = at_one_rate([*pieces, *held_out], rate_hz)
    runs, held_out = every[: len(pieces)], every[len(pieces) :]
    _check_of_kind(kind, structures)
    measured = measured_signals(every) if kind in RECIPES and base is None else ()
    courses = [course_of(one, measured, base) for one in runs]
    absent = absent_signals(runs, courses)
    check_long_enough(courses)
    candidates: list[Candidate] = []
    if kind == "polynomial":
        tried = [Structure(one.regressors, 0) for one in structures] or default_structures(absent)
        _check_present(tried, absent)
        check_products(tried, sum(int(one.counted.sum()) for one in courses))
    else:
        recipe = RECIPES[kind]
        if layers is not None:
            check_layered(kind)
            recipe, structures = replace(recipe, nodes=0), [Structure(one.regressors, 0) for one in structures]
        candidates = candidates_for(recipe, courses, structures, absent, layers)
        tried = [one.structure for one in candidates]
    scales_for(courses, tried)  # refuses a constant signal
    check_distinct(pieces, courses, list(dict.fromkeys(name for one in tried for name in one.signals)))
    _check_held_out(held_out, runs, tried)
    return Given(
        held_out=held_out, courses=courses, measured=measured, absent=absent, candidates=candidates, tried=tried,
        notes=tuple(dict.fromkeys(notes)),
    )  # fmt: skip


def check_long_enough(courses: Sequence[Course]) -> None:
    """Raise DataError where cross-validation would leave nothing to learn from."""
    if not all(fold.learned for fold in folds_of(courses)):
        longest = max(one.force.size for one in courses)
        raise DataError(
            f"the longest run has {longest} samples: cross-validation leaves out a third of each in turn and learns "
            f"from stretches of {SHORTEST}, so at least one run needs {FOLDS * SHORTEST}"
        )


def candidates_for(
    recipe: Recipe,
    courses: Sequence[Course],
    structures: Sequence[Structure],
    absent: Sequence[str],
    layers: Layers | None = None,
) -> list[Candidate]:
    """The structures that are given, or those of the recipe without `absent` signals, for which the samples suffice.

    Raises DataError where a given one sees an absent signal, or the samples suffice for none.
    """
    _check_present(structures, absent)
    recipe_of = [Candidate(one, decay) for one in structures for decay in recipe.decays] or recipe.candidates(absent)
    samples = sum(int(one.counted.sum()) for one in courses)
    weights = [_weights(one.structure, layers) for one in recipe_of]
    fitting = [one for one, count in zip(recipe_of, weights, strict=True) if samples >= LEAST_FOR_EACH_WEIGHT * count]
    if not fitting:
        least = min(weights)
        raise DataError(
            f"{samples} samples for {least} weights: at least {LEAST_FOR_EACH_WEIGHT:g} for each are needed; "
            "record more, or use fewer nodes or regressors"
        )
    return fitting


def check_layered(kind: str) -> None:
    """Raise DataError where a kind has no layers to state."""
    if kind not in LAYERED:
        raise DataError(f"layers, activations and an evolution are for {' and '.join(LAYERED)}, not for {kind!r}")


def _check_of_kind(kind: str, structures: Sequence[Structure]) -> None:
    """Raise DataError where a structure is none of its kind: it would be another model under this name."""
    for one in structures:
        names = " ".join(map(str, one.regressors))
        if MODEL in one.signals and kind != "hybrid":
            raise DataError(f"regressors {names} hold M, the force of a base: only a hybrid has one")
        if kind == "mlp" and one.fed_back:
            raise DataError(f"regressors {names} hold a past force F: an mlp is static, identify a narx")
        if kind == "arx" and one.nodes:
            raise DataError(f"{one.nodes} nodes are stated: an arx is linear and has none, identify a narx")


def _weights(structure: Structure, layers: Layers | None) -> int:
    return structure.weights if layers is None else layers.size(len(structure.regressors))


def _check_present(structures: Sequence[Structure], absent: Sequence[str]) -> None:
    missing = next((name for one in structures for name in one.signals if name in absent), None)
    if missing is not None:
        raise DataError(f"{missing} does not vary in these runs: leave it out of the regressors")


def _check_held_out(held_out: Sequence[Run], runs: Sequence[Run], tried: Sequence[Structure]) -> None:
    """Raise DataError where a held-out run lacks an input that the model may see."""
    for channel in ("current", "temperature"):
        if any(channel in one.signals for one in tried):
            lacking = next((one for one in held_out if channel not in one.channels), None)
            if lacking is not None:
                raise DataError(
                    f"{name_of(lacking)} has no {channel}, {name_of(runs[0])} has: give runs that all have it"
                )
