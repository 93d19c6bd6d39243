"""What api raises on purpose, and one table: from the errors of every package to HTTP status and exit status.

ApiError
├── InputError        the input cannot be used; the message says what, where, the value, what would be right
│   └── SettingsError an environment variable or an option with which the service cannot start
├── TooLarge          a file that is larger than the service keeps
├── NotFound          no such campaign, test, run or job
├── Conflict          it exists, but not in a state in which this can be done
├── StoreError        the store cannot be reached
│   └── NewerStore    a later version of this program made it
├── LeaseLost         another worker holds the rig or the job: this one must stop
└── ProcessError      a process that was started failed
"""

from __future__ import annotations

from dataclasses import dataclass

from excitation.errors import ExcitationError
from identification.errors import IdentificationError, WorkerLost
from rigctl.errors import IdentityError, IterationError, LimitError, RigError, RunFileError, TransportError, UrlError
from sim_rig.errors import FaultError, SimRigError, SkewError, SpecimenError, SpeedError

__all__ = [
    "ApiError",
    "Conflict",
    "InputError",
    "LeaseLost",
    "NewerStore",
    "NotFound",
    "Outcome",
    "ProcessError",
    "SettingsError",
    "StoreError",
    "TooLarge",
    "one_line",
    "outcome_of",
]


class ApiError(Exception):
    """Everything that api raises on purpose."""


class InputError(ApiError, ValueError):
    """The input cannot be used."""


class SettingsError(InputError):
    """The service cannot start with this setting."""


class TooLarge(ApiError):
    """A file that is larger than the service keeps."""


class NotFound(ApiError, LookupError):
    """There is no such campaign, test, run or job."""


class Conflict(ApiError):
    """It exists, but its state does not allow this."""


class StoreError(ApiError):
    """The store cannot be reached."""


class NewerStore(StoreError):
    """The store was made by a later version of this program."""


class LeaseLost(ApiError):
    """The lease on the rig or the job went to another worker."""


class ProcessError(ApiError):
    """A process that was started failed."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What an error becomes: a status over HTTP, and the exit status of a command."""

    http_status: int
    exit_status: int


_BAD_INPUT = Outcome(422, 2)

# The first class that fits counts: subclasses stand before their base class.
OUTCOMES: tuple[tuple[type[Exception], Outcome], ...] = (
    (NotFound, Outcome(404, 2)),
    (Conflict, Outcome(409, 1)),
    (TooLarge, Outcome(413, 2)),
    (InputError, _BAD_INPUT),
    (NewerStore, Outcome(503, 2)),
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
    """What ``error`` becomes; None for an error that no package raises on purpose: a fault of this program."""
    return next((outcome for kind, outcome in OUTCOMES if isinstance(error, kind)), None)


def one_line(error: BaseException) -> str:
    """The message of an error on one line; its class where it has no message."""
    return " ".join(str(error).split()) or type(error).__name__
