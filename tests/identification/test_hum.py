"""Mains hum is what no motion repeats: a harmonic of the motion itself is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.discrepancy.hum import find_hum, hum_in
from identification.physical.model import Model, element
from identification.physical.predict import predict
from identification.record import Record, record_from_run
from rigctl.runfile import Run

SAMPLES, RATE_HZ = 12_000, 1000.0


def a_record(*, period: int, sine_hz: float = 2.5) -> Record:
    """A sine in displacement under a force of 100 N; `period` 0 is a run that does not say that it has one."""
    t = np.arange(SAMPLES) / RATE_HZ
    turn = 2 * np.pi * sine_hz * t
    noise = np.random.default_rng(1).normal(0.0, 0.5, t.size)
    record = record_from_run(
        Run(
            run_id="sine", created="2026-11-21T00:00:00+00:00", specimen="", sample_rate_hz=RATE_HZ,
            period_samples=period, excitation_kind="sine", status="complete",
            channels={"displacement": 0.02 * np.sin(turn), "force": 100.0 * np.cos(turn) + noise},
            units={"displacement": "m", "force": "N"},
        )
    )  # fmt: skip
    return replace(record, period=period)


def a_residual(record: Record, frequency_hz: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    t = record.motion.t[record.window]
    noise = np.random.default_rng(2).normal(0.0, 0.5, t.size)
    return np.asarray(5.0 * np.sin(2 * np.pi * frequency_hz * t + 1.0) + noise)


@pytest.mark.parametrize("period", [2000, 8000, 0])  # five of them, one, none
@pytest.mark.parametrize("harmonic_hz", [50.0, 60.0])
def test_a_harmonic_of_the_motion_is_no_hum(period: int, harmonic_hz: float) -> None:
    record = a_record(period=period)
    assert find_hum([a_residual(record, harmonic_hz)], [record]) is None


@pytest.mark.parametrize(("period", "frequency_hz"), [(2000, 49.98), (2000, 60.1), (0, 51.1), (0, 400.9)])
def test_a_tone_beside_the_harmonics_is_found_with_its_amplitude(period: int, frequency_hz: float) -> None:
    record = a_record(period=period)
    record = replace(record, tones_hz=(frequency_hz + 0.02,))
    hum = find_hum([a_residual(record, frequency_hz)], [record])
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(frequency_hz, abs=0.01)
    assert hum.amplitude == pytest.approx(5.0, rel=0.1)


def test_runs_whose_periods_all_but_repeat_a_tone_do_not_draw_it_to_where_they_would_repeat_less_of_it() -> None:
    frequency_hz = 50.009
    records = [a_record(period=p, sine_hz=1000.0 / p) for p in (2000, 4000, 3000, 6000, 1849, 1916)]
    records = [replace(r, tones_hz=(frequency_hz + 0.03,)) for r in records]
    hum = find_hum([a_residual(r, frequency_hz) for r in records], records)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(frequency_hz, abs=0.001)
    assert hum.amplitude == pytest.approx(5.0, rel=0.02)


def test_a_run_in_step_with_a_tone_does_not_hide_that_of_the_others_and_loses_its_own_too() -> None:
    records = [a_record(period=p, sine_hz=h) for p, h in ((0, 2.371), (0, 3.137), (0, 2.689), (2400, 1000.0 / 2400))]
    residuals = [a_residual(r, 50.0) for r in records]  # of the last one each period has 120 cycles
    hum = find_hum(residuals, records)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(50.0, abs=0.001)
    assert hum.amplitude == pytest.approx(5.0, rel=0.02)
    for record, residual in zip(records, residuals, strict=True):
        assert np.std(residual - hum_in(record, residual, hum)[record.window]) == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("away", [-1.7, 0.4, 1.7])
def test_runs_whose_harmonics_hide_a_tone_do_not_draw_it_to_where_they_would_show_it(away: float) -> None:
    """`away` lines from the tone lies a harmonic of most sines; two lines from that they see what is beside it."""
    line = RATE_HZ / SAMPLES
    records = [a_record(period=0, sine_hz=(50.0 + away * line) / order) for order in (19, 20, 21, 22, 23, 24)]
    records += [a_record(period=0, sine_hz=h) for h in (2.371, 3.137)]
    hum = find_hum([a_residual(r, 50.0) for r in records], records)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(50.0, abs=0.02 * line)
    assert hum.amplitude == pytest.approx(5.0, rel=0.002)


def a_slow_triangle(seed: int, *, period_s: float) -> tuple[Record, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """A triangle with rests in displacement, and what a friction leaves of its force: a comb of harmonics."""
    t = np.arange(8000) / 200.0
    x = 0.02 * np.clip(1.3 * 2.0 / np.pi * np.arcsin(np.sin(2 * np.pi * t / period_s)), -1.0, 1.0)
    v = np.gradient(x, t)
    record = record_from_run(
        Run(
            run_id=f"ramps{seed}", created="2026-11-27T00:00:00+00:00", specimen="", sample_rate_hz=200.0,
            period_samples=0, excitation_kind="custom", status="complete",
            channels={"displacement": x, "force": 300.0 * v + np.random.default_rng(seed).normal(0.0, 0.1, t.size)},
            units={"displacement": "m", "force": "N"},
        )
    )  # fmt: skip
    return record, 30.0 * np.sign(v) + np.random.default_rng(seed + 100).normal(0.0, 0.05, t.size)


@pytest.mark.parametrize(
    "periods_s", [(2.3513, 3.4489, 4.1514, 2.9488), (2.3513, 2.3848, 2.4514, 2.4178), (2.3848,) * 4]
)  # one harmonic of each is within 0.1 % of 60 Hz; of the last they have one amplitude
def test_harmonics_of_a_slow_triangle_too_many_to_count_are_no_hum_and_hide_none(periods_s: tuple[float, ...]) -> None:
    records, rests = zip(*(a_slow_triangle(k, period_s=p) for k, p in enumerate(periods_s)), strict=True)
    rests = [e[r.window] for e, r in zip(rests, records, strict=True)]
    assert find_hum(rests, records) is None
    tones = [5.0 * np.sin(2 * np.pi * 60.0 * r.motion.t[r.window] + k) for k, r in enumerate(records)]
    hum = find_hum([e + tone for e, tone in zip(rests, tones, strict=True)], records)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(60.0, abs=0.01)
    assert hum.amplitude == pytest.approx(5.0, rel=0.05)


def a_rough_record(seed: int, *, clock: float) -> Record:
    """Noise-like motion; the recorder takes a sample every (1 + clock) steps of the time that it states."""
    rng = np.random.default_rng(seed)
    t = np.arange(SAMPLES) / RATE_HZ
    lines = rng.uniform(0.5, 6.0, 40)
    x = 1e-3 * np.sin(2 * np.pi * np.outer(t, lines) + rng.uniform(0.0, 6.28, 40)).sum(axis=1)
    hum = 5.0 * np.sin(2 * np.pi * 50.0 * (1.0 + clock) * t + rng.uniform(0.0, 6.28))
    force = 2000.0 * np.gradient(x, t) + hum + rng.normal(0.0, 0.5, t.size)
    return record_from_run(
        Run(
            run_id=f"rough{seed}", created="2026-11-27T00:00:00+00:00", specimen="", sample_rate_hz=RATE_HZ,
            period_samples=0, excitation_kind="custom", status="complete",
            channels={"displacement": x, "force": force}, units={"displacement": "m", "force": "N"},
        )
    )  # fmt: skip


def test_a_tone_of_which_the_clocks_of_the_runs_tell_other_frequencies_is_one_hum_and_goes_whole() -> None:
    records = [a_rough_record(k, clock=clock) for k, clock in enumerate((-0.001, 0.0002, 0.001, -0.0006))]
    base = Model(name="rough", elements=(element("viscous_damping", {"c": 2000.0, "c_control": 0.0}),))
    residuals = [r.measured - predict(base, r)[0] for r in records]
    hum = find_hum(residuals, records)
    assert hum is not None
    assert hum.frequency_hz == pytest.approx(50.0, abs=0.05)
    assert hum.amplitude == pytest.approx(5.0, rel=0.05)
    assert hum.scatter < 0.05
    for residual, record in zip(residuals, records, strict=True):
        assert np.std(residual - hum_in(record, residual, hum)[record.window]) < 1.0
        assert np.std(record.measured - predict(base.with_element(hum.element()), record)[0]) < 1.0


@pytest.mark.parametrize("frequency_hz", [0.0, 50.0, 499.9, 500.0, 1e9])
@pytest.mark.parametrize("left_out", [0, 700, SAMPLES - 3])
def test_a_model_with_a_tone_of_any_frequency_is_simulated_on_any_part_of_a_run(
    frequency_hz: float, left_out: int
) -> None:
    record = a_record(period=2000)
    record = replace(record, window=np.arange(SAMPLES)[: SAMPLES - left_out])
    hum = element("mains_hum", {"amplitude": 1.0, "frequency": frequency_hz, "phase": 0.0})
    base = Model(name="rough", elements=(element("viscous_damping", {"c": 300.0, "c_control": 0.0}),))
    force, _ = predict(base.with_element(hum), record)
    assert force.size == record.measured.size == SAMPLES - left_out
    assert np.max(np.abs(force - predict(base, record)[0])) <= 1.0 + 1e-9
