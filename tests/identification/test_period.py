"""The period of a run is what its inputs show, and not what its file states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from identification.datachecks import check_run
from identification.models.inputs import motion_of
from identification.period import with_period_seen
from identification.record import record_from_run
from rigctl.runfile import Run
from tests.identification.specimens import run

Floats = NDArray[np.float64]
RATE = 500.0


def made(x: Floats, *, current: Floats | None = None, period: int = 0, force: Floats | None = None) -> Run:
    channels = {"displacement": x, "force": 800.0 * np.gradient(x, 1.0 / RATE) if force is None else force}
    if current is not None:
        channels["current"] = current
    units = {"displacement": "m", "force": "N", "current": "A"}
    return Run(
        run_id="1",
        created="2026-01-01T00:00:00Z",
        specimen="",
        sample_rate_hz=RATE,
        period_samples=period,
        excitation_kind="custom",
        status="complete",
        channels=channels,
        units={name: units[name] for name in channels},
    )


def sine(period: float, cycles: int, noise: float = 0.0, seed: int = 1) -> Floats:
    n = int(period * cycles)
    clean = 0.01 * np.sin(2.0 * np.pi * np.arange(n) / period)
    return np.asarray(clean + noise * np.random.default_rng(seed).standard_normal(n))


@given(period=st.integers(40, 400), noise=st.sampled_from([0.0, 1e-6, 1e-4]), seed=st.integers(0, 99))
def test_a_sine_of_whole_samples_has_its_period_stated_or_not(period: int, noise: float, seed: int) -> None:
    x = sine(period, 9, noise, seed)
    assert with_period_seen(made(x, period=period)).run.period_samples == period
    assert with_period_seen(made(x)).run.period_samples in (period, 2 * period)


@given(seed=st.integers(0, 50))
def test_a_record_that_does_not_repeat_has_no_period(seed: int) -> None:
    rng = np.random.default_rng(seed)
    white = np.fft.rfft(rng.standard_normal(4000))
    white[int(rng.integers(20, 400)) :] = 0.0
    x = 0.01 * np.fft.irfft(white, 4000)
    assert with_period_seen(made(x)).run.period_samples == 0


@pytest.mark.parametrize("off", [2, 10, 55, -3])
def test_a_wrong_period_is_a_finding_and_is_not_used(off: int) -> None:
    wrong = made(sine(100, 30, 1e-6), period=100 + off)
    found = [f for f in check_run(wrong) if f.kind == "period"]
    assert [f.channel for f in found] == ["displacement"]
    assert f"does not repeat after {100 + off} samples" in found[0].text
    v = motion_of(wrong).v
    inner = slice(200, -200)
    true = 0.01 * 2.0 * np.pi * RATE / 100 * np.cos(2.0 * np.pi * np.arange(v.size) / 100)
    assert np.max(np.abs(v - true)[inner]) < 0.01 * np.max(true)


def test_a_run_whose_current_steps_while_its_displacement_repeats_keeps_its_current() -> None:
    x = sine(100, 40, 1e-6)
    current = np.where(np.arange(x.size) < x.size // 2, 0.3, 1.2)
    stepping = made(x, current=current, period=100)
    assert with_period_seen(stepping).differs == "current"
    record = record_from_run(stepping)
    assert record.period == 0
    assert np.array_equal(record.motion.i, current)
    assert [f.channel for f in check_run(stepping) if f.kind == "period"] == ["current"]


@pytest.mark.parametrize("index", range(6))
def test_a_stated_period_that_holds_is_kept_and_is_found_again_where_the_file_does_not_state_it(index: int) -> None:
    stated = run("none", index, 3)
    if stated.period_samples == 0:
        pytest.skip("this run of the campaign has no period")
    assert with_period_seen(stated).run.period_samples == stated.period_samples
    found = with_period_seen(replace(stated, period_samples=0))
    assert found.run.period_samples > 0
    assert (
        stated.period_samples % found.run.period_samples == 0 or found.run.period_samples % stated.period_samples == 0
    )
    assert "used as its period" in found.note


def test_noise_and_hum_in_the_current_of_a_valve_that_is_off_say_nothing_of_the_period() -> None:
    x = sine(100, 30, 1e-6)
    hum = 0.004 * np.sin(2.0 * np.pi * 50.2 / RATE * np.arange(x.size))
    assert with_period_seen(made(x, current=hum, period=100)).run.period_samples == 100
