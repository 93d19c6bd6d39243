"""HTTP/1 as it is read from a connection: fast, with an end to everything, and nothing that can be read in two ways.

The messages are parsed by llhttp, in C. What it lets pass and a proxy in front of the service may read in another way
is refused here with 400 and one line, and the connection is closed.
"""

from __future__ import annotations

from httptools import HttpParserError
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

__all__ = ["LONGEST_HEAD", "StrictHttp"]

LONGEST_HEAD = 32 * 1024  # bytes: of request line and headers, and of whatever else brings nothing of a body
_TOO_LONG = f"the headers are longer than {LONGEST_HEAD} bytes: send fewer"
_OF_BODY = (b"content-length", b"transfer-encoding")
_MOST_AHEAD = 16  # requests that are sent before the one ahead of them is answered
_VERSIONS = ("1.0", "1.1")


class StrictHttp(HttpToolsProtocol):
    """One connection of the server."""

    _unread = 0  # bytes since the last head was complete or the last part of a body came
    _head = 0  # bytes of this request's line and headers, trailers included
    _in_head = True
    _refused = False
    _why = ""

    def data_received(self, data: bytes) -> None:
        """Parse what has come; nothing is kept of a head or trailer that does not end, or after a refusal."""
        if self._refused:
            return
        self._unread += len(data)
        super().data_received(data)
        if self._unread > LONGEST_HEAD and not self._refused:
            self.send_400_response(_TOO_LONG)

    def send_400_response(self, msg: str) -> None:
        """Say what is wrong and close the connection, but answer first what was asked before."""
        self._refused = True
        cycle = self.cycle
        owed = cycle is not None and not cycle.response_complete
        if owed and self._in_head:
            cycle.keep_alive = False  # closes it after the last answer that is owed
        elif owed and (cycle.response_started or self.pipeline):
            self.transport.close()  # in the middle of an answer, or of others
        else:
            if owed:
                cycle.disconnected = True
            super().send_400_response(self._why or msg)

    def on_message_begin(self) -> None:
        self._head, self._in_head = 0, True
        super().on_message_begin()

    def on_url(self, url: bytes) -> None:
        self._count(len(url))
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        """Note a header; what comes after the body is none, whatever it is called."""
        self._count(len(name) + len(value) + 4)
        if self._in_head:
            super().on_header(name, value.strip(b" \t"))

    def on_headers_complete(self) -> None:
        self._check_head()
        super().on_headers_complete()
        self._in_head, self._unread = False, 0
        if self.parser.should_upgrade():  # to what this service does not speak: what follows is not HTTP
            self.cycle.keep_alive = False

    def on_body(self, body: bytes) -> None:
        self._unread = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        self._unread = 0
        super().on_message_complete()

    def _unsupported_upgrade_warning(self) -> None:
        """A client offers another protocol and is answered in this one: no reason to write to the log."""

    def _count(self, size: int) -> None:
        self._head += size
        if self._head > LONGEST_HEAD:
            self._refuse(_TOO_LONG)

    def _check_head(self) -> None:
        version = self.parser.get_http_version()
        hosts = sum(name == b"host" for name, _ in self.headers)
        codings = [value.lower() for name, value in self.headers if name == b"transfer-encoding"]
        if version not in _VERSIONS:
            self._refuse(f"the version of HTTP is {version}: use 1.1")
        if hosts > 1 or (hosts == 0 and version != "1.0"):
            self._refuse(f"there are {hosts} Host headers: send one")
        if codings and (codings != [b"chunked"] or version == "1.0"):
            self._refuse(f"Transfer-Encoding is {b', '.join(codings)!a:.60}: it can be chunked, in HTTP/1.1")
        if b"#" in self.url or not (self.url.startswith(b"/") or self.url == b"*"):
            self._refuse(f"the target is {self.url!a:.60}: it must be a path that begins with /, without #")
        if self.parser.should_upgrade() and any(name in _OF_BODY and value != b"0" for name, value in self.headers):
            self._refuse("an Upgrade is offered with a body: the service speaks HTTP/1.1 alone, send no Upgrade header")
        if len(self.pipeline) >= _MOST_AHEAD:
            self._refuse(f"more than {_MOST_AHEAD} requests came before the answer to the first: wait for it")

    def _refuse(self, why: str) -> None:
        self._why = why
        raise HttpParserError(why)
