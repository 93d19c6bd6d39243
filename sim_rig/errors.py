"""What sim_rig raises on purpose.

SimRigError
├── SpecimenError    a specimen or an effect that does not exist
└── RequestRefused   a request that the rig's state does not allow; the wire answers with its own refusal
"""

from __future__ import annotations


class SimRigError(Exception):
    """Everything sim_rig raises on purpose."""


class SpecimenError(SimRigError, ValueError):
    """A specimen or an effect that does not exist, or a size that cannot be."""


class RequestRefused(SimRigError):
    """A request that the rig's state does not allow."""
