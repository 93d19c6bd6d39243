"""Warnings of a fit in words: parameters that are not separable, and the test that would separate them."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from identification.fitting.leastsquares import Fit
from identification.physical.elements import ParameterSpec, Remedy

_TRADED = 0.98  # correlation above which one parameter can compensate the other
_VAGUE = 0.5  # standard deviation over the value above which a parameter is hardly determined


def warnings(fit: Fit) -> list[str]:
    """A sentence for each pair of free parameters that the data cannot separate, and each that they hardly show."""
    free = [(e, k) for e, k in fit.model.slots() if e.parameters[k].std is not None]
    names = [f"{e.id}.{e.spec.parameters[k].name}" for e, k in free]
    specs = [e.spec.parameters[k] for e, k in free]
    size = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    if len(names) != size.size:
        return []
    correlation = fit.covariance / np.outer(size, size)
    said = [
        f"these data cannot separate {names[a]} from {names[b]} (correlation {correlation[a, b]:.3f}): "
        f"a test with {_remedy(specs[a], specs[b])} would"
        for a, b in combinations(range(len(names)), 2)
        if abs(correlation[a, b]) > _TRADED
    ]
    values = np.array([e.parameters[k].value for e, k in free])
    for name, spec, value, std in zip(names, specs, values, size, strict=True):
        if value != 0.0 and std > _VAGUE * abs(value):
            said.append(
                f"these data hardly show {name}: {value:.3g} ± {std:.2g}; fix it or add a test with {_remedy(spec)}"
            )
    return said


def _remedy(*parameters: ParameterSpec) -> str:
    """The first of the remedies that helps one of them."""
    return next(r for r in Remedy if any(p.remedy == r for p in parameters)).value
