"""The worker's end of its lines: takes orders, and tells every service what the rig does."""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
from collections.abc import Callable
from threading import Event, Thread

from api.errors import ProcessError, one_line
from api.line.messages import MOST_BYTES, Message, encode, proof, read

__all__ = ["WorkerEnd"]

LOG = logging.getLogger("damper_rig.line")
_PROVE_S = 2.0  # for the other end to prove that it knows the secret
_BEHIND_BYTES = 2**20  # a service that reads so late gets no live samples until it has caught up
_CLOSE_S = 2.0

Answer = Message | Callable[[], Message]  # at once, or the work that leads to it, which may take seconds


class WorkerEnd:
    """Listens on a loopback port in a thread of its own, which does nothing else.

    ``obey`` is called in that thread with every order and must not wait: what takes time it returns as a function.
    """

    def __init__(self, obey: Callable[[Message], Answer]) -> None:
        self._obey = obey
        self.secret = secrets.token_hex(32)
        self.port = 0
        self._kept: dict[str, Message] = {}  # the newest of each kind, for whoever connects later
        self._open: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._listening = Event()
        self._thread = Thread(target=self._run, name="line", daemon=True)

    def start(self) -> None:
        """Listen; ``port`` is known when this returns."""
        self._thread.start()
        self._listening.wait()

    def keep(self, kind: str, value: Message) -> None:
        """Tell every service something, and whoever connects before there is a newer of this kind. Never waits."""
        self._soon(self._keep, {kind: value})

    def tell(self, message: Message) -> None:
        """Tell every service something that is worth nothing later. Never waits."""
        self._soon(self._send, message)

    def close(self, why: str) -> None:
        """Say goodbye and stop to listen."""
        if self._thread.is_alive():
            self._soon(self._send, {"bye": why})
            self._soon(self._loop.stop)
            self._thread.join(_CLOSE_S)

    def _soon(self, call: Callable[..., None], *arguments: Message) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *arguments)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._serve, "127.0.0.1", 0, limit=MOST_BYTES))
        self.port = server.sockets[0].getsockname()[1]
        self._listening.set()
        try:
            self._loop.run_forever()
        finally:
            server.close()
            for task in asyncio.all_tasks(self._loop):
                task.cancel()
            self._loop.run_until_complete(asyncio.sleep(0))
            self._loop.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            if not await asyncio.wait_for(self._proved(reader, writer), _PROVE_S):
                return
            for kept in self._kept.values():
                writer.write(encode(kept))
            self._open.add(writer)
            while (message := await read(reader)) is not None:
                self._answer(message, writer)
        except (
            TimeoutError,
            ProcessError,
            OSError,
            asyncio.CancelledError,
        ):  # the task of a connection is asked for nothing
            return
        finally:
            self._open.discard(writer)
            writer.close()

    async def _proved(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Whether the other end knows the secret; then this end has proved that it knows it too."""
        nonce = secrets.token_hex(16)
        writer.write(encode({"nonce": nonce}))
        said = await read(reader) or {}
        if not hmac.compare_digest(str(said.get("proof", "")), proof(self.secret, "service", nonce)):
            return False
        writer.write(encode({"proof": proof(self.secret, "worker", str(said.get("nonce", "")))}))
        return True

    def _answer(self, message: Message, writer: asyncio.StreamWriter) -> None:
        try:
            answer = self._obey(message)
        except Exception as error:  # a fault of this program must not end the line: the next order may be a stop
            LOG.exception("an order was not understood")
            answer = {"ok": False, "text": one_line(error)}
        if callable(answer):
            work = answer
            Thread(target=self._do, args=(work, message.get("n"), writer), name="order", daemon=True).start()
        else:
            writer.write(encode({"ack": message.get("n"), **answer}))

    def _do(self, work: Callable[[], Message], number: object, writer: asyncio.StreamWriter) -> None:
        try:
            answer = work()
        except Exception as error:  # noqa: BLE001 - whatever it was, the caller must hear it
            answer = {"ok": False, "text": one_line(error)}
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(writer.write, encode({"ack": number, **answer}))

    def _keep(self, message: Message) -> None:
        self._kept.update(dict.fromkeys(message, message))
        self._send(message)

    def _send(self, message: Message) -> None:
        data = encode(message)
        for writer in self._open:
            if writer.transport.get_write_buffer_size() < _BEHIND_BYTES:
                writer.write(data)
