"""Measures of steady tests against closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.eearth import eearth
from identification.force_velocity import at_peak_speed, hysteresis_widths
from identification.models.measures import score
from identification.steady import (
    Cycles,
    dynamic_stiffness,
    energy_per_cycle,
    loop_shape,
    loss_factor,
    steady_cycles,
)
from rigctl.runfile import with_channel
from tests.identification.sines import Law, sine_run

Floats = NDArray[np.float64]


def cycles_of(law: Law, amplitude: float = 0.01, frequency: float = 2.0, *, periodic: bool = True) -> Cycles:
    found = steady_cycles(sine_run(law, amplitude, frequency, periodic=periodic))
    assert found is not None
    return found


@pytest.mark.parametrize("periodic", [True, False])
def test_a_spring_and_a_dashpot_show_their_stiffness_loss_and_energy(periodic: bool) -> None:
    k, c, omega = 3e4, 2e3, 2 * np.pi * 2.0
    test = cycles_of(lambda x, v: k * x + c * v, periodic=periodic)
    assert test.frequency_hz == pytest.approx(2.0, rel=1e-5)
    assert dynamic_stiffness(test) == pytest.approx(np.hypot(k, c * omega), rel=1e-4)
    assert loss_factor(test) == pytest.approx(c * omega / k, rel=1e-3)
    assert energy_per_cycle(test) == pytest.approx(np.pi * c * omega * 0.01**2, rel=1e-4)


@pytest.mark.parametrize(
    ("law", "shape"),
    [
        (lambda x, v: 2e3 * v, 1.0),
        (lambda x, v: 2e3 * v + 4e4 * x, 1.0),
        (lambda x, v: 300.0 * np.sign(v), 4 / np.pi),
        (lambda x, v: 5e3 * v * np.abs(v), 8 / (3 * np.pi)),
    ],
    ids=["dashpot", "spring and dashpot", "dry friction", "orifice"],
)
def test_the_loop_shape_tells_ellipse_rectangle_and_peak_apart(law: Law, shape: float) -> None:
    assert loop_shape(cycles_of(law)) == pytest.approx(shape, rel=0.03)


@pytest.mark.parametrize("frequency", [1.0, 7.3, 10.0, 30.0])
def test_the_forces_at_peak_speed_of_a_dashpot_are_its_own_at_a_few_samples_a_cycle_too(frequency: float) -> None:
    t = np.arange(1000) / 100.0
    turn = 2 * np.pi * frequency
    channels = {"displacement": 0.01 * np.sin(turn * t), "force": 2e3 * 0.01 * turn * np.cos(turn * t) + 50.0}
    test = steady_cycles(replace(sine_run(lambda x, v: v, 0.01, 2.0, periodic=False), channels=channels,
                                 sample_rate_hz=100.0))  # fmt: skip
    assert test is not None
    assert at_peak_speed([test])[1] == pytest.approx([20.0 * turn + 50.0, 50.0 - 20.0 * turn], rel=1e-3)


def test_rebound_and_compression_are_those_at_peak_speed_and_the_width_that_of_the_loop() -> None:
    """With a spring the greatest force is at another speed; it opens the loop over velocity by 2 k a."""
    law: Law = lambda x, v: np.where(v > 0.0, 3e3, 1e3) * v + 4e4 * x + 25.0  # noqa: E731
    test = cycles_of(law)
    top = 0.01 * 2 * np.pi * 2.0
    assert at_peak_speed([test])[0] == pytest.approx([top, -top], rel=1e-3)
    assert at_peak_speed([test])[1] == pytest.approx([3e3 * top + 25.0, 25.0 - 1e3 * top], rel=0.03)
    assert test.loop()[2].max() > 1.3 * at_peak_speed([test])[1][0]
    assert max(hysteresis_widths(test)) == pytest.approx(2 * 4e4 * 0.01, rel=0.02)
    assert max(hysteresis_widths(cycles_of(lambda x, v: 2e3 * v))) < 0.01 * 2e3 * top


def test_a_run_without_force_is_no_test_and_has_no_loop_shape() -> None:
    run = sine_run(lambda x, v: 2e3 * v, 0.01, 2.0)
    flat = with_channel(run, "force_simulated", np.zeros(run.samples), "N")
    assert "loop_shape_measured" in score(flat)
    assert "loop_shape_simulated" not in score(flat)
    assert steady_cycles(flat, "force_simulated") is None


def test_the_loop_shape_depends_neither_on_the_loss_angle_nor_on_the_scale() -> None:
    shapes = [
        loop_shape(cycles_of(lambda x, v, k=k, s=s: s * (300.0 * np.tanh(v / 0.02) + k * x)))  # type: ignore[misc]
        for k, s in ((0.0, 1.0), (0.0, 30.0))
    ]
    assert shapes[0] == pytest.approx(shapes[1], rel=1e-3)


def test_a_shift_a_scale_and_a_warp_each_show_in_their_own_score() -> None:
    t = np.arange(3000) / 1000
    pulse = np.exp(-(((t - 1.5) / 0.2) ** 2))
    assert eearth(pulse, pulse).score == pytest.approx(1.0)
    late = eearth(np.roll(pulse, 60), pulse)
    assert late.shift == 60
    assert late.phase == pytest.approx(1 - 60 / 3000 / 0.2)
    assert late.magnitude == pytest.approx(1.0, abs=1e-6)
    scaled = eearth(pulse, 0.8 * pulse)
    assert (scaled.phase, scaled.slope) == (1.0, pytest.approx(1 - 0.2 / 2.0))
    assert 0.6 < scaled.magnitude < 1.0
    assert scaled.score == pytest.approx(0.2 * scaled.magnitude + 0.4 + 0.4 * scaled.slope)
    assert eearth(pulse, -pulse).score < 0.5


def test_the_banded_warp_is_that_of_the_whole_table() -> None:
    from identification.eearth import _warped

    rng = np.random.default_rng(3)
    c, t = rng.standard_normal(40).cumsum(), rng.standard_normal(40).cumsum()
    cost = np.full((41, 41), np.inf)
    cost[0, 0] = 0.0
    for i, j in product(range(40), range(40)):
        if abs(i - j) <= 6:
            cost[i + 1, j + 1] = (c[j] - t[i]) ** 2 + min(cost[i, j], cost[i + 1, j], cost[i, j + 1])
    i = j = 40
    distance = size = 0.0
    while i:
        distance, size = distance + abs(c[j - 1] - t[i - 1]), size + abs(t[i - 1])
        i, j = min(((i - 1, j - 1), (i, j - 1), (i - 1, j)), key=lambda at: cost[at])
    assert _warped(c, t, 6) == pytest.approx((distance, size))


def test_a_score_tells_energy_and_loop_shape_of_both_forces() -> None:
    run = sine_run(lambda x, v: 2e3 * v, 0.01, 2.0)
    figures = score(with_channel(run, "force_simulated", 0.9 * run.channels["force"], "N"))
    assert figures["energy_simulated"] == pytest.approx(0.9 * figures["energy_measured"])
    assert figures["loop_shape_simulated"] == pytest.approx(figures["loop_shape_measured"])
    assert figures["rrmsse"] == pytest.approx(10.0)
