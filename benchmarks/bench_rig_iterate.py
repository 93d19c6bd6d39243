"""Drive-file iteration on a rig in a process of its own: the error of every iteration, in per cent of the target's rms.

A homogenised multisine and a road record; each must reach 1 % within five iterations after the plain command.
"""

from __future__ import annotations

import tempfile
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.machine import a_rig
from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config
from rigctl.iterate import Iterated, Outcome, iterate
from rigctl.player import connect, play

RATE_HZ = 1000.0
HOMOGENISED = {
    "kind": "homogenised",
    "sample_rate": RATE_HZ,
    "period_samples": 8192,
    "periods": 3,
    "seed": 1,
    "displacement": {
        "f_min": 0.25,
        "f_max": 30.0,
        "spectrum": "quarter-car",
        "max_displacement": 0.04,
        "max_velocity": 0.8,
    },
    "current": {"f_min": 0.25, "f_max": 100.0, "spectrum": "control", "min": 0.3, "max": 1.6},
    "homogenise": {"method": "duym", "grid": [10, 10]},
}


def a_road(seconds: float = 30.0, peak_m: float = 0.02) -> Excitation:
    """A record without a period, with the spectrum of a rough road from 0.3 to 25 Hz."""
    n = round(seconds * RATE_HZ)
    f = np.fft.rfftfreq(2 * n, 1 / RATE_HZ)
    band = (f > 0.3) & (f < 25)
    spectrum = np.fft.rfft(np.random.default_rng(3).standard_normal(2 * n))
    x = np.fft.irfft(np.where(band, np.maximum(f, 0.3) ** -1.0, 0.0) * spectrum)[:n]
    return Excitation(
        kind=Kind.ROAD,
        sample_rate_hz=RATE_HZ,
        period_samples=0,
        displacement_m=peak_m * x / np.max(np.abs(x)),
        current_a=np.full(n, 0.8),
    )


def measure(url: str, name: str, excitation: Excitation) -> bool:
    """Iterate once, print one line; False where 1 % was not reached."""
    with tempfile.TemporaryDirectory() as folder, closing(connect(url)) as wire:
        found: Iterated = iterate(
            partial(play, wire, out_dir=Path(folder)),
            Test(name=name, excitation=excitation, max_temperature_degc=30.0),
        )
    errors = " → ".join(f"{100 * step.error:.2f}" for step in found.steps)
    speed = np.max(np.abs(np.diff(excitation.displacement_m))) * RATE_HZ
    peak = np.max(np.abs(excitation.displacement_m))
    print(f"  {name:22s} {1e3 * peak:3.0f} mm, {speed:.2f} m/s  {found.outcome}: {errors} % rms", flush=True)
    return found.outcome is Outcome.CONVERGED and len(found.steps) <= 6


def main() -> None:
    """Raises SystemExit where a drive did not converge."""
    print("drive-file iteration")
    with a_rig("modbus://127.0.0.1:0", 50.0) as (url, _):
        whole = [
            measure(url, "homogenised multisine", excitation_from_config(HOMOGENISED)),
            measure(url, "road record", a_road()),
        ]
    if not all(whole):
        raise SystemExit("the measured motion is not the wanted one")


if __name__ == "__main__":
    main()
