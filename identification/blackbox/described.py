"""What was identified, in words and as plain numbers: the same for the command line and for notebooks."""

from __future__ import annotations

from typing import Any

from identification.blackbox.identify import Identified
from identification.blackbox.search import Search
from identification.blackbox.selection import Tried


def identified_text(result: Identified) -> str:
    """The fit that is expected and that of the training, the structure, held-out runs, and the memory."""
    model = result.model
    lines = [
        f"fit in free run {result.predicted:.2f} % by cross-validation, {result.trained:.2f} % in training",
        f"  {result.judged[0].candidate}; {len(model.names())} parameters",
    ]
    if "share_of_base" in model.facts:
        lines.append(
            f"  the base alone explains {100.0 * model.facts['share_of_base']:.1f} % of the variance of the force"
        )
    lines.append(f"  its band of 90 % holds {100.0 * result.coverage:.1f} % in cross-validation")
    lines += [
        f"  held out {name}: fit {fit:.2f} %, the band holds {100.0 * result.reached[name]:.1f} %"
        for name, fit in result.shown.items()
    ]
    lines += [f"  {sentence}" for sentence in (*result.beyond, *result.notes)]
    forgets = f"forgets its start within {result.memory_s:.2g} s" if result.stable else "never forgets its start"
    return "\n".join([*lines, f"  a free run {forgets}"])


def identified_data(result: Identified) -> dict[str, Any]:  # Any: JSON
    """All figures; fits in %, the memory in s."""
    return {
        "fit_predicted": result.predicted,
        "fit_trained": result.trained,
        "fit_held_out": dict(result.shown),
        "coverage_90_predicted": result.coverage,
        "coverage_90_held_out": dict(result.reached),
        "outside_training": list(result.beyond),
        "notes": list(result.notes),
        "share_of_base": result.model.facts.get("share_of_base"),
        "stable": result.stable,
        "memory_s": result.memory_s if result.stable else None,
        "weights": len(result.model.names()),
        "candidates": [
            {
                "regressors": [str(one) for one in judged.candidate.structure.regressors],
                "candidate": str(judged.candidate),
                "fit": judged.fit,
            }
            for judged in result.judged
        ],
    }


def search_text(found: Search) -> str:
    """The path, and the error without each signal, a line each."""
    lines = [f"  regressors of {found.trained} structures, error in free run on the training:"]
    lines += [f"    {step.act:8s} {step.tried.rrmsse:7.2f} %  {_names(step.tried)}" for step in found.path]
    lines += [f"    without {symbol} {one.rrmsse:6.2f} %" for symbol, one in found.without.items()]
    return "\n".join(lines)


def search_data(found: Search) -> dict[str, Any]:  # Any: JSON
    """The same as data."""
    return {
        "structures": found.trained,
        "path": [
            {
                "act": step.act,
                "regressors": _names(step.tried).split(),
                "rrmsse": step.tried.rrmsse,
                "tried": step.count,
            }
            for step in found.path
        ],
        "without_each": {
            symbol: {"regressors": _names(one).split(), "rrmsse": one.rrmsse} for symbol, one in found.without.items()
        },
    }


def _names(tried: Tried) -> str:
    return " ".join(map(str, tried.structure.regressors))
