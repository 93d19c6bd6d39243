"""Headers of every answer that tell a browser what it may do with it, and a last look for keys in errors."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.access.tokens import redacted

__all__ = ["SecurityHeaders"]

_PAGE = (  # own scripts and styles only; Plotly sets styles on elements, which a hash cannot allow
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
# A report is one file with everything in it, and part of it was uploaded. In the sandbox it has no origin: its scripts
# draw, but reach neither the session nor the service, and load nothing from anywhere.
_REPORT = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_DATA = "default-src 'none'; sandbox; frame-ancestors 'none'"

_ALWAYS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"x-frame-options", b"DENY"),
)
_HSTS = (b"strict-transport-security", b"max-age=31536000")


class SecurityHeaders:
    """Adds the headers; what a route has set itself stays."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        refused = False

        async def with_headers(message: Message) -> None:
            nonlocal refused
            if message["type"] == "http.response.start":
                refused = message["status"] >= 400
                message = {**message, "headers": _with_headers(scope, message["headers"])}
            elif refused and b"dr_" in message.get("body", b""):  # somebody typed a key where it does not belong
                message = {**message, "body": redacted(message["body"].decode("utf-8", "replace")).encode()}
            await send(message)

        await self.app(scope, receive, with_headers)


def _with_headers(scope: Scope, headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    there = {name.lower(): value for name, value in headers}
    added = [*_ALWAYS, (b"content-security-policy", _policy(scope["path"], there).encode())]
    if scope["path"].startswith("/v1/"):
        added.append((b"cache-control", b"no-store"))
    if scope.get("scheme") == "https":
        added.append(_HSTS)
    return [*headers, *((name, value) for name, value in added if name not in there)]


def _policy(path: str, headers: dict[bytes, bytes]) -> str:
    if not headers.get(b"content-type", b"").startswith(b"text/html"):
        return _DATA
    return _REPORT if path.startswith("/v1/") else _PAGE
