"""Conditions change the measurement of a specimen and nothing else."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.explain.breakdown import CURVES, confidently_wrong, picture, points_left, share, table
from benchmarks.explain.terms import library
from benchmarks.hidden import STANDARD, Case, Conditions, OutOfReach, case
from identification.discrepancy.preparation import prepared
from identification.fitting.leastsquares import fit_records
from identification.physical.elements import CATALOGUE
from identification.physical.modelfile import model_from_json
from identification.record import compact, record_from_run

SEED = 9


@cache
def made(conditions: Conditions = STANDARD) -> Case:
    return case(SEED, "single", conditions)


def force_rms(one: Case) -> float:
    return float(np.sqrt(np.mean(np.concatenate([r.channels["force"] for r in one.runs]) ** 2)))


@pytest.mark.slow
def test_other_noise_is_the_only_difference_that_other_noise_makes() -> None:
    loud = made(Conditions(noise_share=0.05))
    assert loud.noise_n == pytest.approx(0.05 * force_rms(loud), rel=0.02)
    for one, other in zip(made().truth, loud.truth, strict=True):
        assert np.array_equal(one, other)
    assert loud.effects == made().effects


@pytest.mark.parametrize("count", [1, 8])
def test_as_many_runs_as_asked_for_are_measured_on_the_same_specimen(count: int) -> None:
    few = made(Conditions(runs=count))
    assert len(few.runs) == count
    assert len({run.run_id for run in few.runs}) == count
    assert np.array_equal(few.truth[0], made().truth[0])


def test_without_periods_the_same_samples_are_records_that_do_not_repeat() -> None:
    bare = made(Conditions(without_periods=True))
    for run, same in zip((*bare.runs, *bare.held_out), (*made().runs, *made().held_out), strict=True):
        assert record_from_run(run).period == 0
        assert np.array_equal(run.channels["force"], same.channels["force"])
        moved = run.channels["displacement"] - same.channels["displacement"]
        assert 0.0 < np.std(moved) < 1e-3 * np.std(same.channels["displacement"])


def test_sines_only_are_sines_and_the_held_out_runs_are_unchanged() -> None:
    sines = made(Conditions(runs=4, sines_only=True))
    assert [run.excitation_kind for run in sines.runs] == ["sine"] * 4
    assert np.array_equal(sines.truth[0], made().truth[0])


def test_a_wrong_base_curve_changes_the_force_by_about_what_was_asked_for() -> None:
    def change(error: float) -> float:
        wrong = made(Conditions(base_error=error))
        return float(np.std(np.concatenate(wrong.truth) - np.concatenate(made().truth))) / force_rms(made())

    assert 0.003 < change(0.5) < change(1.0) < 0.3  # a refit absorbs most of it
    with pytest.raises(OutOfReach, match="quadratic_damping"):
        made(Conditions(base_error=4.0))


def test_every_term_of_the_library_belongs_to_an_effect_of_the_catalogue_and_is_finite() -> None:
    hidden = made()
    model, train, _ = prepared(model_from_json(hidden.base_model), hidden.runs, hidden.held_out)
    records = [compact(record) for record in train]
    names, columns = library(fit_records(model, records).model, records)
    assert {effect for effect, _ in names} <= set(CATALOGUE)
    assert set(hidden.effects) <= {effect for effect, _ in names}
    for block, record in zip(columns, records, strict=True):
        assert block.shape == (record.measured.size, len(names))
        assert np.all(np.isfinite(block))


def outcome(curve: str, at: float, seed: int, names: dict[str, float]) -> dict[str, object]:
    return {"kind": "single", "curve": curve, "at": at, "seed": seed, "true": ["force_offset"], "names": names}


def test_a_point_that_is_done_is_not_run_again_and_the_picture_shows_what_there_is() -> None:
    outcomes = [
        outcome("noise", 1.0, 1, {"force_offset": 0.95}),
        outcome("noise", 1.0, 2, {"gas_spring": 0.97}),
        outcome("runs", 6.0, 1, {"gas_spring": 0.5}),
    ]
    assert [confidently_wrong(o) for o in outcomes] == [False, True, False]
    total = sum(len(points) for _, points in CURVES.values())
    assert len(points_left(1, outcomes)) == total - 2
    assert ("noise", 1.0) not in points_left(1, outcomes)
    assert "noise             1      2     50%              50%" in table(outcomes)
    assert sorted(share([True, False])) == [pytest.approx(v, abs=1e-3) for v in (0.211, 0.5, 0.789)]
    shown = [trace for trace in picture(outcomes).data if trace.x]
    assert [(trace.name, list(trace.y)) for trace in shown[:2]] == [
        ("named right", [50.0]),
        ("a wrong name at confidence ≥ 0.9", [50.0]),
    ]
