"""A campaign as it is requested: checked whole before anything is stored."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

from api.errors import InputError
from excitation import TestPlan, plan_from_config
from rigctl.interlocks import interlock
from rigctl.player import connect

__all__ = ["NewCampaign", "check_text"]

_MOST_TESTS = 500
_MOST_INTERLOCKS = 50
_MOST_RIG_TIME_S = 7 * 86400.0


@dataclass(frozen=True, kw_only=True)
class NewCampaign:
    """A body of POST /v1/campaigns: tests in order, on one rig, with one specimen.

    ``warm_up`` is played, and not recorded, while the damper is too cold for the next test's gate. ``interlocks`` are
    texts as :func:`rigctl.interlocks.interlock` reads them, for example ``force:-8e3:8e3:stop:0.01``.

    Raises InputError, DesignError, LimitError or UrlError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    name: str
    rig: str
    specimen: str
    tests: list[dict[str, Any]] = field(repr=False)  # any JSON: excitation checks it
    warm_up: dict[str, Any] | None = field(default=None, repr=False)
    interlocks: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        for key, longest in (("name", 200), ("specimen", 200), ("rig", 500)):
            check_text(key, getattr(self, key), longest)
        if not 0 < len(self.tests) <= _MOST_TESTS:
            raise InputError(f"tests has {len(self.tests)} entries: a campaign has 1 … {_MOST_TESTS}")
        if len(self.interlocks) > _MOST_INTERLOCKS:
            raise InputError(f"interlocks has {len(self.interlocks)} entries: at most {_MOST_INTERLOCKS}")
        for text in self.interlocks:
            check_text("interlock", text, 100)
            interlock(text)
        connect(self.rig).close()  # checks the address; sends nothing
        for test in self.plan.tests:
            check_text("test name", test.name, 200)
        if self.plan.duration_s > _MOST_RIG_TIME_S:
            raise InputError(
                f"tests take {self.plan.duration_s:.3g} s of rig time: at most {_MOST_RIG_TIME_S:g} s a campaign"
            )

    @cached_property
    def plan(self) -> TestPlan:
        warm_up = {} if self.warm_up is None else {"warm_up": self.warm_up}
        return plan_from_config({"tests": self.tests, **warm_up})


def check_text(key: str, value: str, longest: int) -> None:
    """Raise InputError where a text is empty, too long or not printable."""
    if not value.strip() or len(value) > longest or not value.isprintable():
        raise InputError(f"{key} is {_shown(value)}: it must be 1 … {longest} printable characters")


def _shown(value: object) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."
