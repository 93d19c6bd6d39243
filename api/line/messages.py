"""What travels on a line: one JSON object a line, in UTF-8, and a proof that both ends know the secret."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import json
from typing import Any

from api.errors import ProcessError

__all__ = ["MOST_BYTES", "Message", "decode", "encode", "proof", "read"]

# Any: JSON
Message = dict[str, Any]

MOST_BYTES = 2**20  # of one message: a campaign of 500 tests has 0.2 MB, a report with live samples some 4 kB


def encode(message: Message) -> bytes:
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"


def decode(line: bytes) -> Message:
    """The message in a line; raises ProcessError for anything else."""
    try:
        message = json.loads(line)
    except ValueError as error:
        raise ProcessError(f"a line of {len(line)} bytes is no message") from error
    if not isinstance(message, dict):
        raise ProcessError("a message is no object")
    return message


async def read(reader: asyncio.StreamReader) -> Message | None:
    """The next message; None at the end of the line. Raises ProcessError for what is no message."""
    try:
        line = await reader.readline()
    except (ValueError, OSError) as error:  # longer than MOST_BYTES, or the connection broke
        raise ProcessError(f"the line broke: {error}") from error
    return decode(line) if line.endswith(b"\n") else None


def proof(secret: str, side: str, nonce: str) -> str:
    """What only somebody who knows the secret can answer to a nonce; ``side`` keeps an answer from being sent back."""
    return hmac.new(secret.encode(), f"{side} {nonce}".encode(), hashlib.sha256).hexdigest()
