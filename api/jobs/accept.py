"""From what was asked over HTTP to an explanation in the store: its runs found, its input looked at."""

from __future__ import annotations

from threading import Lock

from api.campaigns.records import Explanation
from api.errors import InputError
from api.jobs.explain import NewExplanation
from api.jobs.process import refuse
from api.service import House

__all__ = ["accepted"]

_ONE_LOOKS = Lock()  # a process that looks takes a processor for a second: many at once would slow down a rig


def accepted(here: House, new: NewExplanation) -> Explanation:
    """Accept it; raises NotFound, InputError, DataError, RunFileError or ModelError, and then nothing is kept."""
    runs, held_out = _runs(here, new)
    paths = [[here.files.at(place) for place in here.explanations.locations(ids)] for ids in (runs, held_out)]
    with _ONE_LOOKS:
        refuse(new.model, *paths)
    return here.explanations.create(
        name=new.name or _name(here, new), campaign_id=new.campaign, model=new.model, runs=runs, held_out=held_out
    )


def _runs(here: House, new: NewExplanation) -> tuple[list[str], list[str]]:
    """Ids of the training and of the held-out runs."""
    if new.runs:
        return new.runs, new.held_out
    if new.campaign:
        here.store.campaign(new.campaign)  # raises NotFound
    found = here.explanations.complete_runs(campaign_id=new.campaign, rig=new.rig, specimen=new.specimen)
    training = [run.id for run in found if not run.held_out]
    if not training:
        source = f"campaign {new.campaign}" if new.campaign else f"rig {new.rig}"
        of = f" of specimen {new.specimen!r}" if new.specimen else ""
        raise InputError(f"{source} has no complete training run{of}: give at least one measured run")
    return training, [run.id for run in found if run.held_out]


def _name(here: House, new: NewExplanation) -> str:
    model = "the given simulation" if new.model is None else str(new.model.get("name") or "the given model")
    return f"{model}, {here.store.campaign(new.campaign).name}" if new.campaign else model
