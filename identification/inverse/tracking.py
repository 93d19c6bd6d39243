"""How well a wanted force is made: the current, the force of the forward model with it, and what cannot be made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.inverse.by_forward import inverted, told_apart
from identification.inverse.model import Inverse, forward_of
from identification.inverse.reach import Limits, check_controlled, check_reached, reach_of
from identification.inverse.wanted import Wanted
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracking:
    """A current and the force of the forward model with it, each (N,), beside the wanted force.

    `fit` (%) and `rms` (N) compare the two forces over all samples. `lack` (N,), N, is by how much the wanted force
    lies above what any current gives, below it where less than 0; `cannot` (N,) are the samples where that counts.
    `beyond` are sentences on where motion and current leave the training of the forward model.
    """

    name: str
    limits: Limits
    current: Floats
    force: Floats
    wanted: Floats
    lack: Floats
    cannot: NDArray[np.bool_]
    beyond: tuple[str, ...] = ()

    @property
    def rms(self) -> float:
        """Rms of wanted less given force, N."""
        return float(np.sqrt(np.mean((self.wanted - self.force) ** 2)))

    @property
    def fit(self) -> float:
        """100·(1 − ‖F* − F‖/‖F* − mean F*‖), %; −∞ where a constant force is wanted."""
        return _fit(self.wanted, self.force)

    @property
    def fit_where_it_can(self) -> float:
        """The same over the samples whose force can be made, %."""
        can = ~self.cannot
        return _fit(self.wanted[can], self.force[can])

    @property
    def share_cannot(self) -> float:
        """Share of the samples whose wanted force cannot be made."""
        return float(np.mean(self.cannot))

    def described(self, dt: float) -> str:
        """A sentence on what cannot be made, and what is given in its place; empty where all can."""
        if not self.cannot.any():
            return ""
        size = np.where(self.cannot, np.abs(self.lack), 0.0)
        first, worst = int(np.argmax(self.cannot)), int(np.argmax(size))
        side = "more" if self.lack[worst] > 0.0 else "less"
        return (
            f"{self.name}: the wanted force cannot be made in {100.0 * self.share_cannot:.3g} % of the samples, first "
            f"at {first * dt:.4g} s, farthest at {worst * dt:.4g} s by {size[worst]:.3g} N {side} than "
            f"[{self.limits.low:g}, {self.limits.high:g}] A can give; there the current gives another force"
        )


def _fit(wanted: Floats, given: Floats) -> float:
    spread = float(np.linalg.norm(wanted - wanted.mean()))
    return 100.0 * (1.0 - float(np.linalg.norm(wanted - given)) / spread) if spread > 0.0 else -np.inf


def track(
    inverse: Inverse | SimulationModel, wanted: Wanted, limits: Limits | None = None, *, learned: bool = True
) -> Tracking:
    """The current for a wanted force, checked with the forward model.

    A learned inverse gives the current itself, or, not `learned`, by inversion of its forward model; a forward model
    is inverted, and then needs `limits`.

    Raises
    ------
    DataError
        one line, where nothing of the wanted force can be made, or the current does not change the force.
    SimulationError
        as the forward model does.
    """
    forward = forward_of(inverse)
    within = limits or (inverse.limits if isinstance(inverse, Inverse) else limits_of(forward))
    told = told_apart(forward, within)
    reach = reach_of(forward, wanted, told)
    check_reached(reach, wanted, within)
    if isinstance(inverse, Inverse) and learned:
        current = np.clip(inverse.current(wanted), within.low, within.high)
    else:
        current = inverted(forward, wanted, told, reach)
    driven, known = wanted.driven(current), forward.training_range
    return Tracking(
        name=wanted.name,
        limits=within,
        current=current,
        force=forward.force(driven),
        wanted=wanted.force,
        lack=reach.lack(wanted.force),
        cannot=reach.cannot(wanted.force),
        beyond=() if known is None else tuple(f"{wanted.name}: {sentence}" for sentence in known.described(driven)),
    )


def limits_of(forward: SimulationModel) -> Limits:
    """The currents that a forward model was trained within; raises DataError where it states none."""
    check_controlled(forward)
    known = forward.training_range
    if known is None or "current" not in known.limits:
        raise DataError(f"'{forward.name}' states no range of the current: give the limits (--current LOW HIGH)")
    return Limits(*known.limits["current"])


def tracking_data(found: Tracking) -> dict[str, Any]:
    """The figures as JSON data, SI units. Any: what JSON can say."""
    worst = float(found.lack[np.argmax(np.where(found.cannot, np.abs(found.lack), 0.0))]) if found.cannot.any() else 0.0
    return {
        "run": found.name,
        "fit": found.fit if np.isfinite(found.fit) else None,
        "fit_where_it_can": found.fit_where_it_can if np.isfinite(found.fit_where_it_can) else None,
        "rms": found.rms,
        "current": [found.limits.low, found.limits.high],
        "share_cannot": found.share_cannot,
        "worst_lack": worst,
        "outside_training": list(found.beyond),
    }
