"""From a request to a job that can be stored: finds its runs and checks its input in a process."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from threading import BoundedSemaphore, Lock
from typing import Any, Final, TypedDict

from api.campaigns.store import CampaignStore
from api.errors import Busy
from api.jobs.kind import Request
from api.jobs.process import check_in_process
from api.jobs.run_choice import find_runs
from api.store.runs import RunStore

__all__ = ["NewJob", "prepare"]

# A check uses a processor for a second: several at once would slow down rig control. Every request that waits for its
# turn keeps one of the 40 threads that answer requests: with many of them nobody else got an answer.
_ONE_AT_A_TIME = Lock()
MOST_UNDER_WAY: Final = 5  # the last of them waits for some 5 s; more: fewer refusals, fewer threads for all else
RETRY_AFTER_S: Final = 5
_PLACES = BoundedSemaphore(MOST_UNDER_WAY)


class NewJob(TypedDict):
    """A job that was checked, as ``JobStore.create`` takes it."""

    kind: str
    name: str
    campaign_id: str
    request: Mapping[str, Any]  # Any: JSON


def prepare(request: Request, *, campaigns: CampaignStore, runs: RunStore, memory_bytes: int = 0) -> NewJob:
    """Check a job, which takes seconds: call it in no transaction.

    Raises NotFound, InputError, DataError or RunFileError; Busy where too many are being checked.
    """
    training, held_out = find_runs(runs, request)
    kept = {**request.options, "runs": training, "held_out": held_out}
    paths = runs.paths(training), runs.paths(held_out)
    with _turn():
        check_in_process(request.kind, kept, *paths, memory_bytes=memory_bytes)
    of = f", {campaigns.campaign(request.campaign).name}" if request.campaign else ""
    return NewJob(
        kind=request.kind, name=request.name or request.title + of, campaign_id=request.campaign, request=kept
    )


@contextmanager
def _turn() -> Iterator[None]:
    if not _PLACES.acquire(blocking=False):
        raise Busy(f"{MOST_UNDER_WAY} jobs are being checked: send this one again", retry_after_s=RETRY_AFTER_S)
    try:
        with _ONE_AT_A_TIME:
            yield
    finally:
        _PLACES.release()
