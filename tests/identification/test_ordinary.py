"""What ordinary dampers have: sides that differ by a factor, a stop at one end, gas; and noise that is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import bessel, butter, group_delay, lfilter

from identification.discrepancy import Verdict, explain
from identification.discrepancy.candidates import admissible
from identification.discrepancy.preparation import prepared
from identification.fitting.leastsquares import fit_records
from identification.motion_noise import with_motion_noise
from identification.physical.model import Model, element
from identification.quieter import quieter
from identification.record import record_from_run
from identification.scales import scales_of
from tests.identification.ordinary import RATE, Floats, campaign, digressive, motion, recorded

BASE = Model(
    name="a saturating valve, the same on both sides",
    elements=(element("arctan_damping", {"F1": 250.0, "S": 15.0, "d": 600.0, "F2": 0.0}, ("F2",)),),
)
SIZES = (0.02, 0.012, 0.016, 0.01, 0.014)


def test_a_valve_that_gives_half_in_compression_is_an_asymmetry_and_no_offset() -> None:
    runs = campaign("half", lambda x, v: digressive(v, 0.5), SIZES)
    found = explain(BASE, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["damping_asymmetry"]
    own = {e.name: e for e in found.model.elements}["damping_asymmetry"].values()
    assert own["share"] == pytest.approx(1.0 / 3.0, abs=0.04)  # (1 + s)/(1 − s) = 2
    assert found.held_out.final < 0.1 * found.held_out.base_refitted


def test_a_stop_at_one_end_is_an_end_stop_of_that_side() -> None:
    stop = lambda x, v: digressive(v) - 5e4 * np.maximum(-0.013 - x, 0.0) ** 1.04  # noqa: E731
    runs = campaign("stop", stop, SIZES)
    found = explain(BASE, runs[:4], runs[4:])
    assert "end_stop" in [e.element for e in found.effects]
    assert {e.name: e for e in found.model.elements}["end_stop"].values()["side"] == pytest.approx(-1.0, abs=0.1)


@pytest.mark.parametrize(
    "analogue",
    [
        butter(1, 9.0, fs=RATE),
        *(pytest.param(a, marks=pytest.mark.slow) for a in (butter(2, 14.0, fs=RATE), bessel(4, 16.0, fs=RATE))),
    ],
)
def test_a_low_pass_of_the_recorder_is_a_late_force_and_no_bush_or_mass(analogue: tuple[Floats, Floats]) -> None:
    """Filters of three kinds, of 2 to 4 times the fastest motion, on the force alone."""
    runs = campaign("late", lambda x, v: lfilter(*analogue, digressive(v)), SIZES)
    found = explain(BASE, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["force_delay"]
    own = {e.name: e for e in found.model.elements}["force_delay"].values()
    _, delay = group_delay(analogue, w=[2.0], fs=RATE)  # at the frequencies of the motion a filter delays by as much
    assert own["tau"] + own["lag"] == pytest.approx(delay[0] / RATE, rel=0.1)


@pytest.mark.parametrize(
    "analogue", [butter(1, 30.0, fs=RATE), pytest.param(butter(2, 25.0, fs=RATE), marks=pytest.mark.slow)]
)
def test_a_low_pass_of_the_displacement_is_an_early_force_and_no_mass(analogue: tuple[Floats, Floats]) -> None:
    runs = campaign("early", lambda x, v: digressive(v), SIZES)
    runs = [
        replace(r, channels={**r.channels, "displacement": lfilter(*analogue, r.channels["displacement"])})
        for r in runs
    ]
    found = explain(BASE, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["force_delay"]
    own = {e.name: e for e in found.model.elements}["force_delay"].values()
    _, delay = group_delay(analogue, w=[2.0], fs=RATE)
    assert own["tau"] == pytest.approx(-delay[0] / RATE, rel=0.15)


def test_beside_a_free_preload_no_offset_is_sought() -> None:
    runs = campaign("gas", lambda x, v: digressive(v) - 200.0 * (1.0 + x / 0.12) ** -1.25, SIZES[:3])
    gas = BASE.with_element(element("gas_spring", {"f0": 150.0, "length": 0.1, "n": 1.3}))
    _, train, _ = prepared(gas, runs)
    assert "force_offset" in admissible(BASE, train, scales_of(train, 10.0))
    assert "force_offset" not in admissible(gas, train, scales_of(train, 10.0))


def test_steps_of_the_current_are_no_noise_once_a_model_has_them() -> None:
    _, x, v = motion(1, 0.015)
    steps = np.repeat(np.random.default_rng(3).uniform(0.0, 1.5, x.size // 4 + 1), 4)[: x.size]
    run = recorded("controlled", 1, x, (600.0 + 900.0 * steps) * v, noise=4.0, more={"current": steps})
    record = record_from_run(run)
    model = Model(name="m", elements=(element("viscous_damping", {"c": 600.0, "c_control": 900.0}),))
    assert record.sigma > 6.0
    assert quieter(record, model).sigma == pytest.approx(4.0, rel=0.1)
    worse = Model(name="m", elements=(element("viscous_damping", {"c": 0.0, "c_control": 0.0}),))
    assert quieter(record, worse).sigma <= record.sigma


def test_motion_noise_is_no_more_than_what_is_left() -> None:
    """Dry friction makes much force of the noise of a slow displacement; a recorder with less noise refutes it."""
    t = np.arange(round(20.0 * RATE)) / RATE
    x = 0.006 * np.sin(2.0 * np.pi * 0.9 * t)
    force = 150.0 * np.sign(np.cos(2.0 * np.pi * 0.9 * t)) + 400.0 * np.gradient(x, 1.0 / RATE)
    record = record_from_run(recorded("rubs", 2, x, force))
    model = fit_records(
        Model(
            name="m",
            elements=(element("coulomb_friction", {"f_c": 140.0}), element("viscous_damping", {"c": 300.0})),
        ),
        [record],
    )
    left = model.rms
    assert with_motion_noise(record, model.model).sigma < 1.2 * max(left, record.sigma)


@pytest.mark.slow
def test_a_small_effect_beside_a_large_one_is_found_within_the_tolerance_of_its_form() -> None:
    """Asked again with what was found as its base, `explain` finds nothing more."""
    law = lambda x, v: digressive(v, 0.6) - 260.0 * (1.0 + x / 0.09) ** -1.2 + 14.0 * np.tanh(v / 0.004)  # noqa: E731
    runs = campaign("small", law, SIZES)
    found = explain(BASE, runs[:4], runs[4:])
    assert {"damping_asymmetry", "gas_spring"} <= {e.element for e in found.effects}
    again = explain(found.model, runs[:4], runs[4:])
    if found.verdict == Verdict.EXPLAINED:
        assert again.verdict in (Verdict.NO_DISCREPANCY, Verdict.UNKNOWN_EFFECT)
        assert again.effects == ()
