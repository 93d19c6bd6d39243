"""The service as a process: one socket and one app, until SIGINT or SIGTERM."""

from __future__ import annotations

import ipaddress
import logging
import socket
from collections.abc import Callable
from types import FrameType

import uvicorn
from fastapi import FastAPI

from api.app import create_app
from api.errors import SettingsError, one_line
from api.service import Service
from api.settings import Settings
from api.store.database import Database

__all__ = ["serve_until_stopped"]

LOG = logging.getLogger("damper_rig.service")
_GRACE_S = 3


class _Server(uvicorn.Server):
    """A server that reports when it is ready and ends only after its rigs are safe.

    In uvicorn a second Ctrl-C skips the shutdown of the app; here every signal does the same.
    """

    def __init__(self, app: FastAPI, on_ready: Callable[[], None]) -> None:
        super().__init__(
            uvicorn.Config(
                app, log_level="warning", access_log=False, timeout_graceful_shutdown=_GRACE_S, lifespan="on"
            )
        )
        self._app, self._on_ready = app, on_ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_ready()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        service = getattr(self._app.state, "service", None)
        if isinstance(service, Service):
            service.closing.set()  # ends streamed answers, which the server would wait for
        self.should_exit = True


def serve_until_stopped(settings: Settings, *, on_ready: Callable[[str], None]) -> int:
    """Serve until SIGINT or SIGTERM; returns 0, or 1 where a rig was not released by its deadline.

    Raises SettingsError where the address cannot be listened on, StoreError where the store cannot be opened.
    """
    logging.basicConfig(level=logging.WARNING, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    with _listen(settings) as listening:
        Database(settings.store_url).close()  # an error in it is reported here, in one line
        if not _is_local(settings.host):
            LOG.warning("listening on %s without access control: anyone who can connect can move a rig", settings.host)
        host, port = listening.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        app = create_app(settings)
        _Server(app, lambda: on_ready(f"http://{shown}:{port}")).run(sockets=[listening])
    return 1 if getattr(app.state, "late", ()) else 0


def _listen(settings: Settings) -> socket.socket:
    try:
        [*_, (family, kind, protocol, _, address)] = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[:1]
        listening = socket.socket(family, kind, protocol)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
    except OSError as error:
        raise SettingsError(
            f"host {settings.host!r}, port {settings.port}: cannot listen there ({one_line(error)}): "
            "give another, or port 0 for a free one"
        ) from error
    return listening


def _is_local(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
