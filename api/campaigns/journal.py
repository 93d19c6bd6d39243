"""The last words of a worker about its campaign, on its own disk, until the store has them."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Self

from api.campaigns.orders import Asked
from api.errors import ProcessError, one_line

__all__ = ["Journal", "LastWords"]

LOG = logging.getLogger("damper_rig.worker")
_BYTES = 8192  # taken when the worker starts: a disk that is full later does not matter
_LONGEST = 1500  # of a text, in characters: four bytes each at most


@dataclass(frozen=True, slots=True, kw_only=True)
class LastWords:
    """What was asked of a campaign over the line, and how it ended where the store could not be told."""

    campaign_id: str
    asked: str = Asked.NOTHING
    reason: str = ""
    ended: str = ""  # a final state; empty: it had not ended
    pauses: bool = True


class Journal:
    """A small file that is written in place and forced to the disk by a thread of its own."""

    def __init__(self, path: Path) -> None:
        """Open it and take its space; raises ProcessError."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
            old = os.pread(self._file, _BYTES, 0)
            os.pwrite(self._file, old.ljust(_BYTES), 0)
            os.fsync(self._file)
        except OSError as error:
            raise ProcessError(f"{path}: cannot be written: {one_line(error)}") from error
        self.last = _decoded(old)
        self._orders: SimpleQueue[LastWords | None] = SimpleQueue()
        self._thread = Thread(target=self._write, name="journal", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._orders.put(None)
        self._thread.join(2.0)

    def note(self, words: LastWords) -> None:
        """Keep these words instead of earlier ones. Never waits."""
        self.last = words
        self._orders.put(words)

    def clear(self) -> None:
        """The store has everything."""
        if self.last.campaign_id:
            self.note(LastWords(campaign_id=""))

    def _write(self) -> None:
        while (words := self._orders.get()) is not None:
            text = {key: value[:_LONGEST] if isinstance(value, str) else value for key, value in asdict(words).items()}
            try:
                os.pwrite(self._file, json.dumps(text, ensure_ascii=False).encode().ljust(_BYTES)[:_BYTES], 0)
                os.fsync(self._file)
            except OSError as error:
                LOG.error("the journal of the worker cannot be written: %s", one_line(error))
        os.close(self._file)


def _decoded(content: bytes) -> LastWords:
    with suppress(ValueError, TypeError):
        found = json.loads(content.strip() or b"{}")
        if isinstance(found, Mapping) and found:
            return LastWords(**found)
    return LastWords(campaign_id="")
