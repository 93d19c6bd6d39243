"""The free parameters of a physical model from measured runs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.runs import Runs, listed
from damper_rig.simulating import AnyModel, model_of
from identification.errors import ModelError
from identification.fitting import Fit, Intervals, fit_as_asked, fit_data, fit_text, moved_far
from identification.measured import check_runs
from identification.physical.model import Model
from identification.physical.modelfile import write_model
from rigctl.runfile import Run

__all__ = ["Fitted", "fit"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """A fitted model: ``result`` is what the fit gave, ``intervals`` are those of profile likelihood, 68 %."""

    result: Fit
    start: Model
    runs: Runs
    intervals: Intervals = field(default_factory=dict)

    @property
    def model(self) -> Model:
        return self.result.model

    @property
    def questions(self) -> list[str]:
        """Questions about the input that the result raises."""
        return moved_far(self.start, self.model)

    def data(self) -> dict[str, Any]:
        """What `damper-rig fit --json` prints, without the file."""
        return fit_data(self.result, self.intervals)

    def rows(self) -> list[dict[str, Any]]:
        """The parameters, a dictionary each."""
        return [{"parameter": name, **entry} for name, entry in self.data()["parameters"].items()]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the fitted model; raises ModelFileError."""
        write_model(Path(path), self.model)
        return Path(path)

    def __repr__(self) -> str:
        return "\n".join([fit_text(self.result, self.intervals), *(f"  {one}" for one in self.questions)])

    def _repr_html_(self) -> str:
        first, *_ = fit_text(self.result).splitlines()
        rows = [
            (
                one["parameter"],
                f"{one['value']:.5g}",
                one["unit"],
                "fixed" if one["fixed"] else "" if one["std"] is None else f"± {one['std']:.2g}",
            )
            for one in self.rows()
        ]
        said = [*self.data()["warnings"], *self.questions]
        return (
            paragraph(first, strong=True)
            + table(("parameter", "value", "unit", "standard deviation"), rows)
            + "".join(map(paragraph, said))
        )


def fit(
    model: AnyModel,
    runs: Run | Iterable[Run],
    *,
    starts: int = 1,
    robust: float | None = None,
    refine: bool = False,
    profile: Sequence[str] = (),
) -> Fitted:
    """Fit the free parameters of a physical model to all runs at once, as `damper-rig fit` does.

    ``starts``: number of starts, the best is kept; ``robust``: Huber threshold, noise standard deviations; ``refine``:
    smooth forms of friction and hysteresis; ``profile``: parameters, `element.parameter`, whose interval is computed by
    profile likelihood.

    Raises
    ------
    DataError
        Where the runs cannot be used, or one is given twice.
    ModelError
        Where the model is not a physical one.
    """
    start, measured = model_of(model), listed(runs)
    if not isinstance(start, Model):
        raise ModelError(f"'{start.name}' is of kind '{start.kind}': only a physical model is fitted")
    check_runs(measured, once=True)
    with working("fitting") as tell:
        found, intervals = fit_as_asked(
            start, measured, starts=starts, robust=robust, refine=refine, profile=profile, tell=tell
        )
    return Fitted(result=found, start=start, runs=Runs(tuple(measured)), intervals=intervals)
