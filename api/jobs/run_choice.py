"""Which runs a job works on: those of a campaign, of a rig, or given by their ids."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from api.campaigns.texts import check_text
from api.errors import InputError

if TYPE_CHECKING:
    from api.store.runs import RunStore  # the process of a job does without a database

__all__ = ["RunChoice", "check_choice", "find_runs"]

_MOST_RUNS = 200
_SOURCES = ("campaign", "rig", "runs")


class RunChoice(Protocol):
    """The runs in a request: those of a campaign, of a rig (where given, of one specimen), or with these ids."""

    @property
    def name(self) -> str: ...  # of the job; may be empty, like every text

    @property
    def campaign(self) -> str: ...

    @property
    def rig(self) -> str: ...

    @property
    def specimen(self) -> str: ...

    @property
    def runs(self) -> list[str]: ...

    @property
    def held_out(self) -> list[str]: ...


def check_choice(chosen: RunChoice) -> None:
    """Raise InputError where no source of runs is given, or more than one."""
    for key in ("name", "campaign", "rig", "specimen"):
        if getattr(chosen, key):
            check_text(key, getattr(chosen, key), 500 if key == "rig" else 200)
    given = [key for key in _SOURCES if getattr(chosen, key)]
    if not given:
        raise InputError("give at least one measured run: a campaign, a rig, or runs by their ids")
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given: the runs come from one of them")
    if chosen.held_out and not chosen.runs:
        raise InputError("held_out goes with runs: the tests of a campaign state which of its runs are held out")
    if chosen.specimen and not chosen.rig:
        raise InputError("specimen goes with rig: it chooses among the runs of a rig")
    count = len(chosen.runs) + len(chosen.held_out)
    if count > _MOST_RUNS:
        raise InputError(f"runs and held_out have {count} entries: at most {_MOST_RUNS}")


def find_runs(runs: RunStore, chosen: RunChoice) -> tuple[list[str], list[str]]:
    """Ids of the training and of the held-out runs, none for a kind that needs none; raises NotFound, and InputError
    where there is no training run.
    """
    if chosen.runs or not (chosen.campaign or chosen.rig):
        return chosen.runs, chosen.held_out
    found = runs.complete(campaign_id=chosen.campaign, rig=chosen.rig, specimen=chosen.specimen)
    training = [run.id for run in found if not run.held_out]
    if not training:
        source = f"campaign {chosen.campaign}" if chosen.campaign else f"rig {chosen.rig}"
        of = f" of specimen {chosen.specimen!r}" if chosen.specimen else ""
        raise InputError(f"{source} has no complete training run{of}: give at least one measured run")
    return training, [run.id for run in found if run.held_out]
