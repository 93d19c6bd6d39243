"""Tests in the order in which a rig plays them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from excitation.errors import DesignError
from excitation.signal import JSON, Excitation

__all__ = ["Test", "TestPlan"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Test:
    """One excitation with a name and the conditions under which it may start.

    The gate: the test starts only while the damper's temperature lies within [min, max]. ``dwell_s`` is the
    rest before the test. ``held_out``: kept back for validation; ``data_set`` is the set it belongs to by
    name ("training", "test 1"; empty where it has none).
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
            raise DesignError(
                f"test {self.name!r}: min_temperature is {low} °C: it must lie below max ({high} °C)"
            )


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
            raise DesignError(
                f"tests: the name {twice[0]!r} occurs more than once: every test needs its own name"
            )

    @property
    def duration_s(self) -> float:
        return sum(test.excitation.duration_s + test.dwell_s for test in self.tests)
