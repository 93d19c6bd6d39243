"""Help without names of Python types: a flag has no value, an argument its name, an option what to give."""

from __future__ import annotations

import re
from typing import Any

from typer.core import TyperGroup

__all__ = ["WordedGroup"]

_TYPE = re.compile(r"<(?:list\[)?(\w+)\]?(?: range)?>")  # `range`: limits stand behind it
_WORDS = {"str": "TEXT", "path": "PATH", "int": "NUMBER", "float": "NUMBER", "bool": ""}


class WordedGroup(TyperGroup):
    """A group whose commands, and theirs, show words in the column of types."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # Any: typer keeps click inside or outside of itself
        """The command, worded."""
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            _word(command, ctx)
        return command

    def get_params(self, ctx: Any) -> Any:
        """The options of the group itself, worded."""
        for parameter in (params := super().get_params(ctx)):
            _word_parameter(parameter, ctx)
        return params


def _word(command: Any, ctx: Any) -> None:
    for parameter in command.get_params(ctx):
        _word_parameter(parameter, ctx)
    for inner in getattr(command, "commands", {}).values():
        _word(inner, ctx)


def _word_parameter(parameter: Any, ctx: Any) -> None:
    """Of the versions of typer that show types; others keep what they show."""
    shown = getattr(parameter, "display_type_rich", None)
    if shown is None:
        return
    text = str(shown(ctx) or "")
    is_argument = parameter.param_type_name == "argument"
    text = _TYPE.sub(lambda found: "" if is_argument else _WORDS.get(found[1].lower(), "TEXT"), text)
    parameter.display_type_rich = lambda ctx: text.strip(". ") or None
