"""Simulated controllers of other makes in their own processes, driven by the maps of examples/rigs in real time.

Each plays a test; then its host is killed with SIGKILL in motion, some times, and the controller has to come to rest,
switch off and latch a fault by itself. ``python -m benchmarks.bench_controllers 3`` kills three hosts of each.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.address import connect
from rigctl.device import Control, RigState
from rigctl.machines.rig_map import read_rig_map
from rigctl.player import play
from rigctl.runfile import read_run

EXAMPLES = Path(__file__).parent.parent / "examples" / "rigs"
MAPS = {  # map: kind of controller, address, and what of the map is replaced by the real one
    "plc_streamed": ("plc", "modbus://127.0.0.1:0", "port = 5021"),
    "plc_generator": ("plc", "modbus://127.0.0.1:0", "port = 5021"),
    "plc_can": ("plc", "can://loopback/{name}", 'channel = "plc"'),
    "motion_buffered": ("motion", "modbus://127.0.0.1:0", "port = 5022"),
    "ds402": ("ds402", "can://loopback/{name}", 'channel = "ds402"'),
    "console_file": ("console", "files://{folder}", 'folder = "console"'),
}
REST_S = 5.0
HOST = "import sys, benchmarks.bench_controllers as b; b.host(*sys.argv[1:])"


def a_sine(rate_hz: float, seconds: float) -> Test:
    """10 mm at 1 Hz."""
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    x = 0.01 * np.sin(2 * np.pi * time_s)
    period = round(rate_hz)
    excitation = Excitation(
        kind=Kind.SINE, sample_rate_hz=rate_hz, period_samples=period, displacement_m=x, current_a=None, design={}
    )
    return Test(name="sine", excitation=excitation)


def host(rig: str, folder: str) -> None:
    """Play for a minute, in a process of its own, and say that it moves."""
    rate = read_rig_map(rig).clock.rate_hz
    with closing(connect(rig)) as wire:
        play(wire, a_sine(rate, 60.0), folder, on_progress=lambda p: print(p.phase, flush=True))


@contextmanager
def a_controller(name: str, folder: Path) -> Iterator[str]:
    """A controller in its own process, and the path of a map with its real address."""
    kind, address, placeholder = MAPS[name]
    bus = f"bench-{os.getpid()}-{kind}"
    address = address.format(name=bus, folder=folder / "console")
    line = [sys.executable, "-m", "api.cli", "sim", "--controller", kind, "--listen", address]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            real = process.stdout.readline().split()[-1]
            replaced = {
                "modbus": f"port = {real.rsplit(':', 1)[-1]}",
                "can": f'channel = "{bus}"',
                "files": f'folder = "{folder / "console"}"',
            }[real.split(":", 1)[0]]
            text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8").replace(placeholder, replaced)
            for beside in ("ds402.eds", "plc_can.dbc"):
                shutil.copy(EXAMPLES / beside, folder)
            path = folder / f"{name}.toml"
            path.write_text(text, encoding="utf-8")
            yield str(path)
        finally:
            process.terminate()


def kill_one(rig: str, folder: Path) -> tuple[bool, float]:
    """Kill a host in motion; whether the controller rests, off, with a latched fault, and after how long."""
    with subprocess.Popen([sys.executable, "-c", HOST, rig, str(folder)], stdout=subprocess.PIPE, text=True) as one:
        assert one.stdout is not None
        for line in one.stdout:
            if line.strip() == "starting":
                break
        time.sleep(2.0)  # ramp and motion
        one.kill()
    killed = time.monotonic()
    with closing(connect(rig)) as wire:
        while (status := wire.status(1.0)).state is not RigState.FAULT_DISABLED:
            if time.monotonic() - killed > REST_S:
                return False, REST_S
            time.sleep(0.02)
        after = time.monotonic() - killed
        first = status.displacement_m
        time.sleep(0.3)
        rests = abs(wire.status(1.0).displacement_m - first) < 1e-4
        wire.claim(1.0)
        wire.command(Control.DISABLE | Control.RESET, status.run_id, 2.0)
        wire.release(1.0)
    return rests and bool(status.faults), after


def main(kills: float = 5) -> None:
    """Raises SystemExit where a test was not whole or a controller did not stop."""
    bad = 0
    for name in MAPS:
        with tempfile.TemporaryDirectory() as text:
            folder = Path(text)
            with a_controller(name, folder) as rig:
                with closing(connect(rig)) as wire:
                    run = read_run(play(wire, a_sine(read_rig_map(rig).clock.rate_hz, 5.0), folder))
                    missed = getattr(wire, "interpolated", 0)
                found = [kill_one(rig, folder) for _ in range(int(kills))]
        stopped = sum(rests for rests, _ in found)
        bad += (run.status != "complete") + (stopped < len(found))
        print(
            f"{name}: {run.samples} samples {run.status}, {missed} of them missed and interpolated; host killed "
            f"{len(found)} times: {stopped} at rest, off, latched, {max(after for _, after in found):.2f} s at most"
        )
    if bad:
        raise SystemExit("a test was not whole, or a controller did not stop")


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
