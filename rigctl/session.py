"""What a host counts while it commands a rig: its session, its commands, its heartbeats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

NUMBERS: Final = 1 << 16  # sessions, runs, commands and heartbeats are counted modulo this
NOBODY: Final = 0  # the session of a rig without a master; a stop with it is obeyed from anybody


WINDOW: Final = 1024
"""How far ahead a command or a heartbeat may be, so that one forged or damaged number cannot deny the owner's next
ones for long. A host that hears nothing gives up after 8 s (5 s for an answer, 3 s for the stop) and tries at most
every 10 ms: 800 numbers. Half would lock out a host whose wire comes back after 6 s."""
LOST_AT_ONCE: Final = 16  # numbers that may be lost in no time: a burst that a gateway delivers late, damaged frames
SHORTEST_S: Final = 1e-3  # between two heartbeats: the fastest exchange over any of the wires


def may_be_next(number: int, than: int, since_s: float) -> bool:
    """Whether a number follows another one that came `since_s` ago, and the host can have counted so far since."""
    ahead = (number - than) % NUMBERS
    return 0 < ahead <= min(LOST_AT_ONCE + since_s / SHORTEST_S, WINDOW)


def nearest(number: int, following: int, modulo: int) -> int:
    """Return the whole count, nearest to `following`, that a number modulo `modulo` means."""
    return following + (number - following + modulo // 2) % modulo - modulo // 2


def is_newer(number: int, than: int) -> bool:
    """Whether a number follows another one, modulo 65 536: it is ahead by less than half of all numbers (RFC 1982)."""
    return 0 < (number - than) % NUMBERS < NUMBERS // 2


@dataclass(slots=True)
class Session:
    """One host's session on one rig; every command and every heartbeat has a number of its own, always a higher one.

    The rig obeys a number once and never an older one, so that a frame that was delayed or repeated has no effect.
    """

    number: int = NOBODY
    commands: int = 0
    heartbeats: int = 0

    @property
    def claimed(self) -> bool:
        return self.number != NOBODY

    def next_command(self) -> int:
        self.commands = (self.commands + 1) % NUMBERS
        return self.commands

    def next_heartbeat(self) -> int:
        self.heartbeats = (self.heartbeats + 1) % NUMBERS
        return self.heartbeats
