"""What a regressor promises before it is trained: the gain of one step of least squares with its weights.

At the weights θ of a structure with the free-run residuals e and their gradient J, the cost (Σe² + decay·θᵀθ) falls
by gᵀ·(JᵀJ + decay + damping)⁻¹·g to first order, g = Jᵀe − decay·θ. A candidate begins with weights of zero: its
gradient is known without training it (a score test). Without a regressor the cost rises by θ_rᵀ·S·θ_r, S the Schur
complement of its weights in JᵀJ + decay (Hassibi and Stork 1993, for a group of weights).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.network import Sums, network
from identification.blackbox.samples import Course, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import Regressor, Structure

Floats = NDArray[np.float64]

_DAMPING = 1e-3  # of the mean of the diagonal of JᵀJ: as in the first step of the training


def gains(
    structure: Structure,
    weights: Floats,
    offered: Sequence[Regressor],
    courses: Sequence[Course],
    scales: Scales,
    decay: float,
) -> dict[Regressor, float]:
    """By how much the cost falls in one step with each of the offered regressors, none of which it has."""
    whole = Structure((*structure.regressors, *offered), structure.nodes)
    begun = inherited(whole, structure, weights)
    sums = _sums(whole, begun, courses, scales)
    slope = sums.slope - decay * begun
    damping = decay + _DAMPING * float(np.mean(np.diag(sums.gram)))
    common = np.concatenate([_of_nodes(whole), *(_of(whole, one) for one in structure.regressors)])
    return {one: _gain(sums.gram, slope, damping, np.concatenate([common, _of(whole, one)])) for one in offered}


def losses(
    structure: Structure, weights: Floats, courses: Sequence[Course], scales: Scales, decay: float
) -> dict[Regressor, float]:
    """By how much the cost rises without each regressor, the other weights taken back to their best."""
    sums = _sums(structure, weights, courses, scales)
    matrix = sums.gram + decay * np.eye(weights.size)
    return {one: _loss(matrix, weights, _of(structure, one)) for one in structure.regressors}


def inherited(structure: Structure, old: Structure, weights: Floats) -> Floats:
    """Weights of a structure with as many nodes, for one with other regressors: new ones begin with none."""
    lanes = structure.lanes
    width, before = len(structure.regressors) + 1, len(old.regressors) + 1
    hidden, linear = np.zeros((width, lanes)), np.zeros(width)
    given = weights[: before * lanes].reshape(before, lanes)
    line = weights[(before + 1) * lanes :]
    for k, one in enumerate((*structure.regressors, None)):
        if one is None or one in old.regressors:
            index = before - 1 if one is None else old.regressors.index(one)
            hidden[k], linear[k] = given[index], line[index]
    output = weights[before * lanes : (before + 1) * lanes]
    return np.concatenate([hidden.ravel(), output, linear])


def _sums(structure: Structure, weights: Floats, courses: Sequence[Course], scales: Scales) -> Sums:
    samples, net = samples_of(courses, structure, scales), network(structure, scales)
    return net.sums(weights, samples, net.simulate(weights, samples))


def _gain(gram: Floats, slope: Floats, damping: float, index: NDArray[np.int64]) -> float:
    matrix = gram[np.ix_(index, index)] + damping * np.eye(index.size)
    return float(slope[index] @ np.linalg.solve(matrix, slope[index]))


def _loss(matrix: Floats, weights: Floats, index: NDArray[np.int64]) -> float:
    rest = np.setdiff1d(np.arange(weights.size), index)
    across = matrix[np.ix_(rest, index)]
    schur = matrix[np.ix_(index, index)] - across.T @ np.linalg.solve(matrix[np.ix_(rest, rest)], across)
    return float(weights[index] @ schur @ weights[index])


def _of(structure: Structure, one: Regressor) -> NDArray[np.int64]:
    """Where the weights of a regressor lie: to every node, and to the force."""
    k, lanes, width = structure.regressors.index(one), structure.lanes, len(structure.regressors) + 1
    return np.append(np.arange(k * lanes, (k + 1) * lanes), (width + 1) * lanes + k)


def _of_nodes(structure: Structure) -> NDArray[np.int64]:
    """Where the weights lie that belong to no regressor: biases and the output of the nodes, and that of the force."""
    width, lanes = len(structure.regressors) + 1, structure.lanes
    return np.append(np.arange((width - 1) * lanes, (width + 1) * lanes), structure.size - 1)
