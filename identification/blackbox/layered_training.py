"""The choice of regressors and weight decay of a layered network by cross-validation, and its training."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import LeftOut
from identification.blackbox.choose import Judged, in_order
from identification.blackbox.evolution import evolve
from identification.blackbox.folds import Fold, folds_of
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layers import Layers, Predictor, Rows, first_layer_weights, rows_of, span_of
from identification.blackbox.leftout import left_out_of
from identification.blackbox.levenberg import Trained, train
from identification.blackbox.networks import scales_for
from identification.blackbox.samples import Course, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.share import fair_share
from identification.blackbox.structure import FORCE, Structure
from identification.compute import run

Floats = NDArray[np.float64]
Told = Callable[[float, str], None]

# Samples that are learned, a fair share of longer courses; steps and tolerance of the least squares. Half of the
# samples: what is rare is seen less; double: twice the time.
_LEARNED, _STEPS, _TOLERANCE = 10_000, 60, 1e-4

# Starts of a network that feeds its force back. Of 72 starts, six of each of 12 settings on measured runs, three ran
# freely with less than half of the fit of the best. Half: all may be lost; double: twice the time.
_STARTS = 5


@dataclass(frozen=True, slots=True)
class Layered:
    """Regressors, layers and a weight decay; `evolved`: activations and first weights come from an evolution."""

    structure: Structure
    layers: Layers
    decay: float
    evolved: bool = False

    def __str__(self) -> str:
        names = " ".join(map(str, self.structure.regressors))
        chosen = f"layers of {', '.join(map(str, self.layers.nodes))} nodes, evolved" if self.evolved else self.layers
        return f"{names}, {chosen}, weight decay {self.decay:g}"


def layered(
    candidates: Sequence[Layered], courses: Sequence[Course], say: Told
) -> tuple[LayeredNarx, list[Judged], list[LeftOut]]:
    """The network of the best candidate on all courses, how all were judged, and what was left out shows of it.

    All are judged without an evolution first; where one is asked for, the best is judged with it too, and it is kept
    where that is better: the training from random weights often is.
    """
    scales = scales_for(courses, [one.structure for one in candidates])
    judged, parts = _judged(
        [replace(one, evolved=False) for one in candidates], courses, scales,
        lambda done: say(0.5 * done, "cross-validation"),
    )  # fmt: skip
    best = judged[0].candidate
    assert isinstance(best, Layered)  # as they were given
    if any(one.evolved for one in candidates):
        again, others = _judged(
            [replace(best, evolved=True)], courses, scales, lambda done: say(0.5 + 0.3 * done, "evolution")
        )
        if again[0].error < judged[0].error:
            best, parts = replace(best, evolved=True), others
        judged = in_order([*judged, *again])
    say(0.8, "training")
    model = nearest_in_free_run(best, courses, scales)
    return model, judged, parts


def nearest_in_free_run(one: Layered, courses: Sequence[Course], scales: Scales) -> LayeredNarx:
    """The network of several starts whose free run on the courses is nearest: one that predicts well need not simulate.

    Without feedback a free run is the prediction, and one start will do.
    """
    starts = range(1, _STARTS + 1) if one.structure.fed_back else (1,)
    found = run(partial(_from_start, one=one, courses=courses, scales=scales), starts)
    return min(found, key=lambda model: squares_on(model, courses))


def _from_start(seed: int, one: Layered, courses: Sequence[Course], scales: Scales) -> LayeredNarx:
    return train_layered(one, courses, scales, seed=seed)


def squares_on(model: LayeredNarx, courses: Sequence[Course]) -> float:
    """Sum of the squared errors in free run on what counts of some courses, N²."""
    return sum(float(np.sum((course.force - model.along(course))[course.counted] ** 2)) for course in courses)


def train_layered(one: Layered, courses: Sequence[Course], scales: Scales, *, seed: int) -> LayeredNarx:
    """One network from one start: a predictor from measured past forces, by least squares with weight decay."""
    width = len(one.structure.regressors)
    rows = rows_of(samples_of(fair_share(courses, _LEARNED), one.structure, scales), one.structure.fed_back)
    layers, facts, span = one.layers, dict[str, float](), span_of(scales[FORCE])
    weights = first_layer_weights(layers, width, seed)
    tried = [layers]
    if one.evolved:
        found = evolve(layers, span, rows, seed=seed)
        tried, weights = usual_beside(found.layers), found.weights
        facts = {"fitness_first": float(found.best[0]), "fitness_last": float(found.best[-1])}
    layers, trained = trained_best(tried, weights, rows, width, span, one.decay)
    kept = {name: scales[name] for name in (FORCE, *one.structure.signals)}
    return LayeredNarx(
        name="", dt=courses[0].motion.dt, scales=kept, structure=one.structure, layers=layers, weights=trained.weights,
        facts=facts,
    )  # fmt: skip


def usual_beside(layers: Layers) -> list[Layers]:
    """The layers, and the same with the usual activations, tansig and purelin, in place of one of theirs or both.

    An evolution judges untrained networks. Among those a bounded output or a linear layer does little harm; trained,
    the one keeps the force from its largest values, the other the network from bending.
    """
    usual = Layers(layers.nodes)
    pairs = product((layers.hidden, usual.hidden), (layers.output, usual.output))
    return [replace(layers, hidden=hidden, output=output) for hidden, output in dict.fromkeys(pairs)]


def trained_best(
    tried: Sequence[Layers], weights: Floats, rows: Rows, width: int, span: tuple[float, float], decay: float
) -> tuple[Layers, Trained]:
    """The layers whose training from the same weights ends at the lowest cost, and that training."""
    found = [
        (one, train(Predictor(one, width, span), weights, rows, decay=decay, most_steps=_STEPS, tolerance=_TOLERANCE))
        for one in tried
    ]
    count = rows.force.size
    return min(found, key=lambda pair: count * pair[1].error + decay * float(pair[1].weights @ pair[1].weights))


def _judged(
    candidates: Sequence[Layered], courses: Sequence[Course], scales: Scales, say: Callable[[float], None]
) -> tuple[list[Judged], list[LeftOut]]:
    """The candidates by their error in free run on what each had not learned from, and those errors of the best."""
    folds = folds_of(courses)
    tasks = list(product(candidates, folds))
    found = run(partial(_errors, scales=scales), tasks, on_done=lambda done, of: say(done / of))
    parts = {k: found[k * len(folds) : (k + 1) * len(folds)] for k in range(len(candidates))}
    size = scales[FORCE].size
    judged = []
    for k, one in enumerate(candidates):
        squares = sum(min(float(part.errors @ part.errors) / size**2, spread) for part, spread in parts[k])
        judged.append(Judged(one, squares / sum(part.errors.size for part, _ in parts[k])))
    ordered = in_order(judged)
    return ordered, [part for part, _ in parts[judged.index(ordered[0])]]


def _errors(task: tuple[Layered, Fold], scales: Scales) -> tuple[LeftOut, float]:
    """Errors, N, on what a fold shows, and Σ of the squared scaled force there about its centre."""
    one, fold = task
    model = train_layered(one, fold.learned, scales, seed=0)
    shown = [course.judged() for course in fold.shown]
    part = left_out_of(lambda course: (model.along(course), 0.0), one.structure.signals, fold)
    force = np.concatenate([course.force[course.counted] for course in shown])
    spread = (force - scales[FORCE].centre) / scales[FORCE].size
    return part, float(spread @ spread)
