"""Checks of runs and model before the workflow starts."""

from __future__ import annotations

from collections.abc import Sequence

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
    """Raise DataError when runs are missing, doubled, of different specimens, or of mixed polarity."""
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
    work = {_label(run): _work(run) for run in runs}
    against = {label: w for label, w in work.items() if w < -FORM.minor}
    if against and any(w > FORM.minor for w in work.values()):
        label, w = min(against.items(), key=lambda item: item[1])
        raise DataError(
            f"{label}: force works with the motion (correlation {w:.2f}), in other runs against it: "
            "the sign of force or displacement is reversed in one of them; extension and tension are positive"
        )


def _work(run: Run) -> float:
    """Correlation of force and velocity, −1 … 1: positive where the specimen absorbs energy."""
    x, force = run.channels.get("displacement"), run.channels.get("force")
    if x is None or force is None or x.size < 3:
        return 0.0
    return _correlation(np.gradient(x), force)


def check_model(model: Model, records: Sequence[Record]) -> None:
    """Raise DataError or SimulationError when the model can't run on a record."""
    for r in records:
        if any(e.spec.needs_current for e in model.elements) and not r.has_current:
            needs = next(e.name for e in model.elements if e.spec.needs_current)
            raise DataError(
                f"{r.name} has no control current, which '{needs}' of the model needs: record it or leave it out"
            )
        simulated = predict(model, r)[0]
        velocity = r.motion.v[r.window]
        measured, expected = (_correlation(velocity, f) for f in (r.measured, simulated))
        if measured < -FORM.minor and expected > FORM.minor:
            raise DataError(
                f"{r.name}: the measured force works with the motion (correlation {measured:.2f}), the simulated one "
                "against it: the sign of force or displacement is reversed; extension and tension are positive"
            )
        if expected < -FORM.minor and measured > FORM.minor:
            raise DataError(
                f"{r.name}: the simulated force works with the motion (correlation {expected:.2f}), the measured one "
                "against it: the sign of the simulated force is reversed; tension is positive"
            )


def _correlation(v: Floats, f: Floats) -> float:
    v, f = v - v.mean(), f - f.mean()
    scale = float(np.linalg.norm(v) * np.linalg.norm(f))
    return float(v @ f) / scale if scale > 0.0 else 0.0


def _label(run: Run) -> str:
    return run.path.name if run.path is not None else run.run_id
