"""Measures of steady tests against closed forms, and the sheet that shows them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from api.cli.main import main
from identification.eearth import eearth
from identification.errors import DataError
from identification.force_velocity import arctan_fit, at_peak_speed, extremes, hysteresis_width
from identification.models.measures import score
from identification.physical.model import Model, element
from identification.sheet import write_sheet
from identification.steady import (
    Cycles,
    dynamic_stiffness,
    energy_per_cycle,
    loop_shape,
    loss_factor,
    steady_cycles,
)
from rigctl.runfile import Run, with_channel, write_run
from tests.identification.specimens import run as specimen_run

Floats = NDArray[np.float64]
Law = Callable[[Floats, Floats], Floats]


def sine_run(law: Law, amplitude: float, frequency: float, *, noise: float = 0.0, periodic: bool = True) -> Run:
    rate, cycles = min(1000.0, 500.0 * frequency), 8
    period = round(rate / frequency)
    t = np.arange(period * cycles) / rate
    turn = 2 * np.pi * t * rate / period
    x = amplitude * np.sin(turn)
    force = law(x, amplitude * 2 * np.pi * rate / period * np.cos(turn))
    rng = np.random.default_rng(round(1e6 * amplitude) + period)
    channels = {
        "displacement": x + 1e-7 * rng.standard_normal(t.size),
        "force": force + noise * rng.standard_normal(t.size),
    }
    return Run(
        run_id=f"{amplitude}-{frequency}", created="2026-01-01T00:00:00+00:00", specimen="s", sample_rate_hz=rate,
        period_samples=period if periodic else 0, excitation_kind="sine", status="complete", channels=channels,
        units={"displacement": "m", "force": "N"}, design=None, events=(), path=None,
    )  # fmt: skip


def cycles_of(law: Law, amplitude: float = 0.01, frequency: float = 2.0, *, periodic: bool = True) -> Cycles:
    found = steady_cycles(sine_run(law, amplitude, frequency, periodic=periodic))
    assert found is not None
    return found


@pytest.mark.parametrize("periodic", [True, False])
def test_a_spring_and_a_dashpot_show_their_stiffness_loss_and_energy(periodic: bool) -> None:
    k, c, omega = 3e4, 2e3, 2 * np.pi * 2.0
    test = cycles_of(lambda x, v: k * x + c * v, periodic=periodic)
    assert test.frequency_hz == pytest.approx(2.0, rel=1e-5)
    assert dynamic_stiffness(test) == pytest.approx(np.hypot(k, c * omega), rel=1e-4)
    assert loss_factor(test) == pytest.approx(c * omega / k, rel=1e-3)
    assert energy_per_cycle(test) == pytest.approx(np.pi * c * omega * 0.01**2, rel=1e-4)


@pytest.mark.parametrize(
    ("law", "shape"),
    [
        (lambda x, v: 2e3 * v, 1.0),
        (lambda x, v: 2e3 * v + 4e4 * x, 1.0),
        (lambda x, v: 300.0 * np.sign(v), 4 / np.pi),
        (lambda x, v: 5e3 * v * np.abs(v), 8 / (3 * np.pi)),
    ],
    ids=["dashpot", "spring and dashpot", "dry friction", "orifice"],
)
def test_the_loop_shape_tells_ellipse_rectangle_and_peak_apart(law: Law, shape: float) -> None:
    assert loop_shape(cycles_of(law)) == pytest.approx(shape, rel=0.03)


@pytest.mark.parametrize("frequency", [1.0, 7.3, 10.0, 30.0])
def test_the_extremes_of_a_dashpot_are_its_own_at_a_few_samples_a_cycle_too(frequency: float) -> None:
    t = np.arange(1000) / 100.0
    turn = 2 * np.pi * frequency
    channels = {"displacement": 0.01 * np.sin(turn * t), "force": 2e3 * 0.01 * turn * np.cos(turn * t) + 50.0}
    test = steady_cycles(replace(sine_run(lambda x, v: v, 0.01, 2.0, periodic=False), channels=channels,
                                 sample_rate_hz=100.0))  # fmt: skip
    assert test is not None
    assert extremes([test])[1] == pytest.approx([20.0 * turn + 50.0, 50.0 - 20.0 * turn], rel=1e-3)


def test_rebound_and_compression_are_those_at_peak_speed_and_the_width_that_of_the_loop() -> None:
    """With a spring the greatest force is at another speed; it opens the loop over velocity by 2 k a."""
    law: Law = lambda x, v: np.where(v > 0.0, 3e3, 1e3) * v + 4e4 * x + 25.0  # noqa: E731
    test = cycles_of(law)
    top = 0.01 * 2 * np.pi * 2.0
    assert at_peak_speed([test])[0] == pytest.approx([top, -top], rel=1e-3)
    assert at_peak_speed([test])[1] == pytest.approx([3e3 * top + 25.0, 25.0 - 1e3 * top], rel=0.03)
    assert extremes([test])[1][0] > 1.3 * at_peak_speed([test])[1][0]
    assert hysteresis_width(test) == pytest.approx(2 * 4e4 * 0.01, rel=0.02)
    assert hysteresis_width(cycles_of(lambda x, v: 2e3 * v)) < 0.01 * 2e3 * top


def test_a_run_without_force_is_no_test_and_has_no_loop_shape() -> None:
    run = sine_run(lambda x, v: 2e3 * v, 0.01, 2.0)
    flat = with_channel(run, "force_simulated", np.zeros(run.samples), "N")
    assert "loop_shape_measured" in score(flat)
    assert "loop_shape_simulated" not in score(flat)
    assert steady_cycles(flat, "force_simulated") is None


def test_the_loop_shape_depends_neither_on_the_loss_angle_nor_on_the_scale() -> None:
    shapes = [
        loop_shape(cycles_of(lambda x, v, k=k, s=s: s * (300.0 * np.tanh(v / 0.02) + k * x)))  # type: ignore[misc]
        for k, s in ((0.0, 1.0), (0.0, 30.0))
    ]
    assert shapes[0] == pytest.approx(shapes[1], rel=1e-3)


def test_the_four_parameters_of_the_saturating_curve_come_back_from_thirty_tests() -> None:
    s, f1, d, f2 = 12017.0, 0.65, 0.38, -0.0009
    law: Law = lambda x, v: 2 / np.pi * np.arctan(s * v) * f1 + d * v + f2  # noqa: E731
    runs = []
    for amplitude, top in ((2e-3, 8.117), (5e-3, 8.117), (10e-3, 4.058), (15e-3, 2.705), (25e-3, 1.623)):
        runs += [sine_run(law, amplitude, f, noise=1e-3) for f in np.geomspace(0.0068, top, 6)]
    tests = [test for test in map(steady_cycles, runs) if test is not None]
    assert len(tests) == 30
    curve = arctan_fit(*extremes(tests))
    assert [curve.S, curve.F1, curve.d, curve.F2] == pytest.approx([s, f1, d, f2], rel=5e-3, abs=1e-5)


def test_a_shift_a_scale_and_a_warp_each_show_in_their_own_score() -> None:
    t = np.arange(3000) / 1000
    pulse = np.exp(-(((t - 1.5) / 0.2) ** 2))
    assert eearth(pulse, pulse).score == pytest.approx(1.0)
    late = eearth(np.roll(pulse, 60), pulse)
    assert late.shift == 60
    assert late.phase == pytest.approx(1 - 60 / 3000 / 0.2)
    assert late.magnitude == pytest.approx(1.0, abs=1e-6)
    scaled = eearth(pulse, 0.8 * pulse)
    assert (scaled.phase, scaled.slope) == (1.0, pytest.approx(1 - 0.2 / 2.0))
    assert 0.6 < scaled.magnitude < 1.0
    assert scaled.score == pytest.approx(0.2 * scaled.magnitude + 0.4 + 0.4 * scaled.slope)
    assert eearth(pulse, -pulse).score < 0.5


def test_the_banded_warp_is_that_of_the_whole_table() -> None:
    from identification.eearth import _warped

    rng = np.random.default_rng(3)
    c, t = rng.standard_normal(40).cumsum(), rng.standard_normal(40).cumsum()
    cost = np.full((41, 41), np.inf)
    cost[0, 0] = 0.0
    for i, j in product(range(40), range(40)):
        if abs(i - j) <= 6:
            cost[i + 1, j + 1] = (c[j] - t[i]) ** 2 + min(cost[i, j], cost[i + 1, j], cost[i, j + 1])
    i = j = 40
    distance = size = 0.0
    while i:
        distance, size = distance + abs(c[j - 1] - t[i - 1]), size + abs(t[i - 1])
        i, j = min(((i - 1, j - 1), (i, j - 1), (i - 1, j)), key=lambda at: cost[at])
    assert _warped(c, t, 6) == pytest.approx((distance, size))


def test_a_score_tells_energy_and_loop_shape_of_both_forces() -> None:
    run = sine_run(lambda x, v: 2e3 * v, 0.01, 2.0)
    figures = score(with_channel(run, "force_simulated", 0.9 * run.channels["force"], "N"))
    assert figures["energy_simulated"] == pytest.approx(0.9 * figures["energy_measured"])
    assert figures["loop_shape_simulated"] == pytest.approx(figures["loop_shape_measured"])
    assert figures["rrmsse"] == pytest.approx(10.0)


def test_the_sheet_is_one_offline_page_with_a_row_for_each_sine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    law: Law = lambda x, v: 800.0 * np.tanh(v / 0.1) + 500.0 * v  # noqa: E731
    names = []
    for k, (a, f) in enumerate(product((0.005, 0.01, 0.02), (0.5, 1.0, 2.5))):
        write_run(tmp_path / f"{k}.h5", sine_run(law, a, f, noise=2.0))
        names.append(str(tmp_path / f"{k}.h5"))
    write_run(tmp_path / "noise.h5", specimen_run("none", 0, 1))
    assert main(["characterise", *names, str(tmp_path / "noise.h5"), "-o", str(tmp_path / "sheet.html"), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["tests"]
    assert len(rows) == 9
    assert rows[0]["peak_velocity"] == pytest.approx(0.005 * 2 * np.pi * 0.5, rel=1e-3)
    page = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    for words in (
        "PVP",
        "CVP",
        "Dynamic stiffness",
        "Loss factor",
        "noise.h5",
        "arctan",
        "rebound at peak speed",
        "force &gt; 0: tension",
    ):
        assert words in page
    assert '<script src="http' not in page


def test_a_model_stands_beside_the_tests_of_the_sheet(tmp_path: Path) -> None:
    runs = [sine_run(lambda x, v: 800.0 * np.tanh(v / 0.1), 0.01, f, noise=2.0) for f in (0.5, 1.0, 2.5)]
    model = Model(name="viscous", elements=(element("viscous_damping", {"c": 1000.0}),))
    rows = write_sheet(tmp_path / "sheet.html", [replace(r, run_id=f"{k}") for k, r in enumerate(runs)], model)
    for row in rows:
        assert row["force_max_simulated"] == pytest.approx(1000.0 * float(str(row["peak_velocity"])), rel=1e-3)
    assert '"dash"' in (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert "force_max_simulated" not in write_sheet(tmp_path / "plain.html", runs[:1])[0]


def test_a_sheet_without_a_sine_is_refused_and_not_written(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no steady sine"):
        write_sheet(tmp_path / "sheet.html", [specimen_run("none", 0, 1)])
    assert list(tmp_path.iterdir()) == []
