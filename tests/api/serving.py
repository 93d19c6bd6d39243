"""An app behind a real socket, in a thread of the test's own process."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

import httpx
import uvicorn
from starlette.types import ASGIApp

from api.access.strict_http import StrictHttp


@contextmanager
def serving(app: ASGIApp) -> Iterator[httpx.Client]:
    """A client of the app; the server has ended when the block ends."""
    config = uvicorn.Config(app, http=StrictHttp, log_level="critical", lifespan="on", timeout_graceful_shutdown=3)
    server = uvicorn.Server(config)
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP) as listening:  # TCP: sends at once
        listening.bind(("127.0.0.1", 0))
        thread = Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        ends = time.monotonic() + 20
        while not server.started:
            assert thread.is_alive()
            assert time.monotonic() < ends
            time.sleep(0.01)
        try:
            with httpx.Client(base_url=f"http://127.0.0.1:{listening.getsockname()[1]}", timeout=30) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join(20)
