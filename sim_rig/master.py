"""Who commands the rig: one host at a time, whose commands and heartbeats must each be newer than the last one."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from typing import Final

from rigctl.session import NOBODY, NUMBERS, may_be_next
from sim_rig.errors import RequestRefused

LEASE_S: Final = 1.0
"""A host that is silent for so long loses an unpowered rig to the next claim. Heartbeats come at least every 0.25 s:
four may be lost. Twice as long keeps a rig of a dead host from the next one for 2 s; half of it gives a busy host's
rig away."""


class Master:
    """The session of the host that commands the rig.

    A claim begins a session with a number that was not used before, so that nothing sent in an earlier session has an
    effect. Within a session a command is obeyed once, and only if its number is higher than every earlier one.
    """

    def __init__(self, now: Callable[[], float], *, first: int | None = None) -> None:
        self._now = now
        self._following = _after(secrets.randbelow(NUMBERS) if first is None else first - 1)
        self.session, self.nonce = NOBODY, 0
        self._command = self._beat = 0
        self._beat_at = self._heard_at = self._ordered_at = now()
        self.foreign = 0  # requests refused because of their session or their number

    @property
    def silent_s(self) -> float:
        """Time since the last heartbeat of the master, or since supervision began."""
        return self._now() - self._beat_at

    def claim(self, nonce: int, *, powered: bool) -> bool:
        """Begin a session for the host with this nonce; True where it is a new one, False where it has begun already.

        Raises
        ------
        RequestRefused
            When another host commands the rig: it has power, or was heard within the lease.
        """
        if self.session != NOBODY and nonce == self.nonce:
            return False
        if self.session != NOBODY and (powered or self.silent_s <= LEASE_S):
            self.foreign += 1
            raise RequestRefused("another host commands the rig")
        if powered:
            raise RequestRefused("the rig is still coming to rest")
        self.session, self.nonce = self._following, nonce
        self._command = self._beat = 0
        self._following = _after(self._following)
        self.supervise()
        self._heard_at = self._ordered_at = self._beat_at
        return True

    def obeys(self, session: int, number: int) -> bool:
        """Whether a command is new: True once for each number; False for a repetition of the last one.

        Raises
        ------
        RequestRefused
            When the command belongs to another session, is older than the last one, or too far ahead of it.
        """
        self.check(session)
        if number == self._command:
            return False
        if not may_be_next(number, self._command, self._now() - self._ordered_at):
            self.foreign += 1
            raise RequestRefused(f"command {number} does not follow command {self._command}")
        self._command, self._ordered_at = number, self._now()
        return True

    def check(self, session: int) -> None:
        """Raise RequestRefused unless the session is the master's."""
        if not self.owns(session):
            self.foreign += 1
            raise RequestRefused(f"session {session} does not command the rig")

    def owns(self, session: int) -> bool:
        return session != NOBODY and session == self.session

    def beat(self, session: int, number: int) -> bool:
        """Accept a heartbeat; False, without effect, for one of another session or one that cannot be the next."""
        if not self.owns(session) or not may_be_next(number, self._beat, self._now() - self._heard_at):
            return False
        self._beat, self._heard_at = number, self._now()
        self.supervise()
        return True

    @property
    def last_command(self) -> int:
        """The number of the newest command of this session."""
        return self._command

    def supervise(self) -> None:
        """Begin to count the master's silence."""
        self._beat_at = self._now()

    def end(self) -> None:
        """End the session: from now on nobody commands the rig."""
        self.session = NOBODY


def _after(session: int) -> int:
    """Return the next session's number; its low four bits, which travel in the CAN status, are never 0."""
    following = (session + 1) % NUMBERS
    return following if following & 0xF else following + 1
