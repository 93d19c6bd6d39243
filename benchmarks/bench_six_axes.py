"""Six axes: models of a damper between rubber bushes from tests of one axis each, and where that fails.

`python -m benchmarks.bench_six_axes`. After Umehara et al. (railway dampers on a rig of six axes). The specimen is
simulated (`sim_rig.multi_axis`); the identification shares no equation with it. Errors are shown on motions of all axes
that nothing was learned from. The base is fitted to the test of the main axis.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from identification.fitting.axes_base import axes_base
from identification.multiaxis import LOADS, MOTIONS, MultiAxis, check_superposition, identify_axes, superposed
from rigctl.runfile import Run
from sim_rig.multi_axis import ANTI_YAW, played

Floats = NDArray[np.float64]

RATE_HZ, SECONDS = 100.0, 40.0
LARGEST = np.array([4e-3, 4e-3, 4e-3, 0.02, 0.03, 0.03])  # of each axis, m and rad
SIDEWAYS = np.array([1.0, 4.0, 4.0, 1.0, 1.0, 1.0])  # the same with four times the sideways motion
UNITS = ("m", "m", "m", "rad", "rad", "rad", "N", "N", "N", "N·m", "N·m", "N·m")


def main() -> int:
    """Prints what superposition misses, the inputs that are chosen, and the errors of both models."""
    began = time.process_time()
    for label, factor in (("as in service", np.ones(6)), ("four times the sideways motion", SIDEWAYS)):
        moved = motion(1, factor)
        singles = [run_of(moved * (np.arange(6) == k), seed=k) for k in range(6)]
        together = run_of(moved, seed=7)
        found = check_superposition(together, singles)
        print(f"  {label}: missed by the sum of single tests, % of the rms: {row(found.missed)}")
        for sentence in found.described():
            print(f"    {sentence}")
        shown = [run_of(motion(seed, factor), seed=seed) for seed in (20, 21)]
        base = axes_base(None, [singles[0]])
        from_singles = identify_axes([superposed(singles)], base=base)
        from_all = identify_axes([together], base=base)
        alone = identify_axes([superposed(singles)])
        if label == "as in service":
            for load in LOADS:
                print(f"    {load} sees {', '.join(from_singles.loads[load].axes)}")
        print(f"    without a base, of single tests, %:       {row(errors(alone, shown))}")
        print(f"    error of the model of single tests, %:    {row(errors(from_singles, shown))}")
        print(f"    error of the model of a test of all, %:   {row(errors(from_all, shown))}", flush=True)
    print(f"  {time.process_time() - began:.0f} s of the processor")
    return 0


def motion(seed: int, factor: Floats) -> Floats:
    """A random motion of all axes, (N, 6): tones of 0.2 to 4 Hz that fall with the frequency."""
    rng, t = np.random.default_rng([6, seed]), np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    axes = []
    for size in LARGEST * factor:
        hertz = rng.uniform(0.2, 4.0, 24)
        turns = np.multiply.outer(t, 2.0 * np.pi * hertz) + rng.uniform(0.0, 2.0 * np.pi, hertz.size)
        course = np.sin(turns) @ (1.0 / hertz)
        axes.append(size * course / np.max(np.abs(course)) * np.minimum(1.0, t))
    return np.column_stack(axes)


def run_of(moved: Floats, *, seed: int) -> Run:
    """The specimen along a motion, as a run file has it."""
    loads = played(ANTI_YAW, moved, RATE_HZ, seed=seed)
    names = (*MOTIONS, *LOADS)
    channels = dict(zip(names, [*moved.T.copy(), *loads.T.copy()], strict=True))
    return Run(
        run_id=f"six-{seed}", created="2026-01-01T00:00:00+00:00", specimen=ANTI_YAW.name, sample_rate_hz=RATE_HZ,
        period_samples=0, excitation_kind="custom", status="complete", channels=channels,
        units=dict(zip(names, UNITS, strict=True)),
    )  # fmt: skip


def errors(model: MultiAxis, shown: list[Run]) -> dict[str, float]:
    """Rms error of each load over some runs, as a share of its rms about its mean."""
    out = {}
    for load in LOADS:
        measured = np.concatenate([one.channels[load] for one in shown])
        given = np.concatenate([model.simulate(one)[load] for one in shown])
        out[load] = float(np.sqrt(np.mean((measured - given) ** 2)) / np.std(measured))
    return out


def row(shares: Mapping[str, float]) -> str:
    """The loads in their order, %."""
    return "  ".join(f"{name} {100.0 * shares[name]:.1f}" for name in LOADS)


if __name__ == "__main__":
    sys.exit(main())
