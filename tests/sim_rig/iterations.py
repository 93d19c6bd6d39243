"""Targets of a drive-file iteration, and the iteration on a simulated rig in this process."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config
from rigctl.iterate import Iterated, iterate
from rigctl.limits import Limits
from rigctl.player import PlayerSettings, play
from sim_rig.direct import DirectTransport


def homogenised() -> Excitation:
    return excitation_from_config(
        {
            "kind": "homogenised",
            "sample_rate": 1000.0,
            "period_samples": 4096,
            "periods": 3,
            "seed": 1,
            "displacement": {
                "f_min": 0.5,
                "f_max": 30.0,
                "spectrum": "quarter-car",
                "max_displacement": 0.03,
                "max_velocity": 0.6,
            },
            "current": {"f_min": 0.5, "f_max": 100.0, "spectrum": "control", "min": 0.3, "max": 1.6},
            "homogenise": {"method": "duym", "variables": ["velocity", "current"], "grid": [10, 10]},
        }
    )


def road(samples: int = 12_345) -> Excitation:
    """A record without a period, with the spectrum of a rough road, that does not end at zero."""
    spectrum, f = np.zeros(8193), np.fft.rfftfreq(16_384, 1e-3)
    band = (f > 0.3) & (f < 25)
    spectrum[band] = f[band] ** -0.7
    x = np.fft.irfft(spectrum * np.fft.rfft(np.random.default_rng(3).standard_normal(16_384)))[:samples]
    return Excitation(
        kind=Kind.ROAD,
        sample_rate_hz=1000.0,
        period_samples=0,
        displacement_m=0.008 * x / np.max(np.abs(x)),
        current_a=np.full(samples, 0.8),
    )


def iterated(bench: Any, excitation: Excitation, out: Path, limits: Limits | None = None, **more: Any) -> Iterated:
    wire = DirectTransport(bench.rig, bench.clock)
    player = PlayerSettings(ramp_s=0.5, limits=limits)
    return iterate(
        partial(play, wire, out_dir=out, clock=bench.clock, settings=player),
        Test(name="wanted", excitation=excitation, max_temperature_degc=40.0),
        **more,
    )
