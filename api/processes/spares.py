"""Descriptors that are kept open for nothing, so that there is one for a stop where the process may open no more."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from typing import Final

__all__ = ["Spares"]

SPARES: Final = 16  # for the connection of a stop, for one to its rig, and for what others take until they are refused
LENT_S: Final = 1.0  # for which what was given is not taken back: until it is used


class Spares:
    """Used by the thread of one event loop alone."""

    def __init__(self) -> None:
        self._held: list[int] = []
        self._lent, self._lent_until_s = 0, 0.0
        self.restore()

    @property
    def scarce(self) -> bool:
        """Whether the process has no descriptors but these."""
        return len(self._held) + self._lent < SPARES

    def give(self) -> bool:
        """Free one; False where there is none."""
        if not self._held:
            return False
        os.close(self._held.pop())
        return True

    def lend(self, count: int) -> None:
        """Free so many for a while, as far as there are any."""
        self._lent_until_s = time.monotonic() + LENT_S
        self._lent += sum(self.give() for _ in range(count))

    def restore(self) -> None:
        """Take back what was given, as far as the process may open it."""
        if time.monotonic() < self._lent_until_s:
            return
        self._lent = 0
        with suppress(OSError):
            while self.scarce:
                self._held.append(os.open(os.devnull, os.O_RDONLY))

    def close(self) -> None:
        while self.give():
            pass
