"""The next test: of many that the rig has room for, the one on which the best explanation and its rival differ most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.plan import test_from_config
from identification.discrepancy.explanation import NextTest
from identification.discrepancy.naming import Search
from identification.discrepancy.signatures import orthonormal
from identification.discrepancy.trials import Trial
from identification.errors import SimulationError
from identification.fitting.leastsquares import evaluate, free_parameters, predict
from identification.physical.elements import CATALOGUE
from identification.physical.model import Model
from identification.record import Record, compact, record_from_run
from rigctl.runfile import Run

Floats = NDArray[np.float64]


def propose(found: Search, records: Sequence[Record]) -> NextTest:
    """The design, within the motion that the rig has shown, that splits the best two explanations.

    Its worth is ‖(I − QQᵀ)(F_a − F_b)‖ over the data there are and the new run, whitened: the difference that no refit
    of the rival could absorb (T-optimality, Atkinson & Fedorov, 1975).
    """
    rivals = _rivals(found)
    if len(rivals) < 2:
        return NextTest()
    best, rival = rivals[0], rivals[1]
    worth = []
    for config in library(records):
        try:
            worth.append((_worth(best.fit.model, rival.fit.model, records, config), config))
        except SimulationError:
            continue
    if not worth:
        return NextTest()
    value, config = max(worth, key=lambda pair: pair[0])
    titles = f"{CATALOGUE[best.name].title} from {CATALOGUE[rival.name].title}"
    return NextTest(
        text=f"{_words(config)} tells {titles} best: there they differ by {value:.2g} × the noise after any refit",
        design=config,
    )


def _rivals(found: Search) -> list[Trial]:
    adds = [m for m in found.moves if m.rivals]
    if not adds:
        return []
    return sorted(adds[-1].rivals, key=lambda t: t.excess)[:2]


def library(records: Sequence[Record]) -> list[Mapping[str, Any]]:
    """Tests that keep within the stroke, speed and current that the records have reached."""
    rate = 1.0 / min(r.dt for r in records)
    stroke = 0.5 * max(float(np.ptp(r.motion.x[r.window])) for r in records)
    speed = max(float(np.max(np.abs(r.motion.v[r.window]))) for r in records)
    currents = [c for r in records if r.has_current for c in (r.motion.i[r.window].min(), r.motion.i[r.window].max())]
    levels: list[float | None] = [None] if not currents else [float(min(currents)), float(max(currents))]
    designs: list[Mapping[str, Any]] = []
    for part in (0.15, 0.5, 1.0):
        top = speed / (2.0 * np.pi * part * stroke)
        for fraction in (0.03, 0.2, 0.95):
            frequency = min(fraction * top, rate / 20.0)
            for level in levels:
                designs.append(_design("sine", rate, part * stroke, frequency, level))
                designs.append(_design("triangle", rate, part * stroke, 0.6 * frequency, level))
    if len(levels) == 2 and levels[0] is not None and levels[1] is not None:
        steps = [float(q) for q in np.linspace(levels[0], levels[1], 4)]
        designs += [
            {
                "name": "next", "kind": "steps", "sample_rate": rate, "amplitude": 0.7 * stroke,
                "frequency": 0.3 * speed / (2 * np.pi * 0.7 * stroke), "cycles": 12,
                "levels": [steps[0], steps[2], steps[1], steps[3]], "step_time": 0.5, "seed": 1,
            }
        ]  # fmt: skip
    return designs


def _design(kind: str, rate: float, amplitude: float, frequency: float, level: float | None) -> dict[str, Any]:
    config: dict[str, Any] = {
        "name": "next",
        "kind": kind,
        "sample_rate": rate,
        "amplitude": float(f"{amplitude:.4g}"),
        "frequency": float(f"{frequency:.4g}"),
        "cycles": int(np.clip(np.ceil(10.0 * frequency), 4, 60)),
        "settling_cycles": 2,
    }
    if level is not None:
        config["current"] = float(f"{level:.4g}")
    return config


def _worth(best: Model, rival: Model, records: Sequence[Record], config: Mapping[str, Any]) -> float:
    """Whitened difference on the new run that a refit of the rival to everything could not absorb, per sample."""
    new = _imagined(config, records)
    both = [*records, new]
    free = free_parameters(rival, both)
    here = evaluate(rival, both, free)
    basis = orthonormal(np.concatenate([g / r.sigma for g, r in zip(here.gradients, both, strict=True)]))
    apart = [(predict(best, r)[0] - predict(rival, r)[0]) / r.sigma for r in both]
    stacked = np.concatenate(apart)
    left = stacked - basis @ (basis.T @ stacked)
    return float(np.sqrt(np.mean(left[-apart[-1].size :] ** 2)))


def _imagined(config: Mapping[str, Any], records: Sequence[Record]) -> Record:
    """The record that a run of the design would give, without its force."""
    excitation = test_from_config(dict(config)).excitation
    n = excitation.samples
    zeros = np.zeros(n)
    channels = {"displacement": excitation.displacement_m, "force": np.sin(np.arange(n))}
    channels["current"] = excitation.current_a if excitation.current_a is not None else zeros
    units = {"displacement": "m", "force": "N", "current": "A"}
    record = record_from_run(
        Run(
            run_id="next", created="2000-01-01T00:00:00+00:00", specimen="", sample_rate_hz=excitation.sample_rate_hz,
            period_samples=excitation.period_samples, excitation_kind=str(excitation.kind), status="complete",
            channels=channels, units=units, design=None, events=(), path=None,
        )
    )  # fmt: skip
    noise = float(np.median([r.sigma for r in records]))
    return replace(compact(record), sigma=noise)


def _words(config: Mapping[str, Any]) -> str:
    current = f" at {config['current']:.3g} A" if "current" in config else ""
    shape = {"sine": "a sine", "triangle": "a triangle", "steps": "current steps under a sine"}[str(config["kind"])]
    return f"{shape} of {1e3 * config['amplitude']:.3g} mm at {config['frequency']:.3g} Hz{current}"
