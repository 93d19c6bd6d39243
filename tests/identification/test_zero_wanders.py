"""A load cell whose zero differs from run to run: one constant force, and no spring that makes up for it."""

from __future__ import annotations

import numpy as np
import pytest

from identification.discrepancy import explain
from identification.physical.model import Model, element
from rigctl.runfile import Run
from tests.identification.ordinary import motion, recorded

BASE = Model(
    name="a bush, as simulated today",
    elements=(
        element("linear_stiffness", {"k": 7.2e5}),
        element("viscous_damping", {"c": 3000.0, "c_control": 0.0}, fixed=("c_control",)),
    ),
)


def bush(seed: int, zeros: tuple[float, ...]) -> list[Run]:
    """Runs of a spring beside a dashpot, each with the zero of its own session, N."""
    rng = np.random.default_rng([7, seed])
    runs = []
    for k, zero in enumerate(zeros):
        _, x, v = motion(100 * seed + k, rng.uniform(0.002, 0.004), seconds=rng.uniform(6.0, 20.0))
        runs.append(recorded("bush", k, x, 8.4e5 * x + 2700.0 * v + zero, noise=5.0))
    return runs


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_zeros_that_differ_from_run_to_run_are_one_constant_force(seed: int) -> None:
    zeros = np.random.default_rng([8, seed]).normal(-250.0, 18.0, 7)
    runs = bush(seed, tuple(float(z) for z in zeros))
    found = explain(BASE, runs[:5], runs[5:])
    assert [e.element for e in found.effects] == ["force_offset"]
    assert abs(found.model.element("force_offset").value("F0") - float(np.mean(zeros))) < 25.0
    assert any("was the load cell tared" in note for note in found.notes)


def test_of_two_runs_as_well_it_is_told_that_their_zeros_differ() -> None:
    runs = bush(5, (-265.0, -235.0, -250.0))
    found = explain(BASE, runs[:2], runs[2:])
    assert [e.element for e in found.effects] == ["force_offset"]
    assert any("was the load cell tared" in note for note in found.notes)
