"""The analysis of periodic tests against systems whose distortion is known: bounds, approximation, time.

`python -m benchmarks.bench_analysis`
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.friction_system import FrictionCase, friction_played
from benchmarks.known_system import Case, Known, played
from excitation.analysis import Analysis, analyse

TRIALS = 200
GOAL = 0.95
# Of 200 trials with a probability of 0.95 each, 184 to 196 lie within: the goal is held where as many as 0.92 do.
CHANCE = 0.92

_FAST = Case()
_FRICTION = FrictionCase()
CASES: dict[str, Case | FrictionCase] = {
    "fast: one realisation, random odd lines, flat": _FAST,
    "fast, two periods": replace(_FAST, periods=2),
    "fast, noise as large as the distortion": replace(_FAST, noise=0.2),
    "fast, displacement falls with frequency": replace(_FAST, shape="velocity"),
    "fast, road: 3 lines hold most (told as a note)": replace(_FAST, shape="road"),
    "robust: four realisations, odd lines": replace(_FAST, lines="odd", realisations=4),
    "robust: two realisations, all lines": replace(_FAST, lines="all", realisations=2),
    "both: four realisations, random odd lines": replace(_FAST, realisations=4),
    "friction, 2 µm and 1 N noise": _FRICTION,
    "friction, 2 µm noise, two periods": replace(_FRICTION, periods=2),
    "friction, 10 µm noise": replace(_FRICTION, displacement_noise_m=1e-5),
    "friction, 2 µm noise, four realisations, odd lines": replace(_FRICTION, lines="odd", realisations=4),
    "friction, 2 µm noise, two realisations, all lines": replace(_FRICTION, lines="all", realisations=2),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """Whether each level lies within its bounds, how far it is off, and how often the approximation is within."""

    within: dict[str, bool]
    ratio: dict[str, float]
    approximation: float


def main(trials: int = TRIALS, first_seed: int = 1000) -> None:
    """Prints the share of levels within their 95 % bounds for each case."""
    true = np.array([played(_FAST, first_seed + seed).odd for seed in range(trials)])
    low, high = np.percentile(true / np.median(true), [2.5, 97.5])
    print(f"true odd level of one realisation over their median: {low:.2f} … {high:.2f} in 95 % of {trials}")
    for name, case in CASES.items():
        start = time.perf_counter()
        found = [trial(case, first_seed + seed) for seed in range(trials)]
        print(f"{name} ({trials} trials, {time.perf_counter() - start:.1f} s)")
        for kind in found[0].within:
            share = float(np.mean([one.within[kind] for one in found]))
            ratio = np.percentile([one.ratio[kind] for one in found], [2.5, 50.0, 97.5])
            verdict = "met" if share >= GOAL else "met within chance" if share >= CHANCE else "MISSED"
            print(
                f"  {kind}: {100 * share:.1f} % within bounds, goal ≥ {100 * GOAL:.0f} %: {verdict}; found over true "
                f"{ratio[1]:.3f} ({ratio[0]:.3f} … {ratio[2]:.3f})"
            )
        inside = float(np.mean([one.approximation for one in found]))
        print(f"  approximation: {100 * inside:.1f} % of its lines within bounds", flush=True)


def trial(case: Case | FrictionCase, seed: int) -> Trial:
    """One measurement of a case, analysed."""
    known = played(case, seed) if isinstance(case, Case) else friction_played(case, seed)
    found = analyse(known.measurement)
    response = found.responses[0]
    away = np.abs(response.value - known.value[np.isin(known.driven, response.lines)])
    pairs = list(_levels(found, known))
    return Trial(
        within={kind: low <= true <= high for kind, _, low, high, true in pairs},
        ratio={kind: rms / true for kind, rms, _, _, true in pairs},
        approximation=float(np.mean(away <= response.bound)),
    )


def _levels(found: Analysis, known: Known) -> Iterator[tuple[str, float, float, float, float]]:
    levels = found.levels
    for kind, level, true in (
        ("odd", levels.odd, known.odd),
        ("even", levels.even, known.even),
        ("odd and even", levels.nonlinear, known.both),
    ):
        if level is not None:
            yield kind, level.rms, *level.bounds, true


if __name__ == "__main__":
    main()
