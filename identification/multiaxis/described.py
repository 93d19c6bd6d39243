"""A model of several axes that was identified, in words and as plain numbers."""

from __future__ import annotations

from math import isfinite
from typing import Any

from identification.multiaxis.axes import unit_of
from identification.multiaxis.identify import IdentifiedAxes


def axes_text(result: IdentifiedAxes) -> str:
    """How it was learned, each load with its axes and fits, and where superposition fails."""
    model = result.model
    how = "runs of several axes" if result.summed is None else f"the sum of {result.summed} tests of single axes"
    base = "without a base" if model.base is None else f"base of the main axis: {model.base.model.name}"
    lines = [f"learned from {how}, {base}; fit in free run, predicted, training" + _heads(result)]
    for name, load in model.loads.items():
        held_out = "".join(f", {fits[name]:.2f} %" for fits in result.shown.values())
        lines.append(
            f"  {name} from {', '.join(load.axes)}: {result.predicted[name]:.2f} %, {result.trained[name]:.2f} %"
            f"{held_out}"
        )
    lines += [
        f"  {axis} is held in all runs, but for noise of {noise:.3g} {unit_of(axis)}: no load depends on it"
        for axis, noise in result.held.items()
    ]
    lines += [
        f"  {run} moves {axis}, which no run of the training moves: its loads are not to be trusted there"
        for run, axes in result.untried.items()
        for axis in axes
    ]
    for run, found in result.checks.items():
        lines += [f"  {run}: {sentence}" for sentence in found.described() or ["the single tests add up"]]
    lines += [f"  {run}: {sentence}" for run, sentences in result.beyond.items() for sentence in sentences]
    return "\n".join(lines)


def axes_data(result: IdentifiedAxes) -> dict[str, Any]:  # Any: JSON
    """All figures; fits in %, shares of the rms of each load."""
    model = result.model
    return {
        "axes": {name: list(load.axes) for name, load in model.loads.items()},
        "correlations": {load: dict(axes) for load, axes in model.correlations.items()},
        "base": None if model.base is None else model.base.model.name,
        "superposed": result.summed,
        "held": dict(result.held),
        "held_but_moved": {run: list(axes) for run, axes in result.untried.items() if axes},
        "fit_predicted": _finite(result.predicted),
        "fit_trained": _finite(result.trained),
        "fit_held_out": {run: _finite(fits) for run, fits in result.shown.items()},
        "missed_by_superposition": {run: _finite(found.missed) for run, found in result.checks.items()},
        "superposition_fails": {run: list(found.failing) for run, found in result.checks.items()},
        "outside_training": {run: dict(shares) for run, shares in result.outside.items() if shares},
    }


def _heads(result: IdentifiedAxes) -> str:
    return "".join(f", {run}" for run in result.shown)


def _finite(values: Any) -> dict[str, float | None]:  # Any: a mapping of numbers
    return {name: value if isfinite(value) else None for name, value in values.items()}
