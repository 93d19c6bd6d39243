"""bluesky-queueserver with its HTTP server, in an environment of its own: what the service is measured beside.

The environment is made once under ``build/``; Redis is the system's ``redis-server``, every write on the disk,
which is what the service promises for an accepted campaign.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
import venv
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from socket import create_server
from urllib.error import URLError
from urllib.request import Request, urlopen

__all__ = ["ADD", "HEADER", "queueserver"]

HOME = Path("build/queueserver")
PACKAGES = (
    "bluesky-queueserver==0.0.25",
    "bluesky-httpserver==0.0.14",
    "pandas",
)  # it imports pandas, and does not say so
KEY = "benchmark0key"
HEADER = f"Authorization: ApiKey {KEY}"
ADD = b'{"item": {"name": "count", "args": [["det1", "det2"]], "kwargs": {"num": 5}, "item_type": "plan"}}'
READY_S = 120.0


@contextmanager
def queueserver(folder: Path) -> Iterator[str | None]:
    """The address of its HTTP server, its queue empty; None, after a line that says why, where it cannot be run."""
    if shutil.which("redis-server") is None:
        print("bluesky-queueserver: not measured: redis-server is not installed")
        yield None
        return
    python = _environment()
    redis, control, info, http = (_free_port() for _ in range(4))
    environ = {
        **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        "QSERVER_ZMQ_CONTROL_ADDRESS": f"tcp://127.0.0.1:{control}",
        "QSERVER_ZMQ_INFO_ADDRESS": f"tcp://127.0.0.1:{info}",
        "QSERVER_HTTP_SERVER_SINGLE_USER_API_KEY": KEY,
    }
    commands = [
        ["redis-server", "--port", str(redis), "--dir", str(folder), "--appendonly", "yes", "--appendfsync", "always"],
        [
            str(python.parent / "start-re-manager"),
            *("--zmq-control-addr", f"tcp://127.0.0.1:{control}", "--zmq-info-addr", f"tcp://127.0.0.1:{info}"),
            *("--redis-addr", f"127.0.0.1:{redis}", "--console-output", "OFF", "--zmq-publish-console", "OFF"),
        ],
        [str(python), "-m", "uvicorn", "bluesky_httpserver.server:app", "--port", str(http), "--log-level", "warning"],
    ]
    with ExitStack() as stack:
        for command in commands:
            log = stack.enter_context((folder / f"{Path(command[0]).name}.log").open("wb"))
            process = stack.enter_context(subprocess.Popen(command, env=environ, stdout=log, stderr=log))
            stack.callback(process.terminate)
        url = f"http://127.0.0.1:{http}"
        yield url if _is_ready(url) else None


def _environment() -> Path:
    """The interpreter of the environment, made where it is not there yet."""
    python = (HOME / "bin" / "python").absolute()
    if not python.exists():
        print(f"making {HOME} for {', '.join(PACKAGES)}", flush=True)
        venv.create(HOME, with_pip=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    return python


def _is_ready(url: str) -> bool:
    ends = time.monotonic() + READY_S
    request = Request(f"{url}/api/status", headers=dict([HEADER.split(": ", 1)]))
    while time.monotonic() < ends:
        try:
            with urlopen(request, timeout=5) as answer:
                if json.load(answer).get("manager_state") == "idle":
                    return True
        except (URLError, OSError, ValueError):
            pass
        time.sleep(0.5)
    print(f"bluesky-queueserver: not measured: no answer within {READY_S:g} s", file=sys.stderr)
    return False


def _free_port() -> int:
    with create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])
