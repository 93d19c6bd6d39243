"""Handling of Ctrl-C: cleaning up is completed, and no library can swallow it."""

from __future__ import annotations

import signal
import subprocess
import sys

SCRIPT = """
import time
from api.cli.interrupt import ignore_signals, take_signals
take_signals()
try:
    try:
        print("ready", flush=True)
        time.sleep(30)
    except BaseException:
        pass  # as some library might
    print("swallowed", flush=True)
    try:
        time.sleep(30)
    finally:
        print("cleaning", flush=True)
        time.sleep(1.2)
        print("clean", flush=True)
except KeyboardInterrupt:
    ignore_signals()
    print("out", flush=True)
    time.sleep(0.3)
"""


def test_an_interruption_that_a_library_suppresses_is_raised_again_and_more_signals_do_not_stop_the_clean_up() -> None:
    with subprocess.Popen([sys.executable, "-c", SCRIPT], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.strip() in ("ready", "cleaning", "out"):
                process.send_signal(signal.SIGINT)
            if line.strip() == "cleaning":
                process.send_signal(signal.SIGTERM)
            if line.strip() == "out":
                break
            seen = line.strip()
        assert seen == "clean"
        assert process.wait(60) == 0


IMPATIENT = """
import os, signal, sys
import api.cli.main as cli

def interrupt():
    os.kill(os.getpid(), signal.SIGINT)

@cli.app.command()
def patient():
    interrupt()

say = cli._say
def say_among_signals(text):
    interrupt()
    say(text)
    interrupt()

cli._say = say_among_signals
sys.argv = ["damper-rig", "patient"]
cli.run()
"""


def test_a_signal_while_an_interrupted_command_says_so_changes_neither_its_status_nor_its_line() -> None:
    ended = subprocess.run([sys.executable, "-c", IMPATIENT], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stderr) == (1, "damper-rig: interrupted\n")
