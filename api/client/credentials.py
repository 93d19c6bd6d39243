"""Which service a client talks to, and with which key: from arguments, the environment or a file."""

from __future__ import annotations

import ipaddress
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from api.errors import InputError, one_line

__all__ = ["DEFAULT_URL", "Service", "find_service"]

DEFAULT_URL = "http://127.0.0.1:8420"


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """The address of a service, and what a request needs to be accepted there.

    ``ca_file``: certificates to trust beside none other; empty: those of the system. A key is sent over TLS or to this
    computer, and elsewhere only with ``plain_http``.
    """

    url: str = DEFAULT_URL
    key: str = field(default="", repr=False)
    ca_file: str = ""
    plain_http: bool = False

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise InputError(f"service is {self.url!r:.80}: it must begin with http:// or https:// and name a host")
        if parts.username or parts.password:
            raise InputError("service has a name or a password in its address: give a key instead")
        if not (self.key.isascii() and self.key.isprintable()) or " " in self.key:
            raise InputError("the key has characters that no key has: copy it again")
        if self.key and parts.scheme == "http" and not _is_local(parts.hostname) and not self.plain_http:
            raise InputError(
                f"service is {self.url!r:.80}: the network could read the key: use https://, or allow plain HTTP"
            )


def find_service(
    environ: Mapping[str, str], *, url: str | None = None, key_file: Path | None = None, plain_http: bool = False
) -> Service:
    """The service: what is given, else DAMPER_RIG_SERVICE, _KEY, _KEY_FILE and _SERVICE_CA_FILE, else the default.

    Raises InputError, one line, also where other users can read the file of the key.
    """
    named = key_file or (Path(environ["DAMPER_RIG_KEY_FILE"]) if environ.get("DAMPER_RIG_KEY_FILE") else None)
    key = environ.get("DAMPER_RIG_KEY", "") if key_file is None else ""
    if not key and named is not None:
        key = _read_key(named)
    return Service(
        url=(url or environ.get("DAMPER_RIG_SERVICE") or DEFAULT_URL).rstrip("/"),
        key=key,
        ca_file=environ.get("DAMPER_RIG_SERVICE_CA_FILE", ""),
        plain_http=plain_http,
    )


def _read_key(file: Path) -> str:
    try:
        if os.name == "posix" and file.stat().st_mode & (stat.S_IROTH | stat.S_IRGRP):
            raise InputError(f"{file}: other users can read this key: chmod 600 {file}")
        return file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: no key can be read: {one_line(error)}") from error


def _is_local(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
