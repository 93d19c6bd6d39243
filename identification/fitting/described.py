"""A fit in words and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from types import MappingProxyType
from typing import Any, Final

from identification.fitting.advice import warnings
from identification.fitting.leastsquares import Fit

__all__ = ["Intervals", "fit_data", "fit_text"]

Intervals = Mapping[str, tuple[float, float]]  # of 68 %, by the name of the parameter
_NONE: Final[Intervals] = MappingProxyType({})


def fit_data(result: Fit, intervals: Intervals = _NONE) -> dict[str, Any]:
    """What `damper-rig fit --json` prints beside the file; an end of an interval that is not finite is None."""
    return {
        "gap": {"value": result.rms, "unit": "N"},
        "converged": result.converged,
        "reason": result.reason,
        "iterations": result.iterations,
        "warnings": warnings(result),
        "intervals": {name: [e if isfinite(e) else None for e in ends] for name, ends in intervals.items()},
        "parameters": {
            f"{element.id}.{element.spec.parameters[k].name}": {
                "value": element.parameters[k].value,
                "std": element.parameters[k].std,
                "unit": element.spec.parameters[k].unit,
                "fixed": element.parameters[k].fixed,
            }
            for element, k in result.model.slots()
        },
    }


def fit_text(result: Fit, intervals: Intervals = _NONE) -> str:
    """The gap, the parameters with their standard deviations, and the warnings, a line each."""
    figures = fit_data(result, intervals)
    lines = [f"gap {result.rms:.4g} N rms after {result.iterations} iterations"]
    if not result.converged:
        lines[0] += f", not converged: {result.reason}"
    for name, entry in figures["parameters"].items():
        spread = "fixed" if entry["fixed"] else "" if entry["std"] is None else f"± {entry['std']:.2g}"
        lines.append(f"  {name:<36} {entry['value']:>12.5g} {entry['unit']:<10} {spread}".rstrip())
    lines += [f"  {name}: 68 % within {low:.5g} … {high:.5g}" for name, (low, high) in intervals.items()]
    return "\n".join([*lines, *(f"  {sentence}" for sentence in figures["warnings"])])
