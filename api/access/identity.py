"""Who sends a request, and why a request is refused. Neither holds a secret, so both may be logged."""

from __future__ import annotations

from dataclasses import dataclass

from api.access.scopes import Scope

__all__ = ["LOCAL", "Identity", "Refused"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """The holder of a key, directly or in a session of the page."""

    name: str
    scope: Scope
    key_id: str = ""  # empty: nobody needs a key
    session: bool = False

    @property
    def who(self) -> str:
        """For the audit log."""
        return f"{self.name} (key {self.key_id})" if self.key_id else self.name


LOCAL = Identity(name="local", scope=Scope.ADMIN)  # everybody, where no key is needed: on the loopback interface only


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """Why a request is not served: the HTTP status and one line."""

    status: int
    detail: str
    failed: bool = False  # something was shown and did not fit: too many of these are slowed down
