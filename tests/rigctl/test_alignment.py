"""Two clocks are related by pulses or a trigger; the stated uncertainty covers the truth as often as it says."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from api.cli.align import align
from excitation.rpc3 import Channel, TimeHistory
from rigctl.alignment import (
    ClockRelation,
    Edges,
    relation_from_pulses,
    relation_from_trigger,
    resampled,
    rising_edges,
)
from rigctl.errors import AlignmentError
from rigctl.runfile import Run, read_run, write_run
from rigctl.second_acquisition import by_pulse, by_trigger, merged, read_record


def seen(pulses_s: NDArray[np.float64], rate_hz: float) -> Edges:
    """Edges as a clock with this rate sees them: at the middle of the sample in which they fall."""
    return Edges(time_s=(np.floor(pulses_s * rate_hz) + 0.5) / rate_hz, u_s=1.0 / (rate_hz * np.sqrt(12.0)))


def random_clocks(random: np.random.Generator) -> tuple[ClockRelation, float, float]:
    """An estimate, and the delay and drift that are true."""
    delay, drift = random.uniform(-3, 3), random.uniform(-2e-4, 2e-4)
    rig_hz, other_hz = random.uniform(100, 5000), random.uniform(100, 20_000)
    pulses = 5.0 + np.cumsum(random.uniform(0.5, 1.5, random.integers(8, 60)))
    relation = relation_from_pulses(seen(pulses, rig_hz), seen((pulses - delay) / (1 + drift), other_hz))
    return relation, delay, drift


def test_delay_and_drift_are_within_two_uncertainties_in_95_of_100_cases() -> None:
    random = np.random.default_rng(20)
    found = [random_clocks(random) for _ in range(3000)]
    delays = np.mean([abs(r.delay_s - delay) <= 2 * r.delay_u_s for r, delay, _ in found])
    drifts = np.mean([abs(r.drift - drift) <= 2 * r.drift_u for r, _, drift in found])
    assert 0.94 <= delays <= 0.985
    assert 0.94 <= drifts <= 0.985


def test_pulses_that_are_locked_to_both_clocks_do_not_pretend_to_more_than_a_sample() -> None:
    """At equal rates every edge has the same error, and the mean of many is no better than one."""
    pulses = 1.0 + np.arange(50) + 0.00043
    relation = relation_from_pulses(seen(pulses, 1000.0), seen(pulses + 0.0003, 1000.0))
    assert abs(relation.delay_s + 0.0003) <= 2 * relation.delay_u_s
    assert relation.delay_u_s >= 1e-3 / np.sqrt(12)


def test_a_missed_pulse_does_not_shift_the_record() -> None:
    random = np.random.default_rng(4)
    pulses = 2.0 + np.cumsum(random.uniform(0.5, 1.5, 20))
    whole = seen(pulses, 1000.0)
    late = seen(pulses[2:] - 1.234, 5000.0)
    assert relation_from_pulses(whole, late).delay_s == pytest.approx(1.234, abs=1e-3)
    assert relation_from_pulses(late, whole).delay_s == pytest.approx(-1.234, abs=1e-3)


def test_regular_pulses_of_which_one_is_missing_are_refused() -> None:
    regular = seen(1.0 + np.arange(20.0), 1000.0)
    with pytest.raises(AlignmentError, match="more than one pairing fits"):
        relation_from_pulses(regular, Edges(time_s=regular.time_s[1:], u_s=regular.u_s))


def test_edges_of_different_pulses_are_refused() -> None:
    random = np.random.default_rng(5)
    one, two = (seen(np.cumsum(random.uniform(0.5, 1.5, 20)), 1000.0) for _ in range(2))
    with pytest.raises(AlignmentError, match="these are not the same pulses"):
        relation_from_pulses(one, two)


def test_a_trigger_gives_the_delay_and_leaves_the_drift_uncertain() -> None:
    relation = relation_from_trigger(0.0, 2.5, 1e-4, 100e-6)
    assert relation.to_other(np.array([0.0]))[0] == 2.5
    at_start, after_ten_minutes = relation.uncertainty_s(np.array([0.0, 600.0]))
    assert at_start == pytest.approx(1e-4)
    assert after_ten_minutes == pytest.approx(600 * 100e-6 / np.sqrt(3), rel=1e-2)


def test_an_edge_of_a_sampled_pulse_is_within_half_a_sample_and_a_flank_is_interpolated() -> None:
    time = np.arange(20_000) / 1000.0
    pulse = ((time - 0.1234567) % 1.7 < 0.5).astype(float) * 5.0
    edges = rising_edges(pulse, 1000.0)
    truth = 0.1234567 + 1.7 * np.arange(edges.time_s.size + 1)
    assert min(np.abs(edges.time_s - truth[:-1]).max(), np.abs(edges.time_s - truth[1:]).max()) <= 0.5e-3
    sine = rising_edges(np.sin(2 * np.pi * (time - 0.01234)), 1000.0)
    assert np.abs(sine.time_s - 1.01234 - np.arange(sine.time_s.size)).max() <= 1e-6


def test_a_resampled_channel_is_the_signal_at_the_times_of_the_run() -> None:
    relation = ClockRelation(delay_s=-1.3, drift=5e-5, delay_u_s=0.0, drift_u=0.0, covariance_s=0.0, events=10)
    for rate in (700.0, 1000.0, 5000.0):
        other_s = np.arange(round(8 * rate)) / rate
        rig_s = np.arange(4000) / 1000.0

        def signal(t: NDArray[np.float64]) -> NDArray[np.float64]:
            return 3.0 + np.sin(2 * np.pi * 20 * t) + 0.3 * np.sin(2 * np.pi * 90 * t + 1.0)

        found = resampled(signal(-1.3 + (1 + 5e-5) * other_s), rate, relation, 1000.0, 4000)
        assert np.abs(found - signal(rig_s)).max() <= 1e-4


def test_what_the_slower_clock_cannot_carry_does_not_come_back_as_something_else() -> None:
    relation = ClockRelation(delay_s=-0.5, drift=0.0, delay_u_s=0.0, drift_u=0.0, covariance_s=0.0, events=10)
    time = np.arange(20_000) / 5000.0
    found = resampled(np.sin(2 * np.pi * 900 * time), 5000.0, relation, 1000.0, 2000)
    assert np.abs(found).max() <= 1e-3


def a_run(pulse: NDArray[np.float64], rate_hz: float = 1000.0) -> Run:
    time = np.arange(pulse.size) / rate_hz
    return Run(
        run_id="1",
        created="2026-01-01T00:00:00+00:00",
        specimen="",
        sample_rate_hz=rate_hz,
        period_samples=0,
        excitation_kind="custom",
        status="complete",
        channels={"displacement": 0.01 * np.sin(2 * np.pi * 2 * time), "force": np.zeros(pulse.size), "current": pulse},
        units={"displacement": "m", "force": "N", "current": "A"},
    )


def a_record(seconds: float = 16.0, delay_s: float = -2.0, drift: float = 3e-5) -> tuple[Run, TimeHistory]:
    """A run, and the record of a better load cell at 2 500 Hz with a clock of its own; both have the coil's current."""
    edges = np.cumsum(np.random.default_rng(6).uniform(0.4, 1.4, 40))

    def pulse(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return (np.searchsorted(edges, t) % 2).astype(float)

    def force(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return 1000.0 * np.cos(2 * np.pi * 2 * t)

    run = a_run(pulse(np.arange(12_000) / 1000.0))
    at = delay_s + (1 + drift) * np.arange(round(seconds * 2500)) / 2500.0
    channels = (
        Channel(name="Load", unit="kN", values=force(at) * 1e-3),
        Channel(name="Coil", unit="mA", values=pulse(at) * 1e3),
        Channel(name="Oil", unit="degC", values=np.full(at.size, 40.0)),
    )
    return run, TimeHistory(sample_rate_hz=2500.0, channels=channels, drive=False)


def test_force_of_another_acquisition_replaces_that_of_the_run_and_says_how_sure_it_is() -> None:
    run, record = a_record()
    found = merged(run, record, by_pulse(run, record, "current", "Coil", 0.5), {"Load": "force", "Oil": "temperature"})
    truth = 1000.0 * np.cos(2 * np.pi * 2 * np.arange(run.samples) / 1000.0)
    error = float(np.sqrt(np.mean((found.run.channels["force"] - truth) ** 2)))
    assert error <= 2 * found.channel_u["force"]
    assert found.channel_u["force"] <= 10.0
    assert found.run.units["temperature"] == "degC"
    assert found.run.channels["temperature"] == pytest.approx(np.full(run.samples, 40.0))
    assert "another acquisition: delay -2.0" in found.run.events[-1][1]


def test_a_record_that_does_not_cover_the_run_is_refused() -> None:
    run, record = a_record(seconds=10.0)
    with pytest.raises(AlignmentError, match=r"the other record covers -2.000 … 8.000 s of the run, 0 … 12.000 s"):
        merged(run, record, by_trigger(run, record, 2.0, 1e-4), {"Load": "force"})


@pytest.mark.parametrize(
    ("names", "says"),
    [
        ({"Lode": "force"}, "the record has no channel 'Lode': there are Load, Coil, Oil"),
        ({"Oil": "force"}, "channel 'Oil' is in 'degC': force must be in N"),
    ],
)
def test_a_channel_that_cannot_be_taken_is_refused(names: dict[str, str], says: str) -> None:
    run, record = a_record()
    with pytest.raises(AlignmentError, match=says):
        merged(run, record, by_trigger(run, record, 2.0, 1e-4), names)


def test_a_record_in_a_text_file_is_aligned_by_the_command(tmp_path: Path) -> None:
    _, record = a_record(seconds=0.1)
    path = tmp_path / "daq.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", *(f"{c.name} [{c.unit}]" for c in record.channels)])
        writer.writerows(zip(np.arange(250) / 2500.0, *(c.values for c in record.channels), strict=True))
    found = read_record(path)
    assert found.sample_rate_hz == pytest.approx(2500.0)
    assert found.channels[0].values == pytest.approx(record.channels[0].values)
    run_path, out = tmp_path / "run.h5", tmp_path / "aligned.h5"
    write_run(run_path, replace(a_run(np.zeros(80)), path=None))
    align(run=run_path, record=path, take=["Load=force"], output=out, trigger=0.01)
    assert read_run(out).channels["force"].size == 80
    path.write_text("time,Load\n0,1\n1,2\n", encoding="utf-8")
    with pytest.raises(AlignmentError, match=r"line 1: each heading must be 'name \[unit\]'"):
        read_record(path)
