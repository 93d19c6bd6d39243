"""Opens the CAN bus of a map with its bit timing."""

from __future__ import annotations

import logging
from typing import Any

import can

from rigctl.errors import MapError
from rigctl.machines.wires import Bus

OWN_TIMING = ("pcan", "kvaser", "vector", "slcan", "ixxat", "virtual")  # interfaces whose timing python-can sets


def bus_arguments(bus: Bus) -> dict[str, Any]:
    """Arguments of python-can for a bus. Any: they differ by interface.

    Raises
    ------
    MapError
        Where the interface does not exist, or its bit timing is set elsewhere: SocketCAN's by ``ip link``.
    """
    if bus.interface not in can.VALID_INTERFACES:
        raise MapError(
            f"interface is {bus.interface!r}: use loopback or one of {', '.join(sorted(can.VALID_INTERFACES))}"
        )
    found: dict[str, Any] = {"interface": bus.interface, "channel": bus.channel, "fd": bus.fd}
    if bus.interface in ("kvaser", "vector") and bus.channel.isdecimal():
        found["channel"] = int(bus.channel)
    if bus.app_name is not None:
        found["app_name"] = bus.app_name
    if bus.interface == "socketcan":
        if bus.sample_point is not None:
            raise MapError(
                "sample_point: SocketCAN's bit timing is set by: ip link set can0 type can bitrate … sample-point …"
            )
        return found
    if bus.sample_point is None:
        found["bitrate"] = bus.bitrate
        if bus.fd:
            found["data_bitrate"] = bus.data_bitrate
        if bus.sjw is not None:
            found["sjw"] = bus.sjw
        return found
    if bus.interface not in OWN_TIMING:
        raise MapError(
            f"sample_point: interface {bus.interface} takes none: give bitrate only, or use {', '.join(OWN_TIMING)}"
        )
    return found | {"timing": timing(bus)}


def timing(bus: Bus) -> can.BitTiming | can.BitTimingFd:
    """Timing registers for a bit rate and sample point at the clock of the chip; MapError where there are none."""
    assert bus.clock_hz is not None
    assert bus.sample_point is not None
    try:
        if bus.fd:
            return can.BitTimingFd.from_sample_point(
                f_clock=bus.clock_hz,
                nom_bitrate=bus.bitrate,
                nom_sample_point=100 * bus.sample_point,
                data_bitrate=bus.data_bitrate,
                data_sample_point=100 * (bus.data_sample_point or bus.sample_point),
            )
        return can.BitTiming.from_sample_point(
            f_clock=bus.clock_hz, bitrate=bus.bitrate, sample_point=100 * bus.sample_point
        )
    except ValueError as error:
        raise MapError(f"bitrate {bus.bitrate} at a clock of {bus.clock_hz} Hz: {error}") from error


def open_bus(bus: Bus, *, listen: bool = False) -> can.BusABC:
    """Open a bus; CanError where it cannot be opened."""
    logging.getLogger("can").addHandler(logging.NullHandler())  # a missing driver is reported by an exception
    if bus.interface == "loopback":
        from rigctl.loopback_can import LoopbackBus

        return LoopbackBus(bus.channel, listen=listen, fd=bus.fd)
    arguments = bus_arguments(bus)
    try:
        return can.Bus(**arguments)
    except (can.CanError, OSError, ValueError):
        raise
    except Exception as error:  # a driver that is not installed raises one of many: NameError, ImportError, TypeError
        raise can.CanInitializationError(
            f"interface {bus.interface} cannot be used here: is its driver installed? ({error})"
        ) from error
