"""The rig's address, and the transport that it names."""

from __future__ import annotations

from urllib.parse import urlsplit

from rigctl.clock import Clock
from rigctl.errors import UrlError
from rigctl.transport import Transport

FORMS = "modbus://HOST:PORT, can://loopback/NAME or can://INTERFACE/CHANNEL?fd=true"


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


def connect(url: str, *, clock: Clock | None = None) -> Transport:
    """Return the transport that an address names; nothing is sent yet.

    Raises
    ------
    UrlError
        When the address has none of the forms, or names an interface that does not exist.
    """
    if urlsplit(url).scheme == "modbus":
        from rigctl.modbus_wire import ModbusTransport

        host, port = host_and_port(url)
        return ModbusTransport(host, port, clock=clock)
    raise UrlError(f"rig address {url!r}: it must be {FORMS}")
