"""The noise of a current's sensor is no current: a model is not told by it what another current would do."""

from __future__ import annotations

import numpy as np
import pytest

from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.physical.predict import predict
from identification.record import compact, record_from_run
from rigctl.runfile import Run
from tests.identification.ordinary import Floats, motion, recorded

NOISE_A = 4e-3


def law(v: Floats, i: Floats) -> Floats:
    return np.asarray(500.0 * v + (80.0 + 350.0 * i) * np.tanh(60.0 * v))


def controlled(seed: int, current: Floats | float) -> Run:
    """A run whose current is recorded with noise."""
    _, x, v = motion(seed, 0.02)
    i = np.broadcast_to(current, x.shape)
    seen = i + NOISE_A * np.random.default_rng([7, seed]).standard_normal(x.size)
    return recorded("magnet", seed, x, law(v, np.asarray(i)), more={"current": seen})


def test_a_fit_at_one_current_does_not_tell_by_its_noise_what_another_one_would_do() -> None:
    first = {"alpha": 90.0, "alpha_control": 380.0, "beta": 55.0, "delta": 0.0}
    elements = (
        element("tanh_hysteresis", first, ("delta",)),
        element("viscous_damping", {"c": 450.0, "c_control": 0.0}),
    )
    given = Model(name="magnet", elements=(elements[0], elements[1]))
    for seed in range(4):
        one, other = (compact(record_from_run(controlled(seed, i))) for i in (0.35, 2.8))
        fit = fit_records(given, [one])
        before, after = (np.std(other.measured - predict(m, other)[0]) for m in (given, fit.model))
        assert after < 0.5 * before


@pytest.mark.parametrize("level", [0.0, 0.3, 2.0])
def test_a_current_that_is_only_noise_about_its_mean_is_its_mean(level: float) -> None:
    record = record_from_run(controlled(1, level))
    assert np.ptp(record.motion.i) == 0.0
    assert record.motion.i[0] == pytest.approx(level, abs=4 * NOISE_A / np.sqrt(record.motion.i.size))
    assert (record.motion.i[0] == 0.0) == (level == 0.0), "off is no current"


def test_a_current_that_is_stepped_or_designed_as_noise_stays_as_it_is() -> None:
    n = motion(1, 0.02)[0].size
    rng = np.random.default_rng(3)
    for current in (np.repeat(rng.uniform(0.0, 2.0, n // 50 + 1), 50)[:n], 1.0 + 0.5 * rng.standard_normal(n)):
        run = controlled(1, current)
        assert np.array_equal(record_from_run(run).motion.i, run.channels["current"])
