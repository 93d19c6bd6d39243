"""Runs commands of damper-rig, each in a process of its own that is forked from this one, which has loaded them all.

A rig then costs a twentieth of a start anew, a service a fifth; from there on a command is as it always is: its
arguments, its environment, its folder, its streams, its signals and its exit status are its own. ``tests.starting``
starts this.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import select
import signal
import socket
import sys
from importlib import import_module
from typing import NoReturn

STATUS: list[int] = []  # of the command that this process has become, at its end


def load() -> None:
    """All that a rig and a service need, with the compiled loops of a rig."""
    import numpy as np

    for name in ("api.cli.main", "api.serving", "sim_rig.server", "sim_rig.can_server"):
        import_module(name)
    from sim_rig.plant import SimulatedPlant
    from sim_rig.specimens import SPECIMENS

    found = SPECIMENS["semi-active"]
    SimulatedPlant(found.damper, found.noise, seed=1, start_degc=25.0).play(np.zeros((1, 2)))
    gc.freeze()  # a collection in a child would copy what is loaded


def leave() -> None:
    """End a command without freeing, one by one, the objects that were loaded."""
    if STATUS:
        sys.stderr.flush()
        os._exit(STATUS[0])


def become(asked: bytes, streams: list[int], ours: list[int]) -> NoReturn:
    """Be the command that was asked for, to its end."""
    from api.cli.main import run

    for number, kept in enumerate(streams[:3]):
        os.dup2(kept, number)
    for kept in (*streams, *ours):
        os.close(kept)
    request = json.loads(asked)
    os.setsid()
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environ"])
    sys.argv = ["damper-rig", *request["arguments"]]
    try:
        run()  # which flushes what it has said
    except SystemExit as ended:
        STATUS.append(int(ended.code or 0))
        raise


def reap(ends: dict[int, int]) -> None:
    """Say of every process that has ended with which status."""
    for pid in list(ends):
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            os.write(ends[pid], str(os.waitstatus_to_exitcode(status)).encode())
            os.close(ends.pop(pid))


def serve(channel: socket.socket) -> None:
    """Start what is asked for until the other end closes."""
    woken, wakes = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    ends: dict[int, int] = {}
    while True:
        signal.signal(signal.SIGCHLD, lambda *_: None)  # without a handler nothing wakes the select
        signal.set_wakeup_fd(wakes, warn_on_full_buffer=False)
        ready, _, _ = select.select([channel, woken], [], [])
        if woken in ready:
            os.read(woken, 4096)
            reap(ends)
        if channel in ready:
            asked, streams, _, _ = socket.recv_fds(channel, 1 << 20, 4)
            if not asked:
                return
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            pid = os.fork()
            if not pid:
                channel.close()
                become(asked, streams, [woken, wakes, *ends.values()])
            ends[pid] = streams.pop()
            for kept in streams:
                os.close(kept)
            channel.send(str(pid).encode())
            reap(ends)  # it may have ended before anybody listened


if __name__ == "__main__":
    atexit.register(leave)  # before the libraries register what they do at the end: so it comes after all of that
    load()
    with socket.socket(fileno=int(sys.argv[1])) as channel:
        serve(channel)
