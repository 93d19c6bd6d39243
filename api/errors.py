"""What api raises on purpose, and one table: from the errors of every package to HTTP status and exit status.

ApiError
├── InputError        the input cannot be used; the message says what, where, the value, what would be right
│   └── SettingsError an environment variable or an option with which the service cannot start
├── TooLarge          a file that is larger than the service keeps
├── TooSlow           a body that does not come
├── DiskFull          no space on the disk, or none left of what is set aside
├── Busy              too much at once: the same request succeeds later
├── NotFound          no such campaign, test, run or job
│   └── Gone          it was removed
├── Changed           it is not what the client has read
├── Conflict          it exists, but not in a state in which this can be done
├── StoreError        the store cannot be reached
│   └── NewerStore    a later version of this program made it
├── LeaseLost         another worker holds the rig or the job: this one must stop
└── ProcessError      a process that was started failed
    └── ServiceError  a service does not answer, or cannot do now what a client wants of it
"""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Final

from excitation.errors import ExcitationError
from identification.errors import IdentificationError, WorkerLost
from rigctl.errors import (
    CalibrationError,
    ForeignFileError,
    IdentityError,
    IterationError,
    LimitError,
    RigError,
    RunFileError,
    TransportError,
    UrlError,
)
from sim_rig.errors import FaultError, SimRigError, SkewError, SpecimenError, SpeedError

__all__ = [
    "TOO_FEW_FILES",
    "TOO_MANY_OPEN",
    "ApiError",
    "Busy",
    "Changed",
    "Conflict",
    "DiskFull",
    "Gone",
    "InputError",
    "LeaseLost",
    "Needed",
    "NewerStore",
    "NotFound",
    "Outcome",
    "ProcessError",
    "ServiceError",
    "SettingsError",
    "StoreError",
    "TooLarge",
    "TooSlow",
    "one_line",
    "outcome_of",
]


TOO_FEW_FILES: Final = (errno.EMFILE, errno.ENFILE)  # of an OSError: for this process, for the whole computer
_LONGEST: Final = 3000  # characters of a message: twice the list of all elements, the longest that we say
_END: Final = 500  # of them from its end, where the cure stands
TOO_MANY_OPEN: Final = "the service has too many files open: try again"


class ApiError(Exception):
    """Everything that api raises on purpose."""


class InputError(ApiError, ValueError):
    """The input cannot be used."""


class SettingsError(InputError):
    """The service cannot start with this setting."""


class TooLarge(ApiError):
    """A file that is larger than the service keeps."""


class TooSlow(ApiError):
    """The body of a request did not come in time, or not to its end."""


class DiskFull(ApiError):
    """No space on the disk, or none left of what is set aside. The message names no folder: it is shown to clients."""


class Busy(ApiError):
    """Too much at once; the message is shown to clients, who may try again after ``retry_after_s``."""

    def __init__(self, message: str, *, retry_after_s: int) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class NotFound(ApiError, LookupError):
    """There is no such campaign, test, run or job."""


class Gone(NotFound):
    """It was there and has been removed."""


class Conflict(ApiError):
    """It exists, but its state does not allow this."""


class Changed(ApiError):
    """It is not what the caller has seen."""


class Needed(ApiError):
    """A precondition that this request needs is missing."""


class StoreError(ApiError):
    """The store cannot be reached."""


class NewerStore(StoreError):
    """The store was made by a later version of this program."""


class LeaseLost(ApiError):
    """The lease on the rig or the job went to another worker."""


class ProcessError(ApiError):
    """A process that was started failed."""


class ServiceError(ProcessError):
    """A service does not answer a client, or cannot do now what it wants."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What an error becomes: a status over HTTP, and the exit status of a command."""

    http_status: int
    exit_status: int


_BAD_INPUT = Outcome(422, 2)

# The first class that fits counts: subclasses stand before their base class.
OUTCOMES: tuple[tuple[type[Exception], Outcome], ...] = (
    (Gone, Outcome(410, 2)),
    (NotFound, Outcome(404, 2)),
    (Changed, Outcome(412, 1)),
    (Conflict, Outcome(409, 1)),
    (Needed, Outcome(428, 1)),
    (TooLarge, Outcome(413, 2)),
    (TooSlow, Outcome(408, 1)),
    (DiskFull, Outcome(507, 1)),
    (Busy, Outcome(503, 1)),
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
    (CalibrationError, _BAD_INPUT),
    (ForeignFileError, _BAD_INPUT),
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
    """The message of an error on one line; its class where it has no message.

    What a file or a request says may stand in it: control characters are written out, so that no terminal obeys them,
    and the middle of what is very long is left out.
    """
    text = " ".join(str(error).split()) or type(error).__name__
    text = "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in text)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - _END]} … {text[-_END:]}"
