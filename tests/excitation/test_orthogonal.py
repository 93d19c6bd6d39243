"""Inputs that are orthogonal between realisations: the matrix of the inputs can be inverted at every line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from excitation.design import design
from excitation.errors import DesignError
from excitation.plan import TestPlan

CONFIG: dict[str, Any] = {
    "sample_rate": 500.0,
    "period_samples": 1000,
    "displacement": {"f_min": 0.5, "f_max": 20.0, "max_displacement": 0.06, "max_velocity": 1.5},
    "current": {"f_min": 0.5, "f_max": 20.0, "min": 0.3, "max": 1.6},
    "realisations": 4,
    "orthogonal": True,
}


def inputs_of(plan: TestPlan) -> np.ndarray[Any, Any]:
    """DFT of displacement and current of each test, (tests, 2, lines)."""
    made = []
    for test in plan.tests:
        current = test.excitation.current_a
        assert current is not None
        made.append([np.fft.rfft(u)[1:41] for u in (test.excitation.displacement_m, current)])
    return np.array(made)


@pytest.mark.parametrize(
    ("command", "more"),
    [("random-phase", {}), ("random-phase", {"phases": "crest"}), ("homogenised", {"homogenise": {"iterations": 20}})],
)
def test_each_two_realisations_are_orthogonal_at_every_line(command: str, more: dict[str, Any]) -> None:
    made = design(command, CONFIG | more)
    assert isinstance(made, TestPlan)
    inputs = inputs_of(made)
    for pair in (inputs[:2], inputs[2:]):
        matrix = np.moveaxis(pair, 2, 0) / np.abs(pair).max(axis=(0,)).T[:, None, :]  # each input at unit size
        product = matrix @ np.conj(np.swapaxes(matrix, 1, 2))
        np.testing.assert_allclose(product, np.broadcast_to(2.0 * np.eye(2), product.shape), atol=1e-9)
    assert np.abs(inputs[0] - inputs[2]).max() > 1e-3  # another pair has other phases
    currents = [test.excitation.current_a for test in made.tests]
    assert all(u is not None and u.min() >= 0.3 and u.max() <= 1.6 for u in currents)


@pytest.mark.parametrize("wrong", [{"realisations": 3}, {"current": None}, {"orthogonal": "yes"}])
def test_what_cannot_be_orthogonal_is_refused_in_one_line(wrong: dict[str, Any]) -> None:
    config = {key: value for key, value in (CONFIG | wrong).items() if value is not None}
    with pytest.raises(DesignError, match="orthogonal is") as refused:
        design("random-phase", config)
    assert "\n" not in str(refused.value)
