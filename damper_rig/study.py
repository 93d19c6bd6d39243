"""Studies of a model in a notebook: `dr.study.explore(...)` and its neighbours."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, model_of
from damper_rig.vehicles import (
    FmuWiring,
    InRange,
    InRealtime,
    InVehicle,
    OwnVehicle,
    open_vehicle,
    realtime,
    vehicle,
    worth,
)
from damper_rig.vehicles import range_ as range
from excitation.configuration import to_spec
from identification.errors import ModelError
from identification.measured import check_runs
from identification.physical.model import Model
from identification.studies.complexity import Complexity as ComplexityResult
from identification.studies.complexity import Plan, Step, complexity_data, complexity_text, write_complexity
from identification.studies.complexity import complexity as studied
from identification.studies.complexity.feasible import feasible_rows
from identification.studies.complexity.plan import MATTERS
from identification.studies.exploration import Exploration, explored_data, explored_text, write_explored
from identification.studies.exploration import Explored as ExploredResult
from identification.studies.exploration import explore as explored
from identification.studies.sensitivity import Sensitive as SensitiveResult
from identification.studies.sensitivity import Sensitivity, sensitivity_data, sensitivity_text, write_sensitivity
from identification.studies.sensitivity import sensitivity as sensitive
from rigctl.runfile import Run

__all__ = [
    "Complexity",
    "Explored",
    "FmuWiring",
    "InRange",
    "InRealtime",
    "InVehicle",
    "OwnVehicle",
    "Sensitive",
    "complexity",
    "explore",
    "open_vehicle",
    "range",
    "realtime",
    "sensitivity",
    "vehicle",
    "worth",
]


@dataclass(frozen=True, slots=True)
class Explored:
    """The feasible parameters of a model; ``result`` holds every sample."""

    result: ExploredResult

    def data(self) -> dict[str, Any]:
        """What `damper-rig study explore --json` prints, without the file."""
        return explored_data(self.result)

    def rows(self) -> list[dict[str, float]]:
        """The feasible samples, a dictionary of parameters each."""
        return [dict(zip(self.result.names, row, strict=True)) for row in self.data()["feasible_set"]]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_explored(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return explored_text(self.result)

    def _repr_html_(self) -> str:
        rows = [
            (p["name"], f"{p['start']:.4g}", *(f"{v:.4g}" for v in p["feasible"] or (float("nan"),) * 2))
            for p in self.data()["parameters"]
        ]
        first = explored_text(self.result).partition("\n")[0]
        return paragraph(first, strong=True) + table(("parameter", "start", "feasible from", "to"), rows)


def explore(
    model: AnyModel, runs: Run | Iterable[Run], asked: Mapping[str, Any] | Exploration | None = None
) -> Explored:
    """Samples of the model that stay within limits of the measured sine tests; ``asked``: the keys of a study's TOML.

    Raises
    ------
    ModelError, DataError, DesignError
        Where the model has no such parameters, no run is a steady sine, or a key is not known.
    """
    loaded, measured = physical_of(model), listed(runs)
    check_runs(measured)
    spec = asked if isinstance(asked, Exploration) else to_spec(Exploration, dict(asked or {}), "asked")
    with working("exploring") as tell:
        return Explored(explored(loaded, measured, spec, tell=tell))


@dataclass(frozen=True, slots=True)
class Sensitive:
    """The share of every parameter in the change of the force, by each method."""

    result: SensitiveResult

    def data(self) -> dict[str, Any]:
        """What `damper-rig study sensitivity --json` prints, without the file."""
        return sensitivity_data(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """The parameters, a dictionary each."""
        return [{"name": p["name"], "value": p["value"], **p["shares"]} for p in self.data()["parameters"]]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_sensitivity(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return sensitivity_text(self.result)

    def _repr_html_(self) -> str:
        cells = [[one if isinstance(one, str) else f"{one:.4g}" for one in row.values()] for row in self.rows()]
        return table(list(self.rows()[0]), cells)


def sensitivity(model: AnyModel, asked: Mapping[str, Any] | Sensitivity | None = None) -> Sensitive:
    """How much each parameter changes the force at one operating point; ``asked``: the keys of a study's TOML.

    Raises
    ------
    ModelError, DesignError
        Where the model has no such parameters, or a key is not known.
    """
    loaded = physical_of(model)
    spec = asked if isinstance(asked, Sensitivity) else to_spec(Sensitivity, dict(asked or {}), "asked")
    with working("simulating") as tell:
        return Sensitive(sensitive(loaded, spec, tell=tell))


@dataclass(frozen=True, slots=True)
class Complexity:
    """What each element is worth at each step of a plan, the ladder, and the simplified model."""

    result: ComplexityResult

    @property
    def model(self) -> Model:
        """The simplified model, fitted."""
        return self.result.simplified

    def data(self) -> dict[str, Any]:
        """What `damper-rig study complexity --json` prints, without the file."""
        return complexity_data(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """A dictionary for each step and element."""
        return list(self.data()["indicators"])

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_complexity(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return complexity_text(self.result)

    def _repr_html_(self) -> str:
        rows = [
            ["" if v is None else f"{v:.3g}" if isinstance(v, float) else v for v in r.values()] for r in self.rows()
        ]
        return table(list(self.rows()[0]), rows)


def complexity(
    model: AnyModel,
    runs: Run | Iterable[Run],
    plan: Mapping[str, Any] | Plan | Iterable[Step],
    *,
    feasible: Explored | None = None,
    beside: Iterable[AnyModel] = (),
) -> Complexity:
    """What each element of the model is worth in the vehicle; ``plan``: the keys of a TOML file, or steps of your own.

    Raises
    ------
    ModelError, DataError, DesignError
        Where the plan has no step, a step cannot take the model, or the runs cannot be used.
    """
    loaded, measured, others = physical_of(model), listed(runs), [model_of(one) for one in beside]
    check_runs(measured, once=True)
    given = to_spec(Plan, dict(plan), "plan") if isinstance(plan, Mapping) else plan
    steps, matters = (given.step, given.matters) if isinstance(given, Plan) else (tuple(given), MATTERS)
    known = [] if feasible is None else feasible_rows(feasible.data(), "feasible")
    with working("fitting") as tell:
        return Complexity(studied(loaded, measured, steps, matters=matters, feasible=known, beside=others, tell=tell))


def physical_of(model: AnyModel) -> Model:
    """The physical model; raises ModelError for one of another kind."""
    loaded = model_of(model)
    if not isinstance(loaded, Model):
        raise ModelError(f"'{loaded.name}' is of the kind {loaded.kind}: this study varies a physical model")
    return loaded
