"""Runs of a damper with dry friction and one-sided damping on multisines, with the design that made them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from excitation.motion import motion
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config
from rigctl.runfile import Run

__all__ = ["multisine_run"]

_DESIGN = {
    "kind": "multisine",
    "sample_rate": 500.0,
    "period_samples": 1000,
    "periods": 4,
    "seed": 5,
    "displacement": {
        "f_min": 0.5, "f_max": 25.0, "lines": "odd-random", "max_displacement": 0.02, "max_velocity": 0.5,
    },
}  # fmt: skip


def multisine_run(
    number: int = 0, *, noise: float = 1.0, one_sided: float = 100.0, changes: Mapping[str, object] | None = None
) -> Run:
    """F = 800·v + one_sided·v² + 40·tanh(v/0.15) + noise, N."""
    design = {**_DESIGN, "realisation": number, **(changes or {})}
    made = excitation_from_config(design)
    assert isinstance(made, Excitation)
    v = np.resize(motion(made).velocity_m_s, made.samples)
    rng = np.random.default_rng(number)
    force = 800.0 * v + one_sided * v**2 + 40.0 * np.tanh(v / 0.15) + rng.normal(0.0, noise, v.size)
    channels = {"displacement": made.displacement_m.copy(), "force": force}
    units = {"displacement": "m", "force": "N"}
    if made.current_a is not None:
        channels, units = {**channels, "current": made.current_a.copy()}, {**units, "current": "A"}
    return Run(
        run_id=f"multisine {number}",
        created="2026-11-21T00:00:00+00:00",
        specimen="damper 7",
        sample_rate_hz=made.sample_rate_hz,
        period_samples=made.period_samples,
        excitation_kind="multisine",
        status="complete",
        channels=channels,
        units=units,
        design=dict(made.design),
    )
