"""Black boxes from measured runs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, model_of
from identification.blackbox import Identified as Result
from identification.blackbox import (
    identified_data,
    identified_text,
    layers_asked,
    structures_asked,
    write_identified,
)
from identification.blackbox import identify as identified
from identification.errors import ModelError
from identification.fitting.hybrid_base import base_asked, check_asked
from identification.measured import check_runs
from identification.models import SimulationModel
from identification.physical.model import Model
from rigctl.runfile import Run

__all__ = ["Identified", "identify"]


@dataclass(frozen=True, slots=True)
class Identified:
    """A black box, what cross-validation expects of it, and its fit on held-out runs."""

    result: Result

    @property
    def model(self) -> SimulationModel:
        return self.result.model

    def data(self) -> dict[str, Any]:
        """What `damper-rig identify --json` prints, without the file."""
        return identified_data(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """The candidates that were judged, a dictionary each, the best first."""
        return list(self.data()["candidates"])

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the model; raises ModelFileError."""
        write_identified(Path(path), self.result.model)
        return Path(path)

    def __repr__(self) -> str:
        return identified_text(self.result)

    def _repr_html_(self) -> str:
        first, *rest = identified_text(self.result).splitlines()
        rows = [(one["candidate"], f"{one['fit']:.2f}") for one in self.rows()]
        said = "".join(paragraph(one.strip()) for one in rest)
        return paragraph(first, strong=True) + said + table(("candidate", "fit by cross-validation, %"), rows)


def identify(
    kind: str,
    runs: Run | Iterable[Run],
    *,
    held_out: Run | Iterable[Run] = (),
    name: str = "",
    regressors: Sequence[str] = (),
    nodes: int | None = None,
    layers: str | None = None,
    activation: str | None = None,
    evolve: bool = False,
    rate_hz: float | None = None,
    base: AnyModel | None = None,
) -> Identified:
    """Identify a black box of a kind (nnoe, narx, mlp, arx, polynomial, hybrid), as `damper-rig identify` does.

    ``held_out``: runs that are only simulated and compared; ``regressors``: delayed signals, such as ``"F1 v0 v1"``, in
    place of a choice of them, with ``nodes`` of the hidden layer; ``layers``: of a narx or mlp, such as ``"14,8"``,
    with their ``activation``, or, with ``evolve``, one that differential evolution chooses; ``rate_hz``: all runs are
    resampled to it first; ``base``: the physical model under a hybrid, else a simple one is fitted.

    Raises
    ------
    DataError
        Where the kind does not exist or the runs cannot be used.
    ModelError
        Where the base is not a physical model.
    """
    measured, kept = listed(runs), listed(held_out)
    structures = structures_asked(kind, regressors, nodes)
    shape = layers_asked(kind, layers, activation, evolved=evolve, nodes=nodes)
    below = None if base is None else model_of(base)
    if below is not None and not isinstance(below, Model):
        raise ModelError(f"'{below.name}' is of kind '{below.kind}': a hybrid builds on a physical model")
    check_runs([*measured, *kept], once=True)
    if kind == "hybrid":  # what others refuse, they refuse at once
        check_asked(kind, measured, kept, structures=structures, rate_hz=rate_hz, base=below, layers=shape)
    with working("identifying") as tell:
        found = identified(
            kind,
            measured,
            held_out=kept,
            name=name,
            structures=structures,
            rate_hz=rate_hz,
            base=base_asked(kind, below, measured),
            layers=shape,
            evolved=evolve,
            tell=tell,
        )
    return Identified(found)
