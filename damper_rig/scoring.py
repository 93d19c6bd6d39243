"""How far a simulated force is from the measured one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from damper_rig.html import table
from damper_rig.runs import listed
from identification.models.measures import score as figures_of
from identification.models.simulation import name_of
from rigctl.runfile import Run

__all__ = ["Scored", "score"]


@dataclass(frozen=True, slots=True)
class Scored:
    """The error measures of each run."""

    figures: tuple[tuple[str, dict[str, float]], ...]  # name of the run, and its figures by name

    def data(self) -> dict[str, dict[str, float]]:
        """What `damper-rig score` prints, for each run."""
        return dict(self.figures)

    def rows(self) -> list[dict[str, Any]]:
        """The runs, a dictionary each."""
        return [{"run": run, **figures} for run, figures in self.figures]

    def __repr__(self) -> str:
        return "\n".join(
            f"{run}: rms {f['rms']:.4g} N, fit {f['fit']:.2f} %, EEARTH {f['eearth']:.3f}" for run, f in self.figures
        )

    def _repr_html_(self) -> str:
        heads = ("run", "rms, N", "fit, %", "EEARTH")
        return table(heads, [(run, *(f"{f[n]:.4g}" for n in ("rms", "fit", "eearth"))) for run, f in self.figures])


def score(runs: Run | Iterable[Run]) -> Scored:
    """The error measures of `force_simulated` against `force` of each run: rms in N, fit in %, and others.

    Raises
    ------
    DataError
        Where a run lacks one of the two channels, or the measured force is constant.
    """
    return Scored(tuple((name_of(run), figures_of(run)) for run in listed(runs)))
