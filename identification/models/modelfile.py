"""The model file: which kind of model it holds, the reader of that kind, and the one writer."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final
from unicodedata import category

from excitation.atomic import written_whole
from excitation.untrusted import parse_json
from identification.errors import ModelError, ModelFileError
from identification.fmu_process.choice import Choice
from identification.models.not_a_model import not_a_model
from identification.models.protocol import SimulationModel

FORMAT: Final = "damper-rig/model"
FORMAT_VERSION: Final = 1

# What JSON gives is of any type until it has been looked at.
Json = Any

_NOT_SHOWN = ("Cc", "Zl", "Zp")  # classes of Unicode: control characters, and breaks of lines and paragraphs
_LONGEST_SHOWN = 60  # characters of a value in a message


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of model: the word in its file, and its reader as `module:function`.

    The reader of a JSON kind takes the parsed file; that of a kind with an `ending` of its own takes the path and the
    user's choice. Readers are named, not imported: the kinds build on this package, and a command that reads one kind
    need not load the others.
    """

    name: str
    reader: str
    ending: str = ""


KINDS: Final = (
    Kind(name="physical", reader="identification.physical.modelfile:model_from_json"),
    *(
        Kind(name=name, reader="identification.blackbox.modelfile:alone_from_json")
        for name in ("nnoe", "narx", "mlp", "arx")
    ),
    Kind(name="polynomial", reader="identification.blackbox.polynomialfile:polynomial_from_json"),
    Kind(name="layered", reader="identification.blackbox.layeredfile:layered_from_json"),
    Kind(name="hybrid", reader="identification.blackbox.hybrid:hybrid_from_json"),
    Kind(name="fmu", reader="identification.fmu.model:open_fmu", ending=".fmu"),
)


def load_model(
    path: str | os.PathLike[str],
    choice: Choice | None = None,
    *,
    only: Sequence[str] = (),
    kinds: Sequence[Kind] = KINDS,
) -> SimulationModel:
    """The model of a file, of whatever kind it is.

    `choice` connects the variables of an FMU. `only` names the kinds that the caller can use; all, where it is empty.

    Raises
    ------
    ModelFileError
        one line that names the file, the place in it, the value and what would be right.
    """
    path = Path(path)
    try:
        own = next((kind for kind in kinds if kind.ending and kind.ending == path.suffix.lower()), None)
        if own is None:
            return model_from_json(parsed_file(path), only=only, kinds=kinds)
        _check_usable(own.name, only)
        model: SimulationModel = _reader(own)(path, choice)
    except ModelFileError:
        raise
    except ModelError as error:
        text = str(error)
        raise ModelFileError(text if text.startswith(f"{path}: ") else f"{path}: {text}") from error
    return model


def model_from_json(data: Json, *, only: Sequence[str] = (), kinds: Sequence[Kind] = KINDS) -> SimulationModel:
    """The model of a parsed file, of whatever kind it is; raises ModelError with the place and the cure."""
    known = {kind.name: kind for kind in kinds if not kind.ending}
    name = kind_of(data)
    if not isinstance(name, str) or name not in known:
        endings = "".join(f"; a model of kind '{kind.name}' is a file {kind.ending}" for kind in kinds if kind.ending)
        if name == "multiaxis":
            raise ModelError("kind is 'multiaxis': it gives the loads of several axes, see damper-rig simulate")
        if name == "inverse":
            raise ModelError("kind is 'inverse': it gives a current for a wanted force, see damper-rig track")
        raise ModelError(f"kind is {shown(name)}: this program reads {_quoted(known)}{endings}")
    _check_usable(name, only)
    model: SimulationModel = _reader(known[name])(data)
    return model


def kind_of(data: Json) -> Json:
    """The kind that a parsed model file states, after a look at its format; raises ModelError."""
    if not isinstance(data, Mapping):
        raise ModelError(f"a model is an object, this is {type_of(data)}")
    if data.get("format") != FORMAT:
        raise ModelError(f"format is {shown(data.get('format'))}: a model file has '{FORMAT}'")
    version = data.get("format_version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ModelError(f"format_version is {shown(version)}: it must be a positive integer")
    if version > FORMAT_VERSION:
        raise ModelError(f"format_version is {version}: this program reads up to {FORMAT_VERSION}; update it")
    if not isinstance(data.get("name", ""), str):
        raise ModelError(f"name is {shown(data['name'])}: it must be text")
    if any(category(letter) in _NOT_SHOWN for letter in data.get("name", "")):
        raise ModelError(f"name is {shown(data['name'])}: it must be one line of text without control characters")
    return data.get("kind")


def write_json(path: str | os.PathLike[str], data: Mapping[str, Json]) -> None:
    """Write a model file: complete under its name, or not at all; raises ModelFileError."""
    text = json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    with written_whole(Path(path), ModelFileError) as temporary:
        temporary.write_text(text, encoding="utf-8")


def shown(value: Json) -> str:
    """A value of a file in a message, cut where it is long."""
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"


def type_of(value: Json) -> str:
    """What JSON calls a value, for a message."""
    names = {dict: "an object", list: "a list", str: "text", bool: "true or false", type(None): "null"}
    return names.get(type(value), "a number")


def parsed_file(path: Path) -> Json:
    """What the JSON of a model file holds; raises ModelFileError, one line, where it is none."""
    wrong = not_a_model(path)
    if wrong:
        raise ModelFileError(wrong)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise ModelFileError(f"{path}: can't be read ({reason}): give a model file in JSON") from error
    try:
        return parse_json(text)
    except json.JSONDecodeError as error:
        raise ModelFileError(f"{path}: line {error.lineno}, column {error.colno}: no JSON ({error.msg})") from error
    except (ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: no JSON that can be read ({error}): give a model file") from error


def _check_usable(name: str, only: Sequence[str]) -> None:
    if only and name not in only:
        raise ModelError(f"kind is {name!r}: here a model of kind {_quoted(only)} is needed")


def _quoted(names: Mapping[str, Kind] | Sequence[str]) -> str:
    return " or ".join(f"'{name}'" for name in names)


def _reader(kind: Kind) -> Any:  # Any: readers of two signatures, each checked where it is defined
    module, function = kind.reader.split(":")
    return getattr(import_module(module), function)
