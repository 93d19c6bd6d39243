"""Ordered faults of a foreign controller: which it knows, and whether one acts now."""

from __future__ import annotations

from sim_rig.errors import FaultError
from sim_rig.faults import FaultKind, Faults


def acts(faults: Faults, kind: FaultKind) -> bool:
    """Whether a fault with a duration has begun and not ended."""
    return any(faults.remaining_s(order) > 0 for order in faults.select(kind))


def check_faults(faults: Faults, known: tuple[FaultKind, ...], controller: str) -> None:
    """Refuse a fault that this controller does not simulate."""
    for order in faults.orders:
        if order.kind not in known:
            raise FaultError(
                f"fault {order.kind} does not exist with --controller {controller}: use {', '.join(known)}"
            )
