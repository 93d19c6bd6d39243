"""What rigctl raises on purpose.

RigError
├── UrlError             the rig's address cannot be used
├── MapError             the map of a foreign controller cannot be used
├── IdentityError        the device is not a rig that this program can drive
├── LimitError           a test would leave the limits of the rig or of the host
├── TransportError       the wire failed: the rig's state is unknown until it is read again
│   ├── TransportTimeout no answer before the deadline
│   └── RequestDenied    the rig understood and refused; a repetition changes nothing
├── InterlockTripped     an interlock of the host ended the test
├── RigFault             the rig stopped on its own and says why
├── NeedsReset           the rig has latched a fault: only an operator resets it
├── RigOccupied          another host commands the rig
├── SessionLost          the rig no longer obeys this host: it was stopped by somebody else, or restarted
├── IterationError       a drive-file iteration that cannot be done with these numbers
├── NotFollowing         a measured channel is far from its command: nothing to correct, something to repair
├── GateError            a temperature gate or another condition was not met before its deadline
│   └── TooCold          the damper has to be warmed up first
├── ProcedureError       a laboratory procedure (tare, mounting, weighing …) refused its result
│   └── Declined         the operator did not confirm
├── CalibrationError     a calibration record cannot be used
│   └── CalibrationExpired  it has expired
├── StopFailed           the stop was not acknowledged: the rig may still be powered
├── AlignmentError       two records cannot be put on one clock
├── ForeignFileError     a file of another program cannot be made into a run file
└── RunFileError         a run file cannot be used
"""

from __future__ import annotations

from pathlib import Path


class RigError(Exception):
    """Everything rigctl raises on purpose; `run_path` is the run file that was closed, if any."""

    run_path: Path | None = None


class UrlError(RigError, ValueError):
    """The rig's address cannot be used."""


class MapError(RigError, ValueError):
    """The map of a foreign controller cannot be used."""


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


class ProcedureError(RigError):
    """A laboratory procedure refused its result; the rig is at rest."""


class Declined(ProcedureError):
    """The operator did not confirm."""


class CalibrationError(RigError, ValueError):
    """A calibration record cannot be used."""


class CalibrationExpired(CalibrationError):
    """A calibration record has expired."""


class StopFailed(RigError):
    """The stop was not acknowledged: the rig may still be powered."""


class RunFileError(RigError, ValueError):
    """A run file cannot be used: damaged, foreign or inconsistent."""


class NeedsReset(RigError):
    """The rig has latched a fault; only an operator resets it, after a look at the rig (ISO 13850, ISO 12100)."""


class RigOccupied(RigError):
    """Another host commands the rig; nothing was sent that could disturb it."""


class SessionLost(RigError):
    """The rig no longer obeys this host: somebody else stopped or claimed it, or it was restarted."""


class IterationError(RigError, ValueError):
    """A drive-file iteration that cannot be done with these numbers."""


class NotFollowing(RigError):
    """A measured channel is far from its command: a sensor's sign, scale or zero is wrong."""


class AlignmentError(RigError, ValueError):
    """Two records cannot be put on one clock."""


class ForeignFileError(RigError, ValueError):
    """A file of another program cannot be made into a run file as it is."""
