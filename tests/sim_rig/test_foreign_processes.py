"""A controller of another make in a process of its own, its host in another: real sockets, real time, kill -9."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from rigctl.address import connect
from rigctl.device import Fault, RigState
from rigctl.errors import TransportError
from rigctl.machines.instrument import LiveRecord, connect_instrument
from rigctl.player import play
from rigctl.runfile import read_run
from tests.sim_rig.foreign import EXAMPLES, slow_sine

SERVE = """
import sys
from sim_rig.foreign.serving import ControllerKind, serve_controller
kind, address, amplifier = sys.argv[1:]
ready = lambda url: print("ready", url, flush=True)
serve_controller(ControllerKind(kind), address, amplifier=amplifier, on_ready=ready)
"""
INSTRUMENT = EXAMPLES.parent / "instruments" / "amplifier.toml"
HOST = """
import sys
from rigctl.address import connect
from rigctl.machines.instrument import LiveRecord, connect_instrument
from rigctl.player import play
from tests.sim_rig.foreign import slow_sine
play(connect(sys.argv[1]), slow_sine(60.0), sys.argv[2], on_progress=lambda p: print(p.phase, flush=True))
"""
PATIENCE_S = 60.0


@contextmanager
def a_process(*words: str) -> Iterator[subprocess.Popen[str]]:
    line = [sys.executable, "-c", *words]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, cwd=EXAMPLES.parents[1]) as process:
        try:
            yield process
        finally:
            process.kill()


def said(process: subprocess.Popen[str], word: str) -> str:
    """The line that begins with a word."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(word):
            return line.strip()
    raise AssertionError(f"the process never said {word}")


@pytest.mark.slow
def test_a_plc_in_its_own_process_has_one_master_and_stops_when_that_is_killed(tmp_path: Path) -> None:
    with a_process(SERVE, "plc", "modbus://127.0.0.1:0", "modbus://127.0.0.1:0") as controller:
        port = said(controller, "ready").rsplit(":", 1)[1]
        text = (EXAMPLES / "plc_streamed.toml").read_text(encoding="utf-8").replace("port = 5021", f"port = {port}")
        text = text.replace("longest_gap = 2 ", "longest_gap = 20 ")  # of a computer that does other work
        rig = tmp_path / "rig.toml"
        rig.write_text(text, encoding="utf-8")
        port = said(controller, "ready").rsplit(":", 1)[1]
        text = INSTRUMENT.read_text(encoding="utf-8").replace("port = 5023", f"port = {port}")
        (tmp_path / "amplifier.toml").write_text(text, encoding="utf-8")
        instrument = connect_instrument(str(tmp_path / "amplifier.toml"))
        live = LiveRecord(instrument)
        mine = connect(str(rig))
        with live.in_background():
            run = read_run(play(mine, slow_sine(1.0), tmp_path))
        assert run.status == "complete"
        record = live.finish()
        instrument.close()
        assert record.channels[0].values.size >= 1.5 * record.sample_rate_hz  # ramps too, over its own wire
        with closing(connect(str(rig))) as second, pytest.raises(TransportError):
            second.identify(0.25)  # the PLC has one connection, and it is taken
        mine.close()
        with a_process(HOST, str(rig), str(tmp_path)) as host:
            said(host, "running")
            host.kill()
            host.wait()
        ends = time.monotonic() + PATIENCE_S
        with closing(connect(str(rig))) as latched:
            while (status := latched.status(PATIENCE_S)).state is not RigState.FAULT_DISABLED:
                assert time.monotonic() < ends, status
                time.sleep(0.05)
        assert status.faults is Fault.HEARTBEAT
