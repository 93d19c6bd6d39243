"""One plan of several: files, configurations and single tests, each with its own rest and temperature gates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from excitation.checks import check_at_least, check_within
from excitation.configuration import STRICT, to_spec
from excitation.errors import DesignError, ExcitationError
from excitation.file_drive import FileSpec, file_drive
from excitation.files import read_plan
from excitation.plan import Test, TestPlan, test_from_config
from excitation.plan_design import as_design
from excitation.plan_files import holds_a_plan
from excitation.signal import JSON, Excitation

__all__ = ["JoinedPlanSpec", "PartSpec", "joined_plan"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PartSpec:
    """A plan or an excitation in a ``file``, what ``command`` makes of the configuration in ``config``, or a ``test``.

    ``dwell`` and the gates replace those of its tests where they are given. ``name`` begins the names of its tests.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str = ""
    file: str = ""
    command: str = ""
    config: str = ""
    test: dict[str, Any] | None = None  # Any: JSON, read as a test of a plan
    repeats: int = 1
    dwell_s: float | None = None
    min_temperature_degc: float | None = None
    max_temperature_degc: float | None = None

    def __post_init__(self) -> None:
        given = [bool(self.file), bool(self.command or self.config), self.test is not None]
        if sum(given) != 1 or bool(self.command) != bool(self.config):
            raise DesignError("a part has either file, or command and config, or test: give one of the three")
        check_within("repeats", self.repeats, 1, 1000)
        if self.dwell_s is not None:
            check_at_least("dwell", self.dwell_s, 0.0, "s")


@dataclass(frozen=True, slots=True, kw_only=True)
class JoinedPlanSpec:
    """Parts in the order in which they are played; without a ``warm_up`` that of the first part which has one."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    parts: tuple[PartSpec, ...]
    warm_up: dict[str, Any] | None = None  # Any: JSON, read as a test of a plan

    def __post_init__(self) -> None:
        if not self.parts:
            raise DesignError("parts is empty: a plan needs at least one [[parts]]")


def joined_plan(config: Mapping[str, JSON], make: Callable[[str, Path], Excitation | TestPlan]) -> TestPlan:
    """The tests of every part; ``make`` designs a configuration file by a command.

    A name that occurs again gets _2, _3 … Raises DesignError that names the part, and what its files raise.
    """
    spec = to_spec(JoinedPlanSpec, config)
    tests: list[Test] = []
    warm_up = None if spec.warm_up is None else test_from_config({"name": "warm_up", **spec.warm_up})
    taken: set[str] = set()
    for number, part in enumerate(spec.parts):
        try:
            plan = _plan_of(part, make)
        except DesignError as error:
            raise error.below(f"parts[{number}]", "parts", number) from error
        except ExcitationError as error:
            raise type(error)(f"parts[{number}]: {error}") from error
        warm_up = warm_up or plan.warm_up
        for _ in range(part.repeats):
            tests += [_renamed(_conditioned(test, part), part, taken) for test in plan.tests]
    return TestPlan(tests=tuple(tests), warm_up=warm_up, design=config)


def _plan_of(part: PartSpec, make: Callable[[str, Path], Excitation | TestPlan]) -> TestPlan:
    if part.test is not None:
        return TestPlan(tests=(test_from_config({"name": "test", **part.test}),))
    if part.file:
        plan = read_plan(part.file)
        return replace(plan, tests=tuple(_without_samples(test, Path(part.file)) for test in plan.tests))
    made = make(part.command, Path(part.config))
    if isinstance(made, TestPlan):
        return made
    return TestPlan(tests=(Test(name=Path(part.config).stem, excitation=made),))


def _without_samples(test: Test, path: Path) -> Test:
    """The test by its design, or else, if it is all that the file holds, by the file."""
    made = as_design(test.excitation, files=True)
    if made.sources is None and not holds_a_plan(path):
        made = file_drive(FileSpec(record=str(path.resolve())))
    return replace(test, excitation=made)


def _conditioned(test: Test, part: PartSpec) -> Test:
    return replace(
        test,
        dwell_s=test.dwell_s if part.dwell_s is None else part.dwell_s,
        min_temperature_degc=_other(part.min_temperature_degc, test.min_temperature_degc),
        max_temperature_degc=_other(part.max_temperature_degc, test.max_temperature_degc),
    )


def _other(given: float | None, otherwise: float | None) -> float | None:
    return otherwise if given is None else given


def _renamed(test: Test, part: PartSpec, taken: set[str]) -> Test:
    name = f"{part.name}_{test.name}" if part.name else test.name
    unique, number = name, 1
    while unique in taken:
        number += 1
        unique = f"{name}_{number}"
    taken.add(unique)
    return replace(test, name=unique)
