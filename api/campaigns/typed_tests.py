"""How a test and an envelope are described in OpenAPI: derived from the specifications that excitation reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, make_dataclass
from functools import cache, reduce
from operator import or_
from typing import Annotated, Any, Literal, get_args, get_type_hints

from pydantic import Field as Described
from pydantic import GetJsonSchemaHandler, TypeAdapter
from pydantic_core import CoreSchema

from api.store.samples import KIND, SamplesSpec
from excitation import Envelope
from excitation.configuration import STRICT, key_of, unit_of
from excitation.plan import TestConditions
from excitation.plan_steps import STEPS
from excitation.synthesis import SPECS

__all__ = ["EXAMPLES", "EnvelopeConfig", "TestConfig", "units"]

EXAMPLES: tuple[dict[str, Any], ...] = (  # of tests; a test of the suite plays them all
    {"name": "sine 2 Hz", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 10},
    {
        "name": "random phase",
        "kind": "multisine",
        "sample_rate": 1024.0,
        "period_samples": 4096,
        "periods": 2,
        "displacement": {"f_min": 0.5, "f_max": 12.0, "max_displacement": 0.02, "max_velocity": 0.3},
        "held_out": True,
    },
)


@dataclass(frozen=True)
class _DescribedBy:
    """The JSON schema of a value that excitation itself reads and checks. Any: types made at run time."""

    kind: str

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(_test_schema() if self.kind == "test" else TypeAdapter(Envelope).core_schema)


TestConfig = Annotated[dict[str, Any], _DescribedBy("test")]
EnvelopeConfig = Annotated[dict[str, Any], _DescribedBy("envelope")]


def units() -> dict[str, dict[str, str]]:
    """The unit of each key of each described class that has one: {class: {key: unit}}."""
    found: dict[str, dict[str, str]] = {}
    for kind in (*_tests(), *_steps(), Envelope):
        for one in _inside(kind):
            found[one.__name__] = {key_of(f.name): unit for f in fields(one) if (unit := unit_of(f.name))}
    return found


@cache
def _test_schema() -> CoreSchema:
    union: Any = reduce(or_, _tests())  # Any: a union of classes that are made here
    return TypeAdapter(Annotated[union, Described(discriminator="kind")]).core_schema


@cache
def _tests() -> tuple[type, ...]:
    steps: Any = list[Annotated[reduce(or_, _steps()), Described(discriminator="step")]]  # type: ignore[misc]  # classes made here
    return tuple(
        _with(f"{name.capitalize()}Test", "kind", name, spec, [("name", str), *_conditions(steps)])
        for name, spec in {**SPECS, KIND: SamplesSpec}.items()
    )


@cache
def _steps() -> tuple[type, ...]:
    return tuple(_with(f"{name.capitalize()}Step", "step", name, spec, []) for name, spec in STEPS.items())


def _conditions(steps: Any) -> Iterator[tuple[str, Any, Any]]:
    hints = get_type_hints(TestConditions)
    for one in fields(TestConditions):
        if one.name == "before":
            yield one.name, steps, field(default_factory=list)
        elif one.name != "name":
            yield one.name, hints[one.name], _default(one)


def _with(title: str, tag: str, value: str, spec: type, more: list[Any]) -> type:
    """A class with the fields of a specification, a tag that names it, and more. Any: fields of dataclasses."""
    hints = get_type_hints(spec)
    own = [(one.name, hints[one.name], _default(one)) for one in fields(spec)]
    made = make_dataclass(
        title,
        [(tag, Literal[value]), *own, *more],
        kw_only=True,
        namespace={"__pydantic_config__": STRICT, "__doc__": spec.__doc__},
    )
    made.__module__ = __name__
    return made


def _default(one: Field[Any]) -> Any:
    if one.default_factory is not MISSING:
        return field(default_factory=one.default_factory)
    return field() if one.default is MISSING else field(default=one.default)


def _inside(kind: type) -> Iterator[type]:
    """A dataclass and every dataclass in its fields."""
    yield kind
    for hint in get_type_hints(kind).values():
        for part in (hint, *get_args(hint)):
            if isinstance(part, type) and is_dataclass(part):
                yield from _inside(part)
