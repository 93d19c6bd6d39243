"""The names under which the service may be asked for: no name of an attacker's can be rebound to its address."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable

from starlette.types import ASGIApp, Receive, Scope, Send

from api.problems import send_problem

__all__ = ["LOOPBACK_NAMES", "HostList", "is_loopback", "name_of"]

LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")


def is_loopback(host: str) -> bool:
    """Whether only this machine can connect to what listens on ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def name_of(host_header: str) -> str:
    """The name or address in a Host header, without its port, in lower case; "" where it cannot be read.

    >>> [name_of(text) for text in ("Rig:8420", "[::1]:8420", "[::1]", "127.0.0.1", "a:b:c", "[::1")]
    ['rig', '::1', '::1', '127.0.0.1', '', '']
    """
    text = host_header.strip().lower()
    if text.startswith("["):
        inside, closed, after = text[1:].partition("]")
        return inside if closed and (not after or after.startswith(":")) else ""
    name, _, port = text.partition(":")
    return "" if ":" in port else name.rstrip(".")


class HostList:
    """Refuses requests for a host that is not allowed.

    The address to which the connection was made is always allowed: an address cannot be rebound.
    """

    def __init__(self, app: ASGIApp, allowed: Iterable[str]) -> None:
        self.app = app
        self.allowed = frozenset(name.lower() for name in allowed)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            shown = b",".join(value for name, value in scope["headers"] if name == b"host").decode("latin-1")
            host, here = name_of(shown), scope.get("server") or ("",)
            if host not in self.allowed and not (host and host == here[0]):
                detail = f"host {shown!a:.80} is not a name of this service: add it to allowed_hosts if it should be"
                await send_problem(scope, send, 421, detail)
                return
        await self.app(scope, receive, send)
