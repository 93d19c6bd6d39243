"""Runs of a damper with a name for what a model of it lacks, and their way into a service."""

from __future__ import annotations

from pathlib import Path

import httpx
import numpy as np

from rigctl.runfile import Run
from tests.api.following import get

MODEL = {
    "format": "damper-rig/model",
    "format_version": 1,
    "name": "as simulated",
    "kind": "physical",
    "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]},
}
NAMES = ("slow.h5", "middle.h5", "fast.h5", "check.h5")


def a_run(k: int, frequency_hz: float, *, sign: float = 1.0) -> Run:
    """A viscous damper with dry friction on a sine."""
    t = np.arange(4000) / 1000.0
    phase = 2 * np.pi * frequency_hz * t
    v = 0.02 * 2 * np.pi * frequency_hz * np.cos(phase)
    force = 700.0 * v + 30.0 * np.tanh(v / 0.004) + np.random.default_rng(k).normal(0, 1, t.size)
    return Run(
        run_id=f"run {k}",
        created="2026-11-21T00:00:00+00:00",
        specimen="damper 7",
        sample_rate_hz=1000.0,
        period_samples=round(1000 / frequency_hz),
        excitation_kind="sine",
        status="complete",
        channels={"displacement": 0.02 * np.sin(phase), "force": sign * force},
        units={"displacement": "m", "force": "N"},
    )


def sent(base: str, path: Path) -> str:
    answer = httpx.post(f"{base}/v1/runs", params={"name": path.name}, content=path.read_bytes(), timeout=30)
    assert answer.status_code == 201, answer.text
    assert answer.json()["name"] == path.name
    assert get(base, f"/v1/runs/{answer.json()['id']}") == answer.json()
    return str(answer.json()["id"])
