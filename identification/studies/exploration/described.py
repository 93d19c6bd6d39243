"""An exploration in words and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from excitation.configuration import to_config
from identification.studies.exploration.result import CRITERIA, Explored


def in_short(found: Explored) -> str:
    """The answer in one or two sentences."""
    count, total = int(found.feasible.sum()), len(found.samples)
    limit, allowed = found.binding(), found.asked.limits.row()
    name, bound = CRITERIA[limit], f"±{100.0 * allowed[limit]:g} %"
    reached = found.reached()
    if reached is None:
        near = found.nearest()
        test, off = found.worst_test(limit, near), 100.0 * found.worst[near, limit]
        without = int(found.without_limit()[limit])
        return (
            f"No sample of {total} meets the limits. The {name} limit ({bound}) empties the set: the nearest sample is "
            f"off by {off:.3g} % in {test.name}; without that limit {without} would be feasible."
        )
    return (
        f"{count} of {total} samples are feasible ({100.0 * count / total:.3g} %). The {name} limit ({bound}) binds: "
        f"the set reaches {100.0 * reached[limit]:.3g} %, and without that limit {found.without_limit()[limit]} would "
        "be feasible."
    )


def explored_text(found: Explored) -> str:
    """What a terminal shows."""
    lines = [in_short(found), "limit: allowed, reached in the feasible set, rejected by it alone"]
    reached, alone = found.reached(), found.without_limit() - int(found.feasible.sum())
    for k, name in enumerate(CRITERIA):
        top = "–" if reached is None else f"{100.0 * reached[k]:.3g} %"
        lines.append(f"  {name:18s} ±{100.0 * found.asked.limits.row()[k]:g} %  {top:>8s}  {alone[k]}")
    kept = found.samples[found.feasible]
    for k, name in enumerate(found.names):
        low_high = f"{kept[:, k].min():.4g} … {kept[:, k].max():.4g}" if len(kept) else "no feasible value"
        lines.append(f"  {name:28s} start {found.start[k]:.4g}, feasible {low_high}")
    if found.left_out:
        lines.append(f"left out, no steady sine: {', '.join(found.left_out)}")
    return "\n".join(lines)


def explored_data(found: Explored) -> dict[str, Any]:  # Any: JSON
    """The exploration as JSON, SI, angles in rad; `feasible_set` holds a row of parameters for each feasible sample."""
    reached, feasible = found.reached(), found.feasible
    kept = found.samples[feasible]
    correlations = found.correlations()
    alone = found.without_limit() - int(feasible.sum())
    criteria = {
        name: {
            "allowed": float(found.asked.limits.row()[k]),
            "reached": None if reached is None else float(reached[k]),
            "rejected_by_it_alone": int(alone[k]),
            "samples_within": int(found.within[:, k].sum()),
        }
        for k, name in enumerate(CRITERIA)
    }
    parameters = [
        {
            "name": name,
            "start": float(found.start[k]),
            "feasible": [float(kept[:, k].min()), float(kept[:, k].max())] if len(kept) else None,
            "effect_on": dict(zip(CRITERIA, map(float, found.effects()[k]), strict=True)),
        }
        for k, name in enumerate(found.names)
    ]
    near = found.nearest()
    return {
        "study": "exploration",
        "model": found.model,
        "asked": to_config(found.asked),
        "samples": len(found.samples),
        "feasible": int(feasible.sum()),
        "binding_limit": CRITERIA[found.binding()],
        "limits": criteria,
        "parameters": parameters,
        "correlations": None if correlations is None else np.round(correlations, 6).tolist(),
        "nearest": {"parameters": found.samples[near].tolist(), "worst": _finite(found.worst[near])},
        "tests": [
            {
                "name": test.name, "frequency_hz": test.frequency_hz, "amplitude_m": test.amplitude_m,
                "measured": test.measured.tolist(),
            }
            for test in found.tests
        ],
        "left_out": list(found.left_out),
        "feasible_set": kept.tolist(),
    }  # fmt: skip


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]
