"""Trials of a name and the next test: what is left out to save time changes nothing that matters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.criteria import CHANCE, FORM
from identification.discrepancy import choice, nexttest, trials
from identification.discrepancy.candidates import guesses
from identification.fitting.leastsquares import evaluate, fit_records, free_parameters
from identification.physical.model import Element, element
from identification.physical.predict import predict
from identification.scales import scales_of
from tests.identification.specimens import AS_SIMULATED as BASE
from tests.identification.specimens import records_with


def test_of_fits_that_came_to_the_same_place_the_best_is_kept() -> None:
    records = records_with("linear_stiffness")
    best = fit_records(BASE, records)
    again = fit_records(BASE.with_values(1.1 * BASE.values()), records)
    off = fit_records(BASE.with_values(1.5 * BASE.values()), records, max_iterations=0)
    assert trials.distinct([best, again, off]) == [best, off]


def test_no_first_guess_of_a_relief_valve_takes_away_more_damping_than_is_missing() -> None:
    scales = scales_of(records_with("linear_stiffness"), gap=5.0)
    assert all(g.value("c_drop") <= 5.0 / scales.v_rms for g in guesses("relief_valve", scales))


@pytest.mark.parametrize(("other", "is_absorbed"), [("force_offset", True), ("linear_stiffness", False)])
def test_the_worth_of_a_test_is_what_a_refit_to_all_runs_and_to_it_would_leave_of_the_difference_there(
    other: str, is_absorbed: bool
) -> None:
    *records, new = records_with("moving_mass")
    first = {"force_offset": {"F0": 10.0}, "linear_stiffness": {"k": 1e3}}[other]
    best = fit_records(BASE.with_element(element("moving_mass", {"m": 1.0})), records).model
    rival = fit_records(BASE.with_element(element(other, first)), records).model
    value = nexttest._worth(best, rival, nexttest._known(best, rival, records), new)
    everything = [*records, new]
    free = free_parameters(rival, everything)
    gradients = evaluate(rival, everything, free).gradients
    columns = np.concatenate([g / r.sigma for g, r in zip(gradients, everything, strict=True)])
    apart = np.concatenate([(predict(best, r)[0] - predict(rival, r)[0]) / r.sigma for r in everything])
    left = (apart - columns @ np.linalg.lstsq(columns, apart, rcond=None)[0])[-new.measured.size :]
    refitted, there = (float(np.sqrt(np.mean(d**2))) for d in (left, apart[-new.measured.size :]))
    assert (refitted < there) is is_absorbed
    assert value is not None
    assert value == pytest.approx(min(refitted, there), rel=1e-6)
    assert value**2 > CHANCE.at_noise


def test_a_test_that_a_model_cannot_run_is_worth_nothing() -> None:
    *records, new = records_with("moving_mass")
    best = BASE.with_element(element("moving_mass", {"m": 1.0}))
    known = nexttest._known(best, BASE, records)
    beyond = replace(new, motion=replace(new.motion, a=np.full(new.motion.a.size, np.inf)))
    with np.errstate(invalid="ignore"):
        assert nexttest._worth(best, BASE, known, beyond) is None


def test_a_test_on_which_a_gradient_diverges_is_worth_nothing() -> None:
    *records, new = records_with("moving_mass")
    best = BASE.with_element(element("moving_mass", {"m": 1.0}))
    known = nexttest._known(BASE, best, records)
    beyond = replace(new, motion=replace(new.motion, a=np.full(new.motion.a.size, 1e200)))
    assert nexttest._worth(BASE, best, known, beyond) is None


HYSTERESIS = (
    element("presliding_friction", {"sigma": 2e4, "f_c": 15.0}),
    element("bouc_wen", {"alpha": 2e4, "A": 1.0, "n": 1.5, "beta": 500.0, "gamma": 900.0}),
)
JOINT = element("free_play", {"gap": 2e-4}), element("aerated_oil", {"air": 2e-4, "f_half": 19.0})  # of 223 N rms
SOFT_JOINT = element("free_play", {"gap": 2e-4}), element("aerated_oil", {"air": 2e-4, "f_half": 5.0})


@pytest.mark.parametrize(
    ("pair", "behind", "chosen"),
    [(HYSTERESIS, 2.0, 1), (HYSTERESIS, 0.5, 0), (JOINT, 2.0, 1), (JOINT, 0.5, 0), (SOFT_JOINT, 2.0, 0)],
    ids=["hysteresis", "friction", "air that is gone soon", "joint", "joint that meets softly"],
)
def test_a_richer_element_is_named_where_its_limit_is_behind_by_more_than_the_tolerance(
    pair: tuple[Element, Element], behind: float, chosen: int
) -> None:
    """However little the richer one leaves: of a friction that is none of the catalogue it may be a tenth."""
    records = records_with("coulomb_friction")
    base = fit_records(BASE, records, max_iterations=0)
    limit, richer = (
        trials.trial_of(fit_records(BASE.with_element(e), records, max_iterations=0), e.id, base, records, 1.0)
        for e in pair
    )
    seen = CHANCE.at_noise * base.samples
    limit, richer = (
        replace(t, excess=(1.0 + more * 1e4 * FORM.tolerance**2) * seen, formed=1e4 * seen, closed=1e4 * seen)
        for t, more in ((limit, behind), (richer, 0.0))
    )
    best = choice.choose([limit, richer])
    assert best is not None
    assert best.name == pair[chosen].name
