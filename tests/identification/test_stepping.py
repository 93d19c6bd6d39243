"""Models of every kind from sample to sample give what they give along a motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.blackbox.model import BlackBox
from identification.errors import SimulationError
from identification.models import Motion, load_model, motion_from
from identification.models.stepping import Moment, Steppable
from identification.physical.literature import LITERATURE, literature
from identification.physical.model import Model, element
from identification.physical.stepping import left_out
from tests.identification.random_black_boxes import BLACK, DT
from tests.identification.stepped import stepped

N = 1500
SETTLED = slice(N // 2, N)
FILES = sorted(Path("examples/models").glob("*.json"))


def motion() -> Motion:
    """A motion that grows from rest."""
    t = np.arange(N) * DT
    x = 0.012 * (1.0 - np.exp(-4.0 * t)) ** 3 * (np.sin(13.0 * t) + 0.3 * np.sin(47.0 * t))
    return motion_from(x, 1.0 / DT, current=0.5 + 0.4 * np.sin(8.0 * t))


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_a_physical_model_gives_step_by_step_what_it_gives_along_the_motion(path: Path) -> None:
    model, m = load_model(path), motion()
    assert isinstance(model, Model)
    whole = Model(name="in a vehicle", elements=tuple(e for e in model.elements if e.id not in left_out(model)))
    force = whole.force(m)
    assert np.max(np.abs(stepped(model, m) - force)[SETTLED]) <= 2e-4 * np.ptp(force)


@pytest.mark.parametrize("name", LITERATURE)
def test_a_model_of_the_literature_gives_step_by_step_what_it_gives_along_the_motion(name: str) -> None:
    model, m = literature(name), motion()
    force = model.force(m)
    # A hysteresis begins steady, as the coming motion has it there, which is not known here: it forgets that in time.
    # v_m is about the middle of the whole motion there, and about the built-in position here.
    near = 2e-2 if any(e.spec.needs_amplitude for e in model.elements) else 2e-3
    assert np.max(np.abs(stepped(model, m) - force)[SETTLED]) <= near * np.ptp(force[SETTLED])


@pytest.mark.parametrize("model", BLACK, ids=lambda m: m.name)
def test_a_black_box_gives_step_by_step_what_it_gives_along_the_motion(model: BlackBox) -> None:
    force = model.force(motion())
    assert np.max(np.abs(stepped(model, motion()) - force)[SETTLED]) <= 1e-6 * np.ptp(force)


CONTROLLED = Model(
    name="controlled",
    elements=(
        element("series_compliance", {"k": 2e5, "c": 10.0}),
        element("control_lag", {"tau": 0.02}),
        element("control_delay", {"tau": 0.0073}),
        element("control_saturation", {"i_s": 0.8}),
        element("control_hysteresis", {"h": 0.1}),
        element("tanh_hysteresis", {"alpha": 60.0, "alpha_control": 900.0, "beta": 24.0, "delta": 0.8}),
        element("presliding_friction", {"sigma": 2e5, "f_c": 40.0}),
        element("viscous_damping", {"c": 700.0}),
    ),
)


def test_the_control_path_gives_step_by_step_what_it_gives_along_the_motion() -> None:
    force = CONTROLLED.force(motion())
    assert np.max(np.abs(stepped(CONTROLLED, motion()) - force)[SETTLED]) <= 1e-5 * np.ptp(force)


@pytest.mark.parametrize("model", BLACK, ids=lambda m: m.name)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e300])
def test_a_bad_input_on_the_way_gives_step_by_step_what_it_gives_along_the_motion(model: BlackBox, bad: float) -> None:
    m = motion()
    spoilt = {name: getattr(m, name).copy() for name in ("x", "v", "a", "i", "temperature")}
    for k, series in enumerate(spoilt.values()):
        series[400 + 7 * k : 405 + 7 * k] = bad
    given = replace(m, **spoilt)
    force = model.force(given)
    assert np.max(np.abs(stepped(model, given) - force)[SETTLED]) <= 1e-6 * np.ptp(force)


@pytest.mark.parametrize("model", BLACK, ids=lambda m: m.name)
def test_a_start_that_is_no_number_gives_a_number(model: BlackBox) -> None:
    stepper = model.stepper(DT)
    assert np.isfinite(stepper.start(Moment(np.nan, np.inf, np.nan, -np.inf, np.nan)))
    assert np.isfinite(stepper.advance(Moment(v=np.nan)))


@pytest.mark.parametrize("model", [CONTROLLED, literature("LuGre"), *BLACK], ids=lambda m: m.name)
def test_a_question_leaves_no_trace(model: Steppable) -> None:
    m = motion()
    rng = np.random.default_rng(1)
    x, v, i = rng.uniform(-0.01, 0.01, N), rng.uniform(-0.2, 0.2, N), rng.uniform(0.0, 1.0, N)
    asked = stepped(model, m, lambda k: Moment(x[k], v[k], 3.0, i[k]))
    assert np.array_equal(asked, stepped(model, m))


def test_what_belongs_to_the_rig_is_no_part_of_a_damper_in_a_vehicle() -> None:
    core = (element("viscous_damping", {"c": 700.0}), element("force_offset", {"F0": 30.0}))
    rig = (element("moving_mass", {"m": 2.0}), element("force_drift", {"rate": 5.0}))
    damper, measured = Model(name="d", elements=core), Model(name="m", elements=core + rig)
    assert np.array_equal(stepped(damper, motion()), stepped(measured, motion()))
    assert left_out(measured) == ["moving_mass", "force_drift"]
    assert damper.stepper(DT).start(Moment()) == 30.0


def test_a_network_is_stepped_at_the_rate_of_its_training_only() -> None:
    with pytest.raises(SimulationError, match="1000 Hz and the run has 500 Hz"):
        BLACK[0].stepper(2e-3)
