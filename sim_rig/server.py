"""The simulated rig as a process: one specimen on one wire, until a signal stops it."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path

from rigctl.address import CanAddress, can_address, host_and_port, open_bus
from rigctl.errors import UrlError
from rigctl.priority import real_time_priority
from sim_rig.draw import Truth, draw, write_truth
from sim_rig.errors import SimRigError, SpecimenError
from sim_rig.faults import Faults, fault_order
from sim_rig.faulty_plant import FaultyPlant
from sim_rig.modbus_server import serve_modbus
from sim_rig.multi_axis_plant import MultiAxisPlant, held_places
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.skew import Skew
from sim_rig.specimens import MULTI_AXIS, SPECIMENS


def build_rig(
    specimen: str,
    *,
    hide: Sequence[str],
    seed: int,
    speed: float,
    now: Callable[[], float],
    faults: Sequence[str] = (),
    skew: Sequence[str] = (),
    held: Sequence[str] = (),
) -> tuple[SimulatedRig, Truth]:
    """Make a rig with a specimen in it, and its true parameters.

    A specimen of MULTI_AXIS makes it a rig of six axes; `held` are the places of its further axes.

    Raises SpecimenError, FaultError, SkewError: for a name that does not exist.
    """
    ordered = Faults([fault_order(text) for text in faults], now=now)
    several = MULTI_AXIS.get(specimen)
    if several is not None and hide:
        raise SpecimenError(f"nothing can be hidden in specimen {specimen!r}: leave the effects out")
    if several is None and held:
        raise SpecimenError(f"specimen {specimen!r} has one axis: places are for {', '.join(MULTI_AXIS)}")
    truth = draw(specimen if several is None else several[1].name, hide, seed)
    noise = SPECIMENS[truth.specimen].noise
    single = SimulatedPlant(truth.damper, noise, seed=seed, start_degc=truth.start_degc, skew=Skew(skew))
    plant = single if several is None else MultiAxisPlant(single, several[0], held=held_places(held), seed=seed)
    failing = FaultyPlant(plant, ordered) if ordered else plant
    return SimulatedRig(failing, speed=speed, now=now, serial=str(seed), faults=ordered), truth


def serve(
    url: str,
    *,
    specimen: str = "semi-active",
    hide: Sequence[str] = (),
    seed: int = 1,
    speed: float = 1.0,
    reveal: str | os.PathLike[str] | None = None,
    faults: Sequence[str] = (),
    skew: Sequence[str] = (),
    held: Sequence[str] = (),
    on_ready: Callable[[str], None] = lambda url: None,
) -> None:
    """Serve a simulated rig until SIGTERM or SIGINT; `on_ready` gets the address once a connection is accepted.

    `hide` names effects, or ``random``; what was drawn is written only to the file `reveal`, where one is given.
    `faults` are texts for :func:`sim_rig.faults.fault_order`; `skew` gives the delays of channels from
    :func:`sim_rig.skew.skew_order`, `held` the places of further axes for
    :func:`sim_rig.multi_axis_plant.held_places`.

    Raises
    ------
    SpecimenError, FaultError, SkewError, UrlError, SimRigError
        For a specimen, an effect, a fault, an address or a speed that cannot be used, before anything listens.
    """
    over_can = can_address(url) if url.startswith("can:") else None
    host, port = ("", 0) if over_can is not None else host_and_port(url)
    rig, truth = build_rig(
        specimen, hide=hide, seed=seed, speed=speed, now=time.monotonic, faults=faults, skew=skew, held=held
    )
    if reveal is not None and specimen in MULTI_AXIS:
        raise SpecimenError(f"nothing is hidden in specimen {specimen!r}: leave out the file of what is")
    if reveal is not None:
        write_truth(truth, Path(reveal))
    with real_time_priority() if speed == 1 else nullcontext():  # real time; at other speeds the clock may be late
        if over_can is not None:
            _serve_can(rig, url, over_can, on_ready)
        else:
            asyncio.run(_until_signalled(rig, host, port, on_ready))


def _serve_can(rig: SimulatedRig, url: str, address: CanAddress, on_ready: Callable[[str], None]) -> None:
    import can

    from sim_rig.can_server import serve_can

    told = threading.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: told.set())
    try:
        bus = open_bus(address, listen=True)
    except UrlError:
        raise
    except (can.CanError, OSError, ValueError) as error:
        raise SimRigError(f"{url}: cannot be opened ({' '.join(str(error).split())})") from error
    try:
        on_ready(url)
        serve_can(rig, bus, fd=address.fd, now=time.monotonic, stop=told.is_set)
    finally:
        bus.shutdown()


async def _until_signalled(rig: SimulatedRig, host: str, port: int, on_ready: Callable[[str], None]) -> None:
    stop = asyncio.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, stop.set)
    await serve_modbus(rig, host, port, stop, on_ready)
