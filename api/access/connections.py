"""How many connections are open, and which one goes when there are too many.

A connection is counted from the moment at which it is accepted, before TLS and before its first byte. It is *busy*
while a request is answered on it, *idle* otherwise, and *known* once a request on it was let through. Two rules:

- one that is idle for longer than ``header_s`` is closed: whoever sends headers slowly, or nothing, gets no longer;
- at the cap, a new connection takes the place of the one that is idle for the longest time, those that are not known
  first. So idle sockets, however many, keep nobody out who sends a request at once: a stop always finds a place.

Where the process may open no more files, a connection takes a spare descriptor, or the place of an idle one; requests
are then refused unless they stop a rig, see :class:`api.access.busy.Busy`.

Requests that last (live samples) may fill all but ``RESERVE`` places, see :class:`api.access.busy.Busy`.
"""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from api.access.hosts import is_loopback
from api.errors import TOO_FEW_FILES
from api.processes.spares import Spares

__all__ = ["Connections", "GuardedListener"]

Peer = tuple[str, int]  # address and port


@dataclass(slots=True)
class _Open:
    socket: socket.socket
    idle_since_s: float
    busy: int = 0  # requests that are being answered
    known: bool = False


class Connections:
    """The open connections of one listening socket; used by the thread of its event loop alone."""

    def __init__(
        self,
        *,
        most: int,
        most_per_address: int,
        header_s: float,
        exempt: Callable[[str], bool] = is_loopback,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """``exempt``: addresses without a cap of their own, as loopback or a proxy for many others."""
        self.spares = Spares()
        self.most, self.most_per_address, self.header_s = most, most_per_address, header_s
        self._exempt, self._clock = exempt, clock
        self._open: dict[Peer, _Open] = {}

    def __len__(self) -> int:
        return len(self._open)

    def admit(self, peer: Peer, connection: socket.socket) -> bool:
        """Whether it may stay; another one may have been closed for it."""
        self._forget_closed()
        address = peer[0]
        if not self._exempt(address):
            same = [one for (where, _), one in self._open.items() if where == address]
            if len(same) >= self.most_per_address and not self._make_room(same):
                return False
        if len(self._open) >= self.most and not self._make_room(list(self._open.values())):
            return False
        self._open[peer] = _Open(socket=connection, idle_since_s=self._clock())
        return True

    def make_way(self) -> bool:
        """Free a descriptor for a new connection; False where none can be had."""
        return self.spares.give() or self._make_room(list(self._open.values()))

    def begins(self, peer: Peer) -> None:
        """A request has come on this connection, with all its headers."""
        if (one := self._open.get(peer)) is not None:
            one.busy += 1

    def ends(self, peer: Peer) -> None:
        """It is answered."""
        if (one := self._open.get(peer)) is not None:
            one.busy -= 1
            one.idle_since_s = self._clock()

    def is_known(self, peer: Peer) -> None:
        """A request on this connection was let through."""
        if (one := self._open.get(peer)) is not None:
            one.known = True

    def sweep(self) -> None:
        """Close what was idle for too long, and take back spare descriptors."""
        self.spares.restore()
        self._forget_closed()
        now_s = self._clock()
        for one in self._open.values():
            if not one.busy and now_s - one.idle_since_s > self.header_s:
                _shut(one.socket)

    def by_address(self) -> Counter[str]:
        """How many are open from each address."""
        self._forget_closed()
        return Counter(address for address, _ in self._open)

    def _make_room(self, among: list[_Open]) -> bool:
        idle = [one for one in among if not one.busy and one.socket.fileno() >= 0]
        if not idle:
            return False
        oldest = min(idle, key=lambda one: (one.known, one.idle_since_s))
        for peer, one in list(self._open.items()):
            if one is oldest:
                del self._open[peer]
        _shut(oldest.socket)
        return True

    def _forget_closed(self) -> None:
        for peer in [peer for peer, one in self._open.items() if one.socket.fileno() < 0]:
            del self._open[peer]


def _shut(connection: socket.socket) -> None:
    """End it for both sides; the event loop, which owns it, sees its end and closes it."""
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)


class GuardedListener(socket.socket):
    """A listening socket that hands out only the connections that are admitted."""

    connections: Connections

    # Any: an address of Python's socket module
    def accept(self) -> tuple[socket.socket, Any]:
        """Raises ConnectionAbortedError for one that is not admitted: an event loop then takes the next."""
        try:
            connection, address = super().accept()
        except OSError as error:
            if error.errno in TOO_FEW_FILES and self.connections.make_way():
                raise ConnectionAbortedError("it is taken as soon as a descriptor is free") from error
            raise
        if not self.connections.admit(address[:2], connection):
            connection.close()
            raise ConnectionAbortedError("too many connections")
        return connection, address
