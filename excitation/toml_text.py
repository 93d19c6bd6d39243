"""A configuration as TOML text, exact to the last bit of every number."""

from __future__ import annotations

import json
from collections.abc import Mapping

from excitation.errors import DesignError
from excitation.signal import JSON

__all__ = ["toml_text"]


def toml_text(config: Mapping[str, JSON]) -> str:
    """Plain values first, then tables, then lists of tables; deeper values inline.

    >>> print(toml_text({"seed": 1, "tests": [{"name": "slow", "current": {"min": 0.5}}]}), end="")
    seed = 1
    <BLANKLINE>
    [[tests]]
    name = "slow"
    current = { min = 0.5 }
    """
    text = _lines({k: v for k, v in config.items() if not isinstance(v, Mapping) and not _tables(v)})
    for key, value in config.items():
        if isinstance(value, Mapping):
            text += f"\n[{_key(key)}]\n{_lines(value)}"
        text += "".join(f"\n[[{_key(key)}]]\n{_lines(entry)}" for entry in _tables(value))
    return text


def _tables(value: JSON) -> list[Mapping[str, JSON]]:
    """The entries of a list of tables; empty for any other value."""
    entries = value if isinstance(value, (list, tuple)) else []
    tables = [entry for entry in entries if isinstance(entry, Mapping)]
    return tables if len(tables) == len(entries) else []


def _lines(table: Mapping[str, JSON]) -> str:
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items() if value is not None)


def _value(value: JSON) -> str:
    match value:
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case Mapping():
            pairs = ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None)
            return "{ " + pairs + " }" if pairs else "{}"
        case list() | tuple():
            return "[" + ", ".join(_value(v) for v in value) + "]"
    raise DesignError(f"{value!r} has no place in TOML: use text, numbers, booleans, lists and tables")


def _key(key: str) -> str:
    bare = key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
    return key if bare else json.dumps(key, ensure_ascii=False)
