"""The layer that every request passes before its body is read: who sends it, may they, how often, and is it noted."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress
from typing import Any
from urllib.parse import quote

from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.access.access import Access
from api.access.audit import AuditEntry
from api.access.identity import LOCAL, Identity, Refused
from api.access.rates import retry_after
from api.access.rules import Rule, Rules
from api.problems import send_problem

__all__ = ["Guard", "address_of"]

LOG = logging.getLogger("damper_rig.access")

_LOOK_AGAIN_S = 1.0
_SIGN_IN = ("POST", "/v1/session")


def address_of(scope: Any) -> str:
    """The address of the sender, as far as trusted proxies tell it. Any: ASGI's own dictionary."""
    client = scope.get("client")
    return str(client[0]) if client else "unknown"


class Guard:
    """Lets a request pass with ``scope["state"]["identity"]``, or answers it."""

    def __init__(self, app: ASGIApp, access: Access, rules: Rules) -> None:
        self.app, self.access, self.rules = app, access, rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":  # there are no web sockets
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return
        rule = self.rules.find(scope["method"], scope["path"])
        if rule.scope is None:
            await self.app(scope, receive, send)
            return
        found = self.access.gate.may(scope, rule)
        if isinstance(found, Refused):
            await self._refuse(found, scope, send)
            return
        wait_s = self._wait_s(found, rule, scope)
        if wait_s > 0:
            await send_problem(
                scope, send, 429, f"too many requests: try again in {wait_s:.1f} s", headers=retry_after(wait_s)
            )
            return
        scope.setdefault("state", {}).update(identity=found, person=found.name if found.key_id else "")
        answer = _Answer(self.access, found, rule, scope, send)
        await self.app(scope, answer.receiving(receive), answer)

    async def _refuse(self, refused: Refused, scope: Scope, send: Send) -> None:
        address = address_of(scope)
        if refused.failed or refused.status == 403:
            LOG.warning("refused from %s: %s (%s %a)", address, refused.detail, scope["method"], scope["path"][:100])
        if refused.failed:
            wait_s = self.access.failures.wait_s(address)
            if wait_s > 0:
                await send_problem(
                    scope, send, 429, f"too many wrong keys: try again in {wait_s:.1f} s", headers=retry_after(wait_s)
                )
                return
        if refused.status == 401 and scope["method"] == "GET" and _wants_page(scope):
            place = quote(scope["path"], safe="/")
            await RedirectResponse(f"/sign-in?next={place}", 303)(scope, _nothing, send)
            return
        asks = {"WWW-Authenticate": 'Bearer realm="damper-rig"'} if refused.status == 401 else None
        await send_problem(scope, send, refused.status, refused.detail, headers=asks)

    def _wait_s(self, identity: Identity, rule: Rule, scope: Scope) -> float:
        if rule.stops:
            return 0.0
        if (scope["method"], scope["path"]) == _SIGN_IN:
            return self.access.sign_ins.wait_s(address_of(scope))
        if identity is LOCAL:
            return 0.0
        return self.access.requests.wait_s(identity.key_id)


async def _nothing() -> Message:
    return {"type": "http.disconnect"}


def _wants_page(scope: Scope) -> bool:
    return any(name == b"accept" and value.startswith(b"text/html") for name, value in scope["headers"])


class _Answer:
    """Sends the answer on; notes what an action came to; ends a stream whose reader may not read on."""

    def __init__(self, access: Access, identity: Identity, rule: Rule, scope: Scope, send: Send) -> None:
        self.access, self.identity, self.rule, self.scope, self.send = access, identity, rule, scope, send
        self.streams = self.ended = False

    async def __call__(self, message: Message) -> None:
        if self.ended:
            return
        if message["type"] == "http.response.start":
            headers = dict(message["headers"])
            self.streams = headers.get(b"content-type", b"").startswith(b"text/event-stream")
            if self.rule.action and not self._only_checks(message["status"]):
                self._note(message["status"], headers)
        await self.send(message)

    def receiving(self, receive: Receive) -> Receive:
        """A receive by which the app learns within a second that the reader of a stream may not read on."""

        body_ahead = True

        async def message() -> Message:
            nonlocal body_ahead
            if body_ahead:  # nothing is streamed before the body of the request is read
                first = await receive()
                body_ahead = first.get("more_body", False)
                return first
            while True:
                if self.streams and not self.access.gate.still(self.scope):
                    if not self.ended:
                        self.ended = True
                        await self.send({"type": "http.response.body", "body": b"", "more_body": False})
                    return {"type": "http.disconnect"}
                with suppress(TimeoutError):
                    async with asyncio.timeout(_LOOK_AGAIN_S):
                        return await receive()

        return message

    def _only_checks(self, status: int) -> bool:
        """Whether a campaign was only checked: it answers with 201 where it is kept."""
        return self.rule.action == "campaign.submit" and status == 200

    def _note(self, status: int, headers: dict[bytes, bytes]) -> None:
        state = self.scope["state"]
        made = headers.get(b"location", b"").decode("latin-1")
        self.access.trail.note(
            AuditEntry(
                who=self.identity.who,
                key_id=self.identity.key_id,
                address=address_of(self.scope),
                action=self.rule.action,
                target=state.get("audit_target") or made or self.scope["path"],
                status=status,
                outcome="done" if status < 400 else f"refused ({status})" if status < 500 else f"failed ({status})",
            )
        )
