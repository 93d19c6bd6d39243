"""A displacement that comes late beside force and current: the current is not late with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.discrepancy import explain
from identification.physical.elements.equations.sensor import low_passed
from identification.physical.model import Element, Model, element
from identification.physical.simulate import simulate
from rigctl.runfile import Run
from tests.identification.motions import motion
from tests.identification.ordinary import RATE, recorded

Floats = NDArray[np.float64]
LATE = 0.012
VALVE = element("viscous_damping", {"c": 900.0, "c_control": 700.0})


def late(tau: float, *, motion_alone: bool, lag: float = 0.0) -> Element:
    return element("force_delay", {"tau": tau, "lag": lag, "late_motion": float(motion_alone)})


def test_of_a_late_displacement_the_current_keeps_its_time() -> None:
    inputs = motion()
    force = simulate(Model(name="late", elements=(VALVE, late(-0.02, motion_alone=True))), inputs).force
    within = slice(20, -20)
    ahead = motion().shifted(-0.02).v
    np.testing.assert_allclose(force[within], ((900.0 + 700.0 * inputs.i) * ahead)[within], rtol=1e-6, atol=1e-3)


def test_a_late_force_is_late_with_its_current_whatever_the_switch_says() -> None:
    a, b = (simulate(Model(name="m", elements=(VALVE, late(0.02, motion_alone=s))), motion()) for s in (True, False))
    assert np.array_equal(a.force, b.force)


@pytest.mark.parametrize("lag", [0.0, 0.03])
def test_the_gradient_by_the_time_leaves_the_current_where_it_is(lag: float) -> None:
    def model(tau: float) -> Model:
        return Model(name="m", elements=(VALVE, late(tau, motion_alone=True, lag=lag)))

    def force(tau: float) -> Floats:
        return simulate(model(tau), motion()).force

    gradient = simulate(model(-0.02), motion(), gradient=True)
    assert gradient.gradient is not None
    expected = (force(-0.02 + 1e-5) - force(-0.02 - 1e-5)) / 2e-5
    within = slice(300, -50)  # what the low-pass held at the start is forgotten
    np.testing.assert_allclose(gradient.gradient[within, 2], expected[within], atol=2e-3 * np.max(np.abs(expected)))


def controlled(k: int, amplitude: float, period: float) -> Run:
    """A valve whose current steps, or swings, along a road; the displacement is recorded late."""
    t = np.arange(round(10.0 * RATE)) / RATE
    rng = np.random.default_rng([8, k])
    at = np.cumsum(rng.uniform(0.3, 1.2, 5))
    phase = rng.uniform(0.0, 2.0 * np.pi, 5)
    part = amplitude / np.array([1.0, 1.6, 2.5, 4.0, 6.0])

    def along(when: Floats) -> tuple[Floats, Floats]:
        turn = 2.0 * np.pi * at * when[:, None] + phase
        return np.sum(part * np.sin(turn), axis=1), np.sum(part * 2.0 * np.pi * at * np.cos(turn), axis=1)

    i = np.where((t + 0.1 * k) % period < 0.5 * period, 0.2, 1.1)
    speed = along(t)[1]
    opened = 400.0 + 1500.0 * i * (1.0 + 0.1 * i)
    return recorded(
        "controlled", k, along(t - LATE)[0], opened * speed / (1.0 + np.abs(speed) / 0.8), 2.0, {"current": i}
    )


@pytest.mark.slow
def test_of_a_late_displacement_no_delay_of_the_current_is_named() -> None:
    runs = [controlled(k, a, p) for k, (a, p) in enumerate(((0.02, 0.7), (0.03, 1.1), (0.012, 0.5), (0.025, 0.9)))]
    base = Model(
        name="valve",
        elements=(
            element("valve_damping", {"c_soft": 600.0, "c_firm": 2000.0, "u_soft": 0.2, "u_firm": 1.1, "w_knee": 0.7}),
        ),
    )
    found = explain(base, runs)
    assert "force_delay" in [e.element for e in found.effects]
    assert not {"control_delay", "control_lag", "coil_lag"} & {e.element for e in found.effects}
    [channel] = [e for e in found.model.elements if e.name == "force_delay"]
    assert channel.values()["tau"] == pytest.approx(-LATE, rel=0.03)
    assert channel.values()["late_motion"] == 1.0


@pytest.mark.parametrize(("lag", "turn"), [(0.01, 0.0), (0.01, 0.02), (1e3, 0.0), (0.0, 1e3), (1e9, 1e9), (1e20, 1e20)])
def test_a_low_pass_of_any_time_is_that_of_every_line_of_what_repeats(lag: float, turn: float) -> None:
    """Its answer between samples is that of a signal that is linear there: near that of the line itself."""
    period, dt = 200, 1e-3
    t = dt * np.arange(2 * period)
    inputs = replace(
        motion(), dt=dt, **{n: np.zeros(t.size) for n in ("x", "v", "a", "i", "temperature")}, t=t, period=period
    )
    omega = 2.0 * np.pi / (period * dt)
    gain = 1.0 / (1.0 + 1j * omega * lag - (omega * turn) ** 2)
    expected = 3.0 + np.real(gain * np.exp(1j * omega * t))
    found = low_passed(3.0 + np.cos(omega * t), lag, turn, inputs)
    assert np.max(np.abs(found - expected)) < 1e-3 * abs(gain) + 1e-10


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e308])
@pytest.mark.parametrize("repeats", [True, False])
def test_what_runs_away_passes_a_low_pass_without_a_warning(value: float, repeats: bool) -> None:
    inputs = motion()
    inputs = replace(inputs, period=inputs.x.size if repeats else 0)
    series = np.zeros((inputs.x.size, 2))
    series[:3, 1] = value, -value, value
    found = low_passed(series, 0.01, 0.02, inputs)
    assert np.all(found[:, 0] == 0.0)
    assert not np.all(np.abs(found[:, 1]) < 1e300)
