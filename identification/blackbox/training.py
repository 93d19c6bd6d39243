"""The training of one network: its start as a predictor, then over longer and longer stretches of free run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.levenberg import Trained, train
from identification.blackbox.model import Member
from identification.blackbox.network import network
from identification.blackbox.rests import rests_of
from identification.blackbox.samples import Course, Samples, samples_of
from identification.blackbox.scaling import Scales, scale_of
from identification.blackbox.share import fair_share
from identification.blackbox.structure import FORCE, Structure
from identification.errors import DataError, ModelError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stage:
    """Steps of least squares in which the force is fed back over no more than `horizon` samples; None: all.

    It learns from a fair share of about `samples` samples; None: from all, in steps for which `REFINED` allows.
    """

    horizon: int | None
    most_steps: int
    tolerance: float
    samples: int | None


# A predictor is fitted first: its error is smooth in its weights. Fed back, it is often unstable, and the gradient of a
# long free run is then useless; over stretches that grow it finds a stable one on the way.
#
# Of a long training a share is learned, then a few steps refine on everything. Half of each number of samples: the
# search sees less of what is rare; double: it takes twice as long.
_JUDGED, _LEARNED = 5_000, 10_000
REFINED = 400_000  # samples × steps of a refinement: two seconds of a network of 12 nodes
_LEAST_STEPS = 3
PREDICTOR = (Stage(1, 40, 1e-4, _LEARNED), Stage(1, 40, 1e-4, None))
FULL = (
    Stage(1, 40, 1e-4, _LEARNED),
    Stage(20, 15, 1e-3, _LEARNED),
    Stage(100, 15, 1e-3, _LEARNED),
    Stage(500, 15, 1e-3, _LEARNED),
    Stage(None, 100, 1e-4, _LEARNED),
    Stage(None, 40, 1e-4, None),
)
QUICK = (Stage(1, 20, 1e-3, _JUDGED), Stage(20, 10, 1e-3, _JUDGED), Stage(None, 25, 1e-3, _JUDGED))
QUICK_PREDICTOR = (Stage(1, 40, 1e-4, _JUDGED),)


def scales_of(courses: Sequence[Course], signals: Sequence[str]) -> Scales:
    """Scales of the force and of some signals over the samples that count; raises DataError for a constant one."""
    taken = {FORCE: np.concatenate([one.force[one.counted] for one in courses])}
    for name in signals:
        taken[name] = np.concatenate([one.series(name)[one.counted] for one in courses])
    out = {}
    for name, values in taken.items():
        try:
            out[name] = scale_of(values)
        except ModelError as error:
            raise DataError(f"{name}: {error} in all runs, at {values[0]:g}: leave it out of the regressors") from error
    return out


def first_weights(structure: Structure, seed: int) -> Floats:
    """Random weights for scaled signals: sums of about 1 in the nodes, and a small share of each in the force."""
    rng = np.random.default_rng(seed)
    width, lanes, nodes = len(structure.regressors) + 1, structure.lanes, structure.nodes
    hidden, output = np.zeros((width, lanes)), np.zeros(lanes)
    hidden[:, :nodes] = rng.standard_normal((width, nodes)) / np.sqrt(width)
    output[:nodes] = 0.1 * rng.standard_normal(nodes)
    return np.concatenate([hidden.ravel(), output, np.zeros(width)])


def train_member(
    structure: Structure,
    scales: Scales,
    courses: Sequence[Course],
    *,
    decay: float,
    seed: int,
    stages: Sequence[Stage] = FULL,
    rested: bool = False,
) -> tuple[Member, Trained]:
    """One network from one random start, through all stages; `rested`: it learns a prior for rest (see `rests`).

    A free run that learns begins from the measured force where it is fed back: nobody knows the motion before a record,
    and an error of that is none of the network.
    """
    net, weights = network(structure, scales), first_weights(structure, seed)
    whole = _counted(courses)
    done: tuple[int | None, int] | None = None  # horizon and samples of the stage before
    for stage in stages if structure.fed_back else _joined(stages):
        seen = list(courses) if stage.samples is None else fair_share(courses, stage.samples)
        count = _counted(seen)
        if done == (stage.horizon, count):
            continue  # the share was everything
        if done is None or done[1] != count:
            samples = _samples(seen, structure, scales, rested)
        trained = train(
            net,
            weights,
            samples,
            decay=decay * count / whole,  # beside the error of a sample it weighs what it weighs on the whole
            horizon=stage.horizon,
            most_steps=_steps(stage, count),
            tolerance=stage.tolerance,
        )
        weights, done = trained.weights, (stage.horizon, count)
    return Member(structure, weights), trained


def _samples(courses: Sequence[Course], structure: Structure, scales: Scales, rested: bool) -> Samples:
    """The samples that a network learns, with rests where asked for: not those of a linear model, of what a base
    leaves, or of a force that is fed back."""
    if structure.fed_back:
        return samples_of(courses, structure, scales, begun=True)
    rests = rests_of(courses) if rested and structure.nodes and courses[0].model is None else []
    return samples_of([*courses, *rests], structure, scales).alone()


def _joined(stages: Sequence[Stage]) -> list[Stage]:
    """Stages for a network without feedback, to which no horizon matters: one of all steps on each share of samples."""
    return [
        Stage(None, sum(one.most_steps for one in same), min(one.tolerance for one in same), samples)
        for samples, same in ((key, list(group)) for key, group in groupby(stages, key=lambda one: one.samples))
    ]


def _counted(courses: Sequence[Course]) -> int:
    return sum(int(one.counted.sum()) for one in courses)


def _steps(stage: Stage, count: int) -> int:
    if stage.samples is not None:
        return stage.most_steps
    return min(stage.most_steps, max(_LEAST_STEPS, REFINED // max(count, 1)))
