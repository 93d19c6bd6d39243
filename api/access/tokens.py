"""Keys and session tokens as text: how they are made, recognised, digested and kept out of messages.

Both carry 256 random bits. Nobody can try 2^256 values, so a slow password hash would only slow down the service; a
fast one is enough to make a copy of the store useless. The digest of a key is keyed with the key's id: a digest that
is copied to another row of the table opens nothing.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets

__all__ = ["KEY_PATTERN", "digest_of_key", "digest_of_session", "new_key", "new_session", "redacted", "split_key"]

_SECRET_BYTES = 32  # 256 bits
_ID_BYTES = 6
KEY_PATTERN = re.compile(r"dr_([0-9a-f]{12})_([A-Za-z0-9_-]{43})")
_PART_OF_KEY = re.compile(r"(?<=dr_)[0-9A-Za-z_-]{8,}")  # also of one that was cut off


def new_key() -> tuple[str, str, str]:
    """A new key: its id, its secret, and the text ``dr_ID_SECRET`` that is shown once."""
    key_id, secret = secrets.token_hex(_ID_BYTES), secrets.token_urlsafe(_SECRET_BYTES)
    return key_id, secret, f"dr_{key_id}_{secret}"


def split_key(text: str) -> tuple[str, str] | None:
    """The id and the secret of a key; None where the text is no key."""
    found = KEY_PATTERN.fullmatch(text)
    return (found[1], found[2]) if found else None


def digest_of_key(key_id: str, secret: str) -> str:
    """HMAC-SHA256 of the secret, 64 hexadecimal digits."""
    return hmac.new(key_id.encode(), secret.encode(), hashlib.sha256).hexdigest()


def new_session() -> str:
    return secrets.token_urlsafe(_SECRET_BYTES)


def digest_of_session(token: str) -> str:
    """SHA-256, 64 hexadecimal digits: sessions are found by it, so what is compared is never the token."""
    return hashlib.sha256(token.encode()).hexdigest()


def redacted(text: str) -> str:
    """The text with everything that follows ``dr_`` in a key, whole or cut off, replaced; its length stays.

    >>> redacted("there is no campaign 'dr_0123456789ab_secret'")
    "there is no campaign 'dr_*******************'"
    """
    return _PART_OF_KEY.sub(lambda found: "*" * len(found[0]), text)
