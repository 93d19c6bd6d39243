"""Sensitivity of the tanh model as a study of 2021 did it: 15 625 samples, network 6–10–1, Garson's weights.

`python -m benchmarks.bench_sensitivity [PAGE.html]`. Beside it the shares that the study publishes. Goal: its
order of the parameters, exactly by one at a time, and by the mean of twenty networks α, β > c0, δ > F0 > k0: the
difference within each pair is smaller than that between networks.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.physical.literature import literature
from identification.studies.sensitivity import Sensitivity, sensitivity, sensitivity_text, write_sensitivity
from identification.studies.sensitivity.result import ALONE, GARSON

POINT = {
    "tanh_hysteresis.alpha": 1025.79, "tanh_hysteresis.beta": 18.43, "viscous_damping.c": 1830.0,
    "tanh_hysteresis.delta": 0.9715, "force_offset.F0": -104.55, "linear_stiffness.k": 2.5,
}  # fmt: skip
PUBLISHED = (39.4325, 30.6834, 14.7600, 14.71123, 0.3947, 0.0180)  # %, in the order of POINT: that of its shares


def main(arguments: Sequence[str] = ()) -> int:
    """Prints the shares; returns 1 where the order is another."""
    began = time.perf_counter()
    found = sensitivity(literature("hyperbolic tangent", POINT), Sensitivity(vary=tuple(POINT), networks=20))
    print(sensitivity_text(found))
    print(f"  published:    {'  '.join(f'{share:.3g}' for share in PUBLISHED)} %, {time.perf_counter() - began:.0f} s")
    spread = 100.0 * np.stack([found.garson.min(axis=0), found.garson.max(axis=0)])
    print("  by network:   " + ", ".join(f"{low:.2g} – {high:.2g}" for low, high in spread.T))
    order, names = found.order(GARSON), list(POINT)
    grouped = [set(order[:2]), set(order[2:4]), order[4:]] == [set(names[:2]), set(names[2:4]), names[4:]]
    same = grouped and found.order(ALONE) == names
    print(f"  order of the study: {'found' if same else 'NOT found'}")
    if arguments:
        write_sensitivity(Path(arguments[0]), found)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
