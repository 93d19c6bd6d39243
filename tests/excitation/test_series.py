"""Realisations of one design: other phases, and nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from excitation.design import design, remake
from excitation.plan import TestPlan

CONFIG: dict[str, Any] = {
    "sample_rate": 500.0,
    "period_samples": 2000,
    "displacement": {
        "f_min": 0.5, "f_max": 20.0, "lines": "odd-random", "max_displacement": 0.02, "max_velocity": 0.6,
    },
    "current": {"f_min": 0.5, "f_max": 40.0, "lines": "odd-random", "min": 0.3, "max": 1.5},
    "realisations": 8,
    "levels": [0.5, 1.0],
}  # fmt: skip
FORCE = {"max": 500.0, "damping": 500.0, "damping_control": 800.0}


@pytest.mark.parametrize("more", [{}, {"force": FORCE}, {"orthogonal": True}], ids=["free", "force", "orthogonal"])
def test_realisations_of_a_level_have_one_amplitude_spectrum_one_mean_current_and_keep_to_the_limits(
    more: dict[str, Any],
) -> None:
    made = design("random-phase", CONFIG | more)
    assert isinstance(made, TestPlan)
    amplitudes = np.abs(np.fft.rfft([test.excitation.displacement_m for test in made.tests], axis=1))
    currents = np.array([test.excitation.current_a for test in made.tests])
    for level in (amplitudes[:8], amplitudes[8:], np.abs(np.fft.rfft(currents, axis=1))):
        np.testing.assert_allclose(level, np.broadcast_to(level[0], level.shape), atol=1e-9 * level.max())
    assert np.ptp(currents.mean(axis=1)) < 1e-9
    np.testing.assert_allclose(amplitudes[8:], 2.0 * amplitudes[:8], atol=1e-9 * amplitudes.max())
    assert currents.min() == pytest.approx(0.3)
    assert currents.max() == pytest.approx(1.5)
    peaks = [float(np.abs(test.excitation.velocity_m_s).max()) for test in made.tests]
    assert max(peaks) <= 0.6
    if not more.get("force"):
        assert max(peaks) == pytest.approx(0.6)


def test_a_realisation_is_made_again_alone() -> None:
    made = design("random-phase", CONFIG)
    assert isinstance(made, TestPlan)
    one = made.tests[3].excitation
    assert remake(one).displacement_m.tobytes() == one.displacement_m.tobytes()
