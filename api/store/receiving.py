"""What all uploads share: how many come at once, how large and how fast, and the room for them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterable, AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Final

from sqlalchemy import Connection, func, select

from api.errors import Busy, DiskFull, TooLarge, TooSlow
from api.store.database import Database
from api.store.disk_space import DiskSpace
from api.store.part_file import PartFile
from api.store.tables import samples, uploads

__all__ = ["Receiving", "uploaded_bytes"]

MOST_BYTES: Final = 512 * 2**20  # of an uploaded file
MOST_AT_ONCE: Final = 8  # uploads; each holds a connection, two descriptors and for a moment a thread
RETRY_AFTER_S: Final = 5
PIECE_S = 30.0  # longest time between two pieces of a body
LOOK_EVERY_BYTES: Final = 16 * 2**20  # at the disk, while an upload comes in: MOST_AT_ONCE times this may come between


class Receiving:
    """Takes the bodies of uploads, for one service; ``most_total``: of the bytes of all that are kept."""

    def __init__(self, database: Database, space: DiskSpace, most_total: int) -> None:
        self.space, self._database, self._most_total = space, database, most_total
        self._under_way = 0

    @contextmanager
    def turn(self, name: str, length: int) -> Iterator[None]:
        """While an upload comes, of which ``length`` bytes are announced (0: none). Raises TooLarge and Busy."""
        self._check_size(name, length)
        if self._under_way >= MOST_AT_ONCE:
            raise Busy(f"{MOST_AT_ONCE} uploads are under way: send {name} again", retry_after_s=RETRY_AFTER_S)
        self._under_way += 1
        try:
            yield
        finally:
            self._under_way -= 1

    def check_room(self, needed: int) -> None:
        """Raise DiskFull where there is no room for so many bytes."""
        self.space.check(needed)
        with self._database.reading() as connection:
            self.check_total(connection, needed)

    def check_total(self, connection: Connection, more: int) -> None:
        """Raise DiskFull where all uploads together would take too much."""
        total = uploaded_bytes(connection)
        if total + more > self._most_total:
            raise DiskFull(
                f"uploads take {total / 1e9:.3g} of {self._most_total / 1e9:.3g} GB: remove some, or set "
                "most_upload_bytes_total"
            )

    async def write(self, part: PartFile, name: str, content: AsyncIterable[bytes]) -> None:
        """Write the bytes as they come; the space on the disk is looked at again and again.

        Raises TooLarge, TooSlow and DiskFull.
        """
        looked = 0
        async for piece in _in_time(name, content):
            self._check_size(name, part.size + len(piece))
            await asyncio.to_thread(part.write, piece)
            if part.size - looked >= LOOK_EVERY_BYTES:
                looked = part.size
                self.space.check()
        await asyncio.to_thread(part.sync)

    def _check_size(self, name: str, size: int) -> None:
        if size > MOST_BYTES:
            raise TooLarge(f"{name} is larger than {MOST_BYTES} bytes: divide it into several")


def uploaded_bytes(connection: Connection) -> int:
    """Size of all uploaded runs and excitations that are kept."""
    kept = select(func.coalesce(func.sum(uploads.c.size_bytes), 0)).where(uploads.c.removed_at_s.is_(None))
    return sum(int(connection.scalar(query) or 0) for query in (kept, select(func.sum(samples.c.size_bytes))))


async def _in_time(name: str, content: AsyncIterable[bytes]) -> AsyncIterator[bytes]:
    """The pieces of a body; TooSlow where one does not come in time."""
    pieces = aiter(content)
    while True:
        try:
            async with asyncio.timeout(PIECE_S):
                piece = await anext(pieces)
        except StopAsyncIteration:
            return
        except TimeoutError as error:
            raise TooSlow(f"{name}: nothing came for {PIECE_S:g} s: send it again") from error
        yield piece
