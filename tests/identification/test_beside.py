"""Frictions, stops and springs between the ends of a damper, beside what is in series with its core."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from identification.discrepancy import explain
from identification.discrepancy.notes import beside_mount
from identification.errors import ModelError
from identification.physical.model import Element, Model, element
from identification.physical.modelfile import model_from_json, model_to_json
from identification.physical.simulate import simulate
from tests.identification.motions import motion
from tests.identification.ordinary import RATE, Floats, campaign
from tests.identification.stepped import stepped

DASHPOT = element("viscous_damping", {"c": 3000.0, "c_control": 0.0})
BUSH = element("series_compliance", {"k": 2e5, "c": 10.0})
ORIFICE = Model(
    name="an orifice",
    elements=(
        element("viscous_damping", {"c": 1500.0, "c_control": 0.0}, ("c_control",)),
        element("quadratic_damping", {"q": 5000.0}),
    ),
)
FRICTIONS = {
    "coulomb_friction": {"f_c": 80.0},
    "stribeck_friction": {"f_c": 60.0, "f_s": 90.0, "w_s": 0.02},
    "presliding_friction": {"sigma": 1e6, "f_c": 80.0},
    "lugre_friction": {"sigma0": 1e6, "sigma1": 20.0, "f_c": 60.0, "f_s": 90.0, "w_s": 0.02},
}
SPRINGS = {
    "end_stop": {"k": 2e4, "z_max": 0.012},
    "linear_stiffness": {"k": 2e4},
    "cubic_stiffness": {"k3": 2e7},
    "gas_spring": {"f0": 300.0, "length": 0.05, "n": 1.3},
}
BESIDE = {**FRICTIONS, **SPRINGS}
INPUTS = motion(2.0, 0.02)
SIZES = (0.02, 0.012, 0.016, 0.01, 0.014)


def acting(name: str, beside: float = 1.0) -> Element:
    return element(name, {**BESIDE[name], "beside_mount": beside})


def force_of(*elements: Element) -> Floats:
    return simulate(Model(name="m", elements=elements), INPUTS).force


@pytest.mark.parametrize("name", BESIDE)
def test_beside_the_mount_an_element_adds_its_force_to_that_of_the_rest(name: str) -> None:
    alone = force_of(acting(name))
    assert force_of(BUSH, DASHPOT, acting(name)) == pytest.approx(force_of(BUSH, DASHPOT) + alone, abs=1e-9)
    within = force_of(BUSH, DASHPOT, acting(name, 0.0))
    assert np.max(np.abs(within - force_of(BUSH, DASHPOT) - alone)) > 5.0


@pytest.mark.parametrize("name", BESIDE)
def test_without_a_mount_it_is_the_same_beside_and_within(name: str) -> None:
    assert np.array_equal(force_of(DASHPOT, acting(name)), force_of(DASHPOT, acting(name, 0.0)))


def test_a_mount_with_nothing_behind_it_carries_no_force() -> None:
    assert np.array_equal(force_of(BUSH, acting("coulomb_friction")), force_of(acting("coulomb_friction")))


@pytest.mark.parametrize("name", BESIDE)
def test_the_gradient_is_that_of_finite_differences(name: str) -> None:
    model = Model(name="m", elements=(BUSH, DASHPOT, acting(name), element("force_offset", {"F0": 5.0})))
    wanted, values = model.free(), model.values()
    gradient = simulate(model, INPUTS, gradient=wanted).gradient
    assert gradient is not None
    for column, k in enumerate(np.flatnonzero(wanted)):
        step = 1e-5 * max(abs(values[k]), 1e-3) * (np.arange(values.size) == k)
        high, low = (simulate(model.with_values(values + s), INPUTS).force for s in (step, -step))
        by_difference = (high - low) / (2.0 * step[k])
        differ = np.abs(gradient[:, column] - by_difference) > 1e-3 * np.max(np.abs(by_difference))
        assert np.mean(differ) < 0.02, model.names()[k]  # at a reversal a difference steps over it


@pytest.mark.parametrize("name", BESIDE)
def test_from_sample_to_sample_it_is_what_it_is_along_the_motion(name: str) -> None:
    model = Model(name="m", elements=(BUSH, DASHPOT, acting(name)))
    force = model.force(INPUTS)
    late = slice(force.size // 2, force.size)
    assert np.max(np.abs(stepped(model, INPUTS) - force)[late]) <= 2e-3 * np.ptp(force)


def test_from_sample_to_sample_a_mount_with_nothing_behind_it_carries_no_force() -> None:
    bare = Model(name="m", elements=(acting("coulomb_friction"),))
    behind = Model(name="m", elements=(BUSH, acting("coulomb_friction")))
    assert np.array_equal(stepped(bare, INPUTS), stepped(behind, INPUTS))


@pytest.mark.parametrize(
    ("as_given", "now", "said"), [(0.0, 1.0, "beside what gives way"), (1.0, 0.0, "not beside it as it was given")]
)
def test_where_a_friction_acts_is_told_also_where_that_has_changed(as_given: float, now: float, said: str) -> None:
    frictions = (acting("coulomb_friction", beside) for beside in (as_given, now))
    given, final = (Model(name="m", elements=(BUSH, DASHPOT, one)) for one in frictions)
    (note,) = beside_mount(given, final)
    assert said in note
    assert beside_mount(given, Model(name="m", elements=(DASHPOT, acting("coulomb_friction", now)))) == []


def test_a_model_file_says_that_a_friction_is_beside_the_mount_and_nothing_where_it_is_not() -> None:
    model = Model(name="m", elements=(BUSH, DASHPOT, acting("coulomb_friction")))
    assert model_from_json(model_to_json(model)) == model
    within = Model(name="m", elements=(BUSH, DASHPOT, acting("coulomb_friction", 0.0)))
    assert "beside_mount" not in model_to_json(within)["paths"]["core"][1]["parameters"]


@pytest.mark.parametrize("value", [0.5, -1.0, 2.0])
def test_between_beside_and_within_there_is_nothing(value: float) -> None:
    data = model_to_json(Model(name="m", elements=(DASHPOT, acting("coulomb_friction"))))
    data["paths"]["core"][1]["parameters"]["beside_mount"] = value
    with pytest.raises(ModelError, match=r"paths\.core\[1\].*coulomb_friction\.beside_mount"):
        model_from_json(data)


def behind_oil(v: Floats, stiffness: float) -> Floats:
    """Force of an orifice (2 000 N·s/m and 8 000 N·s²/m²) behind oil, dF/dt = k·(v − w(F)), in eighths of a sample."""
    force, out = 0.0, np.zeros(v.size)
    for k in range(1, v.size):
        for part in range(8):
            now = v[k - 1] + (v[k] - v[k - 1]) * (part + 0.5) / 8.0
            w = np.sign(force) * (np.sqrt(2000.0**2 + 4.0 * 8000.0 * abs(force)) - 2000.0) / (2.0 * 8000.0)
            force += stiffness * (now - w) / (8.0 * RATE)
        out[k] = force
    return out


@pytest.mark.slow
@pytest.mark.parametrize("seal", [40.0, 90.0])
def test_a_rod_seal_beside_oil_that_gives_way_is_a_friction_and_a_compliance(seal: float) -> None:
    runs = campaign("cylinder", lambda x, v: behind_oil(v, 6e4) + seal * v / (np.abs(v) + 3e-4), SIZES)
    found = explain(ORIFICE, runs[:4], runs[4:])
    named = {e.name: e for e in found.model.elements}
    assert {e.element for e in found.effects} - set(FRICTIONS) == {"series_compliance"}
    slides = next(e for name, e in named.items() if name in FRICTIONS)
    assert slides.value("beside_mount") == 1.0
    assert (
        f"{slides.spec.title} acts between the ends, beside what gives way there, as a rod seal, "
        "a buffer or the gas behind a rod does" in found.notes
    )
    assert slides.value("f_c") == pytest.approx(seal, rel=0.1)
    assert named["series_compliance"].value("k") == pytest.approx(6e4, rel=0.1)


def buffer(x: Floats) -> Floats:
    into = np.maximum(np.abs(x) - 0.011, 0.0)
    return np.asarray(np.sign(x) * (2.0e5 * into + 3e7 * into**2))


def gas(x: Floats) -> Floats:
    return np.asarray(-150.0 * (1.0 + x / 0.045) ** -1.25)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), [("end_stop", buffer), ("gas_spring", gas)])
def test_a_spring_beside_what_gives_way_is_named_there_and_a_compliance(
    name: str, law: Callable[[Floats], Floats]
) -> None:
    runs = campaign("cylinder", lambda x, v: behind_oil(v, 5e4) + law(x), SIZES)
    found = explain(ORIFICE, runs[:4], runs[4:])
    named = {e.name: e for e in found.model.elements}
    assert {e.element for e in found.effects} == {"series_compliance", name}
    assert named[name].value("beside_mount") == 1.0
    assert name != "gas_spring" or named[name].value("f0") == pytest.approx(150.0, rel=0.05)
    assert named["series_compliance"].value("k") == pytest.approx(5e4, rel=0.1)
