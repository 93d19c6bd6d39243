"""Who a request is from, and whether they may: answered from memory, without the store, a thread or a parser."""

from __future__ import annotations

from typing import Any, Literal

from api.access.identity import LOCAL, Identity, Refused
from api.access.keyring import Keyring
from api.access.requests import Sender, sender
from api.access.rules import Rule
from api.access.scopes import Scope

__all__ = ["Gate"]

_NO_KEY = Refused(
    status=401, detail="this service needs a key: send it as 'Authorization: Bearer dr_…', or sign in at /sign-in"
)
_ELSEWHERE = Refused(status=403, detail="the request comes from a page of another site: use this service's own page")
_UNVOUCHED = Refused(
    status=403, detail="a session changes something only from this service's own page: use a key in a program"
)


class Gate:
    """``keys_required``: also while no key was made; else a key is required from the moment at which one is made."""

    def __init__(self, keyring: Keyring, *, keys_required: bool) -> None:
        self.keyring = keyring
        self._always = keys_required

    @property
    def keys_required(self) -> bool:
        return self._always or self.keyring.any_made

    def may(self, scope: Any, rule: Rule) -> Identity | Refused:
        """Who sends this, where the rule lets them; else why not. Any: ASGI's own dictionary."""
        one = sender(scope)
        if one.from_elsewhere:
            return _ELSEWHERE
        found = self._identify(one)
        if isinstance(found, Refused) or rule.scope is None or found.scope.includes(rule.scope):
            return found
        return Refused(
            status=403,
            detail=f"this needs a key with the scope {rule.scope}: yours ({found.name!a:.60}) has {found.scope}",
        )

    def may_stop(self, scope: Any) -> Identity | Literal[False]:
        """For the path that stops a rig: who sends this, or False where they may not end a test."""
        found = self.may(scope, Rule(scope=Scope.SCHEDULE, stops=True))
        return found if isinstance(found, Identity) else False

    def still(self, scope: Any) -> bool:
        """Whether the sender of a request that is still being answered may go on reading the answer."""
        return isinstance(self._identify(sender(scope), touch=False), Identity)

    def _identify(self, one: Sender, *, touch: bool = True) -> Identity | Refused:
        if not self.keyring.ready:
            return Refused(status=503, detail="the service has not read its keys yet: try again in a second")
        if one.bearer is not None:  # also where no key is needed: a wrong key is a mistake that must be seen
            return self.keyring.of_key(one.bearer)
        if not self.keys_required and not one.forwarded:  # what a proxy passes on is not from this machine
            return LOCAL
        if one.cookie is None:
            return _NO_KEY
        if one.changes and not one.from_own_page:
            return _UNVOUCHED
        return self.keyring.of_session(one.cookie, touch=touch)
