"""Turns a configuration (TOML, JSON) into the frozen dataclass that it describes, or into a one-line error.

The keys of a configuration are the field names without their unit suffix: ``sample_rate_hz`` reads
``sample_rate``.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_type_hints

from excitation.errors import DesignError, Findings
from excitation.signal import JSON

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from pydantic_core import ErrorDetails

__all__ = ["STRICT", "key_of", "read_config", "to_config", "to_spec", "unit_of"]

Spec = TypeVar("Spec")

DEEPEST = 6
"""Levels of the deepest configuration, a step of a test of a plan; texts say it, Python's own bound refuses."""

_UNITS: Mapping[str, str] = {  # suffixes of fields, the longer ones first
    "_n_m_per_rad": "N·m/rad",
    "_n_s_per_m": "N·s/m",
    "_n_per_m": "N/m",
    "_kg_m2": "kg·m²",
    "_per_m": "1/m",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_n_s_m": "N·s/m",
    "_n_m": "N/m",
    "_hz": "Hz",
    "_degc": "°C",
    "_kg": "kg",
    "_pa": "Pa",
    "_m3_s": "m³/s",
    "_m2": "m²",
    "_m3": "m³",
    "_j_k": "J/K",
    "_w_k": "W/K",
    "_s": "s",
    "_m": "m",
    "_a": "A",
    "_n": "N",
    "_w": "W",
    "_deg": "°",
}


def key_of(field_name: str) -> str:
    """The configuration key of a field: its name without the unit.

    >>> key_of("max_velocity_m_s"), key_of("sample_rate_hz"), key_of("period_samples")
    ('max_velocity', 'sample_rate', 'period_samples')
    """
    suffix = next((suffix for suffix in _UNITS if field_name.endswith(suffix)), "")
    return field_name.removesuffix(suffix)


def unit_of(field_name: str) -> str:
    """The unit of a field; empty where it has none.

    >>> unit_of("max_velocity_m_s"), unit_of("period_samples")
    ('m/s', '')
    """
    return next((unit for suffix, unit in _UNITS.items() if field_name.endswith(suffix)), "")


STRICT: dict[str, Any] = {"extra": "forbid", "alias_generator": key_of, "allow_inf_nan": False}
"""What a dataclass carries as ``__pydantic_config__``: no unknown keys, no nan. Any: pydantic's own
dictionary.
"""


def read_config(path: Path) -> dict[str, JSON]:
    """The mapping in a TOML file; raises DesignError with the file's name where it cannot be read."""
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise DesignError(f"{path}: {error.strerror or error}: give a TOML file that can be read") from error
    except UnicodeDecodeError as error:
        raise DesignError(f"{path}: not a text: give a TOML file, such as those in examples/") from error
    except tomllib.TOMLDecodeError as error:
        raise DesignError(f"{path}: not valid TOML: {error}") from error
    except RecursionError as error:
        raise DesignError(f"{path}: tables or lists nested too deep: a design has at most {DEEPEST} levels") from error


def to_spec(kind: type[Spec], config: Mapping[str, JSON], where: str = "") -> Spec:
    """The frozen dataclass that the configuration describes.

    Raises DesignError, one line: ``where``, the key, the value and what would be right.
    """
    from pydantic import ValidationError

    if not isinstance(config, Mapping):
        raise DesignError(f"{where or 'configuration'} is {_shown(config)}: it must be a table of keys and values")
    try:
        text = json.dumps(config)
    except RecursionError as error:
        raise DesignError(f"{where or 'configuration'}: nested too deep: it has at most {DEEPEST} levels") from error
    except (TypeError, ValueError) as error:
        raise DesignError(
            f"{where or 'configuration'}: {error}: use only text, numbers, booleans, lists and tables"
        ) from error
    try:
        spec: Spec = _adapter(kind).validate_json(text, strict=True)  # type: ignore[arg-type]  # classes hash
        return spec
    except ValidationError as error:
        errors = error.errors()
        message = _line(_error_of_likeliest_branch(errors), kind, where)
        raise DesignError(message, findings=_findings(errors, kind, where)) from error


def to_config(spec: Any) -> dict[str, JSON]:
    """The configuration that makes ``spec`` again, defaults written out. Any: a dataclass of any
    specification. Raises DesignError where a field holds another type than its own.
    """
    from pydantic_core import PydanticSerializationError

    adapter = _adapter(type(spec))  # type: ignore[arg-type]  # classes hash
    try:
        config = adapter.dump_python(spec, by_alias=True, mode="json", exclude_none=True, warnings="error")
    except PydanticSerializationError as error:
        named = re.search(r"Expected `(.+?)`.*field_name='(\w+)', input_value=(.+?), input_type=(\w+)", str(error))
        expected, field, value, kind = named.groups() if named else ("another type", type(spec).__name__, "", "unknown")
        raise DesignError(f"{key_of(field)} is {value:.60} ({kind}): it must be {expected}") from error
    return dict(config)


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    # Any: functools.cache loses the type; the callers state it
    from pydantic import TypeAdapter  # 0.15 s to import: only where a configuration is read

    return TypeAdapter(kind)


def _findings(errors: Sequence[ErrorDetails], kind: type, where: str) -> Findings:
    """A line for each key that is wrong; of a union, for its likeliest branch."""
    keys: dict[tuple[str | int, ...], list[ErrorDetails]] = {}
    for error in errors:
        branch = next((k for k, part in enumerate(error["loc"]) if _is_branch(part)), len(error["loc"]))
        keys.setdefault(error["loc"][:branch], []).append(error)
    worst = [_error_of_likeliest_branch(of_key) for of_key in keys.values()]
    return tuple((tuple(p for p in one["loc"] if not _is_branch(p)), _line(one, kind, where)) for one in worst)


def _line(worst: ErrorDetails, kind: type, where: str) -> str:
    path = [part for part in worst["loc"] if not _is_branch(part)]
    place = ".".join(str(part) for part in path)
    inside = f"{where}: " if where else ""
    value = _shown(worst["input"])
    match worst["type"]:
        case "missing":
            return f"{inside}{place} is missing: add it"
        case "unexpected_keyword_argument":
            known = _known_keys(kind, worst["loc"][:-1])
            return f"{inside}{place} = {value} is not a known key: known are {known}"
        case "value_error":
            own = worst["msg"].removeprefix("Value error, ")
            return f"{inside}{place}: {own}" if place else f"{inside}{own}"
        case _:
            return f"{inside}{place} is {value}: {worst['msg'].replace('Input should', 'it must', 1)}"


def _error_of_likeliest_branch(errors: Sequence[ErrorDetails]) -> ErrorDetails:
    """The error to report: pydantic reports every branch of a union, of which the one with the fewest errors and
    the same shape as the value is taken as the one that was meant.
    """
    shaped = [e for e in errors if e["type"] not in _WRONG_BRANCH.get(type(e["input"]), ())] or list(errors)
    counts = Counter(_branch(e) for e in shaped if _branch(e))
    best = min(counts, key=lambda branch: counts[branch], default="")
    meant = [e for e in shaped if _branch(e) in ("", best)]
    return next((e for e in meant if e["type"] == "unexpected_keyword_argument"), meant[0])


_SCALARS = ("string_type", "float_type", "int_type", "literal_error")
_WRONG_BRANCH: Mapping[type, tuple[str, ...]] = {  # errors of branches that a value of this type cannot have meant
    dict: (*_SCALARS, "tuple_type"),
    list: (*_SCALARS, "dataclass_type"),
    str: ("dataclass_type", "tuple_type"),
    float: ("dataclass_type", "tuple_type"),
    int: ("dataclass_type", "tuple_type"),
}


def _branch(error: ErrorDetails) -> str:
    return next((str(part) for part in error["loc"] if _is_branch(part)), "")


def _is_branch(part: object) -> bool:
    """Whether a part of an error's location is a class or type that pydantic inserts between the keys."""
    return isinstance(part, str) and (part[:1].isupper() or "[" in part or part in {"str", "float", "int"})


def _known_keys(kind: type, path: Sequence[int | str]) -> str:
    for step in path:
        kind = _type_below(kind, step)
    return ", ".join(key_of(f.name) for f in fields(kind)) if is_dataclass(kind) else "those of the documentation"


def _type_below(kind: type, step: int | str) -> type:
    """The dataclass in the field ``step`` of ``kind``; of a union its first one, until a later step names the
    branch.
    """
    if isinstance(step, int) or not is_dataclass(kind):
        return kind
    if _is_branch(step):
        module = vars(import_module(kind.__module__))
        return module.get(step, kind) if isinstance(module.get(step), type) else kind
    name = next((f.name for f in fields(kind) if key_of(f.name) == step), "")
    hint = get_type_hints(kind).get(name, kind)
    return next((t for t in (hint, *get_args(hint)) if is_dataclass(t) and isinstance(t, type)), kind)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"
