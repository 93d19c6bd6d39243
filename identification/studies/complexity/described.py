"""A complexity study in words and as JSON."""

from __future__ import annotations

import math
from typing import Any

from excitation.toml_text import toml_text
from identification.physical.modelfile import model_to_json
from identification.studies.complexity.result import Complexity, Indicator, Rung, Verdict


def in_short(found: Complexity) -> str:
    """The answer in a few sentences."""
    more = [f"{one.element} ({one.step})" for one in found.indicators if one.verdict is Verdict.MEASURE]
    said = f"Measure more for {', '.join(more)}. " if more else "The tests leave nothing uncertain that matters here. "
    if found.dropped:
        said += f"{', '.join(found.dropped)} can be left out: no step changes by {100.0 * found.matters:g} % or more. "
    else:
        said += "Nothing can be left out. "
    knee = found.knee
    return said + ("The ladder has no knee." if knee is None else f"The knee of the ladder is {knee.label}.")


def advice(one: Indicator) -> str:
    """What the step says about the element."""
    return f"{one.verdict.value}: {one.test}" if one.test else one.verdict.value


def plan_of_tests(found: Complexity) -> str:
    """The designed tests as a plan for `damper-rig design`; empty where there is none."""
    return toml_text({"tests": [dict(one.config) for one in found.designed]}) if found.designed else ""


def complexity_text(found: Complexity) -> str:
    """What a terminal shows."""
    lines = [in_short(found), f"Uncertainty from {found.spread}; change of the output in %:"]
    for one in found.indicators:
        gone = "–" if one.without is None else f"{100.0 * one.without:.3g}"
        what = f" ({one.parameter})" if one.parameter else ""
        size = f"{100.0 * one.uncertain:.3g}{what}"
        lines.append(f"  {one.step}: {one.element:24s} uncertain {size}, without it {gone}: {advice(one)}")
    lines.append("Ladder: error, cost of a simulated second, free parameters")
    for rung in (*found.ladder, *found.beside):
        error = "fails" if rung.rrmsse is None else f"{rung.rrmsse:.3g} %"
        cost = "–" if rung.cost is None else f"{1e6 * rung.cost:.3g} µs"
        lines.append(f"  {rung.label:50s} {error:>9s} {cost:>9s} {'–' if rung.free is None else rung.free}")
    return "\n".join(lines)


def complexity_data(found: Complexity) -> dict[str, Any]:  # Any: JSON
    """The study as JSON, SI; shares of the output, error in %."""
    return {
        "study": "complexity",
        "steps": list(found.steps),
        "matters": found.matters,
        "uncertainty": found.spread,
        "indicators": [
            {
                "step": one.step, "element": one.element, "uncertain": one.uncertain, "parameter": one.parameter,
                "without": _finite(one.without), "verdict": one.verdict.value, "test": one.test,
            }
            for one in found.indicators
        ],
        "tests": [{"parameter": one.parameter, "left": one.left, "test": dict(one.config)} for one in found.designed],
        "dropped": list(found.dropped),
        "ladder": [_rung(rung) for rung in found.ladder],
        "beside": [_rung(rung) for rung in found.beside],
        "knee": None if found.knee is None else found.knee.label,
        "simplified": model_to_json(found.simplified),
    }  # fmt: skip


def _rung(rung: Rung) -> dict[str, Any]:
    return {
        "label": rung.label, "kind": rung.kind, "free": rung.free, "rrmsse": rung.rrmsse, "cost_s": rung.cost,
        "outputs": [_finite(one) for one in rung.outputs], "why": rung.why,
    }  # fmt: skip


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
