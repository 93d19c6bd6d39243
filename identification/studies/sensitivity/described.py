"""A sensitivity study in words and as JSON."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from excitation.configuration import to_config
from identification.studies.sensitivity.result import FIRST, GARSON, TOTAL, Sensitive

_SPREAD = 5.0  # percentage points between networks, from which the share of one network is called uncertain
_SIGMAS = 2.0  # of a difference between mean shares, from which it counts as one
_APART = 5.0  # percentage points between Garson and the variance, from which they are said to differ


def in_short(found: Sensitive) -> str:
    """The answer in one sentence: ≈ between parameters whose shares the networks do not tell apart."""
    means, count = found.garson.mean(axis=0), len(found.networks)
    of_mean = found.garson.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.zeros_like(means)
    order = np.argsort(-means, kind="stable")
    said = found.names[order[0]]
    for before, k in pairwise(order):
        clear = means[before] - means[k] > _SIGMAS * float(np.hypot(of_mean[before], of_mean[k]))
        said += f"{' > ' if clear else ' ≈ '}{found.names[k]}"
    return f"Influence on the force by Garson's shares: {said}."


def cautions(found: Sensitive) -> list[str]:
    """Where Garson's shares mislead here, and in general."""
    shares, spread = found.shares(), 100.0 * np.ptp(found.garson, axis=0)
    said = [
        "Garson's shares add magnitudes of weights: contributions that cancel between nodes count as influence, and no "
        "input gets a share of 0. They describe the network, in the scale of its inputs, not the model."
    ]
    worst = int(np.argmax(spread))
    if len(found.networks) > 1 and spread[worst] > _SPREAD:
        said.append(
            f"Networks that fit equally well differ by {spread[worst]:.0f} percentage points in the share of "
            f"{found.names[worst]}: one network alone proves no order of near shares."
        )
    apart = np.abs(shares[GARSON] - shares[TOTAL])
    far = int(np.argmax(apart))
    if apart[far] > _APART:
        said.append(
            f"{found.names[far]}: {shares[GARSON][far]:.1f} % by Garson, {shares[TOTAL][far]:.1f} % by variance. "
            "Variance squares the effect, so that the greatest parameter takes more, and it counts the whole box."
        )
    if found.order(GARSON) != found.order(TOTAL):
        said.append(f"By variance the order is {', '.join(found.order(TOTAL))}.")
    if found.interaction > 0.1:
        said.append(
            f"{100.0 * found.interaction:.0f} % of the variance belongs to no parameter alone: the effect of one "
            "depends on the values of others."
        )
    return said


def sensitivity_text(found: Sensitive) -> str:
    """What a terminal shows."""
    shares = found.shares()
    lines = [in_short(found), "share in %: " + ", ".join(shares)]
    for k, name in enumerate(found.names):
        lines.append(f"  {name:30s}" + "  ".join(f"{part[k]:7.3g}" for part in shares.values()))
    within = min(one.within for one in found.networks)
    lines.append(f"{100.0 * within:.1f} % of the unseen samples or more are within 5 % of the change by every network")
    return "\n".join(lines + cautions(found))


def sensitivity_data(found: Sensitive) -> dict[str, Any]:  # Any: JSON
    """The study as JSON, SI; shares in %."""
    shares = found.shares()
    return {
        "study": "sensitivity",
        "model": found.model,
        "asked": to_config(found.asked),
        "samples": int(found.changes.size),
        "parameters": [
            {
                "name": name,
                "value": float(found.values[k]),
                "shares": {method: float(part[k]) for method, part in shares.items()},
                "garson_of_networks": [float(100.0 * v) for v in found.garson[:, k]],
                "first_order": float(found.first[k]),
                "total_order": float(found.total[k]),
                "change_alone_n": float(found.alone[k]),
                "slope_n": float(found.slopes[k]),
            }
            for k, name in enumerate(found.names)
        ],
        "orders": {method: found.order(method) for method in (GARSON, TOTAL, FIRST)},
        "unseen_within_5_percent": [one.within for one in found.networks],
        "interaction": found.interaction,
        "cautions": cautions(found),
    }
