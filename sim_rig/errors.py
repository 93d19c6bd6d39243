"""What sim_rig raises on purpose.

SimRigError
├── SpecimenError    a specimen or an effect that does not exist
├── FaultError       a fault that cannot be ordered
├── SkewError        a skew of an unknown channel, or of an impossible delay
├── SpeedError       a speed that is not positive
└── RequestRefused   a request that the rig's state does not allow; the wire answers with its own refusal
"""

from __future__ import annotations


class SimRigError(Exception):
    """Everything sim_rig raises on purpose."""


class SpecimenError(SimRigError, ValueError):
    """A specimen or an effect that does not exist, or an impossible size."""


class FaultError(SimRigError, ValueError):
    """A fault that cannot be ordered: it does not exist, or its value is impossible."""


class SkewError(SimRigError, ValueError):
    """A skew of an unknown channel, or of an impossible delay."""


class SpeedError(SimRigError, ValueError):
    """A speed that is not positive."""


class RequestRefused(SimRigError):
    """A request that the rig's state does not allow."""
