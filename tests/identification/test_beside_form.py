"""A small effect beside a large one, whose departure from its canonical form would hide it."""

from __future__ import annotations

import numpy as np
import pytest

from identification.discrepancy import Verdict, explain
from identification.physical.model import Model, element
from rigctl.runfile import Run

BASE = Model(name="a dashpot", elements=(element("viscous_damping", {"c": 900.0, "c_control": 0.0}),))


def run(name: str, seed: int, saturates: bool) -> Run:
    """A fluid whose yield force follows the current, under random motion at 250 Hz and steps of current.

    The yield law 2/π·arcsin(…) is none of the catalogue's, nor is the saturation i/(1 + (i/i_s)³)^(1/3).
    """
    rng, rate, count = np.random.default_rng(seed), 250.0, 3000
    t = np.arange(count) / rate
    hz = rng.uniform(0.3, 4.0, 12)
    phase, size = rng.uniform(0.0, 2 * np.pi, 12), 0.01 / (1.0 + (hz / 1.0) ** 2)
    x = np.sum(size[:, None] * np.sin(2 * np.pi * hz[:, None] * t + phase[:, None]), axis=0)
    v = np.sum((2 * np.pi * hz * size)[:, None] * np.cos(2 * np.pi * hz[:, None] * t + phase[:, None]), axis=0)
    i = np.repeat(rng.uniform(0.0, 2.0, 12), count // 12)
    flows = i / (1.0 + (i / 1.2) ** 3) ** (1.0 / 3.0) if saturates else i
    yields = (80.0 + 300.0 * flows) * 2.0 / np.pi * np.arcsin(np.clip(v / np.hypot(v, 0.006), -1.0, 1.0))
    channels = {
        "displacement": x + 1e-7 * rng.standard_normal(count),
        "force": 800.0 * v + yields + 1.5 * rng.standard_normal(count),
        "current": i,
    }
    return Run(
        run_id=name, created="2026-01-01T00:00:00+00:00", specimen="specimen", sample_rate_hz=rate, period_samples=0,
        excitation_kind="custom", status="complete", channels=channels,
        units={"displacement": "m", "force": "N", "current": "A"}, design=None, events=(), path=None,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("saturates", [True, False])
def test_what_one_more_name_closes_almost_whole_is_no_departure_of_form(saturates: bool) -> None:
    runs = [run(f"run-{k}", k, saturates) for k in range(5)]
    found = explain(BASE, runs[:4], runs[4:])
    names = {e.element for e in found.effects}
    assert "tanh_hysteresis" in names
    assert names <= {"tanh_hysteresis", "control_saturation"}
    assert ("control_saturation" in names) is saturates
    assert found.verdict == Verdict.EXPLAINED
