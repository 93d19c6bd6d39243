"""A connection to a service that breaks, and a service that answers as it is told: over real sockets."""

from __future__ import annotations

import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from threading import Thread
from urllib.parse import urlsplit

REASONS = {200: "OK", 429: "Too Many Requests", 503: "Service Unavailable"}


@dataclass(slots=True)
class Told:
    """What a told service was asked, in order: the first line of each request, and all of its header."""

    url: str
    asked: list[str] = field(default_factory=list)
    headers: list[str] = field(default_factory=list)


@contextmanager
def cutting(url: str, *, after: int, times: int) -> Iterator[str]:
    """An address that leads to ``url`` and cuts the first ``times`` connections after ``after`` bytes of answers."""
    parts = urlsplit(url)
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def lead() -> None:
            left = times
            with suppress(OSError):
                while True:
                    ours, _ = listening.accept()
                    limit = after if left > 0 else None
                    left -= 1
                    Thread(target=_forward, args=(ours, (parts.hostname, parts.port), limit), daemon=True).start()

        Thread(target=lead, daemon=True).start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        listening.shutdown(socket.SHUT_RDWR)


def _forward(ours: socket.socket, to: tuple[str, int], limit: int | None) -> None:
    with ours, socket.create_connection(to) as its, suppress(OSError):
        Thread(target=_copy, args=(ours, its, None), daemon=True).start()
        _copy(its, ours, limit)
        ours.shutdown(socket.SHUT_RDWR)


def _copy(source: socket.socket, target: socket.socket, limit: int | None) -> None:
    with suppress(OSError):
        while part := source.recv(4096):
            if limit is not None and len(part) >= limit:
                target.sendall(part[:limit])
                return
            limit = None if limit is None else limit - len(part)
            target.sendall(part)


@contextmanager
def told(statuses: Sequence[int], body: bytes) -> Iterator[Told]:
    """A service that answers one request a connection with these statuses in order; 0: no answer at all."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        service = Told(f"http://127.0.0.1:{listening.getsockname()[1]}")

        def answer() -> None:
            with suppress(OSError):
                for status in statuses:
                    ours, _ = listening.accept()
                    with ours:
                        asked = ours.recv(65536).decode()
                        service.asked.append(asked.split(" HTTP")[0])
                        service.headers.append(asked)
                        if status:
                            head = f"HTTP/1.1 {status} {REASONS[status]}\r\nconnection: close\r\n"
                            ours.sendall(f"{head}content-length: {len(body)}\r\n\r\n".encode() + body)

        thread = Thread(target=answer, daemon=True)
        thread.start()
        yield service
        with suppress(OSError):
            listening.shutdown(socket.SHUT_RDWR)
        thread.join(10)
