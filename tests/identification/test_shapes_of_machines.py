"""Buffers that harden, bushes of rubber, zones to one side, warm gas and coils have the name of their kind alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification.discrepancy import Verdict, explain
from identification.discrepancy.explanation import Explanation
from identification.physical.model import Model, denies_its_name, element
from identification.physical.simulate import simulate
from tests.identification.motions import motion as sine
from tests.identification.ordinary import RATE, Floats, campaign, motion, recorded

BASE = Model(name="a dashpot", elements=(element("viscous_damping", {"c": 2000.0}),))
SIZES = (0.006, 0.012, 0.018, 0.024, 0.015, 0.02)
FINE = 8  # steps of a sample


def explained(name: str, law: Callable[[Floats, Floats], Floats]) -> Explanation:
    runs = campaign(name, law, SIZES)
    return explain(BASE, runs[:4], runs[4:])


def behind(rubber: Callable[[float, Floats, float, float], tuple[float, Floats]]) -> Callable[[Floats, Floats], Floats]:
    """A dashpot of 2 500 N·s/m behind a rubber, by small explicit steps. The rubber tells its force and its memories
    after a step, from the extension, the memories, the change of the extension, and the duration."""

    def law(x: Floats, v: Floats) -> Floats:
        h, out = 1.0 / RATE / FINE, np.zeros(x.size)
        place = np.interp(np.arange((x.size - 1) * FINE + 1) / FINE, np.arange(x.size), x)
        z, e, memory = float(x[0]), 0.0, np.zeros(5)
        for n in range(place.size):
            before, e = e, float(place[n]) - z
            force, memory = rubber(e, memory, e - before, h)
            z += h * force / 2500.0
            if n % FINE == 0:
                out[n // FINE] = force
        return out

    return law


def relaxes(e: float, memory: Floats, de: float, h: float) -> tuple[float, Floats]:
    """Five branches that relax in 3 ms to 0.3 s: nearly a power of time."""
    times = np.array([0.003, 0.01, 0.03, 0.1, 0.3])
    memory = (memory + 3e4 * times**-0.25 * de) * np.exp(-h / times)
    return 6e4 * e + float(memory.sum()), memory


def rubs(e: float, memory: Floats, de: float, h: float) -> tuple[float, Floats]:
    """A spring beside Dahl's friction of an exponent of 1.5."""
    y = memory[0]
    part = 1.0 - np.sign(de) * y / 60.0
    return 1.5e5 * e + y, memory + np.eye(5)[0] * 3e5 * de * np.sign(part) * abs(part) ** 1.5


@pytest.mark.parametrize(
    ("kind", "names", "branch"),
    [
        ("relaxing_compliance", {"k": "k1", "k2": "k2", "c2": "c2"}, {"k2": 4e5, "c2": 3e3}),
        ("rubber_bush", {"k": "k", "c": "c", "k_slip": "k_slip", "f_slip": "f_slip"}, {"k_slip": 6e5, "f_slip": 60.0}),
    ],
)
def test_a_compliance_with_a_branch_is_the_bush_that_has_it(
    kind: str, names: dict[str, str], branch: dict[str, float]
) -> None:
    own = {"k": 8e5, "c": 300.0 if "c" in names else 0.0, **branch}
    with_branch = Model(name="m", elements=(*BASE.elements, element("series_compliance", own)))
    alike = Model(name="m", elements=(*BASE.elements, element(kind, {names[n]: own[n] for n in names})))
    one, other = (simulate(m, sine(), gradient=True) for m in (with_branch, alike))
    assert one.gradient is not None
    assert other.gradient is not None
    assert np.array_equal(one.force, other.force)
    for name, its in names.items():
        places = with_branch.names().index(f"series_compliance.{name}"), alike.names().index(f"{kind}.{its}")
        np.testing.assert_allclose(one.gradient[:, places[0]], other.gradient[:, places[1]], rtol=1e-12)


def test_a_compliance_has_one_branch_and_none_beside_a_play() -> None:
    both = {"k2": 1e5, "c2": 1e3, "k_slip": 1e5, "f_slip": 50.0}
    for more, others, denied in (
        (both, (), True),
        ({"k2": 1e5, "c2": 1e3}, (), False),
        ({"k2": 1e5, "c2": 1e3}, (element("free_play", {"gap": 1e-3}),), True),
        ({}, (element("free_play", {"gap": 1e-3}),), False),
    ):
        bush = element("series_compliance", {"k": 8e5, **more})
        assert denies_its_name(bush, Model(name="m", elements=(*BASE.elements, bush, *others))) is denied


@pytest.mark.parametrize("rubber", [pytest.param(relaxes, marks=pytest.mark.slow), rubs])
def test_a_bush_of_rubber_is_a_compliance_and_no_late_force(
    rubber: Callable[[float, Floats, float, float], tuple[float, Floats]],
) -> None:
    found = explained("bush", behind(rubber))
    assert [e.element for e in found.effects] == ["series_compliance"]
    assert found.effects[0].confidence > 0.9
    assert found.verdict == Verdict.EXPLAINED
    own = {e.name: e for e in found.model.elements}["series_compliance"].values()
    assert (own["k2"] > 0.0) != (own["f_slip"] > 0.0)


def test_a_buffer_at_one_end_that_hardens_is_an_end_stop() -> None:
    def law(x: Floats, v: Floats) -> Floats:
        pressed = np.maximum(-0.011 - x, 0.0)
        return 2500.0 * v - 2e4 * pressed - 6e6 * pressed**2.1

    found = explained("buffer", law)
    assert [e.element for e in found.effects] == ["end_stop"]
    assert found.verdict == Verdict.EXPLAINED
    own = {e.name: e for e in found.model.elements}["end_stop"].values()
    assert own["side"] == pytest.approx(-1.0, abs=0.05)
    assert own["z_max"] == pytest.approx(0.011, rel=0.05)


def test_buffers_that_are_not_centred_are_an_end_stop_off_the_middle() -> None:
    found = explained(
        "off centre", lambda x, v: 2500.0 * v + 3e4 * (np.maximum(x - 0.008, 0) - np.maximum(-0.014 - x, 0))
    )
    assert [e.element for e in found.effects] == ["end_stop"]
    assert found.verdict == Verdict.EXPLAINED
    own = {e.name: e for e in found.model.elements}["end_stop"].values()
    assert (own["z_max"], own["centre"]) == pytest.approx((0.011, -0.003), rel=0.05)


@pytest.mark.slow
def test_a_hydraulic_stop_at_one_end_is_that_and_no_damping_over_position() -> None:
    def law(x: Floats, v: Floats) -> Floats:
        return 2500.0 * v + 1.1e7 * np.maximum(x - 0.012, 0.0) * v * np.abs(v) ** 0.95

    found = explained("hydraulic", law)
    assert [e.element for e in found.effects] == ["hydraulic_bump_stop"]
    assert {e.name: e for e in found.model.elements}["hydraulic_bump_stop"].values()["side"] == pytest.approx(
        1.0, abs=0.05
    )


@pytest.mark.parametrize("centre", [-0.008, 0.005])
def test_a_groove_to_one_side_is_damping_over_position(centre: float) -> None:
    found = explained("groove", lambda x, v: 2500.0 * v * (1.0 - 0.45 * np.exp(-(((x - centre) / 0.004) ** 2))))
    is_a_zone(found, centre, 5e-4)


@pytest.mark.parametrize(
    ("gain", "centre", "half"), [(-0.6, 0.004, 0.003), (-0.3, 0.0023, 0.0033), (1.0, -0.007, 0.004)]
)
def test_a_zone_with_sharp_ends_of_either_sign_is_damping_over_position(
    gain: float, centre: float, half: float
) -> None:
    """From a first value of the other sign the fit crossed zero, where a zone has no place and no width."""
    found = explained("hole", lambda x, v: 2500.0 * v * (1.0 + gain * (np.abs(x - centre) < half)))
    own = is_a_zone(found, centre, 1e-4)
    assert (own["gain"], own["half"]) == pytest.approx((gain, half), rel=0.03)


def is_a_zone(found: Explanation, centre: float, within: float) -> dict[str, float]:
    assert [e.element for e in found.effects] == ["position_dependent_damping"]
    assert found.effects[0].confidence > 0.9
    assert found.verdict == Verdict.EXPLAINED
    own = {e.name: e for e in found.model.elements}["position_dependent_damping"].values()
    assert own["z_0"] == pytest.approx(centre, abs=within)
    return own


def test_a_gas_whose_pressure_follows_the_temperature_is_one_gas_spring() -> None:
    runs = []
    for k, size in enumerate(SIZES):
        t, x, v = motion(k, size)
        warm = 25.0 + 8.0 * k + 6.0 * t / t[-1]
        force = 2500.0 * v - 400.0 * (warm + 273.15) / 298.15 * (1.0 + x / 0.06) ** -1.2
        runs.append(recorded("warm gas", k, x, force, more={"temperature": warm}))
    found = explain(BASE, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["gas_spring"]
    assert found.effects[0].confidence > 0.9
    assert found.held_out.final < 1.1 * found.held_out.noise_floor
    own = {e.name: e for e in found.model.elements}["gas_spring"].values()
    assert (own["f0"], own["warm"]) == pytest.approx((400.0, 1.0), rel=0.05)


def test_a_gas_spring_that_warms_as_an_ideal_gas_is_the_element_of_that_name() -> None:
    inputs = replace(sine(), temperature=np.linspace(5.0, 60.0, sine().x.size))
    own = {"f0": 300.0, "length": 0.1, "n": 1.3}
    finer = Model(name="m", elements=(*BASE.elements, element("gas_spring", {**own, "warm": 1.0})))
    alike = Model(name="m", elements=(*BASE.elements, element("warm_gas_spring", {**own, "T_ref": 25.0})))
    one, other = (simulate(m, inputs).force for m in (finer, alike))
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_coil_that_falls_faster_than_it_rises_is_a_lag_of_the_control() -> None:
    runs = []
    for k, size in enumerate(SIZES):
        t, x, v = motion(k, size)
        i = np.random.default_rng([9, k]).uniform(0.2, 1.5, 40)[(t / 0.7).astype(int)]
        field = np.full(t.size, i[0])
        for n in range(1, t.size):
            tau = 0.06 if i[n - 1] > field[n - 1] else 0.02
            field[n] = i[n - 1] + (field[n - 1] - i[n - 1]) * np.exp(-1.0 / RATE / tau)
        runs.append(recorded("coil", k, x, (900.0 + 1600.0 * field) * v, more={"current": i}))
    base = Model(name="without a coil", elements=(element("viscous_damping", {"c": 800.0, "c_control": 1500.0}),))
    found = explain(base, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["control_lag"]
    assert found.effects[0].confidence > 0.9
    own = {e.name: e for e in found.model.elements}["control_lag"].values()
    assert (own["tau"], own["fall"]) == pytest.approx((0.06, 0.02), rel=0.1)
