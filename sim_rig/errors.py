"""What sim_rig raises on purpose.

SimRigError
├── SpecimenError    a specimen or an effect that does not exist
├── FaultError       a fault that cannot be ordered
├── SkewError        a skew that no channel can have
├── SpeedError       a speed at which no clock runs
└── RequestRefused   a request that the rig's state does not allow; the wire answers with its own refusal
"""

from __future__ import annotations


class SimRigError(Exception):
    """Everything sim_rig raises on purpose."""


class SpecimenError(SimRigError, ValueError):
    """A specimen or an effect that does not exist, or a size that cannot be."""


class FaultError(SimRigError, ValueError):
    """A fault that cannot be ordered: it does not exist, or its value cannot be."""


class SkewError(SimRigError, ValueError):
    """A skew of a channel that does not exist, or of a delay that cannot be."""


class SpeedError(SimRigError, ValueError):
    """A speed at which no clock runs."""


class RequestRefused(SimRigError):
    """A request that the rig's state does not allow."""
