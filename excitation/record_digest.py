"""Whether a file is the one that a design was made of: its SHA-256."""

from __future__ import annotations

from hashlib import file_digest
from pathlib import Path

from excitation.errors import DesignError

__all__ = ["check_digest", "digest_of"]


def digest_of(path: Path) -> str:
    """SHA-256 of the file's bytes, as hexadecimal digits."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def check_digest(path: Path, stated: str) -> None:
    """Raises DesignError where the file is another one."""
    if stated != digest_of(path):
        raise DesignError(
            f"record {path}: it is not the file that the design was made of (its SHA-256 differs): put that file back, "
            "or design again"
        )
