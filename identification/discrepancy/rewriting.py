"""How far the base's own curves moved to make room for what was named."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from identification.discrepancy.naming import Search
from identification.errors import SimulationError
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record


def rewritten(found: Search, records: Sequence[Record]) -> float:
    """How far the base's own curves moved from the given ones to make room for the names, as a share of its force,
    of the given or the fitted, whichever is larger.

    Given values may be off by a third. A curve beside which the base's own becomes another one has replaced it: the
    base may be of the wrong family, and nothing is missing.
    """
    base = found.fit.model
    for name in found.names:
        base = base.without(name)
    given, now = _curves_of(found.given), _curves_of(base)
    if given is None or now is None:
        return 0.0
    moved = was = became = 0.0
    for r in records:
        with suppress(SimulationError):
            change, old, new = (
                predict(now, r)[0] - predict(given, r)[0],
                predict(found.given, r)[0],
                predict(base, r)[0],
            )
            moved += float(np.sum(change**2)) / r.sigma**2
            was += float(np.sum(old**2)) / r.sigma**2
            became += float(np.sum(new**2)) / r.sigma**2
    return float(np.sqrt(moved / max(was, became))) if was > 0.0 else 0.0


def _curves_of(model: Model) -> Model | None:
    """The model less the springs and masses beside its curves over velocity; None without such curves."""
    curves = [e for e in model.on("core") if e.spec.carries]
    beside = [e for e in model.elements if e.spec.path in ("mount", "control") or e.spec.modifier]
    return replace(model, elements=(*beside, *curves)) if curves else None
