"""Drive-file iteration on a rig in a process of its own: the error of every iteration, % of the rms of the target.

A homogenised multisine and a road record; each must reach its tolerance within four iterations after the plain
command, also where the specimen is replaced by another one between two rounds.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from contextlib import closing
from itertools import count
from pathlib import Path

import numpy as np

from benchmarks.machine import a_rig
from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config
from rigctl.drive import IterationSettings
from rigctl.iterate import Iterated, Outcome, iterate
from rigctl.player import connect, play
from rigctl.transport import Transport

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


def measure(
    name: str, excitation: Excitation, wires: Sequence[Transport], settings: IterationSettings | None = None
) -> Iterated:
    """Iterate once and print the errors; round k plays on wire k, all later ones on the last."""
    rounds = count()

    def on_its_wire(test: Test) -> Path:
        return play(wires[min(next(rounds), len(wires) - 1)], test, out_dir=Path(folder))

    with tempfile.TemporaryDirectory() as folder:
        test = Test(name=name, excitation=excitation, max_temperature_degc=30.0)
        found = iterate(on_its_wire, test, settings=settings)
    errors = ", ".join(
        f"{channel} {' → '.join(f'{100 * step.errors[k]:.2f}' for step in found.steps)}"
        for k, channel in enumerate(found.channels)
    )
    repeat = ", ".join(f"{100 * value:.2f}" for value in found.repeatability)
    print(f"  {name:38s} {errors} % rms; rounds differ by {repeat}; {found.outcome}", flush=True)
    return found


def main() -> None:
    """Raises SystemExit where a drive did not converge as it must."""
    print("drive-file iteration: error of each round over the rms of the target")
    multisine, road = excitation_from_config(HOMOGENISED), a_road()
    finer = IterationSettings(gain=0.8, tolerance=0.003)
    with (
        a_rig("modbus://127.0.0.1:0", 50.0) as (url, _),
        a_rig("modbus://127.0.0.1:0", 50.0, "yaw") as (other_url, _),
        closing(connect(url)) as wire,
        closing(connect(other_url)) as other,
    ):
        found = [
            measure("homogenised, motion and current", multisine, [wire]),
            measure("road", road, [wire]),
            measure("road, another specimen from round 1 on", road, [wire, other], finer),
            measure("road, another specimen from round 2 on", road, [wire, wire, other], finer),
        ]
    if not all(one.outcome is Outcome.CONVERGED and len(one.steps) <= 5 for one in found):
        raise SystemExit("the measured motion is not the wanted one")


if __name__ == "__main__":
    main()
