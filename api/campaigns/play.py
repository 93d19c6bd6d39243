"""Plays one campaign on one rig: every test in order, and how each ended."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from threading import Event

from api.campaigns.held_rig import HeldRig
from api.campaigns.live import Live
from api.campaigns.records import Campaign, CampaignState, CampaignTest, TestState
from api.campaigns.watch import Watch
from api.errors import LeaseLost, StoreError, one_line
from api.store.runs import RunStore
from excitation import ExcitationError, test_from_config
from rigctl.errors import RigError, RigFault, RunFileError
from rigctl.interlocks import interlock
from rigctl.player import PlayerSettings, connect, play
from rigctl.progress import Phase
from rigctl.recover import recover_directory
from rigctl.runfile import read_run
from rigctl.transport import Transport
from rigctl.warm_up import warmed_up

__all__ = ["adopt_run_files", "play_campaign"]

HOLD_POLL_S = 0.05  # between two tests the rig is switched off


class _Ended(Exception):
    """The campaign cannot go on: how the test and the campaign end, and why."""

    def __init__(self, state: CampaignState, reason: str) -> None:
        super().__init__(reason)
        self.state = state


def play_campaign(held: HeldRig, campaign: Campaign, runs: RunStore, live: Live, *, stop: Event, poll_s: float) -> None:
    """Play a campaign, and store how it ended on the rig.

    Raises LeaseLost and StoreError: then the rig is safe, and the next holder of the lease closes the campaign.
    """
    state, reason = CampaignState.DONE, ""
    try:
        with Watch(held, campaign, live, stop=stop, poll_s=poll_s) as watch:
            _play_all(held, campaign, runs, watch)
    except _Ended as ended:
        state, reason = ended.state, str(ended)
    except RigError as error:
        state, reason = CampaignState.FAILED, one_line(error)
    except (LeaseLost, StoreError):
        raise
    except Exception as error:
        # A fault of this program or of the disk: the player has made the rig safe, and the store must show the end too
        held.end(campaign, CampaignState.FAILED, f"{type(error).__name__}: {one_line(error)}")
        raise
    if watch.failure is not None:
        raise watch.failure
    held.end(campaign, state, reason)


def _play_all(held: HeldRig, campaign: Campaign, runs: RunStore, watch: Watch) -> None:
    transport = connect(campaign.rig)
    try:
        for test in campaign.tests:
            while watch.should_hold() and not watch.should_stop():
                time.sleep(HOLD_POLL_S)
            if reason := watch.should_stop():
                raise _Ended(CampaignState.ABORTED, reason)
            _play_test(held, campaign, test, runs, watch, transport)
    finally:
        transport.close()


def _play_test(
    held: HeldRig,
    campaign: Campaign,
    test: CampaignTest,
    runs: RunStore,
    watch: Watch,
    transport: Transport,
) -> None:
    watch.begin(test.position)
    held.progress(campaign, test.position, Phase.CONNECTING, 0, "")
    path: Path | None
    failure: RigError | ExcitationError | None = None
    try:
        path = warmed_up(
            partial(
                play,
                transport,
                on_progress=watch.on_progress,
                should_stop=watch.should_stop,
                should_hold=watch.should_hold,
                should_return=watch.should_return,
                specimen=campaign.specimen,
                campaign_id=campaign.id,
                test_id=test.name,
                settings=PlayerSettings(interlocks=tuple(map(interlock, campaign.interlocks))),
            ),
            test_from_config(test.config),
            runs.work_dir(campaign.id),
            None if campaign.warm_up is None else test_from_config(campaign.warm_up),
        )
    except RigError as error:
        path, failure = error.run_path, error
    except ExcitationError as error:  # a later version may refuse what an earlier one accepted
        path, failure = None, error
    complete = False
    if path is not None:
        run = runs.describe(path, campaign_id=campaign.id, held_out=test.held_out)
        held.add_run(campaign, run)
        complete = run.status == "complete"
    if not (complete and failure is None):
        state, reason = _how_it_ended(path, failure, watch.should_stop() or "stopped")
        held.end_test(campaign, test.position, TestState(state), reason)
        raise _Ended(state, reason if state is CampaignState.ABORTED else f"test {test.name!r}: {reason}")
    held.end_test(campaign, test.position, TestState.DONE, "")


def _how_it_ended(
    path: Path | None, failure: RigError | ExcitationError | None, asked: str
) -> tuple[CampaignState, str]:
    """Aborted only where the rig did what was requested; a fault or a stop that failed is a failure.

    A stop before the first sample comes as a RigFault without a file.
    """
    if failure is None or (path is None and isinstance(failure, RigFault) and asked in str(failure)):
        return CampaignState.ABORTED, asked
    return CampaignState.FAILED, one_line(failure)


def adopt_run_files(held: HeldRig, campaign: Campaign, runs: RunStore) -> tuple[str, ...]:
    """Close the run files that a crash left open, and store every run file that the store does not have.

    Returns a line for each file that could not be used.
    """
    folder = runs.work_dir(campaign.id)
    if not folder.is_dir():
        return ()
    refused = [one.reason for one in recover_directory(folder) if one.path is None]
    known = {record.id for record in runs.of_campaign(campaign.id)}
    held_out = {test.name: test.held_out for test in campaign.tests}
    for path in sorted(folder.glob("*.h5")):
        try:
            run = read_run(path)
            if run.run_id not in known:
                kept = runs.describe(path, campaign_id=campaign.id, held_out=held_out.get(run.test_id, False))
                held.add_run(campaign, kept)
        except RunFileError as error:
            refused.append(one_line(error))
    return tuple(refused)
