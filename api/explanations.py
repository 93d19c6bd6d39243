"""What a gap to be explained must be to be accepted: checked at the door, before anything is kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from api.campaigns import check_text
from api.errors import InputError
from identification.errors import ModelError
from identification.models import model_from_json

__all__ = ["NewExplanation"]

_MOST_RUNS = 200
_SOURCES = ("campaign", "rig", "runs")


@dataclass(frozen=True, kw_only=True)
class NewExplanation:
    """A body of POST /v1/explanations: a base model and the runs of one specimen.

    The runs are those of a ``campaign``, all complete ones of a ``rig`` (of one ``specimen``, where it is given), or
    ``runs`` and ``held_out`` by their ids. ``simulated``: no model, the runs hold a channel force_simulated.

    Raises InputError or ModelError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    name: str = ""
    model: dict[str, Any] | None = field(default=None, repr=False)  # any JSON: the model file's reader checks it
    simulated: bool = False
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)
    held_out: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        for key in ("name", "campaign", "rig", "specimen"):
            if getattr(self, key):
                check_text(key, getattr(self, key), 500 if key == "rig" else 200)
        self._check_runs()
        self._check_model()

    def _check_runs(self) -> None:
        given = [key for key in _SOURCES if getattr(self, key)]
        if not given:
            raise InputError("give at least one measured run: a campaign, a rig, or runs by their ids")
        if len(given) > 1:
            raise InputError(f"{' and '.join(given)} are given: the runs come from one of them")
        if self.held_out and not self.runs:
            raise InputError("held_out goes with runs: those of a campaign or a rig are told apart by their tests")
        if self.specimen and not self.rig:
            raise InputError("specimen goes with rig: it chooses among the runs of a rig")
        count = len(self.runs) + len(self.held_out)
        if count > _MOST_RUNS:
            raise InputError(f"runs and held_out have {count} entries: at most {_MOST_RUNS}")

    def _check_model(self) -> None:
        if self.simulated == (self.model is not None):
            raise InputError("give either a model, or simulated: true where the runs hold a channel force_simulated")
        if self.model is not None:
            try:
                model_from_json(self.model)
            except ModelError as error:
                raise ModelError(f"model: {error}") from error
