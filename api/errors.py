"""What the doors raise on purpose, and one table: our errors of every room to HTTP status and exit status.

DoorError
├── InputError        what was asked for cannot be used: says what, where, the value, what would be right
│   └── SettingsError an environment variable or an option that the service cannot start with
├── TooLarge          a file that is larger than the service keeps
├── NotFound          no such campaign, test, run or explanation
├── Conflict          it exists, but not in a state in which this can be done
├── StoreError        the campaign store cannot be reached or is of another version
├── LeaseLost         another worker holds the rig by now: this one must stop
└── ProcessError      a process that was started did not do what it was started for
"""

from __future__ import annotations

from dataclasses import dataclass

from excitation.errors import ExcitationError
from identification.errors import IdentificationError, WorkerLost
from rigctl.errors import IdentityError, IterationError, LimitError, RigError, RunFileError, TransportError, UrlError
from sim_rig.errors import FaultError, SimRigError, SkewError, SpecimenError, SpeedError

__all__ = [
    "Conflict",
    "DoorError",
    "InputError",
    "LeaseLost",
    "NotFound",
    "Outcome",
    "ProcessError",
    "SettingsError",
    "StoreError",
    "TooLarge",
    "one_line",
    "outcome_of",
]


class DoorError(Exception):
    """Everything the doors raise on purpose."""


class InputError(DoorError, ValueError):
    """What was asked for cannot be used."""


class SettingsError(InputError):
    """The service cannot start with this setting."""


class TooLarge(DoorError):
    """More bytes than the service keeps in one file."""


class NotFound(DoorError, LookupError):
    """There is no such campaign, test or run."""


class Conflict(DoorError):
    """It exists, but its state does not allow this."""


class StoreError(DoorError):
    """The campaign store cannot be reached or is of another version."""


class LeaseLost(DoorError):
    """The lease on the rig ran out or went to another worker."""


class ProcessError(DoorError):
    """A process that was started did not do what it was started for."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an error leaves the house: over HTTP, and as the exit status of a command."""

    http_status: int
    exit_status: int


_BAD_INPUT = Outcome(422, 2)

# The first class that fits counts: the narrower stands above the wider.
OUTCOMES: tuple[tuple[type[Exception], Outcome], ...] = (
    (NotFound, Outcome(404, 2)),
    (Conflict, Outcome(409, 1)),
    (TooLarge, Outcome(413, 2)),
    (InputError, _BAD_INPUT),
    (StoreError, Outcome(503, 1)),
    (WorkerLost, Outcome(503, 1)),
    (LeaseLost, Outcome(503, 1)),
    (ProcessError, Outcome(500, 1)),
    (ExcitationError, _BAD_INPUT),
    (IdentificationError, _BAD_INPUT),
    (UrlError, _BAD_INPUT),
    (LimitError, _BAD_INPUT),
    (IterationError, _BAD_INPUT),
    (RunFileError, _BAD_INPUT),
    (SpecimenError, _BAD_INPUT),
    (FaultError, _BAD_INPUT),
    (SkewError, _BAD_INPUT),
    (SpeedError, _BAD_INPUT),
    (IdentityError, Outcome(502, 1)),
    (TransportError, Outcome(504, 1)),
    (RigError, Outcome(502, 1)),
    (SimRigError, Outcome(502, 1)),
    (OSError, Outcome(500, 1)),
)


def outcome_of(error: BaseException) -> Outcome | None:
    """How ``error`` leaves the house; None where it is not one of ours: a fault of the program."""
    return next((outcome for kind, outcome in OUTCOMES if isinstance(error, kind)), None)


def one_line(error: BaseException) -> str:
    """The message of an error on one line; its class where it has no message."""
    return " ".join(str(error).split()) or type(error).__name__
