"""The service as a process: one socket and one app, until SIGINT, SIGTERM, SIGHUP or SIGQUIT."""

from __future__ import annotations

import logging
import resource
import signal
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ipaddress import ip_address, ip_network
from types import FrameType

import uvicorn
from fastapi import FastAPI

from api.access.busy import Tracked
from api.access.connections import Connections, GuardedListener
from api.access.exposure import check_exposure, network_list
from api.access.hosts import is_loopback
from api.access.keys import KeyStore
from api.access.logs import start_log
from api.access.strict_http import StrictHttp
from api.app import create_app
from api.campaigns.envelopes import service_envelopes
from api.errors import SettingsError, one_line
from api.processes.lasting import keep_what_is_there
from api.processes.signals import ending_signals
from api.service import Service
from api.settings import LEAST_CONNECTIONS, Settings
from api.store.database import Database

__all__ = ["serve_until_stopped"]

LOG = logging.getLogger("damper_rig.service")
_GRACE_S = 3
_KEEP_ALIVE_S = 5
_FILES_BESIDE = 200  # descriptors that connections leave for rigs, run files, the store and jobs


class _Server(uvicorn.Server):
    """A server that reports when it is ready and ends only after its rigs are safe.

    In uvicorn a second Ctrl-C skips the shutdown of the app; here every signal does the same.
    """

    def __init__(
        self, app: FastAPI, settings: Settings, connections: Connections, on_ready: Callable[[], None]
    ) -> None:
        super().__init__(
            uvicorn.Config(
                Tracked(app, connections),
                lifespan="on",
                loop="asyncio",  # takes connections from the listener itself
                http=StrictHttp,
                ws="none",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,  # done for the proxies that the settings name, see api.access.layers
                timeout_keep_alive=_KEEP_ALIVE_S,
                timeout_graceful_shutdown=_GRACE_S,
                ssl_certfile=settings.tls_certificate or None,
                ssl_keyfile=settings.tls_key or None,
                ssl_context_factory=_tls if settings.tls_certificate else None,
            )
        )
        self._app, self._connections, self._on_ready = app, connections, on_ready

    async def on_tick(self, counter: int) -> bool:
        self._connections.sweep()
        return await super().on_tick(counter)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            keep_what_is_there()
            self._on_ready()

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Every signal that ends a process stops the server; uvicorn itself knows two of them."""
        with super().capture_signals():
            if threading.current_thread() is not threading.main_thread():
                yield
                return
            before = {number: signal.signal(number, self.handle_exit) for number in ending_signals()}
            try:
                yield
            finally:
                for number, handler in before.items():
                    signal.signal(number, handler)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        service = getattr(self._app.state, "service", None)
        if isinstance(service, Service):
            service.closing.set()  # ends streamed answers, which the server would wait for
        self.should_exit = True


def serve_until_stopped(settings: Settings, *, on_ready: Callable[[str], None]) -> int:
    """Serve until a signal ends the process; returns 0, or 1 where a rig was not released by its deadline.

    Raises SettingsError where the address cannot be listened on, StoreError where the store cannot be opened.
    """
    start_log(settings.log_format)
    service_envelopes(settings)  # an error in them is reported here, in one line
    with _bound(settings) as listening:  # before the store: an address that is none leaves no new store behind
        with Database(settings.store_url) as database:  # an error in it is reported here, in one line
            check_exposure(settings, keys_made=KeyStore(database).any_made())
        host, port = listening.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        scheme = "https" if settings.tls_certificate else "http"
        app = create_app(settings, connections=listening.connections)
        _Server(app, settings, listening.connections, lambda: on_ready(f"{scheme}://{shown}:{port}")).run(
            sockets=[listening]
        )
    return 1 if getattr(app.state, "late", ()) else 0


def _tls(config: uvicorn.Config, default: Callable[[], ssl.SSLContext]) -> ssl.SSLContext:
    """Python's recommended settings for a server; TLS 1.2 or later."""
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(str(config.ssl_certfile), config.ssl_keyfile)
    return context


def _connections(settings: Settings) -> Connections:
    """As many as the settings allow and the descriptors of this process are enough for; raises SettingsError."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = settings.connections + _FILES_BESIDE
    if soft != resource.RLIM_INFINITY and soft < wanted:
        soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    enough = wanted if soft == resource.RLIM_INFINITY else soft
    if enough < LEAST_CONNECTIONS + _FILES_BESIDE:
        raise SettingsError(
            f"this process may have {enough} files open: it needs {LEAST_CONNECTIONS + _FILES_BESIDE}, and "
            f"{wanted} for {settings.connections} connections: raise the limit (ulimit -Hn, or LimitNOFILE of its unit)"
        )
    proxies = network_list(settings.trusted_proxies)
    networks = [ip_network(proxy) for proxy in proxies]
    return Connections(
        most=min(settings.connections, enough - _FILES_BESIDE),
        most_per_address=settings.connections_per_address,
        header_s=settings.header_s,
        exempt=lambda address: is_loopback(address) or any(ip_address(address) in network for network in networks),
    )


def _bound(settings: Settings) -> GuardedListener:
    """A socket that has its address and takes no connection yet: the server listens once the app has started."""
    try:
        [*_, (family, kind, protocol, _, address)] = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[:1]
        listening = GuardedListener(family, kind, protocol)
        listening.connections = _connections(settings)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
    except OSError as error:
        raise SettingsError(
            f"host {settings.host!r}, port {settings.port}: cannot listen there ({one_line(error)}): "
            "give another, or port 0 for a free one"
        ) from error
    return listening
