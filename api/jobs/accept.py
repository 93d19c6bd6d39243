"""From a request to a job in the store: finds its runs and checks its input in a process."""

from __future__ import annotations

from threading import Lock

from api.campaigns.store import CampaignStore
from api.jobs.kind import Request
from api.jobs.process import check_in_process
from api.jobs.records import Job
from api.jobs.run_choice import find_runs
from api.jobs.store import JobStore
from api.store.runs import RunStore

__all__ = ["accept"]

_ONE_AT_A_TIME = Lock()  # a check uses a processor for a second: several at once would slow down rig control


def accept(request: Request, *, campaigns: CampaignStore, runs: RunStore, jobs: JobStore) -> Job:
    """Accept a job; raises NotFound, InputError, DataError or RunFileError, and then nothing is stored."""
    training, held_out = find_runs(runs, request)
    kept = {**request.options, "runs": training, "held_out": held_out}
    paths = runs.paths(training), runs.paths(held_out)
    with _ONE_AT_A_TIME:
        check_in_process(request.kind, kept, *paths)
    of = f", {campaigns.campaign(request.campaign).name}" if request.campaign else ""
    return jobs.create(
        kind=request.kind, name=request.name or request.title + of, campaign_id=request.campaign, request=kept
    )
