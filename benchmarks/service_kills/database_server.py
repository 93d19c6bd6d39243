"""A PostgreSQL server of its own, so that it can be killed."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

__all__ = ["DatabaseServer", "installed"]

READY_S = 120.0


def installed() -> Path | None:
    """The folder of the server's programs."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    return found[-1].parent if found else None


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])


class DatabaseServer:
    """On loopback, in ``folder``; trusts everybody there. It runs until the block ends."""

    def __init__(self, programs: Path, folder: Path) -> None:
        self._programs, self._folder, self.port = programs, folder, free_port()
        # PostgreSQL refuses to run as root
        self._user = "postgres" if os.geteuid() == 0 else None
        folder.mkdir()
        if self._user:
            shutil.chown(folder, self._user)

    def __enter__(self) -> Self:
        self._run("initdb", "-D", str(self._folder / "data"), "-A", "trust", "-U", "postgres", "-N")
        try:
            self.start()
        except BaseException:  # told to end while it started
            self.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def url(self) -> str:
        return f"postgresql+psycopg://postgres@127.0.0.1:{self.port}/postgres"

    def start(self) -> None:
        """Start it, again and again: what a killed server leaves ends only when its last process has ended."""
        ends = time.monotonic() + READY_S
        options = f"-p {self.port} -h 127.0.0.1 -k {self._folder} -c max_connections=100"
        while True:
            try:
                self._run("pg_ctl", "-D", str(self._folder / "data"), "-l", str(self._folder / "log"), "-w", "-o",
                          options, "start")  # fmt: skip
                return
            except subprocess.CalledProcessError:
                if time.monotonic() > ends:
                    raise
                time.sleep(0.2)

    def kill(self) -> None:
        """End its first process at once, as a crash would."""
        pid = int((self._folder / "data" / "postmaster.pid").read_text().splitlines()[0])
        os.kill(pid, signal.SIGKILL)

    def stop(self) -> None:
        """End it at once; no error where it does not run."""
        with suppress(subprocess.CalledProcessError):
            self._run("pg_ctl", "-D", str(self._folder / "data"), "-m", "immediate", "stop")

    def _run(self, program: str, *arguments: str) -> None:
        subprocess.run(
            [str(self._programs / program), *arguments],
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            user=self._user,
            cwd=self._folder,
        )
