"""An inverse that was learned, in words and as plain numbers: the same for the command line and the service."""

from __future__ import annotations

from typing import Any

from identification.inverse.identify import IdentifiedInverse
from identification.inverse.tracking import tracking_data


def inverse_text(result: IdentifiedInverse) -> str:
    """The fit of the current, what was chosen, and the tracking of every run."""
    limits = result.model.limits
    lines = [
        f"fit of the current {result.predicted:.2f} % predicted, [{limits.low:g}, {limits.high:g}] A",
        f"  {result.best}; forward model: {result.model.forward.kind}",
    ]
    for name, one in result.learned.items():
        lines.append(
            f"  {name}: measured force tracked with a fit of {one.fit:.2f} %, by inversion of the forward model "
            f"{result.inverted[name].fit:.2f} %; {100.0 * one.share_cannot:.3g} % of the samples cannot be made"
        )
        lines += [f"  {sentence}" for sentence in one.beyond]
    return "\n".join(lines)


def inverse_data(result: IdentifiedInverse) -> dict[str, Any]:  # Any: JSON
    """All figures; fits in %, currents in A."""
    return {
        "fit_current_predicted": result.predicted,
        "limits": [result.model.limits.low, result.model.limits.high],
        "forward": result.model.forward.kind,
        "candidate": result.best,
        "tracked": [tracking_data(one) for one in result.learned.values()],
        "by_forward": [tracking_data(one) for one in result.inverted.values()],
    }
