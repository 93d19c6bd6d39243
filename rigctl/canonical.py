"""The one spelling of a rig's address, so that one rig is not taken for several."""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Sequence
from fnmatch import fnmatchcase
from urllib.parse import urlsplit

from rigctl.address import FORMS, CanAddress, can_address
from rigctl.errors import UrlError

MODBUS_PORT = 502  # registered for Modbus TCP at IANA
_THIS_COMPUTER = "127.0.0.1"
_NUMERIC = re.compile(r"(?:0x[0-9a-f]*|\d+)(?:\.(?:0x[0-9a-f]*|\d+)){0,3}")
_LABEL = re.compile(r"(?!-)[a-z0-9_-]{1,63}(?<!-)")


def canonical_address(url: str) -> str:
    """Return the address in its one spelling; UrlError, one line, for what is no address of a rig.

    Scheme and host are lower case; localhost, ::1 and every spelling of 127.0.0.1 are 127.0.0.1; the port of Modbus
    is written out; options of CAN that have their default value are left out, the others are sorted. No name is looked
    up: what a name means can change, and the serial number of the rig tells that.
    """
    text = url.strip()
    try:
        parts = urlsplit(text)
        scheme, port = parts.scheme.lower(), parts.port if parts.scheme.lower() == "modbus" else None
    except ValueError as error:
        raise UrlError(f"rig address {url!r:.200}: {error}; use {FORMS}") from error
    if scheme == "modbus":
        extra = parts.path.strip("/") or parts.query or parts.fragment or parts.username or parts.password
        if not parts.hostname or extra or port == 0:
            raise UrlError(f"rig address {url!r:.200}: it must be {FORMS}")
        host = _canonical_host(url, parts.hostname)
        return f"modbus://{f'[{host}]' if ':' in host else host}:{MODBUS_PORT if port is None else port}"
    if scheme == "can":
        return _canonical_can(can_address(f"can{text[len(scheme) :]}"))
    raise UrlError(f"rig address {url!r:.200}: it must be {FORMS}")


def is_allowed(address: str, patterns: Sequence[str]) -> bool:
    """Return whether a canonical address matches one of the patterns, with * and ? as in names of files."""
    return any(fnmatchcase(address, pattern) for pattern in patterns)


def _canonical_host(url: str, host: str) -> str:
    name = host.rstrip(".").lower()
    if name == "localhost" or name.endswith(".localhost"):
        return _THIS_COMPUTER
    if _NUMERIC.fullmatch(name):
        try:  # as connect() reads it: 127.1, 0x7f.1 and 2130706433 are all this computer
            return _canonical_ip(url, ipaddress.ip_address(socket.inet_aton(name)))
        except OSError as error:
            raise UrlError(f"rig address {url!r:.200}: {host!r} is no IPv4 address") from error
    if ":" in name:
        try:
            return _canonical_ip(url, ipaddress.ip_address(name))
        except ValueError as error:
            raise UrlError(f"rig address {url!r:.200}: {host!r} is no IPv6 address") from error
    try:
        ascii_name = name.encode("idna").decode() if not name.isascii() else name
    except UnicodeError as error:
        raise UrlError(f"rig address {url!r:.200}: {host!r} is no name of a host") from error
    labels = ascii_name.split(".")
    if len(ascii_name) > 253 or labels[-1].isdecimal() or not all(map(_LABEL.fullmatch, labels)):
        raise UrlError(f"rig address {url!r:.200}: {host!r} is no name of a host")
    return ascii_name


def _canonical_ip(url: str, ip: ipaddress.IPv4Address | ipaddress.IPv6Address) -> str:
    if isinstance(ip, ipaddress.IPv6Address) and ip.ipv4_mapped is not None:
        ip = ip.ipv4_mapped
    if ip.is_unspecified:  # Linux takes it for this computer, other systems refuse it
        raise UrlError(f"rig address {url!r:.200}: {ip} names no host: use 127.0.0.1 for this computer")
    return _THIS_COMPUTER if str(ip) in ("::1", _THIS_COMPUTER) else str(ip)


def _canonical_can(address: CanAddress) -> str:
    default = CanAddress(interface=address.interface, channel=address.channel)
    options = {
        "bitrate": str(address.bitrate),
        "data_bitrate": str(address.data_bitrate),
        "fd": str(address.fd).lower(),
    }
    usual = {
        "bitrate": str(default.bitrate),
        "data_bitrate": str(default.data_bitrate),
        "fd": str(default.fd).lower(),
    }
    query = "&".join(f"{name}={value}" for name, value in sorted(options.items()) if value != usual[name])
    return f"can://{address.interface.lower()}/{address.channel}" + (f"?{query}" if query else "")
