"""Texts that people give: names, specimens, reasons."""

from __future__ import annotations

from api.errors import InputError

__all__ = ["check_text", "shown"]


def check_text(key: str, value: str, longest: int) -> None:
    """Raise InputError where a text is empty, too long or not printable."""
    if not value.strip() or len(value) > longest or not value.isprintable():
        raise InputError(f"{key} is {shown(value)}: it must be 1 … {longest} printable characters")


def shown(value: object) -> str:
    """The beginning of a value, for a message."""
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."
