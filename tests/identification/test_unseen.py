"""Gaps that only the held-out runs show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.discrepancy import Verdict, explain
from identification.discrepancy.unseen import gap_on
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import compact, record_from_run
from rigctl.runfile import Run

BASE = Model(
    name="a spring and a dashpot",
    elements=(element("linear_stiffness", {"k": 9000.0}), element("viscous_damping", {"c": 60.0})),
)


def run(name: str, amplitude: float, seed: int, rise: float, step: float = 0.0) -> Run:
    """Two sines without a common period, on a spring whose stiffness rises by the share `rise` at 20 mm, or a force
    that jumps by `step` beyond 8 mm."""
    rng, rate = np.random.default_rng(seed), 250.0
    t = np.arange(2500) / rate
    x, v = (
        amplitude * sum(f(2 * np.pi * hz * t) * (2 * np.pi * hz) ** k for hz in (1.3, np.sqrt(7.0))) / 2
        for k, f in ((0, np.sin), (1, np.cos))
    )
    force = 10_000.0 * x * (1.0 + rise * (x / 0.02) ** 2 / (1.0 + 0.05 * (x / 0.02) ** 2)) + 50.0 * v
    force = force + step * (0.5 + 0.5 * np.tanh((x - 0.008) / 1e-4))
    channels = {
        "displacement": x + 1e-6 * rng.standard_normal(t.size),
        "force": force + 0.3 * rng.standard_normal(t.size),
    }
    return Run(
        run_id=name, created="2026-01-01T00:00:00+00:00", specimen="specimen", sample_rate_hz=rate, period_samples=0,
        excitation_kind="custom", status="complete", channels=channels, units={"displacement": "m", "force": "N"},
        design=None, events=(), path=None,
    )  # fmt: skip


def test_an_effect_that_hardly_shows_on_the_fitted_runs_is_named_because_the_held_out_run_shows_it() -> None:
    fitted = [run(f"small-{k}", 0.005, k, rise=0.2) for k in (1, 2, 3)]
    assert explain(BASE, fitted, [run("small", 0.005, 9, rise=0.2)]).verdict == Verdict.NO_DISCREPANCY
    found = explain(BASE, fitted, [run("large", 0.016, 9, rise=0.2)])
    assert [e.element for e in found.effects] == ["cubic_stiffness"]
    assert found.verdict == Verdict.EXPLAINED
    assert found.held_out.closed is not None
    assert found.held_out.closed > 0.9


def test_what_no_fitted_run_holds_is_told_with_the_run_that_shows_it() -> None:
    fitted = [run(f"small-{k}", 0.003, k, rise=0.0, step=30.0) for k in (1, 2, 3)]
    found = explain(BASE, fitted, [run("large", 0.016, 9, rise=0.0, step=30.0)])
    assert found.verdict == Verdict.UNKNOWN_EFFECT
    assert found.effects == ()
    assert "on the fitted runs nothing stays beyond the noise; on the held-out runs" in found.remainder
    assert "most of it on large" in found.remainder


@pytest.mark.parametrize("amplitude", [0.003, 0.03])
def test_a_base_that_is_right_is_right_on_larger_held_out_runs_too(amplitude: float) -> None:
    fitted = [run(f"small-{k}", 0.003, k, rise=0.0) for k in (1, 2, 3)]
    found = explain(BASE, fitted, [run("other", amplitude, 9, rise=0.0)])
    assert found.verdict == Verdict.NO_DISCREPANCY


def test_one_sample_of_a_held_out_run_is_no_gap() -> None:
    """A friction that jumps at a turn that no displacement tells to the sample; two of them are one."""
    fitted = [compact(record_from_run(run(f"small-{k}", 0.003, k, rise=0.0))) for k in (1, 2, 3)]
    fit = fit_records(BASE, fitted)
    other = compact(record_from_run(run("other", 0.003, 9, rise=0.0)))
    for jumps in (0, 1, 2):
        force = other.force.copy()
        force[1000 : 1000 + jumps] += 200.0
        assert gap_on([replace(other, force=force)], fit, fitted) == (jumps > 1)
