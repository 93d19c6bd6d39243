"""Checks of runs and model before the workflow starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.criteria import FORM
from identification.errors import DataError
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record
from rigctl.runfile import Run

Floats = NDArray[np.float64]


def check_runs(runs: Sequence[Run]) -> None:
    """Raise DataError when runs are missing, doubled, or of different specimens."""
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    specimens = {r.specimen: _label(r) for r in reversed(runs)}
    if len(specimens) > 1:
        named = ", ".join(f"'{s}' ({label})" for s, label in sorted(specimens.items()))
        raise DataError(f"runs of different specimens are mixed: {named}; explain one specimen at a time")
    seen: dict[str, str] = {}
    for run in runs:
        if run.run_id in seen:
            raise DataError(f"{_label(run)} is the same run as {seen[run.run_id]}: give each run once")
        seen[run.run_id] = _label(run)


def check_model(model: Model, records: Sequence[Record]) -> None:
    """Raise DataError or SimulationError when the model can't run on a record, or where signs are reversed."""
    for r in records:
        if any(e.spec.needs_current for e in model.elements) and not r.has_current:
            needs = next(e.name for e in model.elements if e.spec.needs_current)
            raise DataError(
                f"{r.name} has no control current, which '{needs}' of the model needs: record it or leave it out"
            )
    senses = [_sense_of(model, r) for r in records]
    _check_polarity(senses)
    upright = any(s.agrees > FORM.minor for s in senses)
    for s in senses:
        if s.agrees >= -FORM.minor:
            continue  # about a quarter of a period apart: one of them is late rather than reversed
        if s.measured < -FORM.minor and s.simulated > FORM.minor:
            raise DataError(
                f"{s.name}: the measured force works with the motion (correlation {s.measured:.2f}), the simulated one "
                "against it: the sign of force or displacement is reversed; extension and tension are positive"
            )
        one_sign = upright and not s.foreign  # in all runs: the model is wrong at the current or the speed of this one
        if s.simulated < -FORM.minor and s.measured > FORM.minor and not one_sign:
            raise DataError(
                f"{s.name}: the simulated force works with the motion (correlation {s.simulated:.2f}), the measured "
                "one against it: the sign of the simulated force is reversed; tension is positive"
            )
        if s.spring < -FORM.minor and s.simulated_spring > FORM.minor:
            raise DataError(
                f"{s.name}: the measured force falls as the displacement rises (correlation {s.spring:.2f}), the "
                "simulated one rises: the sign of force or displacement is reversed; extension and tension are positive"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sense:
    """The senses in which the forces of a record act, as correlations, -1 to 1."""

    name: str
    measured: float  # force and velocity, positive where the specimen absorbs energy
    simulated: float  # the same of the simulated force
    spring: float  # force and the displacement beyond what velocity and acceleration tell, positive for a spring
    simulated_spring: float
    agrees: float  # both forces
    foreign: bool  # the simulated one is a channel of the record


def _sense_of(model: Model, r: Record) -> _Sense:
    velocity, simulated = r.motion.v[r.window], predict(model, r)[0]
    place = _place_alone(r)
    return _Sense(
        name=r.name,
        measured=_correlation(velocity, r.measured),
        simulated=_correlation(velocity, simulated),
        spring=_correlation(place, r.measured),
        simulated_spring=_correlation(place, simulated),
        agrees=_correlation(r.measured, simulated),
        foreign=r.simulated is not None,
    )


def _place_alone(r: Record) -> Floats:
    """Displacement less what follows from velocity and acceleration, (N,), m: zero where that is nearly all of it.

    A mass presses like a spring that is upside down: in one sine the two are the same.
    """
    x, v, a = (c[r.window] - np.mean(c[r.window]) for c in (r.motion.x, r.motion.v, r.motion.a))
    others = np.stack([v, a], axis=1) / np.maximum([np.std(v), np.std(a)], np.finfo(float).tiny)
    alone = x - others @ np.linalg.lstsq(others, x, rcond=None)[0]
    return alone if np.std(alone) > FORM.minor * np.std(x) else np.zeros_like(x)


def _check_polarity(senses: Sequence[_Sense]) -> None:
    """Raise DataError where one record works with the motion, others against it, and the model does not say why.

    Beside a mass a sensor that is late by a twentieth of a period does that: the model knows the mass, and its force is
    nowhere the opposite of the measured one, as far as it resembles it in the other records.
    """
    right = [s for s in senses if s.measured > FORM.minor]
    resembled = any(s.agrees > FORM.minor for s in right)
    for s in senses:
        if right and s.measured < -FORM.minor and (s.agrees < -FORM.minor or not resembled):
            raise DataError(
                f"{s.name}: force works with the motion (correlation {s.measured:.2f}), in other runs against it: "
                "the sign of force or displacement is reversed in one of them; extension and tension are positive"
            )


def _correlation(v: Floats, f: Floats) -> float:
    v, f = v - v.mean(), f - f.mean()
    scale = float(np.linalg.norm(v) * np.linalg.norm(f))
    return float(v @ f) / scale if scale > 0.0 else 0.0


def _label(run: Run) -> str:
    return run.path.name if run.path is not None else run.run_id
