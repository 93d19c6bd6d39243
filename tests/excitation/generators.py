"""A configuration of every kind of design within the same bounds: what the suite of all generators runs over."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from excitation.hdf5 import write_hdf5
from excitation.kinds import Kind
from excitation.rig import Control, Envelope, MotionLimits
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config

__all__ = ["CONFIGS", "file_config", "replay_config", "rig_of", "write_record"]

BOUNDS = {"max_displacement": 0.02, "max_velocity": 0.4, "max_acceleration": 30.0, "beyond": "scale"}
BAND = {"f_min": 0.5, "f_max": 20.0, "max_displacement": 0.02, "max_velocity": 0.4, "max_acceleration": 30.0}
PERIODIC = {"sample_rate": 500.0, "period_samples": 2000, "periods": 2}
ROAD = {"road_class": "C", "length": 100.0, "seed": 3}

CONFIGS: dict[str, dict[str, Any]] = {
    "multisine": {"kind": "multisine", **PERIODIC, "displacement": BAND},
    "multisine of log lines": {"kind": "multisine", **PERIODIC, "displacement": {**BAND, "lines": {"count": 12}}},
    "multisine with current": {
        "kind": "multisine", **PERIODIC, "displacement": BAND,
        "current": {"f_min": 0.5, "f_max": 60.0, "min": 0.2, "max": 1.1},
    },
    "homogenised": {"kind": "homogenised", **PERIODIC, "displacement": BAND, "homogenise": {"method": "duym"}},
    "sine": {"kind": "sine", "sample_rate": 500.0, "amplitude": 0.005, "frequency": 7.3, "cycles": 9, "current": 0.5},
    "triangle": {
        "kind": "triangle", "sample_rate": 500.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 4, "corner_time": 0.05,
    },
    "steps": {
        "kind": "steps", "sample_rate": 500.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 8,
        "levels": [0.2, 0.6, 1.1], "step_time": 0.2,
    },
    "listed steps": {
        "kind": "steps", "sample_rate": 500.0, "amplitude": 0.01, "frequency": 2.1, "cycles": 8, "settling_cycles": 1,
        "levels": [0.2, 0.6, 1.1, 0.5], "step_time": 0.2, "sequence": "listed",
    },
    "prbs": {
        "kind": "steps", "sample_rate": 500.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 8, "levels": [0.2, 1.1],
        "step_time": 0.05, "sequence": "prbs", "order": 5, "periods": 2,
    },
    "linear sweep": {
        "kind": "sweep", "sample_rate": 500.0, "f_start": 0.5, "f_end": 20.0, "duration": 12.0, "law": "linear",
        "bounds": BOUNDS, "current": 0.5,
    },
    "log sweep": {
        "kind": "sweep", "sample_rate": 500.0, "f_start": 20.0, "f_end": 0.5, "duration": 12.0, "fade": 1.0,
        "bounds": BOUNDS,
    },
    "noise": {
        "kind": "noise", **PERIODIC, "bounds": BOUNDS, "current": 0.5,
        "density": {"of": "velocity", "frequency": [0.5, 20.0], "density": [1e-2, 1e-3]},
    },
    "road": {
        "kind": "road", "sample_rate": 500.0, "speed": 20.0, "f_max": 20.0, "periods": 2, "road": ROAD,
        "bounds": BOUNDS,
    },
}  # fmt: skip


def rig_of(share: float = 1.0) -> Envelope:
    """A rig that can do ``share`` of what the configurations ask for, and no more."""
    motion = MotionLimits(
        max_displacement_m=0.02 * share,
        max_velocity_m_s=0.4 * share,
        max_acceleration_m_s2=30.0 * share,
        bandwidth_hz=25.0,
    )
    return Envelope(motion=motion, control=Control(sample_rates_hz=(500.0,), min_current_a=0.0, max_current_a=1.2))


def write_record(path: Path) -> Excitation:
    """A record of 8 s at 1000 Hz: two sines beside a mean of 3 mm, and a current that steps."""
    t = np.arange(8000) / 1000.0
    x = 0.003 + 0.008 * np.sin(2 * np.pi * 1.3 * t + 1.0) + 0.002 * np.cos(2 * np.pi * 5.1 * t)
    made = Excitation(
        kind=Kind.CUSTOM, sample_rate_hz=1000.0, period_samples=0, displacement_m=x, current_a=np.floor(t) / 8.0
    )
    write_hdf5(path, made)
    return made


def replay_config(folder: Path) -> dict[str, Any]:
    """A part of that record at half its rate."""
    write_record(folder / "record.h5")
    return {
        "kind": "replay",
        "record": str(folder / "record.h5"),
        "channel": "displacement_command",
        "current_channel": "current_command",
        "start": 1.0,
        "end": 7.0,
        "sample_rate": 500.0,
        "f_max": 20.0,
        "bounds": BOUNDS,
    }


def file_config(folder: Path) -> dict[str, Any]:
    """A file of samples that no design makes: a sine whose third harmonic an iteration has added."""
    made = excitation_from_config(CONFIGS["sine"])
    n = np.arange(made.samples) % made.period_samples
    added = 1e-4 * np.sin(6.0 * np.pi * n / made.period_samples)
    write_hdf5(folder / "drive.h5", replace(made, displacement_m=0.9 * made.displacement_m + added))
    return {"kind": "file", "record": str(folder / "drive.h5")}
