"""What rigctl raises on purpose.

RigError
├── UrlError             the rig's address cannot be used
├── IdentityError        the device is not a rig that this program can drive
├── LimitError           a test would leave the limits of the rig or of the host
├── TransportError       the wire failed: the rig's state is unknown until it is read again
│   ├── TransportTimeout no answer before the deadline
│   └── RequestDenied    the rig understood and refused; a repetition changes nothing
├── InterlockTripped     an interlock of the host ended the test
├── RigFault             the rig stopped on its own and says why
├── IterationError       a drive-file iteration that cannot be done with these numbers
├── GateError            a temperature gate or another condition was not met before its deadline
│   └── TooCold          the damper has to be warmed up first
├── StopFailed           the stop was not acknowledged: the rig may still be powered
└── RunFileError         a run file cannot be used
"""

from __future__ import annotations

from pathlib import Path


class RigError(Exception):
    """Everything rigctl raises on purpose; `run_path` is the run file that was closed, if any."""

    run_path: Path | None = None


class UrlError(RigError, ValueError):
    """The rig's address cannot be used."""


class IdentityError(RigError):
    """The device is not a rig that this program can drive."""


class LimitError(RigError, ValueError):
    """A test would leave the limits of the rig or of the host; nothing has moved."""


class TransportError(RigError):
    """The wire failed: the rig's state is unknown until it is read again."""


class TransportTimeout(TransportError, TimeoutError):
    """No answer before the deadline."""


class RequestDenied(TransportError):
    """The rig understood the request and refused it; a repetition changes nothing."""


class RigFault(RigError):
    """The rig stopped on its own and says why."""


class GateError(RigError):
    """A temperature gate or another condition was not met before its deadline."""


class TooCold(GateError):
    """The damper is colder than the test's gate: waiting does not help, a warm-up does."""


class InterlockTripped(RigError):
    """An interlock of the host ended the test."""


class StopFailed(RigError):
    """The stop was not acknowledged: the rig may still be powered."""


class RunFileError(RigError, ValueError):
    """A run file cannot be used: damaged, foreign or inconsistent."""


class IterationError(RigError, ValueError):
    """A drive-file iteration that cannot be done with these numbers."""
