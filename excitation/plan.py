"""Tests in the order in which a rig plays them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, TypeAlias

from excitation.configuration import STRICT, key_of, to_config, to_spec
from excitation.errors import DesignError
from excitation.limits_given import TestLimits
from excitation.plan_steps import FAILURES, Gate, OnFailure, Prompt, Step, step_config, steps_from_config
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = [
    "MakeExcitation",
    "Test",
    "TestConditions",
    "TestPlan",
    "conditions_of",
    "config_of",
    "plan_from_config",
    "test_from_config",
    "test_of",
]

MakeExcitation: TypeAlias = "Callable[[Mapping[str, JSON], str], Excitation]"
"""Makes an excitation from its parameters, as :func:`excitation.synthesis.excitation_from_config` does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Test:
    """One excitation with a name and the conditions under which it may start.

    The gate: the test starts only while the damper's temperature lies within [min, max]. ``dwell_s`` is the
    rest before the test. ``held_out``: reserved for validation; ``data_set`` is the name of the set it belongs to
    ("training", "test 1"; empty where it has none).

    ``before`` are steps before the test. Where a step or a gate refuses, ``on_failure`` says what follows: the plan
    stops, the test is skipped, or it is tried again up to ``retries`` times and then the plan stops. A fault of the rig
    or of the wire, and an operator who does not confirm, always stop the plan.

    ``energy_j`` and ``to_temperature_degc`` belong to a warm-up: it is repeated before the first test until the damper
    has taken up this work and is as warm.
    """

    __test__ = False  # the name starts with "Test": pytest must not collect it

    name: str
    excitation: Excitation
    dwell_s: float = 0.0
    min_temperature_degc: float | None = None
    max_temperature_degc: float | None = None
    held_out: bool = False
    data_set: str = ""
    before: tuple[Step, ...] = ()
    on_failure: OnFailure = "stop"
    retries: int = 1  # with on_failure = "retry"
    energy_j: float | None = None
    to_temperature_degc: float | None = None
    limits: TestLimits | None = None  # tighter than those of the machine and the specimen

    def __post_init__(self) -> None:
        if not self.name.strip() or any(ord(c) < 32 for c in self.name):
            raise DesignError(f"name is {self.name!r}: a test needs a printable name")
        if not 0 <= self.dwell_s < float("inf"):
            raise DesignError(f"test {self.name!r}: dwell is {self.dwell_s} s: it must be zero or more")
        low, high = self.min_temperature_degc, self.max_temperature_degc
        if low is not None and high is not None and not low < high:
            raise DesignError(f"test {self.name!r}: min_temperature is {low} °C: it must lie below max ({high} °C)")
        if self.on_failure not in FAILURES or not 1 <= self.retries <= 20:
            raise DesignError(
                f"test {self.name!r}: on_failure is {self.on_failure!r} with {self.retries} retries: "
                f"it must be one of {', '.join(FAILURES)}, with 1 … 20 retries"
            )
        if self.energy_j is not None and not 0 < self.energy_j < float("inf"):
            raise DesignError(f"test {self.name!r}: energy is {self.energy_j} J: it must be positive")

    @property
    def asks(self) -> bool:
        """Whether a step before it asks the operator."""
        return any(
            isinstance(step, Prompt) or (isinstance(step, Gate) and step.of == "ambient") for step in self.before
        )

    @property
    def conditions_the_damper(self) -> bool:
        """Whether it is a warm-up with an end of its own: an energy or a temperature."""
        return self.energy_j is not None or self.to_temperature_degc is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class TestPlan:
    """Tests with unique names, in order; ``warm_up`` is repeated while the next test's gate is too cold."""

    __test__ = False

    tests: tuple[Test, ...]
    warm_up: Test | None = None
    design: Mapping[str, JSON] = field(default_factory=dict)
    changes: tuple[str, ...] = ()  # what became of tests that exceed the rig, a line each

    def __post_init__(self) -> None:
        if not self.tests:
            raise DesignError("tests is empty: a plan needs at least one test")
        ends = [test.name for test in self.tests if test.conditions_the_damper]
        if ends:
            raise DesignError(f"test {ends[0]!r}: energy and to_temperature belong to the warm-up of a plan")
        twice = [name for name, count in Counter(test.name for test in self.tests).items() if count > 1]
        if twice:
            raise DesignError(f"tests: the name {twice[0]!r} occurs more than once: every test needs its own name")

    @property
    def duration_s(self) -> float:
        return sum(test.excitation.duration_s + test.dwell_s for test in self.tests)


@dataclass(frozen=True, slots=True, kw_only=True)
class TestConditions:
    """The keys of a test that do not belong to its excitation."""

    __test__ = False  # the name starts with "Test": pytest must not collect it

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    dwell_s: float = 0.0
    min_temperature_degc: float | None = None
    max_temperature_degc: float | None = None
    held_out: bool = False
    data_set: str = ""
    before: tuple[dict[str, Any], ...] = ()  # Any: JSON, read by steps_from_config
    on_failure: OnFailure = "stop"
    retries: int = 1
    energy: float | None = None
    to_temperature_degc: float | None = None
    limits: TestLimits | None = None


_CONDITION_KEYS = frozenset(key_of(one.name) for one in fields(TestConditions))


def test_from_config(
    config: Mapping[str, JSON],
    make: MakeExcitation = excitation_from_config,  # noqa: PT028 - no test of pytest
) -> Test:
    """The test that a configuration (TOML table, JSON object) describes.

    Keys: name, kind and the parameters of the kind; optionally held_out, data_set, dwell (s), min_temperature
    and max_temperature (°C), before (a list of steps), on_failure, retries; of a warm-up energy (J) and
    to_temperature (°C); limits, a table as :class:`excitation.limits_given.TestLimits` reads it. ``make`` is given the
    kind and its parameters: who keeps samples elsewhere makes the excitations of a kind of its own.

    Raises DesignError: one line with the test's name, the key, the value and what would be right.
    """
    return _test(config, "test", make)


def _test(config: Mapping[str, JSON], where: str, make: MakeExcitation) -> Test:
    if not isinstance(config, Mapping):
        raise DesignError(f"{where} is {config!r}: it must be a table with name, kind and parameters")
    conditions = to_spec(TestConditions, {k: v for k, v in config.items() if k in _CONDITION_KEYS}, where)
    parameters = {k: v for k, v in config.items() if k not in _CONDITION_KEYS}
    return _with_conditions(conditions, make(parameters, f"test {conditions.name!r}"))


def _with_conditions(conditions: TestConditions, excitation: Excitation) -> Test:
    return Test(
        name=conditions.name,
        excitation=excitation,
        dwell_s=conditions.dwell_s,
        min_temperature_degc=conditions.min_temperature_degc,
        max_temperature_degc=conditions.max_temperature_degc,
        held_out=conditions.held_out,
        data_set=conditions.data_set,
        before=steps_from_config(list(conditions.before), f"test {conditions.name!r}: before"),
        on_failure=conditions.on_failure,
        retries=conditions.retries,
        energy_j=conditions.energy,
        to_temperature_degc=conditions.to_temperature_degc,
        limits=conditions.limits,
    )


test_from_config.__test__ = False  # type: ignore[attr-defined]  # pytest must not collect it


def plan_from_config(config: Mapping[str, JSON], make: MakeExcitation = excitation_from_config) -> TestPlan:
    """The plan in {"tests": [...], "warm_up": {...}}: each entry as for ``test_from_config``.

    Raises DesignError: one line.
    """
    if not isinstance(config, Mapping):
        raise DesignError(f"plan is {config!r}: it must be a table with the key tests")
    unknown = sorted(set(config) - {"tests", "warm_up"})
    if unknown:
        raise DesignError(f"plan: {unknown[0]} is not a known key: known are tests, warm_up")
    entries = config.get("tests")
    if not isinstance(entries, (list, tuple)) or not entries:
        raise DesignError("plan: tests must be a list with at least one test")
    tests, wrong = [], []
    for n, entry in enumerate(entries):
        try:
            tests.append(_test(entry, f"tests[{n}]", make))
        except DesignError as error:
            wrong.append(error.below("", "tests", n))
    warm_up = None
    if config.get("warm_up") is not None:
        try:
            warm_up = _test(config["warm_up"], "warm_up", make)  # type: ignore[arg-type]
        except DesignError as error:
            wrong.append(error.below("", "warm_up"))
    if wrong:
        raise DesignError(str(wrong[0]), findings=tuple(found for error in wrong for found in error.findings))
    return TestPlan(tests=tuple(tests), warm_up=warm_up, design=config)


def config_of(test: Test) -> dict[str, JSON]:
    """The configuration that makes ``test`` again: the inverse of ``test_from_config``."""
    return {"name": test.name, **test.excitation.design, **conditions_of(test)}


def conditions_of(test: Test) -> dict[str, JSON]:
    """The keys of a test that belong neither to its name nor to its excitation, without those that have defaults."""
    conditions: dict[str, JSON] = {
        "dwell": test.dwell_s or None,
        "min_temperature": test.min_temperature_degc,
        "max_temperature": test.max_temperature_degc,
        "held_out": test.held_out or None,
        "data_set": test.data_set or None,
        "before": [step_config(step) for step in test.before] or None,
        "on_failure": test.on_failure if test.on_failure != "stop" else None,
        "retries": test.retries if test.retries != 1 else None,
        "energy": test.energy_j,
        "to_temperature": test.to_temperature_degc,
        "limits": None if test.limits is None else to_config(test.limits),
    }
    return {key: value for key, value in conditions.items() if value is not None}


def test_of(name: str, excitation: Excitation, conditions: Mapping[str, JSON]) -> Test:
    """The test of an excitation and of what ``conditions_of`` made; raises DesignError."""
    return _with_conditions(to_spec(TestConditions, {**conditions, "name": name}, f"test {name!r}"), excitation)


test_of.__test__ = False  # type: ignore[attr-defined]
