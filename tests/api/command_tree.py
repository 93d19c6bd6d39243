"""The commands and their parameters, as the program itself knows them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import typer

from api.cli.main import app

# Any: typer keeps click inside or outside of itself, depending on its version


@cache
def commands() -> Mapping[str, Any]:
    """Every command and every group, by the words that call it."""
    return dict(_below(typer.main.get_command(app), ()))


def _below(group: Any, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    yield " ".join(path), group
    for name, command in getattr(group, "commands", {}).items():
        yield from _below(command, (*path, name))


def takes_a_path(parameter: Any) -> bool:
    return "Path" in str(parameter.type_descriptor.annotation)


def name_of(parameter: Any) -> str:
    return str(parameter.opts[-1])


def line(path: str, given: Mapping[str, str], otherwise: str = "nothing.h5") -> list[str]:
    """The words of a command with these parameters, and with `otherwise` for all else that it must be given."""
    words, behind = path.split(), []
    for one in commands()[path].params:
        if not one.required and name_of(one) not in given:
            continue
        value = given.get(name_of(one), "modbus://127.0.0.1:9" if name_of(one) == "--rig" else otherwise)
        if one.param_type_name == "argument":
            behind.append(value)
        else:
            words += [one.opts[0], value]
    return [*words, *behind]
