"""The rig's address, and the transport that it names."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

from rigctl.clock import Clock
from rigctl.errors import UrlError
from rigctl.transport import Transport

if TYPE_CHECKING:
    import can

FORMS = "modbus://HOST:PORT, can://loopback/NAME, can://INTERFACE/CHANNEL?fd=true or the path of a rig.toml"


def host_and_port(url: str) -> tuple[str, int]:
    """Read modbus://HOST:PORT; raise UrlError with one line for anything else."""
    parts = urlsplit(url)
    try:
        port = parts.port
    except ValueError as error:
        raise UrlError(f"rig address {url!r}: {error}; use {FORMS}") from error
    extra = parts.path.strip("/") or parts.query or parts.fragment or parts.username
    if parts.scheme != "modbus" or not parts.hostname or port is None or extra:
        raise UrlError(f"rig address {url!r}: it must be {FORMS}")
    return parts.hostname, port


@dataclass(frozen=True, slots=True, kw_only=True)
class CanAddress:
    """What a CAN address names."""

    interface: str
    channel: str
    fd: bool = False
    bitrate: int = 1_000_000
    data_bitrate: int = 5_000_000


def can_address(url: str) -> CanAddress:
    """Read can://INTERFACE/CHANNEL?fd=true&bitrate=…&data_bitrate=…; UrlError with one line for anything else."""
    parts = urlsplit(url)
    channel = parts.path.strip("/")
    if parts.scheme != "can" or not parts.netloc or not channel:
        raise UrlError(f"rig address {url!r}: it must be {FORMS}")
    found: dict[str, str] = {}
    for name, values in parse_qs(parts.query, keep_blank_values=True).items():
        if name not in ("fd", "bitrate", "data_bitrate"):
            raise UrlError(f"rig address {url!r}: option {name!r} is unknown, use fd, bitrate and data_bitrate")
        found[name] = values[-1]
    if found.get("fd", "false") not in ("true", "false"):
        raise UrlError(f"rig address {url!r}: fd is {found['fd']!r}, it must be true or false")
    for name in ("bitrate", "data_bitrate"):
        if not found.get(name, "1").isdecimal() or int(found.get(name, "1")) == 0:
            raise UrlError(f"rig address {url!r}: {name} is {found[name]!r}, it must be bits per second")
    return CanAddress(
        interface=parts.netloc,
        channel=channel,
        fd=found.get("fd") == "true",
        bitrate=int(found.get("bitrate", "1000000")),
        data_bitrate=int(found.get("data_bitrate", "5000000")),
    )


def open_bus(address: CanAddress, *, listen: bool = False) -> can.BusABC:
    """Open the bus of an address; UrlError for an interface that does not exist, CanError where it cannot be opened."""
    import can

    logging.getLogger("can").addHandler(logging.NullHandler())  # a missing driver is reported by an exception
    if address.interface == "loopback":
        from rigctl.loopback_can import LoopbackBus

        return LoopbackBus(address.channel, listen=listen, fd=address.fd)
    if address.interface not in can.VALID_INTERFACES:
        raise UrlError(
            f"CAN interface {address.interface!r} does not exist: use loopback or one of "
            f"{', '.join(sorted(can.VALID_INTERFACES))}"
        )
    try:
        return can.Bus(
            interface=address.interface,
            channel=address.channel,
            bitrate=address.bitrate,
            data_bitrate=address.data_bitrate,
            fd=address.fd,
        )
    except (can.CanError, OSError, ValueError):
        raise
    except Exception as error:  # a driver that is not installed raises one of many: NameError, ImportError, TypeError
        raise can.CanInitializationError(
            f"interface {address.interface} cannot be used here: is its driver installed? ({error})"
        ) from error


def connect(url: str, *, clock: Clock | None = None) -> Transport:
    """Return the transport that an address names; nothing is sent yet.

    Raises
    ------
    UrlError, MapError
        When the address has none of the forms, or names an interface that does not exist; when a rig.toml is wrong.
    """
    if url.endswith(".toml"):
        from rigctl.machines.connection import connect_machine

        return connect_machine(url, clock=clock)
    if urlsplit(url).scheme == "modbus":
        from rigctl.modbus_wire import ModbusTransport

        host, port = host_and_port(url)
        return ModbusTransport(host, port, clock=clock)
    if urlsplit(url).scheme == "can":
        return _connect_can(url, can_address(url), clock)
    raise UrlError(f"rig address {url!r}: it must be {FORMS}")


def _check_loopback(url: str, channel: str) -> None:
    import can

    from rigctl.loopback_can import socket_path

    try:
        socket_path(channel)
    except can.CanInitializationError as error:
        raise UrlError(f"rig address {url!r}: {error}") from error


def check_address(url: str) -> None:
    """Raise the UrlError that `connect` raises for modbus:// and can:// addresses; makes no transport."""
    scheme = urlsplit(url).scheme
    if scheme == "modbus":
        host_and_port(url)
    elif scheme == "can":
        _check_can(url, can_address(url))
    else:
        raise UrlError(f"rig address {url!r}: it must be {FORMS}")


def _check_can(url: str, address: CanAddress) -> None:
    import can

    if address.interface not in {"loopback", *can.VALID_INTERFACES}:
        open_bus(address)  # raises UrlError where the interface does not exist
    if address.interface == "loopback":
        _check_loopback(url, address.channel)


def _connect_can(url: str, address: CanAddress, clock: Clock | None) -> Transport:
    from rigctl.can_wire import CanTransport

    _check_can(url, address)
    return CanTransport(
        url,
        lambda: open_bus(address),
        fd=address.fd,
        bitrate=address.bitrate,
        data_bitrate=address.data_bitrate,
        clock=clock,
    )
