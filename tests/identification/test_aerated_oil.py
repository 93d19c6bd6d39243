"""Free air in the oil: a travel that the force takes up little by little, between a spring and a play."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.discrepancy import explain
from identification.fitting.leastsquares import fit_records
from identification.models.motion import Motion
from identification.physical.model import Model, element
from identification.physical.mount import contact
from identification.physical.program import Mount
from identification.physical.simulate import simulate
from identification.record import record_from_run
from rigctl.runfile import Run
from tests.identification.motions import motion
from tests.identification.ordinary import motion as road
from tests.identification.ordinary import recorded

Floats = NDArray[np.float64]

AIR = element("aerated_oil", {"air": 2e-3, "f_half": 60.0})
VALVE = element("viscous_damping", {"c": 2000.0})


@given(
    k=st.floats(1e4, 1e8), air=st.floats(1e-6, 1e-2), half=st.floats(1e-2, 1e4), side=st.floats(-0.9, 0.9),
    f=st.floats(-1e4, 1e4),
)  # fmt: skip
def test_the_travel_under_a_force_is_that_of_the_air_and_of_the_spring(
    k: float, air: float, half: float, side: float, f: float
) -> None:
    share = 1.0 + side if f > 0.0 else 1.0 - side
    e = 0.5 * air / share * f / (half * share + abs(f)) + f / k
    mount = Mount(
        k=k, c=0.0, gap=0.0, k2=0.0, c2=0.0, c_control=0.0, air=air, f_half=half, side=side, k_slip=1.0, f_slip=0.0
    )
    assert contact(mount, 0.0, e, 0.0).f == pytest.approx(f, rel=1e-6, abs=1e-9 * k * abs(e) + 1e-12)


def test_air_that_is_gone_under_no_force_is_a_play() -> None:
    play = Model(name="play", elements=(element("free_play", {"gap": 2e-3}), VALVE))
    air = Model(name="air", elements=(element("aerated_oil", {"air": 2e-3, "f_half": 1e-3}), VALVE))
    a, b = (simulate(m, motion()).force for m in (play, air))
    assert np.sqrt(np.mean((a - b) ** 2)) < 0.04 * np.sqrt(np.mean(a**2))  # of which an impact is half


def reference(m: Motion, stiffness: float) -> Floats:
    """Force of that model with a spring in series, from df/dt = (v − f/c)/(h f_h/(f_h + |f|)² + 1/k), (N,), N."""

    def rate(t: float, f: Floats) -> Floats:
        v = np.interp(t, m.t, m.v)
        return np.asarray((v - f / 2000.0) / (1e-3 * 60.0 / (60.0 + np.abs(f)) ** 2 + 1.0 / stiffness))

    start = [2000.0 * m.v[0]]
    found = solve_ivp(rate, (m.t[0], m.t[-1]), start, method="LSODA", t_eval=m.t, rtol=1e-8, atol=1e-6, max_step=m.dt)
    return np.asarray(found.y[0])


def test_it_is_met_by_another_integrator_and_found_again_by_a_fit() -> None:
    m = motion()
    spring = element("series_compliance", {"k": 4e5, "c": 0.0})
    force = reference(m, 4e5)
    settled = slice(200, None)
    model = Model(name="truth", elements=(AIR, spring, VALVE))
    error = simulate(model, m).force - force
    assert np.sqrt(np.mean(error[settled] ** 2)) < 2e-3 * np.sqrt(np.mean(force**2))
    rng = np.random.default_rng(1)
    run = Run(
        run_id="air", created="2026-01-01T00:00:00+00:00", specimen="specimen", sample_rate_hz=1.0 / m.dt,
        period_samples=0, excitation_kind="custom", status="complete",
        channels={"displacement": m.x, "velocity": m.v, "force": force + 0.5 * rng.standard_normal(force.size)},
        units={"displacement": "m", "velocity": "m/s", "force": "N"}, design=None, events=(), path=None,
    )  # fmt: skip
    wrong = {"aerated_oil.air": 1.4, "aerated_oil.f_half": 0.6, "series_compliance.k": 0.7, f"{VALVE.id}.c": 1.2}
    assert set(wrong) <= set(model.names())
    off = model.with_values(model.values() * np.array([wrong.get(name, 1.0) for name in model.names()]))
    found = fit_records(off, [record_from_run(run)]).model
    values = {**found.element("aerated_oil").values(), **found.element("series_compliance").values()}
    assert values["air"] == pytest.approx(2e-3, rel=0.03)
    assert values["f_half"] == pytest.approx(60.0, rel=0.05)
    assert values["k"] == pytest.approx(4e5, rel=0.05)


def aerated(k: int, amplitude: float, gone_n: float) -> Run:
    """A damper whose air is pressed as a gas is, its volume over pressure to the power −1/1.3, beside a column."""
    t, x, v = road(k, amplitude)
    half, c, stiffness = 1.5e-4, 9000.0, 4e6

    def rate(now: float, f: Floats) -> Floats:
        yields = half / (1.3 * gone_n) * (1.0 + np.abs(f) / gone_n) ** (-1.0 / 1.3 - 1.0) + 1.0 / stiffness
        return np.asarray((np.interp(now, t, v) - f / c) / yields)

    found = solve_ivp(rate, (t[0], t[-1]), [c * v[0]], method="LSODA", t_eval=t, rtol=1e-7, atol=1e-3, max_step=2e-3)
    return recorded("aerated", k, x, found.y[0], 3.0)


@pytest.mark.slow
def test_air_that_is_gone_soon_is_named_and_no_play() -> None:
    base = Model(name="viscous", elements=(element("viscous_damping", {"c": 8000.0}),))
    found = explain(base, [aerated(k, a, 40.0) for k, a in enumerate((0.004, 0.008, 0.012, 0.006))])
    assert "aerated_oil" in [e.element for e in found.effects]
    assert "free_play" not in [e.element for e in found.effects]
