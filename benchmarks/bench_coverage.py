"""Coverage of the range that limits and rig allow: planes, spectra, limits that bind, a rig that lags.

`python -m benchmarks.bench_coverage`: about a minute.
"""

from __future__ import annotations

import os
import statistics
import time
from dataclasses import replace
from typing import Any

from excitation.configuration import to_spec
from excitation.homogenise import homogenised
from excitation.multisine import as_excitation, fit_into_limits, random_phase
from excitation.multisine_spec import HomogeniseSpec, MultisineSpec
from excitation.region import Variable
from excitation.response import Lag, RigResponse

PAPER = {  # Witters & Swevers 2009: quarter-car displacement, control current
    "sample_rate": 1000.0,
    "period_samples": 8192,
    "displacement": {
        "f_min": 0.25,
        "f_max": 30.0,
        "spectrum": "quarter-car",
        "max_displacement": 0.06,
        "max_velocity": 1.5,
    },
    "current": {"f_min": 0.25, "f_max": 100.0, "spectrum": "control", "min": 0.3, "max": 1.6},
}
GOAL = 0.5  # percent, on the achievable range
PLANES: tuple[tuple[tuple[Variable, ...], tuple[int, ...]], ...] = (
    (("velocity", "current"), (10, 10)),
    (("displacement", "velocity"), (10, 10)),
    (("velocity", "acceleration"), (10, 10)),
    (("displacement", "velocity", "current"), (6, 6, 6)),
)
LAG = RigResponse(displacement=Lag(bandwidth_hz=50.0), current=Lag(bandwidth_hz=50.0))


def main(seeds: int = 5) -> None:
    """Prints measured against goal."""
    spec = to_spec(MultisineSpec, PAPER)
    homogenised(replace(spec, homogenise=HomogeniseSpec(iterations=1)))  # compiled, or loaded from the cache
    for variables, grid in PLANES:
        for spectrum in ("quarter-car", "flat", "road"):
            asked = replace(
                spec,
                displacement=replace(spec.displacement, spectrum=spectrum),
                homogenise=HomogeniseSpec(variables=variables, grid=grid),
            )
            _row(f"{' × '.join(variables)}, {spectrum}", asked, seeds)
    more_samples(spec, seeds)
    binding(spec, seeds)
    lagging(spec, seeds)
    long(spec)


def more_samples(spec: MultisineSpec, seeds: int) -> None:
    """Three variables have 216 cells, of 38 samples each in a period of 8 192; in 32 768 they have 152."""
    variables, grid = PLANES[-1]
    for spectrum in ("quarter-car", "flat", "road"):
        asked = replace(
            spec,
            period_samples=2**15,
            displacement=replace(spec.displacement, spectrum=spectrum),
            homogenise=HomogeniseSpec(variables=variables, grid=grid),
        )
        _row(f"{' × '.join(variables)}, {spectrum}, 2^15 samples", asked, seeds)


def binding(spec: MultisineSpec, seeds: int) -> None:
    """A displacement limit that leaves less and less of ±1.5 m/s; direct and Duym."""
    for limit_m in (0.06, 0.055, 0.05, 0.04, 0.03):
        narrow = replace(spec, displacement=replace(spec.displacement, max_displacement_m=limit_m))
        _row(f"±{1e3 * limit_m:g} mm, direct", replace(narrow, homogenise=HomogeniseSpec()), seeds)
    _row("±60 mm, Duym", replace(spec, homogenise=HomogeniseSpec(method="duym")), seeds, goal=None)
    _row("±60 mm, direct over what is reached", replace(spec, homogenise=HomogeniseSpec(range="reached")), seeds, None)


def lagging(spec: MultisineSpec, seeds: int) -> None:
    """A first-order rig of 50 Hz for displacement and current, unknown and known to the design."""
    known = replace(spec, response=LAG, homogenise=HomogeniseSpec())
    _row("50 Hz rig, known", known, seeds)
    phases = [homogenised(replace(spec, seed=seed, homogenise=HomogeniseSpec())) for seed in range(seeds)]
    index = []
    for seed, period in enumerate(phases):
        behind = fit_into_limits(replace(spec, response=LAG, seed=seed), period.displacement, period.current)
        index.append(_figures(replace(spec, response=LAG, seed=seed), behind)["coverage_at_damper"])
    print(f"50 Hz rig, unknown: D at the damper {statistics.median(index):.3g} % (median)", flush=True)


def long(spec: MultisineSpec) -> None:
    """Time of every method at 2^18 and 2^21 samples; eight times as many take eight times as long."""
    methods = {
        "random phases": {},
        "Schroeder's phases": {"phases": "schroeder"},
        "crest factor of all limits": {"phases": "crest"},
        "crest factor of the velocity": {"phases": "crest", "crest_of": "velocity"},
        "Duym": {"homogenise": HomogeniseSpec(method="duym")},
        "direct": {"homogenise": HomogeniseSpec()},
    }
    for name, change in methods.items():
        worked_before = 0.0
        for power in (18, 21):
            sized = replace(spec, period_samples=2**power, seed=1000, **change)  # type: ignore[arg-type]
            start, worked = time.perf_counter(), time.process_time()
            period = random_phase(sized) if sized.homogenise is None else homogenised(sized)
            elapsed, worked = time.perf_counter() - start, time.process_time() - worked
            goal = f"   goal ≤ 30 s: {'met' if elapsed <= 30.0 else 'MISSED'}" if power == 21 else ""
            index = _figures(sized, period).get("coverage_achievable")
            told = "" if index is None or sized.homogenise is None else f", D {index:.3g} %"
            times = f", {worked / worked_before:.1f} times as long as 2^18" if worked_before else ""
            print(
                f"2^{power} samples, {name}: {elapsed:.1f} s ({worked:.1f} s of processor{times}; load of the machine "
                f"{os.getloadavg()[0]:.1f} on {os.cpu_count()}){told}{goal}",
                flush=True,
            )
            worked_before = worked


def _figures(spec: MultisineSpec, period: Any) -> dict[str, Any]:  # Any: a Period, figures as JSON
    return dict(as_excitation(spec, period, "homogenised").figures)


def _row(what: str, spec: MultisineSpec, seeds: int, goal: float | None = GOAL) -> None:
    made, seconds = [], []
    for seed in range(seeds):
        asked, start = replace(spec, seed=seed), time.perf_counter()
        made.append(_figures(asked, homogenised(asked)))
        seconds.append(time.perf_counter() - start)
    index = [one["coverage_achievable"] for one in made]
    reach = ", ".join(
        f"{name} {ends[0]:.3g} … {ends[1]:.3g}"
        for name, ends in made[0]["achievable_range"].items()
        if name != "ellipse"
    )
    over = [one["coverage_asked"] for one in made if "coverage_asked" in one]
    asked_text = (
        f", asked {statistics.median(over):.3g} % (even: {made[0]['coverage_asked_even']:.3g} %)" if over else ""
    )
    verdict = (
        ""
        if goal is None
        else f"   goal ≤ {goal:g} %: " + ("met" if max(index) <= goal else f"MISSED, gap {max(index) - goal:.2g} %")
    )
    print(
        f"{what}: D {statistics.median(index):.3g} % median, {max(index):.3g} % worst of {seeds} on {reach}"
        f"{asked_text}, {statistics.median(seconds):.2g} s{verdict}",
        flush=True,
    )


if __name__ == "__main__":
    main()
