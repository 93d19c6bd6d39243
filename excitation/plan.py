"""Tests in the order in which a rig plays them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from excitation.configuration import STRICT, to_spec
from excitation.errors import DesignError
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = ["Test", "TestPlan", "config_of", "plan_from_config", "test_from_config"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Test:
    """One excitation with a name and the conditions under which it may start.

    The gate: the test starts only while the damper's temperature lies within [min, max]. ``dwell_s`` is the
    rest before the test. ``held_out``: reserved for validation; ``data_set`` is the name of the set it belongs to
    ("training", "test 1"; empty where it has none).
    """

    __test__ = False  # the name starts with "Test": pytest must not collect it

    name: str
    excitation: Excitation
    dwell_s: float = 0.0
    min_temperature_degc: float | None = None
    max_temperature_degc: float | None = None
    held_out: bool = False
    data_set: str = ""

    def __post_init__(self) -> None:
        if not self.name.strip() or any(ord(c) < 32 for c in self.name):
            raise DesignError(f"name is {self.name!r}: a test needs a printable name")
        if not 0 <= self.dwell_s < float("inf"):
            raise DesignError(f"test {self.name!r}: dwell is {self.dwell_s} s: it must be zero or more")
        low, high = self.min_temperature_degc, self.max_temperature_degc
        if low is not None and high is not None and not low < high:
            raise DesignError(f"test {self.name!r}: min_temperature is {low} °C: it must lie below max ({high} °C)")


@dataclass(frozen=True, slots=True, kw_only=True)
class TestPlan:
    """Tests with unique names, in order; ``warm_up`` is repeated while the next test's gate is too cold."""

    __test__ = False

    tests: tuple[Test, ...]
    warm_up: Test | None = None
    design: Mapping[str, JSON] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.tests:
            raise DesignError("tests is empty: a plan needs at least one test")
        twice = [name for name, count in Counter(test.name for test in self.tests).items() if count > 1]
        if twice:
            raise DesignError(f"tests: the name {twice[0]!r} occurs more than once: every test needs its own name")

    @property
    def duration_s(self) -> float:
        return sum(test.excitation.duration_s + test.dwell_s for test in self.tests)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Conditions:
    """The keys of a test that do not belong to its excitation."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    dwell_s: float = 0.0
    min_temperature_degc: float | None = None
    max_temperature_degc: float | None = None
    held_out: bool = False
    data_set: str = ""


_CONDITION_KEYS = frozenset({"name", "dwell", "min_temperature", "max_temperature", "held_out", "data_set"})


def test_from_config(config: Mapping[str, JSON]) -> Test:
    """The test that a configuration (TOML table, JSON object) describes.

    Keys: name, kind and the parameters of the kind; optionally held_out, data_set, dwell (s), min_temperature
    and max_temperature (°C).

    Raises DesignError: one line with the test's name, the key, the value and what would be right.
    """
    return _test(config, "test")


def _test(config: Mapping[str, JSON], where: str) -> Test:
    if not isinstance(config, Mapping):
        raise DesignError(f"{where} is {config!r}: it must be a table with name, kind and parameters")
    conditions = to_spec(_Conditions, {k: v for k, v in config.items() if k in _CONDITION_KEYS}, where)
    parameters = {k: v for k, v in config.items() if k not in _CONDITION_KEYS}
    return Test(
        name=conditions.name,
        excitation=excitation_from_config(parameters, f"test {conditions.name!r}"),
        dwell_s=conditions.dwell_s,
        min_temperature_degc=conditions.min_temperature_degc,
        max_temperature_degc=conditions.max_temperature_degc,
        held_out=conditions.held_out,
        data_set=conditions.data_set,
    )


test_from_config.__test__ = False  # type: ignore[attr-defined]  # pytest must not collect it


def plan_from_config(config: Mapping[str, JSON]) -> TestPlan:
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
    warm_up = config.get("warm_up")
    return TestPlan(
        tests=tuple(_test(entry, f"tests[{n}]") for n, entry in enumerate(entries)),
        warm_up=None if warm_up is None else _test(warm_up, "warm_up"),  # type: ignore[arg-type]
        design=config,
    )


def config_of(test: Test) -> dict[str, JSON]:
    """The configuration that makes ``test`` again: the inverse of ``test_from_config``."""
    config: dict[str, JSON] = {"name": test.name, **test.excitation.design}
    if test.dwell_s:
        config["dwell"] = test.dwell_s
    if test.min_temperature_degc is not None:
        config["min_temperature"] = test.min_temperature_degc
    if test.max_temperature_degc is not None:
        config["max_temperature"] = test.max_temperature_degc
    if test.held_out:
        config["held_out"] = True
    if test.data_set:
        config["data_set"] = test.data_set
    return config
