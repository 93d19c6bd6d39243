"""Paths of the routes of the service, of things that do not exist."""

from __future__ import annotations

import re

NOBODY = "0" * 32


def path_of(template: str) -> str:
    """The path of a route with the id of nothing in each of its places."""
    return re.sub(r"\{\w+\}", NOBODY, template)
