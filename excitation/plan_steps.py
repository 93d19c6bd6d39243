"""Steps of a plan before a test, which a person or the rig does without motion; and what follows where one fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias, get_args

from excitation.checks import check_above, check_one_of, check_within
from excitation.configuration import STRICT, to_config, to_spec
from excitation.errors import DesignError
from excitation.signal import JSON

__all__ = ["FAILURES", "STEPS", "Gate", "OnFailure", "Prompt", "Step", "Tare", "step_config", "steps_from_config"]

OnFailure: TypeAlias = Literal["stop", "skip", "retry"]
FAILURES: tuple[str, ...] = get_args(OnFailure)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prompt:
    """The operator is told something and confirms it; without confirmation the plan ends."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    text: str

    def __post_init__(self) -> None:
        if not self.text.strip() or len(self.text) > 500 or not self.text.isprintable():
            raise DesignError(f"text is {self.text!r:.60}: a prompt is 1 … 500 printable characters")


@dataclass(frozen=True, slots=True, kw_only=True)
class Tare:
    """The load cell is read at rest without load; a larger reading than the limit is refused."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    limit_n: float | None = None  # default: a share of the rig's force limit
    readings: int = 200

    def __post_init__(self) -> None:
        check_within("readings", self.readings, 20, 100_000)
        if self.limit_n is not None:
            check_above("limit", self.limit_n, 0.0, "N")


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """A temperature must lie within [min, max]: of the oil, as the rig measures it, or of the room, as a person reads.

    The oil may cool down for ``wait_s``; the room is read once.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    of: Literal["oil", "ambient"]
    min_degc: float | None = None
    max_degc: float | None = None
    wait_s: float = 0.0

    def __post_init__(self) -> None:
        check_one_of("of", self.of, ("oil", "ambient"))
        check_within("wait", self.wait_s, 0.0, 86400.0, "s")
        low, high = self.min_degc, self.max_degc
        if low is None and high is None:
            raise DesignError(f"gate of {self.of}: give min, max or both, °C")
        if low is not None and high is not None and not low < high:
            raise DesignError(f"gate of {self.of}: min is {low:g} °C: it must lie below max ({high:g} °C)")

    def __str__(self) -> str:
        low = "" if self.min_degc is None else f" from {self.min_degc:g} °C"
        high = "" if self.max_degc is None else f" up to {self.max_degc:g} °C"
        return f"{self.of} temperature{low}{high}"

    def passes(self, degc: float) -> bool:
        return (self.min_degc is None or degc >= self.min_degc) and (self.max_degc is None or degc <= self.max_degc)


Step: TypeAlias = Prompt | Tare | Gate
STEPS: Mapping[str, type[Prompt] | type[Tare] | type[Gate]] = {"prompt": Prompt, "tare": Tare, "gate": Gate}


def steps_from_config(entries: JSON, where: str) -> tuple[Step, ...]:
    """The steps in a list of tables, each with ``step`` = prompt, tare or gate and its own keys.

    Raises DesignError: one line.
    """
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise DesignError(f"{where} is {entries!r:.60}: it must be a list of tables")
    return tuple(_step(entry, f"{where}[{n}]") for n, entry in enumerate(entries))


def _step(entry: JSON, where: str) -> Step:
    if not isinstance(entry, Mapping):
        raise DesignError(f"{where} is {entry!r:.60}: it must be a table with the key step")
    kind = entry.get("step")
    check_one_of(f"{where}: step", kind, tuple(STEPS))
    return to_spec(STEPS[str(kind)], {key: value for key, value in entry.items() if key != "step"}, where)


def step_config(step: Step) -> dict[str, JSON]:
    """The table that makes the step again."""
    kind = next(name for name, one in STEPS.items() if type(step) is one)
    return {"step": kind, **to_config(step)}
