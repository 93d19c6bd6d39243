"""A search sees a fair share of long records: a piece of each that holds what is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.criteria import BUDGET
from identification.fitting.leastsquares import fit_records
from identification.physical.predict import predict
from identification.record import Record, record_from_run
from identification.share import fair_shares
from tests.identification.specimens import AS_SIMULATED, between_samples, run


def long_records() -> list[Record]:
    return [record_from_run(between_samples(run("end_stop", k, seed=3))) for k in (0, 2, 4)]


def test_few_samples_are_kept_whole() -> None:
    records = long_records()
    kept = fair_shares(records, [r.measured for r in records])
    few = sum(r.measured.size for r in records) <= BUDGET.samples
    assert all((k is r) == few for k, r in zip(kept, records, strict=True))


def test_a_piece_is_a_stretch_of_the_record_with_the_samples_of_its_window() -> None:
    records = [*long_records(), *long_records()]
    residuals = [r.measured - float(np.mean(r.measured)) for r in records]
    for piece, whole in zip(fair_shares(records, residuals), records, strict=True):
        assert piece.measured.size < whole.measured.size
        begin = int(np.flatnonzero(whole.motion.t == piece.motion.t[0])[0])
        every = round(piece.dt / whole.dt)
        stretch = slice(begin, begin + every * piece.force.size, every)
        assert np.array_equal(piece.force, whole.force[stretch])
        assert np.array_equal(piece.motion.x, whole.motion.x[stretch])
        assert np.array_equal(piece.measured, whole.force[stretch][piece.window])
        assert piece.sigma == whole.sigma


def test_the_piece_holds_what_a_model_lacks() -> None:
    whole = long_records()[0]
    rare = np.zeros(whole.measured.size)
    rare[12_000:12_040] = 1.0
    piece = fair_shares([whole] * 6, [rare] * 6)[0]
    at = whole.motion.t[whole.window][12_000:12_040]
    assert piece.motion.t[piece.window][0] <= at[0]
    assert at[-1] <= piece.motion.t[piece.window][-1]


@pytest.mark.slow
def test_a_model_simulates_the_same_on_the_piece_as_on_the_whole() -> None:
    records = long_records() * 2
    model = fit_records(AS_SIMULATED, records[:3]).model
    residuals = [r.measured - predict(model, r)[0] for r in records]
    for piece, whole in zip(fair_shares(records, residuals), records, strict=True):
        own, of_whole = predict(model, piece)[0], predict(model, whole)[0]
        at = np.searchsorted(whole.motion.t[whole.window], piece.motion.t[piece.window])
        assert own == pytest.approx(of_whole[at], abs=0.05 * float(np.std(of_whole)))


def test_a_motion_sampled_far_too_finely_is_thinned_and_one_with_a_current_that_varies_is_not() -> None:
    t = np.arange(8000) / 1000.0
    slow = run("none", 0, seed=3)
    x, i = 0.02 * np.sin(2.0 * np.pi * 0.4713 * t), np.full(t.size, 0.8)
    rng = np.random.default_rng(1)
    channels = {"displacement": x, "force": 900.0 * np.gradient(x, 1e-3) + rng.standard_normal(t.size), "current": i}
    steady = record_from_run(replace(slow, channels=channels, period_samples=0))
    varied = record_from_run(replace(slow, channels={**channels, "current": np.sin(3.0 * t)}, period_samples=0))
    thin, whole = fair_shares([steady, varied], [r.measured for r in (steady, varied)])
    assert thin.dt == 3.0 * steady.dt  # 16 000 samples are some three times too many
    assert whole.dt == varied.dt
