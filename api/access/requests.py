"""What a request says about its sender: the host it asks for, the page it comes from, the key or cookie it shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

__all__ = ["COOKIE", "SAFE_METHODS", "SECURE_COOKIE", "Sender", "sender"]

COOKIE = "damper-rig-session"
SECURE_COOKIE = "__Host-damper-rig-session"  # browsers accept this name only with Secure, from this host, for all paths
_READ = (b"host", b"origin", b"sec-fetch-site", b"sec-fetch-mode", b"authorization", b"cookie")
_FORWARDED = (b"forwarded", b"x-forwarded-for", b"x-real-ip", b"via")
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sender:
    """The headers of one request that say who sends it. It holds secrets: it is never logged, and has no repr."""

    method: str
    scheme: str
    host: str
    origin: str | None
    fetch_site: str | None
    fetch_mode: str | None
    forwarded: bool  # a proxy says that somebody else sends it
    bearer: str | None  # "": an Authorization header that is not one of ours
    cookie: str | None

    def __repr__(self) -> str:
        return f"Sender({self.method} {self.host!a:.80})"

    @property
    def changes(self) -> bool:
        return self.method not in SAFE_METHODS

    @property
    def from_elsewhere(self) -> bool:
        """Whether a page of another site sends it; programs that are no browsers name no page."""
        if self.origin is not None:
            return not self._is_own(self.origin)
        if self.fetch_mode == "navigate" and not self.changes and self.cookie is None:
            return False  # somebody follows a link to us
        return self.fetch_site in ("cross-site", "same-site")

    @property
    def from_own_page(self) -> bool:
        """Whether a browser vouches that a page of this service sends it."""
        if self.origin is not None:
            return self._is_own(self.origin)
        return self.fetch_site == "same-origin"

    def _is_own(self, origin: str) -> bool:
        try:
            parts = urlsplit(origin)
        except ValueError:
            return False
        return (parts.scheme, parts.netloc.lower()) == (self.scheme, self.host.lower())


def sender(scope: Any) -> Sender:
    """Read from an ASGI scope. Any: ASGI's own dictionary."""
    values: dict[bytes, str] = {}
    for name, value in scope["headers"]:
        if name in _READ:
            # a second header of a kind makes the value one that fits nothing, except for cookies, which may be split
            glue = "; " if name == b"cookie" else ","
            text = value.decode("latin-1")
            values[name] = f"{values[name]}{glue}{text}" if name in values else text
    scheme = scope.get("scheme", "http")
    return Sender(
        method=scope.get("method", "GET"),
        scheme=scheme,
        host=values.get(b"host", ""),
        origin=values.get(b"origin"),
        fetch_site=values.get(b"sec-fetch-site"),
        fetch_mode=values.get(b"sec-fetch-mode"),
        forwarded=any(name in _FORWARDED for name, _ in scope["headers"]),
        bearer=_bearer(values.get(b"authorization")),
        cookie=_cookie(values.get(b"cookie", ""), SECURE_COOKIE if scheme == "https" else COOKIE),
    )


def _bearer(header: str | None) -> str | None:
    if header is None:
        return None
    kind, _, text = header.partition(" ")
    return text.strip() if kind.lower() == "bearer" else ""


def _cookie(header: str, name: str) -> str | None:
    for part in header.split(";"):
        key, _, value = part.strip().partition("=")
        if key == name:
            return value
    return None
