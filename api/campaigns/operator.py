"""The operator of a campaign, asked through the store: over HTTP and on the live page."""

from __future__ import annotations

import math
import time
from contextlib import suppress

from api.campaigns.held_rig import HeldRig
from api.campaigns.records import Campaign
from api.campaigns.watch import Watch
from api.errors import StoreError
from rigctl.errors import Declined
from rigctl.progress import Phase

__all__ = ["YES", "RemoteOperator"]

YES = ("y", "yes")


class RemoteOperator:
    """Shows a question with the campaign and waits for the answer, as long as the campaign may run.

    The rig has no power meanwhile, and the lease on it is kept.
    """

    def __init__(self, held: HeldRig, campaign: Campaign, watch: Watch, *, poll_s: float) -> None:
        self._held, self._campaign, self._watch, self._poll_s = held, campaign, watch, poll_s
        self.position = 0  # of the test that asks
        self.is_there = True  # a question waits until somebody comes

    def confirm(self, text: str) -> None:
        if self._asked(text).strip().lower() not in YES:
            raise Declined(f"the operator did not confirm: {text}")

    def number(self, text: str, unit: str) -> float:
        question = f"{text}, {unit}"
        while True:
            answer = self._asked(question)
            try:
                value = float(answer.replace(",", "."))
            except ValueError:
                value = math.nan
            if math.isfinite(value):
                return value
            question = f"{text}, {unit}: {answer[:40]!r} is no number"

    def go_on(self) -> None:
        """Raise Declined where the campaign has to end."""
        if reason := self._watch.should_stop():
            raise Declined(reason)

    def _asked(self, question: str) -> str:
        self._held.ask(self._campaign, question)
        self._held.progress(self._campaign, self.position, Phase.WAITING, 0, question)
        answer: str | None = None
        try:
            while answer is None:
                self.go_on()
                time.sleep(self._poll_s)
                with suppress(StoreError):  # the watch ends the campaign where the store stays away
                    answer = self._held.answer(self._campaign)
        finally:
            with suppress(StoreError):
                self._held.close_question(self._campaign)
        return answer
