"""Requests to the service: each ends by its deadline with an answer or an error of one line; safe ones are repeated."""

from __future__ import annotations

import ssl
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from typing import Any

import httpx

from api.client.credentials import Service
from api.errors import Conflict, InputError, NotFound, ServiceError, TooLarge, one_line

__all__ = ["Connection", "Repeat"]

CALL_S = 20.0  # for one answer
FILE_S = 90.0  # for one that comes after a file was read: the service gives that 60 s
REPEAT_S = 15.0  # during which a request without an answer is repeated
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 2.0
_NOT_DONE = (429,)  # the service did nothing and may do it later
_LATER = (429, 502, 503)  # it may do it later; perhaps it did
_KINDS = {404: NotFound, 409: Conflict, 412: Conflict, 413: TooLarge}
_NEVER_SENT = (httpx.ConnectError, httpx.ConnectTimeout, httpx.PoolTimeout)


class Repeat(Enum):
    """When a request may be sent again."""

    IF_NOT_DONE = 1  # only where the service surely did nothing: what lets a rig move
    ALWAYS = 2  # also without any answer: reads, stops, and creations with an idempotency key


class Connection:
    """Connections to one service; safe to use from many threads. Any: JSON."""

    def __init__(
        self,
        service: Service,
        *,
        repeat_s: float = REPEAT_S,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._repeat_s, self._now, self._sleep = repeat_s, now, sleep
        headers = {"authorization": f"Bearer {service.key}"} if service.key else {}
        # trust_env: a service on this machine is not reached through a proxy
        self._http = httpx.Client(
            base_url=service.url, timeout=CALL_S, trust_env=False, headers=headers, verify=_trusted(service.ca_file)
        )
        self._url = service.url

    def close(self) -> None:
        self._http.close()

    def json(
        self,
        method: str,
        path: str,
        *,
        repeat: Repeat,
        body: Any = None,
        headers: Mapping[str, str] | None = None,
        query: Mapping[str, str | int] | None = None,
        file: bytes | None = None,
    ) -> Any:
        """The answer of one request, with JSON or the content of a file as its body.

        Raises InputError, NotFound, Conflict or TooLarge where the service refuses it, ServiceError where it does not
        answer.
        """
        more: dict[str, Any] = {} if file is None else {"content": file, "timeout": FILE_S}
        request = self._http.build_request(method, path, json=body, headers=headers, params=query, **more)
        ends, pause = self._now() + self._repeat_s, _FIRST_PAUSE_S
        while True:
            response, error = self._once(request)
            again = _may_repeat(response, error, repeat) and self._now() + pause < ends
            if not again and error is not None:
                raise ServiceError(f"{self._url} did not answer {method} {path}: {one_line(error)}") from error
            if not again and response is not None:
                _refuse(response)
                return _content(response)
            self._sleep(pause)
            pause = min(2 * pause, _LONGEST_PAUSE_S)

    def _once(self, request: httpx.Request) -> tuple[httpx.Response | None, httpx.HTTPError | None]:
        try:
            return self._http.send(request), None
        except httpx.HTTPError as error:
            return None, error

    @contextmanager
    def stream(self, path: str, headers: Mapping[str, str]) -> Iterator[httpx.Response]:
        """An answer whose content is read piece by piece; raises as `json` does, also while it is read."""
        try:
            with self._http.stream("GET", path, headers=headers) as response:
                if response.is_error:
                    response.read()
                _refuse(response)
                yield response
        except httpx.HTTPError as error:
            raise ServiceError(f"{self._url} did not answer GET {path}: {one_line(error)}") from error


def _may_repeat(response: httpx.Response | None, error: httpx.HTTPError | None, repeat: Repeat) -> bool:
    if response is not None:
        return response.status_code in (_LATER if repeat is Repeat.ALWAYS else _NOT_DONE)
    return repeat is Repeat.ALWAYS or isinstance(error, _NEVER_SENT)


def _refuse(response: httpx.Response) -> None:
    """Raise the error that an answer states, with the service's own words."""
    if not response.is_error:
        return
    text, status = _words(response), response.status_code
    if status >= 500 or status == 429:
        raise ServiceError(f"the service cannot do this now ({status}): {text}")
    raise _KINDS.get(status, InputError)(text)


def _words(response: httpx.Response) -> str:
    """The detail of a problem (RFC 9457), and every error in it."""
    try:
        problem = response.json()
        detail = str(problem["detail"])
        found = [str(one["detail"]) for one in problem.get("errors", ())]
    except (ValueError, KeyError, TypeError, AttributeError):
        return f"{response.request.method} {response.request.url.path}: {response.status_code} without a reason"
    return " ".join("; ".join((detail, *(one for one in found if one not in detail))).split())


def _content(response: httpx.Response) -> Any:
    try:
        return response.json()
    except ValueError as error:
        raise ServiceError(f"{response.request.url} is no service of damper-rig: its answer is not JSON") from error


def _trusted(ca_file: str) -> ssl.SSLContext | bool:
    if not ca_file:
        return True
    try:
        return ssl.create_default_context(cafile=ca_file)
    except (OSError, ssl.SSLError) as error:
        raise InputError(f"{ca_file}: no certificates can be read: {one_line(error)}") from error
