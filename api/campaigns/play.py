"""Plays one campaign on one rig: every test in order, and how each ended."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from threading import Event

from api.campaigns.desk import Desk
from api.campaigns.envelopes import envelopes_of
from api.campaigns.held_rig import HeldRig
from api.campaigns.journal import LastWords
from api.campaigns.operator import RemoteOperator
from api.campaigns.records import Campaign, CampaignState, CampaignTest, TestState
from api.campaigns.watch import SHUTDOWN, Watch, said_of
from api.errors import DiskFull, LeaseLost, StoreError, one_line
from api.store.runs import RunStore
from excitation import ExcitationError, Test, test_from_config
from excitation.rig import Envelope
from rigctl.calibration import calibrations_from, check_valid
from rigctl.clock import SystemClock
from rigctl.device import RigState
from rigctl.errors import (
    CalibrationExpired,
    Declined,
    LimitError,
    RigError,
    RigFault,
    RigOccupied,
    RunFileError,
    SessionLost,
    TransportError,
    UrlError,
)
from rigctl.interlocks import interlock
from rigctl.operator_acts import ask_to_start, look
from rigctl.player import PlayerSettings, connect, play
from rigctl.progress import Phase, Progress
from rigctl.recover import recover_directory
from rigctl.runfile import read_run
from rigctl.sequence import Sequence
from rigctl.setup import Setup
from rigctl.transport import Transport

__all__ = ["adopt_run_files", "play_campaign"]

HOLD_POLL_S = 0.05  # between two tests the rig is switched off
FORMER_MASTER_S = 8.0  # longer than the watchdog of any rig that this program has configured without being asked
LATE_ORDER_S = (
    1.0  # a worker that gets no processor takes an order later than the service waits for it; more: a later end
)
_LATE_POLL_S = 0.02
REFUSED = (LimitError, UrlError, ExcitationError)  # of this campaign alone, before anything has moved
AWAY = (TransportError, RigOccupied)  # the rig cannot be used now; it could be later
POWERED = (RigState.HOLD, RigState.ACTIVE, RigState.FAULT_REACTION)


class _Ended(Exception):
    """The campaign cannot go on: how the test and the campaign end, and why; ``pauses``: so does the rig's queue."""

    def __init__(self, state: CampaignState, reason: str, *, pauses: bool = True) -> None:
        super().__init__(reason)
        self.state, self.pauses = state, pauses


class _NotBegun(Exception):
    """The rig cannot be used, and nothing of the campaign is recorded: it goes on waiting."""


def play_campaign(
    held: HeldRig,
    campaign: Campaign,
    runs: RunStore,
    desk: Desk,
    *,
    stop: Event,
    poll_s: float,
    envelopes: tuple[Envelope, ...] = (),
    check: Callable[[], None] = lambda: None,
) -> None:
    """Play a campaign, and store how it ended on the rig; `envelopes` hold beside its own.

    `check` raises RigError where another rig is at the address, DiskFull where a run has no room: the campaign waits.

    The queue of the rig is paused unless the campaign was played to its end, or refused before anything moved.
    Raises LeaseLost and StoreError: then the rig is safe, and the next holder of the lease closes the campaign.
    """
    state, reason, pauses = CampaignState.DONE, "", False
    not_begun = ""
    desk.begin(campaign)
    try:
        with Watch(held, campaign, desk, stop=stop, poll_s=poll_s) as watch:
            try:
                _check_rig(check)
                _play_all(held, campaign, runs, watch, poll_s, envelopes)
            finally:
                desk.end()
    except _Ended as ended:
        state, reason, pauses = ended.state, str(ended), ended.pauses
    except _NotBegun as away:
        not_begun = str(away)
    except RigError as error:
        state, reason, pauses = (
            CampaignState.FAILED,
            runs.without_folder(one_line(error)),
            not isinstance(error, REFUSED),
        )
    except (LeaseLost, StoreError) as error:
        _leave_word(desk, campaign, watch, error)
        raise
    except Exception as error:
        # A fault of this program or of the disk: the player has made the rig safe, and the store must show the end too
        reason = runs.without_folder(f"{type(error).__name__}: {one_line(error)}")
        held.end(campaign, CampaignState.FAILED, reason, pauses=True)
        raise
    if watch.failure is not None:
        _leave_word(desk, campaign, watch, watch.failure)
        raise watch.failure
    if not_begun:
        held.put_back(campaign, not_begun)
    else:
        if desk.journal is not None:  # before the store, which may not answer
            words = LastWords(campaign_id=campaign.id, reason=reason, ended=state, pauses=pauses)
            desk.journal.note(words)
        held.end(campaign, state, reason, pauses=pauses)
        if desk.journal is not None:
            desk.journal.clear()


def _leave_word(desk: Desk, campaign: Campaign, watch: Watch, error: LeaseLost | StoreError) -> None:
    """Keep how a campaign ended that the store cannot be told of now."""
    asked = watch.should_stop()
    state = CampaignState.FAILED if asked is None or watch.failure is not None else CampaignState.ABORTED
    if desk.journal is not None:
        words = LastWords(campaign_id=campaign.id, reason=asked or said_of(error), ended=state)
        desk.journal.note(words)


def _check_rig(check: Callable[[], None]) -> None:
    try:
        check()
    except (RigError, DiskFull) as error:
        raise _NotBegun(one_line(error)) from error


def _play_all(
    held: HeldRig, campaign: Campaign, runs: RunStore, watch: Watch, poll_s: float, envelopes: tuple[Envelope, ...]
) -> None:
    try:
        transport = connect(campaign.rig)
    except TransportError as error:
        raise _NotBegun(one_line(error)) from error
    operator = RemoteOperator(held, campaign, watch, poll_s=poll_s)
    try:
        settings = PlayerSettings(
            interlocks=tuple(map(interlock, campaign.interlocks)), envelopes=envelopes_of(campaign, envelopes)
        )
        sequence = _sequence(campaign, runs, watch, transport, operator, settings)
        for test in campaign.tests:
            while watch.should_hold() and not watch.should_stop():
                watch.waits(test.name)
                time.sleep(HOLD_POLL_S)
            if reason := watch.should_stop():
                raise _Ended(CampaignState.ABORTED, reason)
            _check_room(runs)
            operator.position = test.position
            start = partial(_ask_to_start, transport, operator, campaign) if test is campaign.tests[0] else None
            _play_test(held, campaign, test, runs, watch, sequence, start)
    finally:
        transport.close()


def _sequence(
    campaign: Campaign,
    runs: RunStore,
    watch: Watch,
    transport: Transport,
    operator: RemoteOperator,
    settings: PlayerSettings,
) -> Sequence:
    def tell(progress: Progress) -> None:
        watch.on_progress(replace(progress, text=runs.without_folder(progress.text)))

    def one(test: Test, out_dir: Path, setup: Setup) -> Path:
        return play(
            transport,
            test,
            out_dir,
            on_progress=tell,
            should_stop=watch.should_stop,
            should_hold=watch.should_hold,
            should_return=watch.should_return,
            specimen=campaign.specimen,
            campaign_id=campaign.id,
            test_id=test.name,
            operator=str(campaign.setup.get("operator", "")),
            setup=setup,
            settings=settings,
        )

    return Sequence(
        transport=transport,
        play=one,
        out_dir=runs.work_dir(campaign.id),
        operator=operator,
        clock=SystemClock(),
        warm_up=_warm_up(campaign, runs),
        setup=_setup(campaign, operator),
        tell=lambda text: operator.go_on(),
    )


def _warm_up(campaign: Campaign, runs: RunStore) -> Test | None:
    try:
        return None if campaign.warm_up is None else test_from_config(campaign.warm_up, runs.samples.excitations())
    except ExcitationError as error:  # as of a test: its samples are missing, or a later version refuses it
        raise _Ended(CampaignState.FAILED, f"warm-up: {one_line(error)}", pauses=False) from error


def _check_room(runs: RunStore) -> None:
    try:
        runs.check_room()
    except DiskFull as full:
        raise _Ended(CampaignState.FAILED, one_line(full)) from full


def _ask_to_start(transport: Transport, operator: RemoteOperator, campaign: Campaign) -> None:
    """Ask the operator before a rig that is not simulated moves, and before a latched fault is reset.

    A rig that another host has left under power comes to rest by its own watchdog first. Where the rig does not answer,
    or does not let itself be reset, the campaign waits for somebody who looks at the rig.
    """
    ends = time.monotonic() + FORMER_MASTER_S
    try:
        while look(transport)[1].state in POWERED and time.monotonic() < ends:
            operator.go_on()
            time.sleep(HOLD_POLL_S)
        ask_to_start(transport, operator, f"campaign {campaign.name!r}")
    except Declined:
        raise
    except RigError as error:
        raise _NotBegun(one_line(error)) from error


def _setup(campaign: Campaign, operator: RemoteOperator) -> Setup:
    """What is in the rig, as the campaign says; its operator is asked where a calibration has expired meanwhile."""
    calibrations = calibrations_from(campaign.setup.get("calibrations", ()))
    notes: tuple[str, ...] = ()
    try:
        check_valid(calibrations, datetime.now(UTC).date())
    except CalibrationExpired as expired:
        operator.confirm(f"{expired}. Go on with it?")
        notes = (f"the operator accepted: {expired}",)
    return Setup(
        specimen_serial=str(campaign.setup.get("specimen_serial", "")),
        fixture=str(campaign.setup.get("fixture", "")),
        oil=str(campaign.setup.get("oil", "")),
        calibrations=calibrations,
        notes=notes,
    )


def _play_test(
    held: HeldRig,
    campaign: Campaign,
    test: CampaignTest,
    runs: RunStore,
    watch: Watch,
    sequence: Sequence,
    start: Callable[[], None] | None,
) -> None:
    watch.begin(test.position)
    held.progress(campaign, test.position, Phase.CONNECTING, 0, "")
    path: Path | None
    failure: RigError | ExcitationError | None = None
    skipped = ""
    sequence.on_retry = lambda path: held.add_run(
        campaign, runs.describe(path, campaign_id=campaign.id, held_out=test.held_out)
    )
    try:
        made = test_from_config(test.config, runs.samples.excitations())
        if start is not None:
            start()
        played = sequence.run(made)
        path, skipped = played.path, played.skipped
    except RigError as error:
        path, failure = error.run_path, error
    except ExcitationError as error:  # a later version may refuse what an earlier one accepted
        path, failure = None, error
    if path is None and failure is not None and _can_wait(failure) and not runs.of_campaign(campaign.id):
        raise _NotBegun(one_line(failure))
    complete = False
    if path is not None:
        run = runs.describe(path, campaign_id=campaign.id, held_out=test.held_out)
        held.add_run(campaign, run)
        complete = run.status == "complete"
    if skipped:
        held.end_test(campaign, test.position, TestState.SKIPPED, skipped)
        return
    if not (complete and failure is None):
        asked = _asked_late(watch) if isinstance(failure, SessionLost) else watch.should_stop()
        state, reason = _how_it_ended(path, failure, asked or "stopped", wanted=asked is not None)
        reason = runs.without_folder(reason)
        held.end_test(campaign, test.position, TestState(state), reason)
        why = reason if state is CampaignState.ABORTED else f"test {test.name!r}: {reason}"
        raise _Ended(state, why, pauses=not isinstance(failure, REFUSED))
    held.end_test(campaign, test.position, TestState.DONE, "")


def _asked_late(watch: Watch) -> str | None:
    """The request to stop; where a stop was sent past the player, the request itself may come a moment later."""
    ends = time.monotonic() + LATE_ORDER_S
    while (asked := watch.should_stop()) is None and time.monotonic() < ends:
        time.sleep(_LATE_POLL_S)
    return asked


def _can_wait(failure: RigError | ExcitationError) -> bool:
    """Whether the rig cannot be used now but could be later, or the service was stopped while a question stood."""
    return isinstance(failure, AWAY) or (isinstance(failure, Declined) and str(failure) == SHUTDOWN)


def _how_it_ended(
    path: Path | None, failure: RigError | ExcitationError | None, asked: str, *, wanted: bool
) -> tuple[CampaignState, str]:
    """Aborted only where the rig did what was requested; a fault or a stop that failed is a failure.

    A stop before the first sample comes as a RigFault without a file. An operator who does not confirm aborts.
    """
    if isinstance(failure, Declined):
        return CampaignState.ABORTED, one_line(failure)
    if isinstance(failure, SessionLost) and wanted:  # the stop was sent past the player
        return CampaignState.ABORTED, asked
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
    return tuple(map(runs.without_folder, refused))
