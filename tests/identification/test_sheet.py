"""The characteristic sheet: what dampers of known laws give back, its labels, and its page."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from api.cli.main import main
from identification.errors import DataError
from identification.force_velocity import at_peak_speed, sided_fit
from identification.physical.model import Model, element
from identification.sheet import Sheet, sheet_of, sheet_to_json, write_sheet
from identification.sheet.asked import asked
from identification.sheet.results import row
from identification.static_force import StaticForce, static_force, strokes_of_sine, strokes_of_triangle
from identification.steady import steady_cycles
from rigctl.runfile import Run, with_channel, write_run
from tests.identification.sines import Law, sine_run
from tests.identification.specimens import run as specimen_run

Floats = NDArray[np.float64]
GAS, GAS_LENGTH, FRICTION = 220.0, 0.15, 35.0
SERIES = tuple(0.025 * k for k in (0.2, 0.4, 0.8, 2.0, 4.0, 8.0, 16.0))  # m/s, at 25 mm


def damper(rebound: float, compression: float, knee: float, gas: float = GAS, friction: float = FRICTION) -> Law:
    """A gas spring, dry friction, and valves of an arctangent: none of the forms that the sheet fits."""

    def force(x: Floats, v: Floats) -> Floats:
        valves = np.where(v > 0, rebound, compression) * np.arctan(v / knee)
        return -gas * (1 + x / GAS_LENGTH) ** -1.3 + friction * np.tanh(v / 2e-4) + valves + 400.0 * v

    return force


def series(law: Law, amplitude: float = 0.025, noise: float = 2.0) -> list[Run]:
    return [
        replace(sine_run(law, amplitude, top / (2 * np.pi * amplitude), noise=noise, periodic=False), run_id=f"{k}")
        for k, top in enumerate(SERIES)
    ]


def at_rest(runs: list[Run]) -> StaticForce:
    return static_force([strokes_of_sine(c) for c in map(steady_cycles, runs) if c is not None])


@pytest.mark.parametrize(
    ("rebound", "compression", "knee"), [(900.0, 300.0, 0.15), (250.0, 600.0, 0.05), (1500.0, 1500.0, 0.6)]
)
def test_gas_force_stiffness_and_friction_come_back_within_what_is_stated(
    rebound: float, compression: float, knee: float
) -> None:
    found = at_rest(series(damper(rebound, compression, knee)))
    truth = (-GAS, 1.3 * GAS / GAS_LENGTH, FRICTION)
    for estimate, true in zip((found.force, found.stiffness, found.friction), truth, strict=True):
        assert abs(estimate.value - true) < 2.5 * estimate.std, (estimate, true)
    assert found.force.std < 0.1 * GAS
    assert found.friction.std < 0.5 * FRICTION


def test_a_damper_without_gas_and_friction_shows_neither() -> None:
    found = at_rest(series(damper(900.0, 300.0, 0.15, gas=0.0, friction=0.0)))
    assert abs(found.force.value) < 3.0 * found.force.std + 1.0
    assert abs(found.friction.value) < 3.0 * found.friction.std + 1.0
    assert abs(found.stiffness.value) < 3.0 * found.stiffness.std + 20.0


def test_fast_tests_alone_say_that_they_do_not_show_the_friction() -> None:
    fast = [run for run in series(damper(900.0, 300.0, 0.15)) if run.sample_rate_hz and float(run.run_id) > 4]
    found = at_rest(fast)
    assert abs(found.friction.value - FRICTION) < 2.5 * found.friction.std
    assert found.friction.std > FRICTION


def test_slow_triangles_show_the_friction_better_than_any_sine() -> None:
    law = damper(900.0, 300.0, 0.15)
    strokes = [strokes_of_triangle(triangle_run(law, 0.02, speed)) for speed in (0.002, 0.006)]
    found = static_force([one for one in strokes if one is not None])
    assert found.friction.value == pytest.approx(FRICTION, abs=2.0)
    assert found.force.value == pytest.approx(-GAS, abs=3.0)
    assert found.stiffness.value == pytest.approx(1.3 * GAS / GAS_LENGTH, rel=0.05)
    assert found.slowest_m_s == pytest.approx(0.002, rel=0.01)


def triangle_run(law: Law, amplitude: float, speed: float) -> Run:
    rate, quarter = 200.0, amplitude / speed
    t = np.arange(round(8 * quarter * rate)) / rate
    phase = t / (4 * quarter)
    x = amplitude * (1 - 4 * np.abs((phase + 0.25) % 1 - 0.5))
    v = np.gradient(x, 1 / rate)
    rng = np.random.default_rng(round(1e6 * speed))
    channels = {
        "displacement": x + 1e-7 * rng.standard_normal(t.size),
        "force": law(x, v) + 2.0 * rng.standard_normal(t.size),
    }
    still = sine_run(law, 0.01, 1.0)
    return replace(still, run_id=f"triangle-{speed}", sample_rate_hz=rate, period_samples=0, channels=channels,
                   excitation_kind="triangle")  # fmt: skip


def test_each_side_has_a_curve_of_its_own_and_one_curve_for_both_would_leave_more() -> None:
    tests = [c for c in map(steady_cycles, series(damper(900.0, 300.0, 0.15))) if c is not None]
    v, force = at_peak_speed(tests)
    curve = sided_fit(v, force, at_rest=-GAS, friction=FRICTION)
    assert curve.rms < 0.01 * np.ptp(force)
    one = np.polynomial.Polynomial.fit(np.abs(v), np.where(v > 0, 1, -1) * (force + GAS), 4)
    both = np.sqrt(np.mean((np.where(v > 0, 1, -1) * one(np.abs(v)) - GAS - force) ** 2))
    assert both > 100.0
    assert both > 10 * curve.rms
    assert curve.rebound.c > 2 * curve.compression.c


def test_a_progressive_side_is_steeper_beyond_its_knee() -> None:
    v = np.concatenate([np.linspace(0.05, 1.0, 8), -np.linspace(0.05, 1.0, 8)])
    curve = sided_fit(v, np.where(v > 0, 500 * v + 900 * v**2, 700 * v), at_rest=0.0, friction=0.0)
    assert curve.rebound.c_far > 1.5 * curve.rebound.c
    assert curve(v) == pytest.approx(np.where(v > 0, 500 * v + 900 * v**2, 700 * v), abs=20.0)


def test_a_side_with_three_speeds_is_refused() -> None:
    v = np.array([0.1, 0.2, 0.3, -0.1, -0.2, -0.3])
    with pytest.raises(DataError, match="3 forces on one side"):
        sided_fit(v, 100 * v, at_rest=0.0, friction=0.0)


def test_a_label_is_what_was_asked() -> None:
    assert asked([24.999999975e-3, 25.06e-3, 9.97e-3], [None] * 3) == [0.025, 0.025, 0.01]
    assert asked([0.0223, 0.0249], [0.025, None]) == [0.025, 0.025]  # the design knows better than the measurement
    assert asked([0.004, 0.795, 0.81], [None] * 3, least_step=0.02) == [0.0, 0.8, 0.8]


@given(st.lists(st.sampled_from([0.002, 0.005, 0.01, 0.025, 0.04]), min_size=1, max_size=12), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_amplitudes_that_a_rig_holds_to_a_third_of_a_percent_have_the_labels_that_were_asked(
    levels: list[float], seed: int
) -> None:
    error = np.random.default_rng(seed).uniform(-0.003, 0.003, len(levels))
    assert asked([a * (1 + e) for a, e in zip(levels, error, strict=True)], [None] * len(levels)) == levels


def sheet_runs() -> list[Run]:
    """Two currents, a temperature that rises, and a design of each test."""
    runs = []
    for number, (current, (k, top)) in enumerate(product((0.0, 0.8), enumerate(SERIES[1:]))):
        law = damper(900.0 * (1 + current), 300.0 * (1 + current), 0.15)
        run = sine_run(law, 0.02501, top / (2 * np.pi * 0.02501), noise=2.0)
        run = with_channel(run, "current", np.full(run.samples, current + 0.003 * k), "A")
        run = with_channel(run, "temperature", 25.0 + number + np.linspace(0, 1, run.samples), "degC")
        design = {
            "kind": "sine",
            "amplitude": 0.025,
            "frequency": top / 0.157,
            "frequency_asked": round(top / 0.157, 1),
        }
        created = f"2026-01-01T00:{number:02d}:00+00:00"
        runs.append(replace(run, run_id=f"{number}", design=design, created=created, specimen="front damper"))
    return runs


@pytest.fixture(scope="module")
def sheet() -> Sheet:
    return sheet_of(sheet_runs())


def test_the_tests_of_each_current_stand_together_by_speed_under_what_was_asked(sheet: Sheet) -> None:
    assert [group.current for group in sheet.currents] == [0.0, 0.8]
    for group in sheet.currents:
        speeds = [test.cycles.peak_velocity_m_s for test in group.tests]
        assert speeds == sorted(speeds)
        assert {test.amplitude_asked for test in group.tests} == {0.025}
        assert group.curve is not None
    assert [test.label for test in sheet.tests][:2] == ["25 mm, 0.1 Hz, 0 A", "25 mm, 0.1 Hz, 0 A"]


def test_rebound_and_compression_have_figures_of_their_own(sheet: Sheet) -> None:
    figures = row(sheet.currents[0].tests[-1])
    assert float(str(figures["speed_rebound"])) > 0 > float(str(figures["speed_compression"]))
    assert float(str(figures["force_rebound"])) > 1.3 * -float(str(figures["force_compression"]))
    assert figures["hysteresis_width"] == max(
        float(str(figures["hysteresis_width_rebound"])), float(str(figures["hysteresis_width_compression"]))
    )


def test_the_temperature_is_that_of_each_run_over_the_time_of_all(sheet: Sheet) -> None:
    assert sheet.by_time
    assert [round(one.at[0]) for one in sheet.temperatures] == list(range(12))
    start, end = row(sheet.tests[0])["temperature_start"], row(sheet.tests[0])["temperature_end"]
    assert (start, end) == (pytest.approx(25.0, abs=0.1), pytest.approx(26.0, abs=0.1))


def test_the_page_holds_the_signs_the_tables_and_every_figure_and_nothing_from_outside(
    sheet: Sheet, tmp_path: Path
) -> None:
    write_sheet(tmp_path / "sheet.html", sheet)
    page = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    for words in (
        "front damper", "Peak-velocity plot (PVP)", "Continuous-velocity plot (CVP)", "Temperature over the runs",
        "Dynamic stiffness", "Loss factor", "gas force, N", "its stiffness, N/m", "friction, N", "hysteresis width, N",
        "energy per cycle, J", "force &gt; 0: tension", ">rebound<", ">compression<", "prefers-color-scheme:dark",
        "@media print",
    ):  # fmt: skip
        assert words in page, words
    assert '<script src="http' not in page


def test_the_sheet_of_the_command_is_that_of_the_library(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs = [run for run in series(damper(900.0, 300.0, 0.15)) if float(run.run_id) > 1]
    for run in runs:
        write_run(tmp_path / f"{run.run_id}.h5", run)
    write_run(tmp_path / "noise.h5", specimen_run("none", 0, 1))
    files = sorted(str(path) for path in tmp_path.glob("*.h5"))
    assert main(["characterise", *files, "-o", str(tmp_path / "sheet.html"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["format"] == "damper-rig/sheet"
    assert len(said["tests"]) == 5
    [one] = said["currents"]
    assert one["current"] is None
    assert one["curve"]["rebound"]["c"]["value"] > one["curve"]["compression"]["c"]["value"]
    assert json.loads(json.dumps(sheet_to_json(sheet_of(runs))))["currents"][0]["friction"] == one["friction"]
    assert "noise.h5" in (tmp_path / "sheet.html").read_text(encoding="utf-8")


def test_a_model_stands_beside_the_tests_of_the_sheet(tmp_path: Path) -> None:
    runs = [sine_run(lambda x, v: 800.0 * np.tanh(v / 0.1), 0.01, f, noise=2.0) for f in (0.5, 1.0, 2.5)]
    model = Model(name="viscous", elements=(element("viscous_damping", {"c": 1000.0}),))
    beside = sheet_of([replace(r, run_id=f"{k}") for k, r in enumerate(runs)], model)
    write_sheet(tmp_path / "sheet.html", beside)
    for figures in sheet_to_json(beside)["tests"]:
        assert figures["force_max_simulated"] == pytest.approx(1000.0 * figures["peak_velocity"], rel=1e-3)
    assert '"dash"' in (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert "force_max_simulated" not in sheet_to_json(sheet_of(runs[:1]))["tests"][0]


def test_a_triangle_is_no_sine_and_counts_for_the_force_at_rest() -> None:
    law = damper(900.0, 300.0, 0.15)
    slow = [triangle_run(law, 0.02, speed) for speed in (0.002, 0.006)]
    found = sheet_of([*slow, *series(law)[3:]])
    assert len(found.tests) == 4
    assert set(found.currents[0].at_rest.tests) == {run.run_id for run in slow}


def test_a_sheet_without_a_sine_is_refused() -> None:
    with pytest.raises(DataError, match="no steady sine"):
        sheet_of([specimen_run("none", 0, 1)])
