"""The search for regressors of `damper-rig identify --select`: what is asked for, and what is said of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from api.errors import InputError

if TYPE_CHECKING:
    from identification.blackbox import Offer, Search
    from rigctl.runfile import Run

__all__ = ["SHARE", "offer_of", "searched"]

SHARE = 0.6  # of the progress bar


def offer_of(
    *,
    select: bool,
    every: bool,
    longest: int | None,
    nodes: int | None,
    regressors: list[str] | None,
    files: tuple[Path | None, Path | None],
) -> Offer | None:
    """What the search may choose from; None where no search is asked for. Raises InputError."""
    from identification.blackbox import offer_asked

    if not select:
        given = {"--every": every, "--longest": longest is not None, "--search": files[0], "--page": files[1]}
        idle = next((name for name, value in given.items() if value), None)
        if idle is not None:
            raise InputError(f"{idle} needs --select")
        return None
    if regressors:
        raise InputError("--regressors and --select: give one of them")
    return offer_asked(nodes=nodes, longest=longest, every=every)


def searched(
    kind: str,
    runs: list[Run],
    asked: Offer,
    rate_hz: float | None,
    state: Path | None,
    tell: Callable[[float, str], None],
) -> Search:
    """The search itself."""
    from identification.blackbox import search

    return search(
        kind, runs, offer=asked, rate_hz=rate_hz, state=state, tell=lambda done, text: tell(SHARE * done, text)
    )
