"""What is held out, which names are taken back, and what stays in newtons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.criteria import FORM
from identification.discrepancy import naming
from identification.discrepancy.evidence import gather, main_doubt
from identification.discrepancy.excess import excess_of
from identification.discrepancy.holdout import hold_out
from identification.discrepancy.notes import capped
from identification.discrepancy.trials import trial_of
from identification.discrepancy.verdict import _beyond_noise, _nearest, drop_doubtful
from identification.fitting.leastsquares import fit_records
from identification.physical.model import element
from identification.record import Record, record_from_run
from tests.identification.specimens import AS_SIMULATED, records_with, run


def found_with(*names: str, records: list[Record]) -> naming.Search:
    """What a search that ends with these names stands on, each compared with nothing else."""
    first = {"linear_stiffness": {"k": 2000.0}, "moving_mass": {"m": 0.1}}
    model = AS_SIMULATED
    for name in names:
        model = model.with_element(element(name, first[name]))
    fit = fit_records(model, records)
    compared = {}
    for name in names:
        rest = fit_records(fit.model.without(name), records)
        own = trial_of(fit, name, rest, records, screened=1.0)
        beside = tuple(n for n in names if n != name)
        compared[name] = naming.Compared(without=rest, start=rest, beside=beside, rivals=(own,))
    base = fit_records(AS_SIMULATED, records)
    return naming.Search(
        fit=fit, names=names, excess=excess_of(fit), given=AS_SIMULATED, base_excess=excess_of(base), compared=compared
    )


def test_a_name_keeps_its_evidence_when_a_doubtful_one_beside_it_is_taken_out() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", "moving_mass", records=records)
    before = {e.name: e for e in gather(found, records)}
    assert before["moving_mass"].confidence < FORM.min_confidence <= before["linear_stiffness"].confidence
    kept, stated, withheld = drop_doubtful(found, records)
    assert kept.names == kept.fit.model.ids[len(AS_SIMULATED.elements) :] == ("linear_stiffness",)
    assert stated == [before["linear_stiffness"]]
    assert withheld == [before["moving_mass"]]


def test_where_no_name_is_doubtful_nothing_is_fitted_again() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", records=records)
    kept, stated, withheld = drop_doubtful(found, records)
    assert kept is found
    assert [e.name for e in stated] == ["linear_stiffness"]
    assert withheld == []


def test_a_name_that_is_not_stated_comes_with_its_largest_doubt() -> None:
    records = records_with("linear_stiffness")
    found, _, [mass] = drop_doubtful(found_with("linear_stiffness", "moving_mass", records=records), records)
    steady = replace(mass, features=replace(mass.features, spread=0.0, left_beside=0.9, margin=50.0, own_share=1.0))
    assert main_doubt(steady) == "90% of the gap without it stays with it"
    uneven = replace(steady, features=replace(steady.features, spread=3.0), strengths=(0.5, 2.0), precision=(1.0, 1.0))
    assert main_doubt(uneven).startswith("its strength is 0.50 to 2.00 times the common one from run to run")
    said = _nearest(found, [uneven])
    stated = f"not stated with a confidence of {mass.confidence:.2f}: {main_doubt(uneven)}"
    assert f"mass between load cell and damper, {stated}" in said
    assert "held-out runs are worse with it" in _nearest(found, [replace(uneven, confidence=0.9)])
    assert _nearest(replace(found, moves=()), []) == ""


def test_a_confidence_that_only_more_runs_could_raise_says_so() -> None:
    found = found_with("linear_stiffness", records=records_with("linear_stiffness")[:1])
    [one] = gather(found, records_with("linear_stiffness")[:1])
    [told] = capped([one])
    assert told == f"linear stiffness: no confidence above {one.confidence:.2f} is stated for what one run shows"
    assert capped([replace(one, confidence=0.5)]) == []
    records = records_with("linear_stiffness")
    assert capped(gather(found_with("linear_stiffness", records=records), records)) == []


def test_the_newtons_that_stay_are_those_of_each_run_with_its_own_noise() -> None:
    records = records_with("none")
    fit = fit_records(AS_SIMULATED, records)
    residuals = tuple(np.hypot(5.0, r.sigma) * np.ones(r.measured.size) for r in records)
    assert _beyond_noise(replace(fit, residuals=residuals), records) == pytest.approx(5.0)
    louder = [replace(r, sigma=4.0 * r.sigma) if k else r for k, r in enumerate(records)]
    residuals = tuple(np.hypot(5.0, r.sigma) * np.ones(r.measured.size) for r in louder)
    assert _beyond_noise(replace(fit, residuals=residuals), louder) == pytest.approx(5.0)


def test_the_run_that_alone_reaches_farthest_is_not_held_out() -> None:
    records = [record_from_run(run("none", 2, seed=s)) for s in range(8)]
    for k in range(8):
        far = [stretched(r, 1.5) if n == k else r for n, r in enumerate(records)]
        train, held = hold_out(far)
        assert far[k] in train
        assert len(held) == 2
    train, held = hold_out([stretched(r, 1.0 + 0.2 * n) for n, r in enumerate(records)])
    assert len(held) == 2


def stretched(record: Record, by: float) -> Record:
    motion = replace(record.motion, x=by * record.motion.x, v=by * record.motion.v, a=by * record.motion.a)
    return replace(record, motion=motion)
