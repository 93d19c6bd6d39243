"""The kind ``identify``: a model from measured runs that is no list of elements, as `damper-rig identify` finds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from json import dumps
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import StrictBool, StrictFloat, StrictInt

from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model
from api.jobs.run_choice import check_choice

if TYPE_CHECKING:
    from identification.blackbox import Layers
    from identification.models import SimulationModel
    from identification.physical.model import Model
    from rigctl.runfile import Run

__all__ = ["IDENTIFY", "IdentifyRequest"]

_MOST_SETS = 50  # of regressors
_BEFORE = 0.5  # share of the progress for a search, or the forward model of an inverse


@dataclass(frozen=True, kw_only=True)
class IdentifyRequest:
    """Identify a black box of a ``model_kind`` from the training runs of a campaign, of a rig, or from ``runs``.

    Held-out runs are only simulated and compared. ``regressors``: sets such as ``F1 v0 v1``, in place of a choice of
    them, with ``nodes`` of the hidden layer; ``rate_hz``: all runs are resampled to it first. ``base``: the physical
    model under a hybrid or the main axis of ``multiaxis``, or the forward model of an inverse. ``select``: search the
    regressors first, up to a ``longest`` delay in samples; ``every``: train every structure of the search. ``layers``:
    narx and mlp: nodes of each hidden layer, such as ``14,8``; ``activation``: of these layers; ``evolve``: activations
    and first weights by differential evolution.

    Raises InputError or ModelError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["identify"]
    model_kind: Literal["nnoe", "narx", "mlp", "arx", "polynomial", "hybrid", "inverse", "multiaxis"]
    name: str = ""
    regressors: list[str] = field(default_factory=list)
    nodes: StrictInt | None = None
    layers: str | None = None
    activation: str | None = None
    evolve: StrictBool = False
    rate_hz: StrictFloat | None = None
    base: dict[str, Any] | None = field(default=None, repr=False)  # any JSON: the model file's reader checks it
    select: StrictBool = False
    every: StrictBool = False
    longest: StrictInt | None = None
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)
    held_out: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_choice(self)
        if len(self.regressors) > _MOST_SETS:
            raise InputError(f"regressors has {len(self.regressors)} entries: at most {_MOST_SETS} sets are tried")
        if self.rate_hz is not None and not (isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise InputError(f"rate_hz is {self.rate_hz:g}: it must be above 0 Hz")
        idle = next(
            (key for key, given in (("every", self.every), ("longest", self.longest is not None)) if given), None
        )
        if idle is not None and not self.select:
            raise InputError(f"{idle} goes with select")
        if self.select and self.regressors:
            raise InputError("regressors and select: give one of them")
        if self.select and self.model_kind == "inverse":
            raise InputError("select is for a model of the force: an inverse takes regressors")
        if self.model_kind == "multiaxis" and _structure_stated(self):
            raise InputError("multiaxis: axes are chosen by correlation: leave out regressors, nodes and layers")
        if self.model_kind == "multiaxis" and (self.evolve or self.select):
            raise InputError("evolve and select are for one axis: leave them out")
        if self.base is not None:
            check_model(self.base, where="base")

    @property
    def title(self) -> str:
        return f"{self.model_kind} identified"

    @property
    def options(self) -> dict[str, Any]:
        keys = ("model_kind", "regressors", "nodes", "layers", "activation", "evolve", "rate_hz", "base", "select",
                "every", "longest")  # fmt: skip
        return {key: getattr(self, key) for key in keys}


def _structure_stated(asked: IdentifyRequest) -> bool:
    return bool(asked.regressors) or any(one is not None for one in (asked.nodes, asked.layers, asked.activation))


def _check(task: Task) -> None:
    asked = task.request
    runs, held_out = _read(task)
    if asked["model_kind"] == "inverse":
        from identification.inverse import inverse_runs, inverse_structures

        structures = inverse_structures(asked["regressors"], asked["nodes"])
        _layers(asked)  # refused
        inverse_runs(runs, held_out, _base(asked), structures=structures, rate_hz=asked["rate_hz"])
        return
    if asked["model_kind"] == "multiaxis":
        from identification.multiaxis import check_multiaxis

        _physical(asked)
        check_multiaxis(runs, held_out, rate_hz=asked["rate_hz"])
        return
    from identification.blackbox import check_searchable, offer_asked, structures_asked
    from identification.fitting.hybrid_base import check_asked

    kind = asked["model_kind"]
    structures = structures_asked(kind, asked["regressors"], asked["nodes"], searched=asked["select"])
    if asked["select"]:
        check_searchable(kind)
        offer_asked(nodes=asked["nodes"], longest=asked["longest"], every=asked["every"])
    check_asked(
        kind, runs, held_out, structures=structures, rate_hz=asked["rate_hz"], base=_physical(asked),
        layers=_layers(asked),
    )  # fmt: skip


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    asked = task.request
    figures = {"inverse": _inverse, "multiaxis": _axes}.get(asked["model_kind"], _blackbox)(task, folder, tell)
    (folder / "figures.json").write_text(dumps(figures, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    keys = ("fit_predicted", "fit_trained", "fit_held_out", "stable", "fit_current_predicted", "tracked")
    return {key: figures[key] for key in keys if key in figures}


def _blackbox(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.blackbox import (
        identified_data,
        identify,
        offer_asked,
        search,
        search_data,
        structures_asked,
        write_identified,
    )
    from identification.blackbox.search_page import write_search_page
    from identification.fitting.hybrid_base import base_asked

    asked, kind = task.request, task.request["model_kind"]
    runs, held_out = _read(task)
    structures = structures_asked(kind, asked["regressors"], asked["nodes"], searched=asked["select"])
    found, begun = None, 0.0
    if asked["select"]:
        offer = offer_asked(nodes=asked["nodes"], longest=asked["longest"], every=asked["every"])
        found = search(
            kind, runs, offer=offer, rate_hz=asked["rate_hz"], tell=lambda done, text: tell(_BEFORE * done, text)
        )
        structures, begun = [found.found.structure], _BEFORE
    result = identify(
        kind,
        runs,
        held_out=held_out,
        name=kind,
        structures=structures,
        rate_hz=asked["rate_hz"],
        base=base_asked(kind, _physical(asked), runs),
        layers=_layers(asked),
        evolved=asked["evolve"],
        tell=lambda done, text: tell(begun + (1.0 - begun) * done, text),
    )
    write_identified(folder / "model.json", result.model)
    if found is None:
        return identified_data(result)
    write_search_page(folder / "search.html", kind, found)
    return identified_data(result) | {"search": search_data(found)}


def _inverse(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.inverse import (
        forward_asked,
        identify_inverse,
        inverse_data,
        inverse_structures,
        write_inverse,
    )

    asked = task.request
    runs, held_out = _read(task)
    structures = inverse_structures(asked["regressors"], asked["nodes"])
    forward = forward_asked(
        _base(asked), asked["base"], runs, asked["rate_hz"],
        lambda done, text: tell(_BEFORE * done, f"forward model: {text}"), held_out=held_out, structures=structures,
    )  # fmt: skip
    result = identify_inverse(
        runs,
        forward,
        held_out=held_out,
        name="inverse",
        structures=structures,
        rate_hz=asked["rate_hz"],
        tell=lambda done, text: tell(_BEFORE + (1.0 - _BEFORE) * done, text),
    )
    write_inverse(folder / "model.json", result.model)
    return inverse_data(result)


def _axes(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.fitting.axes_base import axes_base
    from identification.multiaxis import (
        axes_data,
        check_multiaxis,
        identify_multiaxis,
        main_axis_runs,
        write_multiaxis,
    )

    runs, held_out, _ = check_multiaxis(*_read(task), rate_hz=task.request["rate_hz"])
    main = main_axis_runs(runs)
    tell(0.0, "base of the main axis")
    result = identify_multiaxis(
        runs,
        held_out=held_out,
        base=axes_base(_physical(task.request), main) if main else None,
        name="multiaxis",
        tell=lambda done, text: tell(_BEFORE + (1.0 - _BEFORE) * done, text),
    )
    write_multiaxis(folder / "model.json", result.model)
    return axes_data(result)


def _read(task: Task) -> tuple[Sequence[Run], Sequence[Run]]:
    from identification.measured import read_runs

    every = read_runs((*task.runs, *task.held_out), once=True)
    return every[: len(task.runs)], every[len(task.runs) :]


def _layers(asked: Mapping[str, Any]) -> Layers | None:
    from identification.blackbox import layers_asked

    keys = ("layers", "activation")
    return layers_asked(
        asked["model_kind"], *(asked[key] for key in keys), evolved=asked["evolve"], nodes=asked["nodes"],
        searched=asked["select"],
    )  # fmt: skip


def _base(asked: Mapping[str, Any]) -> SimulationModel | None:
    from identification.models import model_from_json

    return None if asked["base"] is None else model_from_json(asked["base"])


def _physical(asked: Mapping[str, Any]) -> Model | None:
    from identification.models import model_from_json
    from identification.physical.model import Model

    if asked["base"] is None:
        return None
    model = model_from_json(asked["base"], only=("physical",))
    assert isinstance(model, Model)  # by `only`
    return model


IDENTIFY = Kind(
    name="identify",
    request=IdentifyRequest,
    files={"model.json": "application/json", "figures.json": "application/json", "search.html": "text/html"},
    only_with={"search.html": "select"},
    check=_check,
    run=_run,
)
