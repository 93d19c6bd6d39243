"""What the service answers, as far as a client uses it; keys that a later service adds are ignored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from api.errors import ServiceError, one_line

__all__ = [
    "ENDED",
    "Campaign",
    "Rig",
    "RigStop",
    "RunFile",
    "Test",
    "campaign_of",
    "campaigns_of",
    "rig_of",
    "rig_stop_of",
    "rigs_of",
    "runs_of",
]

Answer = TypeVar("Answer")

ENDED = ("done", "failed", "aborted")  # states of a campaign that are final


@dataclass(frozen=True, slots=True, kw_only=True)
class Test:
    """One test of a campaign and its progress."""

    __test__ = False  # the name starts with "Test": pytest must not collect it

    name: str
    kind: str
    held_out: bool
    state: str
    phase: str
    samples: int
    total_samples: int
    duration_s: float

    @property
    def done(self) -> float:
        """The share that was played, 0 … 1."""
        if self.state in ("waiting", "running"):
            return min(1.0, self.samples / self.total_samples) if self.total_samples else 0.0
        return 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """One campaign; ``created``, ``started`` and ``ended`` are ISO 8601 in UTC.

    The answer to a stop that was given without the store has only the keys without a default.
    """

    id: str
    rig: str
    state: str
    reason: str
    asked: str
    number: int = 0
    name: str = ""
    specimen: str = ""
    question: str = ""
    created: str = ""
    started: str | None = None
    ended: str | None = None
    tests: tuple[Test, ...] = ()

    @property
    def has_ended(self) -> bool:
        return self.state in ENDED

    @property
    def rig_time_s(self) -> float:
        """Rig time of all tests, in seconds."""
        return sum(test.duration_s for test in self.tests)

    @property
    def left_s(self) -> float:
        """Rig time of what is not played yet, in seconds; settling and questions come on top. 0 at its end."""
        return 0.0 if self.has_ended else sum((1.0 - test.done) * test.duration_s for test in self.tests)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFile:
    """One captured run; ``file`` is the path of its download."""

    id: str
    test: str
    held_out: bool
    status: str
    samples: int
    sample_rate_hz: float
    size_bytes: int
    sha256: str
    file: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """One rig; ``paused``: why no campaign starts, None where its queue runs; ``state``: what is known of it."""

    url: str
    worker: str | None
    running: str | None
    accepted: int
    paused: str | None
    paused_since: str | None
    id: str = ""
    name: str = ""
    serial: str = ""
    state: str = ""
    state_text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RigStop:
    """What came of a stop of a rig: ``by`` whom; ``safe``: at rest without current, None where that is not said."""

    rig: str
    address: str
    acknowledged: bool
    by: str
    safe: bool | None = None
    text: str = ""


_RIG_STOP = TypeAdapter(RigStop)
_CAMPAIGN, _CAMPAIGNS = TypeAdapter(Campaign), TypeAdapter(tuple[Campaign, ...])
_RIG, _RIGS, _RUNS = TypeAdapter(Rig), TypeAdapter(tuple[Rig, ...]), TypeAdapter(tuple[RunFile, ...])


def campaign_of(answer: Any) -> Campaign:
    """Any: JSON. Raises ServiceError where it is no campaign; the others below likewise."""
    return _read(_CAMPAIGN, answer)


def campaigns_of(answer: Any) -> tuple[Campaign, ...]:
    return _read(_CAMPAIGNS, answer["campaigns"])


def rig_of(answer: Any) -> Rig:
    return _read(_RIG, answer)


def rigs_of(answer: Any) -> tuple[Rig, ...]:
    return _read(_RIGS, answer["rigs"])


def rig_stop_of(answer: Any) -> RigStop:
    return _read(_RIG_STOP, answer)


def runs_of(answer: Any) -> tuple[RunFile, ...]:
    return _read(_RUNS, answer["runs"])


def _read(adapter: TypeAdapter[Answer], answer: Any) -> Answer:
    try:
        return adapter.validate_python(answer)
    except ValidationError as error:
        raise ServiceError(f"the service gave an answer that this client cannot read: {one_line(error)}") from error
