"""What a named effect looks like: the force it adds, over the variable that shows it best, beside its best rival's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.discrepancy.explanation import Explanation
from identification.discrepancy.naming import Compared
from identification.discrepancy.where import variables
from identification.errors import SimulationError
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record, compact
from identification.report.page_data import Shape

Floats = NDArray[np.float64]

_BINS = 40
_FEW = 20  # samples: a mean of fewer is left out


def shapes(e: Explanation) -> list[Shape]:
    """The shape of every name, on the training runs."""
    records = [compact(t.record) for t in e.traces if not t.held_out]
    final = _force(e.model, records)
    return [_shape(name, compared, set(e.compared), final, records) for name, compared in e.compared.items()]


def _shape(name: str, compared: Compared, named: set[str], final: Floats, records: Sequence[Record]) -> Shape:
    """The shape of one name, with its best rival where that was tried beside every other name too."""
    tried = [t for t in compared.rivals if t.name not in named] if compared.latest else []
    rivals = sorted(tried, key=lambda t: t.excess)[:1]
    without = _force(compared.without.model, records)
    missing = np.concatenate([r.measured for r in records]) - without
    added = [final - without, *(_force(t.fit.model, records) - without for t in rivals)]
    found = {
        v: _binned(v, records, [missing, *added]) for v in sorted(set.intersection(*map(set, map(variables, records))))
    }
    variable = max(found, key=lambda v: found[v][2])
    centre, means, _ = found[variable]
    return Shape(
        name=name, rival=rivals[0].name if rivals else None, variable=variable, unit=variables(records[0])[variable][1],
        centre=centre, missing=means[0], own=means[1], other=means[2] if rivals else None,
    )  # fmt: skip


def _force(model: Model, records: Sequence[Record]) -> Floats:
    """Simulated force in the windows of all records, (ΣM,), N; none where it can't run."""
    forces = []
    for r in records:
        try:
            forces.append(predict(model, r)[0])
        except SimulationError:
            forces.append(np.full(r.measured.size, np.nan))
    return np.concatenate(forces)


def _binned(variable: str, records: Sequence[Record], series: Sequence[Floats]) -> tuple[Floats, list[Floats], float]:
    """Centres (B,), means of each series in the bins, and the share of the first one's power that its mean holds."""
    values = np.concatenate([variables(r)[variable][0] for r in records])
    low, high = np.quantile(values, (0.002, 0.998))
    edges = np.linspace(low, high, _BINS + 1)
    index = np.clip(np.searchsorted(edges, values) - 1, 0, _BINS - 1)
    count = np.bincount(index, minlength=_BINS)
    means = [np.bincount(index, weights=s, minlength=_BINS) / np.maximum(count, 1) for s in series]
    share = float(np.sum(count * means[0] ** 2) / np.sum(series[0] ** 2))
    seen = count > _FEW
    return 0.5 * (edges[1:] + edges[:-1])[seen], [m[seen] for m in means], share
