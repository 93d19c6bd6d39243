"""The campaign of the demonstration: tests for an unknown semi-active damper."""

from __future__ import annotations

from typing import Any

from excitation.kinds import Kind

__all__ = ["campaign"]

SAMPLE_RATE_HZ = 1000.0


def campaign(rig: str) -> dict[str, Any]:
    """The body of POST /v1/campaigns, 95 s of rig time. Any: JSON."""
    return {
        "name": "what is my simulation missing?",
        "rig": rig,
        "specimen": "semi-active damper",
        "tests": [
            _multisine("multisine low", seed=1, level=0.35, periods=4),
            _multisine("multisine high", seed=2, level=1.0, periods=4),
            _sine("sine 1 Hz", amplitude_m=0.045, frequency_hz=1.0, cycles=8, current_a=0.6),
            _sine("sine 3 Hz", amplitude_m=0.015, frequency_hz=3.0, cycles=15, current_a=1.2),
            {
                "name": "slow triangle",
                "kind": Kind.TRIANGLE,
                "sample_rate": SAMPLE_RATE_HZ,
                "amplitude": 0.03,
                "frequency": 0.2,
                "cycles": 3,
                "corner_time": 0.1,
                "current": 0.3,
            },
            {
                "name": "current steps",
                "kind": Kind.STEPS,
                "sample_rate": SAMPLE_RATE_HZ,
                "amplitude": 0.03,
                "frequency": 1.25,
                "cycles": 15,
                "levels": [0.3, 0.7, 1.1, 1.6],
                "step_time": 0.5,
                "seed": 4,
            },
            _multisine("multisine, other phases", seed=3, level=0.8, periods=3, held_out=True),
            _sine("sine 0.8 Hz", amplitude_m=0.045, frequency_hz=0.8, cycles=6, current_a=0.9, held_out=True),
        ],
    }


def _multisine(name: str, *, seed: int, level: float, periods: int, held_out: bool = False) -> dict[str, Any]:
    return {
        "name": name,
        "kind": Kind.MULTISINE,
        "held_out": held_out,
        "sample_rate": SAMPLE_RATE_HZ,
        "period_samples": 4096,
        "periods": periods,
        "seed": seed,
        "level": level,
        "displacement": {
            "f_min": 0.25,
            "f_max": 15.0,
            "lines": "all",
            "spectrum": "quarter-car",
            "max_displacement": 0.05,
            "max_velocity": 1.0,
        },
        "current": {"f_min": 0.25, "f_max": 50.0, "spectrum": "control", "min": 0.3, "max": 1.6},
    }


def _sine(
    name: str,
    *,
    amplitude_m: float,
    frequency_hz: float,
    cycles: int,
    current_a: float,
    held_out: bool = False,
) -> dict[str, Any]:
    return {
        "name": name,
        "kind": Kind.SINE,
        "held_out": held_out,
        "sample_rate": SAMPLE_RATE_HZ,
        "amplitude": amplitude_m,
        "frequency": frequency_hz,
        "cycles": cycles,
        "settling_cycles": 1,
        "current": current_a,
    }
