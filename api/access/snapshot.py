"""Every key and session of the store as it was at one moment: who a token belongs to, without asking the store.

Times that the store wrote are on its clock. Here they are on the steady clock of this process: keys and sessions expire
on time while the store is away, whatever a wall clock does. An end that was read once only ever comes nearer, and what
was idle stays so: where the store's clock is set back, nothing is valid again.
"""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from dataclasses import dataclass, field

from api.access.identity import Identity, Refused
from api.access.scopes import Scope
from api.access.tokens import digest_of_key, digest_of_session, split_key

__all__ = ["ABSOLUTE_S", "IDLE_S", "HeldKey", "HeldSession", "Snapshot"]

IDLE_S = 30 * 60.0  # an open page asks every 15 s who is signed in: a session idles when its last page is closed
ABSOLUTE_S = 12 * 3600.0  # a shift; then the key must be shown again

_UNKNOWN = Refused(status=401, detail="this key is not known: look at it, or ask an administrator", failed=True)
_NO_SESSION = Refused(status=401, detail="you are not signed in any more: sign in at /sign-in", failed=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldKey:
    """One key as it is checked; ``ends_s`` on the steady clock."""

    id: str
    name: str
    scope: Scope
    digest: str = field(repr=False)
    ends_s: float
    revoked: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldSession:
    """One session as it is checked; times on the steady clock; ``stored_s``: when it was seen, as it is stored."""

    key_id: str
    ends_s: float
    seen_s: float
    stored_s: float

    def over(self, used_s: float | None, steady_s: float) -> bool:
        """Whether it has ended; ``used_s``: when this process last saw it."""
        seen_s = self.seen_s if used_s is None else max(self.seen_s, used_s)
        return steady_s - seen_s > IDLE_S or steady_s > self.ends_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """All keys by their ids, and all sessions by their digests."""

    keys: Mapping[str, HeldKey] = field(default_factory=dict)
    sessions: Mapping[str, HeldSession] = field(default_factory=dict, repr=False)

    def of_key(self, text: str, steady_s: float) -> Identity | Refused:
        """Whose key this is at this moment of the steady clock."""
        parts = split_key(text)
        held = self.keys.get(parts[0]) if parts else None
        if parts is None or held is None:
            return _UNKNOWN
        if not hmac.compare_digest(digest_of_key(*parts), held.digest):
            return _UNKNOWN
        return _usable(held, steady_s, session=False)

    def of_session(self, token: str, used_s: float | None, steady_s: float) -> Identity | Refused:
        """Whose session this is; ``used_s``: when this process last saw it, on the steady clock."""
        held = self.sessions.get(digest_of_session(token))
        if held is None or held.over(used_s, steady_s):
            return _NO_SESSION
        return _usable(self.keys[held.key_id], steady_s, session=True)


def _usable(key: HeldKey, steady_s: float, *, session: bool) -> Identity | Refused:
    if key.revoked:
        return _no_longer(key, "was revoked")
    if steady_s >= key.ends_s:
        return _no_longer(key, "has expired")
    return Identity(name=key.name, scope=key.scope, key_id=key.id, session=session)


def _no_longer(key: HeldKey, why: str) -> Refused:
    return Refused(status=401, detail=f"key {key.id} {why}: ask an administrator for another", failed=True)
