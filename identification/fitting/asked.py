"""A fit as a user asks for it: the fit, and the intervals of the parameters that are named."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from identification.fitting.described import Intervals
from identification.fitting.fit import fit
from identification.fitting.leastsquares import Fit
from identification.fitting.profile import intervals_of
from identification.physical.model import Model
from rigctl.runfile import Run


def fit_as_asked(
    start: Model,
    runs: Sequence[Run],
    *,
    starts: int = 1,
    robust: float | None = None,
    refine: bool = False,
    profile: Sequence[str] = (),
    tell: Callable[[float, str], None] = lambda done, text: None,
) -> tuple[Fit, Intervals]:
    """The fit, and by profile likelihood the interval of each parameter that `profile` names as `element.parameter`.

    `tell` is told the share that is done, by a guess: nobody knows how many steps there will be.

    Raises
    ------
    DataError
        Where the runs cannot be used, or a parameter does not exist.
    """
    found = fit(
        start,
        runs,
        starts=starts,
        robust=robust,
        refine=refine,
        on_step=lambda step, cost: tell(1 - 0.8**step, f"fitting, step {step}"),
    )
    return found, intervals_of(found, runs, profile, robust=robust)
