"""One campaign on one rig: every test in order, each end written down as it was."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event

from api.errors import LeaseLost, StoreError, one_line
from api.leases import Leased
from api.live import Live
from api.records import Campaign, CampaignState, CampaignTest, TestState
from api.runfiles import RunFiles
from excitation import ExcitationError, test_from_config
from rigctl.errors import RigError, RunFileError, StopFailed
from rigctl.player import connect, play
from rigctl.progress import Phase, Progress
from rigctl.recover import recover_directory
from rigctl.runfile import read_run
from rigctl.transport import Transport

__all__ = ["adopt_run_files", "play_campaign"]

SHUTDOWN = "the service was stopped"


class _Ended(Exception):
    """The campaign cannot go on: how the test and the campaign end, and why."""

    def __init__(self, state: CampaignState, reason: str) -> None:
        super().__init__(reason)
        self.state = state


@dataclass(slots=True, kw_only=True)
class _Watch:
    """Looks to the store now and then: keeps the lease, hears of an abort, tells how far the test is."""

    leased: Leased
    campaign: Campaign
    live: Live
    stop: Event
    poll_s: float
    now: Callable[[], float] = time.monotonic
    position: int = 0
    reason: str | None = None
    looked_at: float = field(default=float("-inf"))
    told_at: float = field(default=float("-inf"))
    phase: Phase | None = None

    def should_stop(self) -> str | None:
        if self.reason is None and self.stop.is_set():
            self.reason = SHUTDOWN
        if self.reason is None and self.now() - self.looked_at >= self.poll_s:
            self.looked_at = self.now()
            self.reason = self.leased.sign_of_life(self.campaign)
        return self.reason

    def on_progress(self, progress: Progress) -> None:
        if progress.block is not None:
            self.live.publish(self.campaign.id, progress.test, progress.block.values[:, 1], progress.block.values[:, 0])
        if progress.phase is not self.phase or self.now() - self.told_at >= self.poll_s:
            self.phase, self.told_at = progress.phase, self.now()
            self.leased.progress(self.campaign, self.position, progress.phase, progress.samples, progress.text)


def play_campaign(
    leased: Leased, campaign: Campaign, files: RunFiles, live: Live, *, stop: Event, poll_s: float
) -> None:
    """Play a campaign that was taken, and end it in the store as it ended on the rig.

    Raises LeaseLost and StoreError: then the rig is safe, and the next holder of the lease closes the campaign.
    """
    watch = _Watch(leased=leased, campaign=campaign, live=live, stop=stop, poll_s=poll_s)
    try:
        _play_all(leased, campaign, files, watch)
    except _Ended as ended:
        leased.end(campaign, ended.state, str(ended))
    except RigError as error:
        leased.end(campaign, CampaignState.FAILED, one_line(error))
    except (LeaseLost, StoreError):
        raise
    except Exception as error:
        # A fault of this program or of the disk: the player has made the rig safe; the story must end truly too
        leased.end(campaign, CampaignState.FAILED, f"{type(error).__name__}: {one_line(error)}")
        raise
    else:
        leased.end(campaign, CampaignState.DONE, "")


def _play_all(leased: Leased, campaign: Campaign, files: RunFiles, watch: _Watch) -> None:
    transport = connect(campaign.rig)
    try:
        for test in campaign.tests:
            watch.position, watch.phase = test.position, None
            if reason := watch.should_stop():
                raise _Ended(CampaignState.ABORTED, reason)
            _play_test(leased, campaign, test, files, watch, transport)
    finally:
        transport.close()


def _play_test(
    leased: Leased,
    campaign: Campaign,
    test: CampaignTest,
    files: RunFiles,
    watch: _Watch,
    transport: Transport,
) -> None:
    leased.progress(campaign, test.position, Phase.CONNECTING, 0, "")
    path: Path | None
    trouble: Exception | None = None
    try:
        path = play(
            transport,
            test_from_config(test.config),
            files.work_dir(campaign.id),
            on_progress=watch.on_progress,
            should_stop=watch.should_stop,
            specimen=campaign.specimen,
            campaign_id=campaign.id,
            test_id=test.name,
        )
    except (RigError, ExcitationError) as error:
        path, trouble = getattr(error, "run_path", None), error
    if path is not None:
        leased.add_run(campaign, files.keep(path, campaign_id=campaign.id, held_out=test.held_out))
    _end_test(leased, campaign, test, watch.reason, trouble)


def _end_test(
    leased: Leased, campaign: Campaign, test: CampaignTest, asked: str | None, trouble: Exception | None
) -> None:
    """An abort is one only if the rig followed it: a stop that failed is a failure whoever asked for it."""
    if asked is not None and not isinstance(trouble, StopFailed):
        leased.end_test(campaign, test.position, TestState.ABORTED, asked)
        raise _Ended(CampaignState.ABORTED, asked)
    if trouble is not None:
        leased.end_test(campaign, test.position, TestState.FAILED, one_line(trouble))
        raise _Ended(CampaignState.FAILED, f"test {test.name!r}: {one_line(trouble)}")
    leased.end_test(campaign, test.position, TestState.DONE, "")


def adopt_run_files(leased: Leased, campaign: Campaign, files: RunFiles) -> tuple[str, ...]:
    """Close the run files that a crash left open, tell the store of every file that it does not know yet.

    Returns a line for each file that could not be used.
    """
    folder = files.work_dir(campaign.id)
    if not folder.is_dir():
        return ()
    refused = [one.reason for one in recover_directory(folder) if one.path is None]
    known = {record.id for record in leased.store.runs(campaign.id)}
    held_out = {test.name: test.held_out for test in campaign.tests}
    for path in sorted(folder.glob("*.h5")):
        try:
            run = read_run(path)
            if run.run_id not in known:
                kept = files.keep(path, campaign_id=campaign.id, held_out=held_out.get(run.test_id, False))
                leased.add_run(campaign, kept)
        except RunFileError as error:
            refused.append(one_line(error))
    return tuple(refused)
