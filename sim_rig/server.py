"""The simulated rig as a process: one specimen, one wire, until told to stop."""

from __future__ import annotations

import asyncio
import signal
import threading
import time
from collections.abc import Callable, Sequence

from rigctl.address import host_and_port
from sim_rig.errors import SpecimenError
from sim_rig.modbus_server import serve_modbus
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.specimens import SPECIMENS


def build_rig(specimen: str, *, hide: Sequence[str], seed: int, speed: float, now: Callable[[], float]) -> SimulatedRig:
    """Make a rig with a specimen in it; SpecimenError for a name that does not exist."""
    if specimen not in SPECIMENS:
        raise SpecimenError(f"specimen {specimen!r} does not exist: choose one of {', '.join(SPECIMENS)}")
    found = SPECIMENS[specimen]
    plant = SimulatedPlant(found.damper, found.noise, seed=seed, start_degc=25.0)
    return SimulatedRig(plant, speed=speed, now=now, serial=str(seed))


def serve(
    url: str,
    *,
    specimen: str = "semi-active",
    hide: Sequence[str] = (),
    seed: int = 1,
    speed: float = 1.0,
    on_ready: Callable[[str], None] = lambda url: None,
) -> None:
    """Serve a simulated rig until SIGTERM or SIGINT; `on_ready` gets the address once a connection is accepted.

    Raises
    ------
    SpecimenError, UrlError, SimRigError
        For a specimen, an effect, an address or a speed that cannot be, before anything listens.
    """
    host, port = host_and_port(url)
    rig = build_rig(specimen, hide=hide, seed=seed, speed=speed, now=time.monotonic)
    asyncio.run(_until_signalled(rig, host, port, on_ready))


async def _until_signalled(rig: SimulatedRig, host: str, port: int, on_ready: Callable[[str], None]) -> None:
    stop = asyncio.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, stop.set)
    await serve_modbus(rig, host, port, stop, on_ready)
