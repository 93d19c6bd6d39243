"""What a fit cannot tell, in words: parameters that trade against each other, and the test that would part them."""

from __future__ import annotations

from itertools import combinations
from typing import Final

import numpy as np

from identification.fitting.leastsquares import Fit

_TRADED = 0.98  # correlation beyond which one parameter may take the other's part
_VAGUE = 0.5  # standard deviation over the value beyond which a parameter is hardly seen

# What a parameter multiplies: two of the same kind need a test that changes what they have in common.
_KINDS: Final = {
    "another current": ("c_control", "alpha_control", "c_soft", "c_firm", "u_soft", "u_firm", "alpha1", "alpha2",
                        "delta1"),
    "another frequency at the same speed": ("k", "k1", "k2", "m", "tau", "sigma", "sigma0"),
    "a larger stroke": ("k3", "length", "n", "z_max", "p", "gap"),
    "lower and higher speeds": ("c", "c1", "c2", "f_c", "f_s", "f_r", "F1", "S", "d", "q", "alpha", "beta", "w_knee",
                                "w_s", "c_drop", "c_a", "delta", "gamma"),
}  # fmt: skip


def warnings(fit: Fit) -> list[str]:
    """One sentence for each pair of free parameters that these data can't tell apart, and each that they hardly see."""
    free = [(e, k) for e, k in fit.model.slots() if e.parameters[k].std is not None]
    names = [f"{e.name}.{e.spec.parameters[k].name}" for e, k in free]
    size = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    if len(names) != size.size:
        return []
    correlation = fit.covariance / np.outer(size, size)
    said = [
        f"these data can't tell {names[a]} from {names[b]} (correlation {correlation[a, b]:.3f}): "
        f"a test with {_remedy(names[a], names[b])} would"
        for a, b in combinations(range(len(names)), 2)
        if abs(correlation[a, b]) > _TRADED
    ]
    values = np.array([e.parameters[k].value for e, k in free])
    for name, value, std in zip(names, values, size, strict=True):
        if value != 0.0 and std > _VAGUE * abs(value):
            said.append(
                f"these data hardly show {name}: {value:.3g} ± {std:.2g}; fix it, or add a test with {_remedy(name)}"
            )
    return said


def _remedy(*names: str) -> str:
    plain = [name.split(".")[-1] for name in names]
    fits = [remedy for remedy, kinds in _KINDS.items() if any(p in kinds for p in plain)]
    return fits[0] if fits else "another amplitude and frequency"
